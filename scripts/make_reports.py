"""Write the layout of the JSON report into docs/reports.md, from its schema.

Run this script after a change of the schema: `python scripts/make_reports.py`. A test compares the page with
the output of this script.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from urdfkin.validation.document import VALIDATION

PAGE = Path(__file__).parents[1] / "docs" / "reports.md"
#: The script replaces all text after this line of the page.
MARK = "<!-- written by scripts/make_reports.py from the schema -->\n"


def page() -> str:
    """Return the text of the page."""
    return PAGE.read_text("utf-8").partition(MARK)[0] + MARK + "".join(_tables())


def _tables() -> Iterator[str]:
    whole = VALIDATION.schema()
    yield from _table("The document", whole)
    for name, part in whole["$defs"].items():
        yield from _table(f"`{name}`", part)


def _table(title: str, part: dict[str, Any]) -> Iterator[str]:
    yield f"\n### {title}\n\n{part['description']}\n\n| entry | type | meaning |\n|---|---|---|\n"
    for name, entry in part["properties"].items():
        yield f"| `{name}` | {_type(entry)} | {_cell(_meaning(entry))} |\n"


def _type(entry: dict[str, Any]) -> str:
    """Return a type as text, such as `number or null`, `list of Check`, or the allowed values of an enum."""
    if "$ref" in entry:
        return f"`{entry['$ref'].rpartition('/')[2]}`"
    if "anyOf" in entry:
        return " or ".join(_type(choice) for choice in entry["anyOf"])
    if "const" in entry:
        return f"`{entry['const']}`"
    if "enum" in entry:
        return ", ".join("null" if word is None else f"`{word}`" for word in entry["enum"])
    if entry["type"] == "array":
        count = entry.get("minItems")
        return f"{f'{count} ×' if count else 'list of'} {_type(entry['items'])}"
    return str(entry["type"])


def _meaning(entry: dict[str, Any]) -> str:
    """Return the description of an entry or, if it has none, the description of the entry's type."""
    name = entry.get("$ref", "").rpartition("/")[2]
    return str(entry.get("description") or VALIDATION.schema()["$defs"][name]["description"])


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("*", "\\*").replace("<", "&lt;")


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
