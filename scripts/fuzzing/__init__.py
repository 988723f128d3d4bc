"""Parts of scripts/fuzz.py: the generation of robots, and the tests of each robot."""

from dataclasses import dataclass

GOOD = (
    "refused",
    "verified",
    "not verified, with a finding that states the reason",
    "too large to compute, with a finding that states the reason",
)


@dataclass(frozen=True, slots=True)
class Case:
    what: str
    data: bytes
    root_joint: str | None = None
    mimic: bool | None = None

    @property
    def words(self) -> str:
        options = f"root_joint={self.root_joint!r}, mimic={self.mimic!r}"
        return f"{self.what}; load(..., {options})"


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of a test; `word` is an element of `GOOD` if the test passed, else it names the failure."""

    word: str
    details: str = ""
