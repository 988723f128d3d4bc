"""Find the structure of an arm, and export the structure for closed-form inverse kinematics solvers.

Six revolute joints have a closed-form solution if three consecutive axes are parallel or intersect in one
point (Pieper, 1968). The distance and the angle of two consecutive axes do not depend on the configuration.
Therefore, they are computed in the zero configuration.

An ortho-parallel arm with a spherical wrist (OPW, Brandstoetter et al., 2014) has the standard table

    a1 -90 c1 q1    c2 0 0 q2-90    a2 90 b q3+90    0 -90 c3 q4    0 90 0 q5    0 0 c4 q6

with cells in the order a, alpha, d, theta. OPW has no parameter for the small tilts of a calibrated arm.

Solvers by subproblem decomposition (IK-Geo, EAIK) take the axes h_i and the vectors P_i of the tip's pose:

    p(q) = P_0 + R(h_1, q_1) (P_1 + R(h_2, q_2) (P_2 + ... + P_n)),    R(q) = R(h_1, q_1) ... R(h_n, q_n) R_6T
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from urdfkin.dh.derive import DerivationOptions, derive
from urdfkin.dh.make import derive_matching_table, find_reversed_joints
from urdfkin.dh.screws import ProductOfExponentials
from urdfkin.dh.table import DHConvention, DHRow, DHTable, angle_difference, is_identity
from urdfkin.errors import InputError
from urdfkin.model.chain import FrameChain
from urdfkin.model.configuration import joint_value_range, largest_value, sample_uniform
from urdfkin.model.path import elementary_pose
from urdfkin.model.tree import FloatArray, JointKind, is_bounded

#: A property is reported if its deviation is at most this angle (rad) and this length (m).
NEAR_ANGLE, NEAR_LENGTH = 0.02, 0.005
#: A property with at most this deviation (rad and m) counts as exact.
EXACT_TOLERANCE = 1e-9
#: Singular values below this number count as zero. Their rounding errors are much smaller.
_RANK_TOLERANCE = 1e-6
_REACH_SAMPLES = 2000
#: Default tolerance of `find_opw` (metres and rad).
OPW_TOLERANCE = 1e-6
OPW_SAMPLES = 200
_RIGHT_ANGLE = math.pi / 2.0
_ALPHA, _THETA = (
    (-_RIGHT_ANGLE, 0.0, _RIGHT_ANGLE, -_RIGHT_ANGLE, _RIGHT_ANGLE, 0.0),
    (0.0, -_RIGHT_ANGLE, _RIGHT_ANGLE, 0.0, 0.0, 0.0),
)


@dataclass(frozen=True, slots=True)
class AxisPair:
    """Two consecutive axes.

    Attributes:
        angle: Angle between the axes, at most pi/2 rad.
        distance: Distance (m) between the axes, or 0 if a joint is prismatic.
    """

    first: str
    second: str
    angle: float
    distance: float


@dataclass(frozen=True, slots=True)
class StructureKind:
    """A property of consecutive joints, such as "spherical wrist".

    Attributes:
        radians: Largest deviation of an angle.
        metres: Largest deviation of a length.
        at: Centre (m) of a spherical wrist, shoulder or joint, in the base frame and the zero configuration.
            For other properties, the centre is None.
    """

    name: str
    joints: tuple[str, ...]
    radians: float = 0.0
    metres: float = 0.0
    at: tuple[float, ...] | None = None

    @property
    def is_exact(self) -> bool:
        return self.radians <= EXACT_TOLERANCE and self.metres <= EXACT_TOLERANCE


@dataclass(frozen=True, slots=True)
class Structure:
    """The geometric structure of a path.

    `reach` and `sampled_reach` are distances between the tip and `reach_from`.
    Prismatic joints without limits are sampled within `ASSUMED_LIMIT`.

    Attributes:
        joints: A letter for each joint: R for revolute, P for prismatic.
        freedoms: Rank of the Jacobian at a random configuration.
        reach: Upper bound (m) of the distance within the joint limits. The bound is infinite if a prismatic
            joint has no limits.
        sampled_reach: Largest sampled distance (m).
        reach_from: Point (m) in the base frame that does not depend on q.
        reach_point: Description of `reach_from`.
    """

    robot: str
    base_frame: str
    tip_frame: str
    joints: str
    freedoms: int
    pairs: tuple[AxisPair, ...]
    kinds: tuple[StructureKind, ...]
    reach: float
    sampled_reach: float
    reach_from: tuple[float, ...]
    reach_point: str
    solvers: tuple[str, ...]


def find_structure(screws: ProductOfExponentials) -> Structure:
    letters = "".join("R" if joint.kind.turns else "P" for joint in screws.joints)
    pairs = tuple(_make_pair(screws, i) for i in range(len(letters) - 1))
    kinds = [*_find_triples(screws, letters, pairs), *_find_arm_kinds(screws, letters, pairs)]
    kinds = sorted(kinds, key=lambda kind: (not kind.is_exact, kind.radians + kind.metres))
    tips, jacobian = _sample_tips_and_jacobian(screws)
    origin, reach_point = _find_origin(screws)
    return Structure(
        screws.robot,
        screws.base_frame,
        screws.tip_frame,
        letters,
        int(np.linalg.matrix_rank(jacobian, tol=_RANK_TOLERANCE)) if letters else 0,
        pairs,
        tuple(kinds),
        _reach_bound(screws, origin),
        float(_length(tips - origin).max()),
        tuple(origin.tolist()),
        reach_point,
        tuple(_find_solvers(letters, kinds, pairs)),
    )


# -- axes ----------------------------------------------------------------------------------------------


def _length(x: FloatArray) -> FloatArray:
    # Squares of lengths could overflow or underflow, but np.hypot does not.
    return np.asarray(np.hypot.reduce(x, axis=-1))


def _axis(screws: ProductOfExponentials, i: int) -> FloatArray:
    w = screws.space[i, :3]
    return w if w.any() else screws.space[i, 3:]


def _make_pair(screws: ProductOfExponentials, i: int) -> AxisPair:
    z, following = _axis(screws, i), _axis(screws, i + 1)
    cross = np.cross(z, following)
    angle = math.atan2(float(np.linalg.norm(cross)), abs(float(z @ following)))
    distance = 0.0
    if screws.joints[i].kind.turns and screws.joints[i + 1].kind.turns:
        between = screws.points[i + 1] - screws.points[i]
        is_parallel = angle < NEAR_ANGLE
        normal = _length(np.cross(z, between)) if is_parallel else abs(cross @ between) / np.sin(angle)
        distance = float(normal)
    return AxisPair(screws.joints[i].name, screws.joints[i + 1].name, angle, distance)


def find_intersection(screws: ProductOfExponentials, indices: tuple[int, ...]) -> tuple[FloatArray, float]:
    """Return the axes' least-squares intersection, and its largest distance (m) from an axis."""
    A, b = np.zeros((3, 3)), np.zeros(3)
    for i in indices:
        across = np.eye(3) - np.outer(_axis(screws, i), _axis(screws, i))
        A, b = A + across, b + across @ screws.points[i]
    point = np.asarray(np.linalg.lstsq(A, b, rcond=_RANK_TOLERANCE)[0], np.float64)
    distances = [_length(np.cross(_axis(screws, i), point - screws.points[i])) for i in indices]
    return point, float(max(distances))


# -- kinds ---------------------------------------------------------------------------------------------


def _find_triples(
    screws: ProductOfExponentials, letters: str, pairs: tuple[AxisPair, ...]
) -> list[StructureKind]:
    found = []
    for i in range(len(letters) - 2):
        if letters[i : i + 3] != "RRR":
            continue
        names = tuple(joint.name for joint in screws.joints[i : i + 3])
        tilt = max(pairs[i].angle, pairs[i + 1].angle)
        if tilt <= NEAR_ANGLE:
            found.append(StructureKind("three parallel axes", names, radians=tilt))
        elif min(pairs[i].angle, pairs[i + 1].angle) > NEAR_ANGLE:
            point, distance = find_intersection(screws, (i, i + 1, i + 2))
            if distance <= NEAR_LENGTH:
                place = "wrist" if i == len(letters) - 3 else "shoulder" if i == 0 else "joint"
                at = tuple(point.tolist())
                found.append(StructureKind(f"spherical {place}", names, metres=distance, at=at))
    return found


def _find_arm_kinds(
    screws: ProductOfExponentials, letters: str, pairs: tuple[AxisPair, ...]
) -> list[StructureKind]:
    names = tuple(joint.name for joint in screws.joints)
    tilt = max((pair.angle for pair in pairs), default=0.0)
    if sorted(letters) == ["P", "R", "R", "R"] and tilt <= NEAR_ANGLE:
        return [StructureKind("SCARA", names, radians=tilt)]
    if letters[:3] == "PPP":
        sine = max(abs(float(_axis(screws, i) @ _axis(screws, k))) for i, k in ((0, 1), (1, 2), (0, 2)))
        if sine <= NEAR_ANGLE:
            return [StructureKind("gantry", names[:3], radians=math.asin(sine))]
    return []


def _find_solvers(letters: str, kinds: list[StructureKind], pairs: tuple[AxisPair, ...]) -> list[str]:
    """Return the closed-form solvers for the arm, as if its approximate properties were exact."""
    names = {kind.name for kind in kinds}
    spherical = names & {"spherical wrist", "spherical shoulder"}
    if letters == "R" * 7 and len(spherical) == 2:
        return ["7R with spherical shoulder and wrist: closed form for each elbow angle"]
    if letters != "R" * 6:
        return []
    solutions = []
    orthogonal = [abs(pair.angle - math.pi / 2.0) <= NEAR_ANGLE for pair in pairs]
    parallel = [pair.angle <= NEAR_ANGLE for pair in pairs]
    if "spherical wrist" in names and orthogonal[0] and parallel[1] and all(orthogonal[2:]):
        solutions.append("OPW (ortho-parallel basis, spherical wrist): opw_kinematics, rs-opw-kinematics")
    intersect = [pair.distance <= NEAR_LENGTH and pair.angle > NEAR_ANGLE for pair in pairs]
    if spherical:
        suffix = "_two_parallel" if parallel[1] else "_two_intersecting" if intersect[0] else ""
        ik_geo = f", ik-geo's spherical{suffix}" if "spherical wrist" in names else ""
        solutions.append(f"Pieper, three axes meet: EAIK{ik_geo}")
    if "three parallel axes" in names:
        # ik-geo's solvers for three parallel axes require that axes 2, 3 and 4 are parallel. The solver with
        # the suffix _two_intersecting also requires that axes 5 and 6 intersect.
        ik_geo = f"ik-geo's three_parallel{'_two_intersecting' if intersect[4] else ''}"
        solvers = ["EAIK"] * any(intersect) + [ik_geo] * (parallel[1] and parallel[2])
        if solvers:
            two_meet = ", two meet" * any(intersect)
            solutions.append(f"Pieper, three axes are parallel{two_meet}: {', '.join(solvers)}")
    return solutions


# -- reach ---------------------------------------------------------------------------------------------


def _find_origin(screws: ProductOfExponentials) -> tuple[FloatArray, str]:
    if not screws.joints or not screws.joints[0].kind.turns:
        return np.zeros(3), "the base's origin"
    if len(screws.joints) > 1 and screws.joints[1].kind.turns:
        z, y = _axis(screws, 0), _axis(screws, 1)
        cross = np.cross(z, y)
        if np.linalg.norm(cross) > NEAR_ANGLE:
            between = screws.points[1] - screws.points[0]
            along = float(np.linalg.det([between, y, cross]) / (cross @ cross))
            nearest = np.asarray(screws.points[0] + along * z)
            return nearest, "the point of the first axis that is nearest to the second axis"
    return np.asarray(screws.points[0]), "the point of the first axis that is nearest to the base's origin"


def _reach_bound(screws: ProductOfExponentials, origin: FloatArray) -> float:
    """Bound the distance between `origin` and the tip.

    The bound is the length of a polyline from `origin` to the tip, plus the travel of the prismatic joints.
    The polyline has a corner on each revolute axis, at the point nearest to the previous corner.
    """
    point, total = origin, 0.0
    for i, joint in enumerate(screws.joints):
        if not joint.kind.turns:
            total += largest_value(joint.limit) if is_bounded(joint.limit) else math.inf
            continue
        z = _axis(screws, i)
        nearest = screws.points[i] + z * float(z @ (point - screws.points[i]))
        total += float(_length(nearest - point))
        point = nearest
    return total + float(_length(screws.M[:3, 3] - point))


def _sample_tips_and_jacobian(screws: ProductOfExponentials) -> tuple[FloatArray, FloatArray]:
    """Return sampled tip positions, and the Jacobian at the first sample; mimic rules are ignored."""
    ranges = [joint_value_range(joint.kind, joint.limit) for joint in screws.joints]
    values = sample_uniform(ranges, _REACH_SAMPLES)
    return screws.path.poses(values)[:, :3, 3], screws.path.pose_and_jacobian(values[0])[1]


@dataclass(frozen=True, slots=True, eq=False)
class OpwParameters:
    """The OPW parameters of an arm.

    The solver's joint values are `q_opw = sign * q - offset`.

    Attributes:
        base: T_base_opw.
        tool: T_flange_tip.
    """

    joints: tuple[str, ...]
    lengths: dict[str, float]
    offsets: tuple[float, ...]
    signs: tuple[int, ...]
    base: FloatArray
    tool: FloatArray

    def placement(self, q: FloatArray) -> FloatArray:
        """Return the tip's pose `base F(sign * q - offset) tool`; F is the solver's forward kinematics."""
        t = np.moveaxis(np.asarray(q) * self.signs - np.array(self.offsets), -1, 0)
        a1, a2, b, c1, c2, c3, c4 = self.lengths.values()
        x = c2 * np.sin(t[1]) + a2 * np.cos(t[1] + t[2]) + c3 * np.sin(t[1] + t[2]) + a1
        z = c2 * np.cos(t[1]) - a2 * np.sin(t[1] + t[2]) + c3 * np.cos(t[1] + t[2]) + c1
        T = (
            elementary_pose(2, True, t[0])
            @ elementary_pose(1, True, t[1] + t[2])
            @ elementary_pose(2, True, t[3])
            @ elementary_pose(1, True, t[4])
            @ elementary_pose(2, True, t[5])
        )
        T[..., :3, 3] = np.stack(
            [x * np.cos(t[0]) - b * np.sin(t[0]), x * np.sin(t[0]) + b * np.cos(t[0]), z], -1
        )
        T[..., :3, 3] += c4 * T[..., :3, 2]
        return np.asarray(self.base @ T @ self.tool)

    def as_mapping(self) -> dict[str, Any]:
        return {
            "opw_kinematics_geometric_parameters": self.lengths,
            "opw_kinematics_joint_offsets": list(self.offsets),
            "opw_kinematics_joint_sign_corrections": list(self.signs),
            "joints": list(self.joints),
            "T_base_opw": self.base.tolist(),
            "T_flange_tip": self.tool.tolist(),
        }


def find_opw(path: FrameChain, tolerance: float = OPW_TOLERANCE) -> OpwParameters:
    """Find the OPW parameters.

    `tolerance` is the largest permitted error of an entry of the tip's pose. Entries of the position are in
    m.

    Raises:
        InputError: the arm does not have six revolute joints, or no parameters are within the tolerance.
    """
    where = f"{path.robot}, {path.base} to {path.tip}"
    if [joint.kind.turns for joint in path.joints] != [True] * 6:
        letters = "".join("R" if joint.kind.turns else "P" for joint in path.joints)
        message = "an OPW arm must have six revolute joints, RRRRRR"
        raise InputError(message, where=where, found=letters or "no joints")
    free = replace(path, joints=tuple(replace(joint, mimic=None) for joint in path.joints))
    q = sample_uniform([(-np.pi, np.pi)] * len(path.joints), OPW_SAMPLES)
    expected, best, reason = free.placement(q), None, ""
    for reference in _opw_candidate_tables(path):
        try:
            options = DerivationOptions(flip=find_reversed_joints(path, DerivationOptions(), reference))
        except InputError as error:
            reason = reason or error.found or ""
            continue
        opw = _read_parameters(derive_matching_table(path, options, reference))
        errors = np.abs(opw.placement(q) - expected)
        metres, radians = float(errors[..., :3, 3].max()), float(errors[..., :3, :3].max())
        fails = max(metres, radians) > tolerance
        negative = sum(opw.lengths[name] < 0.0 for name in ("c1", "c2", "c3", "c4"))
        rank = (fails, max(metres, radians) if fails else negative, len(options.flip))
        if best is None or rank < best[0]:
            best = rank, opw
            reason = f"an error of {metres * 1e3:.3g} mm and {radians:.3g} rad at the tip"
    if best is None or best[0][0]:
        raise InputError(
            "the arm is not ortho-parallel with a spherical wrist (OPW)",
            where=where,
            found=reason,
            remedy="run `urdfkin structure` to see the arm's properties, or allow a larger tolerance"
            " (--opw MM)",
        )
    return best[1]


def _opw_candidate_tables(path: FrameChain) -> Iterator[DHTable]:
    """Yield an OPW table with approximate lengths for each choice of the signs of a1, a2 and b."""
    rows = derive(path, DerivationOptions(last="flange")).rows
    tip = float(np.linalg.norm(path.T_last_tip[:3, 3])) or 1.0
    a1, c2, a2 = (abs(row.a) for row in rows[:3])
    b = abs(rows[1].d) + abs(rows[2].d)
    for one, two, three in product((1.0, -1.0), repeat=3):
        a = (one * a1, c2, two * a2, 0.0, 0.0, 0.0)
        d = (abs(rows[0].d) or 1.0, 0.0, three * b, abs(rows[3].d), 0.0, tip)
        opw_rows = (
            DHRow(a[i], _ALPHA[i], d[i], _THETA[i], JointKind.REVOLUTE, joint.name)
            for i, joint in enumerate(path.joints)
        )
        yield DHTable(DHConvention.STANDARD, tuple(opw_rows))


def _read_parameters(table: DHTable) -> OpwParameters:
    """`table` comes from `derive_matching_table` with a reference from `_opw_candidate_tables`."""
    rows = table.rows
    lengths = {"a1": rows[0].a, "a2": rows[2].a, "b": rows[1].d + rows[2].d}
    lengths |= {"c1": rows[0].d, "c2": rows[1].a, "c3": rows[3].d, "c4": rows[5].d}
    offsets = (angle_difference(zero, row.theta) + 0.0 for zero, row in zip(_THETA, rows, strict=True))
    names, signs = tuple(row.joint for row in rows), tuple(row.sense for row in rows)
    # The last row of an OPW table has a = 0 and alpha = 0, so X_6 is the identity.
    tool = table.tool if is_identity(rows[5].X) else rows[5].X @ table.tool
    return OpwParameters(names, lengths, tuple(offsets), signs, table.base, tool)


def axes_and_connecting_vectors(screws: ProductOfExponentials) -> tuple[FloatArray, FloatArray]:
    """Return the axes h_i (n, 3) and the vectors P_i (n + 1, 3), m, of an arm with revolute joints.

    Intersecting axes share a point if possible, because solvers test whether a vector is exactly zero.
    """
    points = np.vstack([np.zeros(3), _choose_axis_points(screws), screws.M[:3, 3]])
    return screws.space[:, :3], np.diff(points, axis=0)


def _choose_axis_points(screws: ProductOfExponentials) -> FloatArray:
    """Return a point of each axis; consecutive axes that intersect share a point if possible.

    Intersections of three axes have priority over intersections of two axes. Later intersections have
    priority over earlier ones.
    """
    points, assigned, n = screws.points.copy(), set[int](), len(screws.joints)
    for size in (3, 2):
        for i in reversed(range(n - size + 1)):
            indices = tuple(range(i, i + size))
            axes = screws.space[list(indices), :3]
            sines = np.linalg.norm(np.cross(axes[:-1], axes[1:]), axis=-1)
            point, distance = find_intersection(screws, indices)
            if assigned.isdisjoint(indices) and sines.min() > NEAR_ANGLE and distance <= EXACT_TOLERANCE:
                points[list(indices)] = point
                assigned.update(indices)
    return points
