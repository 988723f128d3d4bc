"""Whether a product of exponentials is Pinocchio's motion of the tip in the base, to rounding."""

from __future__ import annotations

import numpy as np

from urdfkin.dh.noise import left_out
from urdfkin.dh.opw import Opw
from urdfkin.dh.screws import Screws
from urdfkin.kinematics.roundings import EPS, of_joints
from urdfkin.model.chain import FrameChain, chain
from urdfkin.verify.sampling import sample
from urdfkin.verify.tables import TableError
from urdfkin.verify.verifier import TABLE_SAMPLES, Verifier


def check_opw(verifier: Verifier, path: FrameChain, found: Opw) -> str | None:
    """One line on how far the solver's forward kinematics is off; None where Pinocchio cannot check."""
    if verifier.cannot() is not None:
        return None
    q = sample(verifier.tree, TABLE_SAMPLES, np.random.default_rng(0))
    base, tip = np.moveaxis(verifier.oracle().placements(q, [path.base, path.tip]), 1, 0)
    own = path.coupling.values(path.coupling.select(verifier.tree, q))
    off = np.abs(base @ found.placement(own) - tip)[:, :3]
    return (
        f"base . F(sign q - offset) . tool is off by at most {off[..., 3].max():.2e} m"
        f" and {off[..., :3].max():.2e} rad on {len(q)} samples"
    )


def check_screws(verifier: Verifier, screws: Screws) -> str | None:
    """One line on how close they are; None where Pinocchio cannot check the robot.

    Raises:
        TableError: they differ by more than rounding.
    """
    if verifier.cannot() is not None:
        return None
    q = sample(verifier.tree, TABLE_SAMPLES, np.random.default_rng(0))
    base, tip = np.moveaxis(verifier.oracle().placements(q, [screws.base_frame, screws.tip_frame]), 1, 0)
    own = screws.coupling.select(verifier.tree, q)
    off = np.abs(base @ screws.placement(own) - tip)[:, :3]
    path = chain(verifier.tree, screws.tip_frame, screws.base_frame)
    # Pinocchio goes from the root to both ends, screws from one to the other.
    lever = np.linalg.norm(base[:, :3, 3], axis=-1) + path.reach + float(path.lengths[0])
    joints = sum(len(verifier.tree.path(verifier.tree.frame_link(end))) for end in (path.base, path.tip))
    unit = EPS * (of_joints(joints) + np.abs(own).sum(axis=-1)) + left_out(path)
    allowed = screws.rounding(own) + unit * (lever + np.abs(own).sum(axis=-1))
    share = float((off[..., 3].max(axis=-1) / allowed).max(initial=0.0))
    turn = float((off[..., :3].max(axis=(-1, -2)) / (unit + EPS * screws.roundings)).max())
    if max(share, turn) > 1.0:
        raise TableError(
            "the product of exponentials disagrees",
            where=f"{screws.robot}, {screws.base_frame} to {screws.tip_frame}",
            found=f"a tip {off[..., 3].max():.3g} m off",
            remedy="please report this as an error of urdfkin, with the URDF",
        )
    return (
        f"agrees within rounding on {len(q)} samples: tip within {off[..., 3].max():.2e} m"
        f" ({max(share, turn):.0%} of the bound)"
    )
