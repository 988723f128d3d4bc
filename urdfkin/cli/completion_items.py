"""What a shell offers where a robot, a frame, a table or a code is to be typed; click's completion asks.

It runs at each press of the key, so nothing heavy is imported, and of a file only the names are read. A name
that a shell would take for more than a name is not offered: a robot's file may come from a stranger, and what
is put on a command line is carried out.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem

from urdfkin.errors import UrdfkinError
from urdfkin.urdf.catalogue import catalogue

if TYPE_CHECKING:
    Items = list[CompletionItem[str]]

#: No quotes, no blanks, nothing that is expanded; no colon, at which bash would begin a new word.
_HARMLESS = re.compile(r"(?=\w)[\w./+-]+")
#: Bytes of a file that are read for its names.
_MOST = 10_000_000
#: What names a frame: of a URDF the children of its root, of an MJCF file anything.
_URDF, _MJCF = ("link", "joint"), ("body", "site", "joint")


def complete_robot(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    """Files, and the catalogue's names."""
    return [CompletionItem(incomplete, type="file"), *_offered(catalogue(), incomplete)]


def complete_file(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    """Files."""
    return [CompletionItem(incomplete, type="file")]


def complete_frame(context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    """Links and joints of the robot that stands on the line already."""
    # Where an option still waits for its value, click has not told arguments apart yet.
    robot = context.params.get("robot") or next(iter(context.args), "")
    return _offered(_frames(robot), incomplete)


def complete_table(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    """Files, and the tables that are shipped."""
    from urdfkin.system.resources import robots_dir  # noqa: PLC0415  only for those who ask

    shipped = sorted(path.stem for path in (robots_dir() / "dh").glob("*.toml"))
    return [CompletionItem(incomplete, type="file"), *_offered(shipped, incomplete)]


def complete_code(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> Items:
    """Codes of findings, and their short names."""
    from urdfkin.lint.pages import RULES  # noqa: PLC0415  only for those who ask

    return _offered((name for rule in RULES.values() for name in (rule.id, rule.slug)), incomplete)


def complete_topic(context: click.Context, parameter: click.Parameter, incomplete: str) -> Items:
    """What `explain` takes: codes, and equations."""
    from urdfkin.kinematics.registry import equations  # noqa: PLC0415  only for those who ask

    return [*complete_code(context, parameter, incomplete), *_offered(equations(), incomplete)]


def _offered(names: Iterable[str], incomplete: str) -> Items:
    return [
        CompletionItem(name)
        for name in names
        if name.startswith(incomplete) and _HARMLESS.fullmatch(name) is not None
    ]


def _frames(word: str) -> Iterator[str]:
    """A robot's names, as far as its file says them without being expanded or computed."""
    from urdfkin.lint.reporter import Reporter  # noqa: PLC0415
    from urdfkin.lint.rules.document import read_document  # noqa: PLC0415
    from urdfkin.urdf.sources import is_xacro, read_source  # noqa: PLC0415

    if is_xacro(word) or not (word in catalogue() or Path(word).expanduser().is_file()):
        return
    try:
        text = read_source(word, _MOST)
        root = read_document(Reporter(text.label, text.data))
    except (UrdfkinError, OSError):
        return
    if root is None:
        return
    elements, kinds = (root.walk(), _MJCF) if root.tag == "mujoco" else (root.children, _URDF)
    names = (element.attributes.get("name", "") for element in elements if element.tag in kinds)
    yield from dict.fromkeys(names)
