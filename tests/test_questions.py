"""The page of questions has correct answers, and every section that a message names exists."""

import re
import textwrap
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from tests import urdfs
from tests.cli.running import good
from tests.cli.running import urdfkin as run
from tests.pages import DOCS
from tests.urdfs import joint, limit, mimic
from urdfkin.cli.explain import answers, find_answer, format_answer
from urdfkin.errors import QuestionsSection, UrdfkinError
from urdfkin.urdf import xacro
from urdfkin.verify.pinocchio import _make_wrong_module_error

WHEEL = urdfs.robot(
    joint("axle", "continuous", "a", "b"),
    joint("cap", "revolute", "b", "c", more=limit(-9, 9) + mimic("axle", 2)),
    name="wheel",
)


def _without_xacrodoc() -> object:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(xacro, "find_spec", lambda _: None)
        return xacro.expand(Path(__file__), {})


AXES = QuestionsSection.AXES.value


def _typed(*words: str) -> Callable[[], str]:
    """Return the output of a command, with the message if it fails."""
    return lambda: (done := run(*words)).text + done.err


def _raised(call: Callable[[], object]) -> Callable[[], str]:
    """Return the message of the exception that a call raises."""

    def message() -> str:
        with pytest.raises(UrdfkinError) as raised:
            call()
        assert raised.value.question is not None
        return str(raised.value)

    return message


def _ur5() -> urdfkin.Robot:
    return urdfkin.load("ur5")


def _wheel() -> urdfkin.Robot:
    return urdfs.loaded(WHEEL)


def _warned(act: Callable[[], object]) -> str:
    with pytest.warns(urdfkin.DegreesWarning) as caught:
        act()
    return str(caught[0].message)


#: For each question: the message or the page that names it.
ASKED: dict[QuestionsSection, list[Callable[[], str]]] = {
    QuestionsSection.REFERENCE_FRAMES: [
        _raised(lambda: _ur5().jacobian(np.zeros(6), "tool0", "body")),
        _typed("jacobian", "ur5", "--reference", "body"),
    ],
    QuestionsSection.TWO_ACCELERATIONS: [_typed("acceleration", "--help")],
    QuestionsSection.JOINT_ORDER: [
        _raised(lambda: _ur5().jacobian(np.zeros(7))),
        _raised(lambda: _ur5().jacobian("1, 2, 3")),
        _typed("info", "talos"),
    ],
    QuestionsSection.CONTINUOUS_JOINTS: [
        _raised(lambda: _wheel().from_pinocchio([0.3, 0.3, 0.6])),
        _raised(lambda: _wheel().from_pinocchio([0.3])),
        _raised(lambda: _wheel().placement([1.0, 0.0, 0.5])),
    ],
    QuestionsSection.MIMIC_JOINTS: [
        _raised(lambda: _wheel().from_pinocchio([1.0, 0.0, 0.5])),
        _raised(lambda: _wheel().placement({"axle": 1.0, "cap": 2.0})),
        _raised(lambda: urdfkin.load("panda").placement(np.zeros(9))),
        _typed("explain", "mimic-loop"),
    ],
    QuestionsSection.PACKAGES_AND_MESHES: [
        _raised(lambda: urdfkin.load("package://nowhere/arm.urdf")),
        _typed("explain", "URDF706"),
    ],
    QuestionsSection.URDF_TO_DH: [_typed("dh", "--help")],
    QuestionsSection.WHICH_DH_CONVENTION: [_raised(lambda: _ur5().dh(convention="classic"))],
    QuestionsSection.DH_AND_URDF_DISAGREE: [
        _typed("dh", "ur10", "--compare", "ur5"),
        _raised(lambda: urdfkin.load("ur10").dh("tool0", "base", like=_ur5().dh("tool0", "base"))),
    ],
    QuestionsSection.UNKNOWN_FRAMES: [_raised(lambda: _ur5().placement(np.zeros(6), "tol0"))],
    QuestionsSection.ROW_ORDER: [_raised(lambda: urdfkin.BaseMotion(velocity=np.zeros(3)))],
    QuestionsSection.FIXED_JOINTS: [_raised(lambda: _ur5().placement("neutral, ee_fixed_joint=1"))],
    QuestionsSection.WRONG_PINOCCHIO: [_raised(lambda: _raise(_make_wrong_module_error(np)))],
    QuestionsSection.AXES: [_typed("explain", "axis-not-unit")],
    QuestionsSection.XACRO: [_raised(_without_xacrodoc), _typed("explain", "unexpanded-xacro")],
    QuestionsSection.GRAVITY: [_typed("acceleration", "--help"), _typed("imu", "--help")],
    QuestionsSection.FLOATING_BASES: [
        _raised(lambda: urdfs.loaded(WHEEL, root_joint="floating").placement({"root_joint": np.zeros(6)}))
    ],
    QuestionsSection.LOCKED_JOINTS: [
        _raised(lambda: urdfkin.load("panda").with_locked_joints("ready")),
        _raised(lambda: _ur5().with_locked_joints({"elbow_joint": 1.0}).placement({"elbow_joint": 1.0})),
    ],
    QuestionsSection.DEGREES: [lambda: _warned(lambda: _ur5().integrate(np.full(6, 40.0), np.zeros(6)))],
    QuestionsSection.SINGULARITY: [_typed("singular-values", "--help")],
}


def _raise(error: Exception) -> None:
    raise error


@pytest.mark.slow
@pytest.mark.parametrize("question", QuestionsSection, ids=lambda question: question.value)
def test_messages_about_common_mistakes_name_an_existing_section(
    question: QuestionsSection,
) -> None:
    for told in ASKED[question]:
        assert f"`urdfkin explain {question.value}`" in " ".join(told().split()).replace("- ", "-")
    text = good("explain", question.value).text
    assert len(text.splitlines()) > 3
    assert "](" not in text


def test_a_message_names_the_section_of_each_common_problem() -> None:
    """No message names `stale-data`; messages about a file contain the codes of findings instead."""
    led = {question.value for question in ASKED}
    assert set(list(answers())[1:16]) - led == {"stale-data", "errors-in-a-file"}


def test_one_word_is_enough_to_find_a_question() -> None:
    for words, topic in (("mimic", "mimic-joints"), ("Meshes", "packages-and-meshes"), ("unit axes", AXES)):
        assert find_answer(words) == answers()[topic]
    assert find_answer("frames") is None  # two questions contain the word
    assert find_answer("") is None
    assert run("explain", "mimic").text.startswith("Mimic joints\n")
    assert run("explain", "frames").code == 2


@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")  # one answer is about a warning
@pytest.mark.parametrize("topic", answers())
def test_an_answer_on_a_terminal_is_wrapped_and_its_code_runs(topic: str) -> None:
    shown = format_answer(answers()[topic])
    assert "`" * 3 not in shown
    assert all(len(line) <= 88 for line in shown.splitlines() if not line.startswith("    "))
    own = "".join(re.findall(r"```python\n(.*?)```", answers()[topic], re.DOTALL))
    assert ("It runs after:" in shown) == bool(own)
    if own:
        names: dict[str, object] = {}
        exec(textwrap.dedent(shown.partition("It runs after:")[2]), names)
        exec(own, names)


def test_every_link_to_a_question_points_to_an_existing_one() -> None:
    for path in (*DOCS.rglob("*.md"), DOCS.parent / "README.md"):
        for topic in re.findall(r"questions\.md#([\w-]+)", path.read_text("utf-8")):
            assert topic in answers(), path


def test_the_most_frequent_questions_come_first() -> None:
    """The page begins with the fifteen most frequent problems in public issue trackers, in this order."""
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
