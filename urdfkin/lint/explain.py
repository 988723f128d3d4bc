"""The page of a rule as `urdfkin explain` prints it."""

from __future__ import annotations

import textwrap

from urdfkin.errors.escape import printable
from urdfkin.lint.pages import page
from urdfkin.lint.rule import Rule

#: Longest line of an example that is shown whole.
_WIDEST = 100
#: How wide prose is on a terminal.
WIDTH = 88


def explain(rule: Rule) -> str:
    """The page as plain text."""
    said = page(rule.id)
    paragraphs = [
        f"{rule.id} {rule.slug} ({rule.severity.value})",
        textwrap.fill(said.title[0].upper() + said.title[1:] + ".", WIDTH),
        textwrap.fill(said.why, WIDTH),
        "Found in:\n\n" + _example(said.example),
        "Better:\n\n" + _example(said.cure),
        textwrap.fill(said.others, WIDTH),
    ]
    if rule.oracle is not None:
        paragraphs.append(
            textwrap.fill(
                "Because of this, urdfkin computes the robot and reports every result as not verified.", WIDTH
            )
        )
    if said.question is not None:
        paragraphs.append(f"{said.question}.")
    return "\n\n".join(paragraphs)


def _example(text: str) -> str:
    """An example, indented, with everything unprintable escaped and long lines cut."""
    lines = [printable(line) for line in text.strip("\n").split("\n")]
    cut = [line if len(line) <= _WIDEST else line[: _WIDEST - 4] + " ..." for line in lines]
    return textwrap.indent("\n".join(cut), "    ", lambda line: True).rstrip()
