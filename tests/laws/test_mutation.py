"""The bound is tight: a term that is off by a relative 1e-10 is caught, and so is the URDF's 12th digit."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from tests.laws.mutants import MUTANTS
from urdfkin.oracle import Oracle
from urdfkin.origin import Origin
from urdfkin.recursion.plan import make_plan
from urdfkin.robot import Robot
from urdfkin.urdf.reader import read_tree

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def caught() -> dict[str, list[str]]:
    """What `tests.laws.mutants` prints, run without the compiler."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.laws.mutants"],
        cwd=ROOT,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    answer: dict[str, list[str]] = json.loads(done.stdout)
    return answer


@pytest.mark.slow
def test_the_recursion_as_it_is_passes(caught: dict[str, list[str]]) -> None:
    assert caught["nothing"] == []


@pytest.mark.slow
@pytest.mark.parametrize("mutant", MUTANTS)
def test_a_term_that_is_off_by_1e_10_is_caught(caught: dict[str, list[str]], mutant: str) -> None:
    assert set(MUTANTS[mutant].caught_by) <= set(caught[mutant])


def robot_that_misreads(text: str, wrong: str) -> Robot:
    """A robot whose own tree was read from `wrong` and which has Pinocchio check it against `text`."""
    return Robot(read_tree(wrong.encode()), text, origin=Origin("<text>"))


@pytest.mark.parametrize("place", ["0.333", "-1.5707963267948966", "0.0825", "0.384"])
def test_a_number_that_was_misread_in_its_12th_digit_is_caught(place: str) -> None:
    text = urdfkin.load("panda").urdf
    found = re.search(rf'(?:xyz|rpy)="[^"]*{re.escape(place)}[^"]*"', text)
    assert found is not None
    exponent = int(np.floor(np.log10(abs(float(place)))))
    changed = repr(float(place) + 2.0 * 10.0 ** (exponent - 11))
    wrong = text[: found.start()] + found[0].replace(place, changed, 1) + text[found.end() :]
    robot = robot_that_misreads(text, wrong)
    q = robot.sample(5, 0)
    with pytest.raises(urdfkin.VerificationError, match="disagrees with Pinocchio's"):
        robot.placement(q, "panda_hand_tcp")
    if place != "0.333":  # below the first joint, where no Jacobian depends on it
        with pytest.raises(urdfkin.VerificationError):
            robot.jacobian(q, "panda_hand_tcp")


@pytest.mark.parametrize(
    ("before", "after", "frame"),
    [
        ('<axis xyz="0 0 1" />', '<axis xyz="0 1e-11 1" />', "panda_hand_tcp"),
        ('"panda_finger_joint1"/>', '"panda_finger_joint1" multiplier="1.0000000001"/>', "panda_rightfinger"),
        ('"panda_finger_joint1"/>', '"panda_finger_joint1" offset="1e-12"/>', "panda_rightfinger"),
    ],
)  # fmt: skip
def test_an_axis_and_a_mimic_rule_that_were_misread_are_caught(before: str, after: str, frame: str) -> None:
    text = urdfkin.load("panda").urdf
    spelled = next(
        way for way in (before, before.replace("/>", " />"), before.replace(" />", "/>")) if way in text
    )
    robot = robot_that_misreads(text, text.replace(spelled, after))
    with pytest.raises(urdfkin.VerificationError):
        robot.placement(robot.sample(20, 1), frame)


def test_pinocchio_reads_the_text_itself() -> None:
    # What the oracle computes follows the text it was given; of the tree only names and layout enter.
    robot = urdfkin.load("panda")
    moved = robot.urdf.replace('xyz="0 0 0.333"', 'xyz="0 0 0.433"')
    assert moved != robot.urdf
    q = robot.neutral()[np.newaxis]
    here, there = (Oracle(text, robot.tree).placements(q, ["panda_link1"]) for text in (robot.urdf, moved))
    assert there[0, 0, 2, 3] - here[0, 0, 2, 3] == pytest.approx(0.1)
    assert make_plan(robot.tree, [1]).lengths.sum() == pytest.approx(0.333)
