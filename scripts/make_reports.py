"""Write the layout of the JSON report into docs/reports.md, from its schema.

Run it after a change of the schema: `python scripts/make_reports.py`. A test compares the page with the
output of this script.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from urdfkin.report.document import schema

PAGE = Path(__file__).parents[1] / "docs" / "reports.md"
#: This script writes the text after this line.
MARK = "<!-- written by scripts/make_reports.py from the schema -->\n"


def page() -> str:
    """Return the text of the page."""
    return PAGE.read_text("utf-8").partition(MARK)[0] + MARK + "".join(_tables())


def _tables() -> Iterator[str]:
    whole = schema()
    yield from _table("The document", whole)
    for name, part in whole["$defs"].items():
        if "properties" in part:
            yield from _table(f"`{name}`", part)


def _table(title: str, part: dict[str, Any]) -> Iterator[str]:
    yield f"\n### {title}\n\n{part['description']}\n\n| entry | type | meaning |\n|---|---|---|\n"
    for name, entry in part["properties"].items():
        yield f"| `{name}` | {_type(entry)} | {_cell(_meaning(entry))} |\n"


def _type(entry: dict[str, Any]) -> str:
    """Return a type as text: `number or null`, `list of check`, or the allowed values."""
    if "$ref" in entry:
        return _named(entry["$ref"])
    if "oneOf" in entry:
        return " or ".join(_type(choice) for choice in reversed(entry["oneOf"]))
    if "const" in entry:
        return f"`{entry['const']}`"
    if "enum" in entry:
        return ", ".join("null" if word is None else f"`{word}`" for word in entry["enum"])
    kinds = entry["type"] if isinstance(entry["type"], list) else [entry["type"]]
    words = [f"list of {_type(entry['items'])}" if kind == "array" else kind for kind in kinds]
    return " or ".join(words)


def _named(reference: str) -> str:
    name = reference.rpartition("/")[2]
    return {"units": "number or null", "matrix": "4 lists of 4 numbers"}.get(name, f"`{name}`")


def _meaning(entry: dict[str, Any]) -> str:
    if "description" in entry:
        return str(entry["description"])
    target = schema()["$defs"][entry["$ref"].rpartition("/")[2]]
    return str(target["description"])


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("*", "\\*")


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
