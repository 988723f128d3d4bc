"""The page of one code: why it matters, a bad and a good example, and what others do with it."""

from __future__ import annotations

import textwrap

from urdfkin.errors import UnknownNameError
from urdfkin.lint.codes import REGISTRY
from urdfkin.lint.rule import Code
from urdfkin.printable import printable

#: Longest line of an example that is shown whole.
_WIDEST = 100


def find_code(word: str) -> Code:
    """A code by its id or its short name, in any case.

    Raises:
        UnknownNameError: there is none; the nearest are offered.
    """
    wanted = word.strip().lower()
    wanted = f"urdf{wanted}" if wanted.isdigit() else wanted
    for code in REGISTRY.values():
        if wanted in (code.id.lower(), code.slug):
            return code
    raise UnknownNameError("code", word, [*REGISTRY, *(code.slug for code in REGISTRY.values())])


def page(code: Code, width: int = 88) -> str:
    """The page as plain text."""
    paragraphs = [
        f"{code.id} {code.slug} ({code.severity.value})",
        textwrap.fill(code.title[0].upper() + code.title[1:] + ".", width),
        textwrap.fill(code.why, width),
        "Found in:\n\n" + _example(code.bad),
        "Better:\n\n" + _example(code.good),
        textwrap.fill(code.others, width),
    ]
    if code.oracle is not None:
        paragraphs.append(
            textwrap.fill(
                "Because of this, urdfkin computes the robot and reports every result as not verified.", width
            )
        )
    return "\n\n".join(paragraphs)


def _example(text: str) -> str:
    """An example, indented, with everything unprintable escaped and long lines cut."""
    lines = [printable(line) for line in text.strip("\n").split("\n")]
    cut = [line if len(line) <= _WIDEST else line[: _WIDEST - 4] + " ..." for line in lines]
    return textwrap.indent("\n".join(cut), "    ", lambda line: True).rstrip()
