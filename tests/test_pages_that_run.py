"""The code of the pages runs with the printed output; statements about other libraries are correct."""

import re
import shlex
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import urdfkin
from tests.cli.running import urdfkin as urdfkin_command
from tests.pages import DOCS, blocks, pages, run
from tests.reading import present
from urdfkin.cli import cli
from urdfkin.model.tree import FloatArray

PAGE = (DOCS / "accelerations.md").read_text(encoding="utf-8")
Q, V, A = np.array([np.pi / 2.0, 0.5]), np.array([2.0, 0.3]), np.zeros(2)


#: Pages whose blocks other tests run, or whose blocks cannot run in a test.
ELSEWHERE = {
    "check.md": "tests/cli/test_check_in_a_repository.py",
    "dh.md": "tests/cli/test_dh.py",
    "enclosures.md": "tests/verify/exact/test_enclosure.py",
    "campaigns.md": "a scheduler on another machine",
}


#: Pages that show files, and pages with programs that run separately.
WITH_FILES = {"calibration.md": pytest.mark.slow, "dh-at-work.md": pytest.mark.long}
#: Pattern of the first line of a file on a page: a comment with the file's name.
NAMED = re.compile(r"\A(?:#|%|<!--)\s*(\S+\.\w+)")


def runs(page: str) -> bool:
    shown = any(kind in ("python", "console") for kind, _ in blocks(page))
    return shown and page not in ELSEWHERE and page not in WITH_FILES


def loose(text: str) -> str:
    """Return a text without blanks at the ends of lines."""
    return re.sub(r"[ \t]+$", "", text, flags=re.MULTILINE)


def pattern(shown: str) -> re.Pattern[str]:
    """Return the pattern of an output on a page, in which `...` matches any text."""
    return re.compile(".*?".join(map(re.escape, loose(shown).strip("\n").split("..."))), re.DOTALL)


@pytest.mark.parametrize("page", [pytest.param(page, marks=mark) for page, mark in WITH_FILES.items()])
def test_every_example_with_files_prints_the_shown_output(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    ran = 0
    for kind, text in blocks(page):
        named = NAMED.match(text)
        if named:
            Path(named[1]).write_text(text, "utf-8")
        if kind == "console":
            for example in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
                command, _, shown = example.partition("\n")
                words, _, file = command.partition(" > ")
                done = urdfkin_command(*shlex.split(words)[1:])
                refused = shown.startswith("urdfkin: error")
                assert done.code == 3 * refused or page != "calibration.md", (command, done.err)
                if file:
                    Path(file).write_text(done.text, "utf-8")
                else:
                    printed = loose(done.err if refused else done.text + done.err)
                    assert pattern(shown).search(printed), f"{command}\n{printed}"
                ran += 1
        elif kind == "python":
            program = [sys.executable, "-W", "error", "-c", text]
            alone = subprocess.run(program, capture_output=True, text=True, check=False)
            assert alone.returncode == 0, alone.stderr
        else:
            assert named, f"a block of {page} is not run: {text}"
    assert ran >= 6
    assert not Path("no.urdf").exists()


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in pages() if runs(page)])
def test_each_block_prints_the_output_below_it(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with np.printoptions(), warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)  # examples of mistakes
        for block in run(page):
            assert block.agrees(), f"{block.code}\n{block.printed}"


@pytest.mark.parametrize("page", [page for page in ELSEWHERE if page in pages()])
def test_a_page_that_another_test_runs_is_named_in_that_test(page: str) -> None:
    where, name = ELSEWHERE[page], page.removesuffix(".md")
    assert not where.startswith("tests/") or name in (DOCS.parent / where).read_text("utf-8")


def rows(library: str) -> list[tuple[str, FloatArray]]:
    """Return the calls and the bead's numbers of a library in the table."""
    found, owner = [], ""
    for line in PAGE.splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) == 4:
            owner = cells[0] or owner
            numbers = re.findall(r"-?\d+(?:\.\d+)?", cells[2])
            if owner.startswith(library) and len(numbers) == 3:
                found.append((cells[1], np.array(numbers, dtype=float)))
    return found


def demand(asked: list[FloatArray], library: str) -> None:
    """Demand that a library returns the numbers of its rows."""
    for (call, numbers), theirs in zip(rows(library), asked, strict=True):
        np.testing.assert_allclose(theirs, numbers, atol=1e-12, err_msg=call)


def wheel() -> str:
    return present(re.search(r'"""(<robot.*?</robot>)"""', PAGE, re.DOTALL))[1]


def test_the_statements_about_pinocchio_are_true() -> None:
    model = pin.buildModelFromXML(wheel(), mimic=False)
    q = urdfkin.load(wheel()).to_pinocchio(Q)
    data, frame, aligned = model.createData(), model.getFrameId("bead"), pin.LOCAL_WORLD_ALIGNED
    pin.forwardKinematics(model, data, q, V, A)
    pin.computeJointJacobiansTimeVariation(model, data, q, V)
    rates = [pin.getFrameJacobianTimeVariation(model, data, frame, r) @ V for r in (aligned, pin.WORLD)]
    asked = [
        pin.getFrameClassicalAcceleration(model, data, frame, aligned).linear,
        pin.getFrameAcceleration(model, data, frame, aligned).linear,
        *(rate[:3] for rate in rates),
    ]
    demand(asked, "Pinocchio")
    (own,) = rows("urdfkin")
    np.testing.assert_allclose(urdfkin.load(wheel()).acceleration(Q, V, A, "bead")[:3], own[1], atol=1e-12)


def test_the_statements_about_mujoco_are_true() -> None:
    mujoco = pytest.importorskip("mujoco")
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    link = rf'\1><inertial><mass value="1"/>{inertia}</inertial></link>'
    spec = mujoco.MjSpec.from_string(re.sub(r'(<link name="\w+")/>', link, wheel()))
    spec.body("bead").add_site(name="bead")
    for name in ("FRAMELINACC", "ACCELEROMETER"):
        kind = getattr(mujoco.mjtSensor, f"mjSENS_{name}")
        spec.add_sensor(name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="bead")
    model = spec.compile()
    data, J_rate = mujoco.MjData(model), np.zeros((3, 2))
    data.qpos[:], data.qvel[:], data.qacc[:] = Q, V, A
    mujoco.mj_inverse(model, data)
    mujoco.mj_jacDot(model, data, J_rate, None, data.site("bead").xpos, model.body("bead").id)
    demand([J_rate @ V, data.sensor("FRAMELINACC").data, data.sensor("ACCELEROMETER").data], "MuJoCo")


def table_rows(heading: str) -> list[list[str]]:
    """Return the rows of a table of docs/coming-from.md: the code in each cell."""
    section = (DOCS / "coming-from.md").read_text("utf-8").split(f"\n## {heading}")[1].split("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("| ")][1:]
    return [re.findall(r"`([^`]+)`", line) for line in lines]


def test_the_pinocchio_code_and_the_urdfkin_code_give_the_same_result() -> None:
    (setup, *_) = (text for kind, text in blocks("coming-from.md") if kind == "python")
    names: dict[str, object] = {}
    exec(setup, names)
    told = table_rows("Pinocchio")
    assert len(told) >= 8
    for theirs, ours in told:
        a, b = eval(theirs, names), eval(ours, names)
        if isinstance(b, list | tuple):
            assert tuple(a) == tuple(b), ours
        else:
            np.testing.assert_allclose(b, a, atol=1e-13, err_msg=ours)


def own_robot() -> dict[str, object]:
    """Return the robot that the table about the Robotics Toolbox names."""
    robot = urdfkin.load("elbow")
    q, v = np.linspace(-0.6, 0.9, robot.nq), np.linspace(1, -1, robot.nv)
    return {"np": np, "urdfkin": urdfkin, "robot": robot, "path": str(robot.path), "q": q, "v": v}


@pytest.mark.filterwarnings("ignore")  # code of the other library
def test_the_robotics_toolbox_code_and_the_urdfkin_code_give_the_same_result() -> None:
    rtb = pytest.importorskip("roboticstoolbox")
    ours = own_robot()
    theirs = ours | {"rtb": rtb, "robot": rtb.Robot.URDF(ours["path"])}
    for row in table_rows("Robotics Toolbox"):
        if row[0] == "robot.teach(q)":  # opens a window
            assert callable(rtb.Robot.teach)
            continue
        a = eval(row[0], theirs)
        if isinstance(a, np.ndarray | float):
            np.testing.assert_allclose(eval(row[1], ours), a, atol=1e-14, err_msg=row[0])


@pytest.mark.parametrize("heading", ["Robotics Toolbox", "MATLAB"])
def test_the_urdfkin_code_of_the_page_runs(heading: str) -> None:
    (setup, *_) = (text for kind, text in blocks("coming-from.md") if kind == "python")
    names: dict[str, object] = {}
    exec(setup, names)
    if heading == "Robotics Toolbox":
        names |= own_robot()
    group = cli.make_context("urdfkin", ["--help"], resilient_parsing=True)
    told = [row[-1] for row in table_rows(heading)]
    assert len(told) >= 8
    for ours in told:
        if ours.startswith("urdfkin "):
            _, name, *words = ours.split()
            command = cli.get_command(group, name)
            assert command is not None, ours
            command.make_context(name, words, parent=group)
        else:
            eval(ours, names)
