"""Where a point of a moving chain can come at most: support functions, bounded from above.

The support function of a set W of points is h(u) = max over p in W of u . p. It is all that a bound on
distances asks of W, and it passes through joints: where W is turned by any angle of a range about an axis,
h'(u) is the largest h over the directions u turned back, and where it slides, the slide's own is added. So
the whole reach of a chain is a function on directions, however many joints it has: no search in all its
coordinates together.

h is kept at the points of a grid on the cube's surface, and is convex with h(s u) = s h(u): at any direction
it is at most what interpolation between grid points says, which therefore is a bound, not a guess. A turn is
bounded likewise: an arc of directions lies in the polygon drawn about it, and h on the polygon is largest at
a corner. Each makes a bound larger by a share that falls with the square of the grid's step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from urdfkin.kinematics.rotation.aligning import axis_aligning
from urdfkin.kinematics.rotation.axis_angle import rotation_about
from urdfkin.model.mechanisms.mechanism import Screw
from urdfkin.model.tree import FloatArray

_WHOLE = 2.0 * math.pi
#: Corners of the polygon about a circle: they lie farther out by a thousandth.
_AROUND = 64


@dataclass(frozen=True, slots=True)
class Grid:
    """Directions on a cube's surface.

    Attributes:
        cells: Along an edge of a face.
        segments: Into which a whole turn is divided.
    """

    cells: int
    segments: int

    @property
    def points(self) -> FloatArray:
        """(n, 3) of largest coordinate 1."""
        return _points(self.cells)

    @property
    def lengths(self) -> FloatArray:
        """(n,) of the points."""
        return np.asarray(np.linalg.norm(self.points, axis=1))


@cache
def _points(cells: int) -> FloatArray:
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
    """A bound on a support function, metres: its values at the grid's points."""

    grid: Grid
    values: FloatArray

    def at(self, u: FloatArray) -> FloatArray:
        """(...) bounds at directions (..., 3) of any length; 0 at none."""
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
        found[np.isnan(found)] = np.inf  # nothing of an infinite neighbour is not told from some
        return np.where(largest > 0.0, found, 0.0).reshape(u.shape[:-1])

    def turned(self, screw: Screw, low: float, high: float) -> Support:
        """Of the set turned about a screw by any angle of a range."""
        angles, factors = np.array(_corners(low, high, self.grid.segments)).T
        G = self.grid.points
        centred = Support(self.grid, self.values - G @ screw.point)
        best = centred.turned_back(screw.direction, angles, factors).max(axis=0)
        return Support(self.grid, best + G @ screw.point)

    def turned_back(self, axis: FloatArray, angles: FloatArray, factors: FloatArray | float) -> FloatArray:
        """(angles, n) at the grid's points turned back about an axis, their part across it made longer."""
        G = self.grid.points
        along = (G @ axis)[:, np.newaxis] * axis
        back = rotation_about(axis, angles)  # a row times R is R^T times the column
        across = (G - along) @ back * np.reshape(factors, (-1, 1, 1))
        return self.at(along + across)

    def slid(self, direction: FloatArray, low: float, high: float) -> Support:
        """Of the set slid along a direction by any way of a range."""
        c = self.grid.points @ direction
        with np.errstate(invalid="ignore"):
            ways = np.where(c == 0.0, 0.0, np.maximum(low * c, high * c))
        return Support(self.grid, self.values + ways)

    def moved(self, T: FloatArray) -> Support:
        """Of the set after a rigid motion."""
        return Support(self.grid, self.at(self.grid.points @ T[:3, :3]) + self.grid.points @ T[:3, 3])

    def radius(self, screw: Screw) -> float:
        """How far from a screw's line the set comes at most, metres."""
        x, y, _ = axis_aligning(screw.direction).T
        corners = [
            factor * (math.cos(t) * x + math.sin(t) * y) for t, factor in _corners(0.0, _WHOLE, _AROUND)
        ]
        u = np.array(corners)
        return float(max((self.at(u) - u @ screw.point).max(), 0.0))

    def largest(self) -> float:
        """How far from the origin the set comes at most, metres.

        A direction between grid points g_k is a sum of them, c_k g_k, all within r of the middle of their
        cell; so its length is cos r times that of all c_k |g_k| at least, and h there 1 / cos r of theirs at
        most.
        """
        share = (self.values / self.grid.lengths).max(initial=0.0)
        return float(share) / math.cos(math.atan(math.sqrt(2.0) / self.grid.cells))

    def __add__(self, other: Support) -> Support:
        return Support(self.grid, self.values + other.values)


def point(grid: Grid, p: FloatArray) -> Support:
    """Of a single point."""
    return Support(grid, grid.points @ p)


def _corners(low: float, high: float, segments: int) -> list[tuple[float, float]]:
    """Angles and lengths of the corners of a polygon that holds an arc of radius 1."""
    if high - low >= _WHOLE:
        half = math.pi / segments
        return [(2.0 * half * k, 1.0 / math.cos(half)) for k in range(segments)]
    if high == low:
        return [(low, 1.0)]
    count = max(1, math.ceil((high - low) / _WHOLE * segments))
    half = (high - low) / (2.0 * count)
    middles = [(low + (2 * k + 1) * half, 1.0 / math.cos(half)) for k in range(count)]
    return [(low, 1.0), *middles, (high, 1.0)]
