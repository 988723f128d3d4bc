"""Mechanical cures: which bytes of a file to put others in place of, and everything else left as it is.

Places count in the bytes that follow a byte order mark, as the findings' lines and columns do.
"""

from __future__ import annotations

import codecs
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Edit:
    """The bytes from `start` up to `end` become `text`."""

    start: int
    end: int
    text: str = ""


@dataclass(frozen=True, slots=True)
class Fix:
    """What cures a finding.

    Attributes:
        edits: What to put where, in the order of the file, none into another.
        turns: By how much it may turn the joint's frame, rad; with 0 the robot stays as it is.
    """

    edits: tuple[Edit, ...]
    turns: float = 0.0


def apply(data: bytes, fixes: Iterable[Fix]) -> tuple[bytes, list[Fix]]:
    """A file with as many fixes as go together, and which these are; one that overlaps another waits.

    >>> apply(b'<axis xyz="0 0 2"/>', [Fix((Edit(11, 16, "0 0 1"),))])[0]
    b'<axis xyz="0 0 1"/>'
    """
    mark = codecs.BOM_UTF8 if data.startswith(codecs.BOM_UTF8) else b""
    text = data.removeprefix(mark)
    taken: list[Fix] = []
    pieces, cursor = [mark], 0
    for fix in sorted(fixes, key=lambda fix: fix.edits[0].start):
        if fix.edits[0].start < cursor:
            continue
        taken.append(fix)
        for edit in fix.edits:
            pieces += [text[cursor : edit.start], edit.text.encode()]
            cursor = edit.end
    return b"".join([*pieces, text[cursor:]]), taken
