"""A campaign's folder: a manifest, and one small file a chunk, each there whole or not at all.

    DIR/manifest.json           what the campaign is
    DIR/chunks/4f/4f1a....chunk   what a chunk found; .failed: why its robot could not be checked
    DIR/judge.json              what the judge was asked for; chunks/*/*.judged: what it found
    DIR/lock                    held by who is at work

It knows no engine: whoever computed a chunk, its answer lies under the chunk's key. A file that is no answer
is reported, put aside and computed again; so is one under a name that no chunk of the campaign has.
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
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TypeVar

from urdfkin.errors import InputError, SourceError
from urdfkin.system.files import read_bytes, read_if_there
from urdfkin.validation.answer import Answer, DamagedError, Failure, read, written
from urdfkin.validation.manifest import Manifest

_MANIFEST, _LOCK, _CHUNKS, _ASIDE = "manifest.json", "lock", "chunks", "damaged"
_WRITING = ".writing"
#: What the judge was asked for; `urdfkin.validation.accuracy_store`.
JUDGE = "judge.json"
#: How the name of a file ends that holds what the judge found; its key is the judge's.
JUDGED = ".judged"
_DONE, _FAILED = ".chunk", ".failed"

#: How often a lock is asked for, a tenth of a second apart.
_TRIES = 10

_T = TypeVar("_T")

#: Told of each file that cannot be trusted.
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Store:
    """The folder of a campaign, to read from; `opened` gives one to write to.

    Attributes:
        folder: Where.
        manifest: What the campaign is.
        tell: Told of each damaged file.
        scratch: Where files are begun; None: nothing can be written.
    """

    folder: Path
    manifest: Manifest
    tell: Tell
    scratch: Path | None = None

    @classmethod
    def reading(cls, folder: Path, tell: Tell) -> Store:
        """A store as it is now, whoever is at work on it.

        Raises:
            SourceError, InputError: it is none.
        """
        place = folder / _MANIFEST
        return cls(folder, Manifest.from_json(read_bytes(place), str(place)), tell)

    def answer(self, robot: int, index: int) -> Answer | None:
        """What is known of a chunk; a damaged file is put aside, or left where nothing can be written."""
        key = self.manifest.key(robot, index)
        return self.kept(key, _DONE, read) or self.kept(key, _FAILED, read)

    def kept(self, key: str, kind: str, read: Callable[[str, bytes], _T]) -> _T | None:
        """What lies under a key; what cannot be read as that is put aside."""
        place = self._place(key, kind)
        try:
            content = read_if_there(place)
            return None if content is None else read(key, content)
        except (DamagedError, OSError) as error:
            why = f"{error.what}: {error.found}" if isinstance(error, SourceError) else str(error)
            self._put_aside(place, f"is computed again: {why}")
            return None

    def keep(self, robot: int, index: int, found: Answer) -> None:
        """Write an answer: on the disc, whole, when this returns.

        Raises:
            SourceError: it cannot be written.
        """
        key = self.manifest.key(robot, index)
        self.keep_part(key, _FAILED if isinstance(found, Failure) else _DONE, written(key, found))

    def has(self, key: str, kind: str) -> bool:
        """Whether something lies under a key."""
        return self._place(key, kind).exists()

    @property
    def has_judge(self) -> bool:
        """Whether the judge was asked."""
        return (self.folder / JUDGE).exists()

    def keep_part(self, key: str, kind: str, data: bytes) -> None:
        """Write what `kept` reads, likewise."""
        self._write(self._place(key, kind), data)

    def forget_failures(self) -> None:
        """Have the robots that could not be checked computed again."""
        for place in self._files(_FAILED):
            place.unlink(missing_ok=True)

    def check_names(self) -> None:
        """Report files beside the chunks that have the name of none, as a renamed one, and put them aside."""
        keys = (
            self.manifest.key(robot, index)
            for robot in range(len(self.manifest.robots))
            for index in range(len(self.manifest.cut))
        )
        expected = {self._place(key, kind) for key in keys for kind in (_DONE, _FAILED)}
        for place in sorted((self.folder / _CHUNKS).glob("*/*")):
            if place not in expected and place.suffix != JUDGED:
                self._put_aside(place, "is not used: no chunk of this campaign has this name")

    def counts(self) -> dict[int, tuple[int, bool]]:
        """For each robot how many of its chunks are there, and whether it failed; by the files' names."""
        names = {place.name for kind in (_DONE, _FAILED) for place in self._files(kind)}
        found = {}
        for robot in range(len(self.manifest.robots)):
            keys = [self.manifest.key(robot, index) for index in range(len(self.manifest.cut))]
            done = sum(key + _DONE in names for key in keys)
            found[robot] = done, any(key + _FAILED in names for key in keys)
        return found

    def take(self, other: Store) -> int:
        """Copy what another store of the same campaign has and this one has not; how many chunks it were."""
        other.check_names()
        taken = 0
        for robot in range(len(self.manifest.robots)):
            for index in range(len(self.manifest.cut)):
                if self.answer(robot, index) is None and (found := other.answer(robot, index)) is not None:
                    self.keep(robot, index, found)
                    taken += 1
        return taken

    def demand_same(self, manifest: Manifest, where: object) -> None:
        """Refuse another campaign, with what differs.

        Raises:
            InputError: it is another one.
        """
        if differences := self.manifest.differences(manifest):
            raise InputError(
                "another campaign's store",
                where=str(self.folder),
                found=f"(there, and {where}) {'; '.join(differences)}",
                remedy="give the options it was made with, or another folder",
            )

    def at_work(self) -> str | None:
        """Who is at work on it; None: nobody."""
        try:
            with _lock_file(self.folder / _LOCK, os.O_RDONLY) as file:
                return None if _try_lock(file, fcntl.LOCK_SH) else _holder(file)
        except OSError:
            return None

    def write_manifest(self) -> None:
        """Write what the campaign is."""
        self.write(_MANIFEST, self.manifest.as_json())

    def write(self, name: str, data: bytes) -> None:
        """Write a file beside the manifest.

        Raises:
            SourceError: it cannot be written.
        """
        self._write(self.folder / name, data)

    def _place(self, key: str, kind: str) -> Path:
        return self.folder / _CHUNKS / key[:2] / (key + kind)

    def _files(self, kind: str) -> Iterator[Path]:
        return (self.folder / _CHUNKS).glob(f"*/*{kind}")

    def _put_aside(self, place: Path, why: str) -> None:
        self.tell(f"{place} {why}")
        if self.scratch is not None:
            aside = self.folder / _ASIDE
            with contextlib.suppress(OSError):
                aside.mkdir(exist_ok=True)
                place.replace(aside / place.name)

    def _write(self, place: Path, data: bytes) -> None:
        if self.scratch is None:
            raise SourceError("a store that is only read", where=str(self.folder))
        begun = self.scratch / place.name
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            with begun.open("wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            begun.replace(place)
        except OSError as error:
            raise SourceError(
                "the store cannot be written",
                where=str(self.folder),
                found=error.strerror or str(error),
                remedy="what it holds stays; make room and give the same command again to go on",
            ) from error


@contextlib.contextmanager
def opened(
    folder: Path, manifest: Manifest, tell: Tell, *, shard: str | None = None, retry_failed: bool = False
) -> Iterator[Store]:
    """The store of a campaign, made if it is not there, for this process alone.

    Args:
        folder: Where.
        manifest: What the campaign is.
        tell: Told of each damaged file.
        shard: Only a part of it is worked on, as others are on other parts.
        retry_failed: Forget what failed; those robots may have other texts now.

    Raises:
        SourceError: it cannot be made or written.
        InputError: it is another campaign's, or somebody else is at work on it.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / _MANIFEST).exists() and not all(map(_is_ours, folder.iterdir())):
            raise InputError(
                "a folder that is not empty and is no campaign's",
                where=str(folder),
                remedy="name a folder that is empty or not there yet",
            )
        with _locked(folder, shard):
            if (folder / _WRITING).is_symlink():
                raise SourceError(
                    "a link in place of the store's folder",
                    where=str(folder / _WRITING),
                    remedy="delete the link",
                )
            scratch = folder / _WRITING / (shard or "all").replace("/", "-of-")
            shutil.rmtree(scratch, ignore_errors=True)  # what a killed one had begun
            scratch.mkdir(parents=True)
            try:
                store = _opened(Store(folder, manifest, tell, scratch), retry_failed=retry_failed)
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
    """Whether it may be there before the manifest is: other parts begin at the same time."""
    return path.name in (_WRITING, _CHUNKS) or path.name.startswith(_LOCK)


def _opened(store: Store, *, retry_failed: bool) -> Store:
    """The store with its own manifest if it has one: it says when the campaign began."""
    if not (store.folder / _MANIFEST).exists():
        store.write_manifest()
        return store
    before = Store(store.folder, Store.reading(store.folder, store.tell).manifest, store.tell, store.scratch)
    if retry_failed and _only_failed_ones_differ(before, store.manifest):
        before.forget_failures()
        store.write_manifest()
        return store
    before.demand_same(store.manifest, "here")
    if retry_failed:
        before.forget_failures()
    return before


def _only_failed_ones_differ(store: Store, manifest: Manifest) -> bool:
    """Whether the manifests differ in nothing but the texts of robots that failed."""
    mine, theirs = store.manifest, manifest
    if len(mine.robots) != len(theirs.robots):
        return False
    differ = [i for i, pair in enumerate(zip(mine.robots, theirs.robots, strict=True)) if pair[0] != pair[1]]
    robots = [theirs.robots[i] if i in differ else robot for i, robot in enumerate(mine.robots)]
    same = Manifest(tuple(robots), mine.samples, mine.seed, mine.provenance, mine.versions, mine.started)
    counts = store.counts()
    return (
        bool(differ)
        and not same.differences(theirs)
        and all(counts[i][1] and mine.robots[i][0] == theirs.robots[i][0] for i in differ)
    )


@contextlib.contextmanager
def _locked(folder: Path, shard: str | None) -> Iterator[None]:
    """One at a time on the whole, or one on each part."""
    with contextlib.ExitStack() as stack:
        whole = stack.enter_context(_lock_file(folder / _LOCK))
        _lock(whole, fcntl.LOCK_SH if shard else fcntl.LOCK_EX, folder)
        if shard:
            part = stack.enter_context(_lock_file(folder / f"{_LOCK}-{shard.replace('/', '-of-')}"))
            _lock(part, fcntl.LOCK_EX, folder)
            whole = part
        whole.truncate(0)
        whole.write(json.dumps({"host": socket.gethostname(), "process": os.getpid()}).encode())
        whole.flush()
        yield


def _lock_file(place: Path, how: int = os.O_RDWR | os.O_CREAT | os.O_APPEND) -> IO[bytes]:
    """A lock's file, which is never another file: a link, a pipe or a device in its place is refused."""
    try:
        descriptor = os.open(place, how | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o666)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise _no_lock(place, "a link") from error
        raise
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise _no_lock(place, "another kind of file")
    return os.fdopen(descriptor, "rb" if how == os.O_RDONLY else "a+b")


def _no_lock(place: Path, found: str) -> SourceError:
    return SourceError(
        "the store's lock is no file of its own", where=str(place), found=found, remedy="delete it"
    )


def _lock(file: IO[bytes], how: int, folder: Path) -> None:
    for _ in range(_TRIES):
        if _try_lock(file, how):
            return
        time.sleep(0.1)  # who only asks holds it for a moment
    raise InputError(
        "somebody else is at work on this store",
        where=str(folder),
        found=_holder(file),
        remedy="wait for it, end it, or name another folder",
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
        return "a process that has not said which"
