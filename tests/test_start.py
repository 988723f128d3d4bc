"""Where somebody starts who has never seen urdfkin: to the first numbers and the first answer."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import urdfkin
from tests.cli.running import urdfkin as run
from tests.pages import DOCS, blocks
from urdfkin.cli.explain import anchor, answers

README = (DOCS.parent / "README.md").read_text("utf-8")
#: The robot of the page "Start", whose file they have.
OWN = re.search(r'"""(<robot.*?</robot>)"""', blocks("index.md")[1][1], re.DOTALL)
POSE = np.radians([30.0, 90.0])  # Pinocchio's order: the shoulder first, as it is a chain


@pytest.fixture
def own(tmp_path: Path) -> Path:
    assert OWN is not None
    file = tmp_path / "mine.urdf"
    file.write_text(OWN[1], "utf-8")
    return file


def pinocchios_jacobian(file: Path) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    model = pin.buildModelFromUrdf(str(file))
    tool = model.getFrameId("tool")
    found: np.ndarray[tuple[int, ...], np.dtype[np.float64]] = pin.computeFrameJacobian(
        model, model.createData(), POSE, tool, pin.LOCAL_WORLD_ALIGNED
    )
    return found


def test_the_readme_links_to_the_start_and_to_the_questions() -> None:
    headings = [
        anchor(line[3:]) for line in (DOCS / "index.md").read_text().splitlines() if line[:3] == "## "
    ]
    (start,) = re.findall(r"\(docs/index\.md#([\w-]+)\)", README)
    assert start in headings
    assert "(docs/questions.md)" in README


def test_nothing_is_wrong_with_their_file(own: Path) -> None:
    done = run("check", str(own))
    assert done.code == 0, done.text


def test_the_start_pages_robot_has_pinocchios_jacobian(own: Path) -> None:
    robot = urdfkin.load(own)
    pose = {"elbow": np.pi / 2, "shoulder": np.radians(30)}
    J = robot.jacobian([pose[name] for name in robot.coordinate_names], "tool")
    np.testing.assert_allclose(J, pinocchios_jacobian(own), atol=1e-15)
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
