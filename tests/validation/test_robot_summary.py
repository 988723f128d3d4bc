"""Summaries of robots in a report, and the commands that compute a result again."""

import json
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any, cast
from xml.etree import ElementTree

import numpy as np
import pinocchio
import pytest

import urdfkin
from tests.cli.running import good
from tests.cli.running import urdfkin as command
from tests.reading import present
from tests.robots.odd_urdfs import urdf_of
from tests.urdfs import joint, limit
from tests.urdfs import robot as robot_of
from urdfkin.dh import make_dh_table
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import catalogue
from urdfkin.validation import robot_summary
from urdfkin.validation.campaign import validate
from urdfkin.validation.chunk import Timings
from urdfkin.validation.results import RobotReport
from urdfkin.validation.robot_summary import MAX_CHAINS, make_chains
from urdfkin.verify.pinocchio import PinocchioOracle

pytestmark = pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")


def test_the_chains_of_a_catalogue_robot_are_its_limbs_checked_in_both_conventions() -> None:
    robot = urdfkin.load("talos")
    chains: Any = make_chains(robot, robot.verifier.oracle())
    assert [chain["limb"] for chain in chains] == ["left_arm", "right_arm", "left_leg", "right_leg", "head"]
    for chain in chains:
        assert chain["samples"] >= 10
        assert 0.0 < chain["worst"] < 50.0
        assert chain["bound_ratio"] < 1.0
        joints = [row["joint"] for row in chain["standard"]["rows"]]
        assert joints == [row["joint"] for row in chain["modified"]["rows"]]


def test_other_robots_have_one_chain_to_a_leaf_for_each_set_of_joints() -> None:
    robot = urdfkin.load(urdfkin.load("talos").urdf)
    chains = make_chains(robot, None)
    sets = [tuple(row["joint"] for row in chain["standard"]["rows"]) for chain in chains]
    assert len(sets) == len(set(sets)) <= MAX_CHAINS
    assert all(chain["limb"] is None and chain["samples"] == 0 for chain in chains)


def test_computing_times_add_up_to_the_time_of_a_robot() -> None:
    robot = validate("ur5", samples=10).robots[0]
    parts = present(robot.timings).as_dict()
    assert all(seconds > 0.0 for seconds in parts.values())
    np.testing.assert_allclose(sum(parts.values()), robot.seconds, rtol=0.02, atol=1e-3)
    both = Timings(1.0, 2.0, 3.0, 4.0) + Timings(10.0, 20.0, 30.0, 40.0)
    assert both == Timings(11.0, 22.0, 33.0, 44.0)


@pytest.mark.parametrize("wrong", ["standard", "modified"])
def test_a_wrong_table_of_one_convention_fails_the_robot(wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = urdfkin.load("ur5")
    (good,) = cast("Any", make_chains(robot, robot.verifier.oracle()))
    shifted = np.eye(4)
    shifted[0, 3] = 1e-9

    def shifted_table(tree: Any, tip: Any, base: Any, convention: str) -> object:
        table = make_dh_table(tree, tip, base, convention)
        return replace(table, tool=table.tool @ shifted) if convention == wrong else table

    monkeypatch.setattr(robot_summary, "make_dh_table", shifted_table)
    (bad,) = cast("Any", make_chains(robot, robot.verifier.oracle()))
    assert bad["metres"] == pytest.approx(1e-9, rel=1e-3)
    assert bad["worst"] > 1e4 * good["worst"]
    assert bad["bound_ratio"] > 1.0 > good["bound_ratio"]
    report = validate("ur5", samples=0).robots[0]
    assert (report.failed, report.verdict) == (0, "disagrees")


def test_an_infinite_disagreement_is_null_in_the_document(monkeypatch: pytest.MonkeyPatch) -> None:
    right = PinocchioOracle.placements

    def wrong(*args: object) -> object:
        T = right(*args).copy()  # type: ignore[arg-type]
        T[..., 3, 0] = 1e-3
        return T

    monkeypatch.setattr(PinocchioOracle, "placements", wrong)
    report = validate("ur5", samples=2)
    assert not report.passed
    text = json.dumps(report.as_dict(), allow_nan=False)
    check = next(c for c in json.loads(text)["robots"][0]["checks"] if c["quantity"] == "placement")
    assert check["worst"] is None
    assert check["bound_ratio"] is None
    assert check["failed"] == check["results"]


# -- commands that compute a result again ----------------------------------------------------------


#: A link and another joint have the same name.
TEXT = robot_of(
    joint("turn", "revolute", "base", "b", 'xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"', "0 1 1", limit()),
    joint("slide", "prismatic", "b", "turn", 'xyz="0 0.7 0"', "1 2 0", limit()),
)


def replay_all(report: RobotReport, stdin: str = "") -> int:
    """Run each command in a robot's report, and return the number of commands."""
    lines = [line for key in report.error_stats if (line := report.replay(key)) is not None]
    for line in lines:
        words = shlex.split(line)
        assert words[0] == "urdfkin"
        good(*words[1:], "--format", "json", stdin=stdin)
    return len(lines)


@pytest.mark.slow
@pytest.mark.parametrize("root_joint", [None, "planar"])
def test_the_commands_for_a_text_read_the_text_from_standard_input(root_joint: str | None) -> None:
    report = validate(TEXT, samples=2, root_joint=root_joint).robots[0]
    assert report.source == "<text>"
    assert replay_all(report, TEXT) > 10


def test_a_command_computes_the_compared_joint_and_not_a_link_with_the_same_name() -> None:
    robot = urdfkin.load(TEXT)
    report = validate(robot, samples=2).robots[0]
    key = next(key for key in report.error_stats if key[0] == "joint jacobian" and report.replay(key))
    case, line = present(report.error_stats[key].case), present(report.replay(key))
    done = command(*shlex.split(line)[1:], "--format", "json", stdin=TEXT)
    expected = robot.jacobian(case.q, f"joint:{case.frame}", key[1])
    assert np.allclose(done.data["result"][0], expected, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("loaded", [False, True])
def test_a_path_is_a_file_even_if_a_catalogue_robot_has_this_name(
    loaded: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("panda").write_text(TEXT, encoding="utf-8")
    source: Path | Robot = urdfkin.load(Path("panda")) if loaded else Path("panda")
    report = validate(source, samples=0)
    assert report.robots[0].name == "r"
    assert report.command == "urdfkin validate ./panda --samples 0 --seed 0"
    assert replay_all(report.robots[0]) > 10


def test_the_command_of_a_report_repeats_the_run_with_a_line_for_each_set_of_options(tmp_path: Path) -> None:
    floating, texts = urdfkin.load("ur5", root_joint="floating"), map(urdf_of, ("single_link", "odd_names"))
    report = validate(["planar_two_link", floating, "ur3", *texts], samples=0)
    assert report.passed
    assert report.command.splitlines() == [
        "urdfkin validate planar_two_link ur3 - --samples 0 --seed 0",
        "urdfkin validate ur5 --samples 0 --seed 0 --root-joint floating",
        "urdfkin validate - --samples 0 --seed 0",
    ]
    first = validate(["planar_two_link", TEXT], samples=3, seed=5)
    path = tmp_path / "again.json"
    good(*shlex.split(first.command)[1:], "--json", str(path), stdin=TEXT)
    again = json.loads(path.read_text("utf-8"))
    assert [robot["name"] for robot in again["robots"]] == ["planar_two_link", "r"]
    worst, worst_again = (
        [robot["checks"][0]["worst"] for robot in each["robots"]] for each in (first.as_dict(), again)
    )
    assert worst == worst_again


def test_the_command_of_a_robot_that_cannot_be_loaded_has_the_locks_and_the_xacro_arguments(
    tmp_path: Path,
) -> None:
    report = validate("ur5", samples=0, lock={"nope": 1})
    assert report.robots[0].verdict == "bad input"
    assert report.command == "urdfkin validate ur5 --samples 0 --seed 0 --lock nope=1.0"
    xacro = tmp_path / "missing.xacro"
    report = validate(str(xacro), samples=0, xacro_args={"arm": "left one"})
    assert report.robots[0].verdict == "bad input"
    assert "--xacro-arg 'arm:=left one'" in report.command


def test_validate_accepts_every_kind_of_source_that_load_accepts() -> None:
    path = str(catalogue()["planar_two_link"].path)
    screws = urdfkin.load("ur5").screws("tool0", "base")
    sources = [pinocchio.buildModelFromUrdf(path), ElementTree.parse(path), screws]
    for source in sources:
        report = validate([source], samples=1).robots[0]
        assert report.verdict == "verified", report.reason
        assert len(report.joints) == len(urdfkin.load(source).joint_names)


def test_a_loaded_robot_with_other_options_is_not_validated() -> None:
    for source in ("ur5", catalogue()["planar_two_link"].path):
        robot = urdfkin.load(source)
        for options in ({"root_joint": "floating"}, {"mimic": False}):
            report = validate([robot, "ur5"], samples=1, **options)
            assert [one.verdict for one in report.robots] == ["bad input", "verified"]
            assert f"`{next(iter(options))}` has no effect on a loaded robot" in str(report.robots[0].reason)
        assert validate(urdfkin.load(source, root_joint="planar"), samples=1, root_joint="planar").passed
        assert validate(robot, samples=1, mimic=True).passed


def test_a_robot_with_a_second_oracle_is_compared_with_it_in_a_validation() -> None:
    pytest.importorskip("mujoco")
    for source in ("planar_two_link", str(catalogue()["planar_two_link"].path)):
        report = validate(urdfkin.load(source, oracle="mujoco"), samples=1)
        assert all(stats.cross_check for stats in report.robots[0].stats_of("placement"))


def test_a_report_refuses_an_unknown_quantity_or_key() -> None:
    report = validate("planar_two_link", samples=1).robots[0]
    with pytest.raises(urdfkin.UnknownNameError, match="did you mean placement") as error:
        report.stats_of("placment")
    assert "unknown quantity 'placment'" in str(error.value)
    keys: list[Any] = [("placment", "world"), ("velocity", "global"), "velocity", ["velocity"], None]
    for key in keys:
        with pytest.raises(urdfkin.InputError, match="the report does not contain this key"):
            report.replay(key)
