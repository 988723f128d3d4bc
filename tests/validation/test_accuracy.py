"""The accuracy study reads decimals exactly, has fifty right digits, and finds errors of a few units."""

import re
from collections.abc import Iterator

import numpy as np
import pytest
from flint import arb

import urdfkin
from scripts import make_pages
from tests.high_precision import mp as independent
from tests.high_precision import rate, second_rate
from tests.laws.subjects import robot_of
from tests.text.robots import motion
from urdfkin import BaseMotion
from urdfkin.compiled import evaluate
from urdfkin.errors import InputError
from urdfkin.kinematics import equations as eq
from urdfkin.kinematics.rotation import EULER_SEQUENCES, quaternion_of
from urdfkin.model import base_motion as recursion_base
from urdfkin.model.configuration import draw_base_motion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.report.words import accuracy_words, more_accurate, more_accurate_counts
from urdfkin.system.documents import as_json_data
from urdfkin.validation import accuracy
from urdfkin.validation.accuracy import AccuracyLine, AccuracyStudy, Errors, accuracy_study, exact_quaternion
from urdfkin.verify.analytical_reference import euler_jacobian, quaternion_jacobian
from urdfkin.verify.exact import recursion as exact_recursion
from urdfkin.verify.exact.numbers import as_interval, precision, read_exact_joints
from urdfkin.verify.oracle import BaseRows
from urdfkin.verify.quantities import QUANTITIES

#: Arms, a hand with mimic joints, humanoids, a quadruped, a mobile base, CAD exports.
ROBOTS = (
    "panda", "ur5", "xarm7", "kinova", "allegro_left_hand", "tiago_pro", "talos", "icub", "anymal", "so100",
    "polar",
)  # fmt: skip


@pytest.fixture(autouse=True)
def many_digits() -> Iterator[None]:
    with precision(80):
        yield


def check_errors(study: AccuracyStudy) -> None:
    for line in study.lines:
        assert max(line.urdfkin.worst, line.pinocchio.worst) < 40.0, line


def is_worse(line: AccuracyLine) -> bool:
    """Return whether urdfkin's worst or typical error is more than twice Pinocchio's."""
    ours, theirs = line.urdfkin, line.pinocchio
    return ours.worst > 2.0 * theirs.worst or ours.typical > 2.0 * theirs.typical


def slightly_larger(monkeypatch: pytest.MonkeyPatch, name: str, units: float) -> None:
    """Multiply the results of a function by 1 + units * eps."""
    right = getattr(evaluate, name)
    factor = 1.0 + units * np.finfo(np.float64).eps
    monkeypatch.setattr(evaluate, name, lambda *args, **kwargs: right(*args, **kwargs) * factor)


def test_decimals_are_read_exactly_and_a_wrong_number_of_bases_is_refused() -> None:
    robot = urdfkin.load("planar_two_link")
    joints = read_exact_joints(robot.urdf, robot.tree)
    assert abs(5 * joints[2].p[0] - 2) < 1e-78
    assert not joints[2].p[0].contains(0.4)
    with pytest.raises(InputError, match="base: wrong batch shape; give one motion, or 2"):
        accuracy_study(urdfkin.load("polar"), samples=2, base=draw_base_motion(3, np.random.default_rng(1)))


def test_exact_velocity_and_acceleration_of_the_elbow_are_derivatives_to_many_digits() -> None:
    # The independent computation has the doubles 0.6, 0.5 and 0.45, so the text gets these doubles, too.
    moving = motion("elbow", 12)
    text = urdfkin.load("elbow").urdf
    for word in ("0.6", "0.5", "0.45"):
        text = text.replace(f" {word}", f" {independent.nstr(independent.mpf(float(word)), 60)}")
        text = text.replace(f'"{word}', f'"{independent.nstr(independent.mpf(float(word)), 60)}')
    tree = urdfkin.load("elbow").tree
    motion_of = exact_recursion.compute_motion(
        tree, read_exact_joints(text, tree), moving.q, moving.v, moving.a
    )
    state = motion_of.states[tree.link_index("wrist")]
    # The independent computation differentiates with a step of 1e-18 at 60 digits.
    for found, derivative, room in (
        (state.p, moving.d(6)(0), 1e-45),
        (state.vel, rate(moving.d(6), 0.0), 1e-33),
        (state.acc, second_rate(moving.d(6), 0.0), 1e-22),
    ):
        for row in range(3):
            assert abs(found[row] - derivative[row]) < room


def test_the_exact_jacobian_rate_is_the_difference_quotient_of_the_jacobian() -> None:
    moving = motion("polar", 13)
    step = 2.0**-50
    robot = urdfkin.load("polar")
    joints, link = read_exact_joints(robot.urdf, robot.tree), robot.tree.link_index("slider")

    def at(t: float) -> exact_recursion.ExactMotion:
        q = [as_interval(x) + t * as_interval(rate) for x, rate in zip(moving.q, moving.v, strict=True)]
        return exact_recursion.compute_motion(robot.tree, joints, q, moving.v, moving.v)

    for reference in Reference:
        ahead, behind = (exact_recursion.jacobian_values(at(t), link, reference).T for t in (step, -step))
        found = exact_recursion.jacobian_rate_values(at(0.0), link, reference).T
        for column, after, before in zip(found, ahead, behind, strict=True):
            for x, late, early in zip(column, after, before, strict=True):
                assert abs(x - (late - early) / (2 * step)) < 1e-25


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "root_joint"), [("ur3_gripper", None), ("anymal", "floating"), ("solo8", "planar")]
)
def test_errors_are_small_with_mimic_joints_and_free_joints(name: str, root_joint: str | None) -> None:
    check_errors(accuracy_study(urdfkin.load(name, root_joint=root_joint), samples=1))


@pytest.mark.long
def test_an_error_of_sixteen_units_in_the_last_place_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    right = {line.quantity: line for line in accuracy_study(urdfkin.load("ur5"), samples=2).lines}
    slightly_larger(monkeypatch, "placements", 16.0)
    found = {line.quantity: line for line in accuracy_study(urdfkin.load("ur5"), samples=2).lines}
    assert not is_worse(right["placement"])
    assert is_worse(found["placement"])
    assert found["placement"].urdfkin.worst == pytest.approx(16.0, rel=0.2)
    assert found["placement"].pinocchio == right["placement"].pinocchio


@pytest.mark.long
def test_equal_seeds_give_equal_studies() -> None:
    first, again = (accuracy_study(urdfkin.load("polar"), samples=3, seed=4) for _ in range(2))
    assert first == again
    assert first != accuracy_study(urdfkin.load("polar"), samples=3, seed=5)


def test_the_digits_of_true_values_grow_with_joints_before_a_link(monkeypatch: pytest.MonkeyPatch) -> None:
    # 15 digits are too few for 20 joints, as 50 digits are for 200 joints.
    monkeypatch.setattr(accuracy, "REFERENCE_DIGITS", 15)
    check_errors(accuracy_study(urdfkin.load(make_pages.make_askew_chain(20), verify=False), samples=1))


@pytest.mark.parametrize(("name", "samples"), [("fixed_only", 1), ("single_link", 1), ("one_joint", 0)])
def test_a_study_without_moving_joints_or_samples_has_the_same_lines(name: str, samples: int) -> None:
    lines = accuracy_study(robot_of(name), samples=samples).lines
    assert len(lines) == 15
    assert all(line.numbers == 0 for line in lines if "jacobian" in line.quantity)


@pytest.mark.long
@pytest.mark.parametrize("name", ROBOTS)
def test_the_errors_of_urdfkin_are_at_most_twice_those_of_pinocchio(name: str) -> None:
    for line in accuracy_study(urdfkin.load(name), samples=5).lines:
        assert not is_worse(line), line


# -- a base that moves ---------------------------------------------------------------------------------


def test_a_moving_base_equals_a_floating_joint_with_the_same_motion() -> None:
    # The velocities of the floating joint are in the child link's axes: u = R^T vel, o = R^T w.
    base, robot = draw_base_motion(1, np.random.default_rng(3)), robot_of("tree_3")
    hung = robot_of("tree_3", root_joint="floating")
    generator = np.random.default_rng(4)
    q = robot.sample(1, 4)[0]
    v, a = generator.standard_normal((2, robot.nv))
    T, six, six_2 = base.placement[0], base.velocity[0], base.acceleration[0]
    root = exact_recursion.make_base_state(BaseRows(T, six, six_2))
    back = eq.transposed(root.R)
    u, o = eq.rotate(back, root.vel), eq.rotate(back, root.w)
    u_rate = eq.rotate(back, eq.minus(root.acc, eq.cross(root.w, root.vel)))
    o_rate = eq.rotate(back, root.alpha)
    quaternion = exact_quaternion(np.array([root.R], dtype=object), quaternion_of(T[:3, :3])[np.newaxis])[0]
    on_base = exact_recursion.compute_motion(
        robot.tree, read_exact_joints(robot.urdf, robot.tree), q, v, a, base=root
    )
    free = ([*root.p, *quaternion], [*u, *o], [*u_rate, *o_rate])
    full = ([*first, *rest] for first, rest in zip(free, (q, v, a), strict=True))
    afloat = exact_recursion.compute_motion(hung.tree, read_exact_joints(hung.urdf, hung.tree), *full)
    for link, name in enumerate(robot.tree.links):
        there = hung.tree.link_index(name)
        for reference in Reference:
            for quantity in ("placement", "velocity", "acceleration"):
                one = QUANTITIES[quantity].enclose(on_base, link, reference)
                other = QUANTITIES[quantity].enclose(afloat, there, reference)
                assert (abs(one - other) < 1e-40).all(), (name, quantity, reference)
            rate = QUANTITIES["jacobian rate"].enclose
            one, other = rate(on_base, link, reference), rate(afloat, there, reference)
            assert (abs(one - other[:, 6:]) < 1e-40).all(), (name, reference)


@pytest.mark.long
@pytest.mark.parametrize(("name", "root_joint"), [("ur3_gripper", None), ("polar", "planar")])
def test_errors_are_small_on_a_moving_base(name: str, root_joint: str | None) -> None:
    robot = urdfkin.load(name, root_joint=root_joint)
    still = accuracy_study(robot, samples=2)
    for base in (draw_base_motion(2, np.random.default_rng(1)), BaseMotion(velocity=np.arange(6.0))):
        moving = accuracy_study(robot, samples=2, base=base)
        assert moving.moving_base
        assert len(moving.lines) == len(still.lines)
        assert moving.lines != still.lines
        check_errors(moving)


@pytest.mark.long
def test_a_base_motion_that_differs_slightly_in_one_library_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, base = urdfkin.load("ur5"), draw_base_motion(2, np.random.default_rng(1))
    original = recursion_base.BaseMotion.state

    def off(self: BaseMotion, batch_shape: tuple[int, ...]) -> FloatArray:
        return original(self, batch_shape) * (1.0 + 1e-13)

    monkeypatch.setattr(recursion_base.BaseMotion, "state", off)
    lines = accuracy_study(robot, samples=2, base=base).lines
    assert all(is_worse(line) for line in lines if line.quantity != "analytical jacobian")
    assert max(line.pinocchio.worst for line in lines) < 40.0


# -- analytical Jacobians ------------------------------------------------------------------------------


def angles(name: str, R: object) -> list[object]:
    """Return the angles of a rotation at 50 digits, as the textbook (ZYZ) and URDF (xyz) define them."""
    x, y, z = (tuple(row) for row in R)  # type: ignore[attr-defined]
    if name == "ZYZ":  # Rz(phi) Ry(theta) Rz(psi)
        return [arb.atan2(y[2], x[2]), z[2].acos(), arb.atan2(z[1], -z[0])]
    return [arb.atan2(z[1], z[2]), -z[0].asin(), arb.atan2(y[0], x[0])]  # xyz: roll, pitch, yaw


@pytest.mark.long
@pytest.mark.parametrize("name", ["ZYZ", "xyz", "quaternion"])
def test_the_exact_analytical_jacobian_is_the_difference_quotient_of_the_pose(name: str) -> None:
    robot = urdfkin.load("panda")
    joints, link = read_exact_joints(robot.urdf, robot.tree), robot.tree.frame_link("panda_hand")
    q, zeros, step = robot.sample(1, 5)[0], [0] * robot.nv, 2.0**-60

    def at(column: int, off: float) -> exact_recursion.ExactMotion:
        numbers = [as_interval(x) + (off if i == column else 0) for i, x in enumerate(q)]
        return exact_recursion.compute_motion(robot.tree, joints, numbers, zeros, zeros)

    def pose(column: int, off: float) -> list[object]:
        state = at(column, off).states[link]
        if name != "quaternion":
            return [*state.p, *angles(name, state.R)]
        return [*state.p, *exact_quaternion(np.array([state.R], dtype=object), near)[0]]

    here = at(0, 0)
    R = np.array(here.states[link].R, dtype=object)
    near = quaternion_of(R.astype(float))[np.newaxis]
    J_v = QUANTITIES["jacobian"].enclose(here, link, Reference.LOCAL_WORLD_ALIGNED)
    if name == "quaternion":
        J = quaternion_jacobian(exact_quaternion(R[np.newaxis], near), J_v[np.newaxis])[0]
    else:
        J = euler_jacobian(name, R[np.newaxis], J_v[np.newaxis])[0][0]
    for column in range(robot.nv):
        for row, (late, early) in enumerate(zip(pose(column, step), pose(column, -step), strict=True)):
            assert abs(J[row, column] - (late - early) / (2 * step)) < 1e-28  # type: ignore[operator]


@pytest.mark.parametrize("name", [name for name in EULER_SEQUENCES if name.islower()])
def test_angles_about_fixed_axes_have_the_rows_of_euler_angles_in_reverse_order(name: str) -> None:
    robot = urdfkin.load("panda", verify=False)
    q = robot.sample(5, 0)
    both = (name, name.upper()[::-1])
    fixed, euler = (robot.analytical_jacobian(q, "panda_hand", each) for each in both)
    assert (fixed[:, :3] == euler[:, :3]).all()
    assert (fixed[:, 3:] == euler[:, :2:-1]).all()


@pytest.mark.long
def test_an_error_of_the_analytical_jacobians_is_found_in_every_representation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot = urdfkin.load("ur5")

    def lines() -> dict[str | None, AccuracyLine]:
        return {x.reference: x for x in accuracy_study(robot, samples=2).lines if x.quantity == quantity}

    quantity = "analytical jacobian"
    right = lines()
    slightly_larger(monkeypatch, "jacobians", 64.0)
    found = lines()
    assert set(right) == set(found) == {"euler angles", "quaternion"}
    for name, line in right.items():
        assert line.urdfkin.worst < 5.0
        assert line.pinocchio.worst < 5.0
        assert is_worse(found[name])
        assert found[name].pinocchio == line.pinocchio
    # Two samples of eleven links with up to six columns, in twelve sequences; singular samples are left out.
    assert 1000 < right["euler angles"].numbers < 2 * 11 * 6 * 6 * 12


def test_errors_are_equal_only_if_they_are_the_same_double() -> None:
    def line(ours: float, theirs: float) -> AccuracyLine:
        return AccuracyLine("placement", "", 9, Errors(1.0, ours), Errors(1.0, theirs))

    study = AccuracyStudy("arm", 1, 0, (line(0.1, 0.2), line(0.2, 0.2), line(0.3, 0.2), line(0.1, 0.1)))
    lines = as_json_data(study)["lines"]
    assert [more_accurate(one) for one in lines] == ["urdfkin", "equal", "Pinocchio", "equal"]
    counts = "urdfkin is more accurate in 1 of 4 lines, equal in 2, less accurate in 1"
    assert more_accurate_counts(lines) == counts
    assert accuracy_words(as_json_data(study)) == f"1 sample; {counts}"
    assert f"\n{counts}. " in make_pages.format_studies({"arm": study})["counts"]


def test_the_page_marks_the_equal_results_of_polar() -> None:
    lines = as_json_data(accuracy_study(urdfkin.load("polar"), samples=make_pages.SAMPLES))["lines"]
    table = make_pages.page_path("accuracy").read_text("utf-8").partition("## polar")[2].partition("## ")[0]
    rows = re.findall(r"\| ([\d.]+) \| ([\d.]+) \|$", table, re.M)
    assert [ours == theirs for ours, theirs in rows] == [more_accurate(line) == "equal" for line in lines]
