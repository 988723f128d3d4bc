"""Check chains, solvers, orientations and converted robots with Pinocchio.

| Function | Compared |
|---|---|
| `check_chain` | the origin and the direction of each joint of a chain, and the tip |
| `check_opw` | the forward kinematics of an OPW (ortho-parallel wrist) solver |
| `check_screws` | the placement of the tip by a product of exponentials |
| `check_orientations` | rotation matrices that Pinocchio computes from roll-pitch-yaw angles or quaternions |
| `check_table_source` | Pinocchio's placements of the tip with the product of a table's matrices (eq. 7.64) |
| `check_model_source` | placements of all links with the placements of a `pinocchio.Model` |

`check_chain`, `check_opw` and `check_screws` return a line of text with the result, or None if Pinocchio
cannot check the robot.

For a table or a `pinocchio.Model`, urdfkin writes a URDF text. urdfkin and Pinocchio compute from this text,
so a comparison of their results cannot find an error in the text. Therefore, `check_table_source` and
`check_model_source` compare with the table or the model.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from urdfkin.compiled.plan import compile_tree
from urdfkin.dh.common_normals import sum_zeroed_tilts
from urdfkin.dh.convert import link_names
from urdfkin.dh.screws import ProductOfExponentials
from urdfkin.dh.snapping import rotation_angle
from urdfkin.dh.structure import OpwParameters
from urdfkin.dh.table import DHTable
from urdfkin.errors import OracleError, RangeError
from urdfkin.kinematics.number_kinds import norm
from urdfkin.kinematics.roundings import (
    EPS,
    ROW_ROUNDINGS,
    SMALLEST_SUBNORMAL,
    joint_roundings,
    table_roundings,
    written_urdf_roundings,
)
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.chain import FrameChain, make_chain
from urdfkin.model.configuration import neutral, sample
from urdfkin.model.tree import FloatArray, JointFrame, JointKind, KinematicTree, LinkFrame
from urdfkin.urdf.foreign import ConvertedModel
from urdfkin.verify.bounds import Bound, compute_magnitudes
from urdfkin.verify.certificate import VerificationError
from urdfkin.verify.comparison import compare
from urdfkin.verify.oracle import QueryBatch
from urdfkin.verify.pinocchio import MAX_NV, pinocchio, version
from urdfkin.verify.quantities import PLACEMENT
from urdfkin.verify.tables import TableError
from urdfkin.verify.verifier import TABLE_SAMPLES, Verifier

#: Number of random configurations. `check_model_source` also compares the neutral configuration.
_SAMPLE_COUNT = 8
#: Upper bound, in eps, on the sum of the rounding errors of urdfkin and of Pinocchio in `check_orientations`.
#: The error of each program is less than 8 eps. Angles need arctan2, sines, cosines and products of three
#: numbers (`urdfkin.kinematics.roundings`). Quaternions need a square root, a quotient and products of two
#: numbers.
_ORIENTATION_ROUNDINGS = 16.0


@np.errstate(over="ignore", invalid="ignore")  # RangeError replaces these warnings.
def check_chain(verifier: Verifier, chain: FrameChain, q: FloatArray) -> str | None:
    """Compare the frames of a chain with Pinocchio's frames.

    | Frame of a joint | |
    |---|---|
    | chain | frame before the joint's motion, in the direction of the chain |
    | Pinocchio | frame of the child link |
    | chain from parent to child | Pinocchio's frame after the motion, minus a prismatic displacement |
    | chain from child to parent | Pinocchio's frame before the motion |

    | Bound | |
    |---|---|
    | paths of Pinocchio | from the root to the first frame and to the last frame of the chain |
    | path of urdfkin | the chain, a part of these two paths |
    | rounding errors | of all joints on the two paths |
    | length for positions | from the root to the first frame, plus the chain with prismatic displacements |
    """
    if verifier.find_refusal() is not None:
        return None
    tree = verifier.tree
    names = [chain.base, *(JointFrame.of(joint.name) for joint in chain.joints), chain.tip]
    theirs = verifier.oracle().placements(QueryBatch(names, (q,)))
    base, theirs = theirs[:, :1], theirs[:, 1:]
    coordinates = chain.coupling.select(tree, q)
    values, ours = chain.coupling.values(coordinates), base @ chain.frames(coordinates)
    expected = theirs.copy()
    for i, joint in enumerate(chain.joints):
        axis = tree.joints[tree.joint_index(joint.name)].axis
        expected[:, i, :3, 2] = theirs[:, i, :3, :3] @ (-axis if joint.backwards else axis)
        if not joint.backwards and not joint.kind.turns:
            expected[:, i, :3, 3] -= values[:, i, np.newaxis] * expected[:, i, :3, 2]
    differences = np.abs(ours - expected)[:, :, :3]
    # NaN is a disagreement: `np.maximum` returns NaN, and the comparison NaN <= 1 is False.
    metres = differences[..., 3].max(initial=0.0)
    direction = np.maximum(differences[..., 2].max(initial=0.0), differences[:, -1, :, :3].max(initial=0.0))
    ends = [i for end in (chain.base, chain.tip) for i in tree.path(tree.frame_link(end))]
    rounding = EPS * float(joint_roundings(len(ends) + 2, sum(tree.joints[i].pinocchio_tilt for i in ends)))
    length = norm(base[..., :3, 3]).max(initial=0.0) + chain.lengths.sum()
    displacements = values[:, [not joint.kind.turns for joint in chain.joints]]
    length += np.abs(displacements).sum(axis=-1).max(initial=0.0)
    _require_finite_bound(rounding * length, chain)
    bound_ratio = np.maximum(metres / (rounding * length + SMALLEST_SUBNORMAL), direction / rounding)
    if not bound_ratio <= 1.0:
        raise TableError(
            "the chain's axes disagree with Pinocchio's",
            where=f"{chain.robot}, {chain.base} to {chain.tip}",
            found=f"an origin {metres:.3g} m off, a direction {direction:.3g}",
            remedy="please report this as an error of urdfkin, with the URDF",
        )
    return (
        f"origins of {len(chain.joints)} joints and the tip within {metres:.2e} m"
        f" ({bound_ratio:.0%} of the bound)"
    )


def _require_finite_bound(bound: FloatArray, chain: FrameChain) -> None:
    """Raise RangeError for an infinite bound. Every position would be within this bound."""
    if not np.isfinite(bound).all():
        raise RangeError(
            "the bound on a position exceeds the range of double precision",
            where=f"{chain.robot}, {chain.base} to {chain.tip}",
            remedy="give smaller numbers",
        )


def check_opw(verifier: Verifier, chain: FrameChain, opw: OpwParameters) -> str | None:
    if verifier.find_refusal() is not None:
        return None
    q, base, tip = _sample_base_and_tip(verifier, chain.base, chain.tip)
    values = chain.coupling.values(chain.coupling.select(verifier.tree, q))
    found = base @ opw.placement(values)
    metres = np.linalg.norm(found[:, :3, 3] - tip[:, :3, 3], axis=-1).max()
    radians = rotation_angle(found[:, :3, :3], tip[:, :3, :3]).max()
    return (
        f"the OPW solver's tip pose differs from Pinocchio's by at most {metres:.2e} m and {radians:.2e} rad"
        f" on {len(q)} samples; tip pose = base . F(sign q - offset) . tool"
    )


@np.errstate(over="ignore", invalid="ignore")  # RangeError replaces these warnings.
def check_screws(verifier: Verifier, screws: ProductOfExponentials) -> str | None:
    """Compare a product of exponentials with Pinocchio.

    | | Relative error | Length |
    |---|---|---|
    | product of exponentials | `ProductOfExponentials.rounding` | included |
    | Pinocchio | of the joints from the root to both ends | from the root to the base, and the chain |

    The chain's length includes the displacements of prismatic joints. Both programs reduce an angle exactly,
    so a large angle adds no error.
    """
    if verifier.find_refusal() is not None:
        return None
    q, base, tip = _sample_base_and_tip(verifier, screws.base_frame, screws.tip_frame)
    coordinates = screws.coupling.select(verifier.tree, q)
    displacements = screws.coupling.values(coordinates)[:, [not joint.kind.turns for joint in screws.joints]]
    differences = np.abs(base @ screws.placement(coordinates) - tip)[:, :3]
    chain = make_chain(verifier.tree, screws.tip_frame, screws.base_frame)
    # Pinocchio computes the placements of the base and the tip relative to the root. The product of
    # exponentials is the placement of the tip relative to the base.
    lever = norm(base[:, :3, 3]) + chain.lengths.sum() + np.abs(displacements).sum(axis=-1)
    tree = verifier.tree
    ends = [tree.joints[i] for end in (chain.base, chain.tip) for i in tree.path(tree.frame_link(end))]
    tilt = sum(joint.pinocchio_tilt for joint in ends)
    rounding = EPS * float(joint_roundings(len(ends), tilt)) + sum_zeroed_tilts(chain)
    allowed = screws.rounding(coordinates) + rounding * lever
    _require_finite_bound(allowed, chain)
    position_ratio = (differences[..., 3].max(axis=-1) / (allowed + SMALLEST_SUBNORMAL)).max(initial=0.0)
    rotation_ratio = (differences[..., :3].max(axis=(-1, -2)) / (rounding + EPS * screws.roundings)).max()
    bound_ratio = np.maximum(position_ratio, rotation_ratio)  # NaN is a disagreement.
    if not bound_ratio <= 1.0:
        raise TableError(
            "the product of exponentials disagrees with Pinocchio",
            where=f"{screws.robot}, {screws.base_frame} to {screws.tip_frame}",
            found=f"a tip {differences[..., 3].max():.3g} m off",
            remedy="please report this as an error of urdfkin, with the URDF",
        )
    return (
        f"agrees within rounding on {len(q)} samples: tip within {differences[..., 3].max():.2e} m"
        f" ({bound_ratio:.0%} of the bound)"
    )


def _sample_base_and_tip(
    verifier: Verifier, base: str, tip: str
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return random q (n, nq), and Pinocchio's placements (n, 4, 4) of the base and of the tip."""
    q = sample(verifier.tree, TABLE_SAMPLES, np.random.default_rng(0))
    T = verifier.oracle().placements(QueryBatch([base, tip], (q,)))
    return q, T[:, 0], T[:, 1]


def check_orientations(
    orientations: FloatArray, R: FloatArray, frame: str, make_command: Callable[[int], str]
) -> None:
    """Compare Pinocchio's rotations with verified rotations.

    The function compares rotation matrices, because angles at gimbal lock and signs of quaternions are not
    unique. The bound includes the rounding errors of `R`.

    `orientations` contains roll, pitch, yaw (n, 3) in rad, or quaternions (n, 4), scalar last.
    `make_command(k)` returns a command that computes sample k again.
    """
    pin = pinocchio()
    if orientations.shape[-1] == 3:
        theirs = np.array([pin.rpy.rpyToMatrix(*row) for row in orientations.tolist()])
    else:
        theirs = np.array([pin.Quaternion(row).toRotationMatrix() for row in orientations])
    theirs = theirs.reshape(-1, 3, 3)
    defect = np.abs(R.swapaxes(-1, -2) @ R - np.eye(3)).sum(axis=(-1, -2))
    bound = _ORIENTATION_ROUNDINGS * EPS + 2.0 * defect
    differences = np.abs(theirs - R).max(axis=(-1, -2))
    if (differences <= bound).all():
        return
    k = int(np.argmax(differences / bound))
    raise VerificationError(
        "orientation",
        frame,
        "rpy" if orientations.shape[-1] == 3 else "quaternion",
        index=(k,),
        ours=R[k],
        theirs=theirs[k],
        bound=np.full((3, 3), bound[k]),
        units=float(differences[k] / EPS),
        reproduce=make_command(k),
    )


def check_model_source(verifier: Verifier, converted: ConvertedModel, source: Any) -> str:
    """Compare a robot with its source, a pinocchio.Model or a RobotWrapper."""
    model, tree = getattr(source, "model", source), verifier.tree
    if model.nv > MAX_NV:
        return (
            f"not compared with the model itself: nv is {model.nv},"
            f" and Pinocchio needs too much memory for nv > {MAX_NV}"
        )
    q = np.vstack((neutral(tree), sample(tree, _SAMPLE_COUNT, np.random.default_rng(0))))
    names = [*converted.joints, *converted.frames]
    plan = compile_tree(tree, [tree.frame_link(LinkFrame.of(name)) for name in names])
    ours: FloatArray = PLACEMENT.compute_results(plan, (q,), None, base=FIXED_BASE_STATE)
    theirs = _compute_model_placements(model, _convert_configurations(model, tree, q), converted)
    # The factor 2 allows for rounded angles in the URDF text.
    bound = PLACEMENT.bound(plan, compute_magnitudes(plan, q, None, None, FIXED_BASE_STATE), None)
    found = compare(ours, theirs, Bound(bound.scale, 2.0 * bound.k), 2)
    if not found.agrees:
        raise OracleError(
            "the robot made from a pinocchio.Model differs from the model",
            where=f"{tree.name}, {names[found.index[1]]}",
            found=f"{found.bound_ratio:.3g} times the bound of rounding, Pinocchio {version()}",
            remedy="please report this as an error of urdfkin, with the model",
        )
    return (
        f"compared with the model itself: {len(names)} links agree in {len(q)} configurations"
        f" ({found.bound_ratio:.1%} of the bound)"
    )


def _compute_model_placements(model: Any, q: FloatArray, converted: ConvertedModel) -> FloatArray:
    """Return the placements of `converted.joints`, then of `converted.frames`."""
    pin = pinocchio()
    data = model.createData()
    out = np.empty((len(q), len(converted.joints) + len(converted.frames), 4, 4))
    for k, q_k in enumerate(q):
        pin.framesForwardKinematics(model, data, q_k)
        placed = [data.oMi[j] for j in converted.joints.values()] + [
            data.oMf[i] for i in converted.frames.values()
        ]
        out[k] = [one.homogeneous for one in placed]
    return out


def _convert_configurations(model: Any, tree: KinematicTree, q: FloatArray) -> FloatArray:
    """Convert q of urdfkin's tree to q (n, model.nq) of a model with the same joint names."""
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
    if verifier.find_refusal() is not None:
        return
    q = sample(verifier.tree, _SAMPLE_COUNT, np.random.default_rng(0))
    own = table.coupling.select(verifier.tree, q)
    theirs = verifier.oracle().placements(QueryBatch([LinkFrame.of(link_names(table)[-1])], (q,)))[:, 0]
    differences = np.abs(theirs - table.placement(own))[:, :3]
    # The table's base and tool may have rotations with six digits, but the URDF contains exact rotations. The
    # bound therefore includes the orthogonality error of the table's rotations.
    rows, metres, defect = len(table.rows), table.rounding(own), _orthogonality_defect(table)
    turn = EPS * written_urdf_roundings(rows) + defect
    allowed = metres * (written_urdf_roundings(rows) / table_roundings(rows) + defect / (EPS * ROW_ROUNDINGS))
    # A comparison with NaN is False, so NaN is a disagreement.
    if not ((differences[..., 3].max(axis=-1) <= allowed).all() and (differences[..., :3] <= turn).all()):
        raise TableError(
            "the URDF made from a table differs from the table",
            where=table.robot,
            found=f"a tip {differences[..., 3].max():.3g} m off",
            remedy="please report this as an error of urdfkin, with the table",
        )


def _orthogonality_defect(table: DHTable) -> float:
    """Sum the Frobenius norms of R^T R - I for the rotations of the table's base and tool."""
    rotations: list[FloatArray] = [table.base[:3, :3], table.tool[:3, :3]]
    return sum(float(np.linalg.norm(R.T @ R - np.eye(3))) for R in rotations)
