"""Mechanical cures: which bytes of a file to put others in place of, and everything else left as it is.

Places count in the bytes that follow a byte order mark, as the findings' lines and columns do.
"""

from __future__ import annotations

import codecs
from collections.abc import Iterable
from dataclasses import dataclass

from urdfkin.system.edits import Edit, edited

#: Radians: what rounding an angle of a turn to a double moves at most.
ROUNDING = 2.0**-50


@dataclass(frozen=True, slots=True)
class Fix:
    """What cures a finding.

    Attributes:
        edits: What to put where, in the order of the file, none into another.
        turns: By how much it may turn the joint's frame, rad; with 0 the robot stays as it is.
    """

    edits: tuple[Edit, ...]
    turns: float = 0.0

    @property
    def is_safe(self) -> bool:
        """Whether it turns no joint by more than the rounding of one number."""
        return self.turns <= ROUNDING


def apply(data: bytes, fixes: Iterable[Fix]) -> tuple[bytes, list[Fix]]:
    """A file with as many fixes as go together, and which these are; one that overlaps another waits.

    >>> apply(b'<axis xyz="0 0 2"/>', [Fix((Edit(11, 16, "0 0 1"),))])[0]
    b'<axis xyz="0 0 1"/>'
    """
    mark = codecs.BOM_UTF8 if data.startswith(codecs.BOM_UTF8) else b""
    taken, end = list[Fix](), 0
    for fix in sorted(fixes, key=lambda fix: fix.edits[0].start):
        if fix.edits[0].start >= end:
            taken.append(fix)
            end = fix.edits[-1].end
    return mark + edited(data.removeprefix(mark), [edit for fix in taken for edit in fix.edits]), taken
