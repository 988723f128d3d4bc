"""The order of a tree, distances of poses, integration, limits, and Pinocchio's layout."""

import math
import pickle
from typing import Any

import numpy as np
import pinocchio
import pytest

import urdfkin
from tests.random_chains import rotation, shift
from tests.random_chains import z_joint as joint
from urdfkin.compiled.evaluate import placements
from urdfkin.compiled.plan import compile_tree
from urdfkin.errors import InputError, RangeError, UnknownNameError
from urdfkin.model.configuration import from_pinocchio, limit_violations, to_pinocchio
from urdfkin.model.integration import difference, integrate
from urdfkin.model.mechanisms.mechanism import pose_difference
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree, Limit, Mimic, build_tree, with_root_joint
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import catalogue


@pytest.fixture
def hand() -> KinematicTree:
    rows = [
        (joint("tip", mimic=Mimic("finger", 0.5, 0.1)), "finger_link", "tip_link"),
        (joint("thumb", kind=JointKind.CONTINUOUS), "palm", "thumb_link"),
        (joint("mount", kind=JointKind.FIXED), "tip_link", "nail"),
        (joint("finger"), "palm", "finger_link"),
    ]
    return build_tree("hand", "palm", rows)


def test_joints_are_ordered_depth_first_and_siblings_by_name(hand: KinematicTree) -> None:
    assert [j.name for j in hand.joints] == ["finger", "tip", "mount", "thumb"]
    assert hand.links == ("palm", "finger_link", "tip_link", "nail", "thumb_link")
    assert [j.parent for j in hand.joints] == [0, 1, 2, 0]


def test_a_mimic_joint_has_the_index_of_the_mimicked_joint(hand: KinematicTree) -> None:
    assert (hand.nq, hand.nv) == (2, 2)
    assert hand.q_index[hand.joint_index("tip")] == hand.q_index[hand.joint_index("finger")] == 0
    assert hand.q_index[hand.joint_index("thumb")] == 1


def test_the_frame_of_a_joint_is_the_frame_of_the_child_link(hand: KinematicTree) -> None:
    assert hand.frame_link("tip") == hand.frame_link("tip_link") == 2
    assert hand.frame_names[:4] == ("palm", "finger", "finger_link", "tip")


def test_the_error_about_an_unknown_frame_lists_the_nearest_names(hand: KinematicTree) -> None:
    with pytest.raises(UnknownNameError, match=r"unknown frame 'tip_lnk'; did you mean tip_link"):
        hand.frame_link("tip_lnk")


def test_a_name_of_a_link_and_of_an_unrelated_joint_needs_a_prefix() -> None:
    tree = build_tree("r", "a", [(joint("b"), "a", "c"), (joint("d"), "c", "b")])
    with pytest.raises(InputError, match=r"write 'link:b' or 'joint:b'"):
        tree.frame_link("b")
    assert (tree.frame_link("link:b"), tree.frame_link("joint:b")) == (2, 1)
    assert [tree.frame_name(link) for link in range(3)] == ["a", "c", "link:b"]


def test_a_path_lists_the_joints_from_the_root_outwards(hand: KinematicTree) -> None:
    assert [hand.joints[i].name for i in hand.path(hand.link_index("nail"))] == ["finger", "tip", "mount"]
    assert [hand.links[i] for i in hand.leaves()] == ["nail", "thumb_link"]


def test_a_root_joint_connects_the_robot_to_the_universe(hand: KinematicTree) -> None:
    free = with_root_joint(hand, JointKind.FLOATING)
    assert (free.nq, free.nv) == (9, 8)
    assert free.links[:2] == ("universe", "palm")
    assert free.joints[0].name == "root_joint"
    with pytest.raises(InputError, match="root_joint"):
        with_root_joint(free, JointKind.PLANAR)


def test_a_loop_or_a_disconnected_link_is_refused() -> None:
    with pytest.raises(InputError, match="cannot be reached"):
        build_tree("r", "a", [(joint("x"), "b", "c")])
    with pytest.raises(InputError, match="loop"):
        build_tree("r", "a", [(joint("x"), "a", "b"), (joint("y"), "b", "a")])


def test_a_mimic_joint_of_a_mimic_joint_is_refused() -> None:
    first, second = joint("b", mimic=Mimic("a", 1.0, 0.0)), joint("c", mimic=Mimic("b", 1.0, 0.0))
    with pytest.raises(InputError, match="mimic only an independent joint"):
        build_tree("r", "l0", [(joint("a"), "l0", "l1"), (first, "l1", "l2"), (second, "l2", "l3")])


def test_arrays_are_read_only_before_and_after_pickling(hand: KinematicTree) -> None:
    for tree in (hand, pickle.loads(pickle.dumps(hand))):
        with pytest.raises(ValueError, match="read-only"):
            tree.joints[0].T_parent_joint[0, 3] = 1.0


@pytest.mark.slow
def test_a_chain_of_50000_links_needs_no_recursion() -> None:
    chain = [(joint(f"j{i}"), f"l{i}", f"l{i + 1}") for i in range(50_000)]
    tree = build_tree("long", "l0", chain)
    assert tree.nq == 50_000
    assert len(tree.path(50_000)) == 50_000


# -- distance of two poses -------------------------------------------------------------------------


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.3, math.pi / 2, 3.0, -3.0])
def test_the_distance_of_poses_is_the_angle_and_the_displacement(axis: str, angle: float) -> None:
    T = shift(0.1, -0.2, 0.3) @ rotation("y", 0.7) @ rotation("x", -1.1)
    moved = T @ rotation(axis, angle)
    moved[:3, 3] += [2.0, 3.0, 6.0]
    turned, way = pose_difference(T, moved)
    assert turned == pytest.approx(abs(angle), rel=1e-6, abs=1e-15)
    assert way == pytest.approx(7.0, rel=1e-15)
    assert pose_difference(moved, T) == pytest.approx((turned, way), rel=1e-12)
    assert np.allclose(pose_difference(T, T), 0.0, atol=1e-15)


# -- `integrate` and `difference` -------------------------------------------------------------------


EPS = np.finfo(float).eps
#: A robot without mimic joints for each kind of root joint.
SUBJECTS = [("kinova", None), ("a1", "floating"), ("a1", "planar")]


def both(name: str, root: str | None) -> tuple[Robot, Any]:
    roots = {"floating": pinocchio.JointModelFreeFlyer, "planar": pinocchio.JointModelPlanar}
    path = str(catalogue()[name].path)
    model = pinocchio.buildModelFromUrdf(path, *([roots[root]()] if root else []))
    return urdfkin.load(name, root_joint=root, verify=False), model


@pytest.mark.parametrize("size", [1e-9, 1e-3, 0.49, 0.51, 2.5])
@pytest.mark.parametrize(("name", "root"), SUBJECTS)
def test_integrate_agrees_with_pinocchio_and_difference_is_the_inverse(
    name: str, root: str | None, size: float
) -> None:
    robot, model = both(name, root)
    q = robot.sample(20, seed=3)
    v = np.random.default_rng(4).uniform(-1.0, 1.0, (20, robot.nv))
    v *= size / np.abs(v).max(axis=1, keepdims=True)
    if root == "floating":
        v[:, 3:6] *= min(1.0, 3.0 / np.linalg.norm(v[:, 3:6], axis=1).max())
    ahead = robot.integrate(q, v)
    pairs = zip(robot.to_pinocchio(q), v, strict=True)
    theirs = np.array([pinocchio.integrate(model, *pair) for pair in pairs])
    assert same_pose(robot.to_pinocchio(ahead), theirs) < 64 * EPS * (1.0 + np.abs(theirs).max())
    back = robot.difference(q, ahead)
    np.testing.assert_allclose(back, v, rtol=0.0, atol=256 * EPS * (4.0 + size))
    pairs = zip(robot.to_pinocchio(q), robot.to_pinocchio(ahead), strict=True)
    theirs = np.array([pinocchio.difference(model, *pair) for pair in pairs])
    # Pinocchio's logarithms give some digits away near 0.
    np.testing.assert_allclose(back, theirs, rtol=0.0, atol=1e-9)


def same_pose(ours: FloatArray, theirs: FloatArray) -> float:
    """How far two of Pinocchio's configurations are apart, where a quaternion's negative is the same."""
    flipped = theirs.copy()
    flipped[:, 3:7] *= -1.0
    apart = np.minimum(np.abs(ours - theirs).max(axis=1), np.abs(ours - flipped).max(axis=1))
    return float(apart.max())


@pytest.mark.parametrize(("name", "root"), SUBJECTS)
def test_small_steps_at_constant_rates_add_up_to_a_large_step(name: str, root: str | None) -> None:
    robot, _ = both(name, root)
    q, v = robot.sample(5, seed=1), np.random.default_rng(2).uniform(-1.0, 1.0, (5, robot.nv))
    walked = q
    for _ in range(8):
        walked = robot.integrate(walked, v / 8.0)
    np.testing.assert_allclose(robot.difference(robot.integrate(q, v), walked), 0.0, atol=1e-13)


def test_the_velocity_of_a_frame_is_the_difference_quotient_along_an_integration_step() -> None:
    robot, _ = both("a1", "floating")
    q, v = robot.sample(1, seed=5)[0], np.random.default_rng(6).uniform(-1.0, 1.0, robot.nv)
    h = 1e-5
    ahead, behind = (robot.placement(robot.integrate(q, x * v), "FL_foot")[:3, 3] for x in (h, -h))
    np.testing.assert_allclose((ahead - behind) / (2 * h), robot.velocity(q, v, "FL_foot")[:3], atol=1e-8)


def test_batches_of_integrate_and_difference_broadcast_or_are_refused() -> None:
    robot, _ = both("a1", "planar")
    q, v = robot.sample(4), np.ones((3, 1, robot.nv))
    assert robot.integrate(q, v).shape == (3, 4, robot.nq)
    assert robot.difference(q, robot.neutral()).shape == (4, robot.nv)
    with pytest.raises(urdfkin.InputError, match="the batch shapes of the arguments do not broadcast"):
        robot.integrate(q, np.ones((3, robot.nv)))


def test_integrate_counts_turns_and_difference_takes_the_shortest_way() -> None:
    robot, _ = both("kinova", None)
    wheel = robot.coordinate_names.index("j2s6s200_joint_1")
    turned = robot.integrate("neutral", "neutral, j2s6s200_joint_1=350deg/s")
    assert turned[wheel] == pytest.approx(np.radians(350.0))
    assert robot.difference("neutral", turned)[wheel] == pytest.approx(np.radians(-10.0))


@pytest.mark.parametrize(
    ("root", "q", "v"),
    [
        (None, "joint_1=1.7e308, joint_2=0", "joint_1=1.7e308, joint_2=0"),
        ("planar", "neutral", "neutral, root_joint.vx=1, root_joint.wz=1e160"),
        ("floating", "neutral", "neutral, root_joint.wx=1e160"),
        ("floating", "neutral, root_joint.x=1.7e308", "neutral, root_joint.vx=1.7e308"),
    ],
)
def test_integrate_refuses_a_result_outside_the_range_of_doubles(root: str | None, q: str, v: str) -> None:
    robot = urdfkin.load("planar_two_link", root_joint=root, verify=False)
    with pytest.raises(RangeError, match="a result leaves the range of double precision"):
        robot.integrate(q, v)


@pytest.mark.parametrize(
    ("root", "change"), [(None, "joint_1=1.7e308"), ("planar", "root_joint.angle=1e160"),
                         ("floating", "root_joint.x=1.7e308")],
)  # fmt: skip
def test_difference_refuses_a_result_outside_the_range_of_doubles(root: str | None, change: str) -> None:
    robot = urdfkin.load("planar_two_link", root_joint=root, verify=False)
    with pytest.raises(RangeError, match="a result leaves the range of double precision"):
        robot.difference(f"neutral, {change.replace('=', '=-')}", f"neutral, {change}")


@pytest.mark.parametrize("kind", [JointKind.PRISMATIC, JointKind.REVOLUTE, JointKind.CONTINUOUS])
@pytest.mark.parametrize(("multiplier", "keeps_pose"), [(0.5, False), (0.0, True), (-2.0, None)])
def test_difference_keeps_full_turns_that_move_a_mimic_joint(
    kind: JointKind, multiplier: float, keeps_pose: bool | None
) -> None:
    keeps_pose = kind.turns if keeps_pose is None else keeps_pose
    wheel = joint("wheel", kind=JointKind.CONTINUOUS)
    other = joint("other", kind=kind, mimic=Mimic("wheel", multiplier, 0.1))
    tree = build_tree("rack", "base", [(wheel, "base", "hub"), (other, "base", "rack")])
    start, end = np.array([0.2]), np.array([6.0])
    way = difference(tree, start, end)
    assert way == pytest.approx([5.8 - math.tau if keeps_pose else 5.8])
    poses = placements(compile_tree(tree, [1, 2]), np.array([end, integrate(tree, start, way)]))
    np.testing.assert_allclose(poses[1], poses[0], rtol=0.0, atol=1e-14)


# -- limits, and the layout of Pinocchio -----------------------------------------------------------


LOWER, UPPER = -0.7, 1.3


def two_joints(mimic: Mimic | None = None) -> KinematicTree:
    a = joint("a", limit=Limit(LOWER, UPPER, 1.0, 1.0))
    b = joint("b", kind=JointKind.PRISMATIC, limit=Limit(0.0, 0.1, 1.0, 1.0), mimic=mimic)
    return build_tree("two", "l0", [(a, "l0", "l1"), (b, "l1", "l2")])


@pytest.mark.parametrize(
    "a", [LOWER, 0.0, UPPER, math.nextafter(LOWER, -1.0), math.nextafter(UPPER, 2.0)], ids=str
)
def test_a_limit_and_its_neighbouring_number_are_within_the_limit(a: float) -> None:
    assert limit_violations(two_joints(), np.array([a, 0.05])) == []


@pytest.mark.parametrize("beyond", [1e-12, 1e-6, 1e-3, 1.0])
@pytest.mark.parametrize(("bound", "sign"), [(LOWER, -1.0), (UPPER, 1.0)])
def test_a_joint_slightly_outside_its_limits_is_reported(bound: float, sign: float, beyond: float) -> None:
    q = np.array([[0.0, 0.05], [bound + sign * beyond, 0.05], [0.1, 0.05]])
    (line,) = limit_violations(two_joints(), q)
    assert line == f"joint a: {bound + sign * beyond:.6g} is outside [-0.7, 1.3]"


def test_the_worst_value_of_a_batch_is_reported_for_each_joint() -> None:
    q = np.array([[[1.4, -0.2], [1.9, 0.0]], [[-0.8, 0.3], [0.0, 0.05]]])
    said = ["joint a: 1.9 is outside [-0.7, 1.3]", "joint b: -0.2 is outside [0, 0.1]"]
    assert limit_violations(two_joints(), q) == said


@pytest.mark.parametrize(("a", "b"), [(0.15, None), (0.21, "0.11"), (-0.01, None), (-0.02, "-0.005")])
def test_the_limits_of_a_mimic_joint_apply_to_its_own_value(a: float, b: str | None) -> None:
    found = limit_violations(two_joints(Mimic("a", 0.5, 0.005)), np.array([a]))
    assert found == ([] if b is None else [f"joint b: {b} is outside [0, 0.1]"])


def test_joints_without_limits_and_empty_batches_have_no_violations() -> None:
    tree = build_tree("free", "l0", [(joint("c", kind=JointKind.CONTINUOUS), "l0", "l1")])
    assert limit_violations(tree, np.array([1e9])) == []
    assert limit_violations(two_joints(), np.empty((0, 2))) == []


@pytest.fixture
def everything() -> KinematicTree:
    joints = [
        joint("wheel", kind=JointKind.CONTINUOUS),
        joint("table", kind=JointKind.PLANAR),
        joint("slide", kind=JointKind.PRISMATIC, mimic=Mimic("wheel", -2.0, 0.3)),
        joint("gear", kind=JointKind.CONTINUOUS, mimic=Mimic("wheel", 3.0, 0.1)),
    ]
    return build_tree("everything", "l0", [(one, f"l{i}", f"l{i + 1}") for i, one in enumerate(joints)])


@pytest.mark.parametrize("mimic", [True, False])
def test_from_pinocchio_inverts_to_pinocchio(everything: KinematicTree, mimic: bool) -> None:
    q = np.random.default_rng(2).uniform(-3.0, 3.0, (2, 5, 4))
    there = to_pinocchio(everything, q, mimic=mimic)
    assert there.shape == (2, 5, 6 if mimic else 9)
    np.testing.assert_allclose(from_pinocchio(everything, there, mimic=mimic), q, atol=1e-14)


@pytest.mark.parametrize("turns", [0, 1, -3])
@pytest.mark.parametrize("angle", [-math.pi, math.pi, np.nextafter(-math.pi, 0.0), 3.0, -0.0])
def test_from_pinocchio_returns_angles_in_plus_minus_pi(everything: Any, angle: float, turns: int) -> None:
    x = angle + turns * math.tau
    there = np.array([np.cos(x), np.sin(x), x, x, np.cos(x), np.sin(x)])
    found = from_pinocchio(everything, there, mimic=True)[[0, 3]]  # the wheel's, and the planar joint's
    assert (np.abs(found) <= math.pi).all()
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * angle), atol=1e-14)
    if not turns:
        assert (found == angle).all()


@pytest.mark.parametrize(("off", "refused"), [(1e-12, False), (1e-8, True), (-1e-3, True), (0.5, True)])
@pytest.mark.parametrize("name", ["slide", "gear"])
def test_from_pinocchio_refuses_a_mimic_joint_that_violates_its_rule(
    everything: KinematicTree, name: str, off: float, refused: bool
) -> None:
    q = np.array([[0.2, 0.0, 0.0, 0.0], [0.4, 1.0, 2.0, 3.0]])
    there = to_pinocchio(everything, q)
    if name == "slide":
        there[1, 6] += off
    else:
        angle = 3.0 * 0.4 + 0.1 + off
        there[1, 7:] = math.cos(angle), math.sin(angle)
    if not refused:
        np.testing.assert_allclose(from_pinocchio(everything, there), q, atol=1e-14)
        return
    with pytest.raises(InputError, match=f"{name}.*off by {abs(off):.3g}|off by {abs(off):.3g}.*{name}"):
        from_pinocchio(everything, there)


def test_from_pinocchio_finds_the_turns_that_a_mimic_joint_shows(everything: KinematicTree) -> None:
    q = np.array([[4.0, 0.0, 0.0, 0.0], [-20.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]])
    there = to_pinocchio(everything, q)
    np.testing.assert_allclose(from_pinocchio(everything, there), q, atol=1e-13)
    with pytest.raises(InputError, match="lose whole turns, which move joint slide"):
        to_pinocchio(everything, q, mimic=True)
    np.testing.assert_allclose(to_pinocchio(everything, q[2], mimic=True)[:2], there[2, :2])


def test_to_pinocchio_has_the_length_of_the_model_if_mimic_joints_move_freely() -> None:
    for mimic in (True, False):
        robot = urdfkin.load("panda", mimic=mimic, verify=False)
        for same in (True, False):
            model = robot.pinocchio_model(mimic=same)
            assert robot.to_pinocchio(robot.neutral(), mimic=same).shape == (model.nq,)


@pytest.mark.parametrize("at", [0, 4])
def test_from_pinocchio_refuses_an_invalid_cosine_and_sine(everything: KinematicTree, at: int) -> None:
    there = to_pinocchio(everything, np.array([0.2, 0.5, -0.5, 1.0]), mimic=True)
    there[at : at + 2] *= 1.0 + 2e-6
    with pytest.raises(InputError, match="must have norm 1"):
        from_pinocchio(everything, there, mimic=True)
    there[at : at + 2] *= 0.5  # The message names this norm, not the correct norm of another configuration.
    right = to_pinocchio(everything, np.array([0.2, 0.5, -0.5, 1.0]), mimic=True)
    with pytest.raises(InputError, match=r"found 0\.500001"):
        from_pinocchio(everything, np.array([right, there]), mimic=True)


@pytest.mark.parametrize("length", [5, 7, 9])
def test_a_configuration_of_the_wrong_length_is_refused(everything: KinematicTree, length: int) -> None:
    with pytest.raises(InputError, match="wrong length"):
        from_pinocchio(everything, np.zeros(length), mimic=True)
