"""A new reference frame, or a new joint kind, is refused by each branch that does not know it.

A branch that took it for another member would return wrong numbers without a word.
"""

from collections.abc import Callable, Mapping
from typing import Any, cast

import numpy as np
import pytest

import urdfkin
from urdfkin.cli.options import REFERENCES
from urdfkin.cli.quantity import REPRESENTATIONS
from urdfkin.compiled.breakdown import acceleration_breakdown
from urdfkin.compiled.machine.single import make_single_evaluator
from urdfkin.compiled.plan import REFERENCES as IN_KERNELS
from urdfkin.compiled.plan import CompiledTree, compile_tree
from urdfkin.export.function import make_function
from urdfkin.export.recursion import QUANTITY_FUNCTIONS as EXPORTED
from urdfkin.kinematics.bodies import QUATERNION
from urdfkin.kinematics.rotation import EULER_SEQUENCES
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.mechanisms.mechanism import coordinates_of, pose_of
from urdfkin.model.recursion import IDENTITY, ZERO
from urdfkin.model.reference import Reference
from urdfkin.model.tree import JointKind
from urdfkin.robot.trajectory import _central_velocities
from urdfkin.verify.bounds import compute_magnitudes, find_active_entries
from urdfkin.verify.exact.numbers import ExactJoint
from urdfkin.verify.exact.recursion import compute_motion
from urdfkin.verify.oracle import QueryBatch
from urdfkin.verify.oracles import ORACLES
from urdfkin.verify.quantities import QUANTITIES, Quantity

REFUSED = (AttributeError, KeyError, AssertionError, NotImplementedError)
REFERRED = [
    row for row in QUANTITIES.values() if row.has_reference and row.recursive and row.object_kind != "columns"
]


def new_reference(**properties: bool) -> Reference:
    """Make a member of the enumeration as a new line in its class would, or one without properties."""
    member = int.__new__(Reference, 3)
    for name, value in {"_name_": "NEW", "_value_": 3, "_sort_order_": 3, **properties}.items():
        setattr(member, name, value)
    return member


#: Its axes are the frame's and its point is at the world's origin; and one that states neither.
NEW = {"mixed": new_reference(own_axes=True, at_world=True), "bare": new_reference()}


@pytest.fixture(params=NEW)
def reference(request: pytest.FixtureRequest) -> Reference:
    return NEW[request.param]


#: Configurations of the UR5, rates and second rates.
X = np.ones((1, 6))


@pytest.fixture(scope="module")
def robot() -> urdfkin.Robot:
    return urdfkin.load("ur5", verify=False)


@pytest.fixture(scope="module")
def plan(robot: urdfkin.Robot) -> CompiledTree:
    return compile_tree(robot.tree, [robot.tree.frame_link(robot.tip_frame)])


def test_a_reference_frame_without_axes_and_point_cannot_be_defined() -> None:
    with pytest.raises(TypeError, match="own_axes"):
        cast("Any", Reference)._new_member_(Reference, 3)


@pytest.mark.parametrize("row", REFERRED, ids=lambda row: row.name)
def test_the_recursion_refuses_a_new_reference_frame(plan: Any, reference: Reference, row: Quantity) -> None:
    with pytest.raises(REFUSED):
        row.compute_results(plan, (X, X, X), reference)


@pytest.mark.parametrize("name", ["velocity", "jacobian", "jacobian rate", "hessian", "acceleration"])
def test_functions_for_single_configurations_refuse_a_new_reference_frame(
    plan: Any, reference: Reference, name: str
) -> None:
    with pytest.raises(REFUSED):
        make_single_evaluator(name.replace(" ", "_"), plan, reference)


def test_the_breakdown_of_an_acceleration_refuses_a_new_reference_frame(robot: urdfkin.Robot) -> None:
    with pytest.raises(REFUSED):
        acceleration_breakdown(robot.tree, 3, X, X, X, NEW["bare"])


@pytest.mark.parametrize("name", sorted(EXPORTED.keys() - {"placement"}))
def test_exported_code_refuses_a_new_reference_frame(plan: CompiledTree, name: str) -> None:
    with pytest.raises(REFUSED):
        make_function(plan, QUANTITIES[name], NEW["bare"])


@pytest.mark.parametrize("row", REFERRED, ids=lambda row: row.name)
def test_bounds_refuse_a_reference_frame_without_properties(plan: CompiledTree, row: Quantity) -> None:
    if row.name.split()[-1] == "jacobian":
        with pytest.raises(REFUSED):
            find_active_entries(plan, NEW["bare"])
        return  # the size of a Jacobian's terms is the same in each reference frame
    with pytest.raises(REFUSED):
        row.bound(plan, compute_magnitudes(plan, X, X, X, FIXED_BASE_STATE), NEW["bare"])


def test_the_bound_of_a_hessian_refuses_a_new_reference_frame(plan: Any, reference: Reference) -> None:
    with pytest.raises(REFUSED):
        QUANTITIES["hessian"].bound(plan, compute_magnitudes(plan, X, X, X, FIXED_BASE_STATE), reference)


@pytest.mark.parametrize("oracle", ORACLES)
@pytest.mark.parametrize("row", REFERRED, ids=lambda row: row.name)
def test_the_oracles_refuse_a_new_reference_frame(
    robot: urdfkin.Robot, reference: Reference, row: Quantity, oracle: str
) -> None:
    if oracle == "mujoco":
        pytest.importorskip("mujoco")
        if row.name == "hessian":
            return
    model = ORACLES[oracle].make_oracle(robot.urdf, robot.tree)
    joints = row.object_kind == "joints"
    frame = f"joint:{robot.joint_names[0]}" if joints else robot.tip_frame
    with pytest.raises(REFUSED):
        row.ask_oracle(model, QueryBatch([frame], (X, X, X), reference, frames_are_joints=joints))


def test_kernels_and_command_line_support_every_reference_frame() -> None:
    assert dict(IN_KERNELS) == {reference: reference.value for reference in Reference}
    assert tuple(reference.name.lower() for reference in Reference) == REFERENCES
    assert set(REPRESENTATIONS) == {"rpy", QUATERNION, *EULER_SEQUENCES}


# -- joint kinds -----------------------------------------------------------------------------------------


def new_kind() -> JointKind:
    """Make a joint kind with two coordinates and no single axis."""
    member: JointKind = cast("Any", JointKind)._new_member_(JointKind, "screw", 2, 2, 2, False, False, False)
    member._name_ = "SCREW"
    return member


def test_a_joint_kind_without_its_properties_cannot_be_defined() -> None:
    with pytest.raises(ValueError, match="expected 6"):
        cast("Any", JointKind)._new_member_(JointKind, "screw")


def plan_of_last(robot: urdfkin.Robot) -> CompiledTree:
    return compile_tree(robot.tree, [len(robot.tree.joints)])


METHODS: Mapping[str, Callable[[urdfkin.Robot, Any], object]] = {
    "recursion": lambda robot, x: robot.placement(x, robot.tip_frame, verify=False),
    "split": lambda robot, x: robot.acceleration_breakdown(x, x, x, robot.tip_frame, verify=False),
    "size of terms": lambda robot, x: compute_magnitudes(plan_of_last(robot), x, x, x, FIXED_BASE_STATE),
    "pose": lambda robot, x: pose_of(robot.tree.joints[0].kind, x),
    "coordinates": lambda robot, _: coordinates_of(robot.tree.joints[0].kind, np.eye(4)),
    "sample": lambda robot, _: robot.sample(1),
    "names": lambda robot, _: robot.coordinate_names,
    "convention": lambda robot, _: robot.convention("mujoco"),
    "export": lambda robot, _: make_function(plan_of_last(robot), QUANTITIES["velocity"], Reference.WORLD),
    "same": lambda robot, _: urdfkin.same(robot, robot),
    "digits": lambda robot, x: compute_motion(
        robot.tree, {0: ExactJoint(IDENTITY, ZERO, IDENTITY[0], 1, 0)}, x, x, x
    ),
    "velocities": lambda robot, x: _central_velocities(robot.tree, np.stack((x, x, x)), np.arange(3.0)),
    "integrate": lambda robot, x: robot.integrate(x, x),
    "difference": lambda robot, x: robot.difference(x, x),
}


@pytest.mark.parametrize("method", METHODS)
def test_each_computation_refuses_a_new_joint_kind(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = urdfkin.load("one_link", verify=False).urdf.replace('type="revolute"', 'type="floating"')
    kind = new_kind()
    for name in ("nq", "nv", "nq_pinocchio"):
        monkeypatch.setattr(JointKind.FLOATING, name, 2)
    robot = urdfkin.load(text, verify=False)
    for joint in robot.tree.joints:
        if joint.kind is JointKind.FLOATING:
            object.__setattr__(joint, "kind", kind)
    with pytest.raises(REFUSED):
        METHODS[method](robot, np.zeros(2))
