"""J-dot, the breakdown and the manipulator Jacobian are right for a fixed and for a moving base."""

import numpy as np
import pytest

import urdfkin
from tests.odd_tree import pose
from urdfkin.errors import InputError, RepresentationSingularityError, UnknownNameError
from urdfkin.kinematics.rotation import SEQUENCES
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

ROBOTS = ("panda", "ur5", "allegro_left_hand", "polar", "iris_simple")


def moving_base(seed: int) -> urdfkin.BaseMotion:
    generator = np.random.default_rng(seed)
    return urdfkin.BaseMotion(pose(generator), generator.normal(size=6), generator.normal(size=6))


@pytest.mark.slow
@pytest.mark.parametrize("base", [None, moving_base(1)], ids=["still", "moving"])
@pytest.mark.parametrize("name", ROBOTS)
def test_all_results_agree_with_pinocchio_even_on_a_moving_base(
    name: str, base: urdfkin.BaseMotion | None
) -> None:
    robot = urdfkin.load(name)
    q = robot.sample(4, 2)
    v, a = np.random.default_rng(3).normal(size=(2, 4, robot.nv))
    robot.placement(q, robot.link_frames, base=base)
    for reference in Reference:
        robot.velocity(q, v, robot.link_frames, reference, base=base)
        robot.jacobian(q, robot.link_frames, reference, base=base)
        robot.acceleration(q, v, a, robot.link_frames, reference, base=base)
        robot.jacobian_rate(q, v, robot.tip_frame, reference, base=base)
        robot.acceleration_breakdown(q, v, a, robot.tip_frame, reference, base=base)
    certificate = robot.certificate()
    assert certificate.verified
    assert {line.quantity for line in certificate.lines} >= {"jacobian rate", "acceleration"}


def test_an_error_of_the_jacobian_rate_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    from urdfkin.compiled import evaluate

    original = evaluate.jacobian_rates
    monkeypatch.setattr(evaluate, "jacobian_rates", lambda *x, **y: original(*x, **y) * (1.0 + 1e-10))
    robot = urdfkin.load("panda")
    with pytest.raises(
        urdfkin.VerificationError, match=r"jacobian rate of panda_hand.*urdfkin jacobian-rate panda"
    ):
        robot.jacobian_rate(robot.sample(1, 6)[0], np.ones(robot.nv), "panda_hand")


@pytest.mark.slow
@pytest.mark.parametrize("representation", [*SEQUENCES, "quaternion"])
def test_the_manipulator_jacobian_predicts_the_change_of_the_pose(representation: str) -> None:
    from urdfkin.kinematics.bodies import orientation_of

    robot = urdfkin.load("ur5")
    q, v, step = robot.sample(1, 7)[0], np.random.default_rng(8).normal(size=6), 1e-4

    def pose_at(t: float) -> FloatArray:
        T = robot.placement(q + t * v, "tool0")
        return np.concatenate((T[:3, 3], orientation_of(representation, T[:3, :3])))

    slope = (8 * (pose_at(step) - pose_at(-step)) - (pose_at(2 * step) - pose_at(-2 * step))) / (12 * step)
    rates = robot.analytical_jacobian(q, "tool0", representation) @ v
    assert np.abs(rates - slope).max() <= 1e-9 * max(1.0, float(np.abs(rates).max()) ** 3)


def test_the_error_about_a_singularity_names_the_sample() -> None:
    robot = urdfkin.load("elbow")
    q = np.full((3, 6), 0.5)
    q[1] = 0.0
    with pytest.raises(RepresentationSingularityError, match=r"sample \[1\]"):
        robot.analytical_jacobian(q, "wrist", "ZYZ")


def test_unknown_frames_and_wrong_lengths_are_refused() -> None:
    robot = urdfkin.load("polar")
    with pytest.raises(UnknownNameError, match="did you mean slider"):
        robot.placement([0.0, 0.5], ["arm", "slidr"])
    with pytest.raises(InputError, match="v needs 2 numbers"):
        robot.jacobian_rate([0.0, 0.5], [1.0], "slider")
