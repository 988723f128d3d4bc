"""Write generated parts into a page. The comments `<!-- NAME -->` and `<!-- end -->` enclose a part."""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1] / "docs"


def insert_parts(page: str, **parts: str) -> str:
    """Insert the given parts into a page.

    >>> print(insert_parts("before <!-- size --> old <!-- end --> after", size="new"))
    before <!-- size -->
    new
    <!-- end --> after
    """
    for name, part in parts.items():
        pattern = re.compile(rf"(<!-- {name} -->).*?(<!-- end -->)", re.DOTALL)
        text = part.strip("\n")
        page, count = pattern.subn(lambda match, text=text: f"{match[1]}\n{text}\n{match[2]}", page)  # type: ignore[misc]
        if count != 1:
            raise ValueError(f"the page has {count} places <!-- {name} -->")
    return page


def update_page(path: Path, **parts: str) -> None:
    path.write_text(insert_parts(path.read_text("utf-8"), **parts), "utf-8")
    print(path)


def table(heads: Sequence[str], rows: Iterable[Sequence[object]], left: int | None = None) -> str:
    """Return a Markdown table.

    Columns after the first `left` are right-aligned.

    >>> print(table(("robot", "joints"), [("ur5", 6)], left=1))
    | robot | joints |
    |---|---:|
    | ur5 | 6 |
    """
    marks = "".join("|---" if left is None or i < left else "|---:" for i in range(len(heads))) + "|"
    lines = [f"| {' | '.join(map(str, row))} |" for row in (heads, *rows)]
    return "\n".join([lines[0], marks, *lines[1:]])
