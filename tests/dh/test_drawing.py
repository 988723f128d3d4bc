"""A drawing shows every frame and every joint, and equal tables give equal files."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from tests.dh.arms import CONVENTIONS, arm
from tests.random_chains import rotation, shift
from urdfkin.dh import dh_table
from urdfkin.errors import InputError
from urdfkin.view.dh_drawing import drawing, row_corners

pytest.importorskip("matplotlib")
LINK = shift(0.3, 0.1, 0.2) @ rotation("x", 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_a_drawing_is_an_svg_with_every_frame_and_joint(convention: str) -> None:
    text = drawing(dh_table(arm(LINK, LINK, LINK, kinds="RPR", tip=LINK), "tip", convention=convention))
    root = ET.fromstring(text)
    assert root.tag.endswith("svg")
    written = "".join("".join(node.itertext()) for node in root.iter() if node.tag.endswith("text"))
    for name in ("j1", "j2", "j3", "tip", f"{convention} Denavit-Hartenberg frames"):
        assert name in written
    assert written.count("x") >= 4
    assert written.count("z") >= 4


@pytest.mark.slow
def test_equal_tables_give_equal_drawings() -> None:
    table = dh_table(arm(LINK, LINK), "tip")
    assert drawing(table) == drawing(table)
    assert drawing(table) != drawing(table, [0.5, 0.5])


def test_a_chain_without_motion_can_be_drawn_and_a_batch_cannot() -> None:
    assert "<svg" in drawing(dh_table(arm(tip=LINK), "tip"))
    with pytest.raises(InputError, match="needs exactly one configuration"):
        drawing(dh_table(arm(LINK), "tip"), np.zeros((2, 1)))


@pytest.mark.parametrize(("convention", "beta"), [("standard", 0.0), ("standard", 0.3), ("modified", 0.0)])
def test_the_two_lines_of_a_row_lie_on_the_joint_axis_and_on_the_common_normal(
    convention: str, beta: float
) -> None:
    table = dh_table(arm(LINK, LINK), "tip", convention=convention)
    table = replace(table, rows=tuple(replace(row, beta=beta) for row in table.rows))
    frames = table.frames([0.5, -0.7])
    corners, standard = row_corners(table, frames), convention == "standard"
    starts, ends = frames[:-1, :3, 3], frames[1:, :3, 3]
    z = (frames[:-1] if standard else frames[1:])[:, :3, 2]
    along, across = (corners - starts, ends - corners) if standard else (ends - corners, corners - starts)
    np.testing.assert_allclose(np.cross(along, z), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(across, axis=1), [abs(row.a) for row in table.rows], atol=1e-12)
