"""What is drawn over a robot: joint velocities, the ellipsoid of velocity, the acceleration's parts.

The columns of the Jacobian are the frame's velocities for unit rates (7.85); joint rates of length one fill
an ellipsoid whose axes are the left singular vectors, its half-lengths the singular values; the acceleration
is the sum of its transverse, centripetal, Coriolis and sliding parts (7.125, 7.130).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdfkin.compiled.breakdown import KINDS
from urdfkin.kinematics.rotation import quaternion_of
from urdfkin.model.tree import FloatArray
from urdfkin.motion.frame_motion import FrameMotion

#: The colour of each part of the acceleration, 0 to 255, and of their sum.
PART_COLOURS = {
    "transverse": (0, 114, 178),
    "centripetal": (213, 94, 0),
    "coriolis": (0, 158, 115),
    "sliding": (204, 121, 167),
    "sum": (30, 30, 30),
}
LINEAR, ANGULAR = (0, 114, 178), (204, 121, 167)
#: The largest arrow is this part of the robot's reach.
_SHARE = 0.3


@dataclass(frozen=True, eq=False)
class Arrows:
    """Arrows in the world.

    Attributes:
        points: (n, 2, 3) from and to, metres.
        colours: (n, 3) 0 to 255.
        names: One for each.
    """

    points: FloatArray
    colours: np.ndarray
    names: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """Half-lengths (3,) in metres as drawn, centre (3,), orientation (4,) scalar first."""

    half: FloatArray
    centre: FloatArray
    wxyz: FloatArray


def jacobian_arrows(x: FrameMotion, rates: tuple[str, ...], reach: float, *, angular: bool) -> Arrows:
    """The frame's velocity for a unit rate of each joint alone, in world axes, from the frame's origin.

    Args:
        x: A motion of one sample in LOCAL_WORLD_ALIGNED.
        rates: A name for each column.
        reach: The robot's size, for the arrows' scale.
        angular: Angular velocities instead of linear ones.
    """
    rows = slice(3, 6) if angular else slice(0, 3)
    columns = x.jacobian[0, rows].T
    keep = np.linalg.norm(columns, axis=1) > 1e-9
    colour = ANGULAR if angular else LINEAR
    names = tuple(name for name, kept in zip(rates, keep, strict=True) if kept)
    return _arrows(x, columns[keep], [colour] * int(keep.sum()), names, reach)


def acceleration_arrows(x: FrameMotion, reach: float) -> Arrows:
    """The parts of the frame's linear acceleration and their sum, in world axes, from the frame's origin."""
    parts = np.vstack([x.parts.by_kind[0, :, :3], x.acceleration[0, :3]])
    keep = np.linalg.norm(parts, axis=1) > 1e-9
    names = tuple(name for name, kept in zip((*KINDS, "sum"), keep, strict=True) if kept)
    return _arrows(x, parts[keep], [PART_COLOURS[name] for name in names], names, reach)


def _arrows(
    x: FrameMotion,
    vectors: FloatArray,
    colours: list[tuple[int, int, int]],
    names: tuple[str, ...],
    reach: float,
) -> Arrows:
    start = np.broadcast_to(x.placement[0, :3, 3], vectors.shape)
    largest = float(np.linalg.norm(vectors, axis=1).max(initial=0.0))
    scale = _SHARE * reach / largest if largest > 0.0 else 0.0
    points = np.stack([start, start + scale * vectors], axis=1)
    return Arrows(points, np.array(colours, dtype=np.uint8).reshape(-1, 3), names)


def velocity_ellipsoid(x: FrameMotion, reach: float, *, angular: bool = False) -> Ellipsoid:
    """Where the frame's velocity can point for joint rates of length one.

    A direction that no joint moves is drawn as thin as can be seen.

    Args:
        x: A motion of one sample in LOCAL_WORLD_ALIGNED.
        reach: The robot's size, for the scale.
        angular: Of the angular velocity.
    """
    J = x.jacobian[0, slice(3, 6) if angular else slice(0, 3)]
    full = np.hstack([J, np.zeros((3, max(0, 3 - J.shape[1])))])
    U, s, _ = np.linalg.svd(full)
    U = U * np.array([1.0, 1.0, np.sign(np.linalg.det(U))])
    largest = float(s[0])
    half = _SHARE * reach * (s / largest if largest > 0.0 else np.zeros(3))
    half = np.maximum(half, 0.002 * reach)
    return Ellipsoid(half, x.placement[0, :3, 3], scalar_first(U))


def scalar_first(R: FloatArray) -> FloatArray:
    """(..., 4) quaternions (w, x, y, z), as viewers want them."""
    return np.asarray(np.roll(quaternion_of(R), 1, axis=-1), dtype=np.float64)
