"""A result that lies a little outside its bound is one too many, and a run that was ended has not passed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdfkin.kinematics.roundings import EPS
from urdfkin.validation.campaign import validate
from urdfkin.validation.error_stats import tally
from urdfkin.verify.bounds import Bound
from urdfkin.verify.certificate import Comparison

ALLOWED = 64.0


@pytest.mark.parametrize(("share", "failed"), [(0.5, 0), (1.0, 0), (1.0 + 1 / 64, 1), (1.4, 1), (3.0, 1)])
def test_a_share_of_a_bound_above_one_is_counted_and_disagrees(share: float, failed: int) -> None:
    ours = np.ones((2, 3, 6))
    ours[1, 2, 4] += round(share * ALLOWED) * EPS
    bound = Bound(np.ones_like(ours), np.full((2, 3, 1), ALLOWED))
    found = tally(ours, np.ones_like(ours), bound, ("a", "b", "c"), 0, [([0.0], [0.0], [0.0])] * 2)
    assert found.failed == failed
    assert Comparison(6, 1.0, found.share, ()).agrees == (failed == 0)


def test_a_report_of_a_run_that_was_ended_has_not_passed_though_all_it_holds_is_verified() -> None:
    whole = validate(["planar_two_link"], samples=0)
    ended = replace(whole, interrupted=True)
    assert (whole.passed, whole.exit_code, whole.as_dict()["verdict"]) == (True, 0, "verified")
    assert ended.robots[0].verdict == "verified"
    assert (ended.passed, ended.as_dict()["verdict"]) == (False, "interrupted")
    assert ended.exit_code != 0
