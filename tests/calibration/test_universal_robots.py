"""The factory's calibration of a Universal Robots arm, from the driver's YAML or the controller's table."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from urdfkin.calibration.universal_robots import (
    LINKS,
    calibrated_tree,
    distance,
    read_calibration,
    universal_robots,
)
from urdfkin.dh.rows import table_from_rows
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.rotation import euler_of
from urdfkin.model.chain import chain
from urdfkin.model.path import elementary
from urdfkin.model.tree import FloatArray
from urdfkin.robot.loading import load

#: theta, d, a, alpha of a real UR10e, from the driver's documentation: the upper arm is 439 m out.
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
#: What a product with lengths of 446 m leaves, ten times over.
ROUNDING = 10.0 * 446.0 * np.finfo(float).eps
#: Nine lines that are a billion words.
BOMB = "\n".join(
    [
        "a0: &a0 [lol]",
        *(f"a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 9)}]" for k in range(9)),
        "kinematics: {shoulder: {x: *a9}}",
    ]
)
NOMINAL = {
    "shoulder": "0 0 0.1807 0 0 0",
    "upper_arm": "0 0 0 1.570796327 0 0",
    "forearm": "-0.6127 0 0 0 0 0",
    "wrist_1": "-0.57155 0 0.17415 0 0 0",
    "wrist_2": "0 -0.11985 0 1.570796327 0 0",
    "wrist_3": "0 0.11655 0 1.570796326589793 3.141592653589793 3.141592653589793",
}


def drawn_in() -> list[FloatArray]:
    """The links drawn in along their axes, as the driver does it."""
    S = [elementary(2, True, theta) @ elementary(2, False, d) for theta, d, _, _ in CONTROLLER]
    X = [elementary(0, False, a) @ elementary(0, True, alpha) for _, _, a, alpha in CONTROLLER]
    for i in (1, 2):
        M = S[i] @ X[i]
        along = -M[2, 3] / M[2, 2]
        x, y, _ = M[:3, 3] + along * M[:3, 2]
        theta = math.atan2(-y, -x)
        S[i] = elementary(2, True, theta)
        X[i] = elementary(0, False, -math.hypot(x, y)) @ elementary(2, True, CONTROLLER[i, 0] - theta)
        X[i] = X[i] @ elementary(0, True, CONTROLLER[i, 3])
        S[i + 1] = S[i + 1] @ elementary(2, False, -along)
    return [S[0], *(X[i] @ S[i + 1] for i in range(5))]


def as_yaml(origins: list[FloatArray]) -> str:
    lines = ["kinematics:"]
    for link, T in zip(LINKS, origins, strict=True):
        six = [*T[:3, 3], *euler_of("XYZ", T[:3, :3])]
        named = zip(("x", "y", "z", "roll", "pitch", "yaw"), six, strict=True)
        # The driver writes the shortest digits: 1e-05 is a word to YAML 1.1.
        lines += [f"  {link}:", *(f"    {name}: {float(value):.16g}" for name, value in named)]
    return "\n".join([*lines, "  hash: calib_12788084448423163542", ""])


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "my_robot_calibration.yaml"
    path.write_text(as_yaml(drawn_in()))
    return path


def controller() -> DHTable:
    return table_from_rows(CONTROLLER[:, [2, 3, 1, 0]].tolist(), "standard")


def description(prefix: str) -> str:
    """The joints of the ROS description, as its xacro expands."""
    lines = [f'<robot name="ur10e"><link name="{prefix}base_link"/>']
    parent, named = f"{prefix}base_link_inertia", zip(LINKS.items(), NOMINAL.values(), strict=True)

    def fixed(name: str, parent: str, child: str, rpy: str) -> str:
        return (
            f'<link name="{child}"/><joint name="{prefix}{name}" type="fixed"><parent link="{parent}"/>'
            f'<child link="{child}"/><origin xyz="0 0 0" rpy="{rpy}"/></joint>'
        )

    lines.append(fixed("base_link-base_link_inertia", f"{prefix}base_link", parent, f"0 0 {math.pi}"))
    lines.append(fixed("base_link-base_fixed_joint", f"{prefix}base_link", f"{prefix}base", f"0 0 {math.pi}"))
    for (link, joint), six in named:
        x, y, z, *rpy = six.split()
        lines.append(
            f'<link name="{prefix}{link}_link"/>\n<joint name="{prefix}{joint}" type="revolute">\n'
            f'  <parent link="{parent}"/><child link="{prefix}{link}_link"/>\n'
            f'  <origin rpy="{" ".join(rpy)}" xyz="{x} {y} {z}"/><axis xyz="0 0 1"/>\n'
            '  <limit lower="-6.28" upper="6.28" effort="1" velocity="1"/></joint>'
        )
        parent = f"{prefix}{link}_link"
    lines.append(fixed("flange-tool0", parent, f"{prefix}tool0", "0 0 0"))
    return "\n".join([*lines, "</robot>"])


def test_the_drivers_angles_turn_about_x_y_and_z_in_that_order_and_a_urdfs_do_not(file: Path) -> None:
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (50, 6))
    true = controller().placement(q)
    driver, urdf = (
        chain(calibrated_tree(read_calibration(file, order)), "tool0", "base").placement(q)
        for order in ("driver", "urdf")
    )
    assert np.abs(driver - true).max() < ROUNDING
    assert np.abs(urdf - true).max() > 1e-7
    # Some angles are exactly zero in the one order alone.
    assert "pitch: 0\n" in file.read_text().replace("-0\n", "0\n")
    metres, _ = distance(read_calibration(file), read_calibration(file, "urdf"))
    assert 1e-7 < metres < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("prefix", ["", "left_"])
def test_the_ros_descriptions_urdf_gets_the_files_numbers(prefix: str, file: Path) -> None:
    robot = load(description(prefix))
    found = universal_robots(robot, file, "urdf")
    assert found.certificate is not None
    assert found.certificate.verified
    written = load(found.text)
    for (link, joint), T in zip(LINKS.items(), drawn_in(), strict=True):
        here = written.tree.joints[written.tree.joint_index(prefix + joint)].T_parent_joint
        assert np.abs(here[:3, 3] - T[:3, 3]).max() < 1e-15, link
    q = written.sample(20)
    true = universal_robots(robot, file)
    T = load(true.text).placement(q, [f"{prefix}base", f"{prefix}tool0"])
    assert np.abs(np.linalg.solve(T[:, 0], T[:, 1]) - controller().placement(q)).max() < ROUNDING
    assert max(turn for _, turn in true.moved.values()) < 0.01
    assert true.changes.total is not None


def test_the_older_descriptions_frames_stay_near_where_they_were(file: Path) -> None:
    robot = load("ur10")
    found = universal_robots(robot, file)
    assert found.certificate is not None
    written = load(found.text)
    q = written.sample(20)
    T = written.placement(q, ["base", "tool0"])
    assert np.abs(np.linalg.solve(T[:, 0], T[:, 1]) - controller().placement(q)).max() < ROUNDING
    # A UR10 is no UR10e: their shoulders and wrists are 5 cm apart, and no frame is 439 m away.
    assert max(shift for shift, _ in found.moved.values()) < 0.06


@pytest.mark.slow
def test_an_arm_with_other_joints_is_refused(file: Path) -> None:
    urdf = load("ur5").urdf
    with pytest.raises(InputError, match="no origins make the robot move like the calibrated arm"):
        universal_robots(urdf.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 -1"/>'), file)
    seventh = urdf.replace('"wrist_3_link-tool0_fixed_joint" type="fixed"', '"flange" type="continuous"')
    with pytest.raises(InputError, match="different numbers of coordinates: found 7 and 6"):
        universal_robots(seventh, file)


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
        ("kinematics: " + "[" * 5000, "this is not a YAML file"),
    ],
)
def test_another_file_is_told(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "x.yaml").write_text(text)
    with pytest.raises(InputError) as error:
        read_calibration(tmp_path / "x.yaml")
    assert words in str(error.value)


def test_another_robot_and_another_order_are_told(file: Path) -> None:
    with pytest.raises(InputError, match="the robot is not a Universal Robots arm"):
        universal_robots("panda", file)
    with pytest.raises(UnknownNameError, match="driver"):
        universal_robots("ur5", file, "drivers")
