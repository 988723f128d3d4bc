"""`--trajectory FILE`: each row gives the result of the command in that configuration."""

import re
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

import urdfkin
from tests.cli.running import good, numbers, refused
from tests.cli.running import urdfkin as run
from tests.urdfs import joint
from tests.urdfs import robot as robot_of
from urdfkin.cli import cli
from urdfkin.model.tree import FloatArray
from urdfkin.verify.quantities import quantities_by_command

#: Arrays t, q, v and a
Motion = dict[str, FloatArray]
N = 9  # the forward recursion computes eight configurations at a time
COMMANDS = {
    **{name: [row.inputs] for name, row in quantities_by_command().items()},
    "analytical-jacobian": ["q", "--representation", "quaternion"],
    "singular-values": ["q", "--rows", "linear"],
    "imu": ["qva"],
}


@pytest.fixture(scope="module")
def motion() -> Motion:
    robot, rng = urdfkin.load("panda"), np.random.default_rng(5)
    v, a = rng.standard_normal((2, N, robot.nv))
    return {"t": np.cumsum(rng.uniform(0.01, 0.1, N)), "q": robot.sample(N, 2), "v": v, "a": a}


@pytest.fixture
def log(motion: Motion, tmp_path: Path) -> Path:
    return write(tmp_path / "log.csv", urdfkin.load("panda"), motion)


def write(path: Path, robot: Any, motion: Motion, time: str = "t") -> Path:
    """Write the arrays of a motion as CSV with the names of a robot or of a convention."""
    names = {"t": [time], "q": robot.coordinate_names}
    names |= {x: [f"{x}:{name}" for name in robot.velocity_names] for x in "va"}
    heads = [name for x in motion for name in names[x]]
    rows = np.column_stack(list(motion.values())).tolist()
    path.write_text("\n".join([",".join(heads), *map(numbers, rows)]))
    return path


def commands_with(*names: str) -> dict[str, set[str]]:
    """Return the parameters of every command that has one of the given parameters."""
    found: dict[str, set[str]] = {}

    def visit(command: click.Command, name: str) -> None:
        if isinstance(command, click.Group):
            context = click.Context(command)
            for one in command.list_commands(context):
                visit(command.get_command(context, one) or command, f"{name} {one}".strip())
        else:
            given = {parameter.name or "" for parameter in command.params}
            if given & set(names):
                found[name] = given

    visit(cli, "")
    return found


def test_every_command_with_joint_values_has_a_convention_and_with_a_batch_a_trajectory() -> None:
    found = commands_with("q", "trajectory", "poses")
    assert {*COMMANDS, "placement", "chain", "plot", "view", "calibrate"} <= found.keys()
    assert [name for name, given in found.items() if "convention" not in given] == []
    batches = commands_with("q").items()
    assert {name for name, given in batches if "trajectory" not in given} == {"chain"}, "one configuration"


@pytest.mark.parametrize("command", ["placement", *COMMANDS])
def test_each_row_is_bitwise_equal_to_the_result_of_the_single_command(
    command: str, motion: Motion, log: Path
) -> None:
    inputs, *options = COMMANDS.get(command, ["q"])
    words = (command, "panda", "--frame", "panda_hand", *options)
    done = good(*words, "--trajectory", str(log), "--format", "json")
    assert done.data["t"] == motion["t"].tolist()
    assert f" {N} " in done.data["check"]
    results = [key for key in done.data if key in ("result", "singular_values", "manipulability_gradient")]
    for k in (0, 3, N - 1):
        given = [f"--{x}={numbers(motion[x][k])}" for x in inputs]
        one = run(*words, *given, "--format", "json")
        for key in results:
            batch, single = done.data[key], one.data[key]
            if key == "singular_values":
                batch, single = batch["value"], single["value"]
            assert batch[k] == single[0], key


@pytest.mark.parametrize("command", ["placement", *COMMANDS])
def test_csv_has_one_row_for_each_time(command: str, motion: Motion, log: Path) -> None:
    _, *options = COMMANDS.get(command, ["q"])
    words = (command, "panda", "--frame", "panda_hand", *options, "--trajectory", str(log))
    head, *rows = run(*words, "--format", "csv").rows
    assert head[0] == "t"
    assert len({*head}) == len(head)
    table = np.array(rows, dtype=float)
    np.testing.assert_array_equal(table[:, 0], motion["t"])
    if command == "singular-values":
        assert head[1:4] == ["sigma_1", "sigma_1 lower", "sigma_1 upper"]
        return
    result = np.array(run(*words, "--format", "json").data["result"])
    np.testing.assert_array_equal(table[:, 1:], result.reshape(N, -1))
    if command == "jacobian":
        assert head[1:3] == ["vx panda_joint1", "vx panda_joint2"]


def test_every_sample_is_checked_and_a_breakdown_contains_the_times(log: Path, motion: Motion) -> None:
    line = run("velocity panda --frame panda_hand --trajectory", str(log)).text.splitlines()[-1]
    assert f"{N} velocity results, worst disagreement " in line
    assert "of the bound" in line
    words = ("acceleration", "panda", "--frame", "panda_hand", "--breakdown", "--trajectory", str(log))
    head, first, *_ = run(*words, "--format", "csv").rows
    assert head[:3] == ["t", "joint", "kind"]
    assert float(first[0]) == motion["t"][0]


def test_units_in_column_headings_are_applied_in_trajectories_and_batches(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(
        "time [ms],joint_1 [deg],joint_2_deg,v:joint_1_deg_s,v:joint_2 [deg/s]\n250,30,-7.7,90,1e1\n"
    )
    words = ("velocity", "planar_two_link", "--format", "json")
    along = run(*words, "--trajectory", str(path)).data
    one = run(*words, "--q", "30deg,-7.7deg", "--v", "90deg/s,10deg/s").data
    assert (along["result"], along["q"], along["v"]) == (one["result"], one["q"], one["v"])
    assert along["t"] == [0.25]
    (tmp_path / "q.csv").write_text("joint_2_deg,joint_1\n90,0.5\n")
    found = run("placement planar_two_link --q", f"@{tmp_path / 'q.csv'}", "--format", "json").data
    assert found["q"] == [[0.5, np.pi / 2]]


@pytest.mark.parametrize("name", ["mujoco", "drake", "isaaclab"])
def test_a_file_in_a_convention_gives_the_results_of_the_converted_robot(name: str, tmp_path: Path) -> None:
    robot = urdfkin.load("a1", root_joint="floating", verify=False)
    other, rng = robot.with_convention(name), np.random.default_rng(1)
    values = other.conversion.to(robot.sample(4, 3), *rng.standard_normal((2, 4, robot.nv)))
    given = {"t": np.arange(4.0), **dict(zip("qva", values, strict=True))}
    path = write(tmp_path / "log.csv", other, given)
    words = f"a1 --root-joint floating --frame FL_foot --convention {name} --format json --trajectory"
    for command in ("placement", "velocity", "acceleration", "jacobian", "analytical-jacobian", "imu"):
        inputs = COMMANDS.get(command, ["q"])[0]
        options = {"representation": "quaternion"} if command == "analytical-jacobian" else {}
        done = good(f"{command} {words}", str(path), *(f"--{k}={v}" for k, v in options.items()))
        method = getattr(other, command.replace("-", "_"))
        expected = method(*(given[x] for x in inputs), "FL_foot", **options)
        assert np.allclose(done.data["result"], expected, 0, 1e-12), command
        assert done.data["convention"] == name
        assert np.allclose(done.data["q"], given["q"], 0, 1e-15)


def test_singular_values_do_not_depend_on_the_convention_and_the_gradient_follows_it(tmp_path: Path) -> None:
    robot = urdfkin.load("a1", verify=False)
    mujoco, q = robot.convention("mujoco"), robot.sample(1, 4)
    words = ("singular-values", "a1", "--frame", "FL_foot", "--rows", "linear", "--format", "json")
    plain = run(*words, f"--q={numbers(q[0])}").data
    text = f"--q={numbers(mujoco.to(q)[0])}"
    found = run(*words, text, "--convention", "mujoco").data
    assert found["singular_values"] == plain["singular_values"]
    order = mujoco.velocity_permutation
    assert order is not None
    expected = np.array(plain["manipulability_gradient"])[:, order]
    assert found["manipulability_gradient"] == expected.tolist()
    assert (found["rates"], found["convention"]) == (list(mujoco.velocity_names), "mujoco")
    assert "convention mujoco" in run(*words[:-2], text, "--convention", "mujoco").text.splitlines()[0]


def test_a_placement_needs_no_time_and_does_not_unwrap_angles(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("wheel\n3.1\n")
    (tmp_path / "w.urdf").write_text(robot_of(joint("wheel", "continuous", "a", "b"), name="w"))
    words = (str(tmp_path / "w.urdf"), "--trajectory", str(path))
    assert run("placement", *words, "--format", "csv").text.splitlines()[1].startswith("0,")
    assert "at least 3 samples" in run("velocity", *words).err
    path.write_text("wheel\n3.1\n-3.1\n-3\n")
    assert run("placement", *words, "--format", "json").data["q"] == [[3.1], [-3.1], [-3.0]]
    done = run("velocity", *words, "--format", "json")
    assert done.data["q"][1][0] == pytest.approx(2 * np.pi - 3.1)
    assert "one second apart" in done.err
    assert "angle jumps by a whole turn" in done.err


def test_velocities_of_the_file_are_used_and_computed_derivatives_are_stated(
    motion: Motion, tmp_path: Path
) -> None:
    path = write(tmp_path / "log.csv", urdfkin.load("panda"), {x: motion[x] for x in "tqv"})
    words = ("panda", "--frame", "panda_hand", "--trajectory", str(path))
    velocity = run("velocity", *words, "--format", "json")
    assert velocity.data["v"] == motion["v"].tolist()
    assert "rates" not in velocity.err
    done = run("acceleration", *words)
    assert "derivatives v as given, a by central differences of v" in done.text.splitlines()[0]
    assert "largest errors about" in done.err
    assert "estimated by comparison with the results of every second sample" in done.err
    exact = run("acceleration", *words, "--format", "json").data
    np.testing.assert_array_equal(exact["a"], np.gradient(motion["v"], motion["t"], axis=0, edge_order=2))


def test_a_base_in_the_options_or_in_the_file_moves_the_robot(
    motion: Motion, log: Path, tmp_path: Path
) -> None:
    words = "placement panda --frame panda_hand --format json --trajectory"
    shifted = np.array(run(words, str(log), "--base-placement", "1,2,3,0,0,0").data["result"])
    fixed = np.array(run(words, str(log)).data["result"])
    np.testing.assert_allclose(shifted[:, :3, 3] - fixed[:, :3, 3], [[1, 2, 3]] * N, atol=1e-15)
    T = np.tile(np.eye(4), (N, 1, 1))
    T[:, 0, 3] = 1.0
    arrays: dict[str, Any] = {**motion, "base_placement": T}
    arrays |= {f"base_{name}": np.zeros((N, 6)) for name in ("velocity", "acceleration")}
    archive = tmp_path / "log.npz"
    np.savez(archive, **arrays)
    found = np.array(run(words, str(archive)).data["result"])
    np.testing.assert_allclose(found[:, 0, 3] - fixed[:, 0, 3], 1.0, atol=1e-15)
    err = refused(words, str(archive), "--base-placement", "0,0,0,0,0,0")
    assert err.count("\n") == 1
    assert "--base-placement does nothing along a --trajectory with a moving base" in err


@pytest.mark.parametrize("option", ["--q=ready", "--seed=1", "--v=random"])
def test_a_joint_value_together_with_a_trajectory_is_refused(option: str, log: Path) -> None:
    err = refused("velocity panda --trajectory", str(log), option)
    assert f"{option.partition('=')[0]} does nothing along a --trajectory" in err


#: Pattern in the file, its replacement, and the message
SPOILT = {
    "header": (r"^.*\n", "", "log.csv:1: the header is missing: the first line must name the columns"),
    "missing": ("panda_joint3,", "x3,", "missing: panda_joint3"),
    "unknown": ("panda_joint3,", "x3,", "unknown: x3"),
    "duplicate": ("panda_joint3,", "panda_joint2_deg,", "duplicate: panda_joint2, panda_j"),
    "two times": ("panda_joint3,", "time,", "duplicate: t, time"),
    "unit": ("panda_joint3,", "panda_joint3 [mm],", "[mm]: wrong unit: found mm; use rad"),
    "unit of time": ("t,", "t [h],", "t [h]: wrong unit: found h; use s"),
    "rates": ("v:panda_joint3", "v:panda_joint3 [m/s]", "use rad/s or deg/s"),
    "half": ("v:", "w:", "unknown: w:panda_joint1"),
}


@pytest.mark.parametrize("what", SPOILT)
def test_a_wrong_trajectory_file_is_reported_in_one_line(what: str, log: Path) -> None:
    right, wrong, message = SPOILT[what]
    log.write_text(re.sub(right, wrong, log.read_text(), count=1))
    err = refused("placement panda --trajectory", str(log))
    assert err.count("\n") == 1
    assert message in err


@pytest.mark.parametrize("command", ["placement", "singular-values", "chain", "imu", "view --q ready"])
def test_the_error_for_an_unknown_convention_names_the_command_that_lists_all(command: str) -> None:
    err = refused(f"{command} panda --convention mujocco")
    assert err.count("\n") == 1
    assert "unknown convention 'mujocco'; did you mean mujoco" in err
    assert "`urdfkin order ROBOT` lists all" in err


def test_a_chain_reads_q_in_a_convention_and_names_the_convention() -> None:
    robot = urdfkin.load("a1", verify=False)
    q, mujoco = robot.sample(1, 2)[0], robot.convention("mujoco")
    words = ("chain", "a1", "--base", "trunk", "--tip", "FL_foot")
    text = numbers(mujoco.to(q))
    found = run(*words, "--convention", "mujoco", "--q", text, "--format", "json").data
    plain = run(*words, "--q", numbers(q), "--format", "json").data
    assert found["path_q"] == plain["path_q"]
    assert (found["q"], found["convention"]) == (mujoco.to(q).tolist(), "mujoco")
    assert "convention mujoco" in run(*words, "--convention", "mujoco", "--q", text).text.splitlines()[0]


def test_measured_poses_in_a_convention_or_in_degrees_give_the_results_of_radians(tmp_path: Path) -> None:
    robot = urdfkin.load("planar_two_link")
    q = robot.sample(12, 1)
    p = robot.placement(q, "tip")[:, :3, 3] + [0.01, 0.0, 0.0]
    motors = tmp_path / "motors.toml"
    motors.write_text(
        'joints = ["elbow", "joint_1"]\n[joint.joint_1]\nunit = "deg"\nsign = -1\n'
        '[joint.joint_2]\nname = "elbow"\n'
    )
    found = []
    for head, values, more in (
        ("joint_1,joint_2", q, []),
        ("joint_1 [deg],joint_2_deg", np.degrees(q), []),
        ("joint_1,elbow", q * [-180.0 / np.pi, 1.0], ["--convention", str(motors)]),
    ):
        path = tmp_path / "poses.csv"
        np.savetxt(path, np.hstack([values, p]), delimiter=",", header=f"{head},x,y,z", comments="")
        done = good("calibrate planar_two_link --fit base --format json --poses", str(path), *more)
        found.append(done.data["origins"])
    for other in found[1:]:
        for place, T in found[0].items():
            np.testing.assert_allclose(other[place], T, atol=1e-9)
    table = run("calibrate planar_two_link --convention mujoco")
    assert "--convention does nothing without --poses" in table.err


@pytest.mark.slow
def test_a_plot_reads_the_motion_in_a_convention(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    robot = urdfkin.load("planar_two_link")
    how, log, picture = tmp_path / "motors.toml", tmp_path / "log.csv", tmp_path / "x.svg"
    how.write_text('joints = ["elbow", "joint_1"]\nangle = "deg"\n[joint.joint_2]\nname = "elbow"\n')
    t = np.linspace(0.0, 1.0, 5)
    write(log, robot.with_convention(how), {"t": t, "q": np.outer(t, [90.0, 30.0])})
    for given in (["--trajectory", str(log)], ["--from", "0,0", "--to", "90,30", "--samples=5"]):
        words = ("plot", "planar_two_link", "--frame", "tip", *given, "--convention", str(how))
        good(*words, "--panel", "position", "-o", str(picture))
        end = robot.placement([np.pi / 6, np.pi / 2], "tip")[:2, 3]
        assert f"to ({end[0]:.3g}, {end[1]:.3g}, 0)" in " ".join(picture.read_text().split())


@pytest.mark.slow
def test_a_hundred_thousand_rows_are_read_computed_and_checked(tmp_path: Path) -> None:
    n, robot, log, out = 100_000, urdfkin.load("ur5"), tmp_path / "log.csv", tmp_path / "v.csv"
    t = np.linspace(0.0, 100.0, n)
    rows, head = np.column_stack([t, np.sin(np.outer(t, np.arange(1, 7)))]), ["time", *robot.coordinate_names]
    np.savetxt(log, rows, delimiter=",", comments="", header=",".join(head))
    done = good("velocity ur5 --frame tool0 --trajectory", str(log), "-o", str(out))
    assert f"{n:,} velocity results" in done.err
    assert len(out.read_text().splitlines()) == n + 1
