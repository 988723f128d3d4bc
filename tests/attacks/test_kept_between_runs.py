"""What is kept between runs: damage is mended, a full disc ends nothing, what a stranger keeps is not run."""

from __future__ import annotations

import errno
import os
import pickle
import resource
import signal
import stat
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.running import Done, process
from urdfkin.compiled.machine import compiling
from urdfkin.compiled.machine.compiling import NUMBERS, Kernel
from urdfkin.system import cache
from urdfkin.system.cache import CacheWarning, get, kept_folder, put


@pytest.fixture(autouse=True)
def _nothing_said_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "_warned", set())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(compiling, "cache_folder", lambda: tmp_path)
    return tmp_path


#: A command with so many configurations that it uses a kernel.
BATCH = ("placement", "ur5", "--q", "random:20000", "--format", "csv")


def third(x: Any) -> Any:
    return int(x[2])


def fresh() -> Kernel:
    """A small kernel that this process has not compiled yet."""
    return Kernel(third, (NUMBERS,), True)


def ask(kernel: Kernel) -> int:
    return kernel(np.array([5.0, 6.0, 7.0]))


def was_compiled(kernel: Kernel) -> bool:
    return bool(kernel.compiled.stats.cache_misses)


def cut(content: bytes) -> bytes:
    return content[: len(content) // 2]


def flipped(content: bytes) -> bytes:
    """One bit in the middle, which for a kernel is machine code."""
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 4]) + content[middle + 1 :]


DAMAGE: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: b"",
    "cut": cut,
    "one bit": flipped,
    "a byte more": lambda content: content + b"\x00",
    "random": lambda content: np.random.default_rng(0).bytes(len(content)),
    "zeros": lambda content: bytes(len(content)),
    "a pickle that is none of ours": lambda content: pickle.dumps(["something", "else"]),
}


def test_a_kernel_is_compiled_once_and_read_afterwards(folder: Path) -> None:
    assert was_compiled(fresh())
    again = fresh()
    assert not was_compiled(again)
    assert ask(again) == 7


@pytest.mark.long
@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_kernel_is_said_compiled_again_and_mended(damage: str, folder: Path) -> None:
    ask(fresh())
    (file,) = folder.iterdir()
    file.write_bytes(DAMAGE[damage](file.read_bytes()))
    kernel = fresh()
    with pytest.warns(CacheWarning, match=f"{file.name} is damaged and is computed again"):
        assert ask(kernel) == 7
    assert was_compiled(kernel)
    assert not was_compiled(fresh())
    assert list(folder.iterdir()) == [file]


def test_a_kernel_that_is_whole_but_of_another_time_is_compiled_again(folder: Path) -> None:
    ask(fresh())
    (file,) = folder.iterdir()
    put(file, pickle.dumps(("not", "a", "kernel")))
    with pytest.warns(CacheWarning, match="is damaged and is computed again"):
        assert ask(fresh()) == 7
    assert not was_compiled(fresh())


def test_a_kept_file_in_another_folder_of_its_name_is_noticed(tmp_path: Path) -> None:
    first, second = tmp_path / "library-1" / "machine.code", tmp_path / "library-2" / "machine.code"
    for place in (first, second):
        place.parent.mkdir()
    put(first, b"of the first")
    second.write_bytes(first.read_bytes())
    with pytest.warns(CacheWarning, match="the checksum of the file does not match its content and its name"):
        assert get(second) is None
    assert get(first) == b"of the first"
    first.parent.rename(tmp_path / "moved")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "moved").rename(tmp_path / "elsewhere" / "library-1")
    assert (
        get(tmp_path / "elsewhere" / "library-1" / "machine.code") == b"of the first"
    )  # the cache as a whole


# -- no room ---------------------------------------------------------------------------------------------


@pytest.fixture(params=[errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EIO])
def no_room(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    """Every new file fails so; the superuser, as whom tests may run, can be refused no other way."""
    code: int = request.param

    def refuse(*_: object, **__: object) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr("urdfkin.system.cache.tempfile.NamedTemporaryFile", refuse)
    return code


@pytest.mark.long
def test_where_nothing_can_be_written_everything_goes_on_and_it_is_said_once(
    folder: Path, no_room: int
) -> None:
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert ask(fresh()) == 7
        assert ask(fresh()) == 7
    (warning,) = said
    assert warning.category is CacheWarning
    assert f"the cache cannot be written in {folder}: {os.strerror(no_room)}" in str(warning.message)
    assert list(folder.iterdir()) == []


@pytest.fixture
def largest_file() -> Iterator[Callable[[int], None]]:
    """Let files grow to so many bytes only: what is written ends in the middle, as on a full disc."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


def test_a_file_that_ends_in_the_middle_leaves_nothing_behind(
    tmp_path: Path, largest_file: Callable[[int], None]
) -> None:
    largest_file(1000)
    with pytest.warns(CacheWarning, match=f"the cache cannot be written in .*: {os.strerror(errno.EFBIG)}"):
        put(tmp_path / "kept", bytes(5000))
    assert list(tmp_path.iterdir()) == []
    put(tmp_path / "kept", bytes(500))
    assert get(tmp_path / "kept") == bytes(500)


@pytest.mark.long
def test_a_command_on_a_full_disc_gives_its_result_and_says_so(tmp_path: Path) -> None:
    """A disc of its own where the system lets one be mounted; else files may not grow."""
    cache, disc = tmp_path / "cache", ["mount", "-t", "tmpfs", "-o", "size=64k,mode=0700", "none"]
    cache.mkdir(mode=0o700)
    mounted = subprocess.run([*disc, str(cache)], capture_output=True, check=False).returncode == 0
    try:
        if mounted:
            (cache / "much").write_bytes(bytes(60_000))
            done = process(*BATCH, XDG_CACHE_HOME=str(cache), NUMBA_CACHE_DIR="")
        else:
            done = limited(*BATCH, XDG_CACHE_HOME=str(cache), NUMBA_CACHE_DIR="")
    finally:
        if mounted:
            subprocess.run(["umount", str(cache)], check=True)
    assert done.code == 0, done.err
    assert "verified by Pinocchio" in done.err
    assert done.err.count("the cache cannot be written in") == 1
    assert "Traceback" not in done.err


def limited(*words: str, **env: str) -> Done:
    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))

    command = [sys.executable, "-m", "urdfkin", *words]
    done = subprocess.run(
        command, env={**os.environ, **env}, capture_output=True, check=False, preexec_fn=limit
    )
    return Done(done.returncode, done.stdout, done.stderr.decode())


@pytest.mark.long
def test_a_command_with_a_damaged_cache_says_so_in_a_line_and_mends_it(tmp_path: Path) -> None:
    def placement() -> Done:
        return process(*BATCH, XDG_CACHE_HOME=str(tmp_path), NUMBA_CACHE_DIR="")

    placement()
    kernel = min(tmp_path.glob("urdfkin/kernels-*/[!.]*"))
    kernel.write_bytes(flipped(kernel.read_bytes()))
    done = placement()
    assert done.code == 0
    lines = [line for line in done.err.splitlines() if "damaged" in line]
    assert len(lines) == 1
    assert lines[0].startswith("urdfkin: warning: ")
    assert "damaged" not in placement().err


# -- whose folder ------------------------------------------------------------------------------------------


def refused(root: Path, words: str) -> None:
    with pytest.warns(CacheWarning, match=words):
        assert kept_folder("kernels", [], root=root) is None


def test_a_folder_of_ones_own_is_closed_to_others(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        folder = kept_folder("kernels", [], root=tmp_path / "urdfkin")
    finally:
        os.umask(before)
    assert folder is not None
    assert [stat.S_IMODE(place.stat().st_mode) for place in (folder, folder.parent)] == [0o700, 0o700]


@pytest.mark.parametrize("mode", [0o777, 0o1777, 0o702])
def test_a_folder_that_everybody_may_write_in_is_refused(mode: int, tmp_path: Path) -> None:
    folder = kept_folder("kernels", [], root=tmp_path)
    assert folder is not None
    folder.chmod(mode)
    refused(tmp_path, r"every user can write to .*chmod go-w.* and delete")


def test_a_folder_in_which_everybody_could_put_another_in_its_place_is_refused(tmp_path: Path) -> None:
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o777)
    refused(shared / "urdfkin", "every user can write to")
    shared.chmod(0o1777)  # sticky, as /tmp: nobody can move what another owns
    assert kept_folder("kernels", [], root=shared / "urdfkin") is not None


def test_a_folder_of_a_group_is_refused_but_not_that_of_a_users_own_group(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = kept_folder("kernels", [], root=tmp_path)
    assert folder is not None
    folder.chmod(0o770)
    monkeypatch.setattr(cache, "_is_private", lambda group: True)
    assert kept_folder("kernels", [], root=tmp_path) == folder
    monkeypatch.setattr(cache, "_is_private", lambda group: False)
    refused(tmp_path, "a group can write to")


@pytest.mark.parametrize("whose", ["the folder", "the one above", "the file behind a link"])
def test_a_folder_of_another_user_is_refused(
    whose: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its files would be unpickled, and could do anything. Only the superuser can give folders away."""
    root = tmp_path / "shared" / "urdfkin"
    folder = kept_folder("kernels", [], root=root)
    assert folder is not None
    stranger = {"the folder": folder, "the one above": root.parent}.get(whose, folder)
    if whose == "the file behind a link":
        (tmp_path / "link").symlink_to(root)
        root = tmp_path / "link"
    own = Path.stat

    def told(self: Path, **options: Any) -> Any:
        found = own(self, **options)
        return os.stat_result((*found[:4], 12345, *found[5:])) if self == stranger else found

    if os.geteuid() == 0:
        os.chown(stranger, 12345, 12345)
    else:
        monkeypatch.setattr(Path, "stat", told)
    refused(root, "belongs to another user; set XDG_CACHE_HOME to a folder of your own")


def test_a_planted_kernel_of_another_user_is_not_unpickled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if os.geteuid() != 0:
        pytest.skip("only the superuser can give a folder away")
    monkeypatch.setattr(compiling, "cache_folder", lambda: kept_folder("kernels", [], root=tmp_path))
    ask(fresh())
    (folder,) = tmp_path.iterdir()
    (file,) = (path for path in folder.iterdir() if path.name != ".used")
    put(file, pickle.dumps(Planted()))
    os.chown(folder, 12345, 12345)
    with pytest.warns(CacheWarning, match="belongs to another user"):
        assert ask(fresh()) == 7
    assert not Planted.ran


class Planted:
    """A pickle that runs something."""

    ran = False

    def __reduce__(self) -> tuple[Callable[[], None], tuple[()]]:
        return run_planted, ()


def run_planted() -> None:
    Planted.ran = True


def test_the_month_old_folder_of_another_user_is_left_alone(tmp_path: Path) -> None:
    if os.geteuid() != 0:
        pytest.skip("only the superuser can give a folder away")
    old = kept_folder("kernels", [], "old", root=tmp_path)
    assert old is not None
    os.utime(old / ".used", (0.0, 0.0))
    os.chown(old / ".used", 12345, 12345)
    kept_folder("kernels", [], "new", root=tmp_path)
    assert old.exists()


def test_a_folder_that_can_only_be_read_is_still_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = kept_folder("kernels", [], root=tmp_path)

    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(Path, "touch", refuse)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert kept_folder("kernels", [], root=tmp_path) == folder
