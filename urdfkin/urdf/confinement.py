"""A process that can compute and read the files it was shown, and nothing else.

Limits of the kernel bound what it takes; Python's audit events, which every open file, new process, socket
and import raises, refuse the rest. Neither can be taken back. This is a second wall, behind `expressions`: a
program in full control of the interpreter may find a way around events, not around limits.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from urdfkin.urdf.expressions import RefusedError

#: Bytes of memory, of which an interpreter with its libraries takes a tenth.
MEMORY = 2 * 1024**3

#: What an expansion has to do with, beyond the files, which are looked at one by one.
_HARMLESS = {"builtins.id", "compile", "glob.glob", "glob.glob/2", "object.__getattr__", "sys._getframe"}
_READING = {"open", "os.listdir", "os.scandir"}
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


@dataclass(slots=True)
class Ground:
    """The files that may be read: of strangers' making, and no one else's.

    Attributes:
        roots: Folders and files that may be read, but nothing hidden below them. What links lead to must lie
            in one of them, too.
        installed: Folders in which links may lead to a package elsewhere, as where sources are installed by
            links.
    """

    roots: list[str] = field(default_factory=list)
    installed: list[str] = field(default_factory=list)

    @classmethod
    def around(cls, path: Path, search: list[str], arguments: list[str]) -> Ground:
        """What belongs to a file: its folder, its package, its repository, and what the user named.

        Args:
            path: The xacro file.
            search: Folders in which the user has packages.
            arguments: Values the user gave; those that are paths may be read.
        """
        wide = [path.parent / argument for argument in arguments if "\0" not in argument]
        for mark in ("package.xml", ".git"):
            wide += [folder for folder in path.resolve().parents if _exists(folder / mark)][:1]
        home = os.path.expanduser("~")  # noqa: PTH111  which says nothing where there is none
        everything = {Path(home).resolve(), Path("/")}
        real = [place.resolve() for place in wide if _exists(place)]
        near = [path, path.parent, path.resolve().parent, *map(Path, search)]
        roots = [*(place.resolve() for place in near), *(place for place in real if place not in everything)]
        return cls([str(root) for root in roots], search)

    def holds(self, path: str) -> bool:
        """Whether a file or folder may be read."""
        real = os.path.realpath(path)
        if os.path.basename(real) == "package.xml":  # noqa: PTH119  whose name the search for packages reads
            return True
        roots = self.roots
        if any(_lies_in(root, os.path.abspath(path)) for root in self.installed):  # noqa: PTH100  no links
            roots = [*roots, *_package_of(real)]
        return any(_lies_in(root, real) for root in roots)


def _package_of(path: str) -> list[str]:
    """The package a file lies in, if it does."""
    return [str(folder) for folder in Path(path).parents if _exists(folder / "package.xml")][:1]


def _lies_in(root: str, path: str) -> bool:
    """Whether a path is a root or lies below, and nothing below the root is hidden."""
    if path == root:
        return True
    above = root.rstrip(os.sep) + os.sep
    return path.startswith(above) and not any(p.startswith(".") for p in Path(path[len(above) :]).parts)


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # too long a name is no path
        return False


def limit(seconds: int) -> None:
    """Bound this process's memory and time; it may write no file and start no process."""
    import resource  # noqa: PLC0415  not on every system

    bounds = {
        resource.RLIMIT_AS: MEMORY,
        resource.RLIMIT_CPU: seconds,
        resource.RLIMIT_FSIZE: 0,
        resource.RLIMIT_NPROC: 0,
        resource.RLIMIT_NOFILE: 64,
        resource.RLIMIT_CORE: 0,
    }
    for kind, most in bounds.items():
        hard = resource.getrlimit(kind)[1]
        least = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (least, least))


def confine(holds: Callable[[str], bool]) -> None:
    """From here on this process reads the files it may and does nothing else that Python tells of.

    Args:
        holds: Whether a file or folder may be read.
    """

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        if event in _HARMLESS:
            return
        if event not in _READING:
            raise RefusedError(f"a xacro file may not do that: {event} {arguments!r:.80}")
        path, *how = arguments
        if event == "open" and how[-1] & _WRITING:
            raise RefusedError(f"a xacro file may write no file: {path!r}")
        if not isinstance(path, str | bytes | os.PathLike) or not holds(os.fsdecode(path)):
            raise RefusedError(
                f"{path!r} lies neither in the file's folder, package or repository nor in a package on"
                " ROS_PACKAGE_PATH or AMENT_PREFIX_PATH, or it is hidden"
            )

    sys.addaudithook(watch)
