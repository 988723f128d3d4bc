"""What is kept between runs has a folder of its own for each state of its sources, and old ones go."""

import os
import time
from pathlib import Path

import pytest

from urdfkin.system.cache import CacheWarning, kept_folder


def test_a_folder_is_the_same_until_its_sources_or_anything_beside_them_change(tmp_path: Path) -> None:
    source = tmp_path / "source.py"
    source.write_text("a")
    first = kept_folder("things", [source], "1.0", root=tmp_path)
    assert first == kept_folder("things", [source], "1.0", root=tmp_path)
    others = [
        kept_folder("things", [source], "1.1", root=tmp_path),
        kept_folder("trees", [source], root=tmp_path),
    ]
    source.write_text("b")
    others.append(kept_folder("things", [source], "1.0", root=tmp_path))
    assert len({first, *others}) == 4
    assert all(folder is not None and folder.is_dir() for folder in (first, *others))


def test_what_nobody_used_for_a_month_is_deleted_and_nothing_else(tmp_path: Path) -> None:
    def made(kind: str, state: str) -> Path:
        folder = kept_folder(kind, [], state, root=tmp_path)
        assert folder is not None
        return folder

    old, recent, other = made("kernels", "old"), made("kernels", "recent"), made("trees", "old")
    foreign = tmp_path / "kernels-of-somebody-else"
    foreign.mkdir()
    (old / "kernel.nbc").write_bytes(b"compiled")
    for folder, days in ((old, 30.1), (recent, 29.9), (other, 30.1)):
        then = time.time() - days * 24 * 3600
        os.utime(folder / ".used", (then, then))
    used = made("kernels", "new")
    assert not old.exists()
    assert set(tmp_path.iterdir()) == {recent, other, foreign, used}
    assert made("trees", "old") == other
    assert other.exists()


def test_a_root_that_cannot_be_written_gives_no_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.warns(CacheWarning, match="the cache cannot be written in .*file: .*set XDG_CACHE_HOME"):
        assert kept_folder("kernels", [], root=tmp_path / "file") is None
