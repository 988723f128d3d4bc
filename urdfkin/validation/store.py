"""Store the results of a campaign in a folder with a manifest and one small file for each chunk.

    DIR/manifest.json              definition of the campaign
    DIR/chunks/4f/4f1a....chunk    result of a chunk
    DIR/chunks/4f/4f1a....failed   reason why the robot of a chunk could not be checked
    DIR/accuracy.json              settings of the accuracy study
    DIR/chunks/4f/4f1a....accuracy result of the accuracy study of a robot
    DIR/lock                       locked by the process that writes to the store

Files are written atomically, so a file is either complete or absent. The store reports damaged files, and
files whose names belong to no chunk. A store that is open for writing moves these files to `damaged/`. The
chunk of a damaged file is computed again.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import json
import os
import shutil
import socket
import stat
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, TypeVar

from urdfkin.errors import InputError, SourceError
from urdfkin.system.files import read_bytes, read_if_exists
from urdfkin.validation.answer import Answer, DamagedError, Failure, decode_answer, encode_answer
from urdfkin.validation.manifest import Manifest

_MANIFEST, _LOCK, _CHUNKS, _ASIDE = "manifest.json", "lock", "chunks", "damaged"
_WRITING = ".writing"
#: File with the settings of the accuracy study (`urdfkin.validation.accuracy_store`).
STUDY_FILE = "accuracy.json"
#: Suffix of a file with the accuracy result of a robot.
STUDY_SUFFIX = ".accuracy"
_DONE, _FAILED = ".chunk", ".failed"

#: Number of attempts to acquire a lock; the attempts are 0.1 s apart.
_TRIES = 10

_T = TypeVar("_T")

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Store:
    """Folder of a stored validation; `scratch` is a folder for unfinished files, or None for reading only."""

    folder: Path
    manifest: Manifest
    tell: Tell
    scratch: Path | None = None

    @classmethod
    def reading(cls, folder: Path, tell: Tell) -> Store:
        """Return a read-only store; another process may be writing to the same folder."""
        place = folder / _MANIFEST
        return cls(folder, Manifest.from_json(read_bytes(place), str(place)), tell)

    def answer(self, robot: int, index: int) -> Answer | None:
        key = self.manifest.key(robot, index)
        return self.entry(key, _DONE, decode_answer) or self.entry(key, _FAILED, decode_answer)

    def entry(self, key: str, kind: str, decode: Callable[[str, bytes], _T]) -> _T | None:
        """Return the decoded content of a file; None if the file is missing or damaged."""
        place = self._place(key, kind)
        try:
            content = read_if_exists(place)
            return None if content is None else decode(key, content)
        except (DamagedError, OSError) as error:
            why = f"{error.what}: {error.found}" if isinstance(error, SourceError) else str(error)
            self._quarantine(place, f"is damaged and is computed again: {why}")
            return None

    def keep(self, robot: int, index: int, found: Answer) -> None:
        """Write an answer; when this method returns, the complete file is on disk."""
        key = self.manifest.key(robot, index)
        self.write_entry(key, _FAILED if isinstance(found, Failure) else _DONE, encode_answer(key, found))

    def has(self, key: str, kind: str) -> bool:
        return self._place(key, kind).exists()

    @property
    def has_study(self) -> bool:
        return (self.folder / STUDY_FILE).exists()

    def write_entry(self, key: str, kind: str, data: bytes) -> None:
        self._write(self._place(key, kind), data)

    def forget_failures(self) -> None:
        for place in self._files(_FAILED):
            place.unlink(missing_ok=True)

    def check_names(self) -> None:
        """Report files whose names belong to no chunk, such as renamed files, and move them to `damaged/`."""
        keys = (
            self.manifest.key(robot, index)
            for robot in range(len(self.manifest.robots))
            for index in range(len(self.manifest.cut))
        )
        expected = {self._place(key, kind) for key in keys for kind in (_DONE, _FAILED)}
        for place in sorted((self.folder / _CHUNKS).glob("*/*")):
            if place not in expected and place.suffix != STUDY_SUFFIX:
                self._quarantine(place, "is not used: no chunk of this campaign has this name")

    def counts(self) -> dict[int, tuple[int, bool]]:
        """Return (number of stored chunks, whether a chunk failed) for each robot, from file names only."""
        names = {place.name for kind in (_DONE, _FAILED) for place in self._files(kind)}
        found = {}
        for robot in range(len(self.manifest.robots)):
            keys = [self.manifest.key(robot, index) for index in range(len(self.manifest.cut))]
            done = sum(key + _DONE in names for key in keys)
            found[robot] = done, any(key + _FAILED in names for key in keys)
        return found

    def copy_missing(self, other: Store) -> int:
        other.check_names()
        taken = 0
        for robot in range(len(self.manifest.robots)):
            for index in range(len(self.manifest.cut)):
                if self.answer(robot, index) is None and (found := other.answer(robot, index)) is not None:
                    self.keep(robot, index, found)
                    taken += 1
        return taken

    def check_same(self, manifest: Manifest, where: object = None) -> None:
        if differences := self.manifest.differences(manifest):
            there = "here" if where is None else f"in {where}"
            raise InputError(
                "the store belongs to another campaign",
                where=str(self.folder),
                found=f"(in the store, and {there}) {'; '.join(differences)}",
                remedy="use the options of the stored campaign, or another folder",
            )

    def writing_process(self) -> str | None:
        try:
            with _lock_file(self.folder / _LOCK, os.O_RDONLY) as file:
                return None if _try_lock(file, fcntl.LOCK_SH) else _holder(file)
        except OSError:
            return None

    def write(self, name: str, data: bytes) -> None:
        self._write(self.folder / name, data)

    def _place(self, key: str, kind: str) -> Path:
        return self.folder / _CHUNKS / key[:2] / (key + kind)

    def _files(self, kind: str) -> Iterator[Path]:
        return (self.folder / _CHUNKS).glob(f"*/*{kind}")

    def _quarantine(self, place: Path, why: str) -> None:
        self.tell(f"{place} {why}")
        if self.scratch is not None:
            damaged = self.folder / _ASIDE
            with contextlib.suppress(OSError):
                damaged.mkdir(exist_ok=True)
                place.replace(damaged / place.name)

    def _write(self, place: Path, data: bytes) -> None:
        if self.scratch is None:
            raise SourceError("the store is read-only", where=str(self.folder))
        unfinished = self.scratch / place.name
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            with unfinished.open("wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            unfinished.replace(place)
        except OSError as error:
            raise SourceError(
                "the store cannot be written",
                where=str(self.folder),
                found=error.strerror or str(error),
                remedy="free some disk space and repeat the same command; finished chunks are kept",
            ) from error


@contextlib.contextmanager
def open_store(
    folder: Path, manifest: Manifest, tell: Tell, *, shard: str | None = None, retry_failed: bool = False
) -> Iterator[Store]:
    """Open or create the store of a validation, and lock the store for writing.

    If `shard` is given, such as "2/4", other processes may write other shards. With `retry_failed`, stored
    failures are deleted, because the files of the failed robots may have changed.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / _MANIFEST).exists() and not all(map(_is_ours, folder.iterdir())):
            raise InputError(
                "the folder is not empty and is not a store",
                where=str(folder),
                remedy="give an empty or a new folder",
            )
        with _locked(folder, shard):
            if (folder / _WRITING).is_symlink():
                raise SourceError(
                    "a symbolic link replaces a folder of the store",
                    where=str(folder / _WRITING),
                    remedy="delete the link",
                )
            scratch = folder / _WRITING / (shard or "all").replace("/", "-of-")
            shutil.rmtree(scratch, ignore_errors=True)  # A killed process leaves unfinished files.
            scratch.mkdir(parents=True)
            try:
                store = _check_or_write_manifest(
                    Store(folder, manifest, tell, scratch), retry_failed=retry_failed
                )
                store.check_names()
                yield store
            finally:
                shutil.rmtree(scratch, ignore_errors=True)
    except OSError as error:
        if isinstance(error, SourceError):
            raise
        raise SourceError(
            "the store cannot be used", where=str(folder), found=error.strerror or str(error)
        ) from error


def _is_ours(path: Path) -> bool:
    """Return whether this path may belong to a store that has no manifest yet.

    The process of another shard creates locks and folders before it writes the manifest.
    """
    return path.name in (_WRITING, _CHUNKS) or path.name.startswith(_LOCK)


def _check_or_write_manifest(store: Store, *, retry_failed: bool) -> Store:
    """Return the store with its manifest.

    The manifest is written if the folder has none, or for a retry after the files of failed robots changed.
    In all other cases, the folder keeps its manifest, because the manifest contains the original start time.
    """
    if not (store.folder / _MANIFEST).exists():
        store.write(_MANIFEST, store.manifest.as_json())
        return store
    before = replace(store, manifest=Store.reading(store.folder, store.tell).manifest)
    is_changed = retry_failed and _only_failed_robots_differ(before, store.manifest)
    if not is_changed:
        before.check_same(store.manifest)
    if retry_failed:
        before.forget_failures()
    if is_changed:
        store.write(_MANIFEST, store.manifest.as_json())
        return store
    return before


def _only_failed_robots_differ(store: Store, manifest: Manifest) -> bool:
    own, theirs = store.manifest.robots, manifest.robots
    if len(own) != len(theirs) or replace(store.manifest, robots=theirs).differences(manifest):
        return False
    differ = [i for i, robots in enumerate(zip(own, theirs, strict=True)) if robots[0] != robots[1]]
    counts = store.counts()
    return bool(differ) and all(counts[i][1] and own[i][0] == theirs[i][0] for i in differ)


@contextlib.contextmanager
def _locked(folder: Path, shard: str | None) -> Iterator[None]:
    with contextlib.ExitStack() as stack:
        file = stack.enter_context(_lock_file(folder / _LOCK))
        _lock(file, fcntl.LOCK_SH if shard else fcntl.LOCK_EX, folder)
        if shard:
            file = stack.enter_context(_lock_file(folder / f"{_LOCK}-{shard.replace('/', '-of-')}"))
            _lock(file, fcntl.LOCK_EX, folder)
        file.truncate(0)
        file.write(json.dumps({"host": socket.gethostname(), "process": os.getpid()}).encode())
        file.flush()
        yield


def _lock_file(place: Path, how: int = os.O_RDWR | os.O_CREAT | os.O_APPEND) -> IO[bytes]:
    """Open the file of a lock; raise SourceError if the path is a link, a pipe or a device."""
    message, remedy = "the store's lock is not a regular file", "delete the lock"
    try:
        descriptor = os.open(place, how | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o666)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise SourceError(message, where=str(place), found="a link", remedy=remedy) from error
        raise
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise SourceError(message, where=str(place), found="another kind of file", remedy=remedy)
    return os.fdopen(descriptor, "rb" if how == os.O_RDONLY else "a+b")


def _lock(file: IO[bytes], how: int, folder: Path) -> None:
    for _ in range(_TRIES):
        if _try_lock(file, how):
            return
        time.sleep(0.1)  # Another process may hold the lock for a moment, to test the lock.
    raise InputError(
        "another process uses this store",
        where=str(folder),
        found=_holder(file),
        remedy="wait until that process ends, or use another folder",
    )


def _try_lock(file: IO[bytes], how: int) -> bool:
    try:
        fcntl.flock(file, how | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _holder(file: IO[bytes]) -> str:
    try:
        file.seek(0)
        data = json.loads(file.read(1000))
        return f"process {int(data['process'])} on {data['host']}"
    except (OSError, ValueError, KeyError, TypeError):
        return "an unknown process"
