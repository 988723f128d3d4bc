"""Cross check of urdfkin, Pinocchio and a second oracle: the outlier among three results is found."""

import itertools
from functools import reduce
from operator import add
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.urdf.lint.cases.arm import arm
from urdfkin.model.tree import FloatArray
from urdfkin.report.html import as_html
from urdfkin.report.junit import as_junit
from urdfkin.report.markdown import as_markdown
from urdfkin.report.reading import check_document, contradictions
from urdfkin.validation import chunk
from urdfkin.validation.campaign import validate
from urdfkin.validation.document import Document
from urdfkin.validation.error_stats import (
    CrossCheck,
    OraclePair,
    add_cross_checks,
    compute_error_stats,
    make_cross_check,
)
from urdfkin.verify.bounds import Bound
from urdfkin.verify.mujoco import MujocoOracle
from urdfkin.verify.pinocchio import PinocchioOracle

EPS = np.finfo(float).eps
FIRST = Bound(np.ones((1, 1, 1)), np.full((1, 1, 1), 4.0))
SECOND = Bound(np.full((1, 1, 1), 2.0), np.full((1, 1, 1), 8.0))


def checked_results(ours: float, pinocchios: float, second_oracle: float) -> CrossCheck:
    """Compare three results with errors in eps."""
    one, two, three = (np.full((1, 1, 1), 1.0 + x * EPS) for x in (ours, pinocchios, second_oracle))
    return make_cross_check("mujoco", one, two, three, FIRST, SECOND)


#: Three results, the outlier, and the number of undecided cases.
OUTLIERS = [
    ((0, 4, 16), (0, 0, 0), 0), ((100, 0, 0), (1, 0, 0), 0), ((0, 100, 0), (0, 1, 0), 0),
    ((0, 0, 100), (0, 0, 1), 0), ((0, 100, 300), (0, 0, 0), 1), ((0, 8, 16), (0, 0, 0), 1),
    ((0, np.nan, 0), (0, 1, 0), 0), ((0, 0, np.inf), (0, 0, 1), 0),
]  # fmt: skip


@pytest.mark.parametrize(("results", "alone", "undecided"), OUTLIERS)
def test_a_result_that_differs_from_two_equal_results_is_the_outlier(
    results: tuple[float, float, float], alone: tuple[int, int, int], undecided: int
) -> None:
    found = checked_results(*results)
    assert (found.alone, found.undecided) == (alone, undecided)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_a_result_that_is_not_finite_has_an_infinite_ratio_to_its_bound(wrong: float) -> None:
    assert checked_results(wrong, 0, 0).urdfkin == OraclePair(1, np.inf, np.inf)


def test_the_sum_of_cross_checks_does_not_depend_on_the_order() -> None:
    some = [checked_results(*results) for results in ((0, 4, 16), (100, 0, 0), (0, 100, 300))]
    (total,) = {reduce(add, order) for order in itertools.permutations(some)}
    assert add_cross_checks(None, total) == add_cross_checks(total, None) == total
    assert total.alone == (1, 0, 0)
    assert total.undecided == 1
    assert total.urdfkin.failed == 2


#: Bounds: urdfkin and Pinocchio 4 eps, urdfkin and the second oracle 16 eps, the two oracles 20 eps.
@pytest.mark.parametrize(
    ("results", "agree"),
    [
        ((0, 4, 4), (True, True, True)), ((0, 5, 4), (False, True, True)), ((0, 4, 16), (True, True, True)),
        ((0, 4, 17), (True, False, True)), ((0, -4, 16), (True, True, True)),
        ((0, -4, 17), (True, False, False)), ((0, -5, 16), (False, True, False)),
    ],
)  # fmt: skip
def test_two_results_agree_up_to_their_bound(
    results: tuple[float, float, float], agree: tuple[bool, bool, bool]
) -> None:
    found, (ours, pinocchios, second_oracle) = checked_results(*results), results
    _, ours_second, theirs_second = agree
    assert (found.urdfkin.failed, found.pinocchio.failed) == (not ours_second, not theirs_second)
    assert found.urdfkin.bound_ratio == abs(ours - second_oracle) / 16
    assert found.pinocchio.bound_ratio == abs(pinocchios - second_oracle) / 20
    assert found.urdfkin.worst == abs(ours - second_oracle) / 2
    # If only one pair agrees, the third library is the outlier.
    assert found.alone == (agree[::-1] if sum(agree) == 1 else (0, 0, 0))
    assert found.undecided == (sum(agree) in (0, 2))


def test_a_sum_of_cross_checks_has_the_largest_disagreement() -> None:
    small, large = checked_results(0, 2, 6), checked_results(0, -4, 14)
    for total in (small + large, large + small):
        assert total.urdfkin == OraclePair(0, large.urdfkin.worst, large.urdfkin.bound_ratio)
        assert total.pinocchio == OraclePair(0, large.pinocchio.worst, large.pinocchio.bound_ratio)
    assert small.urdfkin.worst < large.urdfkin.worst
    assert small.pinocchio.bound_ratio < large.pinocchio.bound_ratio


def document_of(**changes: Any) -> Document:
    report = validate(arm(), samples=3, oracle="mujoco", **changes)
    return check_document(report.as_dict(), "the report")


def test_each_pair_of_libraries_has_its_own_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    pairs: list[tuple[Bound, Bound]] = []
    bounds: list[Bound] = []

    def record_pairs(*arguments: Any) -> CrossCheck:
        pairs.append(arguments[-2:])
        return make_cross_check(*arguments)

    def record_bounds(ours: FloatArray, theirs: FloatArray, bound: Bound, *others: Any) -> Any:
        bounds.append(bound)
        return compute_error_stats(ours, theirs, bound, *others)

    monkeypatch.setattr(chunk, "make_cross_check", record_pairs)
    monkeypatch.setattr(chunk, "compute_error_stats", record_bounds)
    assert validate(arm(), samples=0, oracle="mujoco").passed
    assert len(pairs) == len(bounds) - 1 > 10  # only Pinocchio has data.J
    for (first, second), bound in zip(pairs, bounds, strict=False):
        assert np.array_equal(first.scale, bound.scale)
        assert np.array_equal(first.k, bound.k)
        assert np.array_equal(second.k, 2.0 * 30.0 / 24.0 * bound.k)


@pytest.mark.slow
def test_every_format_of_a_report_shows_the_cross_check() -> None:
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
def test_a_wrong_oracle_is_the_outlier_in_the_report(who: str, monkeypatch: pytest.MonkeyPatch) -> None:
    right = ORACLES[who].velocities
    monkeypatch.setattr(ORACLES[who], "velocities", lambda *arguments: right(*arguments) + 1e-6)
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
        assert "differs from the two others: urdfkin 0, Pinocchio 0, MuJoCo " in (robot["reason"] or "")


def test_a_robot_that_the_second_oracle_cannot_read_is_not_verified() -> None:
    text = arm(robot='name="r" version="1.1"', origin='<origin quat_xyzw="0 0 1 0"/>')
    report = validate(text, samples=0, oracle="mujoco")
    assert report.exit_code == 3
    assert "MuJoCo does not read the attribute quat_xyzw" in (report.robots[0].reason or "")
    document = validate(arm(), samples=0).as_dict()
    assert "second_oracle" not in str(document)
    assert "mujoco" not in document["versions"]
    assert urdfkin.load(arm()).origin.oracle is None
