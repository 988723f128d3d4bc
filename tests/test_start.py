"""The README, the page "Start" and the tour are correct, and a user's first steps work."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import urdfkin
from tests.cli.running import good
from tests.cli.running import urdfkin as run
from tests.pages import DOCS, blocks
from tests.reading import present
from tests.urdfs import joint, limit
from tests.urdfs import robot as robot_text
from urdfkin.cli import commands
from urdfkin.cli.explain import answers, make_anchor
from urdfkin.model.tree import FloatArray

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text("utf-8")
#: The robot of the page "Start".
OWN = re.search(r'"""(<robot.*?</robot>)"""', blocks("index.md")[1][1], re.DOTALL)
POSE = np.radians([30.0, 90.0])  # Pinocchio's order in this chain begins with the shoulder


@pytest.fixture
def own(tmp_path: Path) -> Path:
    file = tmp_path / "mine.urdf"
    file.write_text(present(OWN)[1], "utf-8")
    return file


def pinocchios_jacobian(file: Path, q: FloatArray) -> FloatArray:
    model: Any = pin.buildModelFromUrdf(str(file))
    frame = model.getFrameId("tool")
    return np.array(pin.computeFrameJacobian(model, model.createData(), q, frame, pin.LOCAL_WORLD_ALIGNED))


def test_the_readme_links_to_the_start_and_to_the_questions() -> None:
    lines = (DOCS / "index.md").read_text().splitlines()
    headings = [make_anchor(line[3:]) for line in lines if line[:3] == "## "]
    (start,) = re.findall(r"\(docs/index\.md#([\w-]+)\)", README)
    assert start in headings
    assert "(docs/questions.md)" in README


def test_the_start_pages_file_has_no_findings(own: Path) -> None:
    good("check", str(own))


def test_the_start_pages_robot_has_pinocchios_jacobian(own: Path) -> None:
    robot = urdfkin.load(own)
    pose = {"elbow": np.pi / 2, "shoulder": np.radians(30)}
    J = robot.jacobian([pose[name] for name in robot.coordinate_names], "tool")
    np.testing.assert_allclose(J, pinocchios_jacobian(own, POSE), atol=1e-15)
    assert robot.certificate().verified


def test_why_their_pinocchio_numbers_differ_is_the_first_answer_and_its_example_agrees() -> None:
    topic, answer = next(iter(answers().items()))
    assert topic == "why-do-my-pinocchio-numbers-differ"
    assert run("explain", topic).code == 0
    for reason in ("layout", "order", "mimic joints", "reference", "accelerations"):
        assert reason in answer
    kinds = [(kind, text) for kind, text in blocks("questions.md")][:3]
    names: dict[str, object] = {}
    for _, code in kinds[:2]:
        exec(code.replace("print(", "agrees = ("), names)
    assert names["agrees"] == (True, True)


# -- the README: its example, its commands and their output ----------------------------------------------


def block(language: str, page: str = README) -> str:
    """Return the first code block of a language."""
    blocks: list[str] = re.findall(rf"```{language}\n(.*?)```", page, re.DOTALL)
    return blocks[0]


def transcripts() -> list[tuple[list[str], list[str]]]:
    """Return each command of the console blocks, and the lines of its output."""
    found: list[tuple[list[str], list[str]]] = []
    for text in re.findall(r"```console\n(.*?)```", README, re.DOTALL):
        for line in text.splitlines():
            if line.startswith("$ urdfkin "):
                found.append((line.split()[2:], []))
            else:
                found[-1][1].append(line)
    return found


def masked(text: str) -> str:
    """Return a text without the disagreements, which differ between machines."""
    varying = r"worst (error |disagreement )?\S+|\S+% of|Pinocchio \S+|\d\S* of the bound"
    return re.sub(varying, "", text).strip()


def worst(text: str) -> list[float]:
    """Return the disagreements and errors in a text."""
    return [float(x) for x in re.findall(r"worst (?:error |disagreement )?([\d.]+)", text)]


def test_the_readmes_example_runs_and_is_verified() -> None:
    names: dict[str, Any] = {}
    exec(compile(block("python"), "README.md", "exec"), names)
    assert names["J"].shape == (1000, 6, 8)
    assert names["robot"].certificate().verified
    assert {line.quantity: line.checked for line in names["robot"].certificate().lines} == {
        "jacobian": 1000,
        "acceleration": 1000,
    }


def test_the_readmes_speeds_are_those_of_the_benchmark() -> None:
    rows = json.loads((ROOT / "docs" / "performance.json").read_text(encoding="utf-8"))["rows"]
    jacobians = [row for row in rows if row["quantity"] == "jacobian"]
    costs = [1 / row["ratio"] for row in jacobians if row["label"] == "urdfkin, verify=True" if row["n"] > 1]
    speeds = [
        row["ratio"] for row in jacobians if row["section"] == "batch" and row["label"] == "urdfkin, 1 thread"
    ]
    assert f"takes {min(costs):.2f} to {max(costs):.2f} times the time of the loop" in README
    assert f"one thread is {min(speeds):.0f} to {max(speeds):.0f} times as fast as the loop" in README


def test_the_page_of_conventions_has_fast_calls_that_run() -> None:
    page = (ROOT / "docs" / "conventions-used.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    exec(compile(block("python", page), "docs/conventions-used.md", "exec"), names)
    (line,) = names["robot"].certificate().lines
    assert (line.quantity, line.checked, line.unchecked) == ("jacobian", 203, 1901)


def test_every_command_has_a_row_on_the_page_of_commands() -> None:
    page = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([a-z-]+)", page, re.MULTILINE)
    assert list(dict.fromkeys(rows)) == list(commands())


def test_the_readme_shows_a_command_for_each_of_four_users() -> None:
    shown = [words[0] for words, _ in transcripts()]
    assert shown == ["dh", "acceleration", "check", "same", "export", "export"]


@pytest.mark.slow
def test_each_transcript_is_the_real_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    for words, expected in transcripts():
        for option in ("-o", "--check"):
            if option in words:
                words[words.index(option) + 1] = str(tmp_path / words[words.index(option) + 1])
        done = run(*words)
        lines = (done.text + done.err).splitlines()
        shown = [line for line in expected if line != "..."]
        assert len(lines) == len(shown) or expected[-1] == "...", words
        printed = lines[: len(shown)]
        assert [masked(line) for line in printed] == [masked(line) for line in shown], words
        # Another processor or compiler rounds differently, but an old number on the page is found.
        assert worst("\n".join(shown)) == pytest.approx(worst("\n".join(printed)), rel=0.5), words


# -- first steps with an own robot -----------------------------------------------------------------------


#: A user's robot with a continuous wheel; its joints are not in alphabetical order.
MINE = robot_text(
    joint("turntable", "continuous", "floor", "column"),
    joint("shoulder", "revolute", "column", "upper", 'xyz="0 0 0.4"', "0 1 0", limit(-2, 2)),
    joint("elbow", "revolute", "upper", "tool", 'xyz="0.3 0 0"', "0 1 0", limit(-2, 2)),
    name="mine",
)
POSE_BY_NAME = "turntable=90deg, shoulder=-30deg, elbow=45deg"


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    path = tmp_path / "mine.urdf"
    path.write_text(MINE)
    return path


def test_a_new_user_computes_the_jacobian_at_a_pose_in_degrees_by_joint_names(mine: Path) -> None:
    done = good("jacobian", str(mine), "--q", POSE_BY_NAME)
    assert all(name in done.text for name in ("jacobian of tool", "turntable", "shoulder", "elbow"))
    assert "verified by Pinocchio" in done.text
    data = run("jacobian", str(mine), "--q", POSE_BY_NAME, "--format", "json").data
    q = np.array([np.cos(np.pi / 2), np.sin(np.pi / 2), np.radians(-30), np.radians(45)])
    np.testing.assert_allclose(data["result"][0], pinocchios_jacobian(mine, q), atol=1e-15)


def test_a_new_user_displays_the_table_in_a_notebook(mine: Path) -> None:
    robot = urdfkin.load(mine)
    table = robot.dh()
    cell = table._repr_html_()
    assert "standard Denavit-Hartenberg parameters" in cell
    assert all("<td" in cell and joint in cell for joint in ("turntable", "shoulder", "elbow"))
    T = robot.placement(POSE_BY_NAME, "tool")
    np.testing.assert_allclose(table.placement(POSE_BY_NAME), T, atol=1e-15)


def test_a_new_user_finds_why_pinocchios_numbers_differ(mine: Path) -> None:
    robot = urdfkin.load(mine)
    q = pin.neutral(pin.buildModelFromUrdf(str(mine)))
    words = r"Pinocchio's q has that length: robot.from_pinocchio\(q\)"
    with pytest.raises(urdfkin.InputError, match=words) as why:
        robot.jacobian(q)
    assert "turntable, shoulder, elbow" in str(why.value)
    np.testing.assert_array_equal(robot.from_pinocchio(q), robot.neutral())
    page = (DOCS / "conventions-used.md").read_text(encoding="utf-8")
    for answer in ("LOCAL_WORLD_ALIGNED", "classical one", "[linear; angular]", "from_pinocchio"):
        assert answer in page
    assert "not the order of the file" in page


# -- docs/tour.md ----------------------------------------------------------------------------------------


TOUR = (DOCS / "tour.md").read_text(encoding="utf-8")


def test_every_picture_exists_and_has_a_description() -> None:
    pictures = re.findall(r"!\[(.+?)\]\((.+?)\)", TOUR)
    assert len(pictures) >= 8
    for described, file in pictures:
        assert len(described) > 20
        assert (DOCS / file).read_text(encoding="utf-8").lstrip().startswith("<?xml")


def test_the_tour_covers_every_section_of_the_chapter() -> None:
    for section in ("7.1", "7.2", "7.3", "7.4", "7.5", "7.6", "7.7"):
        assert re.search(rf"^## .*{re.escape(section)}\b", TOUR, re.MULTILINE), section


@pytest.mark.slow
def test_the_pictures_can_be_drawn_again(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from scripts import make_tour

    make_tour.main(tmp_path)
    drawn = {path.name for path in tmp_path.iterdir()}
    assert drawn == {Path(file).name for _, file in re.findall(r"!\[(.+?)\]\((.+?)\)", TOUR)}
