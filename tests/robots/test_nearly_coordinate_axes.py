"""Pinocchio replaces an axis within 1e-12 of x, y or z; urdfkin's bounds include this change."""

import itertools
import pickle
import warnings
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import urdfkin
from tests import urdfs
from tests.urdfs import joint, limit, loaded
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.tree import FloatArray, KinematicTree, with_pinocchio_tilts, without_mimic_rules
from urdfkin.robot import Robot
from urdfkin.urdf.lint import Severity, check
from urdfkin.verify.oracle import QueryBatch

KINDS = {"revolute": "R", "continuous": "RUB", "prismatic": "P"}
AXES = np.eye(3)


def text(kind: str, *axes: FloatArray) -> str:
    """Write a chain with these joint axes, with enough digits to read each number exactly."""
    origin, more = 'xyz="0.3 0.2 0.1" rpy="0.1 0.2 0.3"', "" if kind == "continuous" else limit(-3, 3)
    words = (" ".join(map(repr, axis.tolist())) for axis in axes)
    return urdfs.robot(
        *(joint(f"j{i}", kind, f"l{i}", f"l{i + 1}", origin, axis, more) for i, axis in enumerate(words))
    )


def snaps(kind: str, axis: FloatArray) -> bool:
    """Return whether Pinocchio's model has a joint about x, y or z."""
    name = pin.buildModelFromXML(text(kind, axis)).joints[1].shortname().removeprefix("JointModel")
    return name in [KINDS[kind] + letter for letter in "XYZ"]


def found(kind: str, axis: FloatArray) -> bool:
    return "URDF514" in [finding.code for finding in check(text(kind, axis).encode())]


def near(size: float, seed: int) -> FloatArray:
    """Return a unit vector that is tilted from x, y or z by `size` in a random direction."""
    rng = np.random.default_rng(seed)
    axis: FloatArray = AXES[seed % 3].copy()
    off = rng.normal(size=3)
    off[seed % 3] = 0.0
    axis += size * off / np.linalg.norm(off)
    return axis


@pytest.mark.parametrize("kind", KINDS)
def test_a_finding_exists_if_pinocchio_snaps_an_axis_with_a_tilt_above_rounding(kind: str) -> None:
    sizes = [0.0, 5e-324, 1e-200, 6e-17, 0.99 * EPS, 1.01 * EPS, 1e-15, 1e-13, 2e-12, 1e-9]
    sizes += [1e-12 * (1.0 + side * distance) for side in (-1, 1) for distance in (1e-3, 1e-6, 1e-9)]
    for size, seed in itertools.product(sizes, range(3)):
        axis = near(size, seed)
        tilt = np.linalg.norm(np.delete(axis, seed % 3))
        assert snaps(kind, axis) == (tilt <= 1e-12), (axis, tilt)
        assert found(kind, axis) == (snaps(kind, axis) and tilt > EPS), (axis, tilt)


def test_at_the_boundary_of_snapping_the_finding_agrees_with_pinocchio_to_the_last_bit() -> None:
    for seed in range(60):
        axis = near(1e-12, seed)
        axis[seed % 3] += (seed % 5 - 2) * EPS
        assert found("revolute", axis) == snaps("revolute", axis), axis


@pytest.mark.parametrize("kind", KINDS)
def test_the_finding_uses_the_axis_vector_without_normalisation_as_pinocchio_does(kind: str) -> None:
    around_one = [1.0 + side * size for side in (-1, 1) for size in (2e-12, 0.9e-12, 5e-13)]
    for length in (*around_one, 0.5, 2.0):
        straight, tilted = length * AXES[1], length * AXES[1] + [0.0, 0.0, 4e-13]
        assert snaps(kind, straight) == (abs(length - 1.0) < 1e-12)
        assert not found(kind, straight)
        assert found(kind, tilted) == snaps(kind, tilted) == (np.hypot(length - 1.0, 4e-13) < 1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_directions_opposite_to_a_coordinate_axis_are_not_snapped(kind: str) -> None:
    for axis in -AXES:
        tilted = axis + 1e-13 * np.roll(axis, 1)
        assert not snaps(kind, axis)
        assert not snaps(kind, tilted)
        assert not found(kind, tilted)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_urdfkin_uses_the_tilted_axis_of_the_file_and_pinocchio_differs_by_the_tilt(
    kind: str, seed: int
) -> None:
    tilt = 1e-12
    robot = loaded(text(kind, near(0.99 * tilt, seed)))
    ours = robot.placement([2.0], "l1")
    theirs = robot.verifier.oracle().placements(QueryBatch(["l1"], (np.array([[2.0]]),)))[0, 0]
    assert 0.1 * tilt < np.abs(ours - theirs).max() < 2.0 * tilt
    # Pinocchio does not replace an axis of length 2, so Pinocchio and urdfkin agree.
    doubled = loaded(text(kind, 2.0 * near(0.99 * tilt, seed)))
    assert np.abs(doubled.placement([2.0], "l1") - ours).max() < 4.0 * EPS
    assert doubled.certificate().verified


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("tilt", [1e-16, 1e-15, 1e-14, 1e-13, 0.99e-12])
def test_a_robot_with_tilted_axes_is_verified_within_twice_the_tilts(kind: str, tilt: float) -> None:
    # Every joint is tilted and far from zero.
    robot = loaded(text(kind, *(near(tilt, seed) for seed in range(12))))
    q, v = robot.sample(50, 1), robot.sample(50, 2)
    for reference in ("local", "world", "local_world_aligned"):
        robot.placement(q, "l12")
        robot.velocity(q, v, "l12", reference)
        robot.jacobian(q, "l12", reference)
        robot.jacobian_rate(q, v, "l12", reference)
        robot.acceleration(q, v, v, "l12", reference)
    certificate = robot.certificate()
    assert certificate.verified
    assert all(line.bound_ratio < 1.0 for line in certificate.lines)
    if tilt > 1e-15:
        assert max(line.bound_ratio for line in certificate.lines) > 0.01  # the bound is not too large
    if tilt > 1e-13:
        uncorrected = Robot(with_pinocchio_tilts(robot.tree, {}), robot.urdf, origin=robot.origin)
        with pytest.raises(urdfkin.VerificationError):
            uncorrected.placement(q, "l12")


@pytest.mark.parametrize("tilt", [1e-15, 1e-13])
def test_errors_above_the_tilt_bound_and_errors_before_tilted_axes_are_detected(tilt: float) -> None:
    robot = loaded(text("revolute", AXES[2], AXES[0], near(tilt, 2), AXES[1]))
    assert [joint.pinocchio_tilt > 0.0 for joint in robot.tree.joints] == [False, False, True, False]
    q = robot.sample(20, 1)

    def with_an_error(by: float) -> Robot:
        first, *others = robot.tree.joints
        joints = replace(first, axis=first.axis + by * AXES[1]), *others
        return Robot(KinematicTree(robot.name, robot.tree.links, joints), robot.urdf, origin=robot.origin)

    allowed = 2.0 * tilt + 24.0 * 5 * EPS
    with pytest.raises(urdfkin.VerificationError):
        with_an_error(6.0 * allowed).placement(q, "l4")
    with pytest.raises(urdfkin.VerificationError):
        with_an_error(100.0 * 24.0 * EPS).placement(q, "l2")  # Pinocchio's axes on this path are the file's
    with_an_error(0.0).placement(q, robot.link_frames)


def test_the_tilt_of_a_joint_is_stored_and_survives_pickling() -> None:
    robot = loaded(text("revolute", AXES[2], near(1e-13, 1)))
    assert [round(joint.pinocchio_tilt, 16) for joint in robot.tree.joints] == [0.0, 1e-13]
    assert without_mimic_rules(robot.tree).joints[1].pinocchio_tilt > 0.0
    assert (
        pickle.loads(pickle.dumps(robot)).tree.joints[1].pinocchio_tilt == robot.tree.joints[1].pinocchio_tilt
    )


@pytest.mark.parametrize("kind", KINDS)
def test_a_tilted_axis_is_a_note_and_results_are_verified(kind: str) -> None:
    document = text(kind, near(1e-13, 1))
    with warnings.catch_warnings():
        warnings.simplefilter("error", urdfkin.UrdfWarning)
        robot = urdfkin.load(document)
    (finding,) = (finding for finding in robot.findings if finding.code == "URDF514")
    assert finding.severity is Severity.NOTE
    assert finding.pinocchio_reading is None
    robot.jacobian([0.4], "l1")
    assert robot.certificate().verified


def test_bounds_of_tables_and_validation_include_tilted_axes() -> None:
    robot = loaded(text("revolute", *(near(0.99e-12, seed) for seed in (2, 0, 1, 2))))
    robot.dh()
    robot.dh(convention="modified")
    robot.tree_parameters()
    report = urdfkin.validate(robot, samples=20)
    assert report.passed, report.robots[0].reason
    assert report.robots[0].failed == 0


@pytest.mark.parametrize("kind", KINDS)
def test_a_tilt_of_one_eps_in_every_joint_stays_within_the_bound(kind: str) -> None:
    # All tilts have the same direction and all joints are far from zero, so the errors add up.
    robot = loaded(text(kind, *[AXES[2] + [EPS, 0.0, 0.0]] * 30))
    q, v = robot.sample(50, 1), robot.sample(50, 2)
    robot.placement(q, "l30")
    robot.jacobian(q, "l30", "local")
    robot.acceleration(q, v, v, "l30", "world")
    certificate = robot.certificate()
    assert certificate.verified
    assert all(line.bound_ratio < 0.1 for line in certificate.lines)
