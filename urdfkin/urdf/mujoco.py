"""The door of MuJoCo: the only module that imports it, when somebody asks."""

from __future__ import annotations

import warnings
from typing import Any

from urdfkin.errors import InputError
from urdfkin.system.lazy_import import installed_version


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


def compiled(spec: Any) -> Any:
    """MuJoCo's model of a specification, whatever it warns of: that is about dynamics."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return spec.compile()


def version() -> str:
    """The version that is installed, found without importing it."""
    if (found := installed_version("mujoco")) is None:
        raise InputError("MuJoCo is not installed", remedy="pip install 'urdfkin[mujoco]'")
    return found
