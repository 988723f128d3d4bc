"""A .xacro file to URDF text, in a process of its own that is trusted with nothing.

xacro files are programs, and they come with robots from anywhere. The process finds packages as
`urdfkin.urdf.packages` does, nothing else of ROS is needed; `expanding` is its side, and docs/xacro.md says
what a file may do.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from importlib.util import find_spec
from math import ceil
from pathlib import Path
from typing import Any

from urdfkin.errors import SourceError, UrdfkinError
from urdfkin.errors.questions import Question
from urdfkin.system.interpreter import ask_python, own_python
from urdfkin.urdf.confinement import Ground
from urdfkin.urdf.packages import VARIABLES
from urdfkin.urdf.xacro_arguments import check_arguments

#: Seconds after which an expansion is given up: a macro may call itself.
PATIENCE = 60.0

#: Bytes of an answer after which it is not read on.
MOST = 100_000_000


class XacroError(UrdfkinError):
    """A xacro file that cannot be expanded."""


def expand(path: Path, arguments: Mapping[str, str], *, patience: float = PATIENCE) -> bytes:
    """The URDF a xacro file stands for, as UTF-8.

    Args:
        path: The file.
        arguments: Values for its `<xacro:arg>`.
        patience: Seconds to wait.

    Raises:
        SourceError: there is no such file.
        UnknownNameError: an argument that the file does not take.
        XacroError: xacrodoc is not installed, xacro cannot expand the file, or the file asks for what it may
            not have: other files, programs, too much memory or time.
    """
    if not path.is_file():
        raise SourceError("no such file", where=str(path))
    if find_spec("xacrodoc") is None:
        raise XacroError(
            "a .xacro file needs the package xacrodoc",
            where=str(path),
            remedy='install it with "urdfkin[xacro]", or expand the file with: xacro FILE > robot.urdf',
            question=Question.XACRO,
        )
    command = own_python("from urdfkin.urdf.expanding import serve; serve()", options=("-B", "-X", "utf8"))
    output, status = ask_python(command, _request(path.absolute(), arguments, patience), patience, MOST)
    if status is None:
        raise XacroError("xacro does not come to an end", where=str(path), found=f"{patience:g} s")
    if len(output) > MOST:
        raise XacroError("xacro makes too long a URDF", where=str(path), found=f"more than {MOST} bytes")
    answer = _answer(output)
    if "urdf" in answer:
        takes = answer.get("takes")
        check_arguments(path, arguments, [str(name) for name in takes] if isinstance(takes, list) else None)
        return str(answer["urdf"]).encode()
    reason = answer.get("error") or f"its process ended with status {status}"
    raise XacroError(
        "xacro cannot expand the file",
        where=str(path),
        found=str(reason).strip() or None,
        remedy="give arguments with --xacro-arg NAME:=VALUE; packages are found by ROS_PACKAGE_PATH,"
        " AMENT_PREFIX_PATH and, if they hold a package.xml, beside the folders above the file; docs/xacro.md"
        " says what a file may do",
        question=Question.XACRO,
    )


def _request(path: Path, arguments: Mapping[str, str], patience: float) -> bytes:
    search = {name: _absolute(os.environ.get(name, "")) for name in VARIABLES}
    installed = [entry for entries in search.values() for entry in entries.split(os.pathsep) if entry]
    request = {
        "path": str(path),
        "arguments": dict(arguments),
        "search": search,
        "ground": asdict(Ground.around(path, installed, list(arguments.values()))),
        "seconds": ceil(patience) + 1,
    }
    return json.dumps(request).encode()


def _absolute(entries: str) -> str:
    """A search path whose entries do not depend on the working directory."""
    return os.pathsep.join(str(Path(entry).absolute()) for entry in entries.split(os.pathsep) if entry)


def _answer(output: bytes) -> dict[str, Any]:
    """The last line of the process's output, if it is an answer."""
    try:
        answer = json.loads(output.splitlines()[-1])
    except (IndexError, ValueError):
        return {}
    return answer if isinstance(answer, dict) else {}
