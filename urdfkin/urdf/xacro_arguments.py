"""Which arguments a xacro file takes, so that one that it does not take can be refused: xacro ignores it.

The file and what it includes are read, not expanded. An include whose name is computed, or that is not found,
may declare anything: then nothing is known, and nothing is refused.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as Xml
from collections.abc import Iterable
from pathlib import Path

from urdfkin.errors import UnknownNameError
from urdfkin.urdf.packages import find_package

#: Bytes of a file, and files, beyond which nothing is known either.
MOST, MOST_FILES = 10_000_000, 200

_USED = re.compile(r"\$\(arg\s+([^\s()]+)\s*\)")
_FIND = re.compile(r"\$\(find\s+([^\s()]+)\s*\)")
_COMPUTED = re.compile(r"\$[({]|[*?\[]")


def check_arguments(path: Path, given: Iterable[str]) -> None:
    """Refuse arguments that a xacro file neither declares nor uses.

    Raises:
        UnknownNameError: with those that it takes.
    """
    given = list(given)
    known = arguments_of(path) if given else None
    for name in given if known is not None else ():
        if name not in (known or ()):
            raise UnknownNameError("xacro argument", name, known or (), where=str(path))


def arguments_of(path: Path) -> set[str] | None:
    """Names in `<xacro:arg>` and `$(arg)` of a file and its includes; None where not all can be read."""
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
                included = _included(element.get("filename", ""), file)
                if included is None:
                    return None
                files.append(included)
    return names


def _read(file: Path) -> Xml.Element | None:
    try:
        if file.stat().st_size > MOST:
            return None
        return Xml.fromstring(file.read_bytes())
    except (OSError, ValueError, Xml.ParseError):
        return None


def _included(name: str, beside: Path) -> Path | None:
    """The file that an include names, or None where that is computed."""
    if match := _FIND.match(name):
        folder = find_package(match[1], beside)
        name = name[match.end() :].lstrip("/")
        if folder is None or _COMPUTED.search(name):
            return None
        return folder / name
    return None if _COMPUTED.search(name) or not name else beside.parent / name
