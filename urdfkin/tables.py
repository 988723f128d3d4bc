"""Chains and Denavit-Hartenberg tables of a robot, each table checked before it is handed out.

`Robot` has the part that stands in this file; `robot_from_table` is the way back.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.call import NotVerifiedWarning
from urdfkin.chain import FrameChain, chain
from urdfkin.demands import choice, word, words
from urdfkin.dh.make import dh_table
from urdfkin.dh.table import DHTable
from urdfkin.dh.tree_parameters import TreeParameters, tree_parameters
from urdfkin.oracle import version
from urdfkin.roundings import EPS, of_joints
from urdfkin.tree import FloatArray
from urdfkin.verification.choosing import checked_choice
from urdfkin.verification.sampling import draw
from urdfkin.verification.tables import TableCheck, TableError, check_table

if TYPE_CHECKING:
    from urdfkin.robot import Robot

#: Random configurations that a table is checked on, besides the neutral one and the ends of the limits.
SAMPLES = 40


class Tables:
    """The part of `Robot` that stands in this file."""

    def chain(self, tip: str | None = None, base: str | None = None) -> FrameChain:
        """The joints between two frames, down the tree, up, or through the common ancestor.

        Args:
            tip: A link's or joint's name; the robot's tip when None.
            base: Likewise; the robot's base frame when None.

        Raises:
            UnknownNameError: no such frame.
            InputError: a planar or floating joint lies on the way.
        """
        robot = cast("Robot", self)
        return chain(robot.tree, choice(tip, robot.tip_frame, "tip"), choice(base, robot.base_frame, "base"))

    def select(self, path: FrameChain | DHTable, q: ArrayLike) -> FloatArray:
        """(..., coordinates) of a path or table out of the robot's `q` (..., nq).

        Raises:
            InputError: `q` has another length than the robot's.
        """
        return path.coupling.select(cast("Robot", self).tree, q)

    def dh(
        self,
        tip: str | None = None,
        base: str | None = None,
        convention: str = "standard",
        *,
        near_parallel: str = "hayati",
        snap: float = 0.0,
        last: str = "tip",
        parallel_offset: str = "last",
        flip: Collection[str] = (),
        verify: bool | None = None,
    ) -> DHTable:
        """The Denavit-Hartenberg table of the path between two frames, checked against Pinocchio.

        Its methods take the path's own coordinates, `table.joint_names`; `robot.select(table, q)` picks them
        out of the robot's. The other arguments are those of `urdfkin.dh.dh_table`.

        Args:
            tip: A link's or joint's name; the robot's tip when None.
            base: Likewise; the robot's base frame when None.
            convention: "standard" (distal, the text's) or "modified" (proximal, Craig's).
            near_parallel: "hayati" or "strict": what nearly parallel axes get.
            snap: Radians within which angles are made multiples of 15 degrees; 0 for an exact table.
            last: "tip" or "flange": whether the last row takes the tip.
            parallel_offset: "last", "first" or "each".
            flip: Joints to count the other way.
            verify: Whether Pinocchio checks the table; None leaves it to the robot.

        Raises:
            UnknownNameError: a frame or a joint that does not exist.
            InputError: an option's value, or a planar or floating joint on the way.
            TableError: Pinocchio computes something else.

        Example:
            >>> import urdfkin
            >>> urdfkin.load("ur5").dh("tool0", "base", snap=1e-6).rows[3].d
            0.10915
        """
        robot = cast("Robot", self)
        table = dh_table(
            robot.tree,
            choice(tip, robot.tip_frame, "tip"),
            choice(base, robot.base_frame, "base"),
            word(convention, "convention"),
            near_parallel=word(near_parallel, "near_parallel"),
            snap=snap,
            last=word(last, "last"),
            parallel_offset=word(parallel_offset, "parallel_offset"),
            flip=[word(joint, "each of flip") for joint in words(flip, "flip")],
        )
        if checked_choice(robot.verify if verify is None else verify):
            verified(robot, table)
        return table

    def tree_parameters(self, *, verify: bool | None = None) -> TreeParameters:
        """Khalil and Kleinfinger's parameters of the whole robot as one table, checked against Pinocchio.

        Args:
            verify: Whether Pinocchio checks it; None leaves it to the robot.

        Raises:
            InputError: a planar or floating joint, which has no single axis.
            TableError: Pinocchio computes something else.
        """
        robot = cast("Robot", self)
        parameters = tree_parameters(robot.tree)
        if checked_choice(robot.verify if verify is None else verify):
            verified_tree(robot, parameters)
        return parameters


def verified(robot: Robot, table: DHTable, samples: int = SAMPLES, seed: int = 0) -> TableCheck | None:
    """Hold a table against Pinocchio; None, with a warning, where Pinocchio cannot check the robot.

    A strict table whose lengths lose more than rounding of the robot's own is warned of as well.

    Raises:
        TableError: the two disagree.
    """
    if (reason := robot.cannot_verify()) is not None:
        _warn(reason)
        return None
    drawn = draw(robot.tree, samples, np.random.default_rng(seed), with_special=True)
    check = check_table(robot.oracle(None), robot.tree, table, drawn)
    if not check.agrees:
        raise TableError(
            f"the {table.convention} table of {table.base_frame} to {table.tip_frame} disagrees",
            where=f"{robot.name}, Pinocchio {version()}",
            found=str(check),
            remedy="please report this as an error of urdfkin, with the URDF",
        )
    if check.loss is not None:
        _warn(str(check))
    return check


def verified_tree(
    robot: Robot, parameters: TreeParameters, samples: int = SAMPLES, seed: int = 0
) -> str | None:
    """Hold the placements of all links by tree parameters against Pinocchio's; a line that says how close.

    None, with a warning, where Pinocchio cannot check the robot.

    Raises:
        TableError: the two disagree.
    """
    if (reason := robot.cannot_verify()) is not None:
        _warn(reason)
        return None
    q = draw(robot.tree, samples, np.random.default_rng(seed), with_special=True).q
    ours = parameters.placements(q)
    theirs = robot.oracle(None).placements(q, robot.tree.link_frames[1:])
    error = np.abs(ours - theirs)[..., :3, :]
    reach = parameters.reach(q)
    units = max(
        float((error[..., 3].max(axis=-1) / np.maximum(EPS * reach, 1e-300)).max(initial=0.0)),
        float(error[..., :3].max(initial=0.0)) / EPS,
    )
    line = (
        f"Pinocchio {version()}: {len(robot.tree.links) - 1} links on {len(q)} samples within"
        f" {error[..., 3].max(initial=0.0):.2e} m, {units:.2g} eps*scale"
    )
    tree = robot.tree
    tilt = max(sum(tree.joints[i].tilt for i in tree.path(leaf)) for leaf in tree.leaves())
    if units > parameters.roundings + of_joints(0, tilt):
        raise TableError(
            f"the tree parameters of {robot.name} disagree", where=f"Pinocchio {version()}", found=line
        )
    return line


def _warn(reason: str) -> None:
    warnings.warn(f"not verified: {reason}", NotVerifiedWarning, stacklevel=4)
