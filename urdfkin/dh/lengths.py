"""Lengths with which a table can be computed and checked: their squares are still doubles."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from urdfkin.dh.table import DHTable
from urdfkin.errors import RangeError
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import Joint

#: Metres: beyond it squares of sums, of which common normals and the bounds of the check are made, overflow.
LONGEST = 1e150


def demand_squares(joints: Iterable[Joint]) -> None:
    """Every joint's offset can be squared.

    Raises:
        RangeError: one of them cannot.
    """
    for joint in joints:
        _demand(f"joint {joint.name}", float(np.abs(joint.T_parent_joint[:3, 3]).max()))


def demand_squares_of(chain: FrameChain, table: DHTable) -> None:
    """Every length of a path and of a table can be squared.

    Raises:
        RangeError: one of them cannot.
    """
    for i, row in enumerate(table.rows):
        for name, length in (("a", row.a), ("d", row.d)):
            _demand(f"the table, row {i + 1}, {name}", abs(length))
    for name, T in (("base", table.base), ("tool", table.tool)):
        _demand(f"the table, {name}", float(np.abs(T[:3, 3]).max()))
    for A in chain.constants:
        _demand(f"{chain.robot}, {chain.base} to {chain.tip}", float(np.abs(A[:3, 3]).max()))


def _demand(where: str, length: float) -> None:
    if length > LONGEST:
        raise RangeError(
            "a table needs the squares of lengths, and they leave the range of double precision",
            where=where,
            found=f"{length:.3g} m",
            remedy="give smaller numbers",
        )
