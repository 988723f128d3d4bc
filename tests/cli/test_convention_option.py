"""`--convention NAME` reads and writes the numbers of other tools; `urdfkin order` prints code for this."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.cli.running import good, numbers, python, refused
from tests.cli.running import urdfkin as run
from tests.urdfs import joint
from tests.urdfs import robot as urdf_of
from urdfkin.model.conventions import BUILT_IN_NAMES
from urdfkin.verify.quantities import quantities_by_command

OF_FRAMES = [name for name, row in quantities_by_command().items() if row.has_reference]
DOG = ("a1", "--root-joint", "floating", "--frame", "FL_foot", "--convention")


@pytest.mark.parametrize("name", ["mujoco", "drake", "isaaclab", "pinocchio"])
@pytest.mark.parametrize("command", OF_FRAMES)
def test_a_result_equals_the_result_of_the_robot_in_the_convention(command: str, name: str) -> None:
    robot = urdfkin.load("a1", root_joint="floating", verify=False)
    other = robot.with_convention(name)
    row, rng = quantities_by_command()[command], np.random.default_rng(3)
    ours = robot.sample(1, 3)[0], rng.standard_normal(robot.nv), rng.standard_normal(robot.nv)
    values = dict(zip("qva", other.conversion.to(*ours), strict=True))
    given = [word for letter in row.inputs for word in (f"--{letter}={numbers(values[letter])}",)]
    done = good(command, *DOG, name, *given, "--format", "json")
    expected = getattr(other, row.method)(*(values[letter] for letter in row.inputs), "FL_foot")
    assert np.allclose(done.data["result"][0], expected, 0, 1e-12)
    assert np.allclose(done.data["q"][0], values["q"], 0, 1e-15)
    assert done.data["convention"] == name
    assert tuple(done.data["rates"]) == other.velocity_names
    assert done.data["rows"][0] == ("wx" if name == "drake" else "vx")


def test_a_placement_reads_q_in_the_convention_and_wxyz_has_the_scalar_first() -> None:
    robot = urdfkin.load("a1", root_joint="floating", verify=False)
    q = robot.sample(1, 3)[0]
    text = numbers(robot.convention("mujoco").to(q))
    done = run("placement", *DOG, "mujoco", "--q", text, "--format", "json")
    assert np.allclose(done.data["result"][0], robot.placement(q, "FL_foot"), 0, 1e-14)
    assert "convention mujoco" in run("placement", *DOG, "mujoco", "--q", text).text
    x, w = (
        run("placement ur5 --q random --as", form, "--format", "json").data["result"][0]
        for form in ("quaternion", "wxyz")
    )
    assert w == [*x[:3], x[6], *x[3:6]]


def test_the_table_names_the_convention_and_states_the_checked_results() -> None:
    lines = run("velocity ur5 --convention drake --v random").text.splitlines()
    assert "convention drake" in lines[0]
    named = [line.split()[0] for line in lines if line.startswith(("linear", "angular"))]
    assert named == ["angular", "linear"]
    done = run("velocity ur5 --convention drake --v random")
    assert "before the conversion to drake" in done.err + done.text
    assert "before the conversion" not in run("velocity ur5 --v random").err


def test_a_convention_file_defines_units_zeros_and_names(tmp_path: Path) -> None:
    file = tmp_path / "motors.toml"
    file.write_text('joints = ["elbow", "joint_1"]\nangle = "deg"\n[joint.joint_2]\nname = "elbow"\n')
    for q in ("90,0", "elbow=90, joint_1=0"):
        done = run("placement planar_two_link --convention", str(file), "--q", q, "--format", "json")
        assert np.allclose(np.array(done.data["result"])[0, :3, 3], [0.5, 0.4, 0.0])
    file = tmp_path / "motors.toml"
    file.write_text('joints = ["joint_2", "joint_1"]\nangle = "deg"\n[joint.joint_1]\nsign = -1\nzero = 5\n')
    space: dict[str, Any] = {"q_from": np.array([1.0, 2.0]), "v_from": np.array([1.0, 2.0]), "np": np}
    exec(run("order planar_two_link --to", str(file)).text, space)
    assert np.allclose(space["q_to"], [np.degrees(2), 5 - np.degrees(1)])
    assert np.allclose(space["v_to"], [np.degrees(2), -np.degrees(1)])


def test_a_convention_without_mimic_joints_needs_no_mimic_and_a_breakdown_has_no_convention() -> None:
    assert "--no-mimic" in refused("jacobian panda --convention mujoco")
    good("jacobian panda --convention mujoco --no-mimic")
    refused("acceleration ur5 --convention mujoco --breakdown")
    assert "unknown convention 'mujocco'; did you mean mujoco" in refused("order a1 --to mujocco")


TWICE = "two joints have the same name in the convention: found 'joint_2'"
FAULTY = {
    'joints = ["joint_1"]': "the order of joints lacks a joint: found joint_2",
    'joints = ["joint_1", "joint_2", "elbow"]': "unknown joint 'elbow'",
    '[joint.joint_1]\nname = "joint_2"': TWICE,
    'joints = ["joint_2", "joint_2"]': TWICE,
}


@pytest.mark.parametrize("text", FAULTY)
def test_a_faulty_convention_file_is_reported_in_one_line(text: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text)
    for command in (("placement", "--convention"), ("order", "--to")):
        err = refused(command[0], "planar_two_link", command[1], str(file))
        assert err.count("\n") == 1
        assert FAULTY[text] in err
        assert "mine" in err


def test_a_batch_without_the_option_imports_no_module_of_conventions() -> None:
    done = python(
        "import sys\nfrom tests.cli.running import urdfkin\n"
        "done = urdfkin('velocity a1 --q random:100 --v random --format csv')\n"
        "loaded = [name for name in sys.modules if name.startswith('urdfkin.model.conventions')]\n"
        "print(done.code, len(done.text.splitlines()) > 100, loaded)\n"
    )
    assert done.stdout == "0 True []\n"


# -- urdfkin order ---------------------------------------------------------------------------------

TOOLS = [name for name in BUILT_IN_NAMES if name != "idyntree"]


def test_order_prints_a_row_for_each_joint_and_a_column_for_each_convention() -> None:
    lines = run("order a1 --root-joint floating --format csv").text.splitlines()
    table = [line.split(",") for line in lines]
    assert table[0] == ["joint", *TOOLS]
    robot = urdfkin.load("a1", root_joint="floating", verify=False)
    assert [row[0] for row in table[1:]] == list(robot.joint_names)
    for k, name in enumerate(TOOLS, 1):
        for row in table[1:]:
            q, _, v = row[k].partition("/")
            first = int((v or q).split("-")[0])
            assert robot.convention(name).velocity_names[first].split(".")[0] == row[0]


def test_tools_with_equal_indices_have_one_column_and_json_has_the_librarys_numbers() -> None:
    text = run("order a1").text
    assert "urdfkin: also pinocchio, kdl, isaacgym" in text
    names = ["joint", "urdfkin", "urdf", "isaaclab", "isaaclab3", "alphabetical"]
    assert text.splitlines()[1].split() == names
    data = run("order a1 --to isaaclab --format json").data
    permutation = urdfkin.load("a1", verify=False).convention("isaaclab").permutation
    assert permutation is not None
    assert data["q"]["reordering"]["index"] == permutation.tolist()
    every = run("order a1 --format json").data["conventions"]
    assert list(every) == TOOLS
    assert every["isaaclab"]["sources"]


@pytest.mark.parametrize(
    ("start", "end"), list(itertools.product(("mujoco", "isaaclab", "drake", "pinocchio"), repeat=2))
)
def test_the_printed_code_converts_q_and_v_between_conventions(start: str, end: str) -> None:
    text = run("order tiago --from", start, "--to", end, "--root-joint", "floating").text
    robot = urdfkin.load("tiago", root_joint="floating", verify=False)
    q, v = robot.sample(1)[0], np.random.default_rng(0).standard_normal(robot.nv)
    space: dict[str, Any] = {"np": np, "robot": robot, "six_from": np.arange(6)}
    space["q_from"], space["v_from"] = robot.convention(start).to(q, v)
    exec(text, space)
    for name, expected in zip(("q_to", "v_to"), robot.convention(end).to(q, v), strict=True):
        assert np.allclose(space[name], expected, 0, 1e-14)
    assert ("six_to" in text) == ((start == "drake") != (end == "drake"))


def test_a_conversion_that_is_no_reordering_has_no_csv(tmp_path: Path) -> None:
    file, output = tmp_path / "r.urdf", tmp_path / "order.csv"
    file.write_text(urdf_of(joint("a", "continuous", "l0", "l1")))
    err = refused("order --from pinocchio --to mujoco", str(file), "-o", str(output))
    assert "cannot express this conversion, so it has no CSV: found q; use --format table" in err
    assert not output.exists()


def test_the_printed_code_names_the_file_of_a_convention(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text('like = "mujoco"\nname = "isaaclab"\n')
    text = run("order a1 --root-joint floating --to drake --from", str(file)).text
    robot = urdfkin.load("a1", root_joint="floating", verify=False)
    q, v = robot.sample(1)[0], np.arange(18.0)
    space: dict[str, Any] = {"robot": robot, "six_from": np.arange(6)}
    space["q_from"], space["v_from"] = robot.convention("mujoco").to(q, v)
    exec(text, space)
    assert np.allclose(space["v_to"], robot.convention("drake").to(q, v)[1], 0, 1e-13)


def test_a_convention_in_which_two_joints_have_the_same_name_is_left_out_with_a_warning(
    tmp_path: Path,
) -> None:
    file = tmp_path / "r.urdf"
    file.write_text(urdf_of(joint("a-b", "continuous", "l0", "l1"), joint("a_b", "continuous", "l1", "l2")))
    done = run("order", str(file), "--format", "json")
    assert list(done.data["conventions"]) == [name for name in TOOLS if name != "isaaclab"]
    assert "no column for isaaclab: two joints have the same name in the convention: found 'a_b'" in done.err
