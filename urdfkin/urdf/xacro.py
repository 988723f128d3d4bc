"""Expand a .xacro file to URDF text, in a separate process with restricted rights.

A xacro file is a program, and may come from an untrusted source. docs/xacro.md lists the operations that a
xacro file may do. The module `expanding` contains the code of the separate process.

xacro itself ignores an argument that the file neither declares nor uses, but urdfkin raises an error. If
urdfkin cannot read one of the included files, every argument is accepted.
"""

from __future__ import annotations

import json
import os
import re
import xml.etree.ElementTree as Xml
from collections.abc import Callable, Mapping
from dataclasses import asdict
from importlib.util import find_spec
from keyword import iskeyword
from math import ceil
from pathlib import Path
from typing import Any

from urdfkin.errors import QuestionsSection, SourceError, UnknownNameError, UrdfkinError
from urdfkin.system.files import read_bytes
from urdfkin.system.lazy_import import install_command
from urdfkin.system.processes import python_command, run_python
from urdfkin.urdf.catalogue import PACKAGE_PATH_VARIABLES, search_path
from urdfkin.urdf.confinement import AllowedPaths
from urdfkin.urdf.expressions import RefusedError

#: Limits of the search for declared arguments: bytes per file, and number of files.
MAX_SEARCHED_BYTES, MAX_SEARCHED_FILES = 10_000_000, 200

#: Function that returns a package's folder, or raises LookupError.
FindPackage = Callable[[str], str]

_ARGUMENT_USE = re.compile(r"\$\(arg\s+([^\s()]+)\s*\)")
_ARGUMENT_CALL = re.compile(r"""\bxacro\.arg\(\s*(?:(['"])([^'"]*)\1\s*\))?""")
_EVALUATION = re.compile(r"\$\(eval\s+([^)]*)")
#: A text in quotation marks, or a name.
_TEXT_OR_NAME = re.compile(r"""'[^']*'|"[^"]*"|(?<![\w.])([A-Za-z_]\w*)""")
_PACKAGE_USE = re.compile(r"\$\(find\s+([^\s()]+)\s*\)")
_COMPUTED_NAME = re.compile(r"\$[({]|[*?\[]")


def find_arguments(path: Path, find: FindPackage) -> set[str] | None:
    """Return the names of the arguments that a xacro file and its included files declare or use.

    Return None if the names may be incomplete: a file cannot be found or read, the name of a file or an
    argument is computed, or there are more than `MAX_SEARCHED_FILES` files.
    """
    names, files, seen = set[str](), [path.absolute()], set[Path]()
    try:
        while files:
            file = files.pop()
            if file in seen:
                continue
            seen.add(file)
            if len(seen) > MAX_SEARCHED_FILES:
                return None
            for element in Xml.fromstring(read_bytes(file, MAX_SEARCHED_BYTES)).iter():
                for text in (*element.attrib.values(), element.text or "", element.tail or ""):
                    names |= _find_used_arguments(text)
                namespace, _, tag = str(element.tag).rpartition("}")
                if "xacro" in namespace and tag == "arg":
                    names.add(element.get("name", ""))
                if "xacro" in namespace and tag == "include":
                    files.append(_find_included_file(element.get("filename", ""), file, find))
    except (SourceError, RefusedError, LookupError, ValueError, Xml.ParseError):
        return None
    return names


def _find_used_arguments(text: str) -> set[str]:
    """Return the names of arguments in a text, and all names in `$(eval ...)`.

    Raise LookupError if the name in a call of `xacro.arg` is computed.
    """
    names = set(_ARGUMENT_USE.findall(text))
    for call in _ARGUMENT_CALL.finditer(text):
        if call[2] is None:
            raise LookupError(call[0])
        names.add(call[2])
    for evaluation in _EVALUATION.findall(text):
        names.update(name for name in _TEXT_OR_NAME.findall(evaluation) if name and not iskeyword(name))
    return names


def _find_included_file(name: str, referring_file: Path, find: FindPackage) -> Path:
    """Return the path of an included file; raise LookupError for a computed name or an unknown package."""
    folder = referring_file.parent
    if match := _PACKAGE_USE.match(name):
        folder = Path(find(match[1]))
        name = name[match.end() :].lstrip("/")
    if _COMPUTED_NAME.search(name) or not name:
        raise LookupError(name)
    return folder / name


#: Maximum time of an expansion (s), because a macro may call itself without end.
EXPANSION_TIMEOUT = 60.0

MAX_EXPANDED_BYTES = 100_000_000


class XacroError(UrdfkinError):
    pass


def expand(path: Path, arguments: Mapping[str, str], *, timeout: float = EXPANSION_TIMEOUT) -> bytes:
    """Return the URDF of a xacro file, as UTF-8.

    | Error | Cause |
    |---|---|
    | SourceError | a missing file |
    | UnknownNameError | an argument that the file neither declares nor uses |
    | XacroError | xacrodoc is not installed |
    | XacroError | the expansion fails, or takes more than `timeout` seconds |
    """
    if not path.is_file():
        raise SourceError("no such file", where=str(path))
    if find_spec("xacrodoc") is None:
        message = "a .xacro file needs the package xacrodoc"
        remedy = f"{install_command('xacro')}, or expand the file with: xacro FILE > robot.urdf"
        raise XacroError(message, where=str(path), remedy=remedy, question=QuestionsSection.XACRO)
    command = python_command(
        "from urdfkin.urdf.expanding import serve; serve()", options=("-B", "-X", "utf8")
    )
    output, status = run_python(
        command, _make_request(path.absolute(), arguments, timeout), timeout, MAX_EXPANDED_BYTES
    )
    if status is None:
        raise XacroError("xacro did not finish", where=str(path), found=f"{timeout:g} s")
    if len(output) > MAX_EXPANDED_BYTES:
        raise XacroError(
            "the expanded URDF is too long", where=str(path), found=f"more than {MAX_EXPANDED_BYTES} bytes"
        )
    answer = _parse_answer(output)
    if "urdf" in answer:
        if isinstance(names := answer.get("arguments"), list):  # The process is not trusted.
            declared = [str(name) for name in names]
            if unknown := [name for name in arguments if name not in declared]:
                raise UnknownNameError("xacro argument", unknown[0], declared, where=str(path))
        return str(answer["urdf"]).encode()
    reason = answer.get("error") or f"the process of xacro ended with status {status}"
    raise XacroError(
        "xacro cannot expand the file",
        where=str(path),
        found=str(reason).strip() or None,
        remedy="set arguments with --xacro-arg NAME:=VALUE, and the folders of packages in ROS_PACKAGE_PATH;"
        " the xacro file may read a file or folder if its path is the VALUE of an argument; docs/xacro.md"
        " lists the allowed operations",
        question=QuestionsSection.XACRO,
    )


def _make_request(path: Path, arguments: Mapping[str, str], timeout: float) -> bytes:
    paths = {
        name: [str(folder.absolute()) for folder in search_path(name)] for name in PACKAGE_PATH_VARIABLES
    }
    installed = [folder for folders in paths.values() for folder in folders]
    request = {
        "path": str(path),
        "arguments": dict(arguments),
        "search": {name: os.pathsep.join(folders) for name, folders in paths.items()},
        "allowed_paths": asdict(AllowedPaths.of_file(path, installed, list(arguments.values()))),
        "seconds": ceil(timeout) + 1,
    }
    return json.dumps(request).encode()


def _parse_answer(output: bytes) -> dict[str, Any]:
    try:
        answer = json.loads(output.splitlines()[-1])
    except (IndexError, ValueError):
        return {}
    return answer if isinstance(answer, dict) else {}
