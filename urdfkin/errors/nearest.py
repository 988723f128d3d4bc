"""Names that look like another, found in bounded time."""

from __future__ import annotations

import difflib
import heapq
from collections.abc import Iterable

#: Characters of a name that are compared.
_COMPARED = 128

#: Pairs of characters that are compared for one word, after what tells at a glance that names differ.
WORK = 1_000_000
#: How many names are offered.
_OFFERED = 3


def nearest(word: str, known: Iterable[str], *, cutoff: float = 0.6, work: int = WORK) -> list[str]:
    """Up to three known names that look like `word`, the nearest first, as `difflib.get_close_matches`.

    Args:
        word: What was written.
        known: The names there are.
        cutoff: How alike they must be, from 0 to 1.
        work: Pairs of characters to compare before the search ends with what it has.

    >>> nearest("pandahand", ["panda_hand", "elbow", "base"])
    ['panda_hand']
    """
    begins = word[:_COMPARED]
    matcher = difflib.SequenceMatcher(b=begins)
    found = []
    for name in known:
        matcher.set_seq1(name[:_COMPARED])
        if matcher.real_quick_ratio() < cutoff or matcher.quick_ratio() < cutoff:
            continue
        work -= len(begins) * len(name[:_COMPARED])
        if work < 0:
            break
        if (alike := matcher.ratio()) >= cutoff:
            found.append((alike, name))
    return [name for _, name in heapq.nlargest(_OFFERED, found)]
