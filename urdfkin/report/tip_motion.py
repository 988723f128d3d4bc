"""How far a robot's tip is from where it was, for the same coordinates, when its model changed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from urdfkin.comparison.result import angle, length
from urdfkin.dh.snapping import rotation_angle
from urdfkin.errors import UrdfkinError
from urdfkin.model.chain import FrameChain, chain
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, Mimic
from urdfkin.report.document import Joint as JointData
from urdfkin.report.document import Model

#: Configurations, the one at zero first.
_SAMPLES = 200
#: Where a file gives no range: a turn, and a metre.
_FREE = {True: math.pi, False: 1.0}
#: Metres and radians below which the two are the same: what rounding gives.
_NOTHING = 1e-12


@dataclass(frozen=True, slots=True)
class TipMotion:
    """The largest distance and angle between a tip's two placements.

    Attributes:
        base, tip: The frames, which both models have.
        metres, radians: At most, over the configurations.
    """

    base: str
    tip: str
    metres: float
    radians: float

    def __str__(self) -> str:
        off = f"{length(self.metres)} and {angle(self.radians)}"
        return f"up to {off} away, on {_SAMPLES} configurations"


def tip_motion(old: Model | None, new: Model | None) -> TipMotion | None:
    """How far the tip that moved most is from where it was; None where none did, or it cannot be told.

    Tips are the robot's own and every leaf. Coordinates have the same names in both; one that only one of
    them has is zero. They are drawn from the ranges of the old model.
    """
    if old is None or new is None:
        return None
    before, after = _tree(old), _tree(new)
    tips = dict.fromkeys([old["tip"], *(before.links[leaf] for leaf in before.leaves())])
    found = [moved for tip in tips if (moved := _moved(before, after, old["base"], tip)) is not None]
    return max(found, key=lambda one: (one.metres, one.radians), default=None)


def _moved(old: KinematicTree, new: KinematicTree, base: str, tip: str) -> TipMotion | None:
    try:
        before, after = (chain(tree, tip, base) for tree in (old, new))
    except UrdfkinError:  # a frame that is gone, or a joint of several coordinates: the changes say so
        return None
    drawn, zero = _drawn(before), np.zeros(_SAMPLES)
    Ts = [
        one.placement(np.stack([drawn.get(name, zero) for name in one.joint_names], axis=-1))
        if one.joint_names
        else one.placement([])[np.newaxis]
        for one in (before, after)
    ]
    metres = float(np.linalg.norm(Ts[1][:, :3, 3] - Ts[0][:, :3, 3], axis=-1).max())
    Rs = np.broadcast_arrays(Ts[0][:, :3, :3], Ts[1][:, :3, :3])
    radians = float(rotation_angle(*Rs).max())
    if metres <= _NOTHING * max(1.0, before.reach) and radians <= _NOTHING:
        return None
    return TipMotion(base, tip, metres, radians)


def _drawn(one: FrameChain) -> dict[str, FloatArray]:
    rng, joints = np.random.default_rng(0), {joint.name: joint for joint in one.joints}
    drawn = {}
    for name in one.joint_names:
        joint = joints.get(name)  # a leader may stand beside the path
        free = _FREE[joint is None or joint.kind.turns]
        limit = None if joint is None else joint.limit
        lower, upper = (-free, free) if limit is None else (limit.lower, limit.upper)
        ends = (lower if math.isfinite(lower) else -free, upper if math.isfinite(upper) else free)
        drawn[name] = np.concatenate([[0.0], rng.uniform(*ends, _SAMPLES - 1)])
    return drawn


def _tree(model: Model) -> KinematicTree:
    """The tree that a report describes."""
    links = tuple(model["links"])
    return KinematicTree(model["name"], links, tuple(_joint(joint, links) for joint in model["joints"]))


def _joint(joint: JointData, links: tuple[str, ...]) -> Joint:
    limit, mimic = joint["limit"], joint["mimic"]
    bounds: Mapping[str, Any] = {} if limit is None else dict(limit)
    return Joint(
        joint["name"],
        JointKind(joint["kind"]),
        links.index(joint["parent"]),
        np.array(joint["placement"], dtype=np.float64),
        np.array(joint["axis"] or (1.0, 0.0, 0.0), dtype=np.float64),
        None if limit is None else Limit(*(_bound(bounds[name], free) for name, free in _BOUNDS.items())),
        None if mimic is None else Mimic(mimic["leader"], mimic["multiplier"], mimic["offset"]),
    )


#: What stands for an entry that is null, as JSON has no infinity.
_BOUNDS = {"lower": -math.inf, "upper": math.inf, "velocity": math.inf, "effort": math.inf}


def _bound(value: float | None, free: float) -> float:
    return free if value is None else value
