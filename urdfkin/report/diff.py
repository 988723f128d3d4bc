"""Show the changes between two versions of a description as lines, a table, Markdown and JSON data."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any, cast

from urdfkin.comparison.diff import Changes, ModelChange, displacement_text, format_value
from urdfkin.comparison.result import angle, length
from urdfkin.errors.display import Strong, Table, TextDocument, format_count
from urdfkin.errors.escape import markdown_text as text
from urdfkin.report.markdown import MAX_CHARACTERS, count_within, row_line, shorten, table_lines
from urdfkin.system.documents import as_json_data

HEADS = ("element", "what", "old", "new", "alone")


def headline(found: Changes) -> str:
    rounding = ""
    if found.rounding is not None:
        metres, radians = found.rounding
        most = f": at most {length(metres)} and {angle(radians)}" if isfinite(metres) else ""
        rounding = f", apart from rounding to single precision{most}"
    if not found:
        return f"nothing changed{rounding}"
    head = format_count(len(found.changes), "change") + rounding
    if found.total is None:
        return f"{head}, no effect on motion" if not any(c.moves for c in found.changes) else head
    return f"{head}; together they {displacement_text(found.total)}"


PAIR_HEADS = ("old", "new", "changes")


def pairs_document(found: Sequence[Changes]) -> TextDocument:
    rows = [(*one.sources, headline(one)) for one in found]
    return TextDocument(
        "", [Table(PAIR_HEADS, rows, left=3), *(line for one in found if one for line in lines_of(one))]
    )


def pairs_markdown(found: Sequence[Changes]) -> str:
    lines = table_lines(PAIR_HEADS, (map(text, (*one.sources, headline(one))) for one in found))
    parts = ["\n".join([*lines, ""])]
    parts += [markdown_of(one, MAX_CHARACTERS // len(found)) for one in found if one]
    return "\n".join(parts)


def lines_of(found: Changes) -> list[str]:
    lines = [f"{found.sources[0]} -> {found.sources[1]}"]
    by_element: dict[str, list[ModelChange]] = {}
    for change in found.changes:
        by_element.setdefault(change.element, []).append(change)
    for element, changes in by_element.items():
        lines += [f"  {change}" for change in changes]
        if (effect := found.effect_of.get(element)) is not None:
            lines.append(f"    {effect}")
    return [*lines, Strong(headline(found))]


def document(found: Changes) -> TextDocument:
    parts: list[str | Table] = [f"{found.sources[0]} \u2192 {found.sources[1]}"]
    parts += [Table(HEADS, rows_of(found), left=len(HEADS))] if found else []
    return TextDocument(headline(found), parts)


def rows_of(found: Changes, longest: int | None = None) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for change in found.changes:
        effect = found.effect_of.get(change.element)
        motion = effect.words if effect and change.moves else ""
        old, new = ("" if value is None else format_value(value) for value in (change.old, change.new))
        new = change.size or new
        if longest is not None:
            old, new = shorten(old, longest), shorten(new, longest)
        cells = (change.element, change.what, old, new) if change.what else (str(change), "", "", "")
        rows.append((*cells, motion))
    return rows


def markdown_of(found: Changes, max_characters: int = MAX_CHARACTERS) -> str:
    lines = [f"## {text(headline(found))}", "", f"{text(found.sources[0])} → {text(found.sources[1])}", ""]
    if found:
        lines += table_lines(HEADS)
    rows = [row_line(map(text, cells)) for cells in rows_of(found, 120)]
    shown = count_within(rows, max_characters - sum(map(len, lines)) - 200)
    lines += rows[:shown]
    if shown < len(rows):
        lines += ["", f"{format_count(len(rows) - shown, 'more change')} not shown."]
    return "\n".join([*lines, ""])


def as_data(found: Changes) -> dict[str, Any]:
    def distance_entry(interval: Any) -> dict[str, Any] | None:
        if interval is None:
            return None
        return {"frame": interval.frame, "lower": interval.lower, "upper": interval.upper}

    data = {
        "sources": list(found.sources),
        "changes": [
            {
                "element": c.element,
                "what": c.what,
                "old": c.old,
                "new": c.new,
                "size": c.size or None,
                "moves": c.moves,
            }
            for c in found.changes
        ],
        "effects": [{"element": e.element, **(distance_entry(e.interval) or {})} for e in found.effects],
        "total": distance_entry(found.total),
        "rounding": found.rounding and dict(zip(("metres", "radians"), found.rounding, strict=True)),
    }
    return cast("dict[str, Any]", as_json_data(data))
