"""The recursion of section 7.7 along one path, on whatever kind of number the equations are given.

A plan of one frame is a row of steps: carried along a rigid link, turned by a constant, moved by a joint
whose axis is z. Places and Jacobians are followed in the world's axes, as in the text. Velocities and
accelerations are followed in each link's own, where axes are (0, 0, 1) and links constants; what is asked for
in the world's is turned back joint by joint, which takes a third less than R itself.

It is `urdfkin.compiled.walk` for one frame and any number; there Numba's kinds carry out a program.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from urdfkin.compiled.plan import Column, Geometry, Motion, Plan
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.reference import Reference

Number = Any
Vector = tuple[Number, Number, Number]
Matrix = tuple[Vector, Vector, Vector]

ZERO: Vector = (0.0, 0.0, 0.0)
_Z: Vector = (0.0, 0.0, 1.0)
_UNTURNED: Matrix = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Kind:
    """A kind of number.

    Attributes:
        chapter: The equations, computing with it.
        sine_cosine: Of an angle.
        root: The square root.
        entering: Told before each step, before the frame (after the last step) and before its results.
        reached: Told of each state, after as many steps.
    """

    chapter: Any
    sine_cosine: Callable[[Number], tuple[Number, Number]]
    root: Callable[[Number], Number]
    entering: Callable[[int], None] = lambda place: None
    reached: Callable[[int, State], None] = lambda place, state: None


@dataclass(frozen=True)
class State:
    """A link's frame: R and p in the world's axes, w, vel, alpha and acc in the axes of the walk."""

    R: Matrix = _UNTURNED
    p: Vector = ZERO
    w: Vector = ZERO
    vel: Vector = ZERO
    alpha: Vector = ZERO
    acc: Vector = ZERO


@dataclass(frozen=True)
class Path:
    """What a walk met.

    Attributes:
        states: After each step.
        end: The frame's.
        turns: The rotations from each frame's axes to those of the one before, from the base on.
    """

    states: list[State]
    end: State
    turns: list[Matrix]


class Walk:
    """One path.

    Args:
        plan: Of one frame.
        kind: Of number.
        inputs: q, v and a; zeros where nobody asks for them.
        own: Whether motion is seen in each link's own axes.
    """

    def __init__(self, plan: Plan, kind: Kind, inputs: Sequence[Sequence[Number]], *, own: bool) -> None:
        self.plan, self.kind, self.own, self.eq = plan, kind, own, kind.chapter
        self.q, self.v, self.a = inputs
        self.turns: list[Matrix] = []

    def path(self) -> Path:
        """From the base to the frame."""
        state, states = State(), list[State]()
        for i in range(len(self.plan.steps)):
            self.kind.entering(i)
            state = self._moved(i, self._rigid(state, self.plan.geometry[i].tolist()))
            states.append(state)
            self.kind.reached(i, state)
        self.kind.entering(len(states))
        end = self._rigid(state, self.plan.offsets[0].tolist())
        self.kind.reached(len(states), end)
        self.kind.entering(len(states) + 1)
        return Path(states, end, self.turns)

    def _rigid(self, s: State, row: Sequence[float]) -> State:
        R, d = row[: Geometry.OFFSET], row[Geometry.OFFSET : Geometry.MULTIPLIER]
        x, y, z = _structure(R[0:3]), _structure(R[3:6]), _structure(R[6:9])
        return self._turned(self._carried(s, _structure(d)), (x, y, z))

    def _seen(self, s: State, x: Vector) -> Vector:
        """A vector of the link, in the axes of the walk."""
        return x if self.own else self.eq.rotate(s.R, x)

    def _carried(self, s: State, d: Any) -> State:
        eq, lever = self.eq, self._seen(s, d)
        return replace(
            s,
            p=eq.point_position(s.p, s.R, d),
            vel=eq.point_velocity(s.vel, s.w, lever),
            acc=eq.point_acceleration(s.acc, s.alpha, s.w, lever),
        )

    def _turned(self, s: State, S: Any) -> State:
        R = self.eq.product(s.R, S)
        self.turns.append(S)
        if not self.own:
            return replace(s, R=R)
        back = self.eq.transposed(S)
        return State(R, s.p, *(self.eq.rotate(back, x) for x in (s.w, s.vel, s.alpha, s.acc)))

    def _about_z(self, s: State, angle: Number) -> State:
        return self._turned(s, self.eq.about_z(*self.kind.sine_cosine(angle), 0.0, 1.0))

    def _moved(self, i: int, s: State) -> State:
        eq, (kind, at, rate_at) = self.eq, self.plan.steps[i].tolist()
        multiplier, constant = self.plan.geometry[i, Geometry.MULTIPLIER :].tolist()
        if kind == Motion.PLANAR:
            return self._planar(s, at, rate_at)
        if kind == Motion.FLOATING:
            return self._floating(s, at, rate_at)
        x, v, a = (
            multiplier * self.q[at] + constant,
            multiplier * self.v[rate_at],
            multiplier * self.a[rate_at],
        )
        if kind == Motion.TURN:
            z = self._seen(s, _Z)
            alpha = eq.angular_acceleration(s.alpha, s.w, z, v, a)
            return self._about_z(replace(s, alpha=alpha, w=eq.angular_velocity(s.w, z, v)), x)
        s = self._carried(s, (0.0, 0.0, x))
        z = self._seen(s, _Z)
        acc = eq.sliding_acceleration(s.acc, s.w, z, v, a)
        return replace(s, vel=eq.sliding_velocity(s.vel, z, v), acc=acc)

    def _planar(self, s: State, at: int, rate_at: int) -> State:
        x, y, angle = self.q[at : at + 3]
        s = self._about_z(self._carried(s, (x, y, 0.0)), angle)
        (u, o), (u_rate, o_rate) = (
            ((x[0], x[1], 0.0), (0.0, 0.0, x[2]))
            for x in (z[rate_at : rate_at + 3] for z in (self.v, self.a))
        )
        return self._free(s, o, u, o_rate, u_rate)

    def _floating(self, s: State, at: int, rate_at: int) -> State:
        x, y, z, *quaternion = self.q[at : at + 7]
        length = self.kind.root(sum(c * c for c in quaternion))
        s = self._carried(s, (x, y, z))
        s = self._turned(s, self.eq.rotation_of_quaternion(*(c / length for c in quaternion)))
        (u, o), (u_rate, o_rate) = (
            (tuple(x[:3]), tuple(x[3:])) for x in (z[rate_at : rate_at + 6] for z in (self.v, self.a))
        )
        return self._free(s, o, u, o_rate, u_rate)

    def _free(self, s: State, o: Any, u: Any, o_rate: Any, u_rate: Any) -> State:
        """A planar or floating joint's rates, which are in the moved axes."""
        eq = self.eq
        o, u, o_rate, u_rate = (self._seen(s, x) for x in (o, u, o_rate, u_rate))
        return replace(
            s,
            w=eq.plus(s.w, o),
            vel=eq.plus(s.vel, u),
            alpha=eq.free_angular_acceleration(s.alpha, s.w, o, o_rate),
            acc=eq.free_acceleration(s.acc, s.w, o, u, u_rate),
        )


def _structure(x: Sequence[float]) -> Vector:
    """A constant vector without what is less than the rounding of its largest number.

    The cosine of the double nearest to pi/2 is 6e-17: a product for nothing wherever it stands. What leaving
    it out costs is counted in `urdfkin.kinematics.roundings`.
    """
    least = EPS / 2.0 * max(map(abs, x))
    first, second, third = (c if abs(c) > least else 0.0 for c in x)
    return first, second, third


# -- what is asked of the frame ----------------------------------------------------------------------------


def placement(plan: Plan, kind: Kind, inputs: Any, reference: Reference) -> list[Number]:
    """T_world_frame, row by row."""
    end = Walk(plan, kind, inputs, own=False).path().end
    rows = [[*row, x] for row, x in zip(end.R, end.p, strict=True)]
    return [*(x for row in rows for x in row), 0.0, 0.0, 0.0, 1.0]


def velocity(plan: Plan, kind: Kind, inputs: Any, reference: Reference) -> list[Number]:
    """[linear; angular]: 7.127, 7.128."""
    path, eq = _path(plan, kind, inputs, reference), kind.chapter
    s = path.end
    linear = s.vel
    if reference is Reference.WORLD:
        linear = eq.point_velocity(linear, s.w, eq.minus(ZERO, s.p))
    return _six(kind, path, reference, linear, s.w)


def acceleration(plan: Plan, kind: Kind, inputs: Any, reference: Reference) -> list[Number]:
    """[linear; angular], classical: 7.129, 7.130."""
    path, eq = _path(plan, kind, inputs, reference), kind.chapter
    s = path.end
    linear = s.acc
    if reference is Reference.WORLD:
        linear = eq.point_acceleration(linear, s.alpha, s.w, eq.minus(ZERO, s.p))
    return _six(kind, path, reference, linear, s.alpha)


def jacobian(plan: Plan, kind: Kind, inputs: Any, reference: Reference) -> list[Number]:
    """Row by row, 7.85."""
    return _columns(plan, kind, inputs, reference, rates=False)


def jacobian_rate(plan: Plan, kind: Kind, inputs: Any, reference: Reference) -> list[Number]:
    """Row by row, 7.126."""
    return _columns(plan, kind, inputs, reference, rates=True)


def hessian(plan: Plan, kind: Kind, inputs: Any, reference: Reference) -> list[Number]:
    """Column by column of each row of 7.85, how each rate changes it: 7.126 before it is summed."""
    path, eq = Walk(plan, kind, inputs, own=False).path(), kind.chapter
    end, to = path.end, ZERO if reference is Reference.WORLD else path.end.p
    columns = [
        (column, multiplier, _column(eq, path, column, to))
        for column, multiplier in zip(plan.columns.tolist(), plan.multipliers.tolist(), strict=True)
    ]
    out: list[Number] = [0.0] * (6 * plan.nv**2)
    for of, multiplier, six in columns:
        for by, rate, by_six in columns:
            before = by[Column.STEP] <= of[Column.STEP]
            change = _change(eq, six, by_six, reference, before=before)
            if reference is Reference.LOCAL:
                change = tuple(eq.rotate(eq.transposed(end.R), x) for x in change)
            for row, x in enumerate((*change[0], *change[1])):
                place = (row * plan.nv + of[Column.V]) * plan.nv + by[Column.V]
                out[place] = out[place] + multiplier * rate * x
    return out


def _change(eq: Any, six: Any, by: Any, reference: Reference, *, before: bool) -> Any:
    """How a column changes with a rate that comes before it, or with it, or behind it."""
    if reference is Reference.WORLD:
        return eq.motion_product(*by, *six) if before else (ZERO, ZERO)
    if reference is Reference.LOCAL:
        return (ZERO, ZERO) if before else eq.motion_product(*six, *by)
    return eq.turned_along(by[1], *six) if before else (eq.end_moved(six[1], by[0]), ZERO)


def _column(eq: Any, path: Path, column: Sequence[int], to: Vector) -> tuple[Vector, Vector]:
    """[linear; angular] of a rate, in the world's axes, of the body's point that is at `to`."""
    s = path.states[column[Column.STEP]]
    z = eq.transposed(s.R)[column[Column.AXIS]]
    if not column[Column.TURNS]:
        return z, ZERO
    six: tuple[Vector, Vector] = eq.turning_column(z, eq.minus(to, s.p))
    return six


def _path(plan: Plan, kind: Kind, inputs: Any, reference: Reference) -> Path:
    # From the world's origin a motion is seen through p, which is followed in the world's axes.
    return Walk(plan, kind, inputs, own=reference is not Reference.WORLD).path()


def _six(kind: Kind, path: Path, reference: Reference, linear: Vector, angular: Vector) -> list[Number]:
    if reference is Reference.LOCAL_WORLD_ALIGNED:
        for S in reversed(path.turns):
            linear, angular = kind.chapter.rotate(S, linear), kind.chapter.rotate(S, angular)
    return [*linear, *angular]


def _columns(plan: Plan, kind: Kind, inputs: Any, reference: Reference, *, rates: bool) -> list[Number]:
    path, eq = Walk(plan, kind, inputs, own=False).path(), kind.chapter
    end = path.end
    out: list[list[Number]] = [[0.0] * plan.nv for _ in range(6)]
    to, to_rate = (ZERO, ZERO) if reference is Reference.WORLD else (end.p, end.vel)
    for column, multiplier in zip(plan.columns.tolist(), plan.multipliers.tolist(), strict=True):
        linear, angular = _column(eq, path, column, to)
        if rates:
            s = path.states[column[Column.STEP]]
            z = eq.transposed(s.R)[column[Column.AXIS]]
            rate, turning = eq.axis_rate(s.w, z), ZERO
            if column[Column.TURNS]:
                d, d_rate = eq.minus(to, s.p), eq.minus(to_rate, s.vel)
                rate, turning = eq.turning_column_rate(z, rate, d, d_rate)
            if reference is Reference.LOCAL:
                rate = eq.rate_in_turning_axes(rate, end.w, linear)
                turning = eq.rate_in_turning_axes(turning, end.w, angular)
            linear, angular = rate, turning
        if reference is Reference.LOCAL:
            back = eq.transposed(end.R)
            linear, angular = eq.rotate(back, linear), eq.rotate(back, angular)
        for row, x in zip(out, (*linear, *angular), strict=True):
            row[column[Column.V]] = row[column[Column.V]] + multiplier * x
    return [x for row in out for x in row]


#: By the names of the table of quantities.
QUANTITIES: dict[str, Callable[[Plan, Kind, Any, Reference], list[Number]]] = {
    "placement": placement,
    "velocity": velocity,
    "jacobian": jacobian,
    "jacobian rate": jacobian_rate,
    "hessian": hessian,
    "acceleration": acceleration,
}
