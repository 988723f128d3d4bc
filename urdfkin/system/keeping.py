"""Folders for what is kept between runs: one for each state of the sources that it is made from.

What is kept is run or unpickled later, so that a folder counts only if nobody but its user can have written
there. What an upgrade leaves behind is deleted when nobody has used it for a month.
"""

from __future__ import annotations

import contextlib
import grp
import hashlib
import os
import pwd
import shutil
import stat
import time
import warnings
from collections.abc import Iterable
from pathlib import Path

import platformdirs

from urdfkin.system.files import read_bytes

#: How files in a folder are sealed: what was sealed otherwise lies in other folders.
_SEAL = "sealed with its name"
_A_MONTH = 30 * 24 * 3600.0
_USED = ".used"
#: Whose folders may lie above one's own: the superuser's, and those of nobody, as which a container sees the
#: superuser outside of it.
_TRUSTED = (0, 65534)


class CacheWarning(UserWarning):
    """Something that was to be kept between runs is not; results do not depend on it."""


def kept_folder(kind: str, sources: Iterable[Path], *besides: str, root: Path | None = None) -> Path | None:
    """A folder of this user's alone, made if need be; None, with a warning, if there can be none.

    Args:
        kind: What is kept; the folder's name begins with it.
        sources: Files on whose contents it depends.
        besides: Other things on which it depends.
        root: Where; None for the user's cache.
    """
    digest = hashlib.sha256("\n".join([_SEAL, *besides]).encode())
    for source in sources:
        digest.update(read_bytes(source))
    root = root or Path(platformdirs.user_cache_dir("urdfkin"))
    try:
        root.mkdir(mode=0o700, parents=True, exist_ok=True)
        folder = root.resolve() / f"{kind}-{digest.hexdigest()[:16]}"
        folder.mkdir(mode=0o700, exist_ok=True)
        if (reason := _not_ours(folder)) is not None:
            say_once(f"nothing is kept between runs: {reason}")
            return None
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle
        reason = getattr(error, "strerror", None) or str(error)
        say_once(f"nothing can be kept in {root}: {reason}; set XDG_CACHE_HOME to another folder")
        return None
    with contextlib.suppress(OSError):  # on a full or read-only disc, what is there is there
        (folder / _USED).touch()
        _forget_unused(root, kind)
    return folder


def say_once(message: str) -> None:
    """Warn, but never of the same thing twice in a process."""
    if message not in _said:
        _said.add(message)
        warnings.warn(message, CacheWarning, stacklevel=3)


_said: set[str] = set()


def _not_ours(folder: Path) -> str | None:
    """Why somebody else could have written what lies in a folder; None if nobody could.

    Who can write in a folder above it can put another in its place, unless it is sticky, as /tmp is.
    """
    me = os.geteuid()
    for place in (folder, *folder.parents):
        found = place.stat()
        if found.st_uid != me and (place == folder or found.st_uid not in _TRUSTED):
            return f"{place} belongs to another user; set XDG_CACHE_HOME to a folder of your own"
        everybody = found.st_mode & stat.S_IWOTH
        group = found.st_mode & stat.S_IWGRP and not _is_private(found.st_gid)
        if (everybody or group) and (place == folder or not found.st_mode & stat.S_ISVTX):
            whom = "everybody" if everybody else "a group"
            return f"{whom} may write in {place}; take that right away (chmod go-w) and delete {folder}"
    return None


def _is_private(group: int) -> bool:
    """Whether a group is the one that many systems make for each user."""
    try:
        name, found = pwd.getpwuid(os.geteuid()).pw_name, grp.getgrgid(group)
    except KeyError:
        return False
    return found.gr_name == name and set(found.gr_mem) <= {name}


def _forget_unused(root: Path, kind: str) -> None:
    """Delete folders of this kind and this user that were last used a month ago."""
    for mark in root.glob(f"{kind}-*/{_USED}"):
        with contextlib.suppress(OSError):
            found = mark.stat()
            if time.time() - found.st_mtime > _A_MONTH and found.st_uid == os.geteuid():
                shutil.rmtree(mark.parent, ignore_errors=True)
