"""Parts of scripts/fuzz.py: how robots are made, and what is asked of each."""

from dataclasses import dataclass

#: What happens to a table that can be read.
COMPARED = "read and compared"
#: What may happen to a robot.
GOOD = (
    "refused",
    "verified",
    "not verified, with a finding that says why",
    "too large to compute, with a finding",
    COMPARED,
)


@dataclass(frozen=True, slots=True)
class Case:
    """A document, how it is to be loaded, and in words how it was made."""

    what: str
    data: bytes
    root_joint: str | None = None
    mimic: bool | None = None
    suffix: str = ".urdf"

    @property
    def words(self) -> str:
        """One line for the note beside a file that is kept."""
        options = f"root_joint={self.root_joint!r}, mimic={self.mimic!r}"
        return f"{self.what}; load(..., {options})"
