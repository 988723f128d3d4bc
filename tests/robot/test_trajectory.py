"""The velocities of a line are its derivatives; a table is read exactly or rejected with the place."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from tests.urdfs import built, joint
from urdfkin.errors import InputError, RangeError, SourceError
from urdfkin.robot import Robot
from urdfkin.robot.trajectory import Trajectory, make_line_trajectory, read_columns, read_trajectory

PARTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
JOINTS = [f"{part}_joint" for part in PARTS]
END = np.array([1.0, -1.2, 0.8, 0.4, -0.3, 2.0])


@pytest.fixture(scope="module")
def robot() -> Robot:
    return urdfkin.load("ur5")


def test_a_line_starts_and_ends_at_rest_and_is_halfway_at_half_time(robot: Robot) -> None:
    x = make_line_trajectory(robot, robot.neutral(), END, 2.0, 101)
    np.testing.assert_array_equal(x.q[0], robot.neutral())
    np.testing.assert_allclose(x.q[-1], END, rtol=1e-15)
    np.testing.assert_allclose(x.q[50], END / 2, rtol=1e-15)
    for ends in (x.v, x.a):
        assert not ends[[0, -1]].any()
    assert not x.q.flags.writeable


def test_velocities_and_accelerations_of_a_line_are_derivatives(robot: Robot) -> None:
    # The error of fourth-order differences of a quintic is h^4 times the fifth derivative.
    x = make_line_trajectory(robot, robot.neutral(), END, 1.5, 401)
    h = x.t[1]
    for values, rates in ((x.q, x.v), (x.v, x.a)):
        slopes = (values[:-4] - 8 * values[1:-3] + 8 * values[3:-1] - values[4:]) / (12 * h)
        np.testing.assert_allclose(slopes, rates[2:-2], atol=1e-6)


@pytest.mark.parametrize(("duration", "samples"), [(0.0, 10), (-1.0, 10), (float("nan"), 10), (1.0, 2)])
def test_a_line_without_a_positive_duration_or_enough_samples_is_refused(
    robot: Robot, duration: float, samples: int
) -> None:
    with pytest.raises(InputError, match="duration"):
        make_line_trajectory(robot, robot.neutral(), END, duration, samples)


def test_a_line_between_batches_of_configurations_is_refused(robot: Robot) -> None:
    with pytest.raises(InputError, match=r"one start and one end: found shapes \(3, 6\), \(6,\)"):
        make_line_trajectory(robot, robot.sample(3), END, 1.0, 3)


@pytest.mark.parametrize("duration", [1e-150, 1e300])
def test_a_line_has_finite_velocities_or_is_refused(robot: Robot, duration: float) -> None:
    x = make_line_trajectory(robot, robot.neutral(), END, duration, 5)
    assert np.isfinite(x.v).all()
    assert np.isfinite(x.a).all()
    with pytest.raises(RangeError, match="the duration is too short: found 1e-160 s"):
        make_line_trajectory(robot, robot.neutral(), END, 1e-160, 5)


def test_a_line_may_take_the_largest_duration(robot: Robot) -> None:
    x = make_line_trajectory(robot, robot.neutral(), END, 1e308, 3)
    assert x.t[-1] == 1e308
    assert not x.a.any()


@pytest.mark.parametrize("root", ["floating", "planar"])
def test_velocities_on_a_line_of_a_floating_base_are_derivatives_of_frame_positions(root: str) -> None:
    robot = urdfkin.load("a1", root_joint=root, verify=False)
    ends = robot.sample(2, seed=8)
    x = make_line_trajectory(robot, ends[0], ends[1], 2.0, 2001)
    np.testing.assert_allclose(robot.difference(x.q[-1], ends[1]), 0.0, atol=1e-13)
    p = robot.placement(x.q, "FL_foot")[:, :3, 3]
    h = x.t[1] - x.t[0]
    slopes, seconds = (p[2:] - p[:-2]) / (2.0 * h), (p[2:] - 2.0 * p[1:-1] + p[:-2]) / h**2
    np.testing.assert_allclose(robot.velocity(x.q, x.v, "FL_foot")[1:-1, :3], slopes, atol=2e-4)
    np.testing.assert_allclose(robot.acceleration(x.q, x.v, x.a, "FL_foot")[1:-1, :3], seconds, atol=2e-3)


Columns = dict[str, np.ndarray]
Read = Callable[[Columns], Trajectory]


def write(path: Path, columns: Columns) -> Path:
    rows = [",".join(columns)]
    rows += [",".join(repr(float(x)) for x in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join(rows))
    return path


@pytest.fixture
def read(robot: Robot, tmp_path: Path) -> Read:
    """A function that writes a table and reads it."""
    return lambda columns: read_trajectory(robot, write(tmp_path / "x.csv", columns))


@pytest.fixture(scope="module")
def direct(robot: Robot) -> Trajectory:
    return make_line_trajectory(robot, robot.neutral(), END, 2.0, 41)


def columns_of(x: Trajectory, letters: str = "") -> Columns:
    """Return the columns of t and q, and of the rates with these letters, of the robot ur5."""
    names = ["t", *JOINTS, *(f"{letter}:{name}" for letter in letters for name in JOINTS)]
    values = [x.t[:, np.newaxis], x.q, *(getattr(x, letter) for letter in letters)]
    return dict(zip(names, np.hstack(values).T, strict=True))


def test_a_trajectory_table_with_velocities_is_read_back_exactly_in_any_column_order(
    direct: Trajectory, read: Read
) -> None:
    x = read(dict(sorted(columns_of(direct, "va").items(), reverse=True)))
    for ours, theirs in ((x.t, direct.t), (x.q, direct.q), (x.v, direct.v), (x.a, direct.a)):
        np.testing.assert_array_equal(ours, theirs)
    assert x.rates_source == "as given"


def test_velocities_missing_in_a_trajectory_table_are_central_differences(
    direct: Trajectory, read: Read
) -> None:
    x = read(columns_of(direct))
    np.testing.assert_allclose(x.v[2:-2], direct.v[2:-2], atol=0.02)
    np.testing.assert_allclose(x.a[4:-4], direct.a[4:-4], atol=0.15)
    assert x.rates_source == "by central differences"


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda text: text.replace("elbow_joint", "elbow"), r"x.csv:1: .* unknown: elbow"),
        (
            lambda text: text.replace("elbow_joint", "wrist_1_joint"),
            r"x.csv:1: .* missing: elbow_joint; duplicate: wrist_1_joint",
        ),
        (
            lambda text: "\n".join(row.rpartition(",")[0] for row in text.splitlines()),
            "missing: wrist_3_joint",
        ),
        (lambda text: text.replace("\n0.1,", "\n9.1,"), "time must increase"),
        (lambda text: text.replace("\n0.1,", "\nnan,"), "not a finite number"),
        (lambda text: text.replace("\n0.1,", "\n0.1,,"), r"x.csv:4: 7 numbers are expected .*: found 8"),
        (lambda text: "\n".join(text.splitlines()[:3]), "at least 3 samples"),
    ],
)
def test_an_invalid_or_missing_trajectory_table_is_refused_with_the_reason(
    spoil: Callable[[str], str], message: str, robot: Robot, direct: Trajectory, tmp_path: Path
) -> None:
    path = write(tmp_path / "x.csv", columns_of(direct))
    path.write_text(spoil(path.read_text()))
    with pytest.raises(InputError, match=message):
        read_trajectory(robot, path)
    path.unlink()
    with pytest.raises(SourceError, match="no such file"):
        read_trajectory(robot, path)


@pytest.mark.parametrize("samples", [41, 100, 1001])
def test_the_estimated_errors_of_central_differences_are_near_the_true_errors(
    samples: int, robot: Robot, read: Read
) -> None:
    direct = make_line_trajectory(robot, robot.neutral(), END, 2.0, samples)
    found = read(columns_of(direct))
    assert found.errors is not None
    for estimate, ours, theirs in zip(found.errors, (found.v, found.a), (direct.v, direct.a), strict=True):
        assert 0.5 < estimate / np.abs(ours - theirs).max() < 2.0
    assert "largest errors about" in found.derivation()


def test_missing_accelerations_are_differences_of_the_given_velocities(
    direct: Trajectory, read: Read
) -> None:
    found = read(columns_of(direct, "v"))
    np.testing.assert_array_equal(found.v, direct.v)
    np.testing.assert_array_equal(found.a, np.gradient(direct.v, direct.t, axis=0, edge_order=2))
    assert found.rates_source == "v as given, a by central differences of v"
    with pytest.raises(InputError, match="joint accelerations need joint velocities"):
        read(columns_of(direct, "a"))


def test_times_too_large_for_the_time_steps_are_reported(direct: Trajectory, read: Read) -> None:
    (note,) = read(columns_of(direct) | {"t": 1.7e9 + direct.t}).notes
    assert "subtract the first time from all times" in note


#: Headings of a column, by the value of 30 in SI units. The name of the joint `wheel_deg` ends like a unit.
HEADINGS = {
    30.0: ("elbow", "q:elbow", "elbow [rad]", "elbow_rad", "wheel_deg", "a:elbow [rad/s²]", "Time"),
    np.pi / 6: (
        *("elbow [deg]", "elbow (degrees)", "elbow[°]", "elbow_deg", "wheel_deg_deg", "v:elbow [deg/s]"),
        *("v:elbow_deg_per_s", "a:elbow [deg/s^2]", "a:elbow_deg_s2"),
    ),
    0.03: ("lift_mm", "lift [mm]", "timestamp [ms]"),
    3e-8: ("time_ns",),
}


@pytest.mark.parametrize(
    ("heading", "value"), [(heading, value) for value, headings in HEADINGS.items() for heading in headings]
)
def test_a_column_heading_may_end_with_a_unit(heading: str, value: float) -> None:
    units = {"t": "s", "elbow": "rad", "lift": "m", "wheel_deg": "rad"}
    units |= {"v:elbow": "rad/s", "a:elbow": "rad/s^2"}
    (found,) = read_columns(f"{heading}\n30\n", "x.csv", "q", [], list(units), units=units).values()
    assert found.tolist() == [value]


@pytest.mark.parametrize(
    ("head", "columns"),
    [
        ("# b,a", {"b": [1.0], "a": [2.0]}),
        ("# measured\n#b_deg, a\n", {"b": [math.radians(1.0)], "a": [2.0]}),
        ("# a, c", {"a": [1.0], "b": [2.0]}),
        ("# b,a\na,b", {"a": [1.0], "b": [2.0]}),
        ("# b", {"a": [1.0], "b": [2.0]}),
    ],
)
def test_a_comment_names_the_columns_only_if_it_names_exactly_the_columns(
    head: str, columns: dict[str, list[float]]
) -> None:
    units = {"a": "rad", "b": "rad"}
    found = read_columns(f"{head}\n1,2\n", "x.csv", "q", ["a", "b"], units=units)
    assert {name: x.tolist() for name, x in found.items()} == columns
    with pytest.raises(InputError, match=r"x\.csv:1, b_m: wrong unit"):
        read_columns("# b_m,a\n1,2\n", "x.csv", "q", ["a", "b"], units=units)


def test_a_joint_may_have_the_name_of_a_time_column() -> None:
    found = read_columns("t,time\n1,2\n", "x.csv", "q", ["time"], ["t"], units={"t": "s", "time": "rad"})
    assert {name: x.tolist() for name, x in found.items()} == {"t": [1.0], "time": [2.0]}


@pytest.mark.parametrize("name", ["t", "v:b"])
def test_a_joint_with_the_name_of_another_column_is_refused(name: str, tmp_path: Path) -> None:
    arm = built(joint(name, "continuous", "l0", "l1"), joint("b", "continuous", "l1", "l2"), verify=False)
    log = write(tmp_path / "x.csv", {name: np.arange(3.0), "b": np.zeros(3)})
    with pytest.raises(InputError, match=f"also the name of another column: found {name}; use an .npz file"):
        read_trajectory(arm, log)


@pytest.mark.parametrize(
    ("heading", "remedy"),
    [
        ("elbow [mm]", "use rad or deg"),
        ("lift_deg", "use m or mm"),
        ("v:elbow [rad/s^2]", "use rad/s or deg/s"),
        ("elbow [pi]", "use rad or deg"),
        ("root.qx [rad]", "use no unit"),
        ("time_deg", "use s, sec"),
    ],
)
def test_a_wrong_unit_is_refused_with_the_valid_units(heading: str, remedy: str) -> None:
    units = {"t": "s", "elbow": "rad", "lift": "m", "v:elbow": "rad/s", "root.qx": ""}
    with pytest.raises(InputError, match=f"wrong unit: found .*{remedy}"):
        read_columns(f"{heading}\n30\n", "x.csv", "q", [], list(units), units=units)


def test_a_trajectory_table_in_a_convention_is_converted_to_the_same_motion(tmp_path: Path) -> None:
    robot = urdfkin.load("a1", root_joint="floating", verify=False)
    start, end = robot.sample(2, seed=8)
    x = make_line_trajectory(robot, start, end, 2.0, 31)
    mujoco = robot.convention("mujoco")
    names = [
        *mujoco.coordinate_names,
        *(f"{letter}:{name}" for letter in "va" for name in mujoco.velocity_names),
    ]
    columns = {"time": x.t} | dict(zip(names, np.hstack(mujoco.to(x.q, x.v, x.a)).T, strict=True))
    path = write(tmp_path / "x.csv", columns)
    found = urdfkin.read_trajectory(robot, path, convention="mujoco")
    for ours, theirs in ((found.q, x.q), (found.v, x.v), (found.a, x.a)):
        np.testing.assert_allclose(ours, theirs, atol=1e-13)
    del columns["FL_hip_joint"]
    with pytest.raises(InputError, match="in the convention mujoco: found missing: FL_hip_joint"):
        urdfkin.read_trajectory(robot, write(path, columns), convention="mujoco")
