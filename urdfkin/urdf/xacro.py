"""Expand a .xacro file to URDF text, in a separate process with restricted rights.

A xacro file is a program, and may come from an untrusted source. `expanding` is the code of the separate
process. docs/xacro.md lists the operations that a file may do.

xacro ignores an argument that the file does not declare; urdfkin raises an error. To find the declared
arguments, the separate process reads the file and its includes. If the name of an include is computed, or if
the include is not found or not allowed, urdfkin accepts any argument of the user.
"""

from __future__ import annotations

import json
import os
import re
import xml.etree.ElementTree as Xml
from collections.abc import Callable, Mapping
from dataclasses import asdict
from importlib.util import find_spec
from math import ceil
from pathlib import Path
from typing import Any

from urdfkin.errors import QuestionsSection, SourceError, UnknownNameError, UrdfkinError
from urdfkin.system.files import read_bytes
from urdfkin.system.lazy_import import install_remedy
from urdfkin.system.processes import ask_python, own_python
from urdfkin.urdf.catalogue import VARIABLES
from urdfkin.urdf.confinement import Ground
from urdfkin.urdf.expressions import RefusedError

#: The search for declared arguments reads files of at most this size, and at most this number of files.
MOST_ARGUMENTS, MOST_FILES = 10_000_000, 200

#: The function returns the folder of a package, or raises LookupError.
Find = Callable[[str], str]

_USED = re.compile(r"\$\(arg\s+([^\s()]+)\s*\)")
_FIND = re.compile(r"\$\(find\s+([^\s()]+)\s*\)")
_COMPUTED = re.compile(r"\$[({]|[*?\[]")


def arguments_of(path: Path, find: Find) -> set[str] | None:
    """Return the names in `<xacro:arg>` and `$(arg)` of a file and its includes, or None.

    The result is None if an include cannot be read.
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
                included = _included_file(element.get("filename", ""), file, find)
                if included is None:
                    return None
                files.append(included)
    return names


def _read(file: Path) -> Xml.Element | None:
    try:
        return Xml.fromstring(read_bytes(file, MOST_ARGUMENTS))
    except (SourceError, RefusedError, ValueError, Xml.ParseError):
        return None


def _included_file(name: str, beside: Path, find: Find) -> Path | None:
    """Return the path of an included file, or None if the name is computed or the package is not found."""
    folder = beside.parent
    if match := _FIND.match(name):
        try:
            folder = Path(find(match[1]))
        except (LookupError, RefusedError):
            return None
        name = name[match.end() :].lstrip("/")
    return None if _COMPUTED.search(name) or not name else folder / name


#: An expansion ends after this time in seconds, because a macro may call itself without end.
PATIENCE = 60.0

#: Size limit of the answer in bytes.
MOST = 100_000_000


class XacroError(UrdfkinError):
    pass


def expand(path: Path, arguments: Mapping[str, str], *, patience: float = PATIENCE) -> bytes:
    """Return the URDF of a xacro file, as UTF-8.

    Raises:
        SourceError: the file does not exist.
        UnknownNameError: the file does not declare an argument.
        XacroError: xacrodoc is not installed, or xacro cannot expand the file. For example, the xacro code
            opens a forbidden file, starts a program, or needs too much memory or more than `patience`
            seconds.
    """
    if not path.is_file():
        raise SourceError("no such file", where=str(path))
    if find_spec("xacrodoc") is None:
        raise XacroError(
            "a .xacro file needs the package xacrodoc",
            where=str(path),
            remedy=f"{install_remedy('xacro')}, or expand the file with: xacro FILE > robot.urdf",
            question=QuestionsSection.XACRO,
        )
    command = own_python("from urdfkin.urdf.expanding import serve; serve()", options=("-B", "-X", "utf8"))
    output, status = ask_python(command, _request(path.absolute(), arguments, patience), patience, MOST)
    if status is None:
        raise XacroError("xacro did not finish", where=str(path), found=f"{patience:g} s")
    if len(output) > MOST:
        raise XacroError("the expanded URDF is too long", where=str(path), found=f"more than {MOST} bytes")
    answer = _answer(output)
    if "urdf" in answer:
        if isinstance(takes := answer.get("takes"), list):
            known = [str(name) for name in takes]
            if unknown := [name for name in arguments if name not in known]:
                raise UnknownNameError("xacro argument", unknown[0], known, where=str(path))
        return str(answer["urdf"]).encode()
    reason = answer.get("error") or f"the process of xacro ended with status {status}"
    raise XacroError(
        "xacro cannot expand the file",
        where=str(path),
        found=str(reason).strip() or None,
        remedy="set arguments with --xacro-arg NAME:=VALUE, and the folders of packages in ROS_PACKAGE_PATH;"
        " docs/xacro.md lists the operations that a file may do",
        question=QuestionsSection.XACRO,
    )


def _request(path: Path, arguments: Mapping[str, str], patience: float) -> bytes:
    paths = {
        name: [str(Path(one).absolute()) for one in os.environ.get(name, "").split(os.pathsep) if one]
        for name in VARIABLES
    }
    installed = [entry for entries in paths.values() for entry in entries]
    request = {
        "path": str(path),
        "arguments": dict(arguments),
        "search": {name: os.pathsep.join(entries) for name, entries in paths.items()},
        "ground": asdict(Ground.around(path, installed, list(arguments.values()))),
        "seconds": ceil(patience) + 1,
    }
    return json.dumps(request).encode()


def _answer(output: bytes) -> dict[str, Any]:
    try:
        answer = json.loads(output.splitlines()[-1])
    except (IndexError, ValueError):
        return {}
    return answer if isinstance(answer, dict) else {}
