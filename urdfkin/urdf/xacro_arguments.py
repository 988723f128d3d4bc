"""Which arguments a xacro file takes, so that one that it does not take can be refused: xacro ignores it.

The file and what it includes are read, not expanded, in the confined process that expands them. An include
whose name is computed, that is not found, or that may not be read, may declare anything: then nothing is
known, and nothing is refused.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as Xml
from collections.abc import Callable, Collection, Iterable
from pathlib import Path

from urdfkin.errors import SourceError, UnknownNameError
from urdfkin.system.files import read_bytes
from urdfkin.urdf.expressions import RefusedError

#: Bytes of a file, and files, beyond which nothing is known either.
MOST, MOST_FILES = 10_000_000, 200

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
        return Xml.fromstring(read_bytes(file, MOST))
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
