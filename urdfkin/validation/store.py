"""Store the results of a validation in a folder.

    DIR/manifest.json              definition of the campaign
    DIR/chunks/4f/4f1a....chunk    result of a chunk
    DIR/chunks/4f/4f1a....failed   reason why the robot of a chunk could not be checked
    DIR/accuracy.json              settings of the accuracy study
    DIR/chunks/4f/4f1a....accuracy result of the accuracy study of a robot
    DIR/lock                       locked by each process that writes to the store
    DIR/lock-2-of-4                locked by the process that computes shard 2/4
    DIR/.writing/                  unfinished files
    DIR/damaged/                   damaged and unknown files

The manifest defines the robots, the samples, the seed, the versions, the chunks and the key of each chunk.
The key is the sha256 of all data on which the chunk's numbers depend. Therefore, results of older code, texts
or options are never reused.

Files are written atomically, so a file is either complete or absent. A file's name contains the key of its
chunk. The store reports damaged files, and files that belong to no chunk of the validation. A writable store
moves these files to the folder `damaged/`. The results in a damaged file are computed again.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import hashlib
import json
import os
import shutil
import socket
import stat
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import IO, TYPE_CHECKING, TypeVar

from urdfkin.errors import InputError, SourceError
from urdfkin.system.documents import DocumentKind, as_data, from_data, parse_json
from urdfkin.system.files import read_bytes, read_if_exists
from urdfkin.urdf.sources import Origin
from urdfkin.validation.answer import (
    Answer,
    DamagedError,
    Failure,
    decode_answer,
    encode_answer,
    pack,
    unpack,
)
from urdfkin.validation.chunk import Chunking
from urdfkin.validation.results import provenance
from urdfkin.validation.robot_input import RobotInput
from urdfkin.verify.oracles import package_version, package_versions

if TYPE_CHECKING:
    from urdfkin.validation.accuracy import AccuracyStudy

_LAYOUT = "urdfkin-campaign/1"
_MAX_DIFFERENCES = 4
_MANIFEST, _LOCK, _CHUNKS, _DAMAGED = "manifest.json", "lock", "chunks", "damaged"
_SCRATCH_FOLDER = ".writing"
_STUDY_SETTINGS_FILE = "accuracy.json"
_STUDY_SUFFIX = ".accuracy"
_DONE, _FAILED = ".chunk", ".failed"

#: Number of attempts to acquire a lock, 0.1 s apart.
_LOCK_ATTEMPTS = 10

_T = TypeVar("_T")

Notify = Callable[[str], None]


@dataclass(frozen=True)
class Manifest:
    """Definition of a campaign.

    Attributes:
        started: Start time, ISO 8601, UTC.
        robots: Origin and sha256 of each robot; the sha256 of an unreadable text is empty.
    """

    robots: tuple[tuple[Origin, str], ...]
    samples: int
    seed: int
    provenance: dict[str, str]
    versions: dict[str, str]
    started: str

    @classmethod
    def of(cls, robot_inputs: Sequence[RobotInput], samples: int, seed: int, started: str) -> Manifest:
        robots = tuple((robot_input.origin, robot_input.sha256) for robot_input in robot_inputs)
        oracles = (robot_input.origin.oracle for robot_input in robot_inputs)
        return cls(robots, samples, seed, provenance(), package_versions(oracles), started)

    @cached_property
    def chunking(self) -> Chunking:
        return Chunking(self.samples)

    def make_robot_inputs(self) -> list[RobotInput]:
        """Return the robots without their texts."""
        return [RobotInput(origin.source, origin, sha256) for origin, sha256 in self.robots]

    def key(self, robot: int, index: int) -> str:
        return hashlib.sha256(
            f"{self._robot_digests[robot]} {index} of {len(self.chunking)}".encode()
        ).hexdigest()

    @cached_property
    def _robot_digests(self) -> list[str]:
        settings = json.dumps([_LAYOUT, self.samples, self.seed, self.provenance], sort_keys=True)
        return [
            hashlib.sha256(f"{settings}\n{json.dumps(as_data(robot))}".encode()).hexdigest()
            for robot in self.robots
        ]

    def as_json(self) -> bytes:
        return (json.dumps({"schema": _LAYOUT} | as_data(self), indent=1) + "\n").encode()

    @classmethod
    def from_json(cls, content: bytes, where: str) -> Manifest:
        layout = DocumentKind(_LAYOUT, cls, (), "urdfkin validate ROBOT --store DIR", is_open=True)
        return layout.validate(parse_json(content, where), where)

    def differences(self, other: Manifest) -> list[str]:
        own, theirs = (
            {"samples": m.samples, "seed": m.seed, "number of robots": len(m.robots)} | m.provenance
            for m in (self, other)
        )
        lines = [
            f"{name} {_shorten_digest(own.get(name))} and {_shorten_digest(theirs.get(name))}"
            for name in own | theirs
            if own.get(name) != theirs.get(name)
        ]
        lines += [
            f"robot {i + 1} {_describe_robot(robot)} and {_describe_robot(other_robot)}"
            for i, (robot, other_robot) in enumerate(zip(self.robots, other.robots, strict=False))
            if robot != other_robot
        ]
        return (
            [*lines[:_MAX_DIFFERENCES], f"{len(lines) - _MAX_DIFFERENCES} more"]
            if len(lines) > _MAX_DIFFERENCES + 1
            else lines
        )


def _shorten_digest(value: object) -> str:
    text = str(value)
    return text[:12] if len(text) == 64 else text


def _describe_robot(robot: tuple[Origin, str]) -> str:
    origin, sha256 = robot
    return f"{origin.command_line} (sha256 {sha256[:12] or 'unknown'})"


@dataclass(frozen=True)
class Store:
    """A folder that contains the results of a validation.

    Attributes:
        scratch: Folder for unfinished files; None if the store is read-only.
    """

    folder: Path
    manifest: Manifest
    notify: Notify
    scratch: Path | None = None

    @classmethod
    def open_read_only(cls, folder: Path, notify: Notify) -> Store:
        """Return a read-only store; another process may write to its folder."""
        path = folder / _MANIFEST
        if not os.path.lexists(path):
            raise SourceError(
                "this is not a folder with results of a validation",
                where=str(folder),
                found=f"no file {_MANIFEST}",
                remedy="give the folder of `urdfkin validate --store DIR`",
            )
        return cls(folder, Manifest.from_json(read_bytes(path), str(path)), notify)

    def read_answer(self, robot: int, index: int) -> Answer | None:
        key = self.manifest.key(robot, index)
        return self.read_entry(key, _DONE, decode_answer) or self.read_entry(key, _FAILED, decode_answer)

    def read_entry(self, key: str, kind: str, decode: Callable[[str, bytes], _T]) -> _T | None:
        """Return the content of a file; None if missing or damaged."""
        path = self._path_of(key, kind)
        try:
            content = read_if_exists(path)
            return None if content is None else decode(key, content)
        except (DamagedError, OSError) as error:
            why = f"{error.what}: {error.found}" if isinstance(error, SourceError) else str(error)
            self._quarantine(path, f"is damaged and is computed again: {why}")
            return None

    def write_answer(self, robot: int, index: int, answer: Answer) -> None:
        key = self.manifest.key(robot, index)
        self.write_entry(key, _FAILED if isinstance(answer, Failure) else _DONE, encode_answer(key, answer))

    def has_entry(self, key: str, kind: str) -> bool:
        return self._path_of(key, kind).exists()

    def write_entry(self, key: str, kind: str, data: bytes) -> None:
        self._write_atomically(self._path_of(key, kind), data)

    def delete_failures(self, chunks: Sequence[range]) -> None:
        """Delete the stored failures of these chunks of each robot."""
        for robot, indices in enumerate(chunks):
            for index in indices:
                self._path_of(self.manifest.key(robot, index), _FAILED).unlink(missing_ok=True)

    def check_names(self) -> None:
        """Report files with unknown names; a writable store moves them to `damaged/`.

        Results of the accuracy study are not checked, because their names depend on settings outside the
        manifest.
        """
        keys = (
            self.manifest.key(robot, index)
            for robot in range(len(self.manifest.robots))
            for index in range(len(self.manifest.chunking))
        )
        expected = {self._path_of(key, kind) for key in keys for kind in (_DONE, _FAILED)}
        for path in sorted((self.folder / _CHUNKS).glob("*/*")):
            if path not in expected and path.suffix != _STUDY_SUFFIX:
                self._quarantine(path, "is not used: no chunk of this campaign has this name")

    def count_chunks(self) -> dict[int, tuple[int, bool]]:
        """Return the number of chunks with a result, and whether a chunk failed, for each robot."""
        names = {path.name for kind in (_DONE, _FAILED) for path in self._find_files(kind)}
        counts = {}
        for robot in range(len(self.manifest.robots)):
            keys = [self.manifest.key(robot, index) for index in range(len(self.manifest.chunking))]
            done = sum(key + _DONE in names for key in keys)
            counts[robot] = done, any(key + _FAILED in names for key in keys)
        return counts

    def copy_missing(self, other: Store) -> int:
        other.check_names()
        taken = 0
        for robot in range(len(self.manifest.robots)):
            for index in range(len(self.manifest.chunking)):
                if (
                    self.read_answer(robot, index) is None
                    and (answer := other.read_answer(robot, index)) is not None
                ):
                    self.write_answer(robot, index, answer)
                    taken += 1
        return taken

    def check_same_campaign(self, manifest: Manifest, where: object = None) -> None:
        if differences := self.manifest.differences(manifest):
            if where is not None:
                there, remedy = f"in {where}", "merge only stores of one validation"
            else:
                there = "here"
                remedy = "use the options, robot files and versions of this campaign, or another folder"
                if any(difference.startswith("robot ") for difference in differences):
                    remedy += "; with --retry failed, the file of a failed robot may differ"
            raise InputError(
                "the store belongs to another campaign",
                where=str(self.folder),
                found=f"(in the store, and {there}) {'; '.join(differences)}",
                remedy=remedy,
            )

    def writing_process(self) -> str | None:
        """Return a process that writes to the store, or None.

        The processes of shards share the store's lock, and each process also locks the file of its shard.
        """
        for path in (self.folder / _LOCK, *sorted(self.folder.glob(f"{_LOCK}-*"))):
            try:
                with _open_lock_file(path, os.O_RDONLY) as file:
                    if not _try_lock(file, fcntl.LOCK_SH):
                        return _read_holder(file)
            except OSError:
                continue
        return None

    def write(self, name: str, data: bytes) -> None:
        self._write_atomically(self.folder / name, data)

    def _path_of(self, key: str, kind: str) -> Path:
        return self.folder / _CHUNKS / key[:2] / (key + kind)

    def _find_files(self, kind: str) -> Iterator[Path]:
        return (self.folder / _CHUNKS).glob(f"*/*{kind}")

    def _quarantine(self, path: Path, why: str) -> None:
        self.notify(f"{path} {why}")
        if self.scratch is not None:
            damaged = self.folder / _DAMAGED
            with contextlib.suppress(OSError):
                damaged.mkdir(exist_ok=True)
                path.replace(damaged / path.name)

    def _write_atomically(self, path: Path, data: bytes) -> None:
        if self.scratch is None:
            raise SourceError("the store is read-only", where=str(self.folder))
        unfinished = self.scratch / path.name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with unfinished.open("wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            unfinished.replace(path)
        except OSError as error:
            raise SourceError(
                "the store cannot be written",
                where=str(self.folder),
                found=error.strerror or str(error),
                remedy=f"{_make_remedy(error)}, and repeat the same command; finished chunks are kept",
            ) from error


def _make_remedy(error: OSError) -> str:
    is_full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    return "free some disk space" if is_full else "correct the folder or its permissions"


@contextlib.contextmanager
def open_store(
    folder: Path,
    manifest: Manifest,
    notify: Notify,
    *,
    shard: str | None = None,
    retry: Sequence[range] | None = None,
) -> Iterator[Store]:
    """Open or create the store of a validation, and lock it.

    | shard | locks of this process |
    |---|---|
    | "2/4" | shared lock of the store, exclusive lock of the shard |
    | None | exclusive lock of the store |

    `retry` contains chunks of each robot. The stored failures of these chunks are deleted, because the
    robots' files may have changed. Failures of other chunks belong to other shards, and remain.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / _MANIFEST).exists() and not all(map(_is_store_entry, folder.iterdir())):
            raise InputError(
                "the folder is not empty and is not a store",
                where=str(folder),
                remedy="give an empty or a new folder",
            )
        with _hold_lock(folder, shard):
            if (folder / _SCRATCH_FOLDER).is_symlink():
                raise SourceError(
                    "a symbolic link replaces a folder of the store",
                    where=str(folder / _SCRATCH_FOLDER),
                    remedy="delete the link",
                )
            scratch = folder / _SCRATCH_FOLDER / (shard or "all").replace("/", "-of-")
            shutil.rmtree(scratch, ignore_errors=True)  # A killed process leaves unfinished files.
            scratch.mkdir(parents=True)
            try:
                store = _check_or_write_manifest(Store(folder, manifest, notify, scratch), retry)
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


def _is_store_entry(path: Path) -> bool:
    """Return whether a store can contain `path` before it has a manifest."""
    return path.name in (_SCRATCH_FOLDER, _CHUNKS) or path.name.startswith(_LOCK)


def _check_or_write_manifest(store: Store, retry: Sequence[range] | None) -> Store:
    """Decide which manifest the store has.

    | case | result |
    |---|---|
    | The folder has no manifest. | Write the new manifest. |
    | `retry`; only the files of failed robots have changed. | Replace the old manifest. |
    | Any other case; both manifests agree. | Keep the old manifest with its start time. |
    | Any other case; the manifests differ. | Raise InputError. |
    """
    if not (store.folder / _MANIFEST).exists():
        store.write(_MANIFEST, store.manifest.as_json())
        return store
    before = replace(store, manifest=Store.open_read_only(store.folder, store.notify).manifest)
    is_changed = retry is not None and _only_failed_robots_differ(before, store.manifest)
    if not is_changed:
        before.check_same_campaign(store.manifest)
    if retry is not None:
        whole = range(len(store.manifest.chunking))
        robots = zip(before.manifest.robots, store.manifest.robots, retry, strict=True)
        # All failures of a changed file are outdated, also those of other shards.
        before.delete_failures([chunks if old == new else whole for old, new, chunks in robots])
    if is_changed:
        store.write(_MANIFEST, store.manifest.as_json())
        return store
    return before


def _only_failed_robots_differ(store: Store, manifest: Manifest) -> bool:
    own, theirs = store.manifest.robots, manifest.robots
    if len(own) != len(theirs) or replace(store.manifest, robots=theirs).differences(manifest):
        return False
    differ = [i for i, robots in enumerate(zip(own, theirs, strict=True)) if robots[0] != robots[1]]
    counts = store.count_chunks()
    return bool(differ) and all(counts[i][1] and own[i][0] == theirs[i][0] for i in differ)


@contextlib.contextmanager
def _hold_lock(folder: Path, shard: str | None) -> Iterator[None]:
    with contextlib.ExitStack() as stack:
        file = stack.enter_context(_open_lock_file(folder / _LOCK))
        _acquire_lock(file, fcntl.LOCK_SH if shard else fcntl.LOCK_EX, folder)
        if shard:
            file = stack.enter_context(_open_lock_file(folder / f"{_LOCK}-{shard.replace('/', '-of-')}"))
            _acquire_lock(file, fcntl.LOCK_EX, folder)
        file.truncate(0)
        file.write(json.dumps({"host": socket.gethostname(), "process": os.getpid()}).encode())
        file.flush()
        yield


def _open_lock_file(path: Path, flags: int = os.O_RDWR | os.O_CREAT | os.O_APPEND) -> IO[bytes]:
    """Open a lock file; raise SourceError for a link, a pipe or a device."""
    message, remedy = "the store's lock is not a regular file", "delete the lock"
    try:
        descriptor = os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o666)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise SourceError(message, where=str(path), found="a link", remedy=remedy) from error
        raise
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise SourceError(message, where=str(path), found="another kind of file", remedy=remedy)
    return os.fdopen(descriptor, "rb" if flags == os.O_RDONLY else "a+b")


def _acquire_lock(file: IO[bytes], flags: int, folder: Path) -> None:
    for _ in range(_LOCK_ATTEMPTS):
        if _try_lock(file, flags):
            return
        time.sleep(0.1)  # `Store.writing_process` of another process can also hold the lock for a moment.
    raise InputError(
        "another process uses this store",
        where=str(folder),
        found=_read_holder(file),
        remedy="wait until that process ends, or use another folder",
    )


def _try_lock(file: IO[bytes], flags: int) -> bool:
    try:
        fcntl.flock(file, flags | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _read_holder(file: IO[bytes]) -> str:
    try:
        file.seek(0)
        data = json.loads(file.read(1000))
        return f"process {int(data['process'])} on {data['host']}"
    except (OSError, ValueError, KeyError, TypeError):
        return "an unknown process"


# -- results of the accuracy study ----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class FailedStudy:
    reason: str


@dataclass(frozen=True, slots=True)
class StudySettings:
    """Settings of the accuracy study; with `moving_base`, the root link moves at random in each sample."""

    samples: int
    seed: int
    moving_base: bool

    @property
    def options(self) -> str:
        moving = " --accuracy-moving-base" if self.moving_base else ""
        return f"--accuracy-samples {self.samples} --seed {self.seed}{moving}"


class AccuracyStore:
    def __init__(self, store: Store, settings: StudySettings) -> None:
        self._store, self._settings = store, settings

    @classmethod
    def merge(cls, store: Store, others: Sequence[Store]) -> None:
        theirs = [results for results in map(cls.from_store, others) if results is not None]
        if not theirs:
            return
        own = cls.from_store(store) or cls(store, theirs[0]._settings)
        for results in theirs:
            own._check_same(results)
        own.write_settings()
        for results in theirs:
            for robot in range(len(store.manifest.robots)):
                if own.read(robot) is None and (study := results.read(robot)) is not None:
                    own.write(robot, study)

    @classmethod
    def from_store(cls, store: Store) -> AccuracyStore | None:
        """Return the store's accuracy results; None if they are missing or unreadable."""
        try:
            if (content := read_if_exists(store.folder / _STUDY_SETTINGS_FILE)) is None:
                return None
            settings = from_data(json.loads(content), StudySettings)
        except (OSError, ValueError, RecursionError) as error:
            store.notify(
                f"{store.folder / _STUDY_SETTINGS_FILE} cannot be read ({type(error).__name__}): the report"
                " has no accuracy results"
            )
            return None
        return cls(store, settings)

    def write_settings(self) -> None:
        self._store.write(_STUDY_SETTINGS_FILE, (json.dumps(asdict(self._settings)) + "\n").encode())

    def read(self, robot: int) -> AccuracyStudy | FailedStudy | None:
        return self._store.read_entry(self._key(robot), _STUDY_SUFFIX, _decode_study)

    def has(self, robot: int) -> bool:
        return self._store.has_entry(self._key(robot), _STUDY_SUFFIX)

    def write(self, robot: int, study: AccuracyStudy | FailedStudy) -> None:
        key = self._key(robot)
        self._store.write_entry(key, _STUDY_SUFFIX, pack(key, {"accuracy": study}))

    def robot_sha256(self, robot: int) -> str:
        return self._store.manifest.robots[robot][1]

    def _check_same(self, other: AccuracyStore) -> None:
        if other._settings != self._settings:
            raise InputError(
                "the accuracy results in the two folders were computed with different options",
                where=str(other._store.folder),
                found=f"{other._settings.options}, and {self._settings.options} in {self._store.folder}",
                remedy="run the accuracy study with the same options for both folders",
            )

    def _key(self, robot: int) -> str:
        manifest = self._store.manifest
        origin, sha256 = manifest.robots[robot]
        origin = replace(origin, oracle=None)  # The study uses no second oracle.
        parts = [
            manifest.provenance,
            package_version("python-flint"),
            asdict(self._settings),
            asdict(origin),
            sha256,
        ]
        return hashlib.sha256(json.dumps([_LAYOUT, "accuracy", *parts], sort_keys=True).encode()).hexdigest()


def _decode_study(key: str, content: bytes) -> AccuracyStudy | FailedStudy:
    from urdfkin.validation.accuracy import AccuracyStudy

    data = unpack(key, content).get("accuracy")
    try:
        if isinstance(data, dict) and "reason" in data:
            return from_data(data, FailedStudy)
        return from_data(data, AccuracyStudy)
    except ValueError as error:
        raise DamagedError(f"not an accuracy result of urdfkin ({error})") from error
