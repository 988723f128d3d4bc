"""Pieces of a text exchanged where they stand: every other byte stays as it is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from urdfkin.errors import InputError


@dataclass(frozen=True, slots=True)
class Edit:
    """The bytes from `start` up to `end` become `text`; nothing is replaced where the two are one."""

    start: int
    end: int
    text: str = ""


def edited(data: bytes, edits: Iterable[Edit]) -> bytes:
    """The text with all edits made.

    >>> edited(b"a=1 b=2", [Edit(6, 7, "3"), Edit(2, 3, "10")])
    b'a=10 b=3'

    Raises:
        InputError: two of them overlap.
    """
    parts, cursor = list[bytes](), 0
    for edit in sorted(edits, key=lambda one: (one.start, one.end)):
        if edit.start < cursor:
            raise InputError("two edits of one place", found=f"byte {edit.start}")
        parts += [data[cursor : edit.start], edit.text.encode()]
        cursor = edit.end
    return b"".join([*parts, data[cursor:]])
