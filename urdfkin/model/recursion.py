"""The forward recursion of section 7.7, and the quantities of a frame, for any kind of number.

`urdfkin.kinematics.arithmetic.bind_equations` makes the textbook's equations for one kind of number.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, assert_never

from urdfkin.model.reference import Reference

Number = Any
Vector = tuple[Number, Number, Number]
Matrix = tuple[Vector, Vector, Vector]
SixVector = tuple[Number, ...]
#: The part of q, v or a that begins at the joint's first number.
JointSlice = Sequence[Number]

ZERO: Vector = (0, 0, 0)
IDENTITY: Matrix = (1, 0, 0), (0, 1, 0), (0, 0, 1)


@dataclass(frozen=True, slots=True)
class LinkState:
    """R and p are in world axes; `Recursion.own_axes` determines the axes of the other vectors."""

    R: Matrix = IDENTITY
    p: Vector = ZERO
    w: Vector = ZERO
    vel: Vector = ZERO
    alpha: Vector = ZERO
    acc: Vector = ZERO


@dataclass(frozen=True, slots=True)
class Column:
    """One Jacobian column of a joint."""

    z: Vector
    turns: bool
    carrier: LinkState  #: State of the frame to which the axis is fixed.
    order: int  #: Index of the joint on the path from the base.
    v_index: int
    factor: Number  #: Multiplier of the mimic rule.


@dataclass(eq=False)
class Recursion:
    """The steps of the forward recursion."""

    eq: Any  #: The textbook's equations for one kind of number.
    #: Whether velocities and accelerations are in link axes instead of world axes.
    own_axes: bool = False

    def express(self, s: LinkState, x: Vector) -> Vector:
        return x if self.own_axes else self.eq.rotate(s.R, x)

    def translate_frame(self, s: LinkState, d: Vector) -> LinkState:
        """Move the origin by the offset d (7.58, 7.128, 7.130)."""
        eq, lever = self.eq, self.express(s, d)
        vel, acc = eq.point_velocity(s.vel, s.w, lever), eq.point_acceleration(s.acc, s.alpha, s.w, lever)
        return replace(s, p=eq.point_position(s.p, s.R, d), vel=vel, acc=acc)

    def rotate_frame(self, s: LinkState, S: Matrix) -> LinkState:
        R = self.eq.product(s.R, S)
        if not self.own_axes:
            return replace(s, R=R)
        back = self.eq.transposed(S)
        return LinkState(R, s.p, *(self.eq.rotate(back, x) for x in (s.w, s.vel, s.alpha, s.acc)))

    def after_revolute(self, s: LinkState, axis: Vector, S: Matrix, v: Number, a: Number) -> LinkState:
        """Return the state after a revolute joint (7.127, 7.129)."""
        z = self.express(s, axis)
        alpha = self.eq.angular_acceleration(s.alpha, s.w, z, v, a)
        return self.rotate_frame(replace(s, alpha=alpha, w=self.eq.angular_velocity(s.w, z, v)), S)

    def after_prismatic(self, s: LinkState, axis: Vector, x: Number, v: Number, a: Number) -> LinkState:
        """Return the state after a prismatic joint (7.64, 7.128, 7.130)."""
        s = self.translate_frame(s, self.eq.times(x, axis))
        z = self.express(s, axis)
        acc = self.eq.sliding_acceleration(s.acc, s.w, z, v, a)
        return replace(s, vel=self.eq.sliding_velocity(s.vel, z, v), acc=acc)

    def after_planar(self, s: LinkState, q: JointSlice, S: Matrix, v: JointSlice, a: JointSlice) -> LinkState:
        rates = [x for u in (v, a) for x in ((u[0], u[1], 0), (0, 0, u[2]))]
        return self._after_free_joint(s, (q[0], q[1], 0), S, rates)

    def after_floating(
        self, s: LinkState, q: JointSlice, S: Matrix, v: JointSlice, a: JointSlice
    ) -> LinkState:
        rates = [(u[k], u[k + 1], u[k + 2]) for u in (v, a) for k in (0, 3)]
        return self._after_free_joint(s, (q[0], q[1], q[2]), S, rates)

    def _after_free_joint(self, s: LinkState, slide: Vector, S: Matrix, rates: Sequence[Vector]) -> LinkState:
        """Return the state after a planar or floating joint.

        `rates` are the joint's linear velocity, angular velocity, linear acceleration and angular
        acceleration, in this order and in the child's axes.
        """
        eq, s = self.eq, self.rotate_frame(self.translate_frame(s, slide), S)
        u, o, u_rate, o_rate = (self.express(s, x) for x in rates)
        return replace(
            s,
            w=eq.plus(s.w, o),
            vel=eq.plus(s.vel, u),
            alpha=eq.free_angular_acceleration(s.alpha, s.w, o, o_rate),
            acc=eq.free_acceleration(s.acc, s.w, o, u, u_rate),
        )

    # -- quantities of a frame -----------------------------------------------------------------------
    # `velocity` and `acceleration` return vectors in the axes of `own_axes`.
    # `Reference.WORLD`, `in_reference` and all methods with columns need `own_axes` = False.

    def velocity(self, s: LinkState, reference: Reference) -> tuple[Vector, Vector]:
        """Return the linear and angular velocity (7.127, 7.128)."""
        if not reference.at_world:
            return s.vel, s.w
        return self.eq.point_velocity(s.vel, s.w, self.eq.minus(ZERO, s.p)), s.w

    def acceleration(self, s: LinkState, reference: Reference) -> tuple[Vector, Vector]:
        """Return the classical acceleration (7.129, 7.130)."""
        if not reference.at_world:
            return s.acc, s.alpha
        return self.eq.point_acceleration(s.acc, s.alpha, s.w, self.eq.minus(ZERO, s.p)), s.alpha

    def in_reference(self, s: LinkState, reference: Reference, linear: Vector, angular: Vector) -> SixVector:
        if reference.own_axes:
            back = self.eq.transposed(s.R)
            linear, angular = self.eq.rotate(back, linear), self.eq.rotate(back, angular)
        return (*linear, *angular)

    def _column(self, column: Column, point: Vector) -> tuple[Vector, Vector]:
        if not column.turns:
            return column.z, ZERO
        six: tuple[Vector, Vector] = self.eq.turning_column(column.z, self.eq.minus(point, column.carrier.p))
        return six

    def jacobian(
        self, s: LinkState, columns: Sequence[Column], nv: int, reference: Reference
    ) -> list[SixVector]:
        """Return the Jacobian's columns (7.85)."""
        point = ZERO if reference.at_world else s.p
        return self._add_mimic_columns(
            s, reference, nv, ((one, *self._column(one, point)) for one in columns)
        )

    def jacobian_rate(
        self, s: LinkState, columns: Sequence[Column], nv: int, reference: Reference
    ) -> list[SixVector]:
        """Return the columns' time derivatives (7.126)."""
        point, point_rate = (ZERO, ZERO) if reference.at_world else (s.p, s.vel)
        rates = ((one, *self._rate(s, one, point, point_rate, reference)) for one in columns)
        return self._add_mimic_columns(s, reference, nv, rates)

    def _rate(
        self, s: LinkState, column: Column, point: Vector, point_rate: Vector, reference: Reference
    ) -> tuple[Vector, Vector]:
        eq, carrier, (linear, angular) = self.eq, column.carrier, self._column(column, point)
        rate, turning = eq.axis_rate(carrier.w, column.z), ZERO
        if column.turns:
            d, d_rate = eq.minus(point, carrier.p), eq.minus(point_rate, carrier.vel)
            rate, turning = eq.turning_column_rate(column.z, rate, d, d_rate)
        if reference.own_axes:
            rate = eq.rate_in_turning_axes(rate, s.w, linear)
            turning = eq.rate_in_turning_axes(turning, s.w, angular)
        return rate, turning

    def _add_mimic_columns(
        self, s: LinkState, reference: Reference, nv: int, columns: Iterator[tuple[Column, Vector, Vector]]
    ) -> list[SixVector]:
        """Add each mimic joint's column, times the multiplier, to the mimicked joint's column."""
        out: list[SixVector] = [(0,) * 6] * nv
        for column, linear, angular in columns:
            six = self.in_reference(s, reference, linear, angular)
            out[column.v_index] = tuple(
                x + column.factor * y for x, y in zip(out[column.v_index], six, strict=True)
            )
        return out

    def hessian(
        self, s: LinkState, columns: Sequence[Column], reference: Reference
    ) -> Iterator[tuple[int, int, Number, SixVector]]:
        """Yield tuples (i, j, factor, x), where i and j are indices of v.

        The derivative of column i with respect to q_j is the sum of factor * x over all tuples (i, j, ...).
        """
        point = ZERO if reference.at_world else s.p
        computed = [(one, self._column(one, point)) for one in columns]
        for column_i, six_i in computed:
            for column_j, six_j in computed:
                change = self._column_derivative(
                    six_i, six_j, reference, is_before=column_j.order <= column_i.order
                )
                yield (
                    column_i.v_index,
                    column_j.v_index,
                    column_i.factor * column_j.factor,
                    self.in_reference(s, reference, *change),
                )

    def _column_derivative(
        self, column_i: Any, column_j: Any, reference: Reference, *, is_before: bool
    ) -> tuple[Vector, Vector]:
        """Return d(column i)/dq_j; `is_before` means that joint j precedes joint i, or is joint i."""
        eq = self.eq
        change: tuple[Vector, Vector] = ZERO, ZERO
        match reference:
            case Reference.WORLD:
                change = eq.motion_product(*column_j, *column_i) if is_before else change
            case Reference.LOCAL:
                change = change if is_before else eq.motion_product(*column_i, *column_j)
            case Reference.LOCAL_WORLD_ALIGNED:
                change = (
                    eq.derivative_by_earlier_joint(column_j[1], *column_i)
                    if is_before
                    else (eq.derivative_by_later_joint(column_i[1], column_j[0]), ZERO)
                )
            case _:
                assert_never(reference)
        return change
