"""`Rule`: a kind of finding, with its code and severity. `lint.pages` has the page of each rule."""

from __future__ import annotations

from dataclasses import dataclass

from urdfkin.lint.finding import PinocchioReading, Severity

ERROR, WARNING, NOTE = Severity.ERROR, Severity.WARNING, Severity.NOTE
REFUSES, DIFFERS = PinocchioReading.REFUSES, PinocchioReading.DIFFERS


@dataclass(frozen=True, slots=True)
class Rule:
    """A kind of finding.

    Attributes:
        id: The code: `URDF` and three digits. A code is never reused. The first digit is the family:
            1 text and XML, 2 dialect and elements, 3 numbers, 4 names and structure, 5 joints, 6 suspicious,
            7 inertials, geometry and materials.
        slug: The short name.
        severity: The default severity of its findings.
        oracle: Pinocchio's behaviour, if it differs from the specification.
    """

    id: str
    slug: str
    severity: Severity
    oracle: PinocchioReading | None = None
