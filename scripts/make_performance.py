"""Write the figures of docs/performance.md, and its picture, from docs/performance.json.

    python scripts/benchmark.py --json docs/performance.json
    python scripts/make_performance.py

The script replaces the text between `<!-- figures: ... -->` and `<!-- end -->` on the page. A test checks
that the page is current.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))  # import from this checkout without an installation

from scripts.benchmarking.picture import draw
from scripts.benchmarking.tables import Words, tables
from scripts.pages import DOCS, inserted, table

PAGE, FIGURES = DOCS / "performance.md", DOCS / "performance.json"
PICTURE = DOCS / "images" / "performance.svg"
NOT_MEASURED = "Not measured yet."


def page(text: str, figures: Mapping[str, Any]) -> str:
    """Return `text` with the figures inserted; a missing measurement is reported in its place.

    Raises:
        ValueError: the page does not have exactly one place for a measurement.
    """
    parts: dict[str, list[str]] = {"machine": [_machine(figures)]}
    for words in tables(figures):
        parts.setdefault(words.section, []).append(_markdown(words))
    places = re.findall(r"<!-- figures: (\w+) -->", text)
    if set(parts) - set(places) or len(places) != len(set(places)):
        raise ValueError(f"the page has places for {places}, the figures are {list(parts)}")
    texts = {place: "\n\n".join(parts.get(place, [NOT_MEASURED])) for place in places}
    return inserted(text, **{f"figures: {place}": part for place, part in texts.items()})


def _machine(figures: Mapping[str, Any]) -> str:
    machine, versions = figures["machine"], figures["versions"]
    libraries = figures["libraries"] | {name: versions[name] for name in ("numpy", "numba")}
    return (
        f"{machine['processor']}, {machine['processors']} processors, {machine['vectors']}, "
        f"{machine['memory_gib']} GiB, {machine['system']}, Python {machine['python']}; "
        f"{', '.join(f'{name} {state}' for name, state in libraries.items())}. "
        f"{figures['rounds']} rounds, float64."
    )


def _markdown(words: Words) -> str:
    remarks = "".join(f"\n[{i}] {remark}." for i, remark in enumerate(words.remarks, start=1))
    cells = table(words.head, words.rows, left=1)
    return f"**{words.title}**\n\n{cells}" + (f"\n{remarks}" if remarks else "")


def main() -> None:
    """Write the page and the picture."""
    figures = json.loads(FIGURES.read_text("utf-8"))
    PAGE.write_text(page(PAGE.read_text("utf-8"), figures), "utf-8")
    PICTURE.write_bytes(draw(figures, PICTURE))
    print(PAGE, PICTURE, sep="\n")


if __name__ == "__main__":
    main()
