"""Prove a bound of a table's tip error for every configuration, by the method of `urdfkin same`.

The path and the table become two mechanisms with the same joints. `urdfkin.model.mechanisms` matches them
joint by joint, as they are written. Support functions carry the differences from the tip to the base.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from urdfkin.dh.convert import free_tree, link_names
from urdfkin.dh.table import DHTable
from urdfkin.model.chain import FrameChain
from urdfkin.model.mechanisms.alignment import AS_WRITTEN
from urdfkin.model.mechanisms.matcher import align
from urdfkin.model.mechanisms.mechanism import Mechanism, tolerance_of
from urdfkin.model.mechanisms.upper_bound import FINE, upper_bounds
from urdfkin.model.mechanisms.variables import variables_of
from urdfkin.model.tree import Joint, JointKind, KinematicTree, Limit, build_tree


def max_tip_error_bound(
    path: FrameChain, table: DHTable, slides: Mapping[str, tuple[float, float]]
) -> tuple[float, float]:
    """Return a bound of the tip error of a table (metres, radians), without rounding.

    Args:
        path: The path; its mimic rules are ignored.
        table: The table. Its variables are the path's coordinates; it contains senses and zeros.
        slides: Ranges of the prismatic joints (metres).
    """
    mechanisms = Mechanism(_free(path, table, slides)), Mechanism(free_tree(table))
    found = align(*mechanisms, {row.joint: row.joint for row in table.rows}, AS_WRITTEN)
    variables = variables_of(found, tolerance_of(*mechanisms))
    tip = link_names(table)[-1]
    frame = next(frame for frame in found.frames if found.a.tree.links[frame.a] == tip)
    return upper_bounds(found, variables, frame, FINE)


def _free(path: FrameChain, table: DHTable, slides: Mapping[str, tuple[float, float]]) -> KinematicTree:
    """Return a path as a tree with the names of the table's links, without mimic rules."""
    names, z = link_names(table), np.array([0.0, 0.0, 1.0])
    joints = list[tuple[Joint, str, str]]()
    for i, joint in enumerate(path.joints):
        kind = JointKind.CONTINUOUS if joint.kind.turns else JointKind.PRISMATIC
        limit = Limit(*slides[joint.name], math.inf, math.inf) if joint.name in slides else None
        one = Joint(joint.name, kind, 0, joint.T_previous_joint, z, limit)
        joints.append((one, names[i], names[i + 1]))
    last = free_tree(table).joints[-1]
    joints.append((replace(last, T_parent_joint=path.T_last_tip), names[-2], names[-1]))
    return build_tree(path.robot, names[0], joints)
