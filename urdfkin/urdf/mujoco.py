"""The door of MuJoCo: the only module that imports it, when somebody asks."""

from __future__ import annotations

from importlib import metadata
from typing import Any

from urdfkin.errors import InputError


def library() -> Any:
    """MuJoCo.

    Raises:
        InputError: it is not installed.
    """
    try:
        import mujoco  # noqa: PLC0415  an extra, and heavy
    except ImportError:
        raise InputError("MuJoCo is not installed", remedy="pip install 'urdfkin[mujoco]'") from None
    return mujoco


def version() -> str:
    """The version that is installed, found without importing it."""
    try:
        return metadata.version("mujoco")
    except metadata.PackageNotFoundError:
        raise InputError("MuJoCo is not installed", remedy="pip install 'urdfkin[mujoco]'") from None
