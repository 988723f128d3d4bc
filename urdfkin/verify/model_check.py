"""Check the URDF text that urdfkin writes for a `pinocchio.Model` or for a Denavit-Hartenberg table.

Pinocchio reads the same URDF text to check a robot's results, so the usual checks do not find an error in the
text.

| Source of the text | Comparison |
|---|---|
| `pinocchio.Model` | placements of all links with the model's placements |
| table | Pinocchio's placements of the tip with the product of the table's matrices (eq. 7.64) |
"""

from __future__ import annotations

from typing import Any

import numpy as np

from urdfkin.compiled.plan import compile_tree
from urdfkin.dh.convert import link_names
from urdfkin.dh.table import DHTable
from urdfkin.errors import OracleError
from urdfkin.kinematics.roundings import EPS, ROW, of_rows, of_rows_read_back
from urdfkin.model.base_motion import STILL_STATE
from urdfkin.model.configuration import neutral, sample
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree, LinkFrame
from urdfkin.urdf.foreign import ConvertedModel
from urdfkin.verify.bounds import Bound, magnitudes
from urdfkin.verify.comparison import compare
from urdfkin.verify.oracle import QueryBatch
from urdfkin.verify.pinocchio import MOST_RATES, pinocchio, version
from urdfkin.verify.quantities import PLACEMENT
from urdfkin.verify.tables import TableError
from urdfkin.verify.verifier import Verifier

#: Number of random configurations besides the zero configuration.
_SAMPLES = 8


def check_model_source(verifier: Verifier, made: ConvertedModel, source: Any) -> str:
    """Compare a robot with the Pinocchio model (or RobotWrapper) from which the robot was made.

    Returns a line of text with the result. Raises OracleError if a placement differs by more than the bound.
    """
    model, tree = getattr(source, "model", source), verifier.tree
    if model.nv > MOST_RATES:  # Pinocchio's memory grows with the cube of nv.
        return f"not compared with the model itself: nv is {model.nv}, more than {MOST_RATES}"
    q = np.vstack((neutral(tree), sample(tree, _SAMPLES, np.random.default_rng(0))))
    names = [*made.joints, *made.frames]
    plan = compile_tree(tree, [tree.frame_link(LinkFrame.of(name)) for name in names])
    ours: FloatArray = PLACEMENT.ours(plan, (q,), None, base=STILL_STATE)
    theirs = _placements(model, _configurations(model, tree, q), made)
    # The factor 2 in the bound allows for the rounded angles in the URDF text.
    bound = PLACEMENT.bound(plan, magnitudes(plan, q, None, None, STILL_STATE), None)
    found = compare(ours, theirs, Bound(bound.scale, 2.0 * bound.k), 2)
    if not found.agrees:
        raise OracleError(
            "the robot made from a pinocchio.Model differs from the model",
            where=f"{tree.name}, {names[found.index[1]]}",
            found=f"{found.share:.3g} times the bound of rounding, Pinocchio {version()}",
            remedy="please report this as an error of urdfkin, with the model",
        )
    return (
        f"compared with the model itself: {len(names)} links agree in {len(q)} configurations"
        f" ({found.share:.1%} of the bound)"
    )


def _placements(model: Any, q: FloatArray, made: ConvertedModel) -> FloatArray:
    """Return the model's placements (n, joints + frames, 4, 4)."""
    pin = pinocchio()
    data = model.createData()
    out = np.empty((len(q), len(made.joints) + len(made.frames), 4, 4))
    for k, q_k in enumerate(q):
        pin.framesForwardKinematics(model, data, q_k)
        placed = [data.oMi[j] for j in made.joints.values()] + [data.oMf[i] for i in made.frames.values()]
        out[k] = [one.homogeneous for one in placed]
    return out


def _configurations(model: Any, tree: KinematicTree, q: FloatArray) -> FloatArray:
    """Return configurations (n, model.nq) of the model for the tree's q, with joints matched by name."""
    full = np.zeros((len(q), int(model.nq)))
    for joint, at in zip(tree.joints, tree.q_index, strict=True):
        if not joint.nq:
            continue
        theirs = model.joints[model.getJointId(joint.name)]
        to, size = int(theirs.idx_q), int(theirs.nq)
        numbers = q[:, at : at + joint.nq]
        if joint.kind is JointKind.PLANAR:
            numbers = np.column_stack((numbers[:, :2], np.cos(numbers[:, 2]), np.sin(numbers[:, 2])))
        elif size == 2:
            numbers = np.column_stack((np.cos(numbers), np.sin(numbers)))
        full[:, to : to + size] = numbers
    return full


def check_table_source(verifier: Verifier, table: DHTable) -> None:
    """Compare Pinocchio's placements of the tip with the placements from the robot's table."""
    if verifier.cannot() is not None:
        return
    q = sample(verifier.tree, _SAMPLES, np.random.default_rng(0))
    own = table.coupling.select(verifier.tree, q)
    theirs = verifier.oracle().placements(QueryBatch([LinkFrame.of(link_names(table)[-1])], (q,)))[:, 0]
    off = np.abs(theirs - table.placement(own))[:, :3]
    # Base and tool of the table may be rounded to six digits; the rotations in the URDF are exact.
    rows, metres, defect = len(table.rows), table.rounding(own), _defect(table)
    turn = EPS * of_rows_read_back(rows) + defect
    allowed = metres * (of_rows_read_back(rows) / of_rows(rows) + defect / (EPS * ROW))
    if (off[..., 3].max(axis=-1) > allowed).any() or (off[..., :3] > turn).any():
        raise TableError(
            "the URDF made from a table differs from the table",
            where=table.robot,
            found=f"a tip {off[..., 3].max():.3g} m off",
            remedy="please report this as an error of urdfkin, with the table",
        )


def _defect(table: DHTable) -> float:
    """Return the sum of the Frobenius norms of R^T R - I over the rotations R of base and tool."""
    rotations: list[FloatArray] = [table.base[:3, :3], table.tool[:3, :3]]
    return sum(float(np.linalg.norm(R.T @ R - np.eye(3))) for R in rotations)
