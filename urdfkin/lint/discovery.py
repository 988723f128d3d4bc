"""Which files are meant by what was named: files, folders with all robots in them, and patterns."""

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

#: Files by which ROS's build tools are told to leave a folder alone: copies of what is elsewhere.
LEFT_ALONE = ("COLCON_IGNORE", "AMENT_IGNORE", "CATKIN_IGNORE")


def collected(word: str, settings: Settings, include: Sequence[str], exclude: Sequence[str]) -> list[str]:
    """The files that a word means, in the order of their names.

    Args:
        word: A file, `-`, a name of the catalogue, a folder, or a pattern with `*`, `?`, `[`, `**`.
        settings: Whose folder patterns are taken from.
        include: Patterns of the names of files to take from a folder.
        exclude: Patterns of files and folders to leave out, except a file that is named itself.

    Raises:
        SourceError: a folder or pattern that means no file.
    """
    path = Path(word)
    if word == "-" or word in catalogue():
        return [word]
    if is_folder(path):
        found = sorted(_below(path, settings.root, include, exclude))
        remedy = f"looked for {', '.join(include)}, but in hidden folders and those excluded"
    elif glob.has_magic(word) and not exists(path):
        found = [file for file in _matching(word) if not matches(file, exclude, settings.root)]
        remedy = None
    else:
        return [f"./{word}" if word.lstrip().startswith("<") else word]
    if not found:
        raise SourceError("no URDF there", where=word, remedy=remedy)
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
    # Path.glob takes no absolute pattern and none that leads up.
    names = map(Path, glob.glob(pattern, recursive=True))  # noqa: PTH207
    return sorted(as_word(name) for name in names if not is_folder(name))
