"""Prove upper bounds on the distance between a frame's poses in two models, for all configurations.

**Support functions.** The support function h(u) of a set W of points is the maximum of u . p over all points
p in W. The largest distance of W from the origin is the maximum of h(u) over all unit vectors u. A motion of
W changes h to h':

| motion of W | h'(u) |
|---|---|
| a rotation R | `h(R^T u)` |
| all rotations R of a range | the maximum of `h(R^T u)` |
| all translations p of a range | `h(u)` plus the maximum of `u . p` |

urdfkin computes h joint by joint along the chain, without a search over joint values.

urdfkin stores the values of h at grid points on the surface of a cube. The function h is convex, and h(s u) =
s h(u) for s >= 0, so interpolation between grid points gives an upper bound. For all rotations R in the range
of a joint, the vectors R^T u form an arc. urdfkin encloses the arc in a polygon, because a convex function on
a polygon is largest at a corner. At each joint, the interpolated h can be larger than the true h. The
relative error is proportional to the square of the grid spacing.

**Recursion.** Suppose that only the joints after joint i move. A's frame is then at x, and B's frame at y.
Let d = y - x. Joint i moves A's frame by e(S t), and B's frame by L e(S' t') with the constant rigid motion
L. If joint i moves too, d becomes:

`d' = (L - 1) e(S' t') y  +  (e(S' t') - e(S t')) y  +  (e(S t') - e(S t)) y  +  e(S t) d`

If A and B agree at joint i, the first three terms are 0. The sum of the terms' support functions is an upper
bound. The terms' support functions follow from the support functions of y and d. If A and B differ at several
joints, the terms of these joints may be largest in different configurations. The sum can then exceed the true
maximum.

A second bound is the sum of upper bounds on the displacements by all motions L. This sum is valid only if all
matched joints have equal axes and equal values. The result is the smaller of the two bounds.

**Second derivatives.** Let D = p_B - p_A be the difference of the frame's positions. `curvature_bounds`
computes bounds on the second derivatives of D, joint by joint from the frame to the base. Joint i has these
quantities:

| quantity | in A | in B |
|---|---|---|
| screw | S | S' |
| direction of the axis | u | u' |
| point on the axis | o | o' |
| value | t | t' |

The derivative of a rotating vector r with respect to the angle is u x r. Let Y = e(S' t') y. The derivatives
of y and d with respect to the value of joint i are:

`y_i = u' x (Y - o')`
`d_i = u x (Y - e(S t) (y - d)) + (u' - u) x (Y - o') + u x (o - o')`

The derivatives y_i and d_i are free vectors. Therefore, the joints between the base and joint i rotate these
vectors, but do not translate them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from urdfkin.kinematics.rotation import rotation_about, rotation_with_z_axis
from urdfkin.model.mechanisms.mechanism import (
    IDENTITY,
    Alignment,
    FramePair,
    MatchedJoints,
    MatchedValues,
    Screw,
    Variables,
    pose_difference,
)
from urdfkin.model.tree import FloatArray, pose

_FULL_TURN = 2.0 * math.pi
#: Number of corners of a polygon around a circle.
#: The corners are 0.1 % outside the circle.
_CIRCLE_CORNER_COUNT = 64


@dataclass(frozen=True, slots=True)
class Grid:
    """Directions, represented by grid points on the surface of a cube.

    Attributes:
        cells: Number of cells along each edge of the cube.
        segments: Number of sides of the polygon that contains a full circle of directions.
    """

    cells: int
    segments: int

    @property
    def points(self) -> FloatArray:
        """The grid points (n, 3)."""
        return _cube_surface_points(self.cells)

    @property
    def point_norms(self) -> FloatArray:
        return np.asarray(np.linalg.norm(self.points, axis=1))


@cache
def _cube_surface_points(cells: int) -> FloatArray:
    across = np.linspace(-1.0, 1.0, cells + 1)
    second, third = (x.ravel() for x in np.meshgrid(across, across, indexing="ij"))
    faces = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            face = np.empty((len(second), 3))
            face[:, axis], face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = sign, second, third
            faces.append(face)
    points = np.concatenate(faces)
    points.setflags(write=False)
    return points


@dataclass(frozen=True, slots=True, eq=False)
class Support:
    """The support function of a set of points.

    `values` contains upper bounds (m) on h at the grid points.
    """

    grid: Grid
    values: FloatArray

    def evaluate(self, u: FloatArray) -> FloatArray:
        """Return upper bounds (m) on h(u).

        Args:
            u: (..., 3) vectors of any length.
        """
        cells, v = self.grid.cells, self.values
        x, y, z = u[..., 0].ravel(), u[..., 1].ravel(), u[..., 2].ravel()
        X, Y, Z = np.abs(x), np.abs(y), np.abs(z)
        first = (X >= Y) & (X >= Z)
        second = ~first & (Y >= Z)
        front = np.where(first, x, np.where(second, y, z))
        right = np.where(first, y, np.where(second, z, x))
        up = np.where(first, z, np.where(second, x, y))
        largest = np.abs(front)
        scale = (0.5 * cells) / np.where(largest > 0.0, largest, 1.0)
        right, up = right * scale + 0.5 * cells, up * scale + 0.5 * cells
        i = np.minimum(right.astype(np.int32), cells - 1)
        j = np.minimum(up.astype(np.int32), cells - 1)
        right -= i
        up -= j
        face = np.where(first, 0, np.where(second, 2, 4)) + (front < 0.0)
        at = (face * (cells + 1) + i) * (cells + 1) + j
        with np.errstate(invalid="ignore"):
            near = v[at] + up * (v[at + 1] - v[at])
            far = v[at + cells + 1] + up * (v[at + cells + 2] - v[at + cells + 1])
            found = (near + right * (far - near)) * largest
        found[np.isnan(found)] = np.inf  # zero times infinity is NaN; the bound is then infinite
        return np.where(largest > 0.0, found, 0.0).reshape(u.shape[:-1])

    def rotate(self, screw: Screw, low: float, high: float) -> Support:
        """Return an upper bound on h over all rotations about `screw` from `low` to `high` (rad)."""
        angles, factors = np.array(_polygon_around_arc(low, high, self.grid.segments)).T
        G = self.grid.points
        centred = Support(self.grid, self.values - G @ screw.point)
        best = centred.rotate_values(screw.direction, angles, factors).max(axis=0)
        return Support(self.grid, best + G @ screw.point)

    def rotate_values(self, axis: FloatArray, angles: FloatArray, factors: FloatArray | float) -> FloatArray:
        """Return h after a rotation of the points, for each angle.

        The axis of the rotation contains the origin. The value at a grid point is:

        `h(along + factor R^T across)`

        The vectors `along` and `across` are the grid point's parts parallel and perpendicular to the axis.

        Args:
            axis: Unit vector.
            angles: (k,) angles, rad.
            factors: (k,) factors, or one factor for all angles.

        Returns:
            (k, n) values at the grid points.
        """
        G = self.grid.points
        along = (G @ axis)[:, np.newaxis] * axis
        R = rotation_about(axis, angles)  # a row vector times R equals R^T times the column vector
        across = (G - along) @ R * np.reshape(factors, (-1, 1, 1))
        return self.evaluate(along + across)

    def translate(self, direction: FloatArray, low: float, high: float) -> Support:
        """Return the maximum of h over all translations along `direction` from `low` to `high` (m)."""
        c = self.grid.points @ direction
        with np.errstate(invalid="ignore"):
            shifts = np.where(c == 0.0, 0.0, np.maximum(low * c, high * c))
        return Support(self.grid, self.values + shifts)

    def transform(self, T: FloatArray) -> Support:
        return Support(self.grid, self.evaluate(self.grid.points @ T[:3, :3]) + self.grid.points @ T[:3, 3])

    def radius(self, screw: Screw) -> float:
        """Return an upper bound (m) on the points' distance from a screw axis."""
        x, y, _ = rotation_with_z_axis(screw.direction).T
        corners = _polygon_around_arc(0.0, _FULL_TURN, _CIRCLE_CORNER_COUNT)
        u = np.array([factor * (math.cos(t) * x + math.sin(t) * y) for t, factor in corners])
        return float(max((self.evaluate(u) - u @ screw.point).max(), 0.0))

    def max_distance(self) -> float:
        """Return an upper bound (m) on the distance of the points from the origin.

        Let r be the largest angle between the centre of a grid cell and the cell's corners g_k. A direction u
        in the cell is the sum of c_k g_k with c_k >= 0. Therefore:

        `h(u) <= sum of c_k h(g_k)`
        `|u| >= cos r * (sum of c_k |g_k|)`
        `h(u) / |u| <= (max of h(g_k) / |g_k|) / cos r`
        """
        largest = float((self.values / self.grid.point_norms).max(initial=0.0))
        if math.isnan(largest):  # zero times infinity proves nothing
            return math.inf
        return largest / math.cos(math.atan(math.sqrt(2.0) / self.grid.cells))

    def __add__(self, other: Support) -> Support:
        return Support(self.grid, self.values + other.values)


def point_support(grid: Grid, p: FloatArray) -> Support:
    return Support(grid, grid.points @ p)


def _polygon_around_arc(low: float, high: float, segments: int) -> list[tuple[float, float]]:
    """Return each corner's angle (rad) and distance from the centre of the unit circle."""
    if high - low >= _FULL_TURN:
        half = math.pi / segments
        return [(2.0 * half * k, 1.0 / math.cos(half)) for k in range(segments)]
    if high == low:
        return [(low, 1.0)]
    count = max(1, math.ceil((high - low) / _FULL_TURN * segments))
    half = (high - low) / (2.0 * count)
    middles = [(low + (2 * k + 1) * half, 1.0 / math.cos(half)) for k in range(count)]
    return [(low, 1.0), *middles, (high, 1.0)]


#: `FINE_GRID` gives smaller bounds than `COARSE_GRID`, but takes longer.
COARSE_GRID, FINE_GRID = Grid(8, 24), Grid(16, 48)
#: Maximum number of intervals between the samples of a revolute joint's variable. If a range needs more
#: intervals, the joint's angles in A and B are treated as independent.
MAX_SAMPLE_INTERVALS = 1024


def upper_bounds(
    alignment: Alignment, variables: Variables, frame: FramePair, grid: Grid = COARSE_GRID
) -> tuple[float, float]:
    """Return upper bounds on the difference of a frame's poses in A and B.

    The bounds hold for all joint values within the limits.

    Returns:
        Bounds on the distance (m) and on the angle (rad). The bounds are 0 if nothing on the frame's path
        differs. A bound is inf if no bound is proven, for example if moving joints of different kinds are
        matched.
    """
    steps, pairs = joints_from_first_difference(alignment, variables, frame)
    if not steps and frame.constant_motion is IDENTITY:
        return 0.0, 0.0
    if any(step.kind_difference and pair is None for step, pair in zip(steps, pairs, strict=True)):
        return math.inf, math.inf
    radians = _angle_bound(steps, pairs, variables, frame)
    if not steps:  # no joint differs, so the distance is constant
        d = (
            frame.constant_motion[:3, :3] @ frame.zero_pose[:3, 3]
            + frame.constant_motion[:3, 3]
            - frame.zero_pose[:3, 3]
        )
        return float(np.linalg.norm(d)), radians
    return _distance_bound(steps, pairs, variables, frame, grid), radians


def joints_from_first_difference(
    alignment: Alignment, variables: Variables, frame: FramePair
) -> tuple[list[MatchedJoints], list[MatchedValues | None]]:
    """Return the joint pairs on a frame's path from the first difference on, and their values."""
    steps = alignment.path(frame.previous)
    pairs = [variables.pairs[i] for i in alignment.indices(frame.previous)]
    first = next((i for i, (s, p) in enumerate(zip(steps, pairs, strict=True)) if _differs(s, p)), len(steps))
    return steps[first:], pairs[first:]


def _differs(step: MatchedJoints, pair: MatchedValues | None) -> bool:
    return step.differs or bool(step.kind_difference) or (pair is not None and pair.a != pair.b)


def _angle_bound(
    steps: Sequence[MatchedJoints],
    pairs: Sequence[MatchedValues | None],
    variables: Variables,
    frame: FramePair,
) -> float:
    """Return the sum of the largest angles (rad) that the differences between A and B can cause."""
    total = pose_difference(IDENTITY, frame.constant_motion)[0]
    for step, pair in zip(steps, pairs, strict=True):
        total += pose_difference(IDENTITY, step.constant_motion)[0]
        if step.kind != "turns" or pair is None:
            continue
        if step.axis_b is not step.axis_a:
            # Let R be the joint's rotation by t, and Q the rotation by the tilt s between the axes. The
            # rotation Q R Q^T R^T has an angle r with sin(r/4) = sin(s/2) sin(t/2).
            most = min(max(map(abs, variables.range(pair.b))), math.pi)
            total += 4.0 * math.asin(math.sin(step.tilt / 2.0) * math.sin(most / 2.0))
        if pair.a != pair.b:
            total += variables.value_difference(pair)
    return min(total, math.pi)


def _distance_bound(
    steps: Sequence[MatchedJoints],
    pairs: Sequence[MatchedValues | None],
    variables: Variables,
    frame: FramePair,
    grid: Grid,
) -> float:
    d, y = supports_at_frame(frame, grid)
    by_constant_motions = _displacement_bound(frame.constant_motion, y.max_distance())
    for step, pair in zip(reversed(steps), reversed(pairs), strict=True):
        d, y = supports_after_joint(step, pair, variables, d, y)
        moves_alike = step.axis_b is step.axis_a and pair is not None and pair.a == pair.b
        by_constant_motions += (
            _displacement_bound(step.constant_motion, y.max_distance()) if moves_alike else math.inf
        )
    return min(d.max_distance(), by_constant_motions)


def _displacement_bound(L: FloatArray, reach: float) -> float:
    """Return |R - 1| reach + |p|, an upper bound on |L y - y| (m) for L = (R, p) and |y| <= reach."""
    rotation, translation = float(np.linalg.norm(L[:3, :3] - np.eye(3))), float(np.linalg.norm(L[:3, 3]))
    return translation + _product(rotation, reach)


def _product(factor: float, reach: float) -> float:
    """Return the product, where 0 * inf is 0."""
    return factor * reach if factor else 0.0


def supports_at_frame(frame: FramePair, grid: Grid) -> tuple[Support, Support]:
    """Return the support functions of d and y at the frame."""
    p, end = frame.zero_pose[:3, 3], frame.constant_motion
    y = end[:3, :3] @ p + end[:3, 3]
    return point_support(grid, y - p), point_support(grid, y)


def supports_after_joint(
    step: MatchedJoints, pair: MatchedValues | None, variables: Variables, d: Support, y: Support
) -> tuple[Support, Support]:
    """Return the support functions of d and y after a joint's motion and L."""
    # A planar or floating joint can rotate d by any angle. Therefore, the new upper bound on the support
    # function of d is h(u) = |u| max |d|.
    if pair is None:
        d = Support(d.grid, d.max_distance() * d.grid.point_norms)
        y = Support(d.grid, np.full(len(d.grid.points), math.inf))
    else:
        d = d_support_after_joint(step, pair, variables, y, d)
        ends = variables.range(pair.b)
        y = (
            y.rotate(step.axis_b, *ends)
            if step.kind == "turns"
            else y.translate(step.axis_b.direction, *ends)
        )
    return supports_after_constant_motion(step, d, y)


def supports_after_constant_motion(step: MatchedJoints, d: Support, y: Support) -> tuple[Support, Support]:
    """Return the support functions of d and y after the rigid motion L."""
    if step.constant_motion is IDENTITY:
        return d, y
    G, L = d.grid.points, step.constant_motion
    return Support(d.grid, d.values + y.evaluate(G @ (L[:3, :3] - np.eye(3))) + G @ L[:3, 3]), y.transform(L)


def d_support_after_joint(
    step: MatchedJoints, pair: MatchedValues, variables: Variables, y: Support, d: Support
) -> Support:
    """Return the support function of d after a joint's motion, without the motion L."""
    same = step.axis_b is step.axis_a and pair.a == pair.b
    if step.kind == "turns":
        about = Screw(step.axis_a.direction, np.zeros(3))
        if same:
            return d.rotate(about, *variables.range(pair.a)) if d.values.any() else d
        samples = _variable_samples(pair, variables, d.grid)
        if samples is not None:
            return _common_variable_difference(step, pair, samples, y, d)
        return d.rotate(about, *variables.range(pair.a)) + _independent_difference(step, pair, variables, y)
    return d if same else d + _prismatic_difference(step, pair, variables, y.grid)


def _prismatic_difference(
    step: MatchedJoints, pair: MatchedValues, variables: Variables, grid: Grid
) -> Support:
    """Return the support function of t' u' - t u for two matched prismatic joints.

    The difference is linear in the joint values, so its support function is largest at the limits.
    """
    if (name := pair.variable) is not None:
        ends = variables.ranges.get(name, (0.0, 0.0))
        values = [(pair.a.evaluate({name: z}), pair.b.evaluate({name: z})) for z in ends]
    else:
        values = [(t, other) for t in variables.range(pair.a) for other in variables.range(pair.b)]
    with np.errstate(invalid="ignore"):
        differences = [
            grid.points @ step.axis_b.direction * other - grid.points @ step.axis_a.direction * t
            for t, other in values
        ]
    max_difference = np.max(differences, axis=0)
    return Support(grid, np.where(np.isnan(max_difference), np.inf, max_difference))


def _variable_samples(pair: MatchedValues, variables: Variables, grid: Grid) -> FloatArray | None:
    """Return samples (n,) of the common variable of two revolute joints, or None.

    If the range is infinite, one turn covers the range only for the slopes 0, 1 and -1. The result is None
    for other slopes, for joints with different variables, and for more than `MAX_SAMPLE_INTERVALS` intervals.
    """
    if (name := pair.variable) is None:
        return None
    low, high = variables.ranges.get(name, (0.0, 0.0))  # a variable without a range moves no joint
    fastest = max(abs(pair.a.slope), abs(pair.b.slope))
    if math.isinf(high - low):
        if {abs(pair.a.slope), abs(pair.b.slope)} - {0.0, 1.0}:
            return None
        low, high = -math.pi, math.pi
    count = max(1, math.ceil(fastest * (high - low) / math.pi * grid.segments))
    return np.linspace(low, high, count + 1) if count <= MAX_SAMPLE_INTERVALS else None


def _common_variable_difference(
    step: MatchedJoints, pair: MatchedValues, samples: FloatArray, y: Support, d: Support
) -> Support:
    """Return the support function of d after two matched revolute joints with a common variable.

    Let b_0 and b_1 be the bounds at two neighbouring samples of the variable, and h the distance of the
    samples. Let M be a bound on the length of the second derivative. Between the samples, the bound is:

    `max(b_0, b_1) + M h^2 / 8`

    If t' = t + c, the second derivative is:

    `d^2/dt^2 (e(S' t') - e(S t)) y = R P x - R' P' x'`

    In A, x is the vector from the axis u to y, P projects perpendicular to u, and R rotates about u. In B,
    the symbols have a prime. The component of x' - x perpendicular to the axis is the offset of the axes. The
    matrices satisfy:

    `|R' - R| <= 2 |u' - u| + |c|`
    `|P' - P| <= |u' - u|`

    If t and t' have different slopes m and m', then M = m^2 r + m'^2 r'. Here r and r' are the largest
    distances of y from the axes.
    """
    G = y.grid.points
    axis, other = step.axis_a, step.axis_b
    t, t_other = (line.constant + line.slope * samples for line in (pair.a, pair.b))
    turns = [rotation_about(screw.direction, values) for screw, values in ((axis, t), (other, t_other))]
    D = turns[1] - turns[0]
    c = (other.point - turns[1] @ other.point) - (axis.point - turns[0] @ axis.point)
    at_samples = y.evaluate(G @ D) + (G @ c.T).T
    radius = y.radius(other)
    if pair.a.slope == pair.b.slope:
        tilt = float(np.linalg.norm(other.direction - axis.direction))
        reach = Support(y.grid, y.values - G @ other.point).max_distance() if tilt else 0.0
        axis_offset = float(np.linalg.norm(np.cross(other.point - axis.point, axis.direction)))
        angle_offset = abs(pair.b.constant - pair.a.constant)
        second = _product(2.0 * tilt + min(angle_offset, 2.0), radius) + tilt * reach + axis_offset
        second *= pair.a.slope**2
    else:
        second = _product(pair.a.slope**2, y.radius(axis)) + _product(pair.b.slope**2, radius)
    between = np.maximum(at_samples[:-1], at_samples[1:])
    between = between + second * (samples[1] - samples[0]) ** 2 / 8.0 * y.grid.point_norms
    if d.values.any():
        half = abs(pair.a.slope) * (samples[1] - samples[0]) / 2.0
        ends = d.rotate_values(axis.direction, t, 1.0)
        middles = d.rotate_values(axis.direction, (t[:-1] + t[1:]) / 2.0, 1.0 / math.cos(half))
        between += np.maximum(np.maximum(ends[:-1], ends[1:]), middles)
    return Support(y.grid, between.max(axis=0))


def _independent_difference(
    step: MatchedJoints, pair: MatchedValues, variables: Variables, y: Support
) -> Support:
    """Return the support function of e(S' t') y - e(S t) y for independent angles t and t'.

    If the axes are different, the result is the sum of the support functions of e(S' t') y and -e(S t) y. If
    the axes are equal, the length of the vector is at most 2 r sin(a/2). Here r is the largest distance of y
    from the axis, and a is the smaller of pi and the largest |t' - t|.
    """
    G, u = y.grid.points, step.axis_a.direction
    if step.axis_b is not step.axis_a:
        y_b = y.rotate(step.axis_b, *variables.range(pair.b))
        y_a = y.rotate(step.axis_a, *variables.range(pair.a))
        return Support(y.grid, y_b.values + y_a.evaluate(-G))
    chord = _product(
        2.0 * math.sin(min(variables.value_difference(pair), math.pi) / 2.0), y.radius(step.axis_a)
    )
    across = np.linalg.norm(G - (G @ u)[:, None] * u, axis=1)
    return Support(y.grid, np.array([_product(length, chord) for length in across]))


#: Support functions of the vectors d and y.
_SupportPair = tuple[Support, Support]


def curvature_bounds(
    steps: Sequence[MatchedJoints], pairs: Sequence[MatchedValues], variables: Variables, frame: FramePair
) -> tuple[list[str], FloatArray]:
    """Return upper bounds on the lengths of the second derivatives of D for each pair of variables.

    D = p_B - p_A is the difference of the frame's positions. All bounds are inf if paired joints
    have different variables or slopes. Pairs without effect on D are ignored.

    Returns:
        Names of the n variables, and (n, n) bounds. Bound (i, j) has the unit m / (unit i * unit j).
    """
    names = list(dict.fromkeys(line.variable for pair in pairs for line in (pair.a, pair.b) if line.slope))
    M = np.zeros((len(names), len(names)))
    for i, j, bound in _second_derivative_bounds(steps, pairs, variables, frame):
        both = pairs[i], pairs[j]
        if not all(one.a.slope or one.b.slope for one in both):
            continue
        alike = [one.variable is not None and one.a.slope == one.b.slope for one in both]
        # For a prismatic joint i, `bound` can be 0 although the joint values in A and B differ.
        if not all(alike) and (bound or (steps[i].kind != "turns" and not alike[0])):
            return names, np.full_like(M, math.inf)
        if not bound:
            continue
        second = bound * abs(pairs[i].a.slope * pairs[j].a.slope)
        row, column = (names.index(pairs[k].a.variable) for k in (i, j))
        M[row, column] += second
        if i != j:
            M[column, row] += second
    return names, M


def _second_derivative_bounds(
    steps: Sequence[MatchedJoints], pairs: Sequence[MatchedValues], variables: Variables, frame: FramePair
) -> Iterator[tuple[int, int, float]]:
    """Yield joints i and j <= i, and a bound on the second derivative of D with respect to their values."""
    free = [_as_free_vectors(step) for step in steps]
    d, y = supports_at_frame(frame, COARSE_GRID)
    for i in reversed(range(len(steps))):
        first = _derivative_supports(steps[i], pairs[i], variables, d, y)
        if steps[i].kind == "turns":
            yield (
                i,
                i,
                _length_bound_at_base(
                    _cross_product_supports(free[i], *first), free[: i + 1], pairs, variables
                ),
            )
        supports = supports_after_constant_motion(free[i], *first)
        for j in reversed(range(i)):
            if steps[j].kind == "turns":
                second = _derivative_supports(free[j], pairs[j], variables, *supports)
                yield i, j, _length_bound_at_base(second, free[: j + 1], pairs, variables)
                supports = supports_after_joint(free[j], pairs[j], variables, *supports)
            else:
                supports = supports_after_constant_motion(free[j], *supports)
        d, y = supports_after_joint(steps[i], pairs[i], variables, d, y)


def _length_bound_at_base(
    supports: _SupportPair,
    steps: Sequence[MatchedJoints],
    pairs: Sequence[MatchedValues],
    variables: Variables,
) -> float:
    """Return an upper bound on the length of d at the base.

    `supports` does not include the motion L of `steps[-1]`.
    """
    supports = supports_after_constant_motion(steps[-1], *supports)
    for step, pair in zip(reversed(steps[:-1]), reversed(pairs[: len(steps) - 1]), strict=True):
        slides = step.kind != "turns"
        supports = (
            supports_after_constant_motion(step, *supports)
            if slides
            else supports_after_joint(step, pair, variables, *supports)
        )
    return supports[0].max_distance()


def _derivative_supports(
    step: MatchedJoints, pair: MatchedValues, variables: Variables, d: Support, y: Support
) -> _SupportPair:
    """Return bounds on the support functions of the derivatives of d and y, without the motion L.

    The derivatives are with respect to the joint's value.
    """
    if step.kind != "turns":
        u, other = step.axis_a.direction, step.axis_b.direction
        return point_support(d.grid, other - u), point_support(d.grid, other)
    d, y = d_support_after_joint(step, pair, variables, y, d), y.rotate(step.axis_b, *variables.range(pair.b))
    return _cross_product_supports(step, d, y)


def _cross_product_supports(step: MatchedJoints, d: Support, y: Support) -> _SupportPair:
    """Return upper bounds on the support functions of d_i and y_i.

    `d_i = u x d + (u' - u) x (y - o') + u x (o - o')`
    `y_i = u' x (y - o')`.

    The arguments d and y include the joint's motion.
    """
    G, axis, other = d.grid.points, step.axis_a, step.axis_b
    by_axes = 0.0
    if other is not axis:
        reach = Support(d.grid, y.values - G @ other.point).max_distance()
        by_axes = float(np.linalg.norm(other.direction - axis.direction)) * reach
        by_axes += float(np.linalg.norm(np.cross(axis.direction, axis.point - other.point)))
    across_a, across_b = np.cross(G, axis.direction), np.cross(G, other.direction)
    d_cross = Support(d.grid, d.evaluate(across_a) + by_axes * d.grid.point_norms)
    return d_cross, Support(d.grid, y.evaluate(across_b) - across_b @ other.point)


def _as_free_vectors(step: MatchedJoints) -> MatchedJoints:
    """Remove the translations of a matched joint, because a translation does not change a free vector."""
    axis = Screw(step.axis_a.direction, np.zeros(3))
    other = axis if step.axis_b is step.axis_a else Screw(step.axis_b.direction, np.zeros(3))
    constant_motion = IDENTITY if step.constant_motion is IDENTITY else pose(step.constant_motion[:3, :3])
    return replace(step, axis_a=axis, axis_b=other, constant_motion=constant_motion)


def relevant_joints(
    alignment: Alignment, variables: Variables, frame: FramePair
) -> tuple[list[MatchedJoints], list[MatchedValues | None]]:
    """Return the matched joints that affect the length of D, and the values of these joints.

    The result begins at the first joint that differs. If an earlier joint has the same variable as one of
    these joints, the result begins at the earlier joint.
    """
    steps, pairs = (
        alignment.path(frame.previous),
        [variables.pairs[i] for i in alignment.indices(frame.previous)],
    )
    first = len(steps) - len(joints_from_first_difference(alignment, variables, frame)[0])
    for i in reversed(range(first)):
        if _variables(pairs[i : i + 1]) & _variables(pairs[first:]):
            first = i
    return steps[first:], pairs[first:]


def _variables(pairs: Sequence[MatchedValues | None]) -> set[str]:
    lines = (line for pair in pairs if pair is not None for line in (pair.a, pair.b))
    return {line.variable for line in lines if line.slope}
