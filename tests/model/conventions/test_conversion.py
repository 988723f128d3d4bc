"""Conversions of q, v, a and Jacobians between conventions: laws, user files, errors, maps of `same`."""

import inspect
import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests import urdfs
from tests.cli.running import good
from tests.comparison.pairs import disguised, files_of, loaded
from tests.comparison.pairs import robot as pair
from tests.model.conventions.libraries import LIBRARIES
from tests.model.test_named_coordinates import Columns
from tests.reading import present
from tests.urdfs import built, joint, limit, mimic
from urdfkin.comparison.result import Sameness
from urdfkin.errors import InputError, RangeError, UnknownNameError
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.conventions import (
    BUILT_IN_NAMES,
    Convention,
    Conversion,
    as_toml,
    find_convention,
    find_reordering,
)
from urdfkin.model.conventions import convention as module
from urdfkin.model.conventions.convention import JointRule, parse_convention, spell_name
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.robot.convention_robot import ConventionRobot
from urdfkin.urdf.catalogue import catalogue
from urdfkin.verify.bounds import compute_magnitudes
from urdfkin.verify.quantities import JACOBIAN, PLACEMENT, Quantity

FLOATING = tuple(name for name in BUILT_IN_NAMES if name != "idyntree")
#: Every combination of axes, orders and points, also those that no tool has.
_FIELDS: dict[Any, tuple[str, str]] = {
    "linear": ("body", "parent"), "angular": ("body", "parent"), "base_v": ("linear first", "angular first"),
    "point": ("origin", "centre of mass"), "quaternion": ("xyzw", "wxyz"),
}  # fmt: skip
ODD = [
    replace(Convention(name=f"odd {k}", six_vectors=how[2]), **dict[Any, Any](zip(_FIELDS, how, strict=True)))
    for k, how in enumerate(itertools.product(*_FIELDS.values()))
]
PLANAR = urdfs.robot(
    joint("plane", "planar", "world", "cart", 'xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"'),
    joint("turn", "continuous", "cart", "arm", 'xyz="0.5 0 0"', "0 1 0"),
)


@pytest.fixture(scope="module")
def dog() -> Robot:
    return urdfkin.load("a1", root_joint="floating", verify=False)


@pytest.fixture(scope="module")
def arm() -> Robot:
    return urdfkin.load("planar_two_link", verify=False)


@pytest.fixture(scope="module")
def cart() -> Robot:
    return urdfkin.load(PLANAR, verify=False)


@pytest.fixture(params=[*map(find_convention, FLOATING), *ODD], ids=lambda how: how.name)
def convention(request: pytest.FixtureRequest) -> Convention:
    how: Convention = request.param
    return how


def _values(robot: Robot, n: int = 4) -> tuple[FloatArray, FloatArray, FloatArray]:
    rng = np.random.default_rng(1)
    return robot.sample(n, 1), rng.standard_normal((n, robot.nv)), rng.standard_normal((n, robot.nv))


def test_every_listed_convention_has_data_and_evidence() -> None:
    assert tuple(module._load_built_in()) == BUILT_IN_NAMES
    for name in BUILT_IN_NAMES:
        found = find_convention(name)
        assert found.note or name == "urdfkin"
        assert found.evidence == "measured" or (found.evidence == "sources" and found.sources)
    own = {"urdfkin", "urdf", "alphabetical"}  # nothing to run: the file itself, and Python's sort
    measured = {name for name in BUILT_IN_NAMES if find_convention(name).evidence == "measured"}
    assert measured == own | set(LIBRARIES)
    assert {name for name in BUILT_IN_NAMES if find_convention(name).measurement} == set(LIBRARIES)


def test_conversion_from_a_convention_is_the_inverse_of_conversion_to_the_convention(
    dog: Robot, cart: Robot, convention: Convention
) -> None:
    for robot in (dog, cart):
        conversion = robot.convention(convention)
        ours = _values(robot)
        back = conversion.from_(*conversion.to(*ours))
        for name, x, y in zip("qva", ours, back, strict=True):
            if name == "q" and convention.continuous == 2:  # an angle comes back in [-pi, pi]
                x, y = np.cos(x), np.cos(y)  # noqa: PLW2901
            assert np.allclose(x, y, 0, 1e-13), name


def test_converted_accelerations_are_derivatives_of_converted_velocities(
    dog: Robot, cart: Robot, convention: Convention
) -> None:
    h = 1e-4
    for robot in (dog, cart):
        conversion = robot.convention(convention)
        q, v, a = (x[0] for x in _values(robot))
        at = [conversion.to(robot.integrate(q, v * t + a * t * t / 2), v + a * t)[1] for t in (-h, h)]
        expected = (at[1] - at[0]) / (2 * h)
        assert np.abs(conversion.to(q, v, a)[2] - expected).max() < 1e-5


def test_a_robot_in_a_convention_satisfies_the_kinematic_identities(
    dog: Robot, cart: Robot, convention: Convention
) -> None:
    for robot, frame in ((dog, "FL_foot"), (cart, "arm")):
        other = robot.with_convention(convention)
        ours = _values(robot)
        q, v, a = other.conversion.to(*ours)
        J = other.jacobian(q, frame)
        assert np.allclose(other.velocity(q, v, frame), (J @ v[..., None])[..., 0], 0, 1e-12)
        rate = other.jacobian_rate(q, v, frame)
        expected = (J @ a[..., None] + rate @ v[..., None])[..., 0]
        assert np.allclose(other.acceleration(q, v, a, frame), expected, 0, 1e-11)
        H = other.hessian(q, frame)
        assert np.allclose(np.einsum("nrij,nj->nri", H, v), rate, 0, 1e-11)
        assert np.allclose(other.placement(q, frame), robot.placement(ours[0], frame), 0, 1e-13)


def test_a_matrix_depends_on_q_only_if_the_axes_of_a_free_joints_velocity_differ(
    cart: Robot, convention: Convention
) -> None:
    dog = urdfkin.load("go2", root_joint="floating", verify=False)  # the base has its mass beside the origin
    for robot, differ in (
        (dog, "parent" in (convention.linear, convention.angular)),
        (cart, convention.planar == "parent"),
    ):
        conversion = robot.convention(convention)
        q, v, _ = _values(robot)
        assert conversion.is_constant == (not differ)
        if differ:
            with pytest.raises(InputError, match="depends on q"):
                conversion.matrix()
            continue
        M, inverse = conversion.matrix(), conversion.inverse_matrix()
        assert not conversion.matrix_rate(q, v).any()
        assert np.allclose(v @ M.T, conversion.to(q, v)[1], 0, 1e-15)
        assert np.allclose(conversion.to(q, v)[1] @ inverse.T, v, 0, 1e-15)
        assert np.array_equal(conversion.matrix(q[0]), M)


def test_several_frames_at_once_equal_single_frames(dog: Robot) -> None:
    other = dog.with_convention("drake")
    q, v, _ = other.conversion.to(*_values(dog))
    frames = ["FL_foot", "trunk"]
    for method, inputs in ((other.jacobian, (q,)), (other.jacobian_rate, (q, v)), (other.hessian, (q,))):
        together = method(*inputs, frames)
        for k, frame in enumerate(frames):
            assert np.array_equal(together[:, k], method(*inputs, frame))


def test_each_argument_of_a_robot_in_a_convention_may_lack_batch_axes_of_the_others(dog: Robot) -> None:
    robot, frames = dog.with_convention("mujoco"), ["FL_foot", "RR_foot"]
    q, v, _ = robot.conversion.to(*_values(dog, 2))
    found = robot.jacobian_rate(q[0], v, frames)
    for k, i in itertools.product(range(2), range(2)):
        assert np.allclose(found[k, i], robot.jacobian_rate(q[0], v[k], frames[i]), 0, 1e-13)
    base = urdfkin.BaseMotion(velocity=np.arange(24.0).reshape(2, 2, 6))
    for found in (robot.jacobian(q, "FL_foot", base=base), robot.jacobian(q[None], "FL_foot", base=base)):
        assert np.allclose(found, robot.jacobian(q, "FL_foot"), 0, 1e-13)
    H = robot.hessian(q, "FL_foot")
    assert np.allclose(robot.hessian(q, "FL_foot", base=base), H, 0, 1e-13)


def test_a_robot_in_a_convention_reads_and_refuses_arguments_as_the_robot_does(dog: Robot) -> None:
    robot = dog.with_convention("mujoco")
    q, v = robot.sample(3), np.zeros((2, robot.nv))
    table = Columns(q[:, ::-1], robot.coordinate_names[::-1])
    for mapping in (table, MappingProxyType(dict(zip(robot.coordinate_names, q.T, strict=True)))):
        assert np.array_equal(robot.placement(mapping, "FL_foot"), robot.placement(q, "FL_foot"))
        assert np.array_equal(robot.conversion.from_(mapping), robot.conversion.from_(q))
    for call in (
        lambda: robot.velocity(q, v, "FL_foot"),
        lambda: robot.conversion.from_(q, v),
        lambda: robot.conversion.to(dog.sample(3), v),
        lambda: robot.conversion.matrix_rate(dog.sample(3), v),
    ):
        with pytest.raises(InputError, match=r"do not broadcast: found \(3,\), \(2,\)"):
            call()
    with pytest.raises(InputError, match="v must be real numbers: found None"):
        robot.velocity(q, None, "FL_foot")  # type: ignore[arg-type]


def test_an_output_array_does_not_change_the_result(dog: Robot) -> None:
    other = dog.with_convention("drake")
    q, v, _ = other.conversion.to(*_values(dog))
    for method, inputs in ((other.jacobian, (q,)), (other.jacobian_rate, (q, v)), (other.hessian, (q,))):
        expected = method(*inputs, "trunk")
        out = np.empty((*expected.shape[:-1], dog.nv))
        assert np.array_equal(method(*inputs, "trunk", out=out), expected)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("quaternion", "WXYZ"), ("continuous", "2"), ("continuous", True), ("base_v", None),
        ("angle", "degrees"),
        ("six_vectors", "Angular first"), ("order", 1), ("joints", "abc"), ("rules", {"FL_hip_joint": 3}),
    ],
)  # fmt: skip
def test_a_convention_refuses_an_unknown_value(key: str, value: Any) -> None:
    # Some of these values were once ignored.
    with pytest.raises(InputError, match=f"convention mujoco: `{key}` must"):
        replace(find_convention("mujoco"), **{key: value})


@pytest.mark.parametrize(
    "rule", [{"sign": 0.0}, {"sign": 2}, {"zero": math.nan}, {"unit": "furlong"}, {"unit": 0}]
)
def test_a_joint_rule_refuses_an_unknown_value(rule: dict[str, Any]) -> None:
    with pytest.raises((InputError, UnknownNameError), match=next(iter(rule))):
        JointRule(**rule)


def test_equal_conventions_make_no_copy() -> None:
    ur5 = urdfkin.load("ur5", verify=False)
    q = ur5.sample(10)
    conversion = ur5.convention("mujoco")
    assert conversion.to(q) is q
    assert conversion.to(q, q)[1] is q
    assert present(conversion.permutation).tolist() == list(range(6))


@pytest.mark.parametrize("name", ["kinova", "panda", "tiago"])
def test_the_convention_pinocchio_converts_as_to_pinocchio(name: str) -> None:
    robot = urdfkin.load(name, root_joint="floating", verify=False)
    q = robot.sample(5)
    assert np.allclose(robot.convention("pinocchio").to(q), robot.to_pinocchio(q), 0, 1e-15)


def test_a_users_file_defines_order_names_signs_units_and_motor_zeros(arm: Robot, tmp_path: Path) -> None:
    file = tmp_path / "motors.toml"
    file.write_text(
        'joints = ["2", "joint_1"]\nangle = "deg"\n'
        '[joint.joint_1]\nzero = 10\n[joint.joint_2]\nname = "2"\nsign = -1\nzero = 2048\nunit = 4096\n'
    )
    motors = arm.convention(file)
    assert motors.joint_names == ("2", "joint_1")
    assert np.allclose(motors.to([np.pi / 2, np.pi / 4]), [2048 - 512, 100])
    assert np.allclose(motors.from_([2048 - 512, 100]), [np.pi / 2, np.pi / 4])
    q, v = motors.to([0.1, 0.2], [1.0, 2.0])
    assert np.allclose(v, [-2 * 4096 / (2 * np.pi), 180 / np.pi])
    other = arm.with_convention(file)
    assert np.allclose(other.velocity(q, v, "tip"), arm.velocity([0.1, 0.2], [1.0, 2.0], "tip"))
    assert np.allclose(other.jacobian(q, "tip") @ v, arm.velocity([0.1, 0.2], [1.0, 2.0], "tip"))


TWICE = "two joints have the same name in the convention: found"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('joints = ["joint_1"]', "the order of joints lacks a joint: found joint_2"),
        ('joints = ["joint_1", "joint_1"]', f"{TWICE} 'joint_1'"),
        ('[joint.joint_1]\nname = "m"\n[joint.joint_2]\nname = "m"', f"{TWICE} 'm'"),
        ('[joint.joint_1]\nname = "joint_2"', f"{TWICE} 'joint_2'"),
        ("[joint.joint_1]\nsign = 2", "joint joint_1: `sign` must be 1 or -1: found 2"),
        ("[joint.joint_1]\nunit = 'mm'", "joint joint_1: this `unit` is for a joint with a length"),
        ("[joint.joint_1]\nunit = -1", "`unit` must be a positive number"),
        ("[joint.joint_1]\nunit = 1e-320", "`unit` must be a positive number from 1e-100 to 1e+100"),
        ("[joint.joint_1]\nzero = nan", "`zero` must be a finite number"),
        ('joints = ["joint_1", "end"]', "the order of joints contains a fixed joint: found end"),
        ('quaternion = "wxzy"', "`quaternion` must be one of: xyzw, wxyz: found 'wxzy'"),
        ("joints = 3", "`joints` must be a list of names"),
        ("joint = 3", "`joint` must contain tables"),
        ("=", "the convention file is not valid TOML"),
    ],
)
def test_an_invalid_convention_file_is_an_error_with_the_place(
    arm: Robot, text: str, words: str, tmp_path: Path
) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        arm.convention(file)
    assert words in str(caught.value)
    assert "mine" in str(caught.value)


@pytest.mark.parametrize("name", ["mujoco", "isaaclab"])
@pytest.mark.parametrize("add", [-1, 1])
def test_a_jacobian_or_hessian_of_another_robot_is_refused(name: str, add: int) -> None:
    robot = urdfkin.load("a1", verify=False)
    q, n = robot.neutral(), robot.nv
    conversion, J = robot.convention(name), np.ones((6, n + add))
    for call in (conversion.columns, conversion.jacobian, conversion.from_jacobian):
        with pytest.raises(InputError, match=rf"J must have the shape \(..., rows, {n}\): found"):
            call(q, J)
    with pytest.raises(InputError, match="J must have the shape"):
        conversion.hessian(q, J, np.ones((6, n, n)))
    with pytest.raises(InputError, match="H must have the shape"):
        conversion.hessian(q, np.ones((6, n)), np.ones((6, 1, 1)))


def test_a_six_vector_or_jacobian_with_a_masked_complex_or_text_value_is_refused() -> None:
    robot = urdfkin.load("ur5", verify=False)
    conversion, J = robot.convention("drake"), np.ones((6, 6))
    for wrong in (np.ma.array(J, mask=np.eye(6, dtype=bool)), J + 1j, J.astype(str), np.full((6, 6), None)):
        for call in (conversion.columns, conversion.jacobian, conversion.from_jacobian):
            with pytest.raises(InputError, match="must be real numbers"):
                call(robot.neutral(), wrong)
        with pytest.raises(InputError, match="six-vectors must be real numbers"):
            conversion.reorder_six_vector(wrong)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[joint.elbow]", "elbow"),
        ('joints = ["joint_1", "joint_3"]', "joint_3"),
        ('like = "mujocco"', "mujoco, "),
        ('like = ["mujoco"]', "unknown convention"),
        ("quaternoin = 1", "did you mean quaternion"),
        ("[joint.joint_1]\nsing = 1", "did you mean sign"),
        (None, "did you mean mujoco"),
    ],
)
def test_an_unknown_convention_or_name_in_its_file_is_refused_with_the_nearest_name(
    arm: Robot, text: str | None, words: str, tmp_path: Path
) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text or "")
    with pytest.raises(UnknownNameError) as caught:
        arm.convention(file if text else "mujocco")
    assert words in str(caught.value)


@pytest.mark.parametrize("name", ["drake", "usd"])
def test_a_matrix_with_a_wrong_number_of_columns_is_refused(name: str, arm: Robot) -> None:
    conversion, q, J, H = arm.convention(name), [0.0, 0.0], np.zeros((6, 2)), np.zeros((6, 2, 3))
    calls: tuple[Callable[[], FloatArray], ...] = (
        lambda: conversion.jacobian(q, np.zeros((6, 3))),
        lambda: conversion.columns(q, np.zeros(2)),
        lambda: conversion.from_jacobian(q, np.zeros((6, 1))),
        lambda: conversion.hessian(q, J, H),
    )
    for call in calls:
        with pytest.raises(InputError, match=r"[JH] must have the shape \(..., rows, 2(, 2)?\): found \("):
            call()


@pytest.mark.parametrize("joints", ["joint_1", 3, ["joint_1", 2], ["joint_1", None], {"joint_1", "joint_2"}])
def test_an_order_that_is_no_list_of_names_is_refused(joints: Any, arm: Robot) -> None:
    with pytest.raises(InputError, match=r"joints must (be a (list of names|name)|have an order)"):
        arm.convention("mujoco", joints)


def test_a_quaternion_in_a_convention_has_norm_1_or_the_error_names_the_joint(dog: Robot) -> None:
    mujoco = dog.convention("mujoco")
    q, v, _ = mujoco.to(*_values(dog))
    q[:, 3:7] *= 1.0 + 1e-9
    assert np.allclose(np.linalg.norm(mujoco.from_(q)[:, 3:7], axis=1), 1.0, 0, 1e-15)
    q[1, 3:7] *= 2.0
    for arguments in ((q,), (q, v)):
        with pytest.raises(InputError, match="of joint root_joint must be a unit quaternion: found norm 2"):
            mujoco.from_(*arguments)


@pytest.mark.parametrize("xyz", ["", "1 2", "1,2,3", "nan 0 0"])
def test_an_invalid_centre_of_mass_is_an_error_that_names_the_link(xyz: str) -> None:
    inertial = f'<inertial><origin xyz="{xyz}"/><mass value="1"/></inertial>'
    box = f'<robot name="box"><link name="body">{inertial}</link></robot>'
    robot = urdfs.loaded(box, root_joint="floating", verify=False)
    with pytest.raises(InputError, match="link body: the origin of <inertial> must be three finite numbers"):
        robot.convention("newton")


def test_the_order_of_joints_may_have_the_names_in_the_convention() -> None:
    arm = built(joint("1", "continuous", "l0", "l1"), joint("a-b", "continuous", "l1", "l2"), verify=False)
    for name, joints in (
        ("usd", ["tn__ab_h3", "tn__1_"]),
        ("isaaclab", ["a_b", "a_1"]),
        ("usd", ["a-b", "1"]),
    ):
        conversion = arm.convention(name, joints)
        assert (conversion.joint_names == tuple(joints)) == ("1" not in joints)
        assert conversion.to([0.0, 0.0], [1.0, 2.0])[1].argmax() == 0


def test_a_convention_without_a_known_joint_order_needs_an_explicit_order(arm: Robot) -> None:
    with pytest.raises(InputError, match="no known order of joints"):
        arm.convention("idyntree")
    assert arm.convention("idyntree", ["joint_2", "joint_1"]).to([1.0, 2.0]).tolist() == [2.0, 1.0]


def test_the_value_of_a_mimic_joint_in_a_convention_must_satisfy_the_mimic_rule() -> None:
    panda = urdfkin.load("panda", verify=False)
    mujoco = panda.convention("mujoco")
    q = mujoco.to("ready")
    assert (mujoco.nq, panda.nq) == (9, 8)
    assert q[7] == q[8]
    q[8] += 0.01
    with pytest.raises(InputError, match="contradicts its mimic rule"):
        mujoco.from_(q)
    with pytest.raises(InputError, match="mimic=False"):
        panda.with_convention("mujoco").jacobian(mujoco.to("ready"))
    free = urdfkin.load("panda", verify=False, mimic=False).with_convention("mujoco")
    assert free.jacobian(q).shape == (6, 9)


@pytest.mark.parametrize("symbol", ["v", "a"])
def test_the_velocity_or_acceleration_of_a_mimic_joint_must_satisfy_the_mimic_rule(
    symbol: str, tmp_path: Path
) -> None:
    arm = arm_with(rule_of_b=mimic("a", 2, 0.1))
    (tmp_path / "degrees.toml").write_text('angle = "deg"\n')
    for name in ("mujoco", "pinocchio", str(tmp_path / "degrees.toml")):
        convention = arm.convention(name)
        q, *rates = convention.to([0.3], [1e9], [-3.0])
        np.testing.assert_allclose(np.ravel(convention.from_(q, *rates)), [0.3, 1e9, -3.0], 1e-15)
        rates["va".index(symbol)][1] *= 1.0 + 1e-8
        with pytest.raises(InputError, match=rf"{symbol}, b: the value of a mimic joint contradicts"):
            convention.from_(q, *rates)


@pytest.mark.parametrize("kind", ["revolute", "continuous", "prismatic"])
@pytest.mark.parametrize("multiplier", [1.0, -0.5, 1.5, 3.0])
def test_cosines_and_sines_keep_the_turns_that_move_a_mimic_joint(kind: str, multiplier: float) -> None:
    wheel = joint("wheel", "continuous", "l0", "l1", "", "0 0 1")
    other = joint(
        "other", kind, "l1", "l2", 'xyz="1 0 0"', "0 1 0", limit(-100, 100) + mimic("wheel", multiplier, 0.2)
    )
    robot = built(wheel, other, verify=False)
    q = np.array([[0.5], [4.0], [-20.0], [2.0]])
    turned = replace(find_convention("pinocchio"), rules={"wheel": JointRule(sign=-1.0, zero=0.3)})
    for convention in (robot.convention("pinocchio"), robot.convention(turned)):
        back = convention.from_(convention.to(q))
        assert np.allclose(robot.placement(back, "l2"), robot.placement(q, "l2"), 0, 1e-13)
    alone = robot.convention("pinocchio", ["other"])
    if kind == "continuous" and multiplier in (1.5, 3.0):
        assert np.allclose(alone.from_(alone.to([0.5])), [0.5], 0, 1e-15)
        with pytest.raises(InputError, match="lose whole turns, which move joint wheel"):
            alone.to(q)
        return
    back = alone.from_(alone.to(q))
    assert np.allclose(robot.placement(back, "l2"), robot.placement(q, "l2"), 0, 1e-13)


@pytest.mark.parametrize("multiplier", [1 / 50, -3 / 50, 0.01, 0.501])
def test_a_pinocchio_configuration_shows_the_turns_of_a_geared_motor(multiplier: float) -> None:
    motor = joint("motor", "continuous", "l0", "l1", "", "0 0 1")
    gear = joint("gear", "continuous", "l1", "l2", 'xyz="1 0 0"', "0 1 0", mimic("motor", multiplier, 0.1))
    robot = built(motor, gear, verify=False)
    pinocchio = robot.convention("pinocchio")
    for turns in range(-24, 25):
        q = np.array([0.3 + math.tau * turns])
        for back in (robot.from_pinocchio(robot.to_pinocchio(q)), pinocchio.from_(pinocchio.to(q))):
            assert np.allclose(back, q, 0, 1e-12)


NAMES = ("1", "12a", "a-b", "joint.1", "a b", "é", "-", "_x", "", "a/b-c", "ok_2", "漢😀-é.", "root_joint.x")
#: What OpenUSD Exchange 3.0.1 and OpenUSD 26.8 return for these names; the libraries are asked below.
IN_USD = (
    "tn__1_", "tn__12a_", "tn__ab_h3", "tn__joint1_m9", "tn__ab_Z2", "tn__l6", "tn__j0", "_x", "tn__",
    "tn__abc_w4B", "ok_2", None, "tn__root_jointx_ZH",
)  # fmt: skip
IDENTIFIERS = (
    "_", "_2a", "a_b", "joint_1", "a_b", "__", "_", "_x", "_", "a_b_c", "ok_2", None, "root_joint_x",
)  # fmt: skip


@pytest.mark.parametrize(("name", "in_usd", "plain"), list(zip(NAMES, IN_USD, IDENTIFIERS, strict=True)))
def test_a_joint_name_is_converted_to_a_valid_usd_name(
    name: str, in_usd: str | None, plain: str | None
) -> None:
    assert spell_name(name, "usd") == in_usd or in_usd is None
    assert spell_name(name, "identifier") == plain or plain is None
    assert all(spell_name(name, how).isidentifier() for how in ("usd", "identifier", "isaacsim"))
    assert not spell_name(name, "isaacsim").startswith("_")


def test_a_name_with_a_leading_digit_has_the_prefix_of_isaac_sim_4() -> None:
    assert spell_name("00_fr_abad", "isaacsim") == "a_00_fr_abad"  # github.com/isaac-sim/IsaacLab/issues/2496


def test_converted_usd_names_are_those_of_the_usd_libraries() -> None:
    exchange, tf = pytest.importorskip("usdex.core"), pytest.importorskip("pxr.Tf")
    rng = np.random.default_rng(0)
    letters = list("abzAZ019_-./ :éß漢😀#")
    drawn = ["".join(rng.choice(letters, rng.integers(0, 12))) for _ in range(2000)]
    for name in (*NAMES, *drawn):
        assert spell_name(name, "usd") == exchange.getValidPrimName(name)
        assert spell_name(name, "identifier") == tf.MakeValidIdentifier(name)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ["newton", "newton-usd", "usd"])
def test_a_library_converts_unusual_names_as_the_convention_states(name: str, tmp_path: Path) -> None:
    text = PLANAR.replace('type="planar"', 'type="continuous"').replace("plane", "1")
    text = text.replace('"turn"', '"a-b"').replace('"world"', '"ground"')
    robot = urdfkin.load(text, verify=False)
    library = LIBRARIES[name](robot, tmp_path)
    assert list(robot.convention(name).joint_names) == library.names


# What `same` finds between two models is a convention: joint order, names, senses and zeros of the other.


ALIGNED = Reference.LOCAL_WORLD_ALIGNED
FEW = ["ur5", "panda", "a1", "tiago", "kinova", "talos_reduced", "so101", "double_pendulum"]


def _room(robot: Robot, q: FloatArray, links: list[str], quantity: Quantity) -> FloatArray:
    """Return the bound of the rounding errors of a quantity at q (nq,): (links, ...)."""
    plan = robot.plan([robot.tree.link_index(link) for link in links])
    bound = quantity.bound(plan, compute_magnitudes(plan, q[None], None, None, FIXED_BASE_STATE), ALIGNED)
    return np.asarray((EPS * bound.k * bound.scale)[0])


def _excess(found: Sameness, a: Robot, b: Robot, conversion: Conversion) -> float:
    """Return the largest difference of placements and Jacobians of A and B as a fraction of its bound.

    The bound is the distance and the angle that `same` counts as rounding, plus the rounding errors of both
    computations. B's placement is that of four products.
    """
    metres, radians = found.rounding
    tools = {(tool.a, tool.b): tool.pose for tool in found.tools}
    pairs = [pair for pair in found.links if pair not in tools] or list(found.links)
    ours, theirs = ([pair[k] for pair in pairs] for k in (0, 1))
    worst = 0.0
    for q_a in a.sample(3, 5):
        q_b = conversion.to(q_a)
        base = f"link:{found.base_links[1]}"
        X = found.base @ b.placement(b.neutral(), base) @ np.linalg.inv(b.placement(q_b, base))
        T_a = a.placement(q_a, [f"link:{x}" for x in ours])
        T_b = b.placement(q_b, [f"link:{x}" for x in theirs])
        for k, two in enumerate(pairs):
            T_a[k] = T_a[k] @ tools.get(two, np.eye(4))
        room = _room(a, q_a, ours, PLACEMENT) + 4.0 * _room(b, q_b, theirs, PLACEMENT)
        room[:, :3, :3] += radians
        room[:, :3, 3] += metres + EPS * np.abs(X[:3, 3]).max() * 16.0
        worst = max(worst, float((np.abs(T_a - X @ T_b)[:, :3] / room[:, :3]).max()))
        if len(tools) == len(found.links):
            continue  # each frame is another one, so that its Jacobian is
        J_a = a.jacobian(q_a, [f"link:{x}" for x in ours])
        J_b = b.jacobian(q_b, [f"link:{x}" for x in theirs])
        turned = np.kron(np.eye(2), X[:3, :3]) @ conversion.from_jacobian(q_a, J_b)
        room = _room(a, q_a, ours, JACOBIAN) + radians
        room += 4.0 * np.abs(conversion.from_jacobian(q_a, _room(b, q_b, theirs, JACOBIAN))).max()
        room[:, :3] += metres + radians * np.abs(T_a[:, :3, 3]).max()
        worst = max(worst, float((np.abs(J_a - turned) / room).max()))
    return worst


def _found(name: str, seed: int) -> tuple[Sameness, Robot, Robot]:
    a = pair(name)
    b = loaded(disguised(a.tree, seed))
    return urdfkin.same(a, b, bounds=False), a, b


@pytest.mark.filterwarnings("ignore::urdfkin.DegreesWarning")  # a zero moves values beyond the limits
@pytest.mark.parametrize(
    ("name", "seed"),
    [
        *itertools.product(FEW, (0, 1)),
        *(pytest.param(name, 2, marks=pytest.mark.long) for name in sorted(set(catalogue()) - set(FEW))),
    ],
)
def test_a_map_converts_to_a_model_with_different_names_signs_zeros_and_order(
    name: str, seed: int, tmp_path: Path
) -> None:
    if not pair(name).tree.nq:
        return
    found, a, b = _found(name, seed)
    file = tmp_path / "found.toml"
    file.write_text(as_toml(found.convention()))
    conversion = a.convention(file)
    q = a.sample(4)
    assert np.array_equal(conversion.to(q), found.to_b(q))
    assert np.allclose(conversion.from_(conversion.to(q)), q, 0, 1e-14)
    assert _excess(found, a, b, conversion) <= 1.0


def _wrong(right: Convention, mistake: str) -> Convention:
    rules, joints = dict(right.rules), list(right.joints)
    turned = next(x for x, rule in rules.items() if rule.sign < 0)
    moved = next(x for x, rule in rules.items() if rule.zero)
    match mistake:
        case "sign":
            rules[turned] = replace(rules[turned], sign=1.0)
        case "zero":
            rules[moved] = replace(rules[moved], zero=rules[moved].zero + 1e-6)
        case "order":
            joints[0], joints[1] = joints[1], joints[0]
    return replace(right, rules=rules, joints=tuple(joints))


@pytest.mark.parametrize("mistake", ["sign", "zero", "order"])
@pytest.mark.parametrize("name", ["ur5", "a1", "tiago"])
def test_a_mistake_in_a_map_is_detected(name: str, mistake: str) -> None:
    found, a, b = _found(name, 0)
    assert _excess(found, a, b, a.convention(_wrong(found.convention(), mistake))) > 100.0


def arm_with(rule_of_a: str = "", rule_of_b: str = "") -> Robot:
    a = joint("a", "revolute", "l0", "l1", more=limit() + rule_of_a)
    b = joint("b", "revolute", "l1", "l2", 'xyz="1 0 0"', "0 1 0", limit() + rule_of_b)
    return built(a, b, verify=False)


def test_a_mimicked_joint_of_one_model_may_be_a_mimic_joint_of_the_other() -> None:
    a, b = arm_with(rule_of_b=mimic("a", 2, 0.1)), arm_with(mimic("b", 0.5, -0.05))
    found = urdfkin.same(a, b, bounds=False)
    conversion = a.convention(found.convention())
    assert conversion.joint_names == ("b",)
    assert conversion.to([0.3]).tolist() == [0.7]
    assert np.allclose(conversion.from_([0.7]), [0.3], 0, 1e-15)
    J = a.with_convention(found.convention()).jacobian([0.7], "l2")
    assert np.allclose(J, b.jacobian([0.7], "l2"), 0, 1e-15)


def test_a_reordering_from_a_mimic_joint_uses_the_mimic_rule(tmp_path: Path) -> None:
    arm = arm_with(rule_of_b=mimic("a", 2, 0.1))
    (tmp_path / "mimic.toml").write_text('joints = ["b"]\nangle = "deg"\n')
    start, end = arm.convention(str(tmp_path / "mimic.toml")), arm.convention("mujoco")
    for one, other in ((start, start), (start, end), (end, start)):
        found = find_reordering("q", one, other)
        assert found is not None
        q = one.to([0.3])[list(found.index)] * found.factor + found.zero
        assert np.allclose(q, other.to([0.3]), 0, 1e-13)


def test_the_code_of_a_reordering_omits_the_last_mimic_joint() -> None:
    arm = arm_with(rule_of_b=mimic("a", 2, 0.1))
    start, end = arm.convention("mujoco"), arm.convention("urdfkin")
    for symbol in "qv":
        found = find_reordering(symbol, start, end)
        assert found is not None
        assert found.code("y", "x") == "y = x[..., [0]]"


def test_no_reordering_converts_the_cosine_of_a_joint_to_the_angle_of_its_mimic_joint(tmp_path: Path) -> None:
    a = joint("a", "continuous", "l0", "l1", "", "0 0 1")
    b = joint("b", "revolute", "l1", "l2", "", "0 1 0", limit() + mimic("a"))
    arm = built(a, b, verify=False)
    (tmp_path / "short.toml").write_text('like = "pinocchio"\njoints = ["a"]\n')
    start, end = arm.convention(str(tmp_path / "short.toml")), arm.convention("pinocchio")
    assert find_reordering("q", start, end) is None


def test_the_cosine_and_sine_of_a_joint_do_not_depend_on_the_unit_of_angles(tmp_path: Path) -> None:
    arm = built(joint("a", "continuous", "l0", "l1", "", "0 0 1"), verify=False)
    file = tmp_path / "degrees.toml"
    file.write_text('like = "pinocchio"\nangle = "deg"\n[joint.a]\nsign = -1\nzero = 90\n')
    program = arm.convention(file)
    q, v = program.to([0.5], [1.0])
    assert np.allclose(q, [np.cos(np.pi / 2 - 0.5), np.sin(np.pi / 2 - 0.5)], 0, 1e-15)
    assert np.allclose(v, [-180 / np.pi], 0, 1e-13)
    assert np.allclose(program.from_(q), [0.5], 0, 1e-15)


@pytest.mark.parametrize(
    ("root_joint", "symbol", "name"),
    [
        ("floating", "v", "root_joint.wz"),
        ("planar", "v", "root_joint.wz"),
        ("planar", "q", "root_joint.angle"),
    ],
)
def test_an_angle_of_a_free_joint_in_degrees_has_no_other_unit(
    root_joint: Any, symbol: str, name: str
) -> None:
    program = urdfkin.load("planar_two_link", root_joint=root_joint, verify=False).convention("usd")
    layout = program.layout(symbol)
    assert layout.parse(f"neutral, {name}=90")[layout.names.index(name)] == 90.0
    with pytest.raises(InputError, match="wrong unit: found '90deg'; use no unit"):
        layout.parse(f"neutral, {name}=90deg")


def test_the_error_of_a_mimic_value_has_the_unit_of_the_convention(tmp_path: Path) -> None:
    arm = arm_with(rule_of_b=mimic("a", 2))
    (tmp_path / "degrees.toml").write_text('angle = "deg"\n')
    with pytest.raises(InputError, match="found a difference of 10, in the unit of this value"):
        arm.convention(str(tmp_path / "degrees.toml")).from_([10.0, 30.0])


def test_a_coordinate_of_only_one_model_is_an_error_that_names_the_joint() -> None:
    a, b = arm_with(), arm_with()
    shorter = urdfkin.load(b.urdf.replace('name="b" type="revolute"', 'name="b" type="fixed"'), verify=False)
    with pytest.raises(InputError, match=r"a joint of B has no matching joint in A.*found b"):
        urdfkin.same(shorter, b, bounds=False).convention()
    with pytest.raises(InputError, match=r"the order of joints lacks a joint.*found b"):
        urdfkin.same(a, shorter, bounds=False).convention()
    rigid = built(joint("j", "fixed", "base", "tip"), verify=False)
    with pytest.raises(InputError, match=r"B has no coordinates.*: found 0 coordinates; compare with"):
        urdfkin.same(rigid, rigid, bounds=False).convention()


def test_no_convention_converts_an_angle_to_a_length() -> None:
    a = arm_with()
    sliding = urdfkin.load(
        a.urdf.replace('name="b" type="revolute"', 'name="b" type="prismatic"'), verify=False
    )
    with pytest.raises(InputError, match=r"a joint of B has no matching joint in A.*found b"):
        urdfkin.same(a, sliding, bounds=False).convention()
    assert urdfkin.same(a, sliding, bounds=False).to_b([0.1, 0.2]).tolist() == [0.1, 0.0]


def test_a_floating_joint_with_different_frames_in_two_models_is_an_error() -> None:
    a, b = (built(joint("f", "floating", "l0", "l1", f'xyz="{x} 0 0"', "")) for x in (0, 1))
    with pytest.raises(InputError, match="the frames of a planar or floating joint in A and B differ"):
        urdfkin.same(a, b, bounds=False).convention()


def test_the_command_writes_a_map_that_other_commands_read(tmp_path: Path) -> None:
    a, b = pair("ur5"), loaded(disguised(pair("ur5").tree, 3))
    one, other = files_of(tmp_path, a.urdf, b.urdf)
    found = str(tmp_path / "map.toml")
    good("same", one, other, "--boxes", "0", "--write-map", found)
    q, frame = a.sample(1)[0], a.link_names[-1]
    text = ",".join(map(repr, urdfkin.same(a, b, bounds=False).to_b(q).tolist()))
    done = good("placement", one, "--convention", found, "--frame", frame, "--q", text, "--format", "json")
    assert np.allclose(done.data["result"][0], a.placement(q, frame), 0, 1e-14)
    order = good("order", one, "--to", found).text
    assert "q_to = q_from[..., [" in order or "np.array" in order


@pytest.mark.parametrize("name", FLOATING)
def test_a_convention_that_is_written_as_toml_is_read_back(name: str) -> None:
    how = find_convention(name)
    rules = {
        'a "b" \\ \x7f é': JointRule("1 é\n", -1.0, -0.1 + 0.2, "deg"),
        "c": JointRule(None, 1.0, 1e-300, 4096.0),
        "d": JointRule("m", unit="mm"),
    }
    how = replace(how, rules=rules, evidence="", measurement="", sources=())
    assert parse_convention(as_toml(how), "text", how.name) == how
    given = replace(how, order="given", joints=("m", "c"))
    assert parse_convention(as_toml(given), "text", how.name) == given


def test_a_unit_of_a_numpy_type_is_written_as_a_toml_number() -> None:
    how = Convention(name="x", rules={"j": JointRule(unit=np.float64(360.0))})
    read = parse_convention(as_toml(how), "text", "x")
    assert read.rules == how.rules


def test_the_methods_of_a_robot_in_a_convention_have_the_argument_names_of_the_robot() -> None:
    shared = [
        name for name in vars(ConventionRobot) if name[0] != "_" and inspect.isfunction(vars(Robot).get(name))
    ]
    assert {"placement", "relative_placement", "velocity", "acceleration"} <= set(shared)
    for name in shared:
        theirs = inspect.signature(getattr(ConventionRobot, name)).parameters.values()
        named = [one.name for one in theirs if one.kind is one.POSITIONAL_OR_KEYWORD]
        ours = list(inspect.signature(getattr(Robot, name)).parameters)
        assert named == ours[: len(named)], name


def test_a_converted_number_outside_the_range_of_doubles_is_an_error() -> None:
    robot = urdfkin.load("a1", root_joint="floating", verify=False)
    q, v = robot.neutral(), np.full(robot.nv, 1e200)
    for name in ("mujoco", "newton", "isaaclab", "drake"):
        conversion = robot.convention(name)
        with pytest.raises(RangeError, match="a result leaves the range of double precision"):
            conversion.to(q, v, v)
        with pytest.raises(RangeError, match="a result leaves the range of double precision"):
            conversion.from_(conversion.to(q), v, v)
    slides = urdfs.built(
        joint("s", "prismatic", "a", "b", more=limit()),
        joint("t", "prismatic", "b", "c", more=limit() + mimic("s", 2)),
    )
    for to in (slides.to_pinocchio, slides.convention("mujoco").to):
        with pytest.raises(RangeError, match="a result leaves the range of double precision"):
            to([1.7e308])
