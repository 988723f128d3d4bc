"""Whether the robot that was made of an MJCF file is the file's: MuJoCo is asked, and Pinocchio's reader.

Every result is checked on the URDF that was written of the tree. What that leaves open is whether the tree is
the file's, so MuJoCo's own model of the file is held against it when it is loaded. Pinocchio's MJCF reader
reads the file itself, and is known to read some otherwise: what it says is told, and decides nothing.
"""

from __future__ import annotations

import numpy as np

from urdfkin.compiled.plan import make_plan
from urdfkin.errors import OracleError
from urdfkin.model.base_motion import STILL_STATE
from urdfkin.model.configuration import neutral
from urdfkin.model.frame_names import LinkFrame
from urdfkin.model.tree import FloatArray
from urdfkin.urdf.mjcf import Mjcf
from urdfkin.urdf.mujoco import version
from urdfkin.verify.bounds import Bound, about_the_root, result_k
from urdfkin.verify.magnitudes import magnitudes
from urdfkin.verify.pinocchio import mjcf_placements
from urdfkin.verify.quantities import PLACEMENT
from urdfkin.verify.sampling import sample
from urdfkin.verify.verifier import Verifier
from urdfkin.verify.worst import worst_of_each

#: Configurations that the two are compared in, besides the neutral one.
_SAMPLES = 8


def demand_the_mjcfs(verifier: Verifier, mjcf: Mjcf, path: str | None) -> str:
    """Who vouches for the reading of an MJCF file, in words.

    Args:
        verifier: Of the robot that was made of it.
        mjcf: What was read.
        path: The file, for Pinocchio's reader; None where it was text.

    Raises:
        OracleError: MuJoCo places a body or a site elsewhere than the tree does.
    """
    tree = verifier.tree
    q = np.vstack((neutral(tree), sample(tree, _SAMPLES, np.random.default_rng(0))))
    frames = [LinkFrame.of(name) for name in mjcf.frames]
    plan = make_plan(tree, [tree.frame_link(frame) for frame in frames])
    ours: FloatArray = PLACEMENT.ours(plan, (q,), None, base=STILL_STATE)
    # Both readings round, and so do the angles of the URDF between them: twice MuJoCo's bound.
    size = about_the_root(magnitudes(plan, q, None, None, STILL_STATE))
    bound = PLACEMENT.bound(plan, size, None)
    bound = Bound(bound.scale, 2.0 * bound.k)
    share = _shares(ours, mjcf.placements(q), bound)
    if not (share <= 1.0).all():
        k, f = np.unravel_index(int(np.nan_to_num(share, nan=np.inf).argmax()), share.shape)
        raise OracleError(
            "the robot that was made of an MJCF file is not the file's",
            where=f"{tree.name}, {frames[f]}",
            found=f"{share[k, f]:.3g} times what rounding allows, MuJoCo {version()}",
            remedy="please report this as an error of urdfkin, with the file",
        )
    said = (
        f"MuJoCo {version()} places {len(frames)} bodies and sites of the MJCF likewise in {len(q)}"
        f" configurations ({share.max(initial=0.0):.1%} of the bound)"
    )
    return f"{said}; {_pinocchios(mjcf, path, q, ours, bound)}"


def _shares(ours: FloatArray, theirs: FloatArray, bound: Bound) -> FloatArray:
    units = worst_of_each(ours, theirs, bound.scale, 2)
    share: FloatArray = units / result_k(bound, units.shape)
    return share


def _pinocchios(mjcf: Mjcf, path: str | None, q: FloatArray, ours: FloatArray, bound: Bound) -> str:
    """What Pinocchio's MJCF reader says of the same bodies."""
    if path is None:
        return "Pinocchio's MJCF reader, which takes files, was not asked"
    bodies = [f for f, (kind, _) in enumerate(mjcf.frames.values()) if kind == "body" and f]
    names = [list(mjcf.frames)[f] for f in bodies]
    try:
        theirs = mjcf_placements(path, mjcf.qpos(q), mjcf.coordinates, names)
    except OracleError as error:
        return f"Pinocchio's MJCF reader does not vouch for it ({error})"
    if not names:
        return "Pinocchio's MJCF reader finds no body either"
    share = _shares(ours[:, bodies], theirs, Bound(bound.scale[:, bodies], bound.k[:, bodies]))
    if (share <= 1.0).all():
        return "Pinocchio's MJCF reader places the bodies likewise"
    f = int(share.max(axis=0).argmax())
    off = np.abs(ours[:, bodies[f]] - theirs[:, f])[:, :3]
    return (
        f"Pinocchio's MJCF reader stands alone: it has {names[f]} up to {off[..., 3].max():.3g} m away,"
        f" and its axes {off[..., :3].max():.3g}"
    )
