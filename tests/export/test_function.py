"""The printed expressions compute what Pinocchio computes, for every joint kind, quantity and reference."""

from __future__ import annotations

from copy import copy

import numpy as np
import pytest

import urdfkin
from scripts.benchmarking.operations import operations
from tests.export.writing import code
from tests.laws.subjects import robot_of
from urdfkin.export.code import exported
from urdfkin.export.expression import Node
from urdfkin.export.function import Function, function_of
from urdfkin.export.proof import CHECKED
from urdfkin.model.configuration import draw
from urdfkin.model.reference import Reference
from urdfkin.robot import Robot
from urdfkin.verify.call import Call
from urdfkin.verify.quantities import ACCELERATION, JACOBIAN

ODD = (
    "floating_root",
    "planar_and_floating_in_the_middle",
    "two_floating_in_a_row",
    "mimic_hand_40_sliding",
    "followers_of_followers",
    "sizes",
    "sliding_only",
    "default_everything",
)


@pytest.mark.slow
@pytest.mark.parametrize("reference", list(Reference))
@pytest.mark.parametrize("name", [*ODD, "panda"])
def test_every_quantity_is_pinocchios_within_the_bound(name: str, reference: Reference) -> None:
    robot = robot_of(name)
    frame = robot.tip_frame
    drawn = draw(robot.tree, 20, np.random.default_rng(3), with_special=True)
    checker = copy(robot.verifier)
    for row in exported():
        inputs = (drawn.q, drawn.v, drawn.a)[: len(row.inputs)]
        call = Call(robot.tree, robot.plan, frame, reference, None, inputs)
        found = function_of(call.plan, row, reference).evaluated((call.q, *call.rates))
        checker.check(row, call, found, True)
    assert checker.certificate().verified


@pytest.mark.parametrize("quantity", ["placement", "jacobian", "acceleration"])
def test_an_expression_that_is_wrong_is_never_written(quantity: str, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = urdfkin.load("ur5")
    proof = code(robot, quantities=(quantity,)).proof
    (line,) = proof.certificate.lines
    assert line.checked >= CHECKED
    assert line.unchecked == 0
    assert proof.certificate.verified
    right = Function.evaluated
    monkeypatch.setattr(Function, "evaluated", lambda *given: right(*given) * (1.0 + 1e-9))
    with pytest.raises(urdfkin.VerificationError):
        code(robot, quantities=(quantity,))


def arm() -> Robot:
    return urdfkin.load("panda", verify=False)


def test_each_joints_sine_and_cosine_stand_there_once_and_no_more_than_are_needed() -> None:
    robot = arm()
    plan = robot.plan([robot.tree.frame_link("panda_hand")])
    place, jacobian = (
        function_of(plan, row, Reference.LOCAL_WORLD_ALIGNED) for row in (exported()[0], JACOBIAN)
    )
    assert sum(node.op == "sin" for node in place.nodes) == 7
    assert sum(node.op == "cos" for node in place.nodes) == 7
    assert len(jacobian.angles) == 6, "how the last joint turns moves no axis"


def test_it_takes_fewer_operations_than_the_walk_for_any_robot() -> None:
    robot = arm()
    plan = robot.plan([robot.tree.frame_link("panda_hand")])
    for row in (JACOBIAN, ACCELERATION):
        function = function_of(plan, row, Reference.LOCAL_WORLD_ALIGNED)
        sines = 2 * len(function.angles)
        # A sine and its cosine are 51 operations in the walk's count, and two in ours.
        walk = operations(plan, row.name) - 51 * len(plan.steps)
        assert function.operations - sines < 0.75 * walk


def test_statements_are_in_an_order_in_which_they_can_be_computed() -> None:
    robot = robot_of("planar_and_floating_in_the_middle")
    plan = robot.plan([robot.tree.frame_link(robot.tip_frame)])
    function = function_of(plan, ACCELERATION, Reference.LOCAL)
    done = set[Node]()
    for node in function.nodes:
        assert set(node.operands) <= done
        done.add(node)
    assert {node for node in function.results if isinstance(node, Node)} <= done


def test_a_robot_with_huge_and_tiny_links_keeps_its_tiny_ones() -> None:
    robot = robot_of("sizes")
    plan = robot.plan([robot.tree.frame_link(robot.tip_frame)])
    function = function_of(plan, exported()[0], Reference.LOCAL)
    lengths = {x for node in function.nodes for x in node.of if isinstance(x, float)}
    assert any(0.0 < x < 1e-5 for x in lengths)
    assert any(x > 100.0 for x in lengths)
