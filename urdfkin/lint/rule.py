"""What a rule is: the code that its findings carry, and how bad they are. Its page is in `lint.pages`."""

from __future__ import annotations

from dataclasses import dataclass

from urdfkin.lint.finding import PinocchioReading, Severity

ERROR, WARNING, NOTE = Severity.ERROR, Severity.WARNING, Severity.NOTE
REFUSES, DIFFERS = PinocchioReading.REFUSES, PinocchioReading.DIFFERS


@dataclass(frozen=True, slots=True)
class Rule:
    """One kind of finding.

    Attributes:
        id: `URDF` and three digits; never used again for anything else. The first digit tells the family:
            1 text and XML, 2 dialect and elements, 3 numbers, 4 names and structure, 5 joints, 6 suspicious,
            7 inertials, geometry and materials.
        slug: A short name in words.
        severity: How bad it is unless a finding says otherwise.
        oracle: What Pinocchio does when it departs from the specification.
    """

    id: str
    slug: str
    severity: Severity
    oracle: PinocchioReading | None = None
