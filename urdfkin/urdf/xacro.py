"""Which arguments a xacro file takes, so that one that it does not take can be refused: xacro ignores it.

The file and what it includes are read, not expanded, in the confined process that expands them. An include
whose name is computed, that is not found, or that may not be read, may declare anything: then nothing is
known, and nothing is refused.


A .xacro file to URDF text, in a process of its own that is trusted with nothing.

xacro files are programs, and they come with robots from anywhere. The process finds packages as
`urdfkin.urdf.packages` does, nothing else of ROS is needed; `expanding` is its side, and docs/xacro.md says
what a file may do.
"""

from __future__ import annotations

import json
import os
import re
import xml.etree.ElementTree as Xml
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import asdict
from importlib.util import find_spec
from math import ceil
from pathlib import Path
from typing import Any

from urdfkin.errors import Question, SourceError, UnknownNameError, UrdfkinError
from urdfkin.system.files import read_bytes
from urdfkin.system.processes import ask_python, own_python
from urdfkin.urdf.confinement import Ground
from urdfkin.urdf.expressions import RefusedError
from urdfkin.urdf.packages import VARIABLES

#: Bytes of a file, and files, beyond which nothing is known either.
MOST_ARGUMENTS, MOST_FILES = 10_000_000, 200

#: What finds the folder of a package, or raises LookupError.
Find = Callable[[str], str]

_USED = re.compile(r"\$\(arg\s+([^\s()]+)\s*\)")
_FIND = re.compile(r"\$\(find\s+([^\s()]+)\s*\)")
_COMPUTED = re.compile(r"\$[({]|[*?\[]")


def check_arguments(path: Path, given: Iterable[str], known: Collection[str] | None) -> None:
    """Refuse arguments that a xacro file neither declares nor uses.

    Args:
        path: The file.
        given: Names of arguments.
        known: The names that `arguments_of` has found; None: nothing is refused.

    Raises:
        UnknownNameError: with those that it takes.
    """
    if known is not None and (unknown := [name for name in given if name not in known]):
        raise UnknownNameError("xacro argument", unknown[0], known, where=str(path))


def arguments_of(path: Path, find: Find) -> set[str] | None:
    """Names in `<xacro:arg>` and `$(arg)` of a file and its includes; None where not all can be read.

    Args:
        path: The file.
        find: What finds packages.
    """
    names, files, seen = set[str](), [path.absolute()], set[Path]()
    while files:
        file = files.pop()
        if file in seen:
            continue
        seen.add(file)
        found = _read(file)
        if found is None or len(seen) > MOST_FILES:
            return None
        for element in found.iter():
            namespace, _, tag = str(element.tag).rpartition("}")
            for value in element.attrib.values():
                names.update(_USED.findall(value))
            names.update(_USED.findall(element.text or ""))
            if "xacro" in namespace and tag == "arg":
                names.add(element.get("name", ""))
            if "xacro" in namespace and tag == "include":
                included = _included(element.get("filename", ""), file, find)
                if included is None:
                    return None
                files.append(included)
    return names


def _read(file: Path) -> Xml.Element | None:
    try:
        return Xml.fromstring(read_bytes(file, MOST_ARGUMENTS))
    except (SourceError, RefusedError, ValueError, Xml.ParseError):
        return None


def _included(name: str, beside: Path, find: Find) -> Path | None:
    """The file that an include names, or None where that is computed or not found."""
    folder = beside.parent
    if match := _FIND.match(name):
        try:
            folder = Path(find(match[1]))
        except (LookupError, RefusedError):
            return None
        name = name[match.end() :].lstrip("/")
    return None if _COMPUTED.search(name) or not name else folder / name


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
