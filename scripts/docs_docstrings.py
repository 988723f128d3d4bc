"""Docstrings for the site, as mkdocs.yml names this file: a doctest is a block of code."""

from __future__ import annotations

import re
from typing import Any

import griffe

#: The lines from a prompt to the next blank line.
_DOCTEST = re.compile(r"^( *)>>> .*(?:\n *\S.*)*", re.MULTILINE)


class Doctests(griffe.Extension):
    """Fences around doctests."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Before the docstring is read."""
        if obj.docstring is not None:
            obj.docstring.value = fenced(obj.docstring.value)


def fenced(docstring: str) -> str:
    """The docstring with each doctest in a fence."""
    return _DOCTEST.sub(r"\1```pycon\n\g<0>\n\1```", docstring)
