"""A table of words: what the terminal and the page print, each in its way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

#: A row of the figures, as data.
Entry = Mapping[str, Any]


@dataclass(frozen=True)
class Words:
    """One table: its section, what it is of, the columns' heads, the rows; the first column is words."""

    section: str
    title: str
    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    remarks: tuple[str, ...] = ()


def number(x: float) -> str:
    """Three digits, and no power of ten."""
    digits = 2 if x < 10 else 1 if x < 100 else 0
    return f"{x:,.{digits}f}"
