"""The result of comparing two models: verdict, differences, joint map and intervals of distance."""

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

#: Smallest number printed with a prefix (0.1 to four digits); the unit alone is used from 9 times it on.
_TENTH, _NINE = 0.09995, 9.0


class Verdict(Enum):
    """Whether two models are the same, equivalent up to the kinds in `Sameness.up_to`, or different."""

    SAME = "same"
    SAME_AFTER = "same after"
    DIFFERS = "differs"


#: Kinds of changes up to which two models are equivalent, in the order of the headline.
FREE = ("base", "zeros", "senses", "free joints", "tools")
#: Kinds of differences for which the distance of each common frame is still bounded.
BOUNDED = frozenset({"axis", "place", "frame", "mimic rule", "fixed"})


@dataclass(frozen=True, slots=True)
class Question:
    """A question about two models.

    Attributes:
        within: Largest allowed distance of a frame as written, in metres and in radians. None: ask whether
            the models are equivalent.
        strict: Whether equivalent models and models with remarks count as different.
    """

    within: float | None = None
    strict: bool = False


@dataclass(frozen=True, slots=True)
class Interval:
    """An interval that contains a frame's largest distance over all configurations within limits.

    Attributes:
        frame: The link of A.
        frame_b: The link of B.
        lower: Lower bound, metres; attained at `q_a` and `q_b`.
        upper: Upper bound, metres, proven; inf where there is no bound.
        radians: Upper bound of the angle between the orientations, proven.
        radians_seen: An attained angle between the orientations.
        q_a: Configuration of A.
        q_b: The corresponding configuration of B.
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
    """One difference between two models.

    Attributes:
        place: The joint or link of A, for example "joint elbow".
        what: The parameter in words, without the size: "axis", "origin", "mimic rule", "only in A", ...
        words: The difference in one line.
        radians: Size of the difference as an angle, 0 where it has none.
        metres: Size of the difference as a length, 0 where it has none.
    """

    place: str
    what: str
    words: str
    radians: float = 0.0
    metres: float = 0.0


@dataclass(frozen=True, slots=True)
class JointMap:
    """A joint of A and its joint of B: value_b = sense * value_a + offset (rad, m).

    A planar or floating joint has the sense 1 and the offset 0. It has a conversion where its pose differs.
    """

    a: str
    b: str
    sense: int
    offset: float
    conversion: JointTransform | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Sameness:
    """Whether two models are the same robot; the result of `urdfkin.same`.

    Attributes:
        names: The robots' names.
        sources: The two sources, as given.
        digests: SHA-256 of the two texts.
        verdict: `Verdict.SAME`, `SAME_AFTER` the changes in `after`, or `DIFFERS`.
        after: The changes of B that bring it closest to A, one line each; also where the models still differ.
        up_to: The kinds of these changes: "base", "zeros", "senses", "free joints", "tools".
        differences: The differences, ordered from the base to the tips.
        remarks: Differences that do not affect motion: limits, kinds, links of one model only.
        joints: The matched joints of A and B.
        links: The matched links of A and B.
        orders: Runs of joints of B that were taken in another order, which their axes allow.
        base: (4, 4) pose of B's root in A's root frame, in the zero configuration; the identity where they
            agree.
        base_links: The link of A and the link of B, on the same body, relative to which poses are compared.
        rounding: (m, rad) distance of frames that counts as rounding.
        frames: The interval of each common link, with the changes in `after`.
        as_written: The interval of the farthest frame without these changes; None where there are none.
        written: (m, rad) proven bound of all common frames as written; infinite where there is no bound. Of
            a table, only frames that have the same name in the robot count.
        narrowed: Joints whose mimic joints leave their limits, one line each. Intervals cover the whole
            range of the joint itself.
        checked: Pinocchio's confirmation, or the reason why there is none.
        trees: The two robot models.
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
        """Whether the models are the same or equivalent."""
        return self.verdict is not Verdict.DIFFERS

    def __repr__(self) -> str:
        after = self.verdict is Verdict.SAME_AFTER
        how = f"equivalent up to {', '.join(self.up_to)}" if after else self.verdict.value
        return log_line(f"<Sameness {self.names[0]}, {self.names[1]}: {how}>")

    @property
    def worst(self) -> Interval | None:
        """The frame with the largest bound of its distance, or of its angle; None if all are rounding."""
        metres, radians = self.rounding
        return max(
            (one for one in self.frames if one.lower > 0.0 or one.upper > metres or one.radians > radians),
            key=lambda one: (one.upper, one.lower, one.radians),
            default=None,
        )

    @property
    def worst_as_written(self) -> Interval | None:
        """The frame with the largest bound at equal coordinates, without the changes in `after`."""
        return self.as_written or self.worst

    def within(self, most: float) -> bool:
        """Return whether all common frames provably stay within a distance (m and rad) as written.

        The roots coincide, and equal coordinates are compared. So a different base, zero or tool counts.
        The result is False if a joint has another kind or exists in one model only.
        """
        return {one.what for one in self.differences} <= BOUNDED and max(self.written) <= most

    def holds(self, question: Question) -> bool:
        """Return whether the answer to a question is yes."""
        if not (bool(self) if question.within is None else self.within(question.within)):
            return False
        return not (question.strict and (self.verdict is Verdict.SAME_AFTER or self.remarks))

    def exit_code(self, *, strict: bool = False, within: float | None = None) -> int:
        """Return 0 if the models are equivalent, or within the given distance; else 1.

        Args:
            strict: Whether equivalent models and models with remarks count as different.
            within: Largest allowed distance of a frame as written, in metres and in radians.
        """
        return int(not self.holds(Question(within, strict)))

    def to_b(self, q: ArrayLike) -> FloatArray:
        """Return B's configurations (..., nq) for A's configurations (..., nq).

        There both models have the same poses, except for `base`. Coordinates of B alone are neutral.

        Raises:
            InputError: q does not have A's length.
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
    """Return a length as text, with a unit prefix.

    >>> length(0.0019), length(2e-9), length(1.5), length(math.inf)
    ('1.9 mm', '2 nm', '1.5 m', 'without bound')
    """
    return _with_prefix(metres, "m")


def up_to(words: Callable[[float], str], lower: float, upper: float) -> str:
    """Return an interval as text: the attained value, and the proven bound where its text differs.

    >>> up_to(length, 0.025, 0.025), up_to(angle, 0.4297, 0.4327), up_to(length, 1.0, math.inf)
    ('25 mm', '429.7 mrad (at most 432.7 mrad)', '1 m (without bound)')
    """
    attained, most = words(lower), words(upper)
    if attained == most:
        return attained
    return f"{attained} ({most})" if math.isinf(upper) else f"{attained} (at most {most})"


def angle(radians: float) -> str:
    """Return an angle as text, with a unit prefix.

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
    """Raise UnknownNameError if no joint has a name, and InputError if a name occurs twice."""
    for name in names:
        tree.joint_index(name)
    if len(set(names)) < len(names):
        double = next(name for i, name in enumerate(names) if name in names[:i])
        raise InputError(f"a joint of {which} is given twice", where="map", found=repr(double))
