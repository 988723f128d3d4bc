"""An IMU measures acceleration minus gravity, and angular velocity: by laws, and by MuJoCo."""

import re
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests import urdfs
from tests.laws.subjects import NAMES, robot_of, state
from tests.urdfs import joint, limit
from urdfkin.compiled import evaluate
from urdfkin.errors import InputError
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.configuration import draw_base_motion
from urdfkin.model.tree import FloatArray
from urdfkin.verify.oracle import free_flyer_q

G = np.array([0.3, -0.2, -9.81])
#: Oblique axes, with a prismatic joint between revolute joints.
SHAKEN = urdfs.robot(
    joint("a", "continuous", "base", "arm", 'xyz="0.1 0.2 0.3" rpy="0.3 -0.4 0.5"', "0.6 0 0.8"),
    joint("b", "prismatic", "arm", "slide", 'xyz="0.3 0 -0.1" rpy="1 0.2 0"', "0 1 0", limit(-9, 9)),
    joint("c", "continuous", "slide", "head", 'xyz="0 0.2 0.1" rpy="0 0.7 0.1"', "0 0.28 0.96"),
)
_INERTIA = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
#: The robot above with masses, which MuJoCo requires.
WITH_MASSES = re.sub(r'<link name="(\w+)"/>', rf'<link name="\1">{_INERTIA}</link>', SHAKEN)


def moving_base(n: int, seed: int) -> BaseMotion:
    return draw_base_motion(n, np.random.default_rng(seed))


@pytest.mark.parametrize("base", [None, moving_base(7, 1)])
@pytest.mark.parametrize("name", NAMES)
def test_an_imu_measures_acceleration_minus_gravity_and_angular_velocity_in_its_axes(
    name: str, base: BaseMotion | None
) -> None:
    robot = robot_of(name)
    q, v, a = state(robot, 7, 2)
    frames = robot.link_frames[-2:]
    found = robot.imu(q, v, a, frames, gravity=G, base=base)
    R = robot.placement(q, frames, base=base)[..., :3, :3]
    acc = robot.acceleration(q, v, a, frames, base=base)[..., :3]
    w = robot.velocity(q, v, frames, base=base)[..., 3:]
    in_world = np.concatenate([(R @ x[..., None])[..., 0] for x in (found[..., :3], found[..., 3:])], axis=-1)
    expected = np.concatenate((acc - G, w), axis=-1)
    assert np.abs(in_world - expected).max() < 2000.0 * EPS * max(1.0, np.abs(expected).max())


def test_an_imu_measures_gravity_at_rest_and_zero_in_free_fall() -> None:
    robot = urdfkin.load("panda")
    q, still = robot.sample(5), np.zeros(robot.nv)
    at_rest = robot.imu(q, still, still, "panda_hand")
    up = robot.placement(q, "panda_hand")[:, 2, :3]
    np.testing.assert_allclose(at_rest, np.concatenate((9.81 * up, np.zeros((5, 3))), axis=1), atol=1e-14)
    falling = BaseMotion(acceleration=np.array([0.0, 0.0, -9.81, 0.0, 0.0, 0.0]))
    assert np.abs(robot.imu(q, still, still, "panda_hand", base=falling)).max() < 1e-14
    assert np.abs(robot.imu(q, still, still, "panda_hand", gravity=[0, 0, 0])).max() == 0.0


@pytest.mark.parametrize("mistake", ["sign", "spatial"])
def test_an_imu_with_reversed_gravity_or_spatial_acceleration_is_found(
    mistake: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, original = urdfkin.load("ur5"), evaluate.imus
    x = robot.sample(3)
    robot.imu(x, x, x, "tool0")

    def wrong(plan: Any, q: FloatArray, v: FloatArray, a: FloatArray, **how: Any) -> FloatArray:
        if mistake == "sign":
            how["gravity"] = -np.asarray(how["gravity"])
        found = original(plan, q, v, a, **how)
        if mistake == "spatial":
            local = robot.velocity(q, v, "tool0", "local", verify=False)
            found[:, 0, :3] -= np.cross(local[:, 3:], local[:, :3])
        return found

    monkeypatch.setattr(evaluate, "imus", wrong)
    with pytest.raises(urdfkin.VerificationError, match="the imu of tool0") as caught:
        robot.imu(x, x, x, "tool0")
    monkeypatch.undo()
    line = caught.value.reproduce.splitlines()[-1]
    assert "gravity=[0.0, 0.0, -9.81]" in line
    assert np.abs(eval(line[line.index("urdfkin.load") :], {"urdfkin": urdfkin})).max() > 0.0


def test_gravity_is_one_vector_of_finite_numbers() -> None:
    robot = urdfkin.load("ur5")
    x = robot.sample(2)
    for gravity in (9.81, [0, 0], np.zeros((2, 3)), [0, 0, np.nan], "down"):
        with pytest.raises(InputError, match="gravity"):
            robot.imu(x, x, x, "tool0", gravity=gravity)
    out = np.empty((2, 6))
    assert robot.imu(x, x, x, "tool0", out=out, threads=2) is out


@pytest.mark.parametrize("afloat", [False, True])
def test_the_sensors_of_mujoco_measure_the_same(afloat: bool) -> None:
    mujoco = pytest.importorskip("mujoco")
    spec = mujoco.MjSpec.from_string(WITH_MASSES)
    spec.option.gravity = G
    if afloat:
        spec.body("base").add_freejoint()
    spec.body("head").add_site(name="imu")
    for name, kind in (("accelerometer", "ACCELEROMETER"), ("gyroscope", "GYRO")):
        sensor = getattr(mujoco.mjtSensor, f"mjSENS_{kind}")
        spec.add_sensor(name=name, type=sensor, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="imu")
    model = spec.compile()
    data, base = mujoco.MjData(model), moving_base(20, 8)
    q, v, a = np.random.default_rng(9).standard_normal((3, 20, 3))
    ours = urdfkin.load(SHAKEN).imu(q, v, a, "head", gravity=G, base=base if afloat else None)
    for k in range(20):
        data.qpos[-3:], data.qvel[-3:], data.qacc[-3:] = q[k], v[k], a[k]
        if afloat:  # linear in the world's axes, angular in the body's, the quaternion's scalar first
            R = base.placement[k, :3, :3]
            data.qpos[:3] = base.placement[k, :3, 3]
            data.qpos[3:7] = np.roll(free_flyer_q(base)[k, 3:], 1)
            for rates, six in ((data.qvel, base.velocity[k]), (data.qacc, base.acceleration[k])):
                rates[:3], rates[3:6] = six[:3], R.T @ six[3:]
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(ours[k], data.sensordata, rtol=0, atol=1e-12 * np.abs(ours[k]).max())
