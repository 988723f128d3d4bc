"""Parts of scripts/fuzz.py: the generation of robots, and the tests of each robot."""

from dataclasses import dataclass

PASSED = (
    "refused",
    "verified",
    "not verified; a finding states the reason",
    "too large to compute; a finding states the reason",
)


@dataclass(frozen=True, slots=True)
class Case:
    name: str
    data: bytes
    root_joint: str | None = None
    mimic: bool | None = None

    @property
    def description(self) -> str:
        options = f"root_joint={self.root_joint!r}, mimic={self.mimic!r}"
        return f"{self.name}; load(..., {options})"


@dataclass(frozen=True, slots=True)
class Outcome:
    result: str  # short description; the test failed if it is not in `PASSED`
    details: str = ""
