"""Find robots by name in the catalogue and in robot_descriptions, and find ROS packages without ROS.

The catalogue has the robots of example-robot-data and urdfkin's own robots. robot_descriptions is a Python
package that clones the repository of a robot into a cache at the first use. urdfkin imports a module of
robot_descriptions only if the package lists the module's name in `DESCRIPTIONS`.

The function `find_package` searches for the folder of a package `name`, and returns the first candidate that
exists. The candidates are, in this order:

| Folders F | Candidates |
|---|---|
| in `ROS_PACKAGE_PATH` | F if F is called `name`, then `F/name`, then each `F/*/name` |
| in `AMENT_PREFIX_PATH` | `F/share/name` |
| all parents of `referring_file`, the nearest first | F if it is the package, then `F/name` |

A parent F is the package if F is called `name`, or if `F/package.xml` declares the package `name`.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from urdfkin.errors import InputError, SourceError, UnknownNameError
from urdfkin.errors.validators import as_str
from urdfkin.system.files import is_folder, may_exist, read_start
from urdfkin.system.resources import example_robots_dir, robots_dir


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """A robot of the catalogue.

    Attributes:
        relative_path: Path of the URDF, relative to the robots folder of urdfkin or of example-robot-data.
        limbs: Base frame and tip frame of each arm, leg or finger. The first limb is the default.
        mimic: Whether the mimic rules of the URDF are valid. If False, urdfkin ignores all
            mimic rules by default.
        mimic_problem: The reason why the mimic rules are invalid, or None.
        poses: Joint values (rad or m) by joint name, for each named pose. Other joints have the value 0. In
            the pose `ready`, they have the middle of their limits if the limits exclude 0.
        is_bundled: Whether urdfkin contains the URDF. If False, example-robot-data contains the URDF.
    """

    name: str
    family: str
    relative_path: Path
    limbs: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    mimic: bool = True
    mimic_problem: str | None = None
    poses: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    is_bundled: bool = False

    @property
    def path(self) -> Path:
        return (robots_dir() if self.is_bundled else example_robots_dir()) / self.relative_path

    @property
    def base_frame(self) -> str | None:
        return next((base for base, _ in self.limbs.values()), None)

    @property
    def tip_frame(self) -> str | None:
        return next((tip for _, tip in self.limbs.values()), None)


@cache
def catalogue() -> Mapping[str, CatalogueEntry]:
    return {
        **_read_catalogue("catalogue.toml", is_bundled=False),
        **_read_catalogue("own.toml", is_bundled=True),
    }


def robots(family: str | None = None) -> tuple[str, ...]:
    """Return the robot names that `load` accepts.

    Args:
        family: A family such as arm, biped, hand, humanoid, quadruped, or text (the robots of the textbook).
            None selects all robots.

    Raises:
        UnknownNameError: the family does not exist.
        InputError: `family` is not a string.

    >>> "panda" in robots("arm"), robots("text")
    (True, ('one_link', 'planar_two_link', 'polar', 'elbow'))
    """
    families = {entry.family for entry in catalogue().values()}
    if family is not None and as_str(family, "family") not in families:
        raise UnknownNameError("family", family, families)
    return tuple(name for name, entry in catalogue().items() if family in (None, entry.family))


def example_robot_data_names() -> tuple[str, ...]:
    return tuple(name for name, entry in catalogue().items() if not entry.is_bundled)


def _read_catalogue(file: str, *, is_bundled: bool) -> dict[str, CatalogueEntry]:
    path = robots_dir() / file
    if not path.is_file():
        return {}
    import tomllib

    with path.open("rb") as stream:
        table = tomllib.load(stream)
    entries = {}
    for name, row in table.items():
        limbs = {limb: (base, tip) for limb, (base, tip) in row.pop("limbs", {}).items()}
        place = Path(row.pop("path"))
        entries[name] = CatalogueEntry(
            name=name, relative_path=place, limbs=limbs, is_bundled=is_bundled, **row
        )
    return entries


PACKAGE_PATH_VARIABLES = ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH")

_PACKAGE_NAME = re.compile(rb"<name>([^<]*)</name>")

PACKAGE_SCHEMES = ("package://", "model://")


def split_uri(uri: str) -> tuple[str, str] | None:
    """Return package and path of a `package://` or `model://` address; None for other text."""
    for scheme in PACKAGE_SCHEMES:
        if uri.startswith(scheme):
            package, _, path = uri.removeprefix(scheme).partition("/")
            return package, path
    return None


def find_package(
    name: str,
    referring_file: Path | None = None,
    environ: Mapping[str, str] = os.environ,
    accepts: Callable[[Path], bool] = lambda folder: True,
) -> Path | None:
    """Return the first folder of a package that `accepts` allows.

    The docstring of this module describes the search.
    """
    if not name or name in (".", "..") or "\0" in name:
        return None
    found = filter(is_folder, _candidates(name, referring_file, environ))
    return next(filter(accepts, found), None)


def _candidates(name: str, referring_file: Path | None, environ: Mapping[str, str]) -> Iterator[Path]:
    for entry in search_path("ROS_PACKAGE_PATH", environ):
        if entry.name == name:
            yield entry
        yield entry / name
        yield from (folder / name for folder in _subfolders(entry))
    for entry in search_path("AMENT_PREFIX_PATH", environ):
        yield entry / "share" / name
    if referring_file is not None:
        for folder in referring_file.absolute().parents:
            if folder.name == name or _declares(folder / "package.xml", name):
                yield folder
            yield folder / name


def _declares(manifest: Path, name: str) -> bool:
    try:
        match = _PACKAGE_NAME.search(read_start(manifest, 100_000))
    except OSError:
        return False
    return match is not None and match[1].decode("utf-8", "replace").strip() == name


def search_path(variable: str, environ: Mapping[str, str] = os.environ) -> list[Path]:
    return [Path(entry) for entry in environ.get(variable, "").split(os.pathsep) if entry]


def _subfolders(entry: Path) -> list[Path]:
    try:
        return sorted(child for child in entry.iterdir() if child.is_dir())
    except OSError:
        return []


_DESCRIPTIONS_PACKAGE = "robot_descriptions"
_DESCRIPTION_NAME = re.compile(r"\w+_description")


@dataclass(frozen=True, slots=True)
class ResolvedDescription:
    path: Path
    xacro_args: Mapping[str, object] = field(default_factory=dict)


def find_description(source: object) -> ResolvedDescription | None:
    """Return the file of a robot in robot_descriptions, or None for any other source.

    `source` is the name of a description module, or the module itself. The name of a catalogue robot or of an
    existing file gives None.

    | Error | Cause |
    |---|---|
    | InputError | robot_descriptions is not installed, or the module has no robot file |
    | UnknownNameError | an unknown name |
    | SourceError | the import or download fails |
    """
    if isinstance(source, str) and _DESCRIPTION_NAME.fullmatch(source) is not None:
        if source in catalogue() or may_exist(Path(source)):
            return None
        source = _import_description(source)
    return _find_description_file(source) if isinstance(source, ModuleType) else None


def _import_description(name: str) -> ModuleType:
    if importlib.util.find_spec(_DESCRIPTIONS_PACKAGE) is None:
        remedy = f"pip install {_DESCRIPTIONS_PACKAGE}, or name a file"
        raise InputError(f"{_DESCRIPTIONS_PACKAGE} is not installed", where=name, remedy=remedy)
    from robot_descriptions import DESCRIPTIONS

    if name not in DESCRIPTIONS:
        raise UnknownNameError("robot description", name, DESCRIPTIONS)
    try:
        return importlib.import_module(f"{_DESCRIPTIONS_PACKAGE}.{name}")
    except Exception as error:  # The download raises errors of many classes.
        message = str(error).strip().splitlines() or [type(error).__name__]
        raise SourceError(
            "this robot description cannot be downloaded",
            where=name,
            found=message[-1].strip(),
            remedy="check git and the network: the repository is cloned at the first use",
        ) from error


def _find_description_file(module: Any) -> ResolvedDescription:
    for name in ("URDF_PATH", "XACRO_PATH", "MJCF_PATH"):
        if hasattr(module, name):
            arguments = getattr(module, "XACRO_ARGS", {}) if name == "XACRO_PATH" else {}
            return ResolvedDescription(Path(getattr(module, name)), dict(arguments))
    message = "this module has neither URDF_PATH nor XACRO_PATH nor MJCF_PATH"
    raise InputError(
        message, where=module.__name__, remedy=f"pass a description module of {_DESCRIPTIONS_PACKAGE}"
    )
