"""Every file is read by `system.files` up to a limit. Pipes and devices are read only if the user names them.

Reading the device /dev/zero to its end would need infinite memory.
"""

import ast
import io
import os
import resource
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from tests.cli.running import refused
from tests.cli.running import urdfkin as command
from tests.cli.test_check_in_a_repository import commit, git, put
from urdfkin.errors import SourceError
from urdfkin.robot.trajectory import read_arrays
from urdfkin.system import files
from urdfkin.system.cache import read_cached_file
from urdfkin.system.files import MAX_BYTES, read_bytes, read_if_exists, read_start
from urdfkin.system.git import merge_base_files
from urdfkin.urdf import mjcf, xacro
from urdfkin.urdf.catalogue import find_package
from urdfkin.validation.campaign import StoreWarning, validate
from urdfkin.validation.store import AccuracyStore, Store
from urdfkin.view import scene
from urdfkin.view.scene import shapes

PACKAGE = Path(urdfkin.__file__).parent

#: Modules that open files without `system.files`, and the files, which other users cannot replace.
OTHERS = {
    "cli/streams.py": "/dev/null",
    "model/conventions/convention.py": "urdfkin's own data; a user's file by the reader",
    "export/c.py": "urdfkin's own frames of code",
    "export/compiled_frame.py": "/proc, and what the compiler has just made in a folder of its own",
    "kinematics/registry/__init__.py": "urdfkin's own data",
    "urdf/lint/pages.py": "urdfkin's own pages",
    "report/html.py": "urdfkin's own pages",
    "system/files.py": "the reader",
    "system/processes.py": "the current folder, to return to it",
    "urdf/catalogue.py": "urdfkin's own catalogue",
    "validation/memory.py": "/proc and /sys",
    "validation/store.py": "a store's lock, refused unless it is a regular file; files that are written",
    "view/server.py": "the page of the installed viser",
}
_OPENING = {"open", "read_bytes", "read_text", "fdopen"}


@pytest.fixture(autouse=True)
def _bounded() -> Iterator[None]:
    """Limit the memory of the process to 2 GiB more than it uses."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + 2 * 2**30, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


def _opens(source: str) -> bool:
    """Return whether a module calls `open` or a method that opens a file."""
    calls = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call))
    names = (ast.unparse(call.func) for call in calls)
    opening = (name for name in names if name == "open" or ("." in name and name.split(".")[-1] in _OPENING))
    return any(not name.startswith("webbrowser.") for name in opening)


@pytest.mark.slow
def test_no_other_module_opens_files_that_another_user_may_have_created() -> None:
    opening = (path for path in PACKAGE.rglob("*.py") if _opens(path.read_text("utf-8")))
    assert {path.relative_to(PACKAGE).as_posix() for path in opening} == set(OTHERS)


def odd_file(kind: str, path: Path) -> Path:
    """Create a file that is not regular or too large, and return its path."""
    make: dict[str, Callable[[], object]] = {
        "a link to a device": lambda: path.symlink_to("/dev/zero"),
        "a pipe": lambda: os.mkfifo(path),
        "a folder": path.mkdir,
        "a large file": lambda: path.write_bytes(bytes(xacro.MAX_SEARCHED_BYTES + 1)),
    }
    make.get(kind, int)()
    return Path("/dev/zero") if kind == "a device" else path


@pytest.mark.parametrize("kind", ["a device", "a link to a device", "a pipe", "a folder"])
def test_a_file_that_is_not_regular_is_refused(kind: str, tmp_path: Path) -> None:
    path = odd_file(kind, tmp_path / "x")
    words = r"not a regular file: found a (character device|pipe)|directory"
    for read in (read_bytes, read_if_exists):
        with pytest.raises(SourceError, match=words):
            read(path)


def test_a_file_that_is_too_large_is_refused_with_the_limit(tmp_path: Path) -> None:
    path = tmp_path / "sparse"
    with path.open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(SourceError, match=f"too large: found more than {MAX_BYTES} bytes"):
        read_bytes(path)
    assert read_start(path, 5) == bytes(5)
    with pytest.raises(SourceError, match="too large: found more than 5000 bytes"):
        read_bytes(Path("/dev/zero"), 5000, pipes=True)


def test_settings_that_are_a_link_to_a_device_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pyproject.toml").symlink_to("/dev/zero")
    assert "pyproject.toml: not a regular file: found a character device" in refused("check ur5")


def test_a_manifest_or_a_cached_file_that_is_a_device_and_an_mjcf_file_that_is_a_pipe_are_ignored(
    tmp_path: Path,
) -> None:
    (tmp_path / "package.xml").symlink_to("/dev/zero")
    assert find_package("arm", tmp_path / "arm.urdf", {}) is None
    (tmp_path / "kernel").symlink_to("/dev/zero")
    with pytest.warns(UserWarning, match="is damaged and is computed again: a character device"):
        assert read_cached_file(tmp_path / "kernel") is None
    os.mkfifo(tmp_path / "arm.xml")
    assert not mjcf.is_mjcf(tmp_path / "arm.xml")


def test_files_of_a_store_that_are_links_to_a_device_are_not_read(tmp_path: Path) -> None:
    validate("planar_two_link", samples=10, store=tmp_path)
    messages: list[str] = []
    (tmp_path / "accuracy.json").symlink_to("/dev/zero")
    assert AccuracyStore.from_store(Store.open_read_only(tmp_path, messages.append)) is None
    assert "no accuracy results" in messages[0]
    (chunk,) = tmp_path.glob("chunks/*/*.chunk")
    chunk.unlink()
    chunk.symlink_to("/dev/zero")
    assert Store.open_read_only(tmp_path, messages.append).read_answer(0, 0) is None
    assert "computed again" in messages[-1]
    words = "is damaged and is computed again: not a regular file: a character device"
    with pytest.warns(StoreWarning, match=words):
        assert validate("planar_two_link", samples=10, store=tmp_path).passed
    assert not chunk.is_symlink()
    (tmp_path / "manifest.json").unlink()
    (tmp_path / "manifest.json").symlink_to("/dev/zero")
    with pytest.raises(SourceError, match="not a regular file"):
        Store.open_read_only(tmp_path, messages.append)


@pytest.mark.parametrize(
    ("link", "words"),
    [
        ("lock", "the store's lock is not a regular file: found a link; delete the lock"),
        (".writing", "a symbolic link replaces a folder of the store"),
    ],
)
def test_the_target_of_a_link_that_replaces_a_lock_or_folder_of_a_store_is_not_changed(
    link: str, words: str, tmp_path: Path
) -> None:
    mine, store = tmp_path / "mine", tmp_path / "store"
    for folder in (mine / "all", store):
        folder.mkdir(parents=True)
    (mine / "all" / "file").write_text("precious")
    (store / link).symlink_to(mine / "all" / "file" if link == "lock" else mine)
    with pytest.raises(SourceError, match=words):
        validate("planar_two_link", samples=10, store=store)
    assert (mine / "all" / "file").read_text() == "precious"


def test_arrays_that_unpack_to_more_than_the_limit_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("urdfkin.robot.trajectory.MAX_DATA_BYTES", 2 * 10**7)
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (2**29, 1)})
    with (
        zipfile.ZipFile(tmp_path / "t.npz", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("q.npy", "w", force_zip64=True) as file,
    ):
        file.write(head.getvalue())
        for _ in range(21):
            file.write(bytes(10**6))
    assert (tmp_path / "t.npz").stat().st_size < 2e5
    words = r"not an \.npz file of numbers: found arrays of 21000\d+ bytes, more than 20000000"
    with pytest.raises(SourceError, match=words):
        read_arrays(tmp_path / "t.npz", {"q": (1,)}, ["q"])


# -- xacro ----------------------------------------------------------------------------------------------

XACRO = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:arg name="length" default="1"/>
<xacro:if value="false"><xacro:include filename="part.xacro"/></xacro:if>
<link name="$(arg length)"/></robot>"""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["a link to a device", "a pipe", "a large file"])
def test_only_the_confined_process_reads_included_files_and_an_unreadable_one_allows_any_argument(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = tmp_path / "arm.xacro"
    arm.write_text(XACRO)
    odd_file(kind, tmp_path / "part.xacro")

    def refuse(*_: object, **__: object) -> bytes:
        raise AssertionError("read by the caller's process")

    monkeypatch.setattr(xacro, "read_bytes", refuse)
    robot = urdfkin.load(arm, xacro_args={"length": "a", "unknown": "1"}, verify=False)
    assert robot.link_names == ("a",)


@pytest.mark.parametrize("word", ["a", "a=1", ":=1"])
def test_a_xacro_argument_without_a_name_and_a_value_is_refused(word: str, tmp_path: Path) -> None:
    (tmp_path / "arm.xacro").write_text(XACRO)
    assert "NAME:=VALUE" in refused("info", str(tmp_path / "arm.xacro"), "--xacro-arg", word)


# -- git ------------------------------------------------------------------------------------------------


def test_an_older_version_that_is_too_large_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    git("init", "-q", "-b", "main")
    arm = tmp_path / put("arm.urdf", "<robot/>" + " " * 1000)
    commit()
    version = merge_base_files("main", tmp_path)
    assert version.read_file(arm) is not None
    monkeypatch.setattr("urdfkin.system.git.MAX_BYTES", 1000)
    with pytest.raises(SourceError, match=r"arm\.urdf: too large in the older version: found 1008 bytes"):
        version.read_file(arm)


# -- folders and meshes ---------------------------------------------------------------------------------


def test_check_of_a_folder_refuses_pipes_and_devices_and_checks_all_other_files(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.urdf")
    (tmp_path / "b.urdf").symlink_to("/dev/zero")
    (tmp_path / "c.urdf").write_text('<robot name="r"><link name="a"/></robot>')
    begin = time.monotonic()
    done = command("check", str(tmp_path))
    assert time.monotonic() - begin < files.PIPE_TIMEOUT
    assert done.code == 2
    assert "a.urdf: not a regular file: found a pipe" in done.err
    assert "b.urdf: not a regular file: found a character device" in done.err
    assert "no errors" in done.text or "1 file" in done.text


OBJ = "mtllib {}\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.mark.parametrize("name", ["device.mtl", "pipe.mtl", "../outside.mtl", "leading_out.mtl"])
def test_files_that_a_mesh_names_are_read_only_if_they_are_regular_files_in_its_folder(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("trimesh")
    folder = tmp_path / "mesh"
    folder.mkdir()
    (tmp_path / "outside.mtl").write_text("newmtl m\nKd 1 0 0\n")
    (folder / "device.mtl").symlink_to("/dev/zero")
    (folder / "leading_out.mtl").symlink_to(tmp_path / "outside.mtl")
    os.mkfifo(folder / "pipe.mtl")
    (folder / "own.mtl").write_text("newmtl m\nKd 1 0 0\n")
    read: list[str] = []

    def read_and_note(path: Path, most: int) -> bytes:
        read.append(path.name)
        return files.read_bytes(path, most)

    monkeypatch.setattr(scene, "read_bytes", read_and_note)
    for mesh, material in (("a.obj", name), ("own.obj", "own.mtl")):
        (folder / mesh).write_text(OBJ.format(material))
        visual = f'<visual><geometry><mesh filename="{mesh}"/></geometry></visual>'
        (folder / "r.urdf").write_text(f'<robot name="r"><link name="l">{visual}</link></robot>')
        (shape,) = shapes(urdfkin.load(folder / "r.urdf", verify=False))
        assert scene.make_mesh(shape) is not None
    assert read == ["a.obj", "own.obj", "own.mtl"]
