"""Folders for what is kept between runs: one for each state of the sources that it is made from.

What is kept is run or unpickled later, so that a folder counts only if nobody but its user can have written
there. What an upgrade leaves behind is deleted when nobody has used it for a month.


Files that are kept between runs, each with a digest: damaged or renamed ones are noticed, and made anew.

Half a file, or one with a flipped bit, might not be read, kill the process, or compute something else. The
digest is of the file's name too, and of its folder's, which say what the content was made from: a file in
another one's place would be another robot's.
"""

from __future__ import annotations

import contextlib
import grp
import hashlib
import os
import pwd
import shutil
import stat
import tempfile
import time
import warnings
from collections.abc import Iterable
from pathlib import Path

import platformdirs

from urdfkin.errors import SourceError
from urdfkin.system.files import MOST_DATA, read_bytes, read_if_there

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


_DIGEST = hashlib.sha256().digest_size


def put(place: Path, data: bytes) -> None:
    """Write a sealed file, whole or not at all; where it cannot be written, that is said and nothing else."""
    name = ""
    try:
        with tempfile.NamedTemporaryFile(dir=place.parent, prefix=f".{place.name}.", delete=False) as file:
            name = file.name
            file.write(_seal(place, data) + data)
        Path(name).replace(place)
    except OSError as error:
        if name:
            with contextlib.suppress(OSError):
                Path(name).unlink()
        say_once(f"nothing can be kept in {place.parent}: {error.strerror or error}")


def get(place: Path) -> bytes | None:
    """What a sealed file holds; None where there is none, or where it is damaged, which is said."""
    try:
        content = read_if_there(place, MOST_DATA)
    except SourceError as error:
        report_damaged(place, error.found or error.what)
        return None
    if content is None:
        return None
    seal, data = content[:_DIGEST], content[_DIGEST:]
    if _seal(place, data) != seal:
        report_damaged(place, "its content is not what was written under this name")
        return None
    return data


def _seal(place: Path, data: bytes) -> bytes:
    digest = hashlib.sha256()
    for part in (os.fsencode(place.parent.name), os.fsencode(place.name), data):
        digest.update(len(part).to_bytes(8, "big") + part)
    return digest.digest()


def report_damaged(place: Path, reason: str) -> None:
    """Say that a file cannot be used; what it held is made and written anew."""
    say_once(f"{place} is damaged and is made anew: {reason}")
