"""The door of robot_descriptions: robots by the names of that package, which fetches them when first asked.

Nothing is imported that the package does not list as a description; what it then does, cloning a repository
into its own cache, it does because the user has named one.
"""

from __future__ import annotations

import importlib
import importlib.util
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from urdfkin.errors import InputError, SourceError, UnknownNameError
from urdfkin.system.files import exists
from urdfkin.urdf.catalogue import catalogue

_PACKAGE = "robot_descriptions"
_NAME = re.compile(r"\w+_description")


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
    if isinstance(source, str) and _NAME.fullmatch(source) is not None:
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
