"""Files of a calibration: measured poses, the factory calibration of a Universal Robots arm, the new URDF."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests import urdfs
from tests.calibration.arms import BRANCHED, pose
from tests.cli.running import urdfkin
from tests.reading import present
from tests.urdfs import joint, limit
from urdfkin.calibration.calibrate import as_pose_array, read_poses
from urdfkin.calibration.universal_robots import (
    PARENT_JOINTS,
    apply_factory_calibration,
    largest_tip_displacement,
    make_calibrated_tree,
    read_calibrated_origins,
)
from urdfkin.calibration.write_back import nearest_rpy, with_origins
from urdfkin.dh.rows import table_from_rows
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.rotation import euler_of, quaternion_of, rotation_from_rpy
from urdfkin.model.chain import make_chain
from urdfkin.model.path import elementary_pose
from urdfkin.model.tree import FloatArray
from urdfkin.robot.loading import load
from urdfkin.system.files import Edit, apply_edits

NAMES = ("a", "b")
Q = np.array([[0.1, 0.2], [0.3, 0.4], [-0.5, 0.6]])
T = np.stack([pose(k, 1.0) for k in range(3)])


def csv(path: Path, header: str, rows: FloatArray) -> Path:
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.17g")
    return path


def test_every_format_of_measured_poses_is_read_equally(tmp_path: Path) -> None:
    quat, p = quaternion_of(T[:, :3, :3]), T[:, :3, 3]
    columns = "qw,qx,qy,qz,x,y,z,b,a"
    rows = np.hstack([np.roll(quat, 1, axis=1), p, Q[:, ::-1]])
    matrices = ",".join(f"T{i}{j}" for i in range(4) for j in range(4))
    np.savez(tmp_path / "T.npz", q=Q, T=T)
    np.savez(tmp_path / "p.npz", q=Q, p=1e3 * p, quat=quat)
    for path, unit in (
        (csv(tmp_path / "quat.csv", columns, rows), "m"),
        (csv(tmp_path / "T.csv", f"a,b,{matrices}", np.hstack([Q, T.reshape(3, 16)])), "m"),
        (tmp_path / "T.npz", "m"),
        (tmp_path / "p.npz", "mm"),
    ):
        q, found = read_poses(path, NAMES, NAMES, unit)
        assert (q == Q).all()
        np.testing.assert_allclose(found, T, atol=1e-15)


@pytest.mark.parametrize("before", ["", "\ufeff", "  # one, two\n", '"# one, two"\n', "  \n\n"])
def test_quoted_headings_comments_and_empty_lines_do_not_hide_the_columns_of_matrices(
    before: str, tmp_path: Path
) -> None:
    names = ["a", "b", *(f"T{i}{j}" for i in range(4) for j in range(4))]
    header = before + ",".join(f'"{name}"' for name in names)
    q, found = read_poses(csv(tmp_path / "T.csv", header, np.hstack([Q, T.reshape(3, 16)])), NAMES, NAMES)
    assert (q == Q).all()
    np.testing.assert_allclose(found, T, atol=1e-15)


def test_a_quaternion_with_few_digits_is_normalised(tmp_path: Path) -> None:
    quat = quaternion_of(T[:, :3, :3])
    rows = np.hstack([quat * 1.0009, T[:, :3, 3], Q])
    found = read_poses(csv(tmp_path / "long.csv", "qx,qy,qz,qw,x,y,z,a,b", rows), NAMES, NAMES)[1]
    np.testing.assert_allclose(found, T, atol=1e-15)


def test_files_with_positions_only_are_read_as_positions(tmp_path: Path) -> None:
    path = csv(tmp_path / "p.csv", "a,x,y,z", np.hstack([Q[:, :1], 1e3 * T[:, :3, 3]]))
    q, p = read_poses(path, NAMES, ("a",), "mm")
    assert (q == Q * [1.0, 0.0]).all()
    np.testing.assert_allclose(p, T[:, :3, 3], atol=1e-15)
    np.savez(tmp_path / "p.npz", q=Q, p=T[:, :3, 3])
    assert (read_poses(tmp_path / "p.npz", NAMES, NAMES)[1] == T[:, :3, 3]).all()


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("a,b,x,y", "missing: z"),
        ("a,x,y,z", "missing: b"),
        ("a,b,x,y,z,qw", "no qx, qy, qz"),
        ("a,b,x,y,z,roll", "unknown: roll"),
        ("a,b,x,y,z,qx,qy,qz,qw", "length 2"),
        ("a,b,T00,T01,T02,T03,T10,T11,T12,T13,T20,T21,T22,T23", "a pose must be a rotation"),
    ],
)
def test_wrong_columns_of_poses_are_reported(header: str, words: str, tmp_path: Path) -> None:
    path = csv(tmp_path / "x.csv", header, np.ones((2, header.count(",") + 1)))
    with pytest.raises(InputError) as error:
        read_poses(path, NAMES, NAMES)
    assert words in str(error.value)


@pytest.mark.parametrize("name", ["x", "qw"])
def test_a_coordinate_with_the_name_of_a_pose_column_is_refused_for_positions_only(
    name: str, tmp_path: Path
) -> None:
    for header in ("x,y,z", "a,x,y,z", f"{name},x,y,z,qx,qy,qz,qw"):
        path = csv(tmp_path / "x.csv", header, np.ones((2, header.count(",") + 1)))
        with pytest.raises(
            InputError, match=f"have the same name: found {name}; give the poses as the columns T00"
        ):
            read_poses(path, (name,), (name,))
    matrices = ",".join(f"T{i}{j}" for i in range(3) for j in range(4))
    path = csv(tmp_path / "T.csv", f"{name},{matrices}", np.hstack([Q[:, :1], T[:, :3].reshape(3, 12)]))
    q, found = read_poses(path, (name,), (name,))
    assert (q == Q[:, :1]).all()
    np.testing.assert_allclose(found, T, atol=1e-15)


def test_transposed_poses_are_refused_in_every_form(tmp_path: Path) -> None:
    transposed = np.stack([elementary_pose(2, True, 0.0)] * 3)
    transposed[:, 3, :3] = T[:, :3, 3]
    header = f"a,b,{','.join(f'T{i}{j}' for i in range(4) for j in range(4))}"
    file = csv(tmp_path / "T.csv", header, np.hstack([Q, transposed.reshape(3, 16)]))
    np.savez(tmp_path / "T.npz", q=Q, T=transposed)
    for path in (file, tmp_path / "T.npz"):
        with pytest.raises(InputError, match=r"pose 0: a pose must be .*, with the last row 0 0 0 1"):
            read_poses(path, NAMES, NAMES)
    with pytest.raises(InputError, match="with the last row 0 0 0 1"):
        as_pose_array(transposed)


def test_wrong_arrays_of_poses_are_reported(tmp_path: Path) -> None:
    np.savez(tmp_path / "x.npz", q=Q, T=T, p=T[:, :3, 3])
    with pytest.raises(InputError, match=r"\(q, T\), \(q, p\) or \(q, p, quat\): found q, T, p"):
        read_poses(tmp_path / "x.npz", NAMES, NAMES)
    np.savez(tmp_path / "x.npz", q=Q, T=T, names=NAMES)
    with pytest.raises(InputError, match="unknown arrays or lacks an array: found unknown: names"):
        read_poses(tmp_path / "x.npz", NAMES, NAMES)


def test_the_csv_output_of_placement_is_read_as_measured_poses(tmp_path: Path) -> None:
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 2))
    (tmp_path / "q.csv").write_text("\n".join(f"{a!r},{b!r}" for a, b in q.tolist()))
    done = urdfkin("placement", "planar_two_link", "--q", f"@{tmp_path}/q.csv", "--format", "csv")
    lines = done.text.splitlines()
    names = ("joint_1", "joint_2")
    rows = [",".join([line, *map(repr, row)]) for line, row in zip(lines[1:], q.tolist(), strict=True)]
    (tmp_path / "poses.csv").write_text("\n".join([f"{lines[0]},{','.join(names)}", *rows]))
    assert (read_poses(tmp_path / "poses.csv", names, names)[0] == q).all()


# The factory's calibration of a Universal Robots arm, from the driver's YAML or the controller's table.


#: theta, d, a, alpha of a real UR10e, from the driver's documentation; d of the upper arm is 439 m.
CONTROLLER = np.array(
    [
        [-2.4147806894359e-07, 0.180539811714259, 2.12234865571206e-05, 1.57014608044242],
        [1.60233952386695, 439.140974079901, 0.0193171326277006, 0.0013941666682559],
        [-1.68607190752171, -446.027059806332, -0.569251663611088, 0.00693818880325995],
        [0.0837331147700119, 7.0603368964236, -4.61409023720934e-05, 1.56998468543761],
        [-1.01260355871158e-07, 0.119811341150314, -6.39280053471802e-05, -1.57038520649543],
        [3.91986209186124e-08, 0.115670917257426, 0.0, 0.0],
    ]
)
#: Ten times the rounding error (m) of a product with lengths of 446 m.
ROUNDING = 10.0 * 446.0 * np.finfo(float).eps
#: Nine lines of YAML that expand to a billion words.
BOMB = "\n".join(
    [
        "a0: &a0 [lol]",
        *(f"a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 9)}]" for k in range(9)),
        "kinematics: {shoulder: {x: *a9}}",
    ]
)
#: Origins of the joints in the description.
NOMINAL = (
    'xyz="0 0 0.1807"',
    'xyz="0 0 0" rpy="1.570796327 0 0"',
    'xyz="-0.6127 0 0"',
    'xyz="-0.57155 0 0.17415"',
    'xyz="0 -0.11985 0" rpy="1.570796327 0 0"',
    'xyz="0 0.11655 0" rpy="1.570796326589793 3.141592653589793 3.141592653589793"',
)


def drawn_in() -> list[FloatArray]:
    """Return the origins of the links, shifted along their axes as the driver does it."""
    S = [elementary_pose(2, True, theta) @ elementary_pose(2, False, d) for theta, d, _, _ in CONTROLLER]
    X = [elementary_pose(0, False, a) @ elementary_pose(0, True, alpha) for _, _, a, alpha in CONTROLLER]
    for i in (1, 2):
        M = S[i] @ X[i]
        along = -M[2, 3] / M[2, 2]
        x, y, _ = M[:3, 3] + along * M[:3, 2]
        theta = math.atan2(-y, -x)
        S[i] = elementary_pose(2, True, theta)
        X[i] = elementary_pose(0, False, -math.hypot(x, y)) @ elementary_pose(
            2, True, CONTROLLER[i, 0] - theta
        )
        X[i] = X[i] @ elementary_pose(0, True, CONTROLLER[i, 3])
        S[i + 1] = S[i + 1] @ elementary_pose(2, False, -along)
    return [S[0], *(X[i] @ S[i + 1] for i in range(5))]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    lines = ["kinematics:"]
    for link, T in zip(PARENT_JOINTS, drawn_in(), strict=True):
        six = [*T[:3, 3], *euler_of("XYZ", T[:3, :3])]
        named = zip(("x", "y", "z", "roll", "pitch", "yaw"), six, strict=True)
        # The driver writes the shortest digits; YAML 1.1 reads 1e-05 as a string.
        lines += [f"  {link}:", *(f"    {name}: {float(value):.16g}" for name, value in named)]
    path = tmp_path / "my_robot_calibration.yaml"
    path.write_text("\n".join([*lines, "  hash: calib_12788084448423163542", ""]))
    return path


def controller() -> DHTable:
    return table_from_rows(CONTROLLER[:, [2, 3, 1, 0]].tolist(), "standard")


def description(prefix: str) -> str:
    """Return the joints of the ROS description as a URDF."""
    half_turn, links = (
        f'rpy="0 0 {math.pi}"',
        ["base_link_inertia", *(f"{link}_link" for link in PARENT_JOINTS)],
    )
    parts = [
        joint("base_link-base_link_inertia", "fixed", "base_link", "base_link_inertia", half_turn, ""),
        joint("base_link-base_fixed_joint", "fixed", "base_link", "base", half_turn, ""),
    ]
    for name, parent, child, origin in zip(PARENT_JOINTS.values(), links, links[1:], NOMINAL, strict=False):
        parts.append(joint(name, "revolute", parent, child, origin, more=limit(-6.28, 6.28)))
    text = urdfs.robot(*parts, joint("flange-tool0", "fixed", links[-1], "tool0", axis=""))
    return re.sub(r' (name|link)="', rf' \1="{prefix}', text)


def test_the_driver_and_a_urdf_apply_roll_pitch_yaw_in_different_orders(file: Path) -> None:
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (50, 6))
    true = controller().placement(q)
    driver, urdf = (
        make_chain(make_calibrated_tree(read_calibrated_origins(file, order)), "tool0", "base").placement(q)
        for order in ("driver", "urdf")
    )
    assert np.abs(driver - true).max() < ROUNDING
    assert np.abs(urdf - true).max() > 1e-7
    # Some angles are exactly zero only in the driver's order.
    assert "pitch: 0\n" in file.read_text().replace("-0\n", "0\n")
    metres, _ = largest_tip_displacement(read_calibrated_origins(file), read_calibrated_origins(file, "urdf"))
    assert 1e-7 < metres < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("prefix", ["", "left_"])
def test_the_calibration_file_is_written_to_the_urdf_of_the_ros_description(prefix: str, file: Path) -> None:
    robot = load(description(prefix))
    found = apply_factory_calibration(robot, file, "urdf")
    assert present(found.certificate).verified
    written = load(found.text)
    for (link, name), T in zip(PARENT_JOINTS.items(), drawn_in(), strict=True):
        here = written.tree.joints[written.tree.joint_index(prefix + name)].T_parent_joint
        assert np.abs(here[:3, 3] - T[:3, 3]).max() < 1e-15, link
    q = written.sample(20)
    true = apply_factory_calibration(robot, file)
    T = load(true.text).placement(q, [f"{prefix}base", f"{prefix}tool0"])
    assert np.abs(np.linalg.solve(T[:, 0], T[:, 1]) - controller().placement(q)).max() < ROUNDING
    assert max(turn for _, turn in true.displacements.values()) < 0.01
    assert true.changes.total is not None


def test_the_frames_of_the_older_description_move_by_less_than_60_millimetres(file: Path) -> None:
    robot = load("ur10")
    found = apply_factory_calibration(robot, file)
    assert found.certificate is not None
    written = load(found.text)
    q = written.sample(20)
    T = written.placement(q, ["base", "tool0"])
    assert np.abs(np.linalg.solve(T[:, 0], T[:, 1]) - controller().placement(q)).max() < ROUNDING
    # The shoulders and wrists of a UR10 and a UR10e are 5 cm apart; no frame moves by 439 m.
    assert max(shift for shift, _ in found.displacements.values()) < 0.06


@pytest.mark.slow
def test_an_arm_with_other_joints_is_refused(file: Path) -> None:
    urdf = load("ur5").urdf
    with pytest.raises(InputError, match="no choice of joint origins makes the robot move like"):
        apply_factory_calibration(urdf.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 -1"/>'), file)
    seventh = urdf.replace('"wrist_3_link-tool0_fixed_joint" type="fixed"', '"flange" type="continuous"')
    with pytest.raises(InputError, match="different numbers of coordinates: found 7 and 6"):
        apply_factory_calibration(seventh, file)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: [", "this is not a YAML file"),
        ("joints: 1", "this file is not a calibration of a Universal Robots arm"),
        ("kinematics: {shoulder: 1}", "no shoulder"),
        ("kinematics: {shoulder: {x: ten}}", "shoulder x"),
        ("kinematics: {shoulder: {x: .nan}}", "shoulder x"),
        ("kinematics: {shoulder: {y: 0}}", "shoulder x: this is not a finite number: found NoneType"),
        (BOMB, "shoulder x: this is not a finite number: found list"),
        ("kinematics: {shoulder: {x: 1, x: 2}}", "x.yaml:1: the calibration file contains a key twice"),
        ("kinematics:\n  a: {}\n  a: {}", "x.yaml:3: the calibration file contains a key twice"),
        ("kinematics: " + "[" * 5000, "this is not a YAML file"),
    ],
)
def test_an_invalid_calibration_file_is_reported(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "x.yaml").write_text(text)
    with pytest.raises(InputError) as error:
        read_calibrated_origins(tmp_path / "x.yaml")
    assert words in str(error.value)


def test_an_unsuitable_robot_and_an_unknown_rotation_order_are_reported(file: Path) -> None:
    with pytest.raises(InputError, match="the robot is not a Universal Robots arm"):
        apply_factory_calibration("panda", file)
    with pytest.raises(UnknownNameError, match="driver"):
        apply_factory_calibration("ur5", file, "drivers")


# -- new origins in a URDF ------------------------------------------------------------------------


ORIGINS = {name: pose(k, 0.5) for k, name in enumerate(["one", "two", "three", "fix"])}


def blank(data: bytes) -> bytes:
    """Return a text without the values of its origins."""
    return re.sub(rb"""(<origin\b[^>]*?)((?:\s+\w+\s*=\s*(?:"[^"]*"|'[^']*'))+)""", rb"\1", data)


def origins(data: bytes) -> dict[str, FloatArray]:
    robot = load(data, verify=False)
    return {one.name: one.T_parent_joint for one in robot.tree.joints}


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_only_the_origins_change_in_the_new_urdf(end: str, mark: bytes) -> None:
    old = mark + BRANCHED.replace("\n", end).encode()
    new = with_origins(old, ORIGINS)
    # The joint without an origin gets one before its parent.
    assert blank(new).replace(b'type="prismatic"><origin/>', b'type="prismatic">') == blank(old)
    found = origins(new)
    for name, T in ORIGINS.items():
        assert np.abs(found[name] - T).max() < 1e-14
    assert (found["four"] == origins(old)["four"]).all()


def test_lines_without_a_changed_joint_and_the_style_of_attributes_are_preserved() -> None:
    text = BRANCHED.encode()
    old, new = (data.splitlines() for data in (text, with_origins(text, {"one": ORIGINS["one"]})))
    assert [k for k, pair in enumerate(zip(old, new, strict=True)) if pair[0] != pair[1]] == [6]
    assert re.fullmatch(rb"""    <origin xyz="\S+ \S+ \S+"   rpy='\S+ \S+ \S+'/>""", new[6])


def test_an_unchanged_number_keeps_its_digits() -> None:
    text = BRANCHED.replace('xyz="0.1 0.2 0.3"', 'xyz="1e-1 .20 0.3"').encode()
    T = origins(text)["one"].copy()
    assert with_origins(text, {"one": T}) == text
    T[2, 3] += 0.001
    assert with_origins(text, {"one": T}) == text.replace(b"1e-1 .20 0.3", b"1e-1 .20 0.301")


@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
def test_an_origin_with_a_quaternion_is_written_with_a_quaternion() -> None:
    text = BRANCHED.replace('name="branched"', 'name="branched" version="1.1"')
    text = text.replace('<origin xyz="0.4 0 0.1"/>', '<origin xyz="0.4 0 0.1" quat_xyzw="0 0 -0.6 -0.8"/>')
    drawn = origins(text.encode())["four"].copy()
    new = with_origins(text.encode(), {"four": drawn @ pose(3, 0.1)})
    assert np.abs(origins(new)["four"] - drawn @ pose(3, 0.1)).max() < 1e-14
    assert b"rpy" not in next(line for line in new.splitlines() if b"quat_xyzw" in line)
    written = present(re.search(rb'quat_xyzw="([^"]*)"', new))
    assert np.dot([float(x) for x in written[1].split()], [0, 0, -0.6, -0.8]) > 0.0


def test_a_urdf_with_an_invalid_mimic_joint_can_be_edited() -> None:
    text = BRANCHED.replace('<axis xyz="0 -1 0"/>', '<axis xyz="0 -1 0"/><mimic joint="nobody"/>').encode()
    assert b'<mimic joint="nobody"/>' in with_origins(text, {"one": ORIGINS["one"]})


def test_a_urdf_with_errors_or_without_the_joint_is_not_edited() -> None:
    with pytest.raises(InputError, match="a URDF with errors is not edited"):
        with_origins(b"<robot>", {})
    with pytest.raises(InputError, match="no such joint"):
        with_origins(BRANCHED.encode(), {"five": np.eye(4)})
    with pytest.raises(InputError, match="two edits overlap"):
        apply_edits(b"abc", [Edit(0, 2), Edit(1, 3)])


angles = st.floats(-7.0, 7.0)


@given(st.tuples(angles, angles, angles), st.tuples(*[st.floats(-1e-3, 1e-3)] * 3))
def test_the_roll_pitch_yaw_angles_nearest_to_the_old_ones_are_written(
    old: tuple[float, float, float], by: tuple[float, float, float]
) -> None:
    wanted = np.array(old) + by
    R = rotation_from_rpy(wanted)
    found = nearest_rpy(R, old)
    assert np.abs(rotation_from_rpy(found) - R).max() < 1e-14
    assert np.abs(found - old).sum() <= np.abs(by).sum() + 1e-12 / max(abs(np.cos(wanted[1])), 1e-16)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_the_roll_is_unchanged_at_a_pitch_of_a_right_angle(pitch: float) -> None:
    R = np.round(rotation_from_rpy([0.0, pitch, 0.5]), 16)
    R[:2, 0] = R[2, 1:] = 0.0
    found = nearest_rpy(R, (0.3, pitch, 0.0))
    assert found[0] == 0.3
    assert np.abs(rotation_from_rpy(found) - R).max() < 1e-15
