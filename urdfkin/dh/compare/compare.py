"""Does a URDF agree with a published table? Cell by cell, and in millimetres at the tip."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from urdfkin.chain import FrameChain
from urdfkin.dh.compare.align import Alignment, align
from urdfkin.dh.compare.fit import CELLS, Model, columns, fit_cells
from urdfkin.dh.compare.freedoms import fit_freedoms
from urdfkin.dh.convert import to_standard
from urdfkin.dh.elements import EPS
from urdfkin.dh.row import Convention
from urdfkin.dh.snapping import rotation_angle
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError
from urdfkin.tree import FloatArray, JointKind

#: Metres at the tip up to which a table agrees: half as much again as rounding to 0.1 mm in a cell or two.
TOLERANCE = 2e-4
FIT_SAMPLES, CHECK_SAMPLES = 40, 200


@dataclass(frozen=True, slots=True)
class CellDifference:
    """One cell that is not the URDF's.

    Attributes:
        row: Index of the row in the reference table, from 0.
        joint: Name of the joint in the URDF.
        cell: "a", "alpha", "d", "theta" or "beta".
        reference: The table's value, metres or radians.
        urdf: What it would have to be.
        tip: Metres: how far this cell alone moves the tip, at the worst of the samples.
    """

    row: int
    joint: str
    cell: str
    reference: float
    urdf: float
    tip: float

    @property
    def difference(self) -> float:
        """URDF less reference, metres or radians."""
        return self.urdf - self.reference


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """What a comparison found.

    Attributes:
        reference: The table, its joints named as in the URDF, with base, tool, senses and offsets fitted:
            its `placement` takes the URDF's coordinates.
        senses: Of each joint: the table's variable is sense * q + offset.
        offsets: Likewise, radians or metres.
        metres: How far the tip is off at the worst of the samples, with base, tool and offsets fitted.
        radians: Likewise its orientation.
        differences: The cells that differ, in the order of the table.
        residual: Metres left when the cells are the URDF's: rounding, unless no cells explain the URDF.
        tolerance: Metres up to which the two are said to agree.
        samples: How many configurations were tried.
    """

    reference: DHTable
    senses: tuple[int, ...]
    offsets: tuple[float, ...]
    metres: float
    radians: float
    differences: tuple[CellDifference, ...]
    residual: float
    tolerance: float
    samples: int

    @property
    def agrees(self) -> bool:
        """Whether the tip is never off by more than the tolerance."""
        return self.metres <= self.tolerance

    @property
    def exact(self) -> bool:
        """Whether rounding explains all of the difference."""
        return self.metres <= 100.0 * EPS * (1.0 + len(self.reference.rows)) * max(self.reference.span, 1e-9)


def compare(chain: FrameChain, reference: DHTable, tolerance: float = TOLERANCE) -> Comparison:
    """Hold a reference table against a path of a URDF.

    Args:
        chain: The path, base to tip; the table's ends may be other frames fixed to the same links.
        reference: The table, either convention, one row for each moving joint, in the path's order.
        tolerance: Metres at the tip.

    Raises:
        InputError: the table has another number or other kinds of joints than the path.
    """
    _check_joints(chain, reference)
    standard = to_standard(reference) if reference.convention is Convention.MODIFIED else reference
    scale = max(chain.reach, standard.span, 1e-9)
    values, wanted = _samples(chain, FIT_SAMPLES, 1)
    aligned, fitted = _best_fit(chain, standard, values, wanted, scale)
    complete = fit_cells(fitted, values, wanted, scale)
    values, wanted = _samples(chain, CHECK_SAMPLES, 2)
    metres, radians = _apart(fitted, values, wanted)
    residual, _ = _apart(complete, values, wanted)
    own = [0 if turns else 1 for turns in fitted.turns]
    offsets = [
        fitted.cells[i, k] - (standard.rows[i].d if k else standard.rows[i].theta) for i, k in enumerate(own)
    ]
    offsets = [
        offset if k else math.remainder(offset, 2.0 * math.pi) for offset, k in zip(offsets, own, strict=True)
    ]
    return Comparison(
        _fitted_table(chain, standard, fitted, aligned.senses),
        tuple(s * row.sense for s, row in zip(aligned.senses, standard.rows, strict=True)),
        tuple(o * row.sense for o, row in zip(offsets, standard.rows, strict=True)),
        metres,
        radians,
        _differences(chain, reference, fitted, complete, values, scale),
        residual,
        tolerance,
        CHECK_SAMPLES,
    )


def _check_joints(chain: FrameChain, reference: DHTable) -> None:
    theirs = [row.kind.turns for row in reference.rows]
    ours = [joint.kind.turns for joint in chain.joints]
    if theirs != ours or not ours:
        words = ["".join("R" if turns else "P" for turns in kinds) or "none" for kinds in (theirs, ours)]
        raise InputError(
            "the table's joints are not the path's",
            where=f"{chain.robot}, {chain.base} to {chain.tip}",
            found=f"{words[0]} in the table, {words[1]} in the URDF",
            remedy="choose base and tip so that exactly the table's joints lie between them",
        )


def _best_fit(
    chain: FrameChain, standard: DHTable, values: FloatArray, wanted: FloatArray, scale: float
) -> tuple[Alignment, Model]:
    """Of the likely sign patterns, the one whose freedoms fit best."""

    def size(model: Model) -> float:
        metres, radians = _apart(model, values, wanted)
        return metres + scale * radians

    best: tuple[float, Alignment, Model] | None = None
    for aligned in align(chain, replace(standard, base=np.eye(4), tool=np.eye(4))):
        start = _start(standard, aligned)
        # Least squares make the sum small. The worst sample is what counts: there the start may be better.
        model = min(fit_freedoms(start, values, wanted, scale), start, key=size)
        if best is None or size(model) < 0.5 * best[0]:
            best = (size(model), aligned, model)
        if best[0] <= 1e-12 * scale:
            break
    if best is None:
        raise InputError("nothing to compare", where=chain.robot)
    return best[1], best[2]


def _start(standard: DHTable, aligned: Alignment) -> Model:
    """The reference with the freedoms that the alignment found."""
    start = Model(
        np.array([(row.theta, row.d, row.a, row.alpha, row.beta) for row in standard.rows]),
        np.array([float(row.kind.turns) for row in standard.rows]),
        np.array(aligned.senses, dtype=np.float64),
        aligned.base,
        aligned.tool,
    )
    for i, offset in enumerate(aligned.offsets):
        start.cells[i, 0 if start.turns[i] else 1] += offset
    return start


def _samples(chain: FrameChain, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Values of all joints (count, n), each joint free, and the tip's poses there."""
    bounds = [(-math.pi, math.pi) if joint.kind.turns else _slide(joint.limit) for joint in chain.joints]
    lower, upper = np.array(bounds).T
    values = np.random.default_rng(seed).uniform(lower, upper, (count, len(bounds)))
    free = replace(chain, joints=tuple(replace(joint, mimic=None) for joint in chain.joints))
    return values, free.placement(values)


def _slide(limit: object) -> tuple[float, float]:
    lower, upper = getattr(limit, "lower", -0.5), getattr(limit, "upper", 0.5)
    return (lower, upper) if math.isfinite(lower) and math.isfinite(upper) and lower < upper else (-0.5, 0.5)


def _apart(model: Model, values: FloatArray, wanted: FloatArray) -> tuple[float, float]:
    poses, _, _ = model.walk(values)
    metres = np.linalg.norm(poses[:, :3, 3] - wanted[:, :3, 3], axis=-1).max()
    return float(metres), float(rotation_angle(poses[:, :3, :3], wanted[:, :3, :3]).max())


def _differences(
    chain: FrameChain,
    reference: DHTable,
    fitted: Model,
    complete: Model,
    values: FloatArray,
    scale: float,
) -> tuple[CellDifference, ...]:
    """The cells that moved by more than rounding, each with its own effect on the tip."""
    _, _, twists = columns(fitted, values, scale)
    linear = np.linalg.norm(twists.reshape(len(values), 6, -1)[:, :3], axis=1).max(axis=0)
    found = []
    for i, row in enumerate(fitted.cells):
        for k, cell in enumerate(CELLS):
            change = complete.cells[i, k] - row[k]
            size = abs(change) * (1.0 if cell in "da" else scale)
            if k == (0 if fitted.turns[i] else 1) or size <= 1e-10 * scale:
                continue
            # In a modified table a, alpha and beta of this step stand in the next row.
            at = i + (reference.convention is Convention.MODIFIED and cell not in ("theta", "d"))
            if at < len(reference.rows):
                value = getattr(reference.rows[at], cell)
                effect = float(linear[5 * i + k] * size)
                found.append(CellDifference(at, chain.joints[at].name, cell, value, value + change, effect))
    return tuple(
        sorted(found, key=lambda one: (one.row, ("a", "alpha", "beta", "d", "theta").index(one.cell)))
    )


def _fitted_table(chain: FrameChain, standard: DHTable, fitted: Model, senses: tuple[int, ...]) -> DHTable:
    """The reference as a table of the URDF's joints."""
    rows = []
    for i, (row, joint) in enumerate(zip(standard.rows, chain.joints, strict=True)):
        theta, d = float(fitted.cells[i, 0]), float(fitted.cells[i, 1])
        rows.append(
            replace(
                row,
                theta=theta,
                d=d,
                sense=senses[i],
                joint=joint.name,
                kind=joint.kind if joint.kind is not JointKind.FIXED else row.kind,
                mimic=joint.mimic,
                limit=joint.limit,
            )
        )
    return DHTable(
        Convention.STANDARD, tuple(rows), fitted.base, fitted.tool, chain.robot, chain.base, chain.tip
    )
