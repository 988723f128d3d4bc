"""H and P, as solvers take an arm that go from subproblem to subproblem (IK-Geo, EAIK).

    T(q) = P_0 + R(h_1, q_1) (P_1 + R(h_2, q_2) (P_2 + ... + P_n)),    R(q) = R(h_1, q_1) ... R(h_n, q_n) R_6T

Any point of an axis would do for this product. A solver that asks whether axes meet asks whether the step
between their points is zero: axes that meet share their point here.
"""

from __future__ import annotations

import numpy as np

from urdfkin.dh.screws import Screws
from urdfkin.dh.structure import EXACT, NEAR_ANGLE, meeting
from urdfkin.model.tree import FloatArray


def axes_and_steps(screws: Screws) -> tuple[FloatArray, FloatArray]:
    """H (n, 3), unit axes, and P (n + 1, 3), metres: from the base, point to point, to the tip.

    Args:
        screws: A path of turning joints.
    """
    way = np.vstack([np.zeros(3), _points(screws), screws.M[:3, 3]])
    return screws.space[:, :3], np.diff(way, axis=0)


def _points(screws: Screws) -> FloatArray:
    """(n, 3) a point of each axis: three that meet come first, the wrist before the shoulder, then two."""
    points, taken, n = screws.points.copy(), set[int](), len(screws.joints)
    for size in (3, 2):
        for i in reversed(range(n - size + 1)):
            at = tuple(range(i, i + size))
            if taken.isdisjoint(at) and _meet(screws, at):
                points[list(at)] = meeting(screws, at)[0]
                taken.update(at)
    return points


def _meet(screws: Screws, at: tuple[int, ...]) -> bool:
    axes = screws.space[list(at), :3]
    turned = np.linalg.norm(np.cross(axes[:-1], axes[1:]), axis=-1)
    return bool(turned.min() > NEAR_ANGLE) and meeting(screws, at)[1] <= EXACT
