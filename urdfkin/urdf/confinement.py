"""Confine the current process, so that it can only compute and read allowed files.

The operating system limits the memory and CPU time of the process, and prevents the process from writing
files and from starting other processes. Python raises an audit event for each opened file, new process,
socket and import. An audit hook refuses all events except the allowed events. The hook and the limits remain
until the process ends. A xacro file that controls the Python interpreter could circumvent the hook, but not
the limits.

This confinement is the second defence. The first defence is the module `expressions`, which evaluates the
expressions of a file without Python's `eval`.

On macOS, the memory is not limited.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from urdfkin.urdf.expressions import RefusedError

#: Maximum memory of the process in bytes. Python and the imported libraries need about a tenth of this
#: memory.
MAX_MEMORY = 2 * 1024**3

#: Audit events that are always allowed.
_HARMLESS_EVENTS = {
    "builtins.id",
    "compile",
    "glob.glob",
    "glob.glob/2",
    "object.__getattr__",
    "sys._getframe",
}
#: Audit events that are allowed only for files that the process may read.
_READ_EVENTS = {"open", "os.listdir", "os.scandir"}
_WRITE_FLAGS = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


@dataclass(slots=True)
class AllowedPaths:
    """The files that a confined process may read.

    Attributes:
        roots: Readable files, and folders with readable content, except hidden files and folders.
            The target of a symbolic link must also be in `roots` or in a folder of `roots`.
        package_folders: Folders with installed packages. A symbolic link in these folders may point to a
            package in any other folder. `colcon build --symlink-install` writes such links.
        manifests: The paths of package.xml in the folders above the xacro file. The search for packages reads
            these files.
    """

    roots: list[str] = field(default_factory=list)
    package_folders: list[str] = field(default_factory=list)
    manifests: list[str] = field(default_factory=list)

    @classmethod
    def of_file(cls, path: Path, package_paths: list[str], arguments: list[str]) -> AllowedPaths:
        """Return the paths that urdfkin may read to load the robot file `path`.

        `roots` contains the folder, the ROS package and the git repository of the file. `roots` also contains
        the folders in `package_paths` and the existing paths in `arguments`. The home folder and `/` do not
        count as package, repository or argument.
        """
        wide = [path.parent / argument for argument in arguments if "\0" not in argument]
        for file_name in ("package.xml", ".git"):
            wide += _nearest_folder_with(file_name, path.resolve())
        home = os.path.expanduser("~")  # noqa: PTH111  Path.home() may fail
        everything = {Path(home).resolve(), Path("/")}
        real = [place.resolve() for place in wide if _exists(place)]
        near = [path, path.parent, path.resolve().parent, *map(Path, package_paths)]
        roots = [*(place.resolve() for place in near), *(place for place in real if place not in everything)]
        manifests = [str(folder / "package.xml") for folder in path.absolute().parents]
        return cls([str(root) for root in roots], package_paths, manifests)

    def allows(self, path: str) -> bool:
        real = os.path.realpath(path)
        as_written = os.path.abspath(path)  # noqa: PTH100  resolve() follows links
        if as_written in self.manifests and os.path.basename(real) == "package.xml":  # noqa: PTH119
            return True
        roots = self.roots
        if any(_is_inside(root, as_written) for root in self.package_folders):
            roots = [*roots, *map(str, _nearest_folder_with("package.xml", Path(real)))]
        return any(_is_inside(root, real) for root in roots)


def _nearest_folder_with(file_name: str, path: Path) -> list[Path]:
    return [folder for folder in path.parents if _exists(folder / file_name)][:1]


def _is_inside(root: str, path: str) -> bool:
    """Return whether `path` is `root`, or is below `root` without a hidden folder or file below `root`."""
    if path == root:
        return True
    above = root.rstrip(os.sep) + os.sep
    return path.startswith(above) and not any(p.startswith(".") for p in Path(path[len(above) :]).parts)


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # The operating system refuses a name that is too long.
        return False


def limit_process(seconds: int) -> None:
    """Limit memory and CPU time of this process; forbid writing files and starting processes."""
    import resource

    bounds = {
        resource.RLIMIT_AS: MAX_MEMORY,
        resource.RLIMIT_CPU: seconds,
        resource.RLIMIT_FSIZE: 0,
        resource.RLIMIT_NPROC: 0,
        resource.RLIMIT_NOFILE: 64,
        resource.RLIMIT_CORE: 0,
    }
    if sys.platform == "darwin":  # macOS does not support a limit on the address space.
        del bounds[resource.RLIMIT_AS]
    for kind, most in bounds.items():
        hard = resource.getrlimit(kind)[1]
        least = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (least, least))


def confine(is_allowed: Callable[[str], bool]) -> None:
    """Permit only harmless audit events and reads of allowed files, until this process ends.

    Any other event raises RefusedError.
    """

    def refuse_forbidden(event: str, arguments: tuple[Any, ...]) -> None:
        if event in _HARMLESS_EVENTS:
            return
        if event not in _READ_EVENTS:
            raise RefusedError(f"a xacro file may not do this: {event} {arguments!r:.80}")
        path, *how = arguments
        if event == "open" and how[-1] & _WRITE_FLAGS:
            raise RefusedError(f"a xacro file may not write a file: {path!r}")
        if not isinstance(path, str | bytes | os.PathLike) or not is_allowed(os.fsdecode(path)):
            raise RefusedError(
                f"{path!r} may not be read: the file is hidden, or outside the allowed folders. A xacro"
                " file may read its own folder, package and repository. It may also read the folders on"
                " ROS_PACKAGE_PATH and AMENT_PREFIX_PATH, the packages that $(find) finds, and a package.xml"
                " in a folder above the xacro file. It may also read files and folders that the user passes"
                " as arguments"
            )

    sys.addaudithook(refuse_forbidden)
