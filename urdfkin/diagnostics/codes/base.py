"""What a code is: its severity, its page of explanation, and two examples that are run as tests."""

from __future__ import annotations

from dataclasses import dataclass

from urdfkin.diagnostics.finding import PinocchioReading, Severity

ERROR, WARNING, NOTE = Severity.ERROR, Severity.WARNING, Severity.NOTE
REFUSES, DIFFERS = PinocchioReading.REFUSES, PinocchioReading.DIFFERS


@dataclass(frozen=True, slots=True)
class Code:
    """One kind of finding.

    Attributes:
        id: `URDF` and three digits; never used again for anything else.
        slug: A short name in words.
        severity: How bad it is unless a finding says otherwise.
        title: The claim in one line, for tables.
        why: Why it matters to someone who wants numbers.
        bad: A smallest example that has it. A whole document, or the inside of `<robot>`; when it begins
            with a joint, the links `base` and `tip` are there already.
        good: The same example, put right.
        others: What Pinocchio (urdfdom) and yourdfpy do with the bad example.
        oracle: What Pinocchio does when it departs from the specification.
    """

    id: str
    slug: str
    severity: Severity
    title: str
    why: str
    bad: str
    good: str
    others: str
    oracle: PinocchioReading | None = None

    def document(self, example: str) -> str:
        """`bad` or `good` as a whole URDF document."""
        text = example.strip("\n")
        if not text.startswith(("<joint", "<link", "<material")):
            return example
        links = '<link name="base"/>\n<link name="tip"/>\n' if text.startswith("<joint") else ""
        return f'<robot name="example">\n{links}{text}\n</robot>\n'
