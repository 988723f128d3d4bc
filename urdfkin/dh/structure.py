"""What kind of arm it is: which axes are parallel or meet, how nearly, and what can be solved in closed form.

Two consecutive axes keep their distance and their angle in every configuration, so that what is read from the
screws at zero holds everywhere (`urdfkin.dh.screws`, which Pinocchio checks). Pieper (1968): six turning
joints have a solution in closed form where three consecutive axes are parallel or meet in one point. A
calibrated robot is never exactly of a kind; how far off it is is said in radians and metres.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from urdfkin.dh.screws import Screws
from urdfkin.model.tree import FloatArray, is_bounded

#: Radians and metres up to which a kind is said, with its distance; and up to which it is exact.
NEAR_ANGLE, NEAR_LENGTH, EXACT = 0.02, 0.005, 1e-9
#: Singular values below this are freedoms that a path does not have: far above rounding, far below a lever.
_RANK = 1e-6
#: Configurations on which the reach is looked for, each joint free within its limits.
_SAMPLES = 2000


@dataclass(frozen=True, slots=True)
class Pair:
    """Two consecutive axes: the angle between their lines, to pi/2, and their distance, 0 beside a slide."""

    first: str
    second: str
    angle: float
    distance: float


@dataclass(frozen=True, slots=True)
class Kind:
    """A property of some consecutive joints.

    Attributes:
        name: "parallel", "meet in a point", "spherical wrist", ...
        joints: Whose.
        radians: How far from it.
        metres: Likewise.
        at: (3,) where, in the base at zero, metres; None where that means nothing.
    """

    name: str
    joints: tuple[str, ...]
    radians: float = 0.0
    metres: float = 0.0
    at: tuple[float, ...] | None = None

    @property
    def is_exact(self) -> bool:
        """Whether rounding explains the distance."""
        return self.radians <= EXACT and self.metres <= EXACT


@dataclass(frozen=True, slots=True)
class Structure:
    """What kind of arm a path is.

    Attributes:
        robot: The robot's name.
        base_frame: What the base is called.
        tip_frame: What the tip is called.
        joints: R or P for each joint.
        freedoms: How many directions the tip can move in at a general configuration: the Jacobian's rank.
        pairs: Of each pair of consecutive axes the angle and the distance.
        kinds: What holds, exactly or nearly, the nearest first.
        reach: Metres from the first axis' point nearest to the second to the tip: no more than this.
        reached: Metres, the largest on samples.
        solvers: What can be solved in closed form, by whom.
    """

    robot: str
    base_frame: str
    tip_frame: str
    joints: str
    freedoms: int
    pairs: tuple[Pair, ...]
    kinds: tuple[Kind, ...]
    reach: float
    reached: float
    solvers: tuple[str, ...]

    def as_mapping(self) -> dict[str, Any]:
        """Plain data; metres and radians."""
        return asdict(self)


def structure(screws: Screws) -> Structure:
    """The structure of a path.

    Args:
        screws: The path as a product of exponentials.
    """
    letters = "".join("R" if joint.kind.turns else "P" for joint in screws.joints)
    pairs = tuple(_pair(screws, i) for i in range(len(letters) - 1))
    kinds = [*_triples(screws, letters, pairs), *_whole(screws, letters, pairs)]
    kinds = sorted(kinds, key=lambda kind: (not kind.is_exact, kind.radians + kind.metres))
    tips, jacobian = _sampled(screws)
    origin = _origin(screws)
    return Structure(
        screws.robot,
        screws.base_frame,
        screws.tip_frame,
        letters,
        int(np.linalg.matrix_rank(jacobian, tol=_RANK)) if letters else 0,
        pairs,
        tuple(kinds),
        _longest(screws, origin),
        float(np.linalg.norm(tips - origin, axis=-1).max()),
        tuple(_solvers(letters, kinds, pairs)),
    )


# -- axes ----------------------------------------------------------------------------------------------


def _axis(screws: Screws, i: int) -> FloatArray:
    w = screws.space[i, :3]
    return w if w.any() else screws.space[i, 3:]


def _pair(screws: Screws, i: int) -> Pair:
    z, following = _axis(screws, i), _axis(screws, i + 1)
    cross = np.cross(z, following)
    angle = math.atan2(float(np.linalg.norm(cross)), abs(float(z @ following)))
    distance = 0.0
    if screws.joints[i].kind.turns and screws.joints[i + 1].kind.turns:
        between = screws.points[i + 1] - screws.points[i]
        across = (
            np.linalg.norm(np.cross(z, between))
            if angle < NEAR_ANGLE
            else abs(cross @ between) / np.sin(angle)
        )
        distance = float(across)
    return Pair(screws.joints[i].name, screws.joints[i + 1].name, angle, distance)


def meeting(screws: Screws, at: tuple[int, ...]) -> tuple[FloatArray, float]:
    """The point nearest to some axes in least squares, and how far the farthest of them is."""
    A, b = np.zeros((3, 3)), np.zeros(3)
    for i in at:
        across = np.eye(3) - np.outer(_axis(screws, i), _axis(screws, i))
        A, b = A + across, b + across @ screws.points[i]
    point = np.asarray(np.linalg.lstsq(A, b, rcond=_RANK)[0], np.float64)
    off = [np.linalg.norm(np.cross(_axis(screws, i), point - screws.points[i])) for i in at]
    return point, float(max(off))


# -- kinds ---------------------------------------------------------------------------------------------


def _triples(screws: Screws, letters: str, pairs: tuple[Pair, ...]) -> list[Kind]:
    found = []
    for i in range(len(letters) - 2):
        if letters[i : i + 3] != "RRR":
            continue
        names = tuple(joint.name for joint in screws.joints[i : i + 3])
        tilt = max(pairs[i].angle, pairs[i + 1].angle)
        if tilt <= NEAR_ANGLE:
            found.append(Kind("three parallel axes", names, radians=tilt))
        elif min(pairs[i].angle, pairs[i + 1].angle) > NEAR_ANGLE:
            point, off = meeting(screws, (i, i + 1, i + 2))
            if off <= NEAR_LENGTH:
                where = " wrist" if i == len(letters) - 3 else " shoulder" if i == 0 else " joint"
                name = "spherical" + where
                found.append(Kind(name, names, metres=off, at=tuple(float(x) for x in point)))
    return found


def _whole(screws: Screws, letters: str, pairs: tuple[Pair, ...]) -> list[Kind]:
    names = tuple(joint.name for joint in screws.joints)
    tilt = max((pair.angle for pair in pairs), default=0.0)
    if sorted(letters) == ["P", "R", "R", "R"] and tilt <= NEAR_ANGLE:
        return [Kind("SCARA", names, radians=tilt)]
    if letters[:3] == "PPP":
        off = max(abs(float(_axis(screws, i) @ _axis(screws, k))) for i, k in ((0, 1), (1, 2), (0, 2)))
        if off <= NEAR_ANGLE:
            return [Kind("gantry", names[:3], radians=math.asin(off))]
    return []


def _solvers(letters: str, kinds: list[Kind], pairs: tuple[Pair, ...]) -> list[str]:
    """What is known to be solved in closed form; a kind that holds nearly gives nearly the solution."""
    named = {kind.name for kind in kinds}
    spherical = [kind for kind in kinds if kind.name in ("spherical wrist", "spherical shoulder")]
    if letters == "R" * 7:
        return (
            ["7R with spherical shoulder and wrist: closed form for each elbow angle"]
            if len(spherical) == 2
            else []
        )
    if letters != "R" * 6:
        return []
    found = []
    square = [abs(pair.angle - math.pi / 2.0) <= NEAR_ANGLE for pair in pairs]
    flat = [pair.angle <= NEAR_ANGLE for pair in pairs]
    if "spherical wrist" in named and square[0] and flat[1] and all(square[2:]):
        found.append("OPW (ortho-parallel basis, spherical wrist): opw_kinematics, rs-opw-kinematics")
    meet = [pair.distance <= NEAR_LENGTH and pair.angle > NEAR_ANGLE for pair in pairs]
    if spherical:
        ends = "_two_parallel" if flat[1] else "_two_intersecting" if meet[0] else ""
        ik_geo = f", ik-geo's spherical{ends}" if "spherical wrist" in named else ""
        found.append(f"Pieper, three axes meet: EAIK{ik_geo}")
    if "three parallel axes" in named:
        # ik-geo wants the axes 2, 3, 4 parallel, and 5, 6 to meet.
        ik_geo = f"ik-geo's three_parallel{'_two_intersecting' if meet[4] else ''}"
        solvers = ["EAIK"] * any(meet) + [ik_geo] * (flat[1] and flat[2])
        if solvers:
            found.append(f"Pieper, three axes are parallel{', two meet' * any(meet)}: {', '.join(solvers)}")
    return found


# -- reach ---------------------------------------------------------------------------------------------


def _origin(screws: Screws) -> FloatArray:
    """The first axis' point nearest to the second axis, or to the tip where there is none."""
    if not screws.joints:
        return np.zeros(3)
    if len(screws.joints) > 1 and screws.joints[0].kind.turns and screws.joints[1].kind.turns:
        z, y = _axis(screws, 0), _axis(screws, 1)
        cross = np.cross(z, y)
        if np.linalg.norm(cross) > NEAR_ANGLE:
            between = screws.points[1] - screws.points[0]
            along = float(np.linalg.det([between, y, cross]) / (cross @ cross))
            return np.asarray(screws.points[0] + along * z)
    return np.asarray(screws.points[0])


def _longest(screws: Screws, origin: FloatArray) -> float:
    """The way from axis to axis, by the feet of their common normals: the tip is never farther away."""
    here, total = origin, 0.0
    for i, joint in enumerate(screws.joints):
        if not joint.kind.turns:
            limit = joint.limit
            total += max(abs(limit.lower), abs(limit.upper)) if limit else math.inf
            continue
        z = _axis(screws, i)
        foot = screws.points[i] + z * float(z @ (here - screws.points[i]))
        total += float(np.linalg.norm(foot - here))
        here = foot
    return total + float(np.linalg.norm(screws.M[:3, 3] - here))


def _sampled(screws: Screws) -> tuple[FloatArray, FloatArray]:
    """Where the tip comes to, each joint within its limits, and the screws at one of these."""
    rng, bounds = np.random.default_rng(0), []
    for joint in screws.joints:
        limit = joint.limit
        bounds.append((limit.lower, limit.upper) if is_bounded(limit) else (-math.pi, math.pi))
    lower, upper = np.array(bounds).reshape(-1, 2).T
    values = rng.uniform(lower, upper, (_SAMPLES, len(bounds)))
    free = Screws(tuple(type(j)(j.name, j.kind) for j in screws.joints), screws.M, screws.space)
    tips = free.placement(values)[:, :3, 3]
    return tips, free.jacobian(values[0])
