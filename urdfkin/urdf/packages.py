"""Where `package://name/...` leads: a documented search that needs no ROS.

In this order, the first folder that exists wins:

1. `ROS_PACKAGE_PATH`: each entry that is called `name`, holds a folder `name`, or holds one one level down
   (as in `src/repository/name`);
2. `AMENT_PREFIX_PATH`: `share/name` below each entry;
3. the folders above the file: one that is called `name`, whose `package.xml` says so, or that holds a
   folder `name`.


The door of robot_descriptions: robots by the names of that package, which fetches them when first asked.

Nothing is imported that the package does not list as a description; what it then does, cloning a repository
into its own cache, it does because the user has named one.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from urdfkin.errors import InputError, SourceError, UnknownNameError
from urdfkin.system.files import exists, is_folder, read_start
from urdfkin.urdf.catalogue import catalogue

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


_PACKAGE = "robot_descriptions"
_DESCRIPTION_NAME = re.compile(r"\w+_description")


@dataclass(frozen=True, slots=True)
class Described:
    """Where a description's file lies, and what a .xacro file is to be expanded with."""

    path: Path
    xacro_args: Mapping[str, object] = field(default_factory=dict)


def described(source: object) -> Described | None:
    """The file of a description, by its module or its name; None for any other source.

    Raises:
        InputError: the package is not installed, or the description has no URDF and no MJCF.
        UnknownNameError: it has none of that name; the nearest are offered.
        SourceError: it cannot be fetched.
    """
    if isinstance(source, str) and _DESCRIPTION_NAME.fullmatch(source) is not None:
        if source in catalogue() or exists(Path(source)):
            return None
        source = _module(source)
    return _file(source) if isinstance(source, ModuleType) else None


def _module(name: str) -> ModuleType:
    if importlib.util.find_spec(_PACKAGE) is None:
        raise InputError(
            f"{_PACKAGE} is not installed", where=name, remedy=f"pip install {_PACKAGE}, or name a file"
        )
    from robot_descriptions import DESCRIPTIONS  # noqa: PLC0415  only for who names one

    if name not in DESCRIPTIONS:
        raise UnknownNameError("robot description", name, DESCRIPTIONS)
    try:
        return importlib.import_module(f"{_PACKAGE}.{name}")
    except Exception as error:  # git's own, of which there are many kinds
        said = str(error).strip().splitlines() or [type(error).__name__]
        raise SourceError(
            "this robot description cannot be fetched",
            where=name,
            found=said[-1].strip(),
            remedy="its repository is cloned when it is first asked for, which needs git and the network",
        ) from error


def _file(module: Any) -> Described:
    if hasattr(module, "URDF_PATH"):
        return Described(Path(module.URDF_PATH))
    if hasattr(module, "XACRO_PATH"):
        return Described(Path(module.XACRO_PATH), dict(getattr(module, "XACRO_ARGS", {})))
    if hasattr(module, "MJCF_PATH"):
        return Described(Path(module.MJCF_PATH))
    raise InputError(
        "a module is a robot where it has URDF_PATH, XACRO_PATH or MJCF_PATH",
        where=module.__name__,
        remedy=f"a description of {_PACKAGE} has",
    )
