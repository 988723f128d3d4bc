"""The class of an arm is reported with its deviation, and the centre of a spherical wrist does not move."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.cli.running import good, urdfkin
from tests.dh.arms import arm
from tests.random_chains import rotation, shift
from urdfkin.dh import table_from_rows, to_tree
from urdfkin.dh.screws import screws_of
from urdfkin.dh.structure import Structure, structure
from urdfkin.model.chain import chain
from urdfkin.model.tree import KinematicTree
from urdfkin.robot.loading import load
from urdfkin.verify.oracle import QueryBatch

H = math.pi / 2
PUMA: list[list[float]] = [
    [0, H, 0, 0], [0.4318, 0, 0, 0], [0.0203, -H, 0.15005, 0], [0, H, 0.4318, 0], [0, -H, 0, 0],
    [0, 0, 0, 0],
]  # fmt: skip


def of_tree(tree: KinematicTree) -> Structure:
    return structure(screws_of(chain(tree, "tip")))


def of_rows(rows: list[list[object]] | list[list[float]]) -> Structure:
    return of_tree(to_tree(table_from_rows(rows, "standard")))


def test_a_puma_has_a_spherical_wrist_and_can_be_solved_by_opw() -> None:
    found = of_rows(PUMA)
    assert [(kind.name, kind.is_exact) for kind in found.kinds] == [("spherical wrist", True)]
    assert found.freedoms == 6
    assert found.solvers[0].startswith("OPW")
    links = 0.4318 + math.hypot(0.0203, 0.15005) + 0.4318
    assert found.reached <= found.reach == pytest.approx(links, abs=0.02)


@pytest.mark.parametrize("offset", [1e-4, 3e-3])
def test_an_inexact_spherical_wrist_is_reported_with_the_distance(offset: float) -> None:
    rows = [[*row] for row in PUMA]
    rows[4][0] = offset  # distance of the last axis from the other two axes
    kind = of_rows(rows).kinds[0]
    assert kind.name == "spherical wrist"
    assert not kind.is_exact
    assert offset / 3 <= kind.metres <= offset
    rows[4][0] = 0.08
    assert of_rows(rows).kinds == ()


@pytest.mark.parametrize("tilt", [0.0, 0.0066])
def test_three_parallel_axes_are_reported_with_the_tilt(tilt: float) -> None:
    rows: list[list[float]] = [
        [0, H, 0.18, 0], [-0.61, tilt, 0, 0], [-0.57, 0, 0, 0], [0, H, 0.17, 0], [0, -H, 0.12, 0],
        [0, 0, 0.1, 0],
    ]  # fmt: skip
    found = of_rows(rows)
    assert found.kinds[0].name == "three parallel axes"
    assert found.kinds[0].radians == pytest.approx(tilt, abs=1e-12)
    assert found.kinds[0].is_exact == (tilt == 0.0)
    solvers = "EAIK, ik-geo's three_parallel_two_intersecting"
    assert found.solvers == (f"Pieper, three axes are parallel, two meet: {solvers}",)


def test_a_scara_and_a_gantry_are_recognised() -> None:
    scara = of_rows([[0.3, 0, 0.2, 0, "R"], [0.25, math.pi, 0, 0, "R"], [0, 0, 0, 0, "P"], [0, 0, 0, 0, "R"]])
    assert (scara.joints, scara.freedoms, scara.kinds[0].name) == ("RRPR", 4, "SCARA")
    square = rotation("x", H)
    gantry = of_tree(arm(np.eye(4), square, rotation("y", H), kinds="PPP", tip=shift(0, 0, 0.1)))
    assert (gantry.joints, gantry.freedoms, gantry.kinds[0].name) == ("PPP", 3, "gantry")


@pytest.mark.parametrize("name", ["kinova", "talos", "panda"])
def test_the_centre_of_a_spherical_joint_does_not_move_according_to_pinocchio(name: str) -> None:
    robot = load(name)
    screws = robot.screws()
    found = structure(screws)
    assert len(found.joints) - found.freedoms == (1 if name != "kinova" else 0)
    kind = next(kind for kind in found.kinds if kind.name.startswith("spherical"))
    assert kind.at is not None
    # The three joints do not move the point of the last link at their common centre.
    beyond = robot.tree.links[robot.tree.joint_index(kind.joints[-1]) + 1]
    q = np.zeros((20, robot.nq))
    columns = [robot.tree.q_index[robot.tree.joint_index(joint)] for joint in kind.joints]
    q[1:, columns] = np.random.default_rng(0).uniform(-1, 1, (19, 3))
    both = robot.verifier.oracle().placements(QueryBatch([screws.base_frame, beyond], (q,)))
    T = np.linalg.inv(both[:, 0]) @ both[:, 1]
    local = np.linalg.solve(T[0], [*kind.at, 1.0])
    centres = (T @ local)[:, :3]
    np.testing.assert_allclose(centres, np.broadcast_to(centres[0], (20, 3)), atol=1e-12)


def test_the_command_prints_the_structure_and_the_check() -> None:
    result = good("structure ur5 --tip tool0")
    assert "three parallel axes: shoulder_lift_joint, elbow_joint, wrist_1_joint, exactly" in result.text
    assert "agrees within rounding" in result.text
    data = good("structure panda --format json").data
    assert data["freedoms"] == 6
    assert data["joints"] == "RRRRRRR"
    assert urdfkin("structure ur5 --no-verify").code == 3
