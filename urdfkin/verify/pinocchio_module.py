"""Import Pinocchio, and detect a different project of the same name.

No other module imports Pinocchio. On PyPI, Pinocchio has the name `pin`. The PyPI project `pinocchio` is a
different one: plugins for the test runner nose, in a module that is also called `pinocchio`. If both projects
are installed, Python finds the module of the plugins first.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from urdfkin.errors import InstallationError, Question

#: Supported versions; the definitions of accelerations and J-dot were tested with them.
_MAJOR = "4"
_WANTED = "'pin>=4,<5'"


def pinocchio() -> Any:
    """Return the module of Pinocchio.

    Raises:
        InstallationError: Pinocchio is not installed, has an unsupported version, or is a different project
            of the same name.
    """
    try:
        import pinocchio as found  # noqa: PLC0415  slow to import, needed for checks only
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
            f"urdfkin needs Pinocchio {_MAJOR} for its checks",
            where=str(found.__file__),
            found=str(found.__version__),
            remedy=f"pip install {_WANTED}",
        )
    return found


def version() -> str:
    """Return the version of Pinocchio; "not installed" if no supported version is installed."""
    try:
        return str(pinocchio().__version__)
    except InstallationError:
        return "not installed"


def _impostor(found: Any) -> InstallationError:
    """Return the error for a different project with Pinocchio's name; its message states the remedy."""
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
    """Return the name and the version of the installed project that contains a file."""
    from importlib import metadata  # noqa: PLC0415  for an error only

    for project in metadata.distributions():
        for one in project.files or ():
            if one.name == file.name and Path(str(project.locate_file(one))) == file:
                return project.metadata["Name"], project.version
    return None
