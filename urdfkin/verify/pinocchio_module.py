"""The door of Pinocchio: the only module that imports it, and that knows an impostor from it.

PyPI's project `pinocchio` is another one (plugins for the test runner nose, with a module of the same name);
Pinocchio's wheels are called `pin`. The other's module lies where Python looks first, so that it is found
even where both are installed.
"""

from __future__ import annotations

import importlib.metadata
from pathlib import Path
from typing import Any

from urdfkin.errors import InstallationError, Question

#: The versions that check: what accelerations and J-dot mean in them was measured.
_MAJOR = "4"
_WANTED = "'pin>=4,<5'"


def pinocchio() -> Any:
    """Pinocchio itself.

    Raises:
        InstallationError: it is not installed, or another project or version is found under its name.
    """
    try:
        import pinocchio as found  # noqa: PLC0415  heavy: only when something is checked
    except ImportError as error:
        if error.name == "pinocchio":
            raise InstallationError("Pinocchio is not installed", remedy=f"pip install {_WANTED}") from None
        raise InstallationError(
            "Pinocchio cannot be imported",
            found=str(error),
            remedy=f"pip install --force-reinstall {_WANTED}",
        ) from error
    if not hasattr(found, "buildModelFromXML"):
        raise _impostor(found)
    if not str(found.__version__).startswith(f"{_MAJOR}."):
        raise InstallationError(
            f"urdfkin is checked by Pinocchio {_MAJOR}",
            where=str(found.__file__),
            found=str(found.__version__),
            remedy=f"pip install {_WANTED}",
        )
    return found


def version() -> str:
    """The version of the Pinocchio that checks, as the module in use says; "not installed" where none can."""
    try:
        return str(pinocchio().__version__)
    except InstallationError:
        return "not installed"


def _impostor(found: Any) -> InstallationError:
    """What is installed under Pinocchio's name, and how to be rid of it."""
    file = found.__file__ or next(iter(found.__path__), "a folder without modules")
    owner = _owner(Path(file))
    cure = f"pip uninstall {owner[0]}" if owner else f"rename or remove {file}"
    what = f"{owner[0]} {owner[1]}, another project" if owner else "a file of no installed package"
    return InstallationError(
        "the module `pinocchio` is not Pinocchio, the library that checks results",
        where=str(file),
        found=what,
        remedy=f"Pinocchio's package is called pin: {cure}; pip install {_WANTED}",
        question=Question.WRONG_PINOCCHIO,
    )


def _owner(file: Path) -> tuple[str, str] | None:
    """Name and version of the installed project that a file belongs to."""
    for project in importlib.metadata.distributions():
        for one in project.files or ():
            if one.name == file.name and Path(str(project.locate_file(one))) == file:
                return project.metadata["Name"], project.version
    return None
