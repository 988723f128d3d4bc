"""Store results in a cache on disk, with a checksum in each file.

The name of a cache folder contains a digest of the source files, so urdfkin uses another folder after a
source file changes. urdfkin later executes or unpickles cached files. A file of another user could therefore
run any code. For this reason, this module uses a folder only if no other user can write to it. A folder that
urdfkin has not used for a month is deleted.

`put` writes a file with a checksum, and `get` verifies it. A truncated or corrupted file could crash the
process or compute a wrong result, so it is reported and replaced. The checksum includes the name of the file
and the name of its folder. Therefore, `get` detects a renamed file, which could belong to another robot.
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

#: Version of the checksum. Each version of the checksum uses other folders, because the digest in a folder's
#: name includes this version.
_CHECKSUM_VERSION = "sealed with its name"
_A_MONTH = 30 * 24 * 3600.0
_USED = ".used"
#: User ids that may own the parent folders: 0 (root) and 65534. In a container, the root user of the host may
#: have the id 65534.
_TRUSTED = (0, 65534)


class CacheWarning(UserWarning):
    """The cache cannot be used, or a cached file is damaged; the results are not affected."""


def kept_folder(kind: str, sources: Iterable[Path], *texts: str, root: Path | None = None) -> Path | None:
    """Return a cache folder that only this user can write to; create it if it does not exist.

    Args:
        kind: Kind of the cached files. The folder's name begins with this word.
        sources: Files from which the cached files are computed. The digest in the folder's name includes the
            contents of these files.
        texts: Texts that also determine the cached files, for example options. The digest in the folder's
            name includes them.
        root: The parent folder; None for the user's cache folder.

    Returns:
        The folder; None, with a `CacheWarning`, if no such folder can be used.
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
    except (OSError, RuntimeError) as error:  # RuntimeError: a loop of symbolic links
        reason = getattr(error, "strerror", None) or str(error)
        say_once(f"the cache cannot be written in {root}: {reason}; set XDG_CACHE_HOME to another folder")
        return None
    with contextlib.suppress(OSError):  # existing files of a full or read-only disk are still readable
        (folder / _USED).touch()
        _delete_unused(root, kind)
    return folder


def say_once(message: str) -> None:
    """Issue a `CacheWarning`, each message at most once per process."""
    if message not in _warned:
        _warned.add(message)
        warnings.warn(message, CacheWarning, stacklevel=3)


_warned: set[str] = set()


def _unsafe_reason(folder: Path) -> str | None:
    """Return the reason why another user could have written to a folder; None if this is impossible.

    A user who can write to a parent folder can replace the folder, unless the parent has the sticky bit, as
    /tmp has.
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
    """Return whether a group is the user's private group, which many systems create for each user."""
    try:
        name, found = pwd.getpwuid(os.geteuid()).pw_name, grp.getgrgid(group)
    except KeyError:
        return False
    return found.gr_name == name and set(found.gr_mem) <= {name}


def _delete_unused(root: Path, kind: str) -> None:
    """Delete the user's cache folders of one kind that urdfkin has not used for a month."""
    for mark in root.glob(f"{kind}-*/{_USED}"):
        with contextlib.suppress(OSError):
            found = mark.stat()
            if time.time() - found.st_mtime > _A_MONTH and found.st_uid == os.geteuid():
                shutil.rmtree(mark.parent, ignore_errors=True)


_DIGEST = hashlib.sha256().digest_size


def put(place: Path, data: bytes) -> None:
    """Write a file with a checksum, completely or not at all; a failure is only a `CacheWarning`."""
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
    """Return the content of a file that `put` wrote, or None.

    The result is None if the file is missing, or, with a warning, if the file is damaged.
    """
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
    """Warn that a cached file is damaged. The caller must compute the content again and replace the file."""
    say_once(f"{place} is damaged and is computed again: {reason}")
