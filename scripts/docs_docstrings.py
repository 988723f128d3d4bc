"""An extension of mkdocs that shows doctests in docstrings as blocks of code; mkdocs.yml refers to it."""

from __future__ import annotations

import re
from typing import Any

import griffe

#: The lines from a prompt to the next blank line.
_DOCTEST = re.compile(r"^( *)>>> .*(?:\n *\S.*)*", re.MULTILINE)


class Doctests(griffe.Extension):
    """Adds code fences around doctests."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Change an object's docstring before it is parsed."""
        if obj.docstring is not None:
            obj.docstring.value = fenced(obj.docstring.value)


def fenced(docstring: str) -> str:
    """Return the docstring with each doctest in a code fence."""
    return _DOCTEST.sub(r"\1```pycon\n\g<0>\n\1```", docstring)
