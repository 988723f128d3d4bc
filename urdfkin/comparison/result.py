"""What was found out about two models: the verdict, what it rests on, and how to use it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError
from urdfkin.errors.escape import log_line
from urdfkin.model.configuration import checked, neutral
from urdfkin.model.mechanisms.mechanism import JointTransform
from urdfkin.model.tree import FloatArray, KinematicTree

#: A tenth, as four digits round to it: from there on a prefix serves; none does from nine of them on.
_TENTH, _NINE = 0.09995, 9.0


class Verdict(Enum):
    """How two models move: alike, alike up to what `Sameness.up_to` names, or not."""

    SAME = "same"
    SAME_AFTER = "same after"
    DIFFERS = "differs"


#: What B may differ in from A and still be equivalent, in the order in which it is named.
FREE = ("base", "zeros", "senses", "free joints", "tools")
#: What a difference may be of if each frame that both have is still bounded.
BOUNDED = frozenset({"axis", "place", "frame", "mimic rule", "fixed"})


@dataclass(frozen=True, slots=True)
class Question:
    """What is asked of two models.

    Attributes:
        within: Metres and radians by which frames may be off as written; None: whether the models are
            equivalent.
        strict: Whether being equivalent only, and remarks, count as differences.
    """

    within: float | None = None
    strict: bool = False


@dataclass(frozen=True, slots=True)
class Interval:
    """A frame's largest distance over all configurations within limits lies in here.

    Attributes:
        frame: Link of A, and
        frame_b: of B.
        lower: Metres, attained at `q_a` and `q_b`.
        upper: Metres, proven; inf where nothing bounds it.
        radians: What its orientations differ by at most, proven.
        radians_seen: What they do differ by somewhere.
        q_a: Configuration of A.
        q_b: The one of B that belongs to it.
    """

    frame: str
    frame_b: str
    lower: float
    upper: float
    radians: float
    radians_seen: float
    q_a: tuple[float, ...]
    q_b: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Difference:
    """One place where two models differ.

    Attributes:
        place: The joint or link of A, "joint elbow".
        what: The parameter in words, without the size: "axis", "origin", "mimic rule", "only in A", ...
        words: All of it in a line.
        radians: By how much, 0 where that says nothing.
        metres: Likewise.
    """

    place: str
    what: str
    words: str
    radians: float = 0.0
    metres: float = 0.0


@dataclass(frozen=True, slots=True)
class JointMap:
    """A joint of A and what it is in B: value_b = sense * value_a + offset (rad, m).

    A planar or floating joint has the sense 1 and the offset 0, and a conversion where it counts otherwise.
    """

    a: str
    b: str
    sense: int
    offset: float
    conversion: JointTransform | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Sameness:
    """Whether two models are one robot; make one with `urdfkin.same`.

    Attributes:
        names: The robots' names.
        sources: What was given.
        digests: SHA-256 of the two texts.
        verdict: `Verdict.SAME`, `SAME_AFTER` what `after` says, or `DIFFERS`.
        after: What has to be done for them to agree, a line each; also where they differ even then.
        up_to: Of what these are, in standard words: "base", "zeros", "senses", "free joints", "tools".
        differences: Where they do differ, from the base outwards; the first is the first place.
        remarks: What is no matter of where things move: limits, kinds, links that only one has.
        joints: Joints of A and of B that are each other's.
        links: Likewise.
        orders: Joints of B that were taken in another order, which their axes allow, run by run.
        base: (4, 4) pose of B's root in A's root frame, at home; the identity where both stand alike.
        base_links: The link of A, and the one of B on the same body, that both are seen from.
        rounding: (m, rad) that frames may lie apart where nothing is said to differ.
        frames: Of each link that both have, after what `after` says.
        as_written: The same without it: of the frame that is then farthest; None where nothing has to be
            done.
        written: (m, rad) by which any frame of both is off at most as written, proven; infinite where
            there is no bound. Of a table, frames that it names as the robot does.
        narrowed: Joints whose mimic joints leave their limits, a line each; intervals cover all of a joint's
            own range.
        checked: What Pinocchio confirmed, or why it did not.
    """

    names: tuple[str, str]
    sources: tuple[str, str]
    digests: tuple[str, str]
    verdict: Verdict
    after: tuple[str, ...]
    up_to: tuple[str, ...]
    differences: tuple[Difference, ...]
    remarks: tuple[Difference, ...]
    joints: tuple[JointMap, ...]
    links: tuple[tuple[str, str], ...]
    orders: tuple[tuple[str, ...], ...]
    base: FloatArray
    base_links: tuple[str, str]
    rounding: tuple[float, float]
    frames: tuple[Interval, ...]
    as_written: Interval | None
    written: tuple[float, float]
    narrowed: tuple[str, ...]
    checked: str
    trees: tuple[KinematicTree, KinematicTree]

    def __bool__(self) -> bool:
        """Whether they are the same, if need be after `after`."""
        return self.verdict is not Verdict.DIFFERS

    def __repr__(self) -> str:
        after = self.verdict is Verdict.SAME_AFTER
        how = f"equivalent up to {', '.join(self.up_to)}" if after else self.verdict.value
        return log_line(f"<Sameness {self.names[0]}, {self.names[1]}: {how}>")

    @property
    def worst(self) -> Interval | None:
        """The frame whose distance may be largest, or its angle; None where none is off beyond rounding."""
        metres, radians = self.rounding
        return max(
            (one for one in self.frames if one.lower > 0.0 or one.upper > metres or one.radians > radians),
            key=lambda one: (one.upper, one.lower, one.radians),
            default=None,
        )

    @property
    def worst_as_written(self) -> Interval | None:
        """The same at equal coordinates, with nothing put right."""
        return self.as_written or self.worst

    def within(self, most: float) -> bool:
        """Whether no frame of both is ever off by more (m and rad) as both models are written: proven.

        Roots are laid on each other, and equal coordinates are compared: a base, a zero or a tool that is
        elsewhere counts. Models with joints of another kind, or that only one has, are never within.
        """
        return {one.what for one in self.differences} <= BOUNDED and max(self.written) <= most

    def holds(self, question: Question) -> bool:
        """Whether the answer to a question is yes."""
        if not (bool(self) if question.within is None else self.within(question.within)):
            return False
        return not (question.strict and (self.verdict is Verdict.SAME_AFTER or self.remarks))

    def exit_code(self, *, strict: bool = False, within: float | None = None) -> int:
        """0: equivalent, or within what is asked; 1: not.

        Args:
            strict: Whether being equivalent only, and remarks, count as differences.
            within: Metres and radians by which frames may be off as written, proven.
        """
        return int(not self.holds(Question(within, strict)))

    def to_b(self, q: ArrayLike) -> FloatArray:
        """(..., nq) of B for A's configurations (..., nq): there both stand alike, but for `base`.

        Coordinates that only B has are neutral.

        Raises:
            InputError: another length than A's.
        """
        return _mapped(self.trees, {one.a: one for one in self.joints}, checked(self.trees[0], q, "q"))


def _mapped(
    trees: tuple[KinematicTree, KinematicTree], joints: dict[str, JointMap], q: FloatArray
) -> FloatArray:
    tree_a, tree_b = trees
    out = np.broadcast_to(neutral(tree_b), (*q.shape[:-1], tree_b.nq)).copy()
    for i, joint in enumerate(tree_a.joints):
        one = joints.get(joint.name)
        if one is None:
            continue
        j = tree_b.joint_index(one.b)
        theirs = tree_b.joints[j]
        if theirs.mimic is not None or joint.kind.nq != theirs.kind.nq:
            continue
        at_a, at_b, n = tree_a.q_index[i], tree_b.q_index[j], joint.kind.nq
        own = q[..., at_a : at_a + n]
        if one.conversion is not None:
            own = one.conversion(joint.kind, own)
        if joint.mimic is not None:
            own = joint.mimic.multiplier * own + joint.mimic.offset
        out[..., at_b : at_b + n] = own if n != 1 else one.sense * own + one.offset
    return out


def length(metres: float) -> str:
    """A length as people read it.

    >>> length(0.0019), length(2e-9), length(1.5), length(math.inf)
    ('1.9 mm', '2 nm', '1.5 m', 'without bound')
    """
    return _with_prefix(metres, "m")


def up_to(words: Callable[[float], str], lower: float, upper: float) -> str:
    """An interval of lengths or angles: what is attained, and what is proven where that reads otherwise.

    >>> up_to(length, 0.025, 0.025), up_to(angle, 0.4297, 0.4327), up_to(length, 1.0, math.inf)
    ('25 mm', '429.7 mrad (at most 432.7 mrad)', '1 m (without bound)')
    """
    attained, most = words(lower), words(upper)
    if attained == most:
        return attained
    return f"{attained} ({most})" if math.isinf(upper) else f"{attained} (at most {most})"


def angle(radians: float) -> str:
    """Likewise.

    >>> angle(0.0003), angle(1.5)
    ('0.3 mrad', '1.5 rad')
    """
    return _with_prefix(radians, "rad")


def _with_prefix(value: float, unit: str) -> str:
    if math.isinf(value):
        return "without bound"
    if value == 0.0:
        return f"0 {unit}"
    for prefix, factor in (("", 1.0), ("m", 1e3), ("µ", 1e6), ("n", 1e9), ("p", 1e12)):
        if abs(value) * factor >= _TENTH * (1.0 if prefix else _NINE):
            return f"{value * factor:.4g} {prefix}{unit}"
    return f"{value:.2g} {unit}"


def demand_joint_names(tree: KinematicTree, names: list[str], which: str) -> None:
    """Raise UnknownNameError for a name that no joint has, InputError for one given twice."""
    for name in names:
        tree.joint_index(name)
    if len(set(names)) < len(names):
        double = next(name for i, name in enumerate(names) if name in names[:i])
        raise InputError(f"a joint of {which} is given twice", where="map", found=repr(double))
