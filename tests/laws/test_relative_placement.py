"""A placement in another frame: how such placements compose, and how they are held."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import urdfkin
from urdfkin import VerificationError
from urdfkin.kinematics import bodies
from urdfkin.model.tree import FloatArray

#: Frames of one branch and of two, up the tree, down and across; a base that moves by itself, a follower.
TRIPLES = {
    "panda": (
        ("panda_link4", "panda_hand", "panda_leftfinger"),
        ("panda_rightfinger", "panda_link2", "panda_link0"),
    ),
    "talos": (("left_sole_link", "gripper_right_base_link", "torso_1_link"),),
}


@pytest.mark.parametrize(
    ("name", "frames", "root_joint"),
    [(name, frames, joint) for name in TRIPLES for frames in TRIPLES[name] for joint in (None, "floating")],
)
def test_neighbours_cancel_and_the_way_back_is_the_inverse(
    name: str, frames: tuple[str, str, str], root_joint: str | None
) -> None:
    robot = urdfkin.load(name, root_joint=root_joint)
    q = robot.sample(5, seed=1)
    a, b, c = frames
    T_a_b, T_b_c, T_a_c, T_b_a = (
        robot.relative_placement(q, frame, relative_to=other)
        for other, frame in ((a, b), (b, c), (a, c), (b, a))
    )
    np.testing.assert_allclose(T_a_b @ T_b_c, T_a_c, atol=1e-14)
    np.testing.assert_allclose(T_a_b @ T_b_a, np.broadcast_to(np.eye(4), T_a_b.shape), atol=1e-14)
    T_world = robot.placement(q, a)
    np.testing.assert_allclose(T_world @ T_a_b, robot.placement(q, b), atol=1e-14)
    assert robot.certificate().verified


def test_it_is_the_chains_placement() -> None:
    robot = urdfkin.load("panda")
    q = robot.sample(6, seed=2)
    path = robot.chain("panda_leftfinger", "panda_link3")
    T = robot.relative_placement(q, "panda_leftfinger", "panda_link3")
    np.testing.assert_allclose(T, path.placement(robot.select(path, q)), atol=1e-14)


def test_several_frames_batches_and_a_given_array_are_as_in_placement() -> None:
    robot = urdfkin.load("ur5")
    q = robot.sample(6, seed=3).reshape(2, 3, 6)
    out = np.empty((2, 3, 2, 4, 4))
    both = robot.relative_placement(q, ["tool0", "base_link"], "wrist_1_link", out=out)
    assert both is out
    for f, frame in enumerate(("tool0", "base_link")):
        np.testing.assert_array_equal(both[:, :, f], robot.relative_placement(q, frame, "wrist_1_link"))
    line = robot.certificate().lines[0]
    assert (line.quantity, line.checked) == ("relative placement", 24)  # no result for the frame looked from


@pytest.mark.parametrize("slip", [1e-12, "transposed", "in the world's axes"])
def test_a_slip_in_it_is_a_disagreement_with_a_line_that_shows_it(
    slip: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    face: Any = bodies
    right = face.seen_from

    def wrong(T_a: FloatArray, T_b: FloatArray, out: FloatArray | None) -> FloatArray:
        T: FloatArray = right(T_a, T_b, out)
        if slip == "transposed":
            T[..., :3, :3] = T[..., :3, :3].swapaxes(-1, -2).copy()
        elif isinstance(slip, float):
            T[..., 0, 3] += slip
        else:
            T[..., :3, 3] = T_b[..., :3, 3] - T_a[..., :3, 3]
        return T

    robot = urdfkin.load("ur5")
    q = robot.sample(1, seed=4)[0]
    monkeypatch.setattr(face, "seen_from", wrong)
    with pytest.raises(VerificationError, match="relative placement of tool0") as caught:
        robot.relative_placement(q, "tool0", "forearm_link")
    monkeypatch.undo()
    again = caught.value.reproduce
    assert again.startswith("urdfkin.load('ur5').relative_placement(")
    np.testing.assert_array_equal(eval(again), robot.relative_placement(q, "tool0", "forearm_link"))
