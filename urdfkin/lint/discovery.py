"""Find the files to check: the arguments of `urdfkin check` are files, folders or patterns."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from urdfkin.errors import SourceError
from urdfkin.lint.settings import Settings, matches
from urdfkin.system.files import exists, is_folder
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.sources import as_word

#: Marker files of ROS's build tools: a folder with one of them is skipped.
LEFT_ALONE = ("COLCON_IGNORE", "AMENT_IGNORE", "CATKIN_IGNORE")


def collected(word: str, settings: Settings, include: Sequence[str], exclude: Sequence[str]) -> list[str]:
    """Return the files for one argument, sorted by name.

    Args:
        word: A file, `-`, a catalogue name, a folder, or a pattern with `*`, `?`, `[`, `**`.
        settings: The settings; patterns are relative to their folder.
        include: Patterns of file names to select in a folder.
        exclude: Patterns of files and folders to skip. A file that is itself the argument is not skipped.

    Raises:
        SourceError: a folder or pattern contains no file.
    """
    path = Path(word)
    if word == "-" or word in catalogue():
        return [word]
    if is_folder(path):
        found = sorted(_below(path, settings.root, include, exclude))
        remedy = f"searched for {', '.join(include)}, except in hidden and excluded folders"
    elif glob.has_magic(word) and not exists(path):
        found = [file for file in _matching(word) if not matches(file, exclude, settings.root)]
        remedy = None
    else:
        return [f"./{word}" if word.lstrip().startswith("<") else word]
    if not found:
        raise SourceError("no URDF found", where=word, remedy=remedy)
    return found


def _below(folder: Path, root: Path, include: Sequence[str], exclude: Sequence[str]) -> Iterator[str]:
    for here, folders, files in os.walk(folder):
        if any(name in LEFT_ALONE for name in files):
            folders.clear()
            continue
        place = Path(here)
        folders[:] = [
            name
            for name in folders
            if not name.startswith(".") and not matches(str(place / name), exclude, root)
        ]
        named = (place / name for name in files if any(fnmatchcase(name, pattern) for pattern in include))
        yield from (as_word(file) for file in named if not matches(str(file), exclude, root))


def _matching(pattern: str) -> list[str]:
    # Path.glob accepts neither absolute patterns nor "..".
    names = map(Path, glob.glob(pattern, recursive=True))  # noqa: PTH207
    return sorted(as_word(name) for name in names if not is_folder(name))
