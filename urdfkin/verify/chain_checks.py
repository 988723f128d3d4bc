"""Check chains, OPW solvers and products of exponentials with Pinocchio's placements.

| Function | Compared |
|---|---|
| `check_chain` | the origin and the direction of each joint, and the tip |
| `check_opw` | the forward kinematics of an OPW (ortho-parallel wrist) solver |
| `check_screws` | the placement of the tip relative to the base |

Each function returns a line of text with the result, or None if Pinocchio cannot check the robot.
"""

from __future__ import annotations

import numpy as np

from urdfkin.dh.common_normals import left_out
from urdfkin.dh.screws import ProductOfExponentials
from urdfkin.dh.structure import Opw
from urdfkin.kinematics.roundings import EPS, LEAST_UNIT, joint_roundings
from urdfkin.model.chain import FrameChain, make_chain
from urdfkin.model.configuration import sample
from urdfkin.model.tree import FloatArray, JointFrame
from urdfkin.verify.oracle import QueryBatch
from urdfkin.verify.tables import TableError
from urdfkin.verify.verifier import TABLE_SAMPLES, Verifier


def check_chain(verifier: Verifier, path: FrameChain, q: FloatArray) -> str | None:
    """Compare the joint frames and the tip of a chain with Pinocchio's at the configurations q (n, nq).

    Pinocchio's frame of a joint is the frame of the child link. If the chain leads from the parent link to
    the child link, Pinocchio's frame includes the joint's motion. If the chain leads from the child link to
    the parent link, Pinocchio's frame does not include the motion.

    Pinocchio computes along two paths, from the root to the first and to the last frame of the chain. urdfkin
    computes along the chain, which is a part of the two paths. The bound allows for the rounding errors of
    all joints on both paths of Pinocchio. The length in the bound is the distance of the first frame from the
    root plus the length of the chain, with prismatic displacements.
    """
    if verifier.cannot() is not None:
        return None
    tree = verifier.tree
    names = [path.base, *(JointFrame.of(joint.name) for joint in path.joints), path.tip]
    theirs = verifier.oracle().placements(QueryBatch(names, (q,)))
    base, theirs = theirs[:, :1], theirs[:, 1:]
    coordinates = path.coupling.select(tree, q)
    values, ours = path.coupling.values(coordinates), base @ path.frames(coordinates)
    expected = theirs.copy()
    for i, joint in enumerate(path.joints):
        axis = tree.joints[tree.joint_index(joint.name)].axis
        expected[:, i, :3, 2] = theirs[:, i, :3, :3] @ (-axis if joint.backwards else axis)
        if not joint.backwards and not joint.kind.turns:
            expected[:, i, :3, 3] -= values[:, i, np.newaxis] * expected[:, i, :3, 2]
    off = np.abs(ours - expected)[:, :, :3]
    metres = float(off[..., 3].max(initial=0.0))
    turned = max(float(off[..., 2].max(initial=0.0)), float(off[:, -1, :, :3].max(initial=0.0)))
    ends = [i for end in (path.base, path.tip) for i in tree.path(tree.frame_link(end))]
    unit = EPS * float(joint_roundings(len(ends) + 2, sum(tree.joints[i].tilt for i in ends)))
    length = np.linalg.norm(base[..., :3, 3], axis=-1).max(initial=0.0) + path.lengths.sum()
    slides = values[:, [not joint.kind.turns for joint in path.joints]]
    length += np.abs(slides).sum(axis=-1).max(initial=0.0)
    share = max(metres / (unit * length + LEAST_UNIT), turned / unit)
    if share > 1.0:
        raise TableError(
            "the chain's axes disagree with Pinocchio's",
            where=f"{path.robot}, {path.base} to {path.tip}",
            found=f"an origin {metres:.3g} m off, a direction {turned:.3g}",
            remedy="please report this as an error of urdfkin, with the URDF",
        )
    return (
        f"origins of {len(path.joints)} joints and the tip within {metres:.2e} m ({share:.0%} of the bound)"
    )


def check_opw(verifier: Verifier, path: FrameChain, found: Opw) -> str | None:
    if verifier.cannot() is not None:
        return None
    q, base, tip = _sampled_ends(verifier, path.base, path.tip)
    values = path.coupling.values(path.coupling.select(verifier.tree, q))
    off = np.abs(base @ found.placement(values) - tip)[:, :3]
    return (
        "the OPW solver's tip pose base . F(sign q - offset) . tool differs from Pinocchio by at most"
        f" {off[..., 3].max():.2e} m and {off[..., :3].max():.2e} rad on {len(q)} samples"
    )


def check_screws(verifier: Verifier, screws: ProductOfExponentials) -> str | None:
    if verifier.cannot() is not None:
        return None
    q, base, tip = _sampled_ends(verifier, screws.base_frame, screws.tip_frame)
    coordinates = screws.coupling.select(verifier.tree, q)
    size = np.abs(coordinates).sum(axis=-1)
    off = np.abs(base @ screws.placement(coordinates) - tip)[:, :3]
    path = make_chain(verifier.tree, screws.tip_frame, screws.base_frame)
    # Pinocchio computes the placements of the base and the tip relative to the root.
    # The product of exponentials is the placement of the tip relative to the base.
    lever = np.linalg.norm(base[:, :3, 3], axis=-1) + path.reach + float(path.lengths[0])
    joints = sum(len(verifier.tree.path(verifier.tree.frame_link(end))) for end in (path.base, path.tip))
    unit = EPS * (joint_roundings(joints) + size) + left_out(path)
    allowed = screws.rounding(coordinates) + unit * (lever + size)
    share = float((off[..., 3].max(axis=-1) / (allowed + LEAST_UNIT)).max(initial=0.0))
    turn = float((off[..., :3].max(axis=(-1, -2)) / (unit + EPS * screws.roundings)).max())
    if not max(share, turn) <= 1.0:
        raise TableError(
            "the product of exponentials disagrees with Pinocchio",
            where=f"{screws.robot}, {screws.base_frame} to {screws.tip_frame}",
            found=f"a tip {off[..., 3].max():.3g} m off",
            remedy="please report this as an error of urdfkin, with the URDF",
        )
    return (
        f"agrees within rounding on {len(q)} samples: tip within {off[..., 3].max():.2e} m"
        f" ({max(share, turn):.0%} of the bound)"
    )


def _sampled_ends(verifier: Verifier, base: str, tip: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return random configurations, and Pinocchio's placements (n, 4, 4) of base and tip."""
    q = sample(verifier.tree, TABLE_SAMPLES, np.random.default_rng(0))
    T = verifier.oracle().placements(QueryBatch([base, tip], (q,)))
    return q, T[:, 0], T[:, 1]
