"""Extend mkdocs so that doctests in docstrings are shown as blocks of code; mkdocs.yml refers to this module.

The pages show the same text as `help()` of a method, for example `help(Robot.jacobian)`. The text of
`help()` also describes the arguments that several methods have in common. The heading `Example:` is removed,
because the site would draw a box around the example.
"""

import inspect
import re
import textwrap
from typing import Any

import griffe

from urdfkin.robot import Robot

#: Regular expression for the heading `Example:` of a docstring and the indented lines below.
_EXAMPLE = re.compile(r"^( *)Examples?:\n((?:\1 +\S.*\n?|\n)+)", re.MULTILINE)
#: Regular expression for a Python prompt `>>>` and all lines up to the next blank line.
_DOCTEST = re.compile(r"^( *)>>> .*(?:\n *\S.*)*", re.MULTILINE)


class DoctestFences(griffe.Extension):
    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        if obj.docstring is not None and obj.path.startswith("urdfkin.robot.Robot."):
            obj.docstring.value = inspect.getdoc(getattr(Robot, obj.name)) or ""
        if obj.docstring is not None:
            obj.docstring.value = fence_doctests(obj.docstring.value)


def fence_doctests(docstring: str) -> str:
    flat = _EXAMPLE.sub(lambda found: textwrap.indent(textwrap.dedent(found[2]), found[1]), docstring)
    return _DOCTEST.sub(r"\1```pycon\n\g<0>\n\1```", flat)
