"""Import MuJoCo on demand."""

from __future__ import annotations

import warnings
from typing import Any

from urdfkin.errors import InputError
from urdfkin.system.lazy_import import install_command, installed_version


def import_mujoco() -> Any:
    try:
        import mujoco
    except ImportError:
        raise InputError("MuJoCo is not installed", remedy=install_command("mujoco")) from None
    return mujoco


def compile_spec(spec: Any) -> Any:
    """Compile a specification; ignore MuJoCo's warnings, which are about dynamics."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return spec.compile()


def version() -> str:
    if (found := installed_version("mujoco")) is None:
        raise InputError("MuJoCo is not installed", remedy=install_command("mujoco"))
    return found
