"""Small serial robots for tests of tables, and the comparison of a table's poses with other poses."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from tests.random_chains import rotation, shift, z_joint
from urdfkin.dh import DHTable, read_table
from urdfkin.dh.parse_table import reference_path
from urdfkin.model.chain import FrameChain
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree, build_tree
from urdfkin.robot.loading import load

EPS = float(np.finfo(np.float64).eps)
CONVENTIONS = ("standard", "modified")


def arm(*steps: FloatArray, kinds: str = "", tip: FloatArray | None = None) -> KinematicTree:
    """Return a serial robot with axes along z at the given poses; R is revolute, P prismatic, F fixed."""
    named = {"R": JointKind.REVOLUTE, "P": JointKind.PRISMATIC, "F": JointKind.FIXED}
    joints = [
        (z_joint(f"j{i + 1}", T, named[kind]), f"l{i}", f"l{i + 1}")
        for i, (T, kind) in enumerate(zip(steps, kinds or "R" * len(steps), strict=True))
    ]
    end = z_joint("end", tip, JointKind.FIXED)
    return build_tree("arm", "l0", [*joints, (end, f"l{len(steps)}", "tip")])


def elbow(kinds: str = "RRRRRR") -> KinematicTree:
    """Return an arm of up to six joints with parallel, skew and intersecting axes.

    All inner cells of the arm's table have different effects.
    """
    square = rotation("x", math.pi / 2)
    steps = [
        shift(0, 0, 0.3), shift(0.05, 0.02, 0.1) @ square, shift(0.4, 0, 0.1),
        shift(0.35, 0.01, 0) @ rotation("y", 0.7), shift(0, -0.2, 0.1) @ square,
        shift(0.02, 0.05, 0) @ rotation("x", -math.pi / 2),
    ]  # fmt: skip
    return arm(*steps[: len(kinds)], kinds=kinds, tip=shift(0.1, 0, 0.08))


def with_cells(table: DHTable, row: int, **cells: Any) -> DHTable:
    """Return the table with other values in some cells of a row."""
    rows = list(table.rows)
    rows[row] = replace(rows[row], **cells)
    return replace(table, rows=tuple(rows))


def disguised(table: DHTable, seed: int) -> DHTable:
    """Return a table of the same mechanism with reversed x and z axes, other zeros, and no base and tool.

    Rz(pi) before and after a step negates a, alpha and beta. Rx(pi) reverses z_i-1 and negates d and theta.
    Rx(pi) also adds pi to alpha of the rows before and after z_i-1, and negates beta of the row before it.
    """
    rng = np.random.default_rng(seed)
    flip_x, flip_z = rng.integers(0, 2, (2, len(table.rows) + 1)).astype(bool)
    rows = []
    for i, row in enumerate(table.rows):
        alpha = row.alpha + math.pi * (flip_z[i] != flip_z[i + 1])
        a, beta = row.a, -row.beta if flip_z[i + 1] else row.beta
        if flip_x[i]:
            a, alpha, beta = -a, -alpha, -beta
        z = -1.0 if flip_z[i] else 1.0
        turn = math.pi * (flip_x[i] != (flip_x[i - 1] if i else False))
        theta = z * row.theta + turn + (rng.uniform(-3, 3) if row.kind.turns else 0.0)
        d = z * row.d + (0.0 if row.kind.turns else rng.uniform(-1, 1))
        rows.append(replace(row, a=a, alpha=alpha, beta=beta, d=d, theta=theta))
    return replace(table, rows=tuple(rows), base=np.eye(4), tool=np.eye(4))


def published(name: str) -> tuple[FrameChain, DHTable]:
    """Return the chain of a robot that a published table describes, and the table."""
    table = read_table(reference_path(name))
    return load(table.robot).chain(table.tip_frame, table.base_frame), table


def error_ratio(
    table: DHTable, poses: FloatArray, expected: FloatArray, q: FloatArray, slack: FloatArray | float = 0.0
) -> float:
    """Return the largest tip error divided by the table's tolerance; `slack` (m) is added for distances."""
    metres, radians = table.tolerance(q)
    error = np.abs(poses - expected)
    lengths = np.linalg.norm(error[..., :3, 3], axis=-1) / np.maximum(metres + slack, 1e-300)
    return float(max(lengths.max(), (error[..., :3, :3].max(axis=(-1, -2)) / radians).max()))
