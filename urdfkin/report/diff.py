"""Print the changes between two versions of a description, or return them as Markdown or JSON data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from urdfkin.comparison.diff import Change, Changes, motion_words, word
from urdfkin.errors.escape import markdown_text as text
from urdfkin.report.markdown import LIMIT, shortened
from urdfkin.report.words import counted

if TYPE_CHECKING:
    from rich.console import Console


def headline(found: Changes) -> str:
    """Return the number of changes, and how far all together move a frame, in one line."""
    if not found:
        return "nothing changed"
    head = counted(len(found.changes), "change")
    if found.total is None:
        return f"{head}, no effect on motion" if not any(c.moves for c in found.changes) else head
    return f"{head}; together they {motion_words(found.total)}"


def _by_element(found: Changes) -> dict[str, list[Change]]:
    grouped: dict[str, list[Change]] = {}
    for change in found.changes:
        grouped.setdefault(change.element, []).append(change)
    return grouped


def print_changes(found: Changes, out: Console) -> None:
    """Print the changes by element, with the effect of each joint's changes alone."""
    out.print(f"{found.sources[0]} -> {found.sources[1]}", soft_wrap=True)
    for element, changes in _by_element(found).items():
        for change in changes:
            out.print(f"  {change}", soft_wrap=True)
        if (effect := found.effect_of.get(element)) is not None:
            out.print(f"    {effect}", soft_wrap=True)
    out.print(headline(found), style="bold")


def markdown_of(found: Changes, limit: int = LIMIT) -> str:
    """Return the changes as Markdown for a pull request's comment, at most `limit` characters."""
    lines = [f"## {text(headline(found))}", "", f"{text(found.sources[0])} → {text(found.sources[1])}", ""]
    if found:
        lines += ["| element | what | old | new | alone |", "| --- | --- | --- | --- | --- |"]
    left = limit - sum(map(len, lines)) - 200
    for k, change in enumerate(found.changes):
        effect = found.effect_of.get(change.element)
        said = effect.words if effect and change.moves else ""
        old, new = (
            shortened("" if value is None else word(value), 120) for value in (change.old, change.new)
        )
        cells = (change.element, change.what, old, new) if change.what else (str(change), "", "", "")
        row = f"| {' | '.join(map(text, (*cells, said)))} |"
        left -= len(row) + 1
        if left < 0:
            lines += ["", f"{counted(len(found.changes) - k, 'more change')} not shown."]
            break
        lines.append(row)
    return "\n".join([*lines, ""])


def as_data(found: Changes) -> dict[str, Any]:
    """Return the changes as JSON data; null for a missing value, and for a distance without bound."""

    def far(interval: Any) -> dict[str, Any] | None:
        if interval is None:
            return None
        upper = None if interval.upper == float("inf") else interval.upper
        return {"frame": interval.frame, "lower": interval.lower, "upper": upper}

    return {
        "sources": list(found.sources),
        "changes": [
            {"element": c.element, "what": c.what, "old": c.old, "new": c.new, "moves": c.moves}
            for c in found.changes
        ],
        "effects": [{"element": e.element, **(far(e.interval) or {})} for e in found.effects],
        "total": far(found.total),
    }
