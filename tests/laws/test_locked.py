"""A locked robot is the whole robot at the locked values, without the locked columns."""

import copy
import itertools
import math
import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import urdfkin
from tests import urdfs
from tests.laws.subjects import robot_of, state
from tests.reading import present
from tests.strategies import trees
from tests.urdfs import joint, limit, loaded, mimic
from urdfkin.errors import OracleError
from urdfkin.kinematics.rotation import rotation_from_rpy
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, pose
from urdfkin.robot import Robot
from urdfkin.urdf.writer import to_urdf
from urdfkin.verify.bounds import compute_magnitudes
from urdfkin.verify.certificate import VerificationError
from urdfkin.verify.oracles import MUJOCO, PINOCCHIO, OracleLibrary
from urdfkin.verify.quantities import recursive_quantities

#: Robots, and the joints to lock; None: every second joint. There are mimic, prismatic and continuous
#: joints, oblique axes, and planar and floating joints, which are not locked.
LOCKS = {
    "panda": ("panda_finger_joint1", "panda_joint4"),
    "a1": ("FL_hip_joint", "RR_calf_joint"),
    "tree_3": None,
    "tree_8": None,
    "floating_root": None,
    "planar_and_floating_in_the_middle": None,
    "mimic_hand_40_sliding": None,
}


def lockable(robot: Robot) -> list[str]:
    return [joint.name for joint in robot.tree.joints if joint.nq == 1]


def values_at(robot: Robot, q: FloatArray, names: list[str]) -> dict[str, float]:
    tree = robot.tree
    return {name: float(q[tree.q_index[tree.joint_index(name)]]) for name in names}


def held(robot: Robot, name: str) -> float:
    return present(robot.joints[name].lock).value


def kept(robot: Robot, names: list[str]) -> tuple[list[int], list[int]]:
    tree = robot.tree
    free = [(i, j) for i, j in enumerate(tree.joints) if j.nv and j.name not in names]
    q = [tree.q_index[i] + c for i, j in free for c in range(j.nq)]
    return q, [tree.v_index[i] + c for i, j in free for c in range(j.nv)]


def demand_the_columns(robot: Robot, names: list[str], q: FloatArray, rng: np.random.Generator) -> Robot:
    """Compare every quantity of all links with the whole robot's; return the locked robot."""
    locked = robot.with_locked_joints(values_at(robot, q, names))
    of_q, of_v = kept(robot, names)
    v, a = np.zeros((2, 1, robot.nv))
    v[:, of_v], a[:, of_v] = rng.standard_normal((2, 1, len(of_v)))
    whole, part = (q[None], v, a), (q[None, of_q], v[:, of_v], a[:, of_v])
    frames = robot.link_frames
    plan = robot.plan([robot.tree.frame_link(frame) for frame in frames])
    size = compute_magnitudes(plan, *whole, FIXED_BASE_STATE)
    for row in recursive_quantities():
        for reference in row.references:
            inputs = [x[: len(row.inputs)] for x in (whole, part)]
            named = Reference.LOCAL_WORLD_ALIGNED if reference is None else reference
            full = robot.compute(row.name, inputs[0], frames, named)
            ours = locked.compute(row.name, inputs[1], frames, named)
            bound = row.bound(plan, size, reference)
            most = np.broadcast_to(EPS * bound.k * bound.scale, full.shape)
            for axis in range(full.ndim)[3:] if row.has_columns else ():
                full, most = full.take(of_v, axis), most.take(of_v, axis)
            assert ours.shape == full.shape, row.name
            assert (np.abs(ours - full) <= most).all(), (row.name, reference)
    return locked


@pytest.mark.parametrize("name", LOCKS)
def test_results_of_a_locked_robot_are_columns_of_the_complete_robots_results(name: str) -> None:
    robot, rng = robot_of(name), np.random.default_rng(1)
    names = list(LOCKS[name] or lockable(robot)[::2])
    for q in robot.sample(3, seed=2):
        demand_the_columns(robot, names, q, rng)


@pytest.mark.parametrize("name", LOCKS)
@pytest.mark.parametrize("oracle", [PINOCCHIO, MUJOCO])
def test_both_oracles_agree_with_a_locked_robot(name: str, oracle: OracleLibrary) -> None:
    robot = robot_of(name)
    names = list(LOCKS[name] or lockable(robot)[::2])
    locked = robot.with_locked_joints(values_at(robot, robot.sample(1)[0], names))
    locked.verifier.library = oracle
    q, v, a = state(locked, 4, 3)
    for reference in Reference:
        locked.acceleration(q, v, a, locked.link_frames, reference, verify=True)
        locked.jacobian_rate(q, v, locked.link_frames, reference, verify=True)
    assert locked.certificate().verified
    assert all(line.bound_ratio > 0.0 or not locked.nv for line in locked.certificate().lines)


@pytest.mark.parametrize("name", ["panda", "a1"])
def test_a_locked_robot_on_a_moving_base_agrees_with_pinocchio(name: str) -> None:
    locked = robot_of(name).with_locked_joints(joints=lockable(robot_of(name))[:2], lock="ready")
    rates = np.array([[1.0, 0, 0, 0, 0, 2.0], [0, 1.0, 0, 3.0, 0, 0]])
    base = urdfkin.BaseMotion(pose(p=[1.0, 2.0, 3.0]), *rates)
    q, v, a = state(locked, 2, 4)
    locked.acceleration(q, v, a, locked.link_frames, base=base, verify=True)
    assert locked.certificate().verified


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.data())
@pytest.mark.filterwarnings("ignore::urdfkin.NotVerifiedWarning")
def test_any_tree_with_locked_joints_equals_the_complete_tree_at_the_locked_values(
    data: st.DataObject,
) -> None:
    robot = loaded(data.draw(trees(max_joints=6)), verify=False)
    names = [name for name in lockable(robot) if data.draw(st.booleans())]
    q = robot.sample(1, seed=data.draw(st.integers(0, 99)))[0]
    locked = demand_the_columns(robot, names, q, np.random.default_rng(5))
    if robot.verifier.known_refusal is None:
        locked.placement(locked.sample(2), locked.link_frames, verify=True)
        locked.jacobian(locked.sample(2), locked.link_frames, verify=True)


@pytest.mark.parametrize("links", list(itertools.permutations("012")))
@pytest.mark.parametrize("multiplier", [None, 0.0, 2.0])
@pytest.mark.parametrize("lock", ["0", "1", "01"])
def test_a_link_may_have_the_name_of_a_locked_joint(
    links: tuple[str, ...], multiplier: float | None, lock: str
) -> None:
    inside = limit(-3, 3), limit(-3, 3) + ("" if multiplier is None else mimic("0", multiplier))
    ends = zip("01", links, links[1:], inside, strict=False)
    text = urdfs.robot(*(joint(name, "revolute", a, b, 'xyz="0 0 1"', "0 1 0", x) for name, a, b, x in ends))
    locked_joints = lock if multiplier is None else "0"  # a mimic joint has no value of its own
    locked = loaded(text).with_locked_joints(dict.fromkeys(locked_joints, 0.3))
    locked.placement(locked.sample(2), locked.link_frames)
    assert locked.certificate().verified


def test_the_bound_of_a_prismatic_joint_locked_at_the_parent_origin_includes_rounding() -> None:
    p, origin = np.array([0.1, 0.7, -0.3]), 'xyz="0.1 0.7 -0.3" rpy="0.4 -1.1 2.2"'
    length = math.hypot(*p)
    axis = rotation_from_rpy([0.4, -1.1, 2.2]).T @ p
    written = " ".join(map(repr, (axis / math.hypot(*axis)).tolist()))  # a unit vector only up to rounding
    whole = loaded(urdfs.robot(joint("s", "prismatic", "a", "b", origin, written, limit(-9, 9))))
    for value in (-length, np.nextafter(-length, 0.0), 7.3):
        locked = whole.with_locked_joints({"s": float(value)})
        locked.placement([], "b")
        assert locked.certificate().verified
    locked = whole.with_locked_joints({"s": -length})
    assert locked.joints["s"].length == pytest.approx(2.0 * length)
    assert np.abs(locked.joints["s"].T_parent_joint[:3, 3]).max() < 1e-15


# -- independence ------------------------------------------------------------------------------------


def test_pinocchio_reads_the_complete_text_and_reduces_the_model_of_a_locked_robot() -> None:
    whole = robot_of("panda")
    locked = whole.with_locked_joints({"panda_finger_joint1": 0.04})
    assert locked.urdf == whole.urdf
    model = locked.pinocchio_model()
    assert model.nq == 7
    assert "panda_finger_joint2" not in list(model.names)
    assert locked.pinocchio_model(mimic=True).nq == 7
    assert locked.to_pinocchio(np.arange(7.0)).tolist() == list(range(7))


def test_a_model_that_pinocchio_cannot_reduce_is_an_oracle_error(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = urdfkin.load("panda", mimic=False).with_locked_joints({"panda_finger_joint1": 0.04})
    assert robot.pinocchio_model(mimic=True).nq == robot.nq  # each finger has its own coordinate

    def refuse(*_: Any) -> None:
        raise ValueError("a locked joint is mimicked")

    monkeypatch.setattr(pin, "buildReducedModel", refuse)
    with pytest.raises(OracleError, match="Pinocchio cannot lock joints of this robot"):
        robot.pinocchio_model(mimic=True)


@pytest.mark.parametrize("oracle", [PINOCCHIO, MUJOCO])
@pytest.mark.parametrize("mistake", ["value", "mimic", "sense", "free"])
def test_both_oracles_detect_a_wrongly_locked_tree(mistake: str, oracle: OracleLibrary) -> None:
    robot = robot_of("panda").with_locked_joints({"panda_finger_joint1": 0.03, "panda_joint7": 0.5})
    robot.verifier.library = oracle
    other = {
        "value": {"panda_finger_joint1": 0.03, "panda_joint7": 0.5000001},
        "mimic": {"panda_finger_joint1": 0.0300001, "panda_joint7": 0.5},
        "sense": {"panda_finger_joint1": 0.03, "panda_joint7": -0.5},
        "free": {"panda_finger_joint1": 0.03},
    }[mistake]
    robot.tree = robot.verifier.tree = robot_of("panda").with_locked_joints(other).tree
    if mistake == "free":
        with pytest.raises(OracleError, match="finds different joints"):
            robot.verifier.oracle(None, oracle)
        return
    with pytest.raises(VerificationError, match=r"--lock panda_joint7=0\.5 --lock panda_finger_joint1=0\.03"):
        robot.placement(robot.neutral(), ["panda_rightfinger", "panda_hand_tcp"], verify=True)


def test_with_free_mimic_joints_a_lock_holds_only_the_named_joint() -> None:
    locked = urdfkin.load("panda", mimic=False, lock={"panda_finger_joint1": 0.04})
    assert locked.joint_names[-1] == "panda_finger_joint2"
    locked.placement(locked.sample(3), locked.link_frames)
    assert locked.certificate().verified


# -- other forms of the same robot -------------------------------------------------------------------


def test_every_way_to_lock_a_joint_gives_the_same_robot() -> None:
    panda = urdfkin.load("panda")
    arm, lock = [f"panda_joint{i}" for i in range(1, 8)], {"panda_finger_joint1": 0.04}
    first = panda.with_locked_joints(lock)
    ways = [
        first,
        panda.with_locked_joints("panda_finger_joint1=40mm"),
        panda.with_locked_joints(lock, joints=arm),
        urdfkin.load("panda", lock={"panda_finger_joint1": "40mm"}),
        urdfkin.load("panda", lock=lock, joints=arm),
        pickle.loads(pickle.dumps(first)),
        copy.copy(first),
    ]
    q = first.poses["ready"]
    T = first.placement(q, "panda_leftfinger")
    for way in ways:
        assert way.origin.lock == (("panda_finger_joint1", 0.04),)
        assert way.placement(q, "panda_leftfinger").tobytes() == T.tobytes()
        assert way.jacobian(q, "panda_hand_tcp").shape == (6, 7)
    twice = panda.with_locked_joints({"panda_joint7": 0.5}).with_locked_joints(lock)
    assert twice.origin.lock == (("panda_joint7", 0.5), ("panda_finger_joint1", 0.04))
    assert (twice.nq, panda.nq) == (6, 8)


def test_the_joints_that_are_not_listed_are_locked_at_zero_or_at_a_pose() -> None:
    panda = urdfkin.load("panda")
    ready = panda.with_locked_joints("ready, panda_joint7=30deg", joints=["panda_joint2", "panda_joint1"])
    assert ready.joint_names == ("panda_joint1", "panda_joint2")
    assert held(ready, "panda_joint7") == math.radians(30)
    assert held(ready, "panda_joint4") == panda.poses["ready"][3]
    arm = urdfkin.load("planar_two_link").with_locked_joints(joints=["joint_1"])
    assert held(arm, "joint_2") == 0.0
    assert arm.placement([0.0], "tip")[:3, 3].tolist() == [0.9, 0.0, 0.0]
    assert urdfkin.load("planar_two_link").with_locked_joints(joints=[]).nq == 0


def test_a_locked_robot_is_the_same_as_its_text_with_fixed_joints() -> None:
    whole = urdfkin.load("ur5")
    locked = whole.with_locked_joints({"wrist_1_joint": 0.5, "shoulder_pan_joint": -1.0})
    assert urdfkin.same(locked, urdfkin.load(to_urdf(locked.tree)))
    assert not urdfkin.same(
        locked, whole.with_locked_joints({"wrist_1_joint": 0.6, "shoulder_pan_joint": -1.0})
    )


def test_all_other_results_exist_for_a_locked_robot() -> None:
    panda = urdfkin.load("panda").with_locked_joints({"panda_finger_joint1": 0.04, "panda_joint3": 0.3})
    frame, q = "panda_hand_tcp", panda.poses["ready"]
    T = panda.placement(q, frame)
    table = panda.dh(frame)
    assert np.abs(table.placement(panda.select(table, q)) - T).max() < 1e-14
    assert np.abs(panda.screws(frame).placement(q) - T).max() < 1e-14
    assert panda.tree_parameters().rows
    assert np.array_equal(panda.prepare(frame).placement(q), T)
    scope: dict[str, Any] = {}
    code = panda.export("numpy", frame, ["placement"])
    assert "Joint panda_finger_joint1 is locked at 0.04" in code
    exec(code, scope)
    assert np.abs(scope["placement"](q) - T).max() < 1e-14
    mujoco = panda.with_convention("mujoco")
    assert mujoco.jacobian(mujoco.neutral(), frame).shape[1] >= panda.nv
    report = urdfkin.validate([panda], samples=3)
    assert report.passed
    assert "--lock panda_joint3=0.3 --lock panda_finger_joint1=0.04" in str(report.as_dict()["command"])
    assert panda.view(q) is not None
    one = np.ones(panda.nv)
    assert (panda.enclose(q, one, one, frame).jacobian.error_bound(panda.jacobian(q, frame)) < 1e-14).all()
    assert panda.certificate().source_notes == "panda_joint3 locked at 0.3, panda_finger_joint1 at 0.04"


MJCF = """<mujoco><worldbody><body name="b"><joint name="one" axis="0 0 1"/><geom size="1"/>
<body name="c" pos="1 0 0"><joint name="two" axis="0 1 0" ref="0.5"/><geom size="1"/></body></body>
</worldbody></mujoco>"""


@pytest.mark.slow
@pytest.mark.parametrize("source", ["mjcf", "table", "model"])
def test_a_robot_from_another_format_can_be_locked(source: str) -> None:
    arm = urdfkin.load("planar_two_link")
    what = {"mjcf": MJCF, "table": arm.dh(), "model": pin.buildModelFromXML(arm.urdf)}[source]
    whole = loaded(what)
    locked = loaded(what, lock={whole.joint_names[0]: 0.25})
    tip = whole.tip_frame
    T = whole.placement([0.25, 1.0], tip)
    assert np.abs(locked.placement([1.0], tip) - T).max() < 1e-15
    assert locked.certificate().verified
    assert locked.verifier.source_notes == whole.verifier.source_notes


def test_calibration_of_a_locked_robot_writes_the_origins_in_the_complete_text() -> None:
    whole = urdfkin.load("panda")
    true = urdfkin.load(whole.urdf.replace('xyz="0 0 0.107"', 'xyz="0 0.001 0.107"'))
    lock = {"panda_joint7": 0.6, "panda_finger_joint1": 0.02}
    locked, q = whole.with_locked_joints(lock), whole.with_locked_joints(lock).sample(40)
    T = true.with_locked_joints(lock).placement(q, "panda_leftfinger")
    found = urdfkin.calibrate(locked, q, T, tip="panda_leftfinger", write_all=True)
    written = urdfkin.load(found.updated_urdf.text)
    full = np.insert(np.concatenate((q, np.full((40, 1), 0.02)), axis=1), 6, 0.6, axis=1)
    assert np.abs(written.placement(full, "panda_leftfinger") - T).max() < 1e-9


# -- errors ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"lock": {"elbow": 1.0}}, "unknown coordinate 'elbow'"),
        (
            {"lock": {"panda_finger_joint2": 0.01}},
            "this joint mimics panda_finger_joint1: give the value of panda_finger_joint1",
        ),
        ({"lock": {"panda_joint8": 0.0}}, "leave out this fixed joint"),
        ({"lock": {"panda_finger_joint1": 4.0}}, "4 is outside [0, 0.04]"),
        ({"lock": {"panda_joint1": 90}}, "degrees? write 90deg"),
        ({"lock": {"panda_joint1": [1.0, 2.0]}}, "needs one value"),
        ({"lock": {"panda_joint1": math.nan}}, "finite value"),
        ({"lock": {"panda_joint1": "soon"}}, "not a finite number"),
        ({"lock": "1, 2"}, "give each number with its name"),
        ({"lock": "ready"}, "a pose does not state which joints to lock"),
        ({"lock": 7}, "lock must be a mapping"),
        ({"lock": {3: 4}}, "must be text"),
        ({"joints": ["elbow"]}, "unknown coordinate 'elbow'"),
        ({"joints": "panda_joint1"}, "must be a list of names"),
        ({"joints": ["panda_joint1"]}, "give a value within them: lock={'panda_joint4': VALUE}"),
        ({"joints": ["panda_joint1"], "lock": {"panda_joint1": 0.0}}, "is also in `joints`"),
        ({"joints": ["panda_finger_joint2"]}, "this joint mimics panda_finger_joint1"),
    ],
)
def test_an_invalid_lock_raises_an_error(options: dict[str, Any], words: str) -> None:
    for lock in (
        lambda: urdfkin.load("panda", **options),
        lambda: urdfkin.load("panda").with_locked_joints(**options),
    ):
        with pytest.raises(urdfkin.UrdfkinError, match=re.escape(words)):
            lock()


@pytest.mark.parametrize(
    "options",
    [{"joints": ["FL_hip_joint"]}, {"lock": {"root_joint": [0.0] * 7}}, {"lock": {"root_joint.x": 1.0}}],
)
def test_a_floating_joint_cannot_be_locked(options: dict[str, Any]) -> None:
    with pytest.raises(urdfkin.InputError, match="a floating joint has no single value to lock"):
        urdfkin.load("a1", root_joint="floating").with_locked_joints(**options)


def test_a_locked_joint_is_named_in_the_errors_about_q() -> None:
    locked = urdfkin.load("planar_two_link").with_locked_joints({"joint_1": 0.5})
    with pytest.raises(urdfkin.InputError, match=r"leave out this joint, locked at 0\.5"):
        locked.placement({"joint_1": 0.5, "joint_2": 0.0})
    with pytest.raises(urdfkin.InputError, match=r"locked at 0\.5"):
        locked.with_locked_joints({"joint_1": 0.4})


def test_a_mimic_joint_outside_its_limits_is_refused_unless_no_value_satisfies_it() -> None:
    mimicked_joint, follows = joint("x", "revolute", "a", "b", axis="1 0 0", more=limit()), mimic("x", 2)
    good, impossible = (
        loaded(
            urdfs.robot(
                mimicked_joint, joint("y", "revolute", "b", "c", "", "1 0 0", follows + limit(low, 9))
            )
        )
        for low in (0, 3)
    )
    assert good.with_locked_joints({"x": 0.5}).nq == 0
    with pytest.raises(urdfkin.InputError, match="joint y: -1 is outside"):
        good.with_locked_joints({"x": -0.5})
    assert impossible.with_locked_joints({"x": 0.5}).nq == 0


@pytest.mark.parametrize("convention", ["isaaclab", "isaaclab3", "mujoco", "newton", "alphabetical"])
@pytest.mark.parametrize("name", ["a1", "go2", "talos", "baxter"])
def test_a_lock_only_removes_the_locked_joint_from_the_joint_order_of_another_tool(
    name: str, convention: str
) -> None:
    robot = urdfkin.load(name, verify=False, mimic=False)
    order = robot.convention(convention).joint_names
    middle = robot.sample(1)[0]
    for name_of in order[::3]:
        locked = robot.with_locked_joints({name_of: middle[robot.coordinate_names.index(name_of)]})
        assert locked.convention(convention).joint_names == tuple(x for x in order if x != name_of)


def test_a_convention_omits_a_locked_joint_from_the_joint_order(tmp_path: Path) -> None:
    file = tmp_path / "map.toml"
    file.write_text('joints = ["joint_2", "joint_1"]\n')
    arm = urdfkin.load("planar_two_link", lock={"joint_1": 0.2})
    assert arm.convention(file).joint_names == ("joint_2",)


def test_exported_code_of_a_locked_robot_states_the_locked_joint() -> None:
    arm = urdfkin.load("ur5", lock={"elbow_joint": 0.5})
    for form in ("tree", "dh", "screws"):
        assert "Joint elbow_joint is locked at 0.5" in arm.export("c", "tool0", ["placement"], form=form)
