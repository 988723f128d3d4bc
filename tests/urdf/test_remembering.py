"""A tree read back from disk is the tree that was read from the URDF."""

from pathlib import Path

import numpy as np
import pytest

from tests.reading import records, tree_of
from urdfkin.model.tree import KinematicTree
from urdfkin.system.keeping import CacheWarning
from urdfkin.urdf import remembering
from urdfkin.urdf.remembering import remembered_tree
from urdfkin.urdf.sources import read_source


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "trees"
    folder.mkdir()
    monkeypatch.setattr(remembering, "_folder", lambda: folder)
    return folder


def text(name: str) -> bytes:
    return read_source(name).data


def same(one: KinematicTree, other: KinematicTree) -> bool:
    """Equal names, kinds and numbers, to the last bit."""
    plain = [(j.name, j.kind, j.parent, j.limit, j.mimic) for j in one.joints]
    return (
        (one.name, one.links) == (other.name, other.links)
        and plain == [(j.name, j.kind, j.parent, j.limit, j.mimic) for j in other.joints]
        and all(
            np.array_equal(a.T_parent_joint, b.T_parent_joint) and np.array_equal(a.axis, b.axis)
            for a, b in zip(one.joints, other.joints, strict=True)
        )
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda", "talos", "icub", "ur5"])
def test_the_second_reading_needs_no_parser_and_gives_the_same_tree(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = text(name)
    first = remembered_tree(records(data))
    monkeypatch.setattr(remembering, "read_tree", None)
    second = remembered_tree(records(data))
    assert same(first, second)
    assert same(second, tree_of(data))
    with pytest.raises(ValueError, match="read-only"):
        second.joints[0].axis[0] = 2.0


def test_another_text_or_another_way_to_read_it_is_another_tree(folder: Path) -> None:
    data = text("panda")
    trees = [
        remembered_tree(records(data)),
        remembered_tree(records(data), mimic=False),
        remembered_tree(records(data), root_joint="floating"),
        remembered_tree(records(data.replace(b"0.333", b"0.334"))),
    ]
    assert len(list(folder.iterdir())) == len(trees)
    assert [tree.nq for tree in trees] == [8, 9, 15, 8]
    assert not same(trees[0], trees[3])


@pytest.mark.parametrize("damage", [b"", b"nothing of the kind", b"\x80\x04N."])
def test_a_damaged_file_is_read_anew_and_mended(folder: Path, damage: bytes) -> None:
    data = text("ur5")
    expected = remembered_tree(records(data))
    (kept,) = folder.iterdir()
    kept.write_bytes(damage)
    with pytest.warns(CacheWarning, match="is damaged and is made anew"):
        assert same(remembered_tree(records(data)), expected)
    assert kept.read_bytes() != damage


def test_where_nothing_can_be_written_the_tree_is_read_each_time(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.rmdir()
    with pytest.warns(CacheWarning, match="nothing can be kept"):
        assert same(remembered_tree(records(text("ur5"))), tree_of(text("ur5")))
    monkeypatch.setattr(remembering, "_folder", lambda: None)
    assert same(remembered_tree(records(text("ur5"))), tree_of(text("ur5")))


def test_it_is_the_robots_of_the_catalogue_that_are_remembered(folder: Path) -> None:
    from urdfkin import load  # noqa: PLC0415

    load("ur5")
    assert len(list(folder.iterdir())) == 1
    load(text("panda").decode())
    assert len(list(folder.iterdir())) == 1
