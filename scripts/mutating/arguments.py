"""The slips that docs/mutation.md argues: no test notices them, and none needs to."""

from __future__ import annotations

import re
from functools import cache

from scripts.mutating.selection import ROOT

#: - `urdfkin.model.tree.build_tree`: `1  ->  2`: why it does not matter.
_ARGUMENT = re.compile(r"^- `(?P<place>[\w.]+)`: `(?P<what>[^`]+)`: (?P<why>\S.+)$", re.MULTILINE)


@cache
def argued() -> dict[tuple[str, str], str]:
    """Why each does not matter, by the place and the text before and after."""
    page = (ROOT / "docs" / "mutation.md").read_text(encoding="utf-8")
    return {(found["place"], found["what"]): found["why"] for found in _ARGUMENT.finditer(page)}
