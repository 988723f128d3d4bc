"""An acceleration's parts are as exact far from the world's origin as at it, and checked as themselves."""

import shlex

import numpy as np
import pytest

import urdfkin
from tests.cli.running import urdfkin as command
from urdfkin.compiled import breakdown
from urdfkin.compiled.breakdown import AccelerationBreakdown
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot

REFERENCES = ("local", "world", "local_world_aligned")


def base_at(distance: float, rates: FloatArray) -> BaseMotion:
    T = np.eye(4)
    T[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    T[:3, 3] = distance * np.array([0.5, 4.5, 1e-4])
    return BaseMotion(T, rates[:6], rates[6:])


@pytest.mark.slow
@pytest.mark.parametrize("reference", REFERENCES)
@pytest.mark.parametrize("distance", [0.0, 1e4, 1e5, 1e6, 1e8, 1e12])
def test_on_a_base_at_map_coordinates_it_is_verified_with_as_small_a_share(
    distance: float, reference: str
) -> None:
    robot = urdfkin.load("panda")
    rng = np.random.default_rng(1)
    q, (v, a) = robot.sample(60, 1), rng.normal(size=(2, 60, robot.nv))
    robot.acceleration_breakdown(
        q, v, a, "panda_hand", reference, base=base_at(distance, rng.normal(size=12))
    )
    (line,) = robot.certificate().lines
    assert line.quantity == "acceleration breakdown"
    assert line.checked == 60
    assert line.share < 0.05


@pytest.mark.parametrize("root_joint", ["floating", "planar"])
def test_behind_a_root_joint_that_stands_far_away_it_is_verified(root_joint: str) -> None:
    robot = urdfkin.load("panda", root_joint=root_joint)
    rng = np.random.default_rng(2)
    q, (v, a) = robot.sample(60, 1), rng.normal(size=(2, 60, robot.nv))
    q[:, :2] += [5e5, 4.5e6]
    for reference in REFERENCES:
        robot.acceleration_breakdown(q, v, a, "panda_hand", reference)
    assert robot.certificate().lines[0].share < 0.05


@pytest.mark.parametrize("reference", ["local", "local_world_aligned"])
def test_each_part_is_the_one_it_is_at_the_origin(reference: str) -> None:
    robot = urdfkin.load("panda")
    rng = np.random.default_rng(3)
    q, (v, a), rates = robot.sample(20, 1), rng.normal(size=(2, 20, robot.nv)), rng.normal(size=12)
    here, there = (
        robot.acceleration_breakdown(q, v, a, "panda_hand", reference, base=base_at(distance, rates))
        for distance in (0.0, 1e7)
    )
    scale = np.abs(here.terms).max()
    assert np.abs(here.terms - there.terms).max() < 20 * EPS * scale
    assert np.abs(here.base - there.base).max() < 20 * EPS * np.abs(here.base).max()


def spoiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Transverse parts that are off by a relative 1e-9."""
    right = breakdown._terms

    def wrong(*x: FloatArray) -> FloatArray:
        terms = right(*x)  # type: ignore[arg-type]
        terms[:, 0] *= 1.0 + 1e-9
        return terms

    monkeypatch.setattr(breakdown, "_terms", wrong)


def disagreement(robot: Robot, base: BaseMotion | None) -> urdfkin.VerificationError:
    rng = np.random.default_rng(4)
    q, (v, a) = robot.sample(3, 1), rng.normal(size=(2, 3, robot.nv))
    with pytest.raises(urdfkin.VerificationError, match="acceleration breakdown") as caught:
        robot.acceleration_breakdown(q, v, a, "panda_hand", "local", base=base)
    return caught.value


def test_on_a_moving_base_the_replay_line_computes_the_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    spoiled(monkeypatch)
    base = base_at(1e5, np.arange(12.0))
    line = disagreement(urdfkin.load("panda"), base).reproduce
    assert ".acceleration_breakdown(" in line
    with pytest.raises(urdfkin.VerificationError):
        eval(line)
    monkeypatch.undo()
    assert isinstance(eval(line), AccelerationBreakdown)


def test_without_one_the_replay_line_is_the_command_that_explains(monkeypatch: pytest.MonkeyPatch) -> None:
    spoiled(monkeypatch)
    words = shlex.split(disagreement(urdfkin.load("panda"), None).reproduce)
    assert words[:3] == ["urdfkin", "acceleration", "--breakdown"]
    assert command(*words[1:]).code == 1
    monkeypatch.undo()
    assert command(*words[1:]).code == 0
