"""What a report tells to type is a command that works: for each worst case, and for the whole run."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from tests.cli.running import urdfkin as command
from tests.robots.odd_urdfs import urdf_of
from urdfkin.robot import Robot
from urdfkin.validation.campaign import validate
from urdfkin.validation.results import RobotReport

#: A link is called as a joint elsewhere, so that a replay line has to say which it means.
TEXT = """<robot name="r"><link name="base"/><link name="b"/><link name="turn"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="b"/>
<origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/><axis xyz="0 1 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="slide" type="prismatic"><parent link="b"/><child link="turn"/>
<origin xyz="0 0.7 0"/><axis xyz="1 2 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


def replayed(report: RobotReport, stdin: str = "") -> int:
    """Run every line of a robot's report; how many there were."""
    lines = [line for key in report.tallies if (line := report.replay(key)) is not None]
    for line in lines:
        words = shlex.split(line)
        assert words[0] == "urdfkin"
        done = command(*words[1:], "--format", "json", stdin=stdin)
        assert done.code == 0, (line, done.err)
    return len(lines)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
@pytest.mark.parametrize("root_joint", [None, "planar"])
def test_every_line_of_a_text_works_with_the_text_on_standard_input(root_joint: str | None) -> None:
    report = validate(TEXT, samples=2, root_joint=root_joint).robots[0]
    assert report.source == "<text>"
    assert replayed(report, TEXT) > 10


@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
def test_a_line_computes_the_joint_that_was_compared_and_not_the_link_of_its_name() -> None:
    robot = urdfkin.load(TEXT)
    report = validate(robot, samples=2).robots[0]
    for (quantity, reference), tally in report.tallies.items():
        line = report.replay((quantity, reference))
        if quantity != "joint jacobian" or line is None or tally.case is None:
            continue
        done = command(*shlex.split(line)[1:], "--format", "json", stdin=TEXT)
        expected = robot.jacobian(tally.case.q, f"joint:{tally.case.frame}", reference)
        assert np.allclose(done.data["result"][0], expected, atol=1e-12)
        return
    pytest.fail("no joint was compared")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
@pytest.mark.parametrize("loaded", [False, True])
def test_a_file_called_as_a_robot_of_the_catalogue_stays_a_file(
    loaded: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("panda").write_text(TEXT, encoding="utf-8")
    source: Path | Robot = urdfkin.load(Path("panda")) if loaded else Path("panda")
    report = validate(source, samples=0)
    assert report.robots[0].name == "r"
    assert report.command == "urdfkin validate ./panda --samples 0 --seed 0"
    assert replayed(report.robots[0]) > 10


def test_the_run_is_repeated_by_a_command_for_robots_with_the_same_options() -> None:
    floating = urdfkin.load("ur5", root_joint="floating")
    report = validate(
        ["planar_two_link", floating, "ur3", urdf_of("single_link"), urdf_of("odd_names")], samples=0
    )
    assert report.command.splitlines() == [
        "urdfkin validate planar_two_link ur3 - --samples 0 --seed 0",
        "urdfkin validate ur5 --samples 0 --seed 0 --root-joint floating",
        "urdfkin validate - --samples 0 --seed 0",
    ]


@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
def test_the_command_of_a_run_over_a_text_repeats_it(tmp_path: Path) -> None:
    first = validate(["planar_two_link", TEXT], samples=3, seed=5)
    path = tmp_path / "again.json"
    done = command(*shlex.split(first.command)[1:], "--json", str(path), stdin=TEXT)
    assert done.code == 0, done.err
    again = json.loads(path.read_text("utf-8"))
    assert [robot["name"] for robot in again["robots"]] == ["planar_two_link", "r"]
    assert [robot["checks"][0]["worst"] for robot in again["robots"]] == [
        robot["checks"][0]["worst"] for robot in first.as_dict()["robots"]
    ]
