"""Lengths with which a table can be computed and checked: their squares are still doubles."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from urdfkin.errors import RangeError
from urdfkin.model.tree import Joint

#: Metres: beyond it squares of sums, of which common normals and the bounds of the check are made, overflow.
LONGEST = 1e150


def demand_squares(joints: Iterable[Joint]) -> None:
    """Every joint's offset can be squared.

    Raises:
        RangeError: one of them cannot.
    """
    for joint in joints:
        length = float(np.abs(joint.T_parent_joint[:3, 3]).max())
        if length > LONGEST:
            raise RangeError(
                "a table needs the squares of lengths, and they leave the range of double precision",
                where=f"joint {joint.name}",
                found=f"{length:.3g} m",
                remedy="give smaller numbers",
            )
