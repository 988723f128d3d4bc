"""The script that checks all exported forms runs on one robot, and finds planted errors."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from scripts.check_forms import RUN, Case, MissingProgramError, make_case, measure_excess_widths
from urdfkin.dh import export

pytestmark = pytest.mark.slow


@cache
def talos_thumb() -> Case:
    """Return four revolute joints; one of them mimics a joint that is not on the path."""
    robot = urdfkin.load("talos")
    return make_case(robot, "talos", robot.dh("gripper_left_fingertip_1_link", "arm_left_5_link"))


@cache
def elbow() -> Case:
    robot = urdfkin.load("elbow")
    return make_case(robot, "elbow", robot.dh(convention="modified"))


@pytest.mark.parametrize("form", sorted(set(RUN) - {"matlab-symbolic"}))
def test_a_catalogue_robot_is_exported_in_every_format(form: str, tmp_path: Path) -> None:
    one = elbow() if form in ("roboticstoolbox", "ets", "matlab-rst") else talos_thumb()
    try:
        (found,) = RUN[form]([one.job], tmp_path)
    except MissingProgramError as error:
        pytest.skip(f"{error} is missing")
    metres, share = one.measure_errors(found)
    assert metres < 1e-14
    assert share <= 1.0
    wrong = found.copy()
    wrong[:, 0, 3] += 1e-12
    assert one.measure_errors(wrong)[1] > 1.0


def test_a_latex_table_is_as_wide_as_the_page_at_most(tmp_path: Path) -> None:
    texts = [export(urdfkin.load(name).dh(), "latex") for name in ("icub", "ur5")]
    # Without scaling, the table is too wide, and LaTeX reports this.
    loose = [text.replace(r"\ifdim\width>\linewidth\linewidth\else\width\fi", r"\width") for text in texts]
    try:
        over = measure_excess_widths([*texts, *loose], tmp_path)
    except MissingProgramError as error:
        pytest.skip(f"{error} is missing")
    assert over[:2] == [0.0, 0.0]
    assert min(over[2:]) > 0.0


def test_a_table_of_a_different_robot_is_detected() -> None:
    one = elbow()
    rows = (replace(one.table.rows[0], d=one.table.rows[0].d + 1e-9), *one.table.rows[1:])
    assert one.measure_errors(replace(one.table, rows=rows).placement(one.job.q))[1] > 1.0
    assert np.isfinite(one.pinocchio_poses).all()
