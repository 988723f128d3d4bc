"""Check chains, OPW solvers and products of exponentials with Pinocchio's placements.

- `check_chain`: the origin and the direction of each joint, and the tip
- `check_opw`: the forward kinematics of an OPW (ortho-parallel wrist) solver
- `check_screws`: the motion of the tip relative to the base, to rounding
"""

from __future__ import annotations

import numpy as np

from urdfkin.dh.common_normals import left_out
from urdfkin.dh.screws import ProductOfExponentials
from urdfkin.dh.structure import Opw
from urdfkin.kinematics.roundings import EPS, LEAST_UNIT, of_joints
from urdfkin.model.chain import FrameChain, chain
from urdfkin.model.configuration import sample
from urdfkin.model.tree import FloatArray, JointFrame
from urdfkin.verify.oracle import QueryBatch
from urdfkin.verify.tables import TableError
from urdfkin.verify.verifier import TABLE_SAMPLES, Verifier


def check_chain(verifier: Verifier, path: FrameChain, q: FloatArray) -> str | None:
    """Return a line about the agreement of a chain with Pinocchio at q (n, nq); None: Pinocchio cannot check.

    Pinocchio's frame of a joint is the frame of the joint's child link. In a chain that leads from the parent
    link to the child link, this frame comes after the joint's motion. In a chain that leads from the child
    link to the parent link, this frame comes before the joint's motion. Pinocchio computes the poses of the
    first and the last frame of the chain from the root. urdfkin computes along the chain, from the first
    frame to the last frame. The bound depends on all joints and lengths of the two paths from the root to
    these two frames. These paths contain every joint and length of both computations.

    Raises:
        TableError: the chain and Pinocchio differ by more than rounding.
    """
    if verifier.cannot() is not None:
        return None
    tree = verifier.tree
    names = [path.base, *(JointFrame.of(joint.name) for joint in path.joints), path.tip]
    theirs = verifier.oracle().placements(QueryBatch(names, (q,)))
    base, theirs = theirs[:, :1], theirs[:, 1:]
    values = path.coupling.values(path.coupling.select(tree, q))
    ours = base @ path.frames(path.coupling.select(tree, q))
    along = theirs.copy()
    for i, joint in enumerate(path.joints):
        axis = tree.joints[tree.joint_index(joint.name)].axis
        along[:, i, :3, 2] = theirs[:, i, :3, :3] @ (-axis if joint.backwards else axis)
        if not joint.backwards and not joint.kind.turns:
            along[:, i, :3, 3] -= values[:, i, np.newaxis] * along[:, i, :3, 2]
    off = np.abs(ours - along)[:, :, :3]
    metres = float(off[..., 3].max(initial=0.0))
    turned = max(float(off[..., 2].max(initial=0.0)), float(off[:, -1, :, :3].max(initial=0.0)))
    ends = [i for end in (path.base, path.tip) for i in tree.path(tree.frame_link(end))]
    unit = EPS * float(of_joints(len(ends) + 2, sum(tree.joints[i].tilt for i in ends)))
    way = np.linalg.norm(base[..., :3, 3], axis=-1).max(initial=0.0) + path.lengths.sum()
    slides = values[:, [not joint.kind.turns for joint in path.joints]]
    way += np.abs(slides).sum(axis=-1).max(initial=0.0)
    share = max(metres / (unit * way + LEAST_UNIT), turned / unit)
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
    """Return a sentence about the error of an OPW solver's forward kinematics; None: no check is possible."""
    if verifier.cannot() is not None:
        return None
    q = sample(verifier.tree, TABLE_SAMPLES, np.random.default_rng(0))
    base, tip = np.moveaxis(verifier.oracle().placements(QueryBatch([path.base, path.tip], (q,))), 1, 0)
    own = path.coupling.values(path.coupling.select(verifier.tree, q))
    off = np.abs(base @ found.placement(own) - tip)[:, :3]
    return (
        f"base . F(sign q - offset) . tool is off by at most {off[..., 3].max():.2e} m"
        f" and {off[..., :3].max():.2e} rad on {len(q)} samples"
    )


def check_screws(verifier: Verifier, screws: ProductOfExponentials) -> str | None:
    """Return a line about the agreement of a product of exponentials with Pinocchio; None: no check.

    Raises:
        TableError: the product of exponentials and Pinocchio differ by more than rounding.
    """
    if verifier.cannot() is not None:
        return None
    q = sample(verifier.tree, TABLE_SAMPLES, np.random.default_rng(0))
    ends = QueryBatch([screws.base_frame, screws.tip_frame], (q,))
    base, tip = np.moveaxis(verifier.oracle().placements(ends), 1, 0)
    own = screws.coupling.select(verifier.tree, q)
    off = np.abs(base @ screws.placement(own) - tip)[:, :3]
    path = chain(verifier.tree, screws.tip_frame, screws.base_frame)
    # Pinocchio computes the poses of base and tip from the root; the product goes from base to tip.
    lever = np.linalg.norm(base[:, :3, 3], axis=-1) + path.reach + float(path.lengths[0])
    joints = sum(len(verifier.tree.path(verifier.tree.frame_link(end))) for end in (path.base, path.tip))
    unit = EPS * (of_joints(joints) + np.abs(own).sum(axis=-1)) + left_out(path)
    allowed = screws.rounding(own) + unit * (lever + np.abs(own).sum(axis=-1))
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
