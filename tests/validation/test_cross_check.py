"""A second oracle: three answers to each question, and it is found who stands alone."""

import itertools
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.urdf.lint.cases.arm import arm
from urdfkin.model.tree import FloatArray
from urdfkin.report.html import as_html
from urdfkin.report.junit import as_junit
from urdfkin.report.markdown import as_markdown
from urdfkin.report.reading import checked, contradictions
from urdfkin.validation import comparison
from urdfkin.validation.campaign import validate
from urdfkin.validation.document import Document
from urdfkin.validation.error_stats import CrossCheck, OraclePair, cross_check, plus, tally
from urdfkin.verify.bounds import Bound
from urdfkin.verify.mujoco import MujocoOracle
from urdfkin.verify.pinocchio import PinocchioOracle

EPS = np.finfo(float).eps
FIRST = Bound(np.ones((1, 1, 1)), np.full((1, 1, 1), 4.0))
SECOND = Bound(np.full((1, 1, 1), 2.0), np.full((1, 1, 1), 8.0))


def asked(ours: float, pinocchios: float, second_oracle: float) -> CrossCheck:
    one, two, three = (np.full((1, 1, 1), 1.0 + x * EPS) for x in (ours, pinocchios, second_oracle))
    return cross_check("mujoco", one, two, three, FIRST, SECOND)


#: Three answers, who stands alone, and how many cases are undecided.
ALONE = [
    ((0, 4, 16), (0, 0, 0), 0), ((100, 0, 0), (1, 0, 0), 0), ((0, 100, 0), (0, 1, 0), 0),
    ((0, 0, 100), (0, 0, 1), 0), ((0, 100, 300), (0, 0, 0), 1), ((0, 8, 16), (0, 0, 0), 1),
    ((0, np.nan, 0), (0, 1, 0), 0), ((0, 0, np.inf), (0, 0, 1), 0),
]  # fmt: skip


@pytest.mark.parametrize(("answers", "alone", "undecided"), ALONE)
def test_who_disagrees_with_two_that_agree_stands_alone(
    answers: tuple[float, float, float], alone: tuple[int, int, int], undecided: int
) -> None:
    found = asked(*answers)
    assert (found.alone, found.undecided) == (alone, undecided)


def test_sums_add_up_in_any_order() -> None:
    some = [asked(*answers) for answers in ((0, 4, 16), (100, 0, 0), (0, 100, 300))]
    sums = set()
    for order in itertools.permutations(some):
        total: CrossCheck | None = None
        for one in order:
            total = plus(total, one)
        sums.add(total)
    (total,) = sums
    assert total is not None
    assert total.alone == (1, 0, 0)
    assert total.undecided == 1
    assert total.urdfkin.failed == 2


#: Bounds: urdfkin and Pinocchio 4 eps, urdfkin and the second oracle 16 eps, the two oracles 20 eps.
@pytest.mark.parametrize(
    ("answers", "agree"),
    [
        ((0, 4, 4), (True, True, True)), ((0, 5, 4), (False, True, True)), ((0, 4, 16), (True, True, True)),
        ((0, 4, 17), (True, False, True)), ((0, -4, 16), (True, True, True)),
        ((0, -4, 17), (True, False, False)), ((0, -5, 16), (False, True, False)),
    ],
)  # fmt: skip
def test_two_answers_agree_up_to_their_bound_and_no_further(
    answers: tuple[float, float, float], agree: tuple[bool, bool, bool]
) -> None:
    found, (ours, pinocchios, second_oracle) = asked(*answers), answers
    _, ours_second, theirs_second = agree
    assert (found.urdfkin.failed, found.pinocchio.failed) == (not ours_second, not theirs_second)
    assert found.urdfkin.share_of_bound == abs(ours - second_oracle) / 16
    assert found.pinocchio.share_of_bound == abs(pinocchios - second_oracle) / 20
    assert found.urdfkin.worst == abs(ours - second_oracle) / 2
    # If two of the three agree, and no others, the third stands alone.
    assert found.alone == (agree[::-1] if sum(agree) == 1 else (0, 0, 0))
    assert found.undecided == (sum(agree) in (0, 2))


def test_of_several_blocks_the_worst_disagreement_is_kept() -> None:
    small, large = asked(0, 2, 6), asked(0, -4, 14)
    for total in (small + large, large + small):
        assert total.urdfkin == OraclePair(0, large.urdfkin.worst, large.urdfkin.share_of_bound)
        assert total.pinocchio == OraclePair(0, large.pinocchio.worst, large.pinocchio.share_of_bound)
    assert small.urdfkin.worst < large.urdfkin.worst
    assert small.pinocchio.share_of_bound < large.pinocchio.share_of_bound


def document_of(**changes: Any) -> Document:
    report = validate(arm(), samples=3, oracle="mujoco", **changes)
    return checked(report.as_dict(), "the report")


def test_each_pair_is_measured_against_its_own_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    bounds: list[tuple[Bound, Bound]] = []
    own: list[Bound] = []

    def sides(*given: Any) -> CrossCheck:
        bounds.append(given[-2:])
        return cross_check(*given)

    def counted(ours: FloatArray, theirs: FloatArray, bound: Bound, *others: Any) -> Any:
        own.append(bound)
        return tally(ours, theirs, bound, *others)

    monkeypatch.setattr(comparison, "cross_check", sides)
    monkeypatch.setattr(comparison, "tally", counted)
    assert validate(arm(), samples=0, oracle="mujoco").passed
    assert len(bounds) == len(own) - 1 > 10  # Pinocchio's data.J is compared by itself
    for (first, second), bound in zip(bounds, own, strict=False):
        assert np.array_equal(first.scale, bound.scale)
        assert np.array_equal(first.k, bound.k)
        assert np.array_equal(second.k, 2.0 * 30.0 / 24.0 * bound.k)


@pytest.mark.slow
def test_three_that_agree_are_told_side_by_side_in_every_form() -> None:
    document = document_of()
    robot = document["robots"][0]
    assert robot["verdict"] == "verified"
    assert "mujoco" in document["versions"]
    assert "--oracle mujoco" in (document["command"] or "")
    second_oracle_rows = [check for check in robot["checks"] if "second_oracle" in check]
    assert {check["subjects"] for check in second_oracle_rows} == {"frames", "joints"}
    every, some = ({check["quantity"] for check in rows} for rows in (robot["checks"], second_oracle_rows))
    assert every - some == {"screws"}  # Pinocchio's own data.J
    for text in (as_markdown(document), as_html(document), as_junit(document).decode()):
        assert "urdfkin, MuJoCo" in text
        assert "outlier" in text
        assert "none" in text


ORACLES: dict[str, Any] = {"Pinocchio": PinocchioOracle, "MuJoCo": MujocoOracle}


@pytest.mark.parametrize("who", ORACLES)
def test_one_that_errs_stands_alone_in_the_report(who: str, monkeypatch: pytest.MonkeyPatch) -> None:
    right = ORACLES[who].velocities
    monkeypatch.setattr(ORACLES[who], "velocities", lambda *given: right(*given) + 1e-6)
    document = document_of()
    robot = document["robots"][0]
    assert robot["verdict"] == "disagrees"
    assert list(contradictions(document)) == []
    key = "pinocchio" if who == "Pinocchio" else "second_oracle"
    counts = {
        check["quantity"]: check["second_oracle"]["alone"][key]  # type: ignore[literal-required]
        for check in robot["checks"]
        if "second_oracle" in check
    }
    assert counts.pop("velocity") > 0
    assert set(counts.values()) == {0}
    assert f"{who} \\(" in as_markdown(document).split("| outlier |")[-1]
    if who == "MuJoCo":
        assert "urdfkin differs from the two others in 0, Pinocchio in 0" in (robot["reason"] or "")


def test_a_second_oracle_that_cannot_read_the_robot_leaves_it_unverified_and_none_is_not_told() -> None:
    text = arm(robot='name="r" version="1.1"', origin='<origin quat_xyzw="0 0 1 0"/>')
    report = validate(text, samples=0, oracle="mujoco")
    assert report.exit_code == 3
    assert "MuJoCo does not read the attribute quat_xyzw" in (report.robots[0].reason or "")
    document = validate(arm(), samples=0).as_dict()
    assert "second_oracle" not in str(document)
    assert "mujoco" not in document["versions"]
    assert urdfkin.load(arm()).origin.oracle is None
