"""Measure how the time and the memory of a check grow with the size of the file (s and MB per MB).

    python scripts/check_growth.py                      # 1, 4, 16 and 64 MB of every kind of content
    python scripts/check_growth.py --sizes 1,4 number   # kinds with "number" in the name

If the cost grows linearly, all numbers in a row are equal. Each document is checked in its own process. A
check that takes longer than `--patience` ends its row.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from scripts.growing.clock import Cost, cost_apart
from scripts.growing.kinds import KINDS


def main() -> None:
    """Print one Markdown row for each kind of content."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument(
        "words",
        nargs="*",
        help="measure only the kinds of documents with one of these words in the name (default: all)",
    )
    parser.add_argument(
        "--sizes", default="1,4,16,64", help="sizes of the documents in megabytes, separated by commas"
    )
    parser.add_argument("--patience", type=float, default=600.0, help="time limit of one document in seconds")
    options = parser.parse_args()
    sizes = [float(size) for size in options.sizes.split(",")]
    heads = [f"{size:g} MB" for size in sizes]
    print(f"| seconds and megabytes for each megabyte of | {' | '.join(heads)} |")
    print("|---|" + "---:|" * len(sizes))
    for kind in KINDS:
        if not options.words or any(word in kind for word in options.words):
            cells = " | ".join(_row(kind, sizes, options.patience))
            print(f"| {kind} | {cells} |", flush=True)


def _row(kind: str, sizes: list[float], patience: float) -> list[str]:
    cells: list[str] = []
    for size in sizes:
        cost = None if cells and cells[-1] == "..." else cost_apart(kind, int(size * 1e6), patience)
        cells.append("..." if cost is None else _cell(cost))
    return cells


def _cell(cost: Cost) -> str:
    return f"{cost.seconds / cost.megabytes:.2f} s, {cost.memory / cost.megabytes:.0f} MB"


if __name__ == "__main__":
    main()
