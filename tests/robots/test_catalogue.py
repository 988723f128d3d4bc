"""Every robot of the catalogue has the frames, layout, poses and results of Pinocchio."""

import pickle
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest

import urdfkin
from tests.robots.against_pinocchio import assert_agrees, model_of
from urdfkin.compiled import evaluate
from urdfkin.kinematics.bodies import orientation_of
from urdfkin.kinematics.rotation import EULER_SEQUENCES
from urdfkin.model.configuration import draw_base_motion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, JointKind
from urdfkin.robot import Robot
from urdfkin.system.resources import example_robots_dir
from urdfkin.urdf.catalogue import catalogue, example_robot_data_names
from urdfkin.validation.document import ValidationVerdict
from urdfkin.verify.quantities import QUANTITIES

#: Robots of which Pinocchio 4.1 builds no model with mimic=True, because it does not find the mimicked
#: joints.
WITHOUT_MIMIC_MODEL = frozenset({"alex_psyonic_hands", "romeo", "talos", "talos_box"})

#: The first robot of each family, an arm with a mimic joint, and a humanoid; the tests of others are slow.
QUICK = {
    "panda",
    "talos",
    *{catalogue()[name].family: name for name in reversed(example_robot_data_names())}.values(),
}


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
        for name in example_robot_data_names()
    ],
)
def robot(request: pytest.FixtureRequest) -> Robot:
    return urdfkin.load(request.param)


def test_the_catalogue_contains_every_valid_urdf_of_example_robot_data() -> None:
    shipped = {path.relative_to(example_robots_dir()) for path in example_robots_dir().rglob("*.urdf")}
    listed = [catalogue()[name].relative_path for name in example_robot_data_names()]
    assert len(listed) == len(set(listed)) == 68
    assert {path.name for path in shipped - set(listed)} == {"ur3.urdf"}


def test_the_ends_of_an_enclosure_are_adjacent_doubles(robot: Robot) -> None:
    v, a = np.random.default_rng(1).standard_normal((2, robot.nv))
    proof = robot.enclose(robot.sample(1, 1)[0], v, a, robot.link_frames[-1])
    for one in (proof.placement, proof.velocity, proof.acceleration, proof.jacobian, proof.jacobian_rate):
        # A true number that is itself a double may lie between the ends, which are then two steps apart.
        few = one.upper <= np.nextafter(np.nextafter(one.lower, np.inf), np.inf)
        assert (few | ((one.width < 1e-28) & one.contains(np.zeros_like(one.width)))).all()


def test_the_catalogue_is_found_without_importing_pinocchio() -> None:
    code = (
        "import sys; from urdfkin.urdf.catalogue import catalogue; "
        "assert all(entry.path.is_file() for entry in catalogue().values()); "
        "print(sorted({'pinocchio', 'example_robot_data', 'yourdfpy', 'numpy', 'numba'} & set(sys.modules)))"
    )
    root = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_the_limbs_of_a_catalogue_robot_name_existing_frames_that_move(robot: Robot) -> None:
    entry = catalogue()[robot.source]
    for base, tip in entry.limbs.values():
        above = robot.tree.path(robot.tree.frame_link(base))
        path = robot.tree.path(robot.tree.frame_link(tip))
        assert path[: len(above)] == above
        assert any(robot.tree.joints[i].kind.nv for i in path[len(above) :])
    if entry.limbs:
        assert (robot.base_frame, robot.tip_frame) == next(iter(entry.limbs.values()))


def test_every_quantity_of_every_frame_agrees_with_pinocchio(robot: Robot) -> None:
    report = urdfkin.validate(robot, samples=1).robots[0]
    assert (report.verdict, report.failed) == (ValidationVerdict.VERIFIED, 0)
    frames, moving = len(robot.all_frames), len(robot.joint_names)
    results = {quantity: sum(stats.results for stats in report.stats_of(quantity)) for quantity in QUANTITIES}
    assert results["placement"] == 4 * frames
    assert results["acceleration"] == 3 * 4 * frames
    assert results["joint jacobian"] == 3 * 4 * moving


@pytest.mark.slow
def test_every_quantity_agrees_with_pinocchio_on_many_samples(robot: Robot) -> None:
    report = urdfkin.validate(robot, samples=50, seed=1).robots[0]
    assert (report.verdict, report.failed) == (ValidationVerdict.VERIFIED, 0)


@pytest.mark.slow
def test_results_of_a_catalogue_robot_agree_with_direct_calls_of_pinocchio(robot: Robot) -> None:
    generator = np.random.default_rng(2)
    q, v, a = robot.sample(1, 2)[0], generator.normal(size=robot.nv), generator.normal(size=robot.nv)
    link = f"link:{robot.tree.links[robot.tree.frame_link(robot.tip_frame)]}"
    for reference in Reference:
        assert_agrees(robot, q, v, a, link, reference)


def test_joints_velocities_and_frames_have_pinocchios_order_and_names(robot: Robot) -> None:
    follows = any(joint.mimic for joint in robot.tree.joints)
    free = urdfkin.load(robot.source, mimic=False) if follows else robot
    model = model_of(free)
    assert free.joint_names == tuple(model.names)[1:]
    assert free.nv == model.nv
    for i, joint in enumerate(free.tree.joints):
        if joint.kind.nv:
            assert free.tree.v_index[i] == model.joints[model.getJointId(joint.name)].idx_v
    kinds = (pin.FrameType.BODY, pin.FrameType.JOINT, pin.FrameType.FIXED_JOINT)
    theirs = [frame.name for frame in model.frames if frame.type in kinds and frame.name != "universe"]
    assert list(robot.frame_names) == list(dict.fromkeys(theirs))


def test_configurations_convert_to_pinocchios_default_model_and_back(robot: Robot) -> None:
    q, model = robot.sample(4, 3), model_of(robot)
    full = robot.to_pinocchio(q)
    assert full.shape == (4, model.nq)
    for row in full:
        assert pin.isNormalized(model, row, 1e-14)
    back = robot.from_pinocchio(full)
    assert np.abs(back - q).max(initial=0.0) < 1e-14
    assert np.array_equal(robot.to_pinocchio(robot.neutral()), pin.neutral(model)) or any(
        joint.mimic and joint.mimic.offset for joint in robot.tree.joints
    )


def test_configurations_and_velocities_are_those_of_pinocchios_mimic_model(robot: Robot) -> None:
    if robot.source in WITHOUT_MIMIC_MODEL:
        with pytest.raises((ValueError, RuntimeError), match="mimic"):
            model_of(robot, mimic=True)
        return
    model = model_of(robot, mimic=True)
    assert robot.nv == model.nv
    q = robot.sample(3, 4)
    full = robot.to_pinocchio(q, mimic=True)
    assert full.shape == (3, model.nq)
    assert np.abs(robot.from_pinocchio(full, mimic=True) - q).max(initial=0.0) < 1e-14
    data, v = model.createData(), np.random.default_rng(5).normal(size=robot.nv)
    link = robot.tree.links[robot.tree.frame_link(robot.tip_frame)]
    index = model.getFrameId(link, pin.FrameType.BODY)
    pin.forwardKinematics(model, data, full[0], v)
    T = pin.updateFramePlacement(model, data, index).homogeneous
    assert np.abs(robot.placement(q[0], f"link:{link}") - T).max() < 1e-12
    velocity = pin.getFrameVelocity(model, data, index, pin.LOCAL_WORLD_ALIGNED).vector
    assert np.abs(robot.velocity(q[0], v, f"link:{link}") - velocity).max() < 1e-11


@pytest.mark.slow
@pytest.mark.parametrize("root_joint", ["floating", "planar"])
@pytest.mark.parametrize("name", ["panda", "ur5", "a1", "icub", "talos"])
def test_the_coordinates_of_a_root_joint_are_those_of_pinocchio(name: str, root_joint: str) -> None:
    robot = urdfkin.load(name, root_joint=root_joint)
    model, q = model_of(robot), robot.sample(2, 6)
    full = robot.to_pinocchio(q)
    assert full.shape == (2, model.nq)
    assert np.abs(robot.from_pinocchio(full) - q).max() < 1e-14
    kind = JointKind.FLOATING if root_joint == "floating" else JointKind.PLANAR
    assert robot.tree.joints[0].kind is kind
    assert robot.velocity_names[0] == "root_joint.vx"
    assert urdfkin.validate(robot, samples=2).passed


def test_a_pickled_robot_gives_the_same_results(robot: Robot) -> None:
    copy = pickle.loads(pickle.dumps(robot))
    q = robot.sample(3, 7)
    assert np.array_equal(copy.jacobian(q, robot.tip_frame), robot.jacobian(q, robot.tip_frame))
    assert (copy.name, copy.frame_names, copy.source) == (robot.name, robot.frame_names, robot.source)
    for joint in copy.tree.joints:
        assert not joint.T_parent_joint.flags.writeable
        assert not joint.axis.flags.writeable


def test_a_robot_with_missing_mimicked_joints_is_an_error_with_a_remedy() -> None:
    assert urdfkin.load("alex_psyonic_hands").findings
    with pytest.raises(urdfkin.UrdfError) as caught:
        urdfkin.load("alex_psyonic_hands", mimic=True)
    assert "mimic" in str(caught.value)
    assert "mimic=False" in str(caught.value) or "--no-mimic" in str(caught.value)


def test_the_error_about_an_unknown_robot_lists_the_nearest_names() -> None:
    with pytest.raises(urdfkin.UnknownNameError, match="did you mean") as caught:
        urdfkin.load("pnda")
    assert "panda" in caught.value.nearest


# -- named poses of the catalogue ------------------------------------------------------------------------

#: Name of the SRDF's pose that the pose `ready` of a robot equals.
SRDF = {
    "a1": "standing", "anymal_kinova": "standing_with_arm_up", "b1": "standing",
    "b1_z1": "standing_with_arm_home", "centauro": "homing_nominal", "go1": "standing", "go2": "standing",
    "hyq": "standing", "icub": "half_sitting", "icub_reduced": "half_sitting", "kinova": "arm_up",
    "panda": "default", "panda_collision": "default", "talos": "half_sitting", "talos_box": "half_sitting",
}  # fmt: skip


def test_only_robots_with_an_srdf_pose_in_this_list_have_a_pose_in_the_catalogue() -> None:
    assert {name for name, entry in catalogue().items() if entry.poses} == set(SRDF)


@pytest.mark.slow
def test_the_ready_pose_satisfies_every_limit_of_every_robot() -> None:
    outside = {}
    for name in catalogue():
        robot = urdfkin.load(name, verify=False)
        outside[name] = robot.limit_violations("ready")
        # `ready` moves only the joints that may not be at 0, except in poses from SRDF files.
        if not catalogue()[name].poses:
            moved = np.flatnonzero(robot.poses["ready"] != robot.neutral())
            assert len(moved) <= len(robot.limit_violations("neutral")), name
    assert {name: lines for name, lines in outside.items() if lines} == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", SRDF)
def test_the_ready_pose_is_within_pinocchios_limits_and_the_neutral_pose_outside(name: str) -> None:
    robot = urdfkin.load(name, verify=False)
    model = pin.buildModelFromUrdf(str(catalogue()[name].path))

    def within(pose: str) -> bool:
        q = robot.to_pinocchio(robot.poses[pose])
        return bool(((model.lowerPositionLimit <= q) & (q <= model.upperPositionLimit)).all())

    assert within("ready")
    assert not within("neutral")


@pytest.mark.slow
@pytest.mark.parametrize("name", SRDF)
def test_the_ready_pose_is_the_pose_of_the_srdf(name: str) -> None:
    folder = Path(example_robots_dir()) / catalogue()[name].relative_path.parts[0] / "srdf"
    texts = [ElementTree.parse(path).getroot() for path in sorted(folder.glob("*.srdf"))]
    robot = urdfkin.load(name, verify=False)
    ready = dict(zip(robot.coordinate_names, robot.poses["ready"].tolist(), strict=True))
    found = []
    for state in (state for root in texts for state in root.iterfind(f"group_state[@name='{SRDF[name]}']")):
        says = {joint.get("name", ""): joint.get("value", "").split() for joint in state.iter("joint")}
        of_ours = {joint: float(x[0]) for joint, x in says.items() if joint in ready and len(x) == 1}
        if name == "kinova":  # the limits differ from the pose by a turn
            of_ours["j2s6s200_joint_3"] = round(of_ours["j2s6s200_joint_3"] + 2.0 * np.pi, 4)
        found.append(of_ours.items() <= ready.items() and len(of_ours) >= len(ready) - 3)
    assert any(found)


# -- fixed and moving bases, and the manipulator Jacobian ------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("name", ["panda", "ur5", "allegro_left_hand", "polar", "iris_simple"])
def test_all_results_agree_with_pinocchio_even_on_a_moving_base(name: str, moving: bool) -> None:
    robot = urdfkin.load(name)
    q = robot.sample(4, 2)
    v, a = np.random.default_rng(3).normal(size=(2, 4, robot.nv))
    base = draw_base_motion(4, np.random.default_rng(1)) if moving else None
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
    original = evaluate.jacobian_rates
    monkeypatch.setattr(evaluate, "jacobian_rates", lambda *x, **y: original(*x, **y) * (1.0 + 1e-10))
    robot = urdfkin.load("panda")
    words = r"jacobian rate of panda_hand.*urdfkin jacobian-rate panda"
    with pytest.raises(urdfkin.VerificationError, match=words):
        robot.jacobian_rate(robot.sample(1, 6)[0], np.ones(robot.nv), "panda_hand")


@pytest.mark.slow
@pytest.mark.parametrize("representation", [*EULER_SEQUENCES, "quaternion"])
def test_the_manipulator_jacobian_predicts_the_change_of_the_pose(representation: str) -> None:
    robot = urdfkin.load("ur5")
    q, v, step = robot.sample(1, 7)[0], np.random.default_rng(8).normal(size=6), 1e-4

    def pose_at(t: float) -> FloatArray:
        T = robot.placement(q + t * v, "tool0")
        return np.concatenate((T[:3, 3], orientation_of(representation, T[:3, :3])))

    slope = (8 * (pose_at(step) - pose_at(-step)) - (pose_at(2 * step) - pose_at(-2 * step))) / (12 * step)
    rates = robot.analytical_jacobian(q, "tool0", representation) @ v
    assert np.abs(rates - slope).max() <= 1e-9 * max(1.0, float(np.abs(rates).max()) ** 3)


def test_unknown_frames_and_wrong_lengths_are_refused() -> None:
    robot = urdfkin.load("polar")
    with pytest.raises(urdfkin.UnknownNameError, match="did you mean slider"):
        robot.placement([0.0, 0.5], ["arm", "slidr"])
    with pytest.raises(urdfkin.InputError, match="v needs 2 numbers"):
        robot.jacobian_rate([0.0, 0.5], [1.0], "slider")
