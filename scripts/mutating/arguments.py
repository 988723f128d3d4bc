"""The mutants that docs/mutation.md lists as harmless: no test detects them, and no test is needed."""

from __future__ import annotations

import re
from functools import cache

from scripts.mutating.selection import ROOT

#: - `urdfkin.model.tree.build_tree`: `1  ->  2`: the reason.
_ARGUMENT = re.compile(r"^- `(?P<place>[\w.]+)`: `(?P<what>[^`]+)`: (?P<why>\S.+)$", re.MULTILINE)


@cache
def argued() -> dict[tuple[str, str], str]:
    """Return the reason of each harmless mutant, by its function and its text."""
    page = (ROOT / "docs" / "mutation.md").read_text(encoding="utf-8")
    return {(found["place"], found["what"]): found["why"] for found in _ARGUMENT.finditer(page)}
