"""Commands read q, v and a in every form, and print results to the last digit in every format."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin as library
from tests.cli.running import Done, good, numbers, process, refused, urdfkin
from tests.robots.odd_urdfs import urdf_of
from tests.urdfs import joint
from tests.urdfs import robot as robot_of
from urdfkin.dh import read_table
from urdfkin.dh.parse_table import published_tables
from urdfkin.model.configuration import sample
from urdfkin.model.tree import FloatArray
from urdfkin.urdf.catalogue import catalogue
from urdfkin.verify.quantities import quantities_by_command

QUANTITIES = {name: row.inputs for name, row in quantities_by_command().items()}
Q = (0.1, -0.5, 1 / 3, -2.0, 2**-0.5, 1.5, 0.8, 0.02)


@pytest.fixture
def columns(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Set the width of the terminal to the parameter, and return it."""
    monkeypatch.setenv("COLUMNS", str(request.param))
    return request.param


def of_widths(*widths: int | str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("columns", widths, indirect=True)


def expected(quantity: str, n: int, reference: str) -> FloatArray:
    """Return the library's results for the samples that the command draws with seed 7."""
    robot, rng = library.load("panda"), np.random.default_rng(7)
    q = sample(robot.tree, n, rng)
    inputs = [q, *(rng.standard_normal((n, robot.nv)) for _ in QUANTITIES[quantity][1:])]
    how = {} if quantity == "placement" else {"reference": reference}
    result: FloatArray = getattr(robot, quantity.replace("-", "_"))(*inputs, "panda_hand", **how)
    return result


def command(quantity: str, n: int, reference: str, format_: str) -> Done:
    words = [word for letter in QUANTITIES[quantity] for word in (f"--{letter}", f"random:{n}")]
    words += [] if quantity == "placement" else ["--reference", reference]
    return good(f"{quantity} panda --frame panda_hand --seed 7 --format {format_}", *words)


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 3])
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_json_csv_and_npy_give_exactly_the_librarys_numbers(quantity: str, n: int) -> None:
    result = expected(quantity, n, "local")
    assert np.array_equal(command(quantity, n, "local", "json").data["result"], result)
    assert np.array_equal(command(quantity, n, "local", "npy").array, result)
    rows = command(quantity, n, "local", "csv").rows
    numbers = np.array([[float(cell) for cell in row if _is_number(cell)] for row in rows[1:]])
    assert np.array_equal(numbers[:, 1:].reshape(result.shape), result)  # the first number is the sample's


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


@of_widths(80)
@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.usefixtures("columns")
def test_the_table_states_the_computed_result_and_the_closeness_of_the_check(quantity: str) -> None:
    text = command(quantity, 1, "local_world_aligned", "table").text
    words = ["panda", "panda_hand", "verified by Pinocchio 4", "eps*scale"]
    words += library.load("panda").velocity_names if quantity.startswith("jacobian") else []
    assert [word for word in words if word not in text] == []


@pytest.mark.slow
@pytest.mark.parametrize("line", ["jacobian", "acceleration --v random --breakdown"])
@of_widths(80, 200)
def test_a_table_folds_no_name_and_is_no_wider_than_the_terminal(line: str, columns: int) -> None:
    line += " talos --frame gripper_left_base_link --q random:1"
    *lines, _ = urdfkin(line).text.splitlines()  # the last line states the check
    assert max(map(len, lines[2:])) <= columns  # the terminal wraps the text above the table
    path = [name for name in library.load("talos").velocity_names if name.startswith(("torso", "arm_left"))]
    assert len(path) == 9
    assert set(path) <= {line.split()[0] for line in lines if line.split()}
    if line.startswith("jacobian"):
        rows = [line.split()[-6:] for line in lines]
        shown = [list(map(float, row)) for row in rows if len(row) == 6 and all(map(_is_number, row))]
        J = urdfkin(f"{line} --format json").data["result"][0]
        assert np.allclose(np.array(shown).T, J, rtol=1e-5, atol=1e-12)


@pytest.mark.slow
@of_widths(60, 80, 110, 200)
@pytest.mark.parametrize("name", ["panda", "tiago_dual"])
@pytest.mark.usefixtures("columns")
def test_info_folds_no_name_and_prints_the_indices_of_a_joint_beside_or_below_the_name(name: str) -> None:
    lines = urdfkin("info", name).text.splitlines()
    robot = library.load(name)
    for i, one in enumerate(robot.tree.joints):
        if not one.kind.nv:
            continue
        (at,) = [k for k, line in enumerate(lines[2:], 2) if one.name in line.lstrip("│├└ ").split()[:3]]
        # Only names longer than the terminal's width continue on the next line.
        found = " ".join(lines[at : at + (1 if one.kind.value in lines[at].split() else 2)]).split()
        assert {robot.link_names[i + 1], one.kind.value, f"q[{robot.tree.q_index[i]}]"} <= set(found)
        if one.limit is not None and np.isfinite(one.limit.upper):
            k = found.index(f"v[{robot.tree.v_index[i]}]")
            limits = (one.limit.lower, one.limit.upper, one.limit.velocity)
            assert found[k + 1 : k + 4] == [f"{limit:.6g}" for limit in limits]


@pytest.mark.slow
def test_a_terminal_without_unicode_lines_gets_dashes() -> None:
    done = process("info", "panda", COLUMNS="80", PYTHONIOENCODING="ascii")
    assert (done.code, done.err) == (0, "")
    assert "\n" + "-" * 80 + "\n" in done.text


@of_widths(60, 80, 200)
def test_the_catalogue_folds_no_name_and_is_no_wider_than_the_terminal(columns: int) -> None:
    lines = urdfkin("robots").text.splitlines()
    table = lines[: next(k for k, line in enumerate(lines) if line.endswith(" robots"))]
    assert max(map(len, table)) <= max(columns, 71)  # the width of family, base and tip
    words = {word for line in table for word in line.split()}
    for entry in catalogue().values():
        assert {
            entry.name,
            *entry.family.split(),
            *filter(None, (entry.base_frame, entry.tip_frame)),
        } <= words


def test_the_json_result_contains_robot_frame_names_inputs_and_check() -> None:
    robot = library.load("panda")
    data = urdfkin("acceleration panda --q random --v random --a random --format json").data
    assert (data["robot"], data["frame"]) == ("panda", "panda_hand_tcp")
    assert data["reference"] == "local_world_aligned"
    assert (data["coordinates"], data["rates"]) == (list(robot.coordinate_names), list(robot.velocity_names))
    assert len(data["q"]) == len(data["v"]) == len(data["a"]) == len(data["result"]) == 1
    assert data["verified"] is True
    assert data["check"].startswith("verified by Pinocchio 4")
    again = robot.acceleration(data["q"], data["v"], data["a"], data["frame"], data["reference"])
    assert np.array_equal(again, data["result"])


def test_joint_values_are_read_as_a_list_by_name_in_degrees_or_with_blanks() -> None:
    data = urdfkin("placement panda --q", numbers(Q), "--format", "json").data
    assert data["q"] == [list(Q)]
    assert np.array_equal(data["result"][0], library.load("panda").placement(Q, "panda_hand_tcp"))
    named = good("jacobian panda --q", f"ready,{NAMED}", "--format", "json")
    assert "warning" not in named.err
    assert named.data["q"] == [RADIANS]
    blanks = urdfkin("jacobian panda --q", f"[{' '.join(map(repr, RADIANS))}]", "--format", "json")
    assert blanks.data["result"] == named.data["result"]
    done = urdfkin("placement panda --q ready,panda_joint1=30 --no-verify")
    assert "warning: joint panda_joint1: 30 is outside [-2.8973, 2.8973]; degrees? write 30deg" in done.err


@pytest.mark.parametrize("layout", ["plain", "header", "header in another order", "crlf and bom", "comments"])
def test_a_batch_comes_from_a_csv_file_with_or_without_a_header(layout: str, tmp_path: Path) -> None:
    robot, path = library.load("panda"), tmp_path / "q.csv"
    q, names = robot.sample(4, 3), robot.coordinate_names
    order = [3, 1, 7, 0, 5, 2, 6, 4] if layout == "header in another order" else range(8)
    lines = [",".join(repr(float(row[i])) for i in order) for row in q]
    if layout.startswith("header"):
        lines.insert(0, ", ".join(names[i] for i in order))
    if layout == "comments":
        lines = ["# recorded today", lines[0], "", *lines[1:]]
    text = "\n".join(lines) + "\n"
    if layout == "crlf and bom":
        text = "\ufeff" + text.replace("\n", "\r\n")
    path.write_text(text, encoding="utf-8", newline="")
    done = good("jacobian panda --q", f"@{path}", "--format", "npy")
    assert np.array_equal(done.array, robot.jacobian(q, "panda_hand_tcp"))


def test_a_batch_or_a_robot_is_read_from_standard_input() -> None:
    robot = library.load("ur5")
    rows = "\n".join(map(numbers, robot.sample(3, 1)))
    done = urdfkin("jacobian ur5 --q @- --format npy", stdin=rows)
    assert np.array_equal(done.array, robot.jacobian(robot.sample(3, 1), robot.tip_frame))
    done = good("jacobian - --frame tool0 --format json", stdin=robot.urdf)
    assert done.data["source"] == "-"
    assert np.array_equal(done.data["result"][0], robot.jacobian(np.zeros(6), "tool0"))


def test_a_batch_is_combined_with_one_sample_reproducible_and_shown_in_part() -> None:
    done = urdfkin("velocity ur5 --q random:5 --v 1,0,0,0,0,0 --format json")
    assert np.shape(done.data["v"]) == (5, 6)
    assert "different lengths: found 5, 4" in refused("velocity ur5 --q random:5 --v random:4")
    one, again, other = (
        urdfkin("jacobian panda --q random:2 --seed", seed, "--format", "csv").out for seed in ("3", "3", "4")
    )
    assert one == again
    assert one != other
    text = urdfkin("velocity ur5 --q random:9 --v random").text
    assert "sample 4" in text
    assert "sample 5" not in text
    assert "4 more samples" in text


def test_output_is_written_to_a_file_or_a_device_and_the_check_to_stderr(tmp_path: Path) -> None:
    path = tmp_path / "J.npy"
    done = urdfkin("jacobian panda --format npy --output", str(path))
    assert (done.code, done.out) == (0, b"")
    assert "verified by Pinocchio" in done.err
    assert np.load(path).shape == (1, 6, 8)
    assert [entry.name for entry in tmp_path.iterdir()] == ["J.npy"]
    assert urdfkin("jacobian panda --format csv -o /dev/null").code == 0
    assert Path("/dev/null").is_char_device()
    assert urdfkin("jacobian panda --format csv -o -").text.startswith("sample,row,panda_joint1")


def test_the_default_frame_is_the_catalogues_tip_and_exceeded_limits_cause_warnings() -> None:
    assert "jacobian of panda_hand_tcp" in urdfkin("jacobian panda").text
    assert "jacobian of tool0" in urdfkin("jacobian ur5").text
    done = good("placement panda --q 0,0,0,-1,0,0,0,0.5 --format json")
    assert "warning: joint panda_finger_joint1: 0.5 is outside [0, 0.04]" in done.err
    assert "warning: joint panda_finger_joint2: 0.5 is outside [0, 0.04]" in done.err
    assert "panda_joint4" not in done.err
    assert done.data["verified"] is True
    assert len(urdfkin("jacobian panda --format json").data["rates"]) == 8
    assert len(urdfkin("jacobian panda --no-mimic --format json").data["rates"]) == 9
    assert urdfkin("jacobian alex_psyonic_hands").code == 0
    assert urdfkin("jacobian alex_psyonic_hands --mimic").code == 2


@pytest.mark.parametrize("root_joint", ["planar", "floating"])
def test_a_root_joint_adds_its_coordinates(root_joint: str) -> None:
    data = urdfkin("velocity a1 --root-joint", root_joint, "--v", "random", "--format", "json").data
    assert data["rates"][0] == "root_joint.vx"
    assert len(data["q"][0]) == 12 + (7 if root_joint == "floating" else 3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["single_link", "fixed_only", "odd_names", "same_names", "mimic_hand_40"])
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_unusual_robots_are_processed_in_every_format(quantity: str, name: str) -> None:
    words = [word for letter in QUANTITIES[quantity] for word in (f"--{letter}", "random:2")]
    for format_ in ("table", "json", "csv", "npy"):
        assert good(quantity, "-", *words, "--format", format_, stdin=urdf_of(name)).out


def test_a_table_can_be_used_as_a_robot_and_an_absent_check_has_a_reason() -> None:
    assert "the check was turned off by verify=False" in urdfkin("jacobian panda --no-verify").text
    path, q = str(published_tables()["ur5"]), [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    robot = library.load(read_table(path))
    done = good("jacobian", path, "--q", ",".join(map(str, q)), "--format", "json")
    assert done.data["result"] == [robot.jacobian(q, robot.tip_frame).tolist()]


#: Name that is longer than a terminal's line together with other text
LONG = "a_joint_of_the_left_manipulator_whose_name_is_as_long_as_names_of_people_who_use_prefixes_are"


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        "info ROBOT", "jacobian ROBOT", "acceleration ROBOT --breakdown --v 1", "dh ROBOT", "dh ROBOT --tree",
        "validate ROBOT --samples 0", "validate ROBOT elbow --samples 0",
    ],
)  # fmt: skip
@of_widths("80", "")
def test_in_a_pipe_no_name_is_folded_and_no_line_ends_in_blanks(
    words: str, columns: str, tmp_path: Path
) -> None:
    path = tmp_path / f"{LONG}.urdf"
    arm = joint(LONG, "continuous", f"{LONG}_base", f"{LONG}_tool", 'xyz="1 0 0"', "0 1 0")
    path.write_text(robot_of(arm, name=f"{LONG}_robot"))
    done = good(*words.replace("ROBOT", str(path)).split())
    assert not any(line.endswith(" ") for line in done.text.splitlines())
    named = [line for line in done.text.splitlines() if "a_joint_of" in line]
    assert named
    assert all(line.count("a_joint_of") == line.count("prefixes_are") for line in named)
    if words.startswith("validate"):
        assert str(path) in done.text
    if not columns and "info" in words:
        assert sum("nq 1" in line and f"{LONG}_robot" in line for line in named) == 1
        assert sum("default base" in line and f"{LONG}_tool" in line for line in named) == 1


# -- locked joints -----------------------------------------------------------------------------------


MOVING = "acceleration panda --base-velocity 1,0,0,0,0,0"


@pytest.mark.parametrize("words", [MOVING, f"{MOVING} --breakdown", "singular-values panda", "chain panda"])
def test_json_states_the_file_the_locked_joints_and_the_motion_of_the_base(words: str) -> None:
    data = good(f"{words} --lock panda_joint1=0.3 --format json").data
    assert data["lock"] == {"panda_joint1": 0.3}
    if not words.startswith("chain"):
        assert data["sha256"] == library.load("panda").sha256
    if "--base-velocity" in words:
        assert data["base_velocity"] == [[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]]


#: Commands about a path; `dh --all` writes a list of documents.
ABOUT_PATHS = (
    "chain", "dh", "dh --all", "dh --tree", "screws", "structure",
)  # fmt: skip
LOCKS = "panda_joint1=0.3"


@pytest.mark.parametrize("words", ABOUT_PATHS)
def test_the_output_about_a_path_states_the_locked_joints(words: str) -> None:
    command, *options = words.split()
    line = (command, "panda", *options, "--lock", LOCKS, "--lock", "panda_finger_joint1=0.04")
    found = urdfkin(*line, "--format", "json").data
    for document in found if isinstance(found, list) else [found]:
        assert document["lock"] == {"panda_joint1": 0.3, "panda_finger_joint1": 0.04}
    expected = "locked: panda_joint1 at 0.3 rad, panda_finger_joint1 at 0.04 m"
    assert expected in urdfkin(*line).text
    assert "panda\\_joint1 at 0.3 rad" in urdfkin(*line, "--format", "markdown").text
    free = urdfkin(command, "panda", *options, "--format", "json").data
    assert all("lock" not in document for document in (free if isinstance(free, list) else [free]))
    assert "locked" not in urdfkin(command, "panda", *options).text


@pytest.mark.parametrize("command", ["dh", "screws"])
def test_a_written_file_with_locked_joints_is_read_as_the_same_robot(command: str, tmp_path: Path) -> None:
    path = tmp_path / "panda.json"
    good(command, "panda", "--lock", LOCKS, "-o", str(path))
    assert json.loads(path.read_text())["lock"] == {"panda_joint1": 0.3}
    read, locked = library.load(path), library.load("panda", lock={"panda_joint1": 0.3})
    q = locked.sample(1, 1)[0][:6]
    tip = "panda_hand_tcp"
    assert np.allclose(read.placement(q, tip), locked.placement([*q, 0.0], tip), 0, 1e-14)


def test_a_comparison_with_a_published_table_states_the_locked_joints() -> None:
    line = "dh panda --compare panda --lock panda_finger_joint1=0.04"
    assert good(f"{line} --format json").data["lock"] == {"panda_finger_joint1": 0.04}
    assert "locked: panda_finger_joint1 at 0.04 m" in good(line).text


def test_a_table_with_a_locked_joint_is_derived_again() -> None:
    table = good("dh robots/dh/ur5.toml --lock shoulder_pan_joint=0.3 --format json").data
    assert table["rows"][0]["joint"] == "shoulder_lift_joint"
    assert table["lock"] == {"shoulder_pan_joint": 0.3}


def test_locked_joints_have_no_coordinate_and_no_column() -> None:
    done = urdfkin("jacobian panda --lock panda_finger_joint1=40mm --q ready --format json")
    robot = library.load("panda", lock={"panda_finger_joint1": 0.04})
    assert done.code == 0, done.err
    assert done.data["result"] == [robot.jacobian("ready").tolist()]
    assert done.data["rates"] == list(robot.velocity_names)
    assert done.data["lock"] == {"panda_finger_joint1": 0.04}
    words = ("--joints", "panda_joint1, panda_joint2", "--lock", "ready", "--lock", "panda_joint7=30deg")
    found = urdfkin("placement panda", *words, "--q", "0.1,0.2", "--format", "json").data
    robot = library.load("panda").with_locked_joints(
        "ready, panda_joint7=30deg", joints=["panda_joint1", "panda_joint2"]
    )
    assert found["result"] == [robot.placement([0.1, 0.2]).tolist()]
    robot = library.load("panda").with_locked_joints({"panda_joint4": -1.0 / 3.0})
    replay = robot.origin.command_line.split()
    assert replay == ["panda", "--lock", f"panda_joint4={-1.0 / 3.0!r}"]
    found = urdfkin("placement", *replay, "--q", "ready", "--format", "json").data
    assert found["result"] == [robot.placement("ready").tolist()]


@pytest.mark.parametrize(
    "line",
    [
        "info", "dh", "screws", "chain", "structure", "order", "hessian", "singular-values --q ready", "imu",
        "analytical-jacobian --representation rpy --q=-0.5,0.3", "export --to numpy --quantity placement",
        "calibrate", "validate --samples 2",
    ],
)  # fmt: skip
def test_every_command_with_one_robot_can_lock_joints(line: str) -> None:
    done = good(f"{line} panda --lock panda_finger_joint1=0.04 --joints panda_joint4,panda_joint5")
    assert "panda_joint3" not in done.text or "locked" in done.text


# -- by name, in degrees, as a pose ----------------------------------------------------------------

NAMED = "panda_joint1=30deg,panda_joint4=-pi/2,panda_joint6=1.5"
RADIANS = [math.pi / 6, -0.785398, 0.0, -math.pi / 2, 0.0, 1.5, 0.785398, 0.001]


@pytest.mark.slow
def test_every_command_with_q_reads_named_values_and_units(tmp_path: Path) -> None:
    q = "shoulder_pan_joint=30deg, shoulder_lift_joint=-90deg, elbow_joint=90deg, wrist_1_joint=0,"
    q += "wrist_2_joint=pi/2 , wrist_3_joint=0"
    at = library.load("ur5").placement(q, "tool0")[:3, 3]
    for command in ("imu", "singular-values"):
        done = urdfkin(command, "ur5", "--q", q, "--format", "json")
        assert (done.code, done.data["q"][0][0]) == (0, math.pi / 6)
    picture = tmp_path / "way.svg"
    done = urdfkin("plot ur5 --to raedy -o", str(picture))
    assert "error: --to: unknown pose 'raedy'; did you mean ready?" in done.err
    assert urdfkin("plot ur5 --from ready --to", q, "--panel", "position", "-o", str(picture)).code == 0
    assert ", ".join(f"{x:.3g}" for x in np.round(at, 9)) in picture.read_text()
