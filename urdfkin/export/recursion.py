"""Compute the forward recursion of the textbook's section 7.7 along one path, for any type of number.

At each joint, the recursion first translates along the rigid link. It then applies a constant rotation, and
then the joint's motion about or along z.

| Quantity | Axes of the vectors |
|---|---|
| placement, Jacobian and its derivatives | world, as in the textbook |
| velocity, acceleration for WORLD | world |
| other velocity, acceleration | each link's frame: joint axes are (0, 0, 1), link vectors are constant |

For LOCAL_WORLD_ALIGNED, the velocity and the acceleration are then rotated joint by joint to the world axes.
These rotations need a third fewer operations than the computation of the frame's rotation matrix.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, assert_never

from urdfkin.compiled.plan import ColumnField, CompiledTree, Geometry, JointMotion
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.recursion import Column, LinkState, Matrix, Number, Recursion, Vector
from urdfkin.model.reference import Reference

_Z: Vector = (0, 0, 1)


@dataclass(frozen=True)
class NumberKind:
    """Functions for one type of number.

    Attributes:
        chapter: The textbook's equations.
        begin_step: Callback before each step, with the step's index as its argument.
            The steps are the joints (0 to n - 1), the frame (n) and the results (n + 1).
        end_step: Callback after each joint and after the frame, with the step's index and the link's state.
    """

    chapter: Any
    sine_cosine: Callable[[Number], tuple[Number, Number]]
    root: Callable[[Number], Number]
    begin_step: Callable[[int], None] = lambda place: None
    end_step: Callable[[int, LinkState], None] = lambda place, state: None


class TreeRecursion(Recursion):
    """The forward recursion along one path.

    Attributes:
        inputs: The numbers of q, v and a. Unused inputs contain zeros.
        own_axes: True if each link's vectors are expressed in the link's own axes.
        turns: Rotation matrices from each frame to the previous frame.
        end: State of the frame.
    """

    def __init__(
        self, plan: CompiledTree, kind: NumberKind, inputs: Sequence[Sequence[Number]], *, own_axes: bool
    ) -> None:
        super().__init__(kind.chapter, own_axes)
        self.plan, self.kind, self.inputs = plan, kind, inputs
        self.turns: list[Matrix] = []
        self.states: list[LinkState] = []
        state = LinkState()
        for i in range(len(plan.steps)):
            kind.begin_step(i)
            state = self._apply_joint_motion(i, self._apply_link_pose(state, plan.geometry[i].tolist()))
            self.states.append(state)
            kind.end_step(i, state)
        kind.begin_step(len(self.states))
        self.end = self._apply_link_pose(state, plan.offsets[0].tolist())
        kind.end_step(len(self.states), self.end)
        kind.begin_step(len(self.states) + 1)

    def rotate_frame(self, s: LinkState, S: Matrix) -> LinkState:
        self.turns.append(S)
        return super().rotate_frame(s, S)

    def _apply_link_pose(self, s: LinkState, row: Sequence[float]) -> LinkState:
        R, d = row[: Geometry.OFFSET], row[Geometry.OFFSET : Geometry.MULTIPLIER]
        x, y, z = _drop_tiny_entries(R[0:3]), _drop_tiny_entries(R[3:6]), _drop_tiny_entries(R[6:9])
        return self.rotate_frame(self.translate_frame(s, _drop_tiny_entries(d)), (x, y, z))

    def _about_z(self, angle: Number) -> Matrix:
        found: Matrix = self.eq.about_z(*self.kind.sine_cosine(angle), 0, 1)
        return found

    def _apply_joint_motion(self, i: int, s: LinkState) -> LinkState:
        (kind, at, rate_at), (q, v, a) = self.plan.steps[i].tolist(), self.inputs
        match motion := JointMotion(kind):
            case JointMotion.PLANAR:
                return self.after_planar(s, q[at:], self._about_z(q[at + 2]), v[rate_at:], a[rate_at:])
            case JointMotion.FLOATING:
                quaternion = q[at + 3 : at + 7]
                length = self.kind.root(sum(c * c for c in quaternion))
                S = self.eq.rotation_of_quaternion(*(c / length for c in quaternion))
                return self.after_floating(s, q[at:], S, v[rate_at:], a[rate_at:])
            case JointMotion.REVOLUTE:
                value, *rates = self._own_values(i)
                return self.after_revolute(s, _Z, self._about_z(value), *rates)
            case JointMotion.PRISMATIC:
                return self.after_prismatic(s, _Z, *self._own_values(i))
            case _:
                assert_never(motion)

    def _own_values(self, i: int) -> tuple[Number, Number, Number]:
        (_, at, rate_at), (q, v, a) = self.plan.steps[i].tolist(), self.inputs
        multiplier, constant = self.plan.geometry[i, Geometry.MULTIPLIER :].tolist()
        return multiplier * q[at] + constant, multiplier * v[rate_at], multiplier * a[rate_at]

    @property
    def columns(self) -> list[Column]:
        found = []
        for row, factor in zip(self.plan.columns.tolist(), self.plan.multipliers.tolist(), strict=True):
            s = self.states[row[ColumnField.STEP]]
            z = self.eq.transposed(s.R)[row[ColumnField.AXIS]]
            found.append(
                Column(
                    z,
                    bool(row[ColumnField.IS_ROTATION]),
                    s,
                    row[ColumnField.STEP],
                    row[ColumnField.V],
                    factor,
                )
            )
        return found


def _drop_tiny_entries(x: Sequence[float]) -> Vector:
    """Replace each entry that is smaller than the largest entry's rounding error by 0.

    Tiny entries, such as 6e-17, would make exported code longer. The error bounds of
    `urdfkin.kinematics.roundings` account for the omitted entries.
    """
    if not all(isinstance(c, float) for c in x):
        return x[0], x[1], x[2]
    least = EPS / 2.0 * max(map(abs, x))
    first, second, third = (c if abs(c) > least else 0.0 for c in x)
    return first, second, third


# -- the quantities of the frame ----------------------------------------------------------------------------


def placement(plan: CompiledTree, kind: NumberKind, inputs: Any, reference: Reference) -> list[Number]:
    end = TreeRecursion(plan, kind, inputs, own_axes=False).end
    rows = [[*row, x] for row, x in zip(end.R, end.p, strict=True)]
    return [*(x for row in rows for x in row), 0.0, 0.0, 0.0, 1.0]


def velocity(plan: CompiledTree, kind: NumberKind, inputs: Any, reference: Reference) -> list[Number]:
    """Return the velocity [linear; angular] (7.127, 7.128)."""
    path = _recursion(plan, kind, inputs, reference)
    return _six_vector(path, reference, *path.velocity(path.end, reference))


def acceleration(plan: CompiledTree, kind: NumberKind, inputs: Any, reference: Reference) -> list[Number]:
    """Return the classical acceleration [linear; angular] (7.129, 7.130)."""
    path = _recursion(plan, kind, inputs, reference)
    return _six_vector(path, reference, *path.acceleration(path.end, reference))


def jacobian(plan: CompiledTree, kind: NumberKind, inputs: Any, reference: Reference) -> list[Number]:
    """Return the Jacobian row by row (7.85)."""
    path = TreeRecursion(plan, kind, inputs, own_axes=False)
    return _by_row(path.jacobian(path.end, path.columns, plan.nv, reference))


def jacobian_rate(plan: CompiledTree, kind: NumberKind, inputs: Any, reference: Reference) -> list[Number]:
    """Return the Jacobian's time derivative row by row (7.126)."""
    path = TreeRecursion(plan, kind, inputs, own_axes=False)
    return _by_row(path.jacobian_rate(path.end, path.columns, plan.nv, reference))


def hessian(plan: CompiledTree, kind: NumberKind, inputs: Any, reference: Reference) -> list[Number]:
    """Return the Hessian (6, nv, nv) row by row.

    The product of the Hessian and v is the time derivative of the Jacobian (7.126).
    """
    path, nv = TreeRecursion(plan, kind, inputs, own_axes=False), plan.nv
    out: list[Number] = [0] * (6 * nv**2)
    for of, by, factor, six in path.hessian(path.end, path.columns, reference):
        for row, x in enumerate(six):
            out[(row * nv + of) * nv + by] = out[(row * nv + of) * nv + by] + factor * x
    return out


def _recursion(plan: CompiledTree, kind: NumberKind, inputs: Any, reference: Reference) -> TreeRecursion:
    # The reference WORLD needs the position p, which is computed in world axes.
    return TreeRecursion(plan, kind, inputs, own_axes=not reference.at_world)


def _six_vector(path: TreeRecursion, reference: Reference, linear: Vector, angular: Vector) -> list[Number]:
    match reference:
        case Reference.LOCAL_WORLD_ALIGNED:
            for S in reversed(path.turns):
                linear, angular = path.eq.rotate(S, linear), path.eq.rotate(S, angular)
        case Reference.LOCAL | Reference.WORLD:
            pass  # `linear` and `angular` are already expressed in the axes of the reference frame.
        case _:
            assert_never(reference)
    return [*linear, *angular]


def _by_row(columns: Sequence[Sequence[Number]]) -> list[Number]:
    return [x for row in zip(*columns, strict=True) for x in row]


QUANTITY_FUNCTIONS: dict[str, Callable[[CompiledTree, NumberKind, Any, Reference], list[Number]]] = {
    "placement": placement,
    "velocity": velocity,
    "jacobian": jacobian,
    "jacobian rate": jacobian_rate,
    "hessian": hessian,
    "acceleration": acceleration,
}
