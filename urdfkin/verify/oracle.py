"""Define the base class of the oracles, and the query, which is the argument of an oracle's methods.

`OracleQuery` converts the arguments of a call to flat batches for the oracle. `urdfkin.verify.call` converts
the same arguments for the recursion. Apart from the exceptions below, the two modules share no code. A wrong
broadcast, order or name in one of them therefore leads to a disagreement.

This module looks up names a second time, in the list of joints. The oracle compares the order of this list
with the order of joints in the oracle's model. The exceptions are the values of named poses and the parser of
units (`urdfkin.errors.numbers`), which the two modules share.
"""

from __future__ import annotations

import math
import re
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple
from xml.parsers.expat import ExpatError

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.compiled.plan import IntArray
from urdfkin.errors import OracleError
from urdfkin.errors.numbers import parse_float, parse_quantity
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, KinematicTree, Mimic
from urdfkin.verify.pinocchio_inputs import BaseNumbers, nearest_quaternion, rules_of_text

#: Largest number of names that an error lists.
_NAMED = 5

#: Suffixes of the names of coordinates and joint velocities, by the number of joint velocities of a joint.
_OF_Q = {3: ("x", "y", "angle"), 6: ("x", "y", "z", "qx", "qy", "qz", "qw")}
_OF_RATES = {3: ("vx", "vy", "wz"), 6: ("vx", "vy", "vz", "wx", "wy", "wz")}


class _Names:
    """Lookup from names to indices in q or v.

    Args:
        joints: Name and number of joint velocities of each joint, in order.
        of: `_OF_Q` or `_OF_RATES`.

    >>> names = _Names([("base", 3), ("elbow", 1)], _OF_Q)
    >>> names.place("base.y"), names.place("base"), names.place("elbow")
    (1, slice(0, 3, None), 3)
    >>> names.pairs("ready, base.x = 5mm, elbow=pi / 2")
    [('base.x', '5mm'), ('elbow', 'pi / 2')]
    """

    def __init__(self, joints: Sequence[tuple[str, int]], of: Mapping[int, tuple[str, ...]]) -> None:
        self._joints, at = dict[str, tuple[int, tuple[str, ...]]](), 0
        for joint, rates in joints:
            own = of.get(rates, ())
            self._joints[joint] = at, own
            at += len(own) or 1

    def place(self, name: str) -> int | slice:
        """Return the index of a coordinate, or the slice of a joint.

        Raise OracleError for an unknown name.
        """
        if name in self._joints:
            at, own = self._joints[name]
            return slice(at, at + len(own)) if own else at
        for joint, (at, own) in self._joints.items():
            suffix = name.removeprefix(joint).lstrip(".:")
            if name.startswith(joint) and suffix in own:
                return at + own.index(suffix)
        raise OracleError("the robot has no coordinate with this name", found=repr(name[:60]))

    def pairs(self, text: str) -> list[tuple[str, str]]:
        """Return the pairs (name, number) of a text with `NAME=NUMBER`."""
        plain = " ".join(text.split())
        plain = plain[1:-1].strip() if plain[:1] + plain[-1:] in ("[]", "()", "{}") else plain
        names = [
            f"{re.escape(joint)}(?:[.:]+(?:{'|'.join(own)}))?" if own else re.escape(joint)
            for joint, (_, own) in self._joints.items()
        ]
        known = "|".join(sorted(names, key=len, reverse=True))
        starts = list(re.finditer(rf"(?:^|(?<=[ ,]))({known}) ?= ?", plain))
        ends = [*(match.start() for match in starts[1:]), len(plain)]
        return [(m[1], plain[m.end() : end].strip(" ,")) for m, end in zip(starts, ends, strict=False)]


def _number(text: str) -> float:
    """Return the number in SI units."""
    found = parse_quantity(text)
    value = parse_float(text) if found is None else found.value
    if value is None:
        raise OracleError("the two readers read this number differently", found=repr(text[:60]))
    return value


class BaseRows(NamedTuple):
    """Placement (n, 4, 4), velocity (n, 6) and acceleration (n, 6) of the base for n configurations."""

    placement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


class QueryBatch(NamedTuple):
    """A query: some configurations as a flat batch.

    Attributes:
        frames: Names of the frames, as the user gave them, or the frames of moving joints.
        inputs: q (n, nq), or q and v (n, nv), or q, v and a (n, nv). A method ignores inputs that it does not
            need.
        reference: The reference frame, as the user gave it. Placements ignore it.
        base: Motion of the base; None: fixed at the world origin.
        joints: True: use the library's functions for joints, if it has them. Each frame is a `JointFrame`.
        divided: True: the frames are a part of a longer list. The library's functions for many frames are
            then used, so that no number depends on the division of the list.

    >>> x = QueryBatch(["tool0"], (np.zeros((1, 6)), np.ones((1, 6))))
    >>> x.q.shape, x.v.shape, x.reference.name
    ((1, 6), (1, 6), 'LOCAL_WORLD_ALIGNED')
    """

    frames: Sequence[str]
    inputs: tuple[FloatArray, ...]
    reference: Reference | str = Reference.LOCAL_WORLD_ALIGNED
    base: BaseNumbers | None = None
    joints: bool = False
    divided: bool = False

    @property
    def q(self) -> FloatArray:
        """Configurations (n, nq)."""
        return self.inputs[0]

    @property
    def v(self) -> FloatArray:
        """Joint velocities (n, nv)."""
        return self.inputs[1]

    @property
    def a(self) -> FloatArray:
        """Joint accelerations (n, nv)."""
        return self.inputs[2]


class OracleQuery:
    """The arguments of one call.

    Args:
        frame: Name of a frame, or several names.
        reference: A `Reference` or its name.
        base: Motion of the base; None: fixed at the world origin.
        inputs: q, or q and v, or q, v and a, as numbers that broadcast.
        named: The original argument of each input that was given by names; None for every other input.
        joints: Name and number of joint velocities of each joint with coordinates, in order.
    """

    def __init__(
        self,
        frame: str | Sequence[str],
        reference: Reference | str,
        base: BaseNumbers | None,
        inputs: Sequence[ArrayLike],
        named: Sequence[str | Mapping[str, ArrayLike] | None] = (),
        joints: Sequence[tuple[str, int]] = (),
    ) -> None:
        self._is_one = isinstance(frame, str)
        self.frames = (frame,) if isinstance(frame, str) else tuple(frame)
        self.reference, self.base = reference, base
        self._given, self._named, self._joints = inputs, named or [None] * len(inputs), joints

    def read(self) -> None:
        """Convert the inputs now. The inputs may be views of `out`, which the computation overwrites."""
        _ = self._inputs

    @cached_property
    def _inputs(self) -> tuple[FloatArray, ...]:
        return tuple(
            np.asarray(x, dtype=np.float64) if given is None else self._by_name(np.array(x, float), given, of)
            for x, given, of in zip(self._given, self._named, (_OF_Q, _OF_RATES, _OF_RATES), strict=False)
        )

    def _by_name(
        self, x: FloatArray, given: str | Mapping[str, ArrayLike], of: Mapping[int, tuple[str, ...]]
    ) -> FloatArray:
        """Return `x` after each number that was given by name is written to the index of its name."""
        names = _Names(self._joints, of)
        for name, value in given.items() if isinstance(given, Mapping) else names.pairs(given):
            x[..., names.place(name)] = _number(value) if isinstance(value, str) else np.asarray(value, float)
        return x

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Batch shape of the result."""
        axes = [x.shape[:-1] for x in self._inputs]
        if self.base is not None:
            axes += [self.base.placement.shape[:-2], self.base.velocity.shape[:-1]]
            axes.append(self.base.acceleration.shape[:-1])
        return axes[0] if len(set(axes)) == 1 else np.broadcast_shapes(*axes)

    @cached_property
    def n(self) -> int:
        """Number of configurations."""
        return math.prod(self.shape)

    def rows(self, part: slice | IntArray) -> QueryBatch:
        """Return the configurations with the given indices in the flat batch (C order)."""

        def pick(x: FloatArray, own: int = 1) -> FloatArray:
            batch, one = x.shape[: x.ndim - own], x.shape[x.ndim - own :]
            if batch == self.shape:
                return x.reshape(self.n, *one)[part]
            numbers = np.arange(part.start, part.stop) if isinstance(part, slice) else part
            spread: FloatArray = np.broadcast_to(x, (*self.shape, *one))
            return spread[np.unravel_index(numbers, self.shape)]

        base = self.base
        if base is not None:
            base = BaseRows(pick(base.placement, 2), pick(base.velocity), pick(base.acceleration))
        return QueryBatch(self.frames, tuple(map(pick, self._inputs)), self.reference, base)

    def flat(self, result: FloatArray, axes: int) -> FloatArray:
        """Convert results in the user's shape to the shape (n, frames, ...); one result has `axes` axes.

        Raises:
            OracleError: the shape does not match the query.
        """
        own, several = result.shape[result.ndim - axes :], () if self._is_one else (len(self.frames),)
        if result.shape != (*self.shape, *several, *own):
            raise OracleError(
                "the batch shape of a result does not match that of the arguments", found=str(result.shape)
            )
        return result.reshape(self.n, len(self.frames), *own)


def mimic_rules(text: str, joints: Sequence[str], robot: str) -> dict[str, Mimic]:
    """Return the mimic rules of some joints of the text, read independently of urdfkin's reader.

    Raises:
        OracleError: a rule cannot be read.
    """
    try:
        return rules_of_text(text, set(joints))
    except (ValueError, ExpatError) as error:
        raise OracleError(
            "the oracle's reader cannot read the mimic rules", where=robot, found=str(error)
        ) from error


class Oracle:
    """A library's results for one robot, in urdfkin's layout of q, v and Jacobian columns.

    A subclass builds the library's model in `__init__` and computes the five quantities below. Each of these
    methods takes a query and returns an array (n, frames, ...).

    Args:
        text: The URDF text.
        tree: urdfkin's tree of the same text, only for a comparison of the joints, their order and the mimic
            joints.
        mimic: True: couple mimic joints. False: every mimic joint moves freely.
        moving_base: Build the model on a free-flyer, which receives the base's motion.
        root_joint: "floating" or "planar" if the tree has such a root joint, which the text does not contain.
        lock: Value (rad or m) of each locked joint, which is a fixed joint in the tree.

    Attributes:
        title: Name of the library.
        new_data: Function that returns a new data structure of the library; each thread has its own.

    Raises:
        OracleError: the library does not accept the text, or reads other joints from it.
        InstallationError: the library is missing.
    """

    title: ClassVar[str]
    new_data: Callable[[], Any]

    def __init__(
        self,
        text: str,
        tree: KinematicTree,
        *,
        mimic: bool = True,
        moving_base: bool = False,
        root_joint: str | None = None,
        lock: Mapping[str, float] = MappingProxyType({}),
    ) -> None:
        self.lock = lock
        self.text, self.tree, self.mimic = text, tree, mimic
        self.moving_base, self.root_joint, self._local = moving_base, root_joint, threading.local()

    def rules(self, joints: Sequence[str]) -> dict[str, Mimic]:
        """Return the mimic rules of the text, read independently of urdfkin's reader.

        Args:
            joints: Names of the moving joints that the library found, in order.

        Raises:
            OracleError: the rules cannot be read, or the joints or their order differ from the tree's. The
                numbers of q would then belong to different joints.
        """
        tree = self.tree
        rules = mimic_rules(self.text, joints, tree.name) if self.mimic else {}
        coordinates = [name for name in joints if name not in rules]
        for what, theirs, own in (
            ("joints", list(joints), [joint.name for joint in tree.joints if joint.kind.nv]),
            ("coordinates", coordinates, [joint.name for joint in tree.joints if joint.nv]),
        ):
            if theirs != own:
                found = ", ".join(sorted(set(theirs) ^ set(own))[:_NAMED]) or "the same in another order"
                raise OracleError(
                    f"{self.title} finds other {what} in this robot", where=tree.name, found=found
                )
        return rules

    @property
    def data(self) -> Any:
        """The library's data structure of this thread."""
        if not hasattr(self._local, "data"):
            self._local.data = self.new_data()
        return self._local.data

    def placements(self, x: QueryBatch) -> FloatArray:
        """Return T_world_frame (n, frames, 4, 4)."""
        raise NotImplementedError

    def velocities(self, x: QueryBatch) -> FloatArray:
        """Return velocities (n, frames, 6)."""
        raise NotImplementedError

    def accelerations(self, x: QueryBatch) -> FloatArray:
        """Return classical accelerations (n, frames, 6)."""
        raise NotImplementedError

    def jacobians(self, x: QueryBatch) -> FloatArray:
        """Return Jacobians (n, frames, 6, nv)."""
        raise NotImplementedError

    def jacobian_rates(self, x: QueryBatch) -> FloatArray:
        """Return J-dot (n, frames, 6, nv)."""
        raise NotImplementedError

    def hessians(self, x: QueryBatch) -> FloatArray:
        """Return Hessians (n, frames, 6, nv, nv).

        Raises:
            OracleError: the library cannot compute the derivative of a Jacobian with respect to q.
        """
        raise OracleError(
            f"{self.title} computes no Hessian", where=self.tree.name, remedy="use oracle='pinocchio'"
        )

    def quaternions(self, x: QueryBatch) -> FloatArray:
        """Return the quaternions (n, frames, 4) of the placements, scalar last, with qw >= 0."""
        out = nearest_quaternion(self.placements(x)[..., :3, :3])
        return np.where(out[..., 3:] < 0.0, -out, out)
