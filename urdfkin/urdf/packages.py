"""Where `package://name/...` leads: a documented search that needs no ROS.

In this order, the first folder that exists wins:

1. `ROS_PACKAGE_PATH`: each entry that is called `name`, holds a folder `name`, or holds one one level down
   (as in `src/repository/name`);
2. `AMENT_PREFIX_PATH`: `share/name` below each entry;
3. the folders above the file: one that is called `name`, whose `package.xml` says so, or that holds a
   folder `name`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from urdfkin.system.files import is_folder, read_start

#: The environment's search paths.
VARIABLES = ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH")

_NAME = re.compile(rb"<name>([^<]*)</name>")

#: Schemes that name a package and a path inside it.
SCHEMES = ("package://", "model://")


def split_uri(uri: str) -> tuple[str, str] | None:
    """Package and path of a `package://` address; None for anything else.

    >>> split_uri("package://ur_description/meshes/base.stl")
    ('ur_description', 'meshes/base.stl')
    """
    for scheme in SCHEMES:
        if uri.startswith(scheme):
            package, _, path = uri.removeprefix(scheme).partition("/")
            return package, path
    return None


def find_package(
    name: str,
    beside: Path | None = None,
    environ: Mapping[str, str] = os.environ,
    accepts: Callable[[Path], bool] = lambda folder: True,
) -> Path | None:
    """The folder of a package, or None.

    Args:
        name: The package.
        beside: The file that refers to it; its parents are searched.
        environ: The environment.
        accepts: Whether a folder that is found may be it.
    """
    if not name or name in (".", "..") or "\0" in name:
        return None
    found = filter(is_folder, _candidates(name, beside, environ))
    return next((folder for folder in found if accepts(folder)), None)


def _candidates(name: str, beside: Path | None, environ: Mapping[str, str]) -> Iterator[Path]:
    for entry in _entries(environ.get("ROS_PACKAGE_PATH")):
        if entry.name == name:
            yield entry
        yield entry / name
        yield from (folder / name for folder in _folders(entry))
    for entry in _entries(environ.get("AMENT_PREFIX_PATH")):
        yield entry / "share" / name
    if beside is not None:
        for folder in beside.absolute().parents:
            if folder.name == name or _declares(folder / "package.xml", name):
                yield folder
            yield folder / name


def _declares(manifest: Path, name: str) -> bool:
    """Whether a package's manifest gives it this name."""
    try:
        match = _NAME.search(read_start(manifest, 100_000))
    except OSError:
        return False
    return match is not None and match[1].decode("utf-8", "replace").strip() == name


def _entries(variable: str | None) -> list[Path]:
    return [Path(entry) for entry in (variable or "").split(os.pathsep) if entry]


def _folders(entry: Path) -> list[Path]:
    try:
        return sorted(child for child in entry.iterdir() if child.is_dir())
    except OSError:
        return []
