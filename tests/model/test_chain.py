"""A chain has the same motion as the tree, for a path in any direction."""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

import urdfkin
from tests import urdfs
from tests.oracle import TreeOracle
from tests.random_chains import configurations, rotation, shift, trees, z_joint
from urdfkin.errors import InputError, NotFiniteError, RangeError, UnknownNameError
from urdfkin.kinematics.rotation import exp_rotation, log_rotation
from urdfkin.model.chain import make_chain
from urdfkin.model.path import ElementaryMotion, Path, elementary_pose
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree, Mimic, build_tree, pose
from urdfkin.verify.conversions import check_chain
from urdfkin.verify.oracle import QueryBatch
from urdfkin.verify.pinocchio import PinocchioOracle
from urdfkin.verify.tables import TableError

EPS = np.finfo(np.float64).eps


@pytest.fixture
def walker() -> KinematicTree:
    hip = shift(0.0, 0.1, 0.0) @ rotation("x", 0.3)
    knee = z_joint("right_knee", shift(0.4, 0, 0), mimic=Mimic("left_knee", -1.5, 0.2))
    rows = [
        (z_joint("left_hip", hip), "pelvis", "left_thigh"),
        (z_joint("left_knee", shift(0.4, 0.0, 0.0)), "left_thigh", "left_shin"),
        (z_joint("left_sole", shift(0.0, 0.0, -0.5), JointKind.FIXED), "left_shin", "left_foot"),
        (z_joint("right_hip", hip.T), "pelvis", "right_thigh"),
        (knee, "right_thigh", "right_shin"),
        (z_joint("float", kind=JointKind.FLOATING), "left_shin", "balloon"),
    ]
    return build_tree("walker", "pelvis", rows)


@pytest.mark.slow
@given(trees())
@settings(max_examples=50)
def test_the_placement_of_every_path_of_a_tree_agrees_with_pinocchio(tree: KinematicTree) -> None:
    oracle = TreeOracle(tree)
    q = configurations(tree.nq, 4)
    ends = [tree.links[0], tree.links[-1], tree.links[len(tree.links) // 2]]
    for base, tip in itertools.product(ends, ends):
        path = make_chain(tree, tip, base)
        scale = 1.0 + path.lengths.sum() + 10.0 * len(path.joints)
        found = path.placement(path.coupling.select(tree, q))
        error = np.abs(found - oracle.placement(q, tip, base)).max()
        assert error <= 10 * (1 + len(tree.joints)) * EPS * scale


def test_a_path_through_the_common_ancestor_goes_up_and_then_down(walker: KinematicTree) -> None:
    path = make_chain(walker, "right_shin", "left_foot")
    assert [j.name for j in path.joints] == ["left_knee", "left_hip", "right_hip", "right_knee"]
    assert [j.backwards for j in path.joints] == [True, True, False, False]


def test_a_joint_passed_backwards_has_a_reversed_axis_and_an_unchanged_sign(walker: KinematicTree) -> None:
    there, back = make_chain(walker, "left_shin", "left_thigh"), make_chain(walker, "left_thigh", "left_shin")
    np.testing.assert_array_equal(there.axes(), [[0.0, 0.0, 1.0]])
    np.testing.assert_array_equal(back.axes(), [[0.0, 0.0, -1.0]])
    np.testing.assert_allclose(there.placement([0.7]) @ back.placement([0.7]), np.eye(4), atol=4 * EPS)


@pytest.mark.slow
@given(trees(min_joints=1))
@settings(max_examples=50)
def test_the_placement_of_a_reversed_chain_is_the_inverse(tree: KinematicTree) -> None:
    there, back = make_chain(tree, "tip", "l0"), make_chain(tree, "l0", "tip")
    q = configurations(tree.nq, 4)
    T_there, T_back = (path.placement(path.coupling.select(tree, q)) for path in (there, back))
    scale = 1.0 + there.lengths.sum() + 10.0 * len(there.joints)
    assert np.abs(T_there @ T_back - np.eye(4)).max() <= 20 * (1 + len(tree.joints)) * EPS * scale


def test_a_mimicked_joint_outside_the_path_is_a_coordinate(walker: KinematicTree) -> None:
    path = make_chain(walker, "right_shin", "pelvis")
    assert path.joint_names == ("right_hip", "left_knee")
    assert path.coupling.values([0.1, 2.0]).tolist() == [0.1, -1.5 * 2.0 + 0.2]
    q = np.arange(1.0, walker.nq + 1)
    picked = dict(zip(path.joint_names, path.coupling.select(walker, q), strict=True))
    assert picked["left_knee"] == q[walker.q_index[walker.joint_index("left_knee")]]
    assert set(picked) <= {j.name for j in walker.joints if j.nq == 1}


def test_coordinates_can_be_given_by_name(walker: KinematicTree) -> None:
    path = make_chain(walker, "left_foot")
    named = path.placement({"left_knee": 0.4, "left_hip": 0.1})
    np.testing.assert_array_equal(named, path.placement([0.1, 0.4]))
    np.testing.assert_array_equal(path.placement("neutral, left_knee=0.4"), path.placement([0.0, 0.4]))
    with pytest.raises(UnknownNameError, match="left_knee"):
        path.placement({"left_nee": 0.4})


@pytest.mark.parametrize(
    "q",
    [
        np.ma.masked_array([0.1, 0.4], [True, False]),
        np.array([0.1 + 1.0j, 0.4]),
        np.array(["0.1", "0.4"]),
        np.array([None, 0.4]),
        np.array(["2026-01-01", "2026-01-02"], dtype="datetime64[D]"),
    ],
)
def test_coordinates_of_a_path_must_be_real_numbers(q: Any, walker: KinematicTree) -> None:
    with pytest.raises(InputError, match="q must be real numbers"):
        make_chain(walker, "left_foot").placement(q)


def test_a_missing_name_raises_an_error(walker: KinematicTree) -> None:
    with pytest.raises(InputError, match=r"no value for left_hip; .*'neutral, left_knee=\.\.\.'"):
        make_chain(walker, "left_foot").placement({"left_knee": 0.4})


def test_the_sum_of_interorigin_vectors_leads_from_the_first_joint_to_the_tip(walker: KinematicTree) -> None:
    path = make_chain(walker, "left_foot", "right_thigh")
    q = configurations(len(path.joint_names), 5)
    total = path.origins(q)[:, 0] + path.interorigin(q).sum(axis=-2)
    np.testing.assert_allclose(total, path.placement(q)[:, :3, 3], atol=8 * EPS)
    np.testing.assert_allclose(np.linalg.norm(path.axes(q), axis=-1), 1.0, atol=8 * EPS)


@pytest.mark.slow
@given(trees())
@settings(max_examples=50)
def test_the_lengths_bound_the_distance_between_origins(tree: KinematicTree) -> None:
    for path in (make_chain(tree, "tip"), make_chain(tree, "l0", "tip")):
        distances = [np.linalg.norm(A[:3, 3]) for A in path.constants]
        assert (np.array(distances) <= path.lengths * (1 + 8 * EPS) + 1e-300).all()


def test_the_error_about_a_path_over_a_floating_joint_contains_a_remedy(walker: KinematicTree) -> None:
    with pytest.raises(InputError, match=r"joint float: a floating joint .*'balloon' outwards"):
        make_chain(walker, "balloon", "pelvis")
    assert make_chain(walker, "balloon", "balloon").joints == ()


def test_the_error_about_a_wrong_number_of_coordinates_lists_the_expected_coordinates(
    walker: KinematicTree,
) -> None:
    with pytest.raises(InputError, match="left_hip, left_knee"):
        make_chain(walker, "left_foot").placement(np.zeros(3))
    with pytest.raises(InputError, match="numbers for walker"):
        make_chain(walker, "left_foot").coupling.select(walker, np.zeros(3))


def moved(name: str, T: FloatArray) -> Callable[..., FloatArray]:
    """Pinocchio's placements with one frame, by its name, moved in its own axes."""
    right = PinocchioOracle.placements

    def placements(self: PinocchioOracle, x: QueryBatch) -> FloatArray:
        found = right(self, x).copy()
        found[:, [str(frame).endswith(name) for frame in x.frames]] @= T
        return found

    return placements


@pytest.mark.parametrize(
    ("frame", "T", "said"),
    [
        ("forearm", shift(1e-12, 0.0, 0.0), "an origin 1e-12 m off, a direction 0"),
        ("forearm", rotation("x", 1e-12), "an origin 0 m off, a direction 1e-12"),
        ("tool", rotation("z", 1e-12), "an origin 0 m off, a direction 1e-12"),
        ("tool", shift(0.0, 1e-12, 0.0), "an origin 1e-12 m off, a direction 0"),
        ("forearm", np.full((4, 4), np.nan), "an origin nan m off, a direction nan"),
    ],
)
def test_a_wrong_origin_alone_or_a_wrong_direction_alone_is_a_disagreement(
    frame: str, T: FloatArray, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = urdfs.robot(
        urdfs.joint("arm", "continuous", "base", "upper"),
        urdfs.joint("forearm", "continuous", "upper", "fore", 'xyz="1 0 0"'),
        urdfs.joint("mount", "fixed", "fore", "tool", 'xyz="1 0 0"', ""),
    )
    robot = urdfkin.load(text)
    path, q = robot.chain("tool"), np.zeros((1, 2))
    assert check_chain(robot.verifier, path, q) is not None
    monkeypatch.setattr(PinocchioOracle, "placements", moved(frame, T))
    with pytest.raises(TableError) as error:
        check_chain(robot.verifier, path, q)
    assert said in str(error.value)


def test_a_chain_with_an_infinite_bound_is_refused() -> None:
    text = urdfs.robot(
        urdfs.joint("one", "prismatic", "base", "middle", more=urdfs.limit(-1.7e308, 1.7e308)),
        urdfs.joint("two", "prismatic", "middle", "tip", more=urdfs.limit(-1.7e308, 1.7e308)),
    )
    robot = urdfkin.load(text)
    with pytest.raises(RangeError, match="the bound on a position exceeds the range"):
        check_chain(robot.verifier, robot.chain("tip"), np.array([[1.7e308, -1.7e308]]))


# -- frames and columns of a path ------------------------------------------------------------------


A = pose(exp_rotation([0.3, -0.4, 0.5]), [0.1, 0.2, 0.3])
MOTIONS = tuple(ElementaryMotion(axis, turns) for turns in (True, False) for axis in range(3))
PATH = Path((A, *(step for motion in MOTIONS for step in (motion, A))))
AMOUNTS = np.random.default_rng(0).uniform(-1.0, 1.0, (4, len(MOTIONS)))


def test_the_frames_of_a_path_are_products_of_the_elementary_motions() -> None:
    T, frames = np.broadcast_to(A, (4, 4, 4)), PATH.frames(AMOUNTS)
    for k, motion in enumerate(MOTIONS):
        T = T @ elementary_pose(motion.axis, motion.turns, AMOUNTS[:, k])
        np.testing.assert_allclose(frames[:, 2 * k + 1], T, atol=1e-15)
        T = T @ A
        np.testing.assert_allclose(frames[:, 2 * k + 2], T, atol=1e-15)


def test_the_jacobian_columns_of_a_path_are_difference_quotients() -> None:
    poses, columns = PATH.pose_and_jacobian(AMOUNTS)
    for k in range(len(MOTIONS)):
        step = 1e-6 * np.eye(len(MOTIONS))[k]
        before, after = PATH.poses(AMOUNTS - step), PATH.poses(AMOUNTS + step)
        turn = log_rotation(after[:, :3, :3] @ before[:, :3, :3].swapaxes(-1, -2))
        quotient = np.hstack([(after - before)[:, :3, 3], turn]) / 2e-6
        np.testing.assert_allclose(columns[:, :, k], quotient, atol=1e-9)
    np.testing.assert_array_equal(poses, PATH.poses(AMOUNTS))


def test_an_elementary_motion_by_zero_is_the_identity() -> None:
    zero = Path((A, *MOTIONS)).poses(np.zeros(len(MOTIONS)))
    np.testing.assert_array_equal(zero, A)


def test_select_refuses_the_name_of_a_frame_instead_of_a_chain() -> None:
    robot = urdfkin.load("planar_two_link")
    with pytest.raises(InputError, match="path must be a result of `chain` or `dh`: found 'tip'"):
        robot.select("tip", [0.1, 0.2])  # type: ignore[arg-type]


def test_an_overflow_or_a_number_that_is_not_finite_is_an_error_in_each_form_of_a_path() -> None:
    slides = [
        urdfs.joint(f"x{i}", "prismatic", f"l{i}", f"l{i + 1}", "", "1 0 0", urdfs.limit()) for i in range(2)
    ]
    end = urdfs.joint("end", "fixed", "l2", "tip", 'xyz="1 2 3" rpy="0.1 0.2 0.3"', "")
    robot = urdfs.built(*slides, end, verify=False)
    path, table = robot.chain("tip"), robot.dh("tip")
    calls = (path.placement, path.axes, path.origins, table.placement, table.frames)
    for call in (*calls, robot.screws("tip").placement, robot.tree_parameters().placements):
        assert np.isfinite(call(np.full(2, 1e300))).all()
        with pytest.raises(RangeError, match="leaves the range"):
            call(np.full(2, 1.7e308))
    for call in (*calls, robot.screws("tip").placement):
        for bad in (np.nan, np.inf):
            with pytest.raises(NotFiniteError, match=f"x1: q must be finite: found {bad}"):
                call(np.array([[0.0, 1.0], [0.0, bad]]))
