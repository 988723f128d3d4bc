"""Store results in a cache on disk, with a checksum in each file.

urdfkin executes or unpickles cached files, so another user's file could run any code. A folder is therefore
used only if no other user can write to it. The name of a folder contains a digest of the source files, so
changed source files get a new folder. A folder that urdfkin has not used for 30 days is deleted.

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
from urdfkin.system.files import MAX_DATA_BYTES, read_bytes, read_if_exists

#: The digest in a folder's name depends on this version.
_CHECKSUM_VERSION = "sealed with its name"
_MAX_UNUSED_SECONDS = 30 * 24 * 3600.0
#: `make_cache_folder` updates the modification time of this file. Unused folders are deleted later.
_LAST_USE_FILE = ".used"
#: Other users that may own parent folders. User 0 is root.
#: In a container, user 65534 can be the host's root.
_TRUSTED_OWNERS = (0, 65534)


class CacheWarning(UserWarning):
    """The cache cannot be used, or a cached file is damaged.

    The results of the computation are not affected.
    """


def make_cache_folder(
    kind: str, sources: Iterable[Path], *versions: str, root: Path | None = None
) -> Path | None:
    """Return a cache folder to which only this user can write; warn and return None if this is impossible.

    The folder's name is `kind`, followed by a digest of the files `sources` and of the strings `versions`.
    """
    digest = hashlib.sha256("\n".join([_CHECKSUM_VERSION, *versions]).encode())
    for source in sources:
        digest.update(read_bytes(source))
    root = root or Path(platformdirs.user_cache_dir("urdfkin"))
    try:
        root.mkdir(mode=0o700, parents=True, exist_ok=True)
        folder = root.resolve() / f"{kind}-{digest.hexdigest()[:16]}"
        folder.mkdir(mode=0o700, exist_ok=True)
        if (reason := _unsafe_reason(folder)) is not None:
            warn_once(f"the cache is not used: {reason}")
            return None
    # A loop of symbolic links raises RuntimeError.
    except (OSError, RuntimeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        warn_once(f"the cache cannot be written in {root}: {reason}; set XDG_CACHE_HOME to another folder")
        return None
    # A full or read-only disk can still contain readable files.
    with contextlib.suppress(OSError):
        (folder / _LAST_USE_FILE).touch()
        _delete_unused(root, kind)
    return folder


def warn_once(message: str) -> None:
    if message not in _warned_messages:
        _warned_messages.add(message)
        warnings.warn(message, CacheWarning, stacklevel=3)


_warned_messages: set[str] = set()


def _unsafe_reason(folder: Path) -> str | None:
    """Return the reason why another user could have written to a folder, or None for a safe folder.

    A user who can write to a parent folder can replace `folder`, unless the parent folder has the sticky bit.
    """
    me = os.geteuid()
    for path in (folder, *folder.parents):
        status = path.stat()
        if status.st_uid != me and (path == folder or status.st_uid not in _TRUSTED_OWNERS):
            return f"{path} belongs to another user; set XDG_CACHE_HOME to a folder of your own"
        everybody = status.st_mode & stat.S_IWOTH
        group = status.st_mode & stat.S_IWGRP and not _is_private(status.st_gid)
        if (everybody or group) and (path == folder or not status.st_mode & stat.S_ISVTX):
            writer = "every user" if everybody else "a group"
            return f"{writer} can write to {path}; remove that permission (chmod go-w) and delete {folder}"
    return None


def _is_private(group: int) -> bool:
    """Return whether a group is the private group that many systems create for each user."""
    try:
        name, entry = pwd.getpwuid(os.geteuid()).pw_name, grp.getgrgid(group)
    except KeyError:
        return False
    return entry.gr_name == name and set(entry.gr_mem) <= {name}


def _delete_unused(root: Path, kind: str) -> None:
    for mark in root.glob(f"{kind}-*/{_LAST_USE_FILE}"):
        with contextlib.suppress(OSError):
            status = mark.stat()
            if time.time() - status.st_mtime > _MAX_UNUSED_SECONDS and status.st_uid == os.geteuid():
                shutil.rmtree(mark.parent, ignore_errors=True)


_DIGEST_SIZE = hashlib.sha256().digest_size


def write_cached_file(path: Path, data: bytes) -> None:
    """Write a file with a checksum, completely or not at all; report a failure as a `CacheWarning`."""
    name = ""
    try:
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as file:
            name = file.name
            file.write(_checksum(path, data) + data)
        Path(name).replace(path)
    except OSError as error:
        if name:
            with contextlib.suppress(OSError):
                Path(name).unlink()
        warn_once(f"the cache cannot be written in {path.parent}: {error.strerror or error}")


def read_cached_file(path: Path) -> bytes | None:
    """Return the content of a file that `write_cached_file` wrote, or None for a missing or damaged file."""
    try:
        content = read_if_exists(path, MAX_DATA_BYTES)
    except SourceError as error:
        report_damaged(path, error.found or error.what)
        return None
    if content is None:
        return None
    checksum, data = content[:_DIGEST_SIZE], content[_DIGEST_SIZE:]
    if _checksum(path, data) != checksum:
        report_damaged(path, "the checksum of the file does not match its content and its name")
        return None
    return data


def _checksum(path: Path, data: bytes) -> bytes:
    digest = hashlib.sha256()
    for part in (os.fsencode(path.parent.name), os.fsencode(path.name), data):
        digest.update(len(part).to_bytes(8, "big") + part)
    return digest.digest()


def report_damaged(path: Path, reason: str) -> None:
    warn_once(f"{path} is damaged and is computed again: {reason}")
