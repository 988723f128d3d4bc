"""Store results in a cache on disk, with a checksum in each file.

urdfkin executes or unpickles cached files, so another user's file could run any code. A folder is therefore
used only if no other user can write to it. The name of a folder contains a digest of the source files, so
changed source files get a new folder. A folder that urdfkin has not used for a month is deleted.

A damaged file could crash the process or cause a wrong result, so the file is reported and replaced. The
checksum includes the names of the file and of the folder, because a renamed file could belong to another
robot.
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

#: Version of the checksum; the digest in a folder's name depends on this version.
_CHECKSUM_VERSION = "sealed with its name"
_A_MONTH = 30 * 24 * 3600.0
#: Name of a file whose modification time is the last use of the folder.
_USED = ".used"
#: Users that may own parent folders: root, and the host's root user in some containers.
_TRUSTED = (0, 65534)


class CacheWarning(UserWarning):
    """The cache cannot be used, or a cached file is damaged; the results are not affected."""


def cache_folder(kind: str, sources: Iterable[Path], *texts: str, root: Path | None = None) -> Path | None:
    """Return a cache folder to which only this user can write; warn and return None if this is impossible.

    The folder's name is `kind`, followed by a digest of the files `sources` and of the strings `texts`.
    """
    digest = hashlib.sha256("\n".join([_CHECKSUM_VERSION, *texts]).encode())
    for source in sources:
        digest.update(read_bytes(source))
    root = root or Path(platformdirs.user_cache_dir("urdfkin"))
    try:
        root.mkdir(mode=0o700, parents=True, exist_ok=True)
        folder = root.resolve() / f"{kind}-{digest.hexdigest()[:16]}"
        folder.mkdir(mode=0o700, exist_ok=True)
        if (reason := _unsafe_reason(folder)) is not None:
            say_once(f"the cache is not used: {reason}")
            return None
    # A loop of symbolic links raises RuntimeError.
    except (OSError, RuntimeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        say_once(f"the cache cannot be written in {root}: {reason}; set XDG_CACHE_HOME to another folder")
        return None
    # On a full or read-only disk, existing files are still readable.
    with contextlib.suppress(OSError):
        (folder / _USED).touch()
        _delete_unused(root, kind)
    return folder


def say_once(message: str) -> None:
    if message not in _warned:
        _warned.add(message)
        warnings.warn(message, CacheWarning, stacklevel=3)


_warned: set[str] = set()


def _unsafe_reason(folder: Path) -> str | None:
    """Return the reason why another user could have written to a folder, or None.

    A user who can write to a parent folder without the sticky bit can replace the folder.
    """
    me = os.geteuid()
    for place in (folder, *folder.parents):
        found = place.stat()
        if found.st_uid != me and (place == folder or found.st_uid not in _TRUSTED):
            return f"{place} belongs to another user; set XDG_CACHE_HOME to a folder of your own"
        everybody = found.st_mode & stat.S_IWOTH
        group = found.st_mode & stat.S_IWGRP and not _is_private(found.st_gid)
        if (everybody or group) and (place == folder or not found.st_mode & stat.S_ISVTX):
            writer = "every user" if everybody else "a group"
            return f"{writer} can write to {place}; remove that permission (chmod go-w) and delete {folder}"
    return None


def _is_private(group: int) -> bool:
    """Return whether a group has the user's name and no other member.

    Many systems create such a private group for each user.
    """
    try:
        name, found = pwd.getpwuid(os.geteuid()).pw_name, grp.getgrgid(group)
    except KeyError:
        return False
    return found.gr_name == name and set(found.gr_mem) <= {name}


def _delete_unused(root: Path, kind: str) -> None:
    for mark in root.glob(f"{kind}-*/{_USED}"):
        with contextlib.suppress(OSError):
            found = mark.stat()
            if time.time() - found.st_mtime > _A_MONTH and found.st_uid == os.geteuid():
                shutil.rmtree(mark.parent, ignore_errors=True)


_DIGEST = hashlib.sha256().digest_size


def put(place: Path, data: bytes) -> None:
    """Write a file with a checksum, completely or not at all; report a failure as a `CacheWarning`."""
    name = ""
    try:
        with tempfile.NamedTemporaryFile(dir=place.parent, prefix=f".{place.name}.", delete=False) as file:
            name = file.name
            file.write(_checksum(place, data) + data)
        Path(name).replace(place)
    except OSError as error:
        if name:
            with contextlib.suppress(OSError):
                Path(name).unlink()
        say_once(f"the cache cannot be written in {place.parent}: {error.strerror or error}")


def get(place: Path) -> bytes | None:
    """Return the content of a file that `put` wrote, or None for a missing or damaged file."""
    try:
        content = read_if_there(place, MOST_DATA)
    except SourceError as error:
        report_damaged(place, error.found or error.what)
        return None
    if content is None:
        return None
    checksum, data = content[:_DIGEST], content[_DIGEST:]
    if _checksum(place, data) != checksum:
        report_damaged(place, "the checksum of the file does not match its content and its name")
        return None
    return data


def _checksum(place: Path, data: bytes) -> bytes:
    digest = hashlib.sha256()
    for part in (os.fsencode(place.parent.name), os.fsencode(place.name), data):
        digest.update(len(part).to_bytes(8, "big") + part)
    return digest.digest()


def report_damaged(place: Path, reason: str) -> None:
    say_once(f"{place} is damaged and is computed again: {reason}")
