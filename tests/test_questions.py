"""The page of questions answers what people ask, and what a message leads to is there."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from tests.cli.running import urdfkin as run
from tests.pages import DOCS
from urdfkin.cli.questions import answers
from urdfkin.errors import UrdfkinError
from urdfkin.errors.questions import Question
from urdfkin.urdf import xacro
from urdfkin.verify.pinocchio_module import _impostor

WHEEL = """<robot name="wheel"><link name="a"/><link name="b"/><link name="c"/>
<joint name="axle" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
<joint name="cap" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>
<limit lower="-9" upper="9" effort="1" velocity="1"/><mimic joint="axle" multiplier="2"/></joint></robot>"""


def _without_xacrodoc() -> object:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(xacro, "find_spec", lambda _: None)
        return xacro.expand(Path(__file__), {})


#: What leads to each question: a call that raises.
ASKED: dict[Question, list[Callable[[], object]]] = {
    Question.CONTINUOUS_JOINTS: [
        lambda: urdfkin.load(WHEEL).from_pinocchio([0.3, 0.3, 0.6]),
    ],
    Question.MIMIC_JOINTS: [lambda: urdfkin.load(WHEEL).from_pinocchio([1.0, 0.0, 0.5])],
    Question.REFERENCE_FRAMES: [lambda: urdfkin.load("ur5").jacobian(np.zeros(6), "tool0", "body")],
    Question.WHICH_DH_CONVENTION: [lambda: urdfkin.load("ur5").dh(convention="classic")],
    Question.XACRO: [_without_xacrodoc],
    Question.WRONG_PINOCCHIO: [lambda: _raised(_impostor(np))],
}


def _raised(error: Exception) -> None:
    raise error


@pytest.mark.slow
@pytest.mark.parametrize("question", Question, ids=lambda question: question.value)
def test_a_message_leads_to_a_section_that_stands_on_the_page(question: Question) -> None:
    for call in ASKED[question]:
        with pytest.raises(UrdfkinError) as raised:
            call()
        topics = re.findall(r"`urdfkin explain ([a-z-]+)` says more", str(raised.value))
        assert topics == [question.value]
        done = run("explain", *topics)
        assert done.code == 0
        assert len(done.text.splitlines()) > 3
        assert "](" not in done.text


def test_every_link_to_a_question_leads_to_one() -> None:
    for path in (*DOCS.rglob("*.md"), DOCS.parent / "README.md"):
        for topic in re.findall(r"questions\.md#([\w-]+)", path.read_text("utf-8")):
            assert topic in answers(), path


def test_what_people_ask_most_comes_first() -> None:
    """The fifteen pains that came up most in public trackers, in their order, and what else was asked."""
    assert list(answers())[1:16] == [
        *("reference-frames", "two-accelerations", "joint-order", "continuous-joints", "mimic-joints"),
        *("packages-and-meshes", "urdf-to-dh", "which-dh-convention", "dh-and-urdf-disagree"),
        *("unknown-frames", "stale-data", "row-order", "errors-in-a-file", "fixed-joints"),
        "the-wrong-pinocchio",
    ]
    assert len(answers()) >= 23


def test_every_answer_but_commands_has_an_example_that_runs() -> None:
    without = {topic for topic, text in answers().items() if "```" not in text}
    assert without <= {"xacro-without-ros"}
