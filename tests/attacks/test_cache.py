"""The cache on disc: damaged files are replaced, a full disc is no error, other users' files are not run."""

import errno
import os
import pickle
import resource
import signal
import stat
import subprocess
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest

from tests.cli.running import process
from tests.reading import present
from urdfkin import compiled as recursion
from urdfkin import kinematics
from urdfkin.compiled import kernel_cache, machine
from urdfkin.compiled.machine import compiling
from urdfkin.compiled.machine.compiling import FLOATS_1D, Kernel
from urdfkin.system import cache
from urdfkin.system.cache import CacheWarning, make_cache_folder, read_cached_file, write_cached_file


@pytest.fixture(autouse=True)
def _no_warning_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "_warned_messages", set())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(compiling, "kernel_cache_folder", lambda: tmp_path)
    return tmp_path


#: A command with enough configurations to use a kernel.
BATCH = ("placement", "ur5", "--q", "random:20000", "--format", "csv")


def third_number(x: Any) -> Any:
    return int(x[2])


def new_kernel() -> Kernel:
    return Kernel(third_number, (FLOATS_1D,))


def call(kernel: Kernel) -> int:
    return kernel(np.array([5.0, 6.0, 7.0]))


def was_compiled(kernel: Kernel) -> bool:
    return bool(kernel.compiled_function.stats.cache_misses)


def with_one_bit_flipped(content: bytes) -> bytes:
    middle = len(content) // 2  # In a kernel, the middle is machine code.
    return content[:middle] + bytes([content[middle] ^ 4]) + content[middle + 1 :]


DAMAGE: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: b"",
    "cut": lambda content: content[: len(content) // 2],
    "one bit": with_one_bit_flipped,
    "a byte more": lambda content: content + b"\x00",
    "random": lambda content: np.random.default_rng(0).bytes(len(content)),
    "zeros": lambda content: bytes(len(content)),
    "another pickle": lambda content: pickle.dumps(["something", "else"]),
}


def test_a_kernel_is_compiled_once_and_compiled_again_if_the_file_is_invalid(folder: Path) -> None:
    assert was_compiled(new_kernel())
    again = new_kernel()
    assert not was_compiled(again)
    assert call(again) == 7
    (file,) = folder.iterdir()
    write_cached_file(file, pickle.dumps(("not", "a", "kernel")))
    with pytest.warns(CacheWarning, match="is damaged and is computed again"):
        assert call(new_kernel()) == 7
    assert not was_compiled(new_kernel())


@pytest.mark.long
@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_kernel_is_compiled_again_with_a_warning_and_replaced(damage: str, folder: Path) -> None:
    call(new_kernel())
    (file,) = folder.iterdir()
    file.write_bytes(DAMAGE[damage](file.read_bytes()))
    kernel = new_kernel()
    with pytest.warns(CacheWarning, match=f"{file.name} is damaged and is computed again"):
        assert call(kernel) == 7
    assert was_compiled(kernel)
    assert not was_compiled(new_kernel())
    assert list(folder.iterdir()) == [file]


def test_a_cached_file_copied_to_another_folder_is_rejected(tmp_path: Path) -> None:
    first, second = tmp_path / "library-1" / "machine.code", tmp_path / "library-2" / "machine.code"
    for path in (first, second):
        path.parent.mkdir()
    write_cached_file(first, b"of the first")
    second.write_bytes(first.read_bytes())
    with pytest.warns(CacheWarning, match="the checksum of the file does not match its content and its name"):
        assert read_cached_file(second) is None
    assert read_cached_file(first) == b"of the first"
    moved = tmp_path / "elsewhere" / "library-1"  # The whole cache is moved.
    moved.parent.mkdir()
    first.parent.rename(moved)
    assert read_cached_file(moved / "machine.code") == b"of the first"


# -- no space --------------------------------------------------------------------------------------


def failing(code: int) -> Callable[..., NoReturn]:
    def fail(*_: object, **__: object) -> NoReturn:
        raise OSError(code, os.strerror(code))

    return fail


@pytest.fixture(params=[errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EIO])
def no_space(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    """The error of every new file; file permissions would not stop the superuser."""
    code: int = request.param
    monkeypatch.setattr("urdfkin.system.cache.tempfile.NamedTemporaryFile", failing(code))
    return code


@pytest.mark.long
def test_an_unwritable_cache_causes_one_warning_and_no_error(folder: Path, no_space: int) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert call(new_kernel()) == 7
        assert call(new_kernel()) == 7
    (warning,) = caught
    assert warning.category is CacheWarning
    assert f"the cache cannot be written in {folder}: {os.strerror(no_space)}" in str(warning.message)
    assert list(folder.iterdir()) == []


@pytest.fixture
def limit_file_size() -> Iterator[Callable[[int], None]]:
    """A function that limits the size of files, so that a write ends early, as on a full disc."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


def test_an_incomplete_write_leaves_no_file(tmp_path: Path, limit_file_size: Callable[[int], None]) -> None:
    limit_file_size(1000)
    with pytest.warns(CacheWarning, match=f"the cache cannot be written in .*: {os.strerror(errno.EFBIG)}"):
        write_cached_file(tmp_path / "kept", bytes(5000))
    assert list(tmp_path.iterdir()) == []
    write_cached_file(tmp_path / "kept", bytes(500))
    assert read_cached_file(tmp_path / "kept") == bytes(500)


@pytest.mark.long
def test_a_command_on_a_full_disc_prints_its_result_and_one_warning(
    tmp_path: Path, limit_file_size: Callable[[int], None]
) -> None:
    """The cache is a small file system or, if that cannot be mounted, the size of files is limited."""
    cache, disc = tmp_path / "cache", ["mount", "-t", "tmpfs", "-o", "size=64k,mode=0700", "none"]
    cache.mkdir(mode=0o700)
    mounted = subprocess.run([*disc, str(cache)], capture_output=True, check=False).returncode == 0
    try:
        if mounted:
            (cache / "much").write_bytes(bytes(60_000))
        else:
            limit_file_size(10_000)  # A child process inherits the limit and the ignored signal.
        done = process(*BATCH, XDG_CACHE_HOME=str(cache), NUMBA_CACHE_DIR="")
    finally:
        if mounted:
            subprocess.run(["umount", str(cache)], check=True)
    assert done.code == 0, done.err
    assert "verified by Pinocchio" in done.err
    assert done.err.count("the cache cannot be written in") == 1
    assert "Traceback" not in done.err


@pytest.mark.long
def test_a_command_with_a_damaged_cache_prints_one_warning_and_replaces_the_file(tmp_path: Path) -> None:
    placement = partial(process, *BATCH, XDG_CACHE_HOME=str(tmp_path), NUMBA_CACHE_DIR="")
    placement()
    kernel = min(tmp_path.glob("urdfkin/kernels-*/[!.]*"))
    kernel.write_bytes(with_one_bit_flipped(kernel.read_bytes()))
    done = placement()
    assert done.code == 0
    (line,) = [line for line in done.err.splitlines() if "damaged" in line]
    assert line.startswith("urdfkin: warning: ")
    assert "damaged" not in placement().err


# -- owner of the folder ---------------------------------------------------------------------------


def demand_refused(root: Path, words: str) -> None:
    with pytest.warns(CacheWarning, match=words):
        assert make_cache_folder("kernels", [], root=root) is None


def created(root: Path, *words: str, kind: str = "kernels") -> Path:
    return present(make_cache_folder(kind, [], *words, root=root))


def test_a_new_cache_is_private_and_only_a_private_group_may_write_in_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = os.umask(0)
    try:
        folder = created(tmp_path / "urdfkin")
    finally:
        os.umask(before)
    assert [stat.S_IMODE(path.stat().st_mode) for path in (folder, folder.parent)] == [0o700, 0o700]
    folder = created(tmp_path)
    folder.chmod(0o770)
    monkeypatch.setattr(cache, "_is_private", lambda group: True)
    assert created(tmp_path) == folder
    monkeypatch.setattr(cache, "_is_private", lambda group: False)
    demand_refused(tmp_path, "a group can write to")


@pytest.mark.parametrize("mode", [0o777, 0o1777, 0o702])
def test_a_folder_that_every_user_can_write_to_is_refused(mode: int, tmp_path: Path) -> None:
    created(tmp_path).chmod(mode)
    demand_refused(tmp_path, r"every user can write to .*chmod go-w.* and delete")


def test_a_parent_folder_that_is_replaceable_or_no_folder_is_refused(tmp_path: Path) -> None:
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o777)
    demand_refused(shared / "urdfkin", "every user can write to")
    shared.chmod(0o1777)  # Sticky, as /tmp: only the owner can rename a file.
    created(shared / "urdfkin")
    (tmp_path / "file").write_text("")
    demand_refused(tmp_path / "file", "the cache cannot be written in .*file: .*set XDG_CACHE_HOME")


@pytest.mark.parametrize("whose", ["the folder", "the one above", "the file behind a link"])
def test_a_cache_folder_of_another_user_is_refused(
    whose: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unpickling the files of another user could run any code. Only the superuser can change an owner."""
    root = tmp_path / "shared" / "urdfkin"
    folder = created(root)
    stranger = root.parent if whose == "the one above" else folder
    if whose == "the file behind a link":
        (tmp_path / "link").symlink_to(root)
        root = tmp_path / "link"
    own = Path.stat

    def stat_of_another_user(self: Path, **options: Any) -> Any:
        found = own(self, **options)
        return os.stat_result((*found[:4], 12345, *found[5:])) if self == stranger else found

    if os.geteuid() == 0:
        os.chown(stranger, 12345, 12345)
    else:
        monkeypatch.setattr(Path, "stat", stat_of_another_user)
    demand_refused(root, "belongs to another user; set XDG_CACHE_HOME to a folder of your own")


def test_a_kernel_of_another_user_is_not_unpickled_and_its_old_folder_is_not_deleted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if os.geteuid() != 0:
        pytest.skip("only the superuser can change the owner of a folder")
    monkeypatch.setattr(
        compiling, "kernel_cache_folder", lambda: make_cache_folder("kernels", [], root=tmp_path)
    )
    call(new_kernel())
    (folder,) = tmp_path.iterdir()
    (file,) = (path for path in folder.iterdir() if path.name != ".used")
    write_cached_file(file, pickle.dumps(Malicious(tmp_path / "ran")))
    os.chown(folder, 12345, 12345)
    with pytest.warns(CacheWarning, match="belongs to another user"):
        assert call(new_kernel()) == 7
    assert not (tmp_path / "ran").exists()
    old = created(tmp_path / "others", "old")
    os.utime(old / ".used", (0.0, 0.0))
    os.chown(old / ".used", 12345, 12345)
    created(tmp_path / "others", "new")
    assert old.exists()


@dataclass
class Malicious:
    """An object that creates a folder when it is unpickled."""

    mark: Path

    def __reduce__(self) -> tuple[Callable[[Path], None], tuple[Path]]:
        return os.mkdir, (self.mark,)


def test_a_read_only_folder_is_used_without_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = created(tmp_path)
    monkeypatch.setattr(Path, "touch", failing(errno.EROFS))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert created(tmp_path) == folder


# -- one folder for each version of the sources ----------------------------------------------------


def test_the_kernel_cache_depends_on_every_source_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[Path] = []

    def recording(kind: str, sources: Iterable[Path], *besides: str, root: Path | None = None) -> Path:
        seen.extend(sources)
        return tmp_path

    monkeypatch.setattr(cache, "make_cache_folder", recording)
    uncached: Callable[[], Path | None] = kernel_cache.kernel_cache_folder.__wrapped__
    assert uncached() == tmp_path
    folders = [Path(str(module.__file__)).parent for module in (recursion, machine, kinematics)]
    files = {path for folder in folders for path in folder.glob("*.py")}
    assert len(files) > 5
    assert files <= set(seen)


def test_a_trusted_owner_of_parent_folders_may_not_own_the_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    owner = tmp_path.stat().st_uid
    assert cache._unsafe_reason(tmp_path) is None
    monkeypatch.setattr(cache, "_TRUSTED_OWNERS", (0, owner))
    monkeypatch.setattr("os.geteuid", lambda: owner + 1)
    assert str(cache._unsafe_reason(tmp_path)).startswith(f"{tmp_path} belongs to another user")


@pytest.mark.parametrize("changed", [0, 1, 2])
def test_a_change_in_any_source_selects_another_folder(changed: int, tmp_path: Path) -> None:
    sources = [tmp_path / f"{name}.py" for name in "abc"]
    for source in sources:
        source.write_text("x = 1")
    first, again, *others = (
        make_cache_folder(kind, sources, version, root=tmp_path)
        for kind, version in (("things", "1.0"), ("things", "1.0"), ("things", "1.1"), ("trees", "1.0"))
    )
    assert first == again
    sources[changed].write_text("x = 2")
    others.append(make_cache_folder("things", sources, "1.0", root=tmp_path))
    assert len({first, *others}) == 4
    assert all(present(folder).is_dir() for folder in (first, *others))


def test_only_folders_unused_for_a_month_are_deleted(tmp_path: Path) -> None:
    old, recent = created(tmp_path, "old"), created(tmp_path, "recent")
    other = created(tmp_path, "old", kind="trees")
    foreign = tmp_path / "kernels-of-somebody-else"
    foreign.mkdir()
    (old / "kernel.nbc").write_bytes(b"compiled")
    for folder, days in ((old, 30.1), (recent, 29.9), (other, 30.1)):
        then = time.time() - days * 24 * 3600
        os.utime(folder / ".used", (then, then))
    used = created(tmp_path, "new")
    assert not old.exists()
    assert set(tmp_path.iterdir()) == {recent, other, foreign, used}
    assert created(tmp_path, "old", kind="trees") == other
    assert other.exists()
