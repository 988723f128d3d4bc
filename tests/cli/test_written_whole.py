"""A file is written whole or not at all, and nothing is left beside it."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path
from typing import Any

import pytest

from urdfkin.cli.output import check_writable, write_file
from urdfkin.errors import SourceError


def test_a_file_that_is_written_is_alone_in_its_folder_with_the_rights_it_had(tmp_path: Path) -> None:
    place = tmp_path / "out.json"
    write_file(place, b"first")
    assert place.stat().st_mode & 0o777 == 0o666 & ~_umask()
    place.chmod(0o640)
    write_file(place, b"second")
    assert [path.name for path in tmp_path.iterdir()] == ["out.json"]
    assert (place.read_bytes(), place.stat().st_mode & 0o777) == (b"second", 0o640)


@pytest.mark.parametrize("where", ["chmod", "replace"])
def test_what_cannot_be_finished_leaves_the_file_as_it_was_and_nothing_beside_it(
    where: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "out.json"
    place.write_bytes(b"before")

    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, where, full)
    with pytest.raises(SourceError, match="No space left"):
        write_file(place, b"after")
    assert [path.name for path in tmp_path.iterdir()] == ["out.json"]
    assert place.read_bytes() == b"before"


def test_asking_whether_a_file_can_be_written_leaves_nothing(tmp_path: Path) -> None:
    check_writable(tmp_path / "out.json", None)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(SourceError, match="cannot be written"):
        check_writable(tmp_path / "no such folder" / "out.json")


def test_a_link_is_followed_and_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    link = tmp_path / "link.json"
    link.symlink_to(tmp_path / "there" / "out.json")
    write_file(link, b"data")
    assert link.is_symlink()
    assert [path.name for path in (tmp_path / "there").iterdir()] == ["out.json"]


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def test_a_disc_that_is_full_while_writing_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = tempfile.NamedTemporaryFile

    def made(*words: Any, **how: Any) -> Any:
        stream = right(*words, **how)

        def write(_: bytes) -> int:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        stream.write = write  # type: ignore[assignment]
        return stream

    monkeypatch.setattr(tempfile, "NamedTemporaryFile", made)
    with pytest.raises(SourceError, match="No space left"):
        write_file(tmp_path / "out.json", b"data")
    assert list(tmp_path.iterdir()) == []
