"""A .xacro file to URDF text, through xacrodoc; the only module that imports it.

Expanding runs the file's expressions and keeps its state in the process, so it is done in a process of its
own, with a time limit. That process finds packages as `urdfkin.urdf.packages` does; nothing else of ROS is
needed. xacro files are programs: expand those you trust.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from urdfkin.errors import SourceError, UrdfkinError
from urdfkin.urdf.packages import VARIABLES, find_package

#: Seconds after which an expansion is given up: a macro may call itself.
PATIENCE = 60.0


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
        XacroError: xacrodoc is not installed, or xacro cannot expand the file.
    """
    if not path.is_file():
        raise SourceError("no such file", where=str(path))
    if find_spec("xacrodoc") is None:
        raise XacroError(
            "a .xacro file needs the package xacrodoc",
            where=str(path),
            remedy='install it with "urdfkin[xacro]", or expand the file with: xacro FILE > robot.urdf',
        )
    request = json.dumps({"path": str(path.absolute()), "arguments": dict(arguments)}).encode()
    try:
        done = subprocess.run(
            [sys.executable, "-m", __name__],
            input=request,
            capture_output=True,
            timeout=patience,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise XacroError("xacro does not come to an end", where=str(path), found=f"{patience:g} s") from None
    answer = _answer(done.stdout)
    if "urdf" in answer:
        return str(answer["urdf"]).encode()
    reason = answer.get("error") or f"its process ended with status {done.returncode}"
    raise XacroError(
        "xacro cannot expand the file",
        where=str(path),
        found=str(reason).strip() or None,
        remedy="give arguments with --xacro-arg NAME:=VALUE; packages are found by ROS_PACKAGE_PATH,"
        " AMENT_PREFIX_PATH and the folders above the file",
    )


def _answer(output: bytes) -> dict[str, Any]:
    """The last line of the process's output, if it is an answer."""
    try:
        answer = json.loads(output.splitlines()[-1])
    except (IndexError, ValueError):
        return {}
    return answer if isinstance(answer, dict) else {}


def _absolute(entries: str) -> str:
    """A search path whose entries do not depend on the working directory."""
    return os.pathsep.join(str(Path(entry).absolute()) for entry in entries.split(os.pathsep) if entry)


def _serve() -> None:
    """The process's side: a request on standard input, an answer as the last line of standard output."""
    import xacrodoc.packages  # noqa: PLC0415  the border: nobody else needs it

    request = json.load(sys.stdin)
    path = Path(request["path"])
    environ = {name: _absolute(os.environ.get(name, "")) for name in VARIABLES}
    os.chdir(path.parent)  # what the file includes without a package is relative to it

    class Finder:
        """Finds packages for xacro's $(find name)."""

        def get_path(self, name: str) -> str:
            folder = find_package(name, path, environ)
            if folder is None:
                raise LookupError(f"package {name!r} is not found")
            return str(folder)

        def walk_up_from(self, path: object, priority: int = 0) -> None:
            """Done by `find_package` already."""

    xacrodoc.packages._finder = Finder()
    try:
        document = xacrodoc.XacroDoc.from_file(path, subargs=request["arguments"], resolve_packages=False)
        answer = {"urdf": document.to_urdf_string()}
    except (Exception, SystemExit) as error:
        answer = {"error": f"{type(error).__name__}: {error}"}
    sys.stdout.write("\n" + json.dumps(answer) + "\n")


if __name__ == "__main__":
    _serve()
