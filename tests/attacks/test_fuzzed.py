"""What random whole robots (`scripts/fuzz.py`) have found, each with the smallest robot that shows it."""

from __future__ import annotations

import pytest

import urdfkin
from urdfkin.errors import RangeError
from urdfkin.validation.accuracy import judge

pytestmark = pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")


def two_axes(first: float, second: float) -> str:
    """Two skew axes, at so many metres from the base and from one another."""
    return f"""<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
<joint name="x" type="continuous"><parent link="a"/><child link="b"/><origin xyz="{first!r} 0 0.1"
 rpy="1 0.2 0.3"/><axis xyz="0 0 1"/></joint>
<joint name="y" type="continuous"><parent link="b"/><child link="c"/><origin xyz="{second!r} 0.1 0.2"
 rpy="1 0.2 0.3"/><axis xyz="0 0.6 0.8"/></joint></robot>"""


@pytest.mark.parametrize(("first", "second"), [(1e155, 0.3), (0.3, -1e200), (1e300, 1e300)])
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_a_table_of_lengths_whose_squares_overflow_is_refused_and_no_error_of_ours(
    first: float, second: float, convention: str
) -> None:
    robot = urdfkin.load(two_axes(first, second))
    with pytest.raises(RangeError, match=r"joint [xy]: .*square of this length"):
        robot.dh("c", "a", convention)
    if first == 1e155:  # the path is short, but Pinocchio comes from the root
        with pytest.raises(RangeError, match="joint x"):
            robot.dh("c", "b", convention)
    assert robot.placement(robot.neutral(), "c").shape == (4, 4)


def test_tree_parameters_of_such_lengths_are_not_measured_by_infinity() -> None:
    with pytest.raises(RangeError, match="square of this length"):
        urdfkin.load(two_axes(1e160, 0.3)).tree_parameters()


def test_tables_of_lengths_up_to_there_are_verified() -> None:
    robot = urdfkin.load(two_axes(1e148, 1e147))
    for convention in ("standard", "modified"):
        robot.dh("c", "a", convention)
        robot.dh("c", "b", convention)
    robot.tree_parameters()


TINY = """<robot name="r"><link name="a"/><link name="b"/>
<joint name="x" type="continuous"><parent link="a"/><child link="b"/><origin xyz="1e-195 1e-196 1e-195"
 rpy="1 0.2 0.3"/><axis xyz="0 0.6 0.8"/></joint></robot>"""


@pytest.mark.filterwarnings("error::urdfkin.NotVerifiedWarning")
def test_a_table_of_lengths_whose_squares_vanish_does_not_lose_to_rounding() -> None:
    robot = urdfkin.load(TINY)
    for convention in ("standard", "modified"):
        robot.dh("b", "a", convention)
    assert urdfkin.validate([TINY.encode()], samples=2).passed


FAINT = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
<joint name="x" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
<joint name="y" type="continuous"><parent link="a"/><child link="c"/><axis xyz="0 1 0"/>
<mimic joint="x" multiplier="5e-324"/></joint></robot>"""


def test_the_judge_counts_in_units_that_do_not_vanish() -> None:
    for line in judge(urdfkin.load(FAINT), samples=2).lines:
        assert line.urdfkin.worst < 100.0, line
        assert line.pinocchio.worst < 100.0, line
