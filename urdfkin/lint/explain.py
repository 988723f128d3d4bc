"""Format the page of a rule for `urdfkin explain`."""

from __future__ import annotations

import textwrap

from urdfkin.errors.escape import printable
from urdfkin.lint.pages import page
from urdfkin.lint.rule import Rule

#: Characters of an example's line; a longer one is cut.
_WIDEST = 100
#: Width of prose on a terminal, in characters.
WIDTH = 88


def explain(rule: Rule) -> str:
    """Return the page of a rule as plain text."""
    content = page(rule.id)
    paragraphs = [
        f"{rule.id} {rule.slug} ({rule.severity.value})",
        textwrap.fill(content.title[0].upper() + content.title[1:] + ".", WIDTH),
        textwrap.fill(content.why, WIDTH),
        "Found in:\n\n" + _example(content.example),
        "Better:\n\n" + _example(content.cure),
        textwrap.fill(content.others, WIDTH),
    ]
    if rule.oracle is not None:
        paragraphs.append(
            textwrap.fill(
                "Because of this, urdfkin computes the robot and reports every result as not verified.", WIDTH
            )
        )
    if content.question is not None:
        paragraphs.append(f"{content.question}.")
    return "\n\n".join(paragraphs)


def _example(text: str) -> str:
    """Indent an example, escape unprintable characters and cut long lines."""
    lines = [printable(line) for line in text.strip("\n").split("\n")]
    cut = [line if len(line) <= _WIDEST else line[: _WIDEST - 4] + " ..." for line in lines]
    return textwrap.indent("\n".join(cut), "    ", lambda line: True).rstrip()
