"""Result of comparing two models: verdict, differences, matched joints, and distances between frames."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.dh.table import nearest_twelfth
from urdfkin.dh.units import parse_units
from urdfkin.errors import InputError
from urdfkin.errors.display import Displayable, TextDocument
from urdfkin.errors.escape import log_line
from urdfkin.errors.validators import as_bool, as_finite_float
from urdfkin.kinematics.rotation import rpy_of
from urdfkin.model.configuration import neutral, parse_finite
from urdfkin.model.mechanisms.mechanism import (
    IDENTITY,
    Alignment,
    FramePair,
    FreeJointConversion,
    MatchedJoints,
    Mechanism,
    Tolerance,
    Variables,
    joint_limits,
    pose_difference,
    tolerance_of,
)
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Lock, Mimic, inverse
from urdfkin.system.lazy_import import get_hook

if TYPE_CHECKING:
    from urdfkin.model.conventions import Convention

#: Values of at least 0.9 (m or rad) have no unit prefix. A smaller value has the first of the prefixes m, µ
#: and n with which its number is at least 0.1: 0.0001 m is 0.1 mm, and 0.00005 m is 50 µm. Values below
#: 0.1 nm have no prefix, because few readers know picoradians: 4e-12 rad. The two limits are 0.05 % smaller,
#: because the numbers are rounded to four digits.
_LEAST_WITHOUT_PREFIX, _LEAST_WITH_PREFIX = 0.89955, 0.09995


class Verdict(Enum):
    """Verdict of a comparison of two models.

    `UP_TO_SINGLE`: single precision explains the difference at each joint.
    """

    SAME = "same"
    SAME_AFTER = "same after"
    UP_TO_SINGLE = "same up to single precision"
    DIFFERS = "differs"


#: Kinds of changes to B. The models are equivalent if changes of these kinds remove all differences. The
#: order is that of the printed verdict.
EQUIVALENCE_KINDS = ("base", "zeros", "senses", "free joints", "tools")
#: For these kinds of differences, `same` computes an upper bound of the distance between matching frames.
BOUNDED_DIFFERENCE_KINDS = frozenset({"axis", "place", "frame", "mimic rule", "fixed"})


@dataclass(frozen=True, slots=True)
class SameQuestion:
    """A condition that `Sameness.holds` checks.

    Attributes:
        within: Limit (m and rad) for `Sameness.within`. If `within` is None, the verdict must not be
            `Verdict.DIFFERS`.
        strict: Whether the condition fails for remarks, and for the verdict `Verdict.SAME_AFTER`.
    """

    within: float | None = None
    strict: bool = False


@dataclass(frozen=True, slots=True)
class Interval:
    """An interval that contains the largest distance between two matching frames.

    The largest distance is taken over all configurations within the joint limits.

    Attributes:
        frame: The link of A.
        frame_b: The link of B.
        lower: Lower bound of the largest distance, m. It equals the distance at `q_a` and `q_b`, minus
            rounding errors.
        upper: Proven upper bound of the distance, m; inf without a bound.
        radians: Proven upper bound of the angle between the frames, rad; inf without a bound.
        radians_seen: Angle between the frames at `q_a` and `q_b`, rad.
        q_a: Configuration of A with the largest distance found. If `lower` is 0, `q_a` can be the
            configuration with the largest angle. Empty if the frames do not differ.
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


#: Value of a parameter of a joint or link. A type or a name is a str. A limit of velocity or effort is a
#: float. For "limits", a tuple contains the lower and the upper limit. For "idle", a tuple contains the type
#: of a joint that never moves, and the joint's value (rad or m). For "only in A" and "only in B", a tuple
#: contains the names of links. A `Mimic` is a mimic rule. None: the joint or link has no value of this
#: parameter.
Value = str | float | tuple[str | float | None, ...] | Mimic | None


@dataclass(frozen=True, slots=True)
class Difference:
    """One difference between two models.

    Attributes:
        place: The joint or link, for example "joint elbow". The name is from A, or from B if A has no such
            joint or link.
        what: The parameter: "axis", "place", "mimic rule", "only in A", ...
        a: The parameter's value in A; None if A has no value.
        b: The parameter's value in B; None if B has no value.
        radians: Angular part of the difference, rad.
        metres: Linear part of the difference, m.
        detail: "alone" if the axis differs, but the links after the joint agree. "converted" if the limits
            of B were converted to A's coordinate. Otherwise empty.
    """

    place: str
    what: str
    a: Value = None
    b: Value = None
    radians: float = 0.0
    metres: float = 0.0
    detail: str = ""

    @property
    def values(self) -> tuple[str | float | None, str | float | None]:
        """The values in A and B as numbers or texts. Mimic rules and link names give None."""
        if self.what == "limits":
            return _format_range(self.a), _format_range(self.b)
        if self.what == "idle":
            return "fixed by its rule" if self.a else None, "fixed by its rule" if self.b else None
        a, b = (x if isinstance(x, str | float) else None for x in (self.a, self.b))
        return a, b

    @property
    def words(self) -> str:  # noqa: PLR0911, PLR0912  each kind of difference has its own text
        """The difference as one line of text."""
        place, what, a, b = self.place, self.what, self.a, self.b
        match what:
            case "axis":
                sizes = [f"tilted by {angle(self.radians)}"] if self.radians else []
                sizes += [f"{length(self.metres)} off"] if self.metres else []
                alone = " (the links after this joint agree)" if self.detail == "alone" else ""
                return f"{place}: its axis is {' and '.join(sizes)}{alone}"
            case "place":
                return f"{place} is {size_words(self.metres, self.radians)} on its rigid body"
            case "frame":
                return f"{place}: its plane is tilted by {angle(self.radians)}"
            case "fixed":
                moves, fixed = ("A", "B") if b == "fixed" else ("B", "A")
                return f"{place} moves in {moves} and is fixed in {fixed}"
            case "mimic rule" if a is None and b is not None:
                return f"{place} is an independent joint in A and a mimic joint in B: {_format_rule(b)}"
            case "mimic rule" if a is not None and b is None:
                return f"{place} is a mimic joint in A and an independent joint in B: {_format_rule(a)}"
            case "mimic rule":
                return f"{place} has different mimic rules: {_format_rule(a)} in A, {_format_rule(b)} in B"
            case "independent joint":
                return (
                    f"{place} is a mimic joint in A and an independent joint in B, with the same motion:"
                    f" {_format_rule(a)}"
                )
            case "idle":
                which, values = ("A", a) if isinstance(a, tuple) else ("B", b)
                return f"{place} never moves in {which}: {_idle_words(values)}"
            case "limits":
                converted = " (in A's coordinate)" if self.detail else ""
                return f"{place}: limits {_format_range(a)} in A, {_format_range(b)} in B{converted}"
            case "velocity" | "effort":
                return f"{place}: {what} limit {_as_number(a):g} in A, {_as_number(b):g} in B"
            case "carried by":
                return f"{place} is carried by {a} in A, by {b} in B"
            case "kind":
                return f"{place} is {a} in A, {b} in B"
        names = a or b
        return (
            f"links {what}: {', '.join(map(str, names))}"
            if isinstance(names, Sequence)
            else f"{place} is {what}"
        )


def _format_rule(rule: Value) -> str:
    return (
        f"{rule.multiplier!r} {rule.mimicked_joint} {rule.offset:+.17g}"
        if isinstance(rule, Mimic)
        else "free"
    )


def _idle_words(values: Value) -> str:
    kind, value = values if isinstance(values, tuple) else (None, None)
    unit = "m" if kind == JointKind.PRISMATIC.value else "rad"
    number = f"{_as_number(value):.12g} {unit}"
    return f"its mimic rule has the multiplier 0, so the joint's value is always {number}"


def _as_number(x: object, infinity: float = math.inf) -> float:
    return x if isinstance(x, float) else infinity


def _format_range(ends: Value) -> str:
    lower, upper = ends if isinstance(ends, tuple) else (None, None)
    return f"{_as_number(lower, -math.inf):.12g} to {_as_number(upper):.12g}"


@dataclass(frozen=True, slots=True)
class JointDifference:
    """A difference that rounding does not explain, or a joint or link that cannot be compared.

    Attributes:
        place: The joint or link of A, for example "joint elbow".
        what: "origin", "axis", "mimic multiplier", "mimic offset", "mimic joint" or "base". Empty if the
            models cannot be compared at this joint or link.
        a: The parameter's value in A; None if `b` is a description.
        b: The parameter's value in B, or a description in words.
        explained: Text of the largest difference that rounding can cause. Empty if no number is rounded.
    """

    place: str
    what: str
    a: float | str | None
    b: float | str
    explained: str = ""

    def __str__(self) -> str:
        old = "" if self.a is None else f" instead of {self.a}"
        explained = f", rounding explains at most {self.explained}" if self.explained else ""
        return f"{self.place}: {self.what} {self.b}{old}".replace("  ", " ") + explained


@dataclass(frozen=True, slots=True, eq=False)
class Tool:
    """Two matched links that `same` reports as different tools.

    Attributes:
        pose: (4, 4) pose of `b` in the frame of `a`.
    """

    a: str
    b: str
    pose: FloatArray


#: Result of Pinocchio's check of the bounds. "not asked" means that the user requested no check, or that
#: there is no bound to check. "not verified" means that Pinocchio could not check the bounds.
ConfirmationState = Literal["confirmed", "not asked", "not verified"]
_STATE_TEXTS = {"not asked": "not checked by Pinocchio", "not verified": "not verified by Pinocchio"}


@dataclass(frozen=True, slots=True)
class Confirmation:
    """Result of Pinocchio's check of the bounds.

    Attributes:
        configurations: Number of checked configurations.
        metres: Largest distance that Pinocchio computed, m.
        reason: Reason for a missing check.
    """

    state: ConfirmationState
    by: str = ""
    configurations: int = 0
    metres: float = 0.0
    reason: str = ""

    def __str__(self) -> str:
        if self.state != "confirmed":
            return f"{_STATE_TEXTS[self.state]}: {self.reason}"
        at = f"at {self.configurations} configurations"
        return f"{self.by} finds at most {self.metres:.2g} m {at}, within the bounds"


@dataclass(frozen=True, slots=True)
class JointMap:
    """A joint of A and the matching joint of B.

    This formula converts the joint value:

        value in B = sense * (value in A) + offset

    Attributes:
        sense: 1 or -1; 1 for planar and floating joints.
        offset: Offset in rad or m; 0 for planar and floating joints.
        conversion: Conversion of a planar or floating joint's pose from A to B. None if the pose needs no
            conversion.
    """

    a: str
    b: str
    sense: int
    offset: float
    conversion: FreeJointConversion | None = None


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Sameness(Displayable):
    """Whether two models are the same robot; the result of `urdfkin.same`.

    `print` and notebooks show the answer, the size of the difference, and the reasons.

    Attributes:
        names: The robots' names.
        sources: For A and B: a path, a catalogue name, or a label such as `<text>`.
        digests: For A and B: SHA-256 of the URDF text, or of the MJCF or USD file.
        verdict: `Verdict.SAME`, `SAME_AFTER` (after the changes in `after`), `UP_TO_SINGLE`, or `DIFFERS`.
        after: Changes of B that bring B closest to A, one line each. The models may still differ after the
            changes.
        up_to: The kinds of change in `after`: "base", "zeros", "senses", "free joints", "tools".
        differences: The differences, ordered from the base to the tips. The list ends with the joints of only
            one model, and the links after different moving joints in A and B.
        remarks: Differences without effect on motion, for example joint limits, joint types, and links of
            only one model.
        joints: Pairs of matching joints of A and B.
        links: Pairs of matching links of A and B.
        tools: Pairs of matching links that `same` reports as different tools.
        orders: Each entry lists consecutive joints of B in a new order, which does not affect the motion.
        base: (4, 4) pose of B's root in A's root frame, in the zero configuration. The identity if the roots
            coincide.
        base_links: A link of A and a link of B, on matching rigid bodies. The comparison uses poses relative
            to these two links.
        rounding: (m, rad) largest distance and angle that rounding errors can cause between matching frames.
        unlimited: Planar and floating joints of A, and prismatic joints without limits. All bounds on
            distances assume that no joint in this list travels more than 10 m.
        single: (m, rad) largest distance and angle that single precision can cause between matching frames.
            None if no file has single precision.
        unexplained: Differences between the unchanged models that rounding does not explain, for each joint
            and link. The numbers of a USD file are rounded to single precision.
        frames: One interval for each pair of matching links, after the changes in `after`. Empty if
            `same` was called with `bounds=False`.
        as_written: Interval of the two matching frames with the largest distance found between the unchanged
            models. None if `after` is empty, if no frames can be compared, or if `bounds` is False.
        bound_as_written: (m, rad) proven bounds on distance and angle between matching frames of the
            unchanged models. Infinite if no bounds were proven. If `after` is not empty, a comparison with a
            Denavit-Hartenberg table uses only the table's base and tip.
        narrowed: One line for each mimicked joint that can move a mimic joint beyond its limits. The
            distances in `frames` are computed for the whole range of the mimicked joint.
        confirmation: Result of Pinocchio's check of the bounds.
        trees: The two robot models.

    >>> import urdfkin
    >>> found = urdfkin.same("ur5", "ur10")
    >>> bool(found), found.verdict.value, found.differences[0].words
    (False, 'differs', 'link shoulder_link is 38.14 mm off on its rigid body')
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
    tools: tuple[Tool, ...]
    orders: tuple[tuple[str, ...], ...]
    base: FloatArray
    base_links: tuple[str, str]
    rounding: tuple[float, float]
    unlimited: tuple[str, ...]
    single: tuple[float, float] | None
    unexplained: tuple[JointDifference, ...]
    frames: tuple[Interval, ...]
    as_written: Interval | None
    bound_as_written: tuple[float, float]
    narrowed: tuple[str, ...]
    confirmation: Confirmation
    trees: tuple[KinematicTree, KinematicTree]

    def __bool__(self) -> bool:
        """Whether the models are the same, equivalent, or the same up to single precision."""
        return self.verdict is not Verdict.DIFFERS

    def __repr__(self) -> str:
        return log_line(f"<Sameness {self.names[0]}, {self.names[1]}: {self._verdict}>")

    @property
    def _verdict(self) -> str:
        after = self.verdict is Verdict.SAME_AFTER
        return f"equivalent up to {', '.join(self.up_to)}" if after else self.verdict.value

    def _text_document(self) -> TextDocument:
        document: TextDocument = get_hook("a comparison as a document")(self)
        return document

    @property
    def worst(self) -> Interval | None:
        """The element of `frames` with the largest upper bound.

        The result is None if all distances and angles are within rounding errors. If upper bounds are equal,
        `lower` decides. If `lower` is equal too, `radians` decides.

        >>> import urdfkin
        >>> found = urdfkin.same("ur5", "ur10")
        >>> found.worst.frame, length(found.worst.lower)
        ('ee_link', '429.7 mm')
        """
        metres, radians = self.rounding
        return max(
            (one for one in self.frames if one.lower > 0.0 or one.upper > metres or one.radians > radians),
            key=lambda one: (one.upper, one.lower, one.radians),
            default=None,
        )

    @property
    def worst_as_written(self) -> Interval | None:
        """The interval of the frame that differs most between the unchanged models, at equal joint values.

        If `as_written` is None, the result is `worst`.

        >>> import urdfkin
        >>> found = urdfkin.same("ur5", "ur10")
        >>> length(found.worst_as_written.lower)
        '432.1 mm'
        """
        return self.as_written or self.worst

    @property
    def up_to_single(self) -> bool:
        """Whether single precision explains every difference in motion.

        Each joint is checked separately. For the verdict `Verdict.SAME`, the result is False.

        >>> import urdfkin
        >>> urdfkin.same("ur5", "ur10").up_to_single
        False
        """
        return self.verdict is Verdict.UP_TO_SINGLE

    @property
    def within_single(self) -> bool:
        """Whether single precision can explain the displacement of every frame.

        The unchanged models are compared. The limit is the sum of the rounding errors of all joints. A
        small wrong number in a file can also cause a displacement below the limit. Only `up_to_single`
        proves that rounding is the cause. The result is False unless the verdict is `Verdict.DIFFERS`.

        >>> import urdfkin
        >>> urdfkin.same("ur5", "ur10").within_single
        False
        """
        if self.single is None or self.verdict is not Verdict.DIFFERS:
            return False
        explained = {one.what for one in self.differences} <= BOUNDED_DIFFERENCE_KINDS
        return (
            explained
            and self.bound_as_written[0] <= self.single[0]
            and self.bound_as_written[1] <= self.single[1]
        )

    def within(self, most: float) -> bool:
        """Return whether all matching frames are proven to differ by at most `most` (m and rad).

        The unchanged models are compared at equal coordinates. Different base poses, tool frames and joint
        zeros can therefore increase the distance. If a root body has a link with the name of the other
        model's root, this link and the other root coincide. Otherwise, the roots coincide. If `differences`
        contains a kind outside `BOUNDED_DIFFERENCE_KINDS`, such as "only in A", the result is False.

        >>> import urdfkin
        >>> found = urdfkin.same("ur5", "ur10")
        >>> found.within(0.01), found.within(1.0)
        (False, True)
        """
        if not (isinstance(most, float) and math.isinf(most)):
            most = as_finite_float(most, "most")
        return {one.what for one in self.differences} <= BOUNDED_DIFFERENCE_KINDS and max(
            self.bound_as_written
        ) <= most

    def holds(self, question: SameQuestion) -> bool:
        """Return whether the result meets a condition.

        >>> import urdfkin
        >>> found = urdfkin.same("ur5", "ur10")
        >>> found.holds(SameQuestion(within=1.0))
        True
        """
        if not (bool(self) if question.within is None else self.within(question.within)):
            return False
        return not (question.strict and (self.verdict is Verdict.SAME_AFTER or self.remarks))

    def exit_code(self, *, strict: bool = False, within: float | None = None) -> int:
        """Return 0 if the condition `SameQuestion(within, strict)` holds, else 1.

        Args:
            strict: Whether remarks and the verdict `Verdict.SAME_AFTER` also give 1.
            within: Largest allowed distance (m) and angle (rad) between frames of the unchanged models.

        >>> import urdfkin
        >>> found = urdfkin.same("ur5", "ur10")
        >>> found.exit_code(), found.exit_code(within=1.0)
        (1, 0)
        """
        return int(not self.holds(SameQuestion(within, as_bool(strict, "strict"))))

    def to_b(self, q: ArrayLike) -> FloatArray:
        """Convert configurations (..., nq) of A to configurations (..., nq) of B.

        For equivalent models, the link poses of A at q and of B at the result differ only by `base` and
        `tools`. Coordinates that only B has are neutral. If a joint is revolute in one model and prismatic in
        the other, its coordinate is also neutral.

        Raises:
            InputError: q does not have A's length, or is not finite.

        >>> import urdfkin
        >>> found = urdfkin.same("ur5", "ur10")
        >>> found.to_b([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]).round(6).tolist()
        [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
        """
        (tree_a, tree_b), joints = self.trees, {one.a: one for one in self.joints}
        q = parse_finite(tree_a, q, "q")
        out = np.broadcast_to(neutral(tree_b), (*q.shape[:-1], tree_b.nq)).copy()
        for i, joint in enumerate(tree_a.joints):
            if (one := joints.get(joint.name)) is None:
                continue
            j = tree_b.joint_index(one.b)
            theirs = tree_b.joints[j]
            if theirs.mimic is not None or not _have_equal_motion(joint, theirs):
                continue
            at_a, at_b, n = tree_a.q_index[i], tree_b.q_index[j], joint.kind.nq
            own = q[..., at_a : at_a + n]
            if one.conversion is not None:
                own = one.conversion(joint.kind, own)
            if joint.mimic is not None:
                own = joint.mimic.multiplier * own + joint.mimic.offset
            out[..., at_b : at_b + n] = own if n != 1 else one.sense * own + one.offset
        return out

    def convention(self) -> Convention:
        """Return a convention that converts A's coordinates to B's.

        The convention gives A's joints the names, order, directions and zeros of B's joints.
        `robot_a.convention(found.convention())` converts q, v, a and Jacobians. For equivalent models, the
        link poses at q and at the converted q differ only by `base` and `tools`.

        Raises:
            InputError: a coordinate has no match in the other model, or B has no coordinates. Also if the
                frames of a planar or floating joint differ.

        >>> import urdfkin
        >>> found = urdfkin.same("ur5", "ur5_limited")
        >>> found.convention().joints[:2]
        ('shoulder_pan_joint', 'shoulder_lift_joint')
        """
        from urdfkin.model.conventions import Convention, Conversion, JointRule

        tree_a, tree_b = self.trees
        joints_of_b = {one.b: one for one in self.joints}
        rules, joints = {}, list[str]()
        for joint in tree_b.joints:
            if not joint.kind.nq or joint.mimic is not None:
                continue
            one = joints_of_b.get(joint.name)
            if one is None or not _have_equal_motion(tree_a.joints[tree_a.joint_index(one.a)], joint):
                raise InputError(
                    "a joint of B has no matching joint in A",
                    where="map",
                    found=joint.name,
                    remedy="match it with map={JOINT_OF_A: JOINT_OF_B} (--map), or make it fixed in B",
                )
            if one.conversion is not None:
                raise InputError(
                    "the frames of a planar or floating joint in A and B differ",
                    where="map",
                    found=joint.name,
                    remedy="convert q with `Sameness.to_b`; a convention cannot convert the joint's pose",
                )
            joints.append(joint.name)
            rule = JointRule(joint.name if one.b != one.a else None, float(one.sense), one.offset)
            if rule != JointRule():
                rules[one.a] = rule
        if not joints:
            raise InputError(
                "B has no coordinates, so no convention can convert to B",
                where=self.names[1],
                found="0 coordinates",
                remedy="compare with a model that has moving joints",
            )
        found = Convention(
            name=self.names[1],
            title=f"{self.sources[0]} with the joints of {self.sources[1]}",
            note=f"found by urdfkin same {' '.join(self.sources)}: {self._verdict}",
            order="given",
            joints=tuple(joints),
            rules=rules,
        )
        # The constructor raises an error if B lacks a coordinate for a joint of A.
        Conversion(tree_a, "", found)
        return found


def _have_equal_motion(a: Joint, b: Joint) -> bool:
    return (a.kind.nq, a.kind.turns) == (b.kind.nq, b.kind.turns)


def length(metres: float) -> str:
    """Return a length as text with a unit prefix.

    >>> length(0.0019), length(4.7e-12), length(math.inf)
    ('1.9 mm', '4.7e-12 m', 'without bound')
    """
    return _with_prefix(metres, "m")


def interval_text(format_size: Callable[[float], str], lower: float, upper: float) -> str:
    """Return an interval as text.

    >>> interval_text(length, 0.025, 0.025), interval_text(angle, 0.4297, 0.4327)
    ('25 mm', '429.7 mrad (at most 432.7 mrad)')
    >>> interval_text(length, 1.0, math.inf)
    '1 m (without bound)'
    """
    attained, most = format_size(lower), format_size(upper)
    if attained == most:
        return attained
    return f"{attained} ({most})" if math.isinf(upper) else f"{attained} (at most {most})"


def angle(radians: float) -> str:
    return _with_prefix(radians, "rad")


def _with_prefix(value: float, unit: str) -> str:
    if math.isinf(value):
        return "without bound"
    if value == 0.0:
        return f"0 {unit}"
    for prefix, factor in (("", 1.0), ("m", 1e3), ("µ", 1e6), ("n", 1e9)):
        if abs(value) * factor >= (_LEAST_WITH_PREFIX if prefix else _LEAST_WITHOUT_PREFIX):
            return f"{value * factor:.4g} {prefix}{unit}"
    return f"{value:.4g} {unit}"


def size_words(metres: float, radians: float) -> str:
    """Return a displacement as text.

    >>> size_words(0.0019, 0.0003), size_words(0.0, 0.0003)
    ('1.9 mm off and turned by 0.3 mrad', 'turned by 0.3 mrad')
    """
    parts = [f"{length(metres)} off"] if metres else []
    parts += [f"turned by {angle(radians)}"] if radians else []
    return " and ".join(parts)


def check_joint_names(tree: KinematicTree, names: list[str], which: str) -> None:
    for name in names:
        tree.joint_index(name)
    if len(set(names)) < len(names):
        double = next(name for i, name in enumerate(names) if name in names[:i])
        raise InputError(f"a joint of {which} occurs twice", where="map", found=repr(double))


def base_as_written(a: Mechanism, b: Mechanism) -> FloatArray:
    """Return the pose (4, 4) of B's root in A's root frame, for the unchanged models.

    If B's root body has a link with the name of A's root, this link coincides with A's root. Otherwise, if
    A's root body has a link with the name of B's root, B's root coincides with this link. Otherwise, the
    roots coincide.
    """
    if (root := a.labels[0]) in b.labels and not b.body_of[link := b.labels.index(root)]:
        return inverse(b.zero_poses[link])
    if (root := b.labels[0]) in a.labels and not a.body_of[link := a.labels.index(root)]:
        return a.zero_poses[link]
    return IDENTITY


def changes_of_b(alignment: Alignment, rounding: Tolerance) -> tuple[tuple[str, str], ...]:
    """Return the kind and the text of each change in `Sameness.after`, and store tool poses in `alignment`.

    Every displaced frame of a Denavit-Hartenberg table counts as a tool, because the table's convention
    determines the frames.
    """
    lines = list[tuple[str, str]]()
    tree_a, tree_b = alignment.a.tree, alignment.b.tree
    for which, mechanism, link in (
        ("A", alignment.a, alignment.base[0]),
        ("B", alignment.b, alignment.base[1]),
    ):
        if mechanism.body_of[link]:
            root, base = mechanism.tree.links[0], mechanism.tree.links[link]
            lines.append(
                ("base", f"{which}'s root is {root}; the joints between {base} and this root are reversed")
            )
    written = pose_difference(base_as_written(alignment.a, alignment.b), alignment.X)
    if alignment.X is not IDENTITY or not rounding.holds(*written):
        lines.append(
            ("base", f"the pose of B's root in A's root frame is {pose_words(alignment.X, rounding)}")
        )
    for step in alignment.steps:
        if step.conversion is not None:
            lines.append(("free joints", _conversion_words(alignment, step, step.conversion, rounding)))
        if step.sense < 0 or step.offset:
            sign = "-" if step.sense < 0 else ""
            least = rounding.angle if step.kind == "turns" else rounding.distance
            offset = _remove_rounding(step.offset, least)
            twelfth = nearest_twelfth(offset)
            if step.kind == "turns" and abs(offset - twelfth) <= 2.0 * least:
                size = parse_units().format_angle(abs(twelfth))
            else:
                size = repr(abs(offset))
            constant = f" {'-' if offset < 0 else '+'} {size}" if offset else ""
            words = f"q[{tree_b.joints[step.b].name}] = {sign}q[{tree_a.joints[step.a].name}]{constant}"
            lines += [("zeros", words)] if step.offset else []
            lines += [("senses", words)] if step.sense < 0 else []
    return (*lines, *_tool_changes(alignment, rounding))


def _tool_changes(alignment: Alignment, rounding: Tolerance) -> Iterator[tuple[str, str]]:
    supports, links = _support_link_pairs(alignment), (alignment.a.tree.links, alignment.b.tree.links)
    for k, frame in enumerate(alignment.frames):
        is_support = (frame.a, frame.b) in supports
        if frame.differs and (
            is_support or alignment.has_free_frames or _are_fixed_end_links(alignment, frame)
        ):
            alignment.frames[k] = frame.move_difference_to_tool()
            if is_support and rounding.holds(
                *pose_difference(alignment.a.zero_poses[frame.a], alignment.b.zero_poses[frame.b])
            ):
                continue  # The line about the base pose already describes this difference.
        if (tool := alignment.frames[k].tool) is not IDENTITY:
            moved = pose_words(tool, rounding)
            yield (
                "tools",
                f"frame {links[1][frame.b]} of B is frame {links[0][frame.a]} of A, moved by {moved}",
            )


def _support_link_pairs(alignment: Alignment) -> set[tuple[int, int]]:
    """Return the index pairs of matching links that support the robots, for example pedestals.

    Matching links beside the robots are included if their poses are equal.
    """
    if alignment.a.body_of[alignment.base[0]] or alignment.b.body_of[alignment.base[1]]:
        return set()
    (support_a, side_a), (support_b, side_b) = (
        _support_and_side_links(m) for m in (alignment.a, alignment.b)
    )
    rounding = tolerance_of(alignment.a, alignment.b)
    return {
        (frame.a, frame.b)
        for frame in alignment.frames
        if (frame.a in support_a and frame.b in support_b)
        or (
            (frame.a in support_a | side_a and frame.b in support_b | side_b)
            and rounding.holds(
                *pose_difference(alignment.a.zero_poses[frame.a], alignment.b.zero_poses[frame.b])
            )
        )
    }


def _support_and_side_links(mechanism: Mechanism) -> tuple[set[int], set[int]]:
    """Return the links of the root body that support the robot, and those beside the robot.

    A supporting link, for example a pedestal, has a fixed child that carries all moving joints. A link beside
    the robot, for example a table, carries no moving joint.
    """
    tree = mechanism.tree
    carried = [0] * len(tree.links)
    children = [list[int]() for _ in tree.links]
    for i, joint in reversed(list(enumerate(tree.joints))):
        moves = mechanism.body_of[i + 1] != mechanism.body_of[joint.parent]
        carried[joint.parent] += 1 if moves else carried[i + 1]
        if not moves:
            children[joint.parent].append(i + 1)
    body = mechanism.bodies[0] if carried[0] else []
    support = {link for link in body if any(carried[child] == carried[0] for child in children[link])}
    return support, {link for link in body if not carried[link]}


def _conversion_words(
    alignment: Alignment, step: MatchedJoints, conversion: FreeJointConversion, rounding: Tolerance
) -> str:
    names = alignment.b.tree.joints[step.b].name, alignment.a.tree.joints[step.a].name
    own = f"the {'inverse of the ' if conversion.back else ''}pose of q[{names[1]}]"
    M, N = (
        "" if T is IDENTITY else f"the pose {pose_words(T, rounding)}"
        for T in (conversion.before, conversion.behind)
    )
    return f"the pose of q[{names[0]}] is {' times '.join(part for part in (M, own, N) if part)}"


def pose_words(T: FloatArray, rounding: Tolerance) -> str:
    xyz, rpy = T[:3, 3], rpy_of(T[:3, :3])
    words = (
        " ".join(repr(_remove_rounding(float(x), least)) for x in numbers)
        for numbers, least in ((xyz, rounding.distance), (rpy, rounding.angle))
    )
    return 'xyz="{}" rpy="{}"'.format(*words)


def _remove_rounding(x: float, rounding: float) -> float:
    return round(x, math.ceil(-math.log10(rounding))) + 0.0


def _are_fixed_end_links(alignment: Alignment, frame: FramePair) -> bool:
    # `same` treats some mimic joints with multiplier 0 as fixed joints. The child link of such a joint is not
    # a tool.
    for tree, link in ((alignment.a.tree, frame.a), (alignment.b.tree, frame.b)):
        if link == 0 or tree.joints[link - 1].kind.nv or idle_joint_lock(tree.joints[link - 1]):
            return False
        if any(joint.parent == link for joint in tree.joints):
            return False
    return True


def differences(alignment: Alignment, variables: Variables) -> tuple[Difference, ...]:
    tree_a, tree_b, tolerance = alignment.a.tree, alignment.b.tree, tolerance_of(alignment.a, alignment.b)
    with_depth: list[tuple[float, list[Difference]]] = [
        (len(alignment.path(i)), _joint_differences(alignment, variables, i))
        for i in range(len(alignment.steps))
    ]
    with_depth += [
        (
            len(alignment.path(frame.previous)) + 0.5,
            [
                Difference(
                    f"link {tree_a.links[frame.a]}", "place", None, None, *_tilt_and_shift(frame, tolerance)
                )
            ],
        )
        for frame in alignment.frames
        if frame.differs
    ]
    ordered = [one for _, found in sorted(with_depth, key=lambda pair: pair[0]) for one in found]
    for tree, joints, which in ((tree_a, alignment.only_a, "A"), (tree_b, alignment.only_b, "B")):
        unmatched = [f"joint {tree.joints[j].name}" for j in sorted(joints) if tree.joints[j].kind.nv]
        ordered += [Difference(place, f"only in {which}") for place in unmatched]
    matched = {frame.a for frame in alignment.frames}
    links_of_b = {label: link for link, label in enumerate(alignment.b.labels)}
    for link, label in enumerate(alignment.a.labels):
        other = links_of_b.get(label)
        if other is not None and link not in matched and _is_on_matched_bodies(alignment, link, other):
            ours, theirs = _carrier_name(tree_a, link), _carrier_name(tree_b, other)
            ordered.append(Difference(f"link {tree_a.links[link]}", "carried by", ours, theirs))
    return tuple(ordered)


def _is_on_matched_bodies(alignment: Alignment, link_a: int, link_b: int) -> bool:
    return all(
        mechanism.body_of[index] not in {mechanism.body_of[j + 1] for j in only}
        for mechanism, only, index in (
            (alignment.a, alignment.only_a, link_a),
            (alignment.b, alignment.only_b, link_b),
        )
    )


def _carrier_name(tree: KinematicTree, link: int) -> str:
    path = [tree.joints[i] for i in tree.path(link) if tree.joints[i].kind.nv]
    return f"joint {path[-1].name}" if path else "the base"


def _joint_differences(alignment: Alignment, variables: Variables, i: int) -> list[Difference]:
    tolerance = tolerance_of(alignment.a, alignment.b)
    step, tree_a, tree_b = alignment.steps[i], alignment.a.tree, alignment.b.tree
    joint, other = tree_a.joints[step.a], tree_b.joints[step.b]
    place = f"joint {joint.name}"
    if step.kind_difference == "kind":
        return [Difference(place, "kind", joint.kind.value, other.kind.value)]
    if step.kind_difference:
        ends = ("fixed", "moves") if step.kind_difference == "a" else ("moves", "fixed")
        return [Difference(place, "fixed", *ends)]
    found = []
    if step.differs and step.kind in ("planar", "floating"):
        found.append(Difference(place, "frame", radians=step.tilt, metres=step.shift))
    elif step.differs:
        detail = "alone" if step.axis_b is not step.axis_a else ""
        found.append(Difference(place, "axis", None, None, *_tilt_and_shift(step, tolerance), detail))
    if i in variables.rule_differences:
        found.append(Difference(place, "mimic rule", joint.mimic, other.mimic))
    return found


def _tilt_and_shift(pair: MatchedJoints | FramePair, rounding: Tolerance) -> tuple[float, float]:
    """Return the tilt (rad) and the shift (m), or 0 for a value within the tolerance `rounding`."""
    return (
        pair.tilt if pair.tilt > rounding.angle else 0.0,
        pair.shift if pair.shift > rounding.distance else 0.0,
    )


def remarks(
    alignment: Alignment,
    variables: Variables,
    tolerance: Tolerance,
    single_roundoff: float = 0.0,
    *,
    as_written: bool = False,
) -> tuple[Difference, ...]:
    """Return differences without effect on motion.

    `single_roundoff` is the relative rounding error of single precision, or 0 for double precision.
    """
    found = list[Difference]()
    for step in alignment.steps:
        if not step.kind_difference:
            a, b = alignment.a.tree.joints[step.a], alignment.b.tree.joints[step.b]
            zero = (1, 0.0) if as_written else (step.sense, step.offset)
            found += limit_differences(a, b, tolerance.angle, single_roundoff, zero)
    for tree, which in ((alignment.a.tree, "A"), (alignment.b.tree, "B")):
        for lock in filter(None, map(idle_joint_lock, tree.joints)):
            value = lock.joint.kind.value, lock.value
            found.append(Difference(f"joint {lock.joint.name}", "idle", *_value_pair(which, value)))
    # A mimic joint of A can be an independent joint in B with the same motion. For example, the mimic rule in
    # B can be the inverse of the mimic rule in A.
    for step in alignment.steps:
        a, b = alignment.a.tree.joints[step.a], alignment.b.tree.joints[step.b]
        line = variables.coordinates_b.get(b.name)
        if a.mimic is not None and line is not None and line.variable == f"a:{a.mimic.mimicked_joint}":
            found.append(Difference(f"joint {a.name}", "independent joint", a.mimic))
    for tree, other, which in (
        (alignment.a.tree, alignment.b.tree, "A"),
        (alignment.b.tree, alignment.a.tree, "B"),
    ):
        matched = {tree.links[frame.a if which == "A" else frame.b] for frame in alignment.frames}
        alone = tuple(link for link in tree.links if link not in other.links and link not in matched)
        if alone:
            found.append(Difference(f"links of {which}", f"only in {which}", *_value_pair(which, alone)))
    return tuple(found)


def _value_pair(which: str, value: Value) -> tuple[Value, Value]:
    return (value, None) if which == "A" else (None, value)


def idle_joint_lock(joint: Joint) -> Lock | None:
    lock = joint.lock
    return lock if lock and lock.joint.mimic and lock.joint.mimic.multiplier == 0.0 else None


def limit_differences(
    a: Joint, b: Joint, tolerance: float, single_roundoff: float, zero: tuple[int, float] = (1, 0.0)
) -> Iterator[Difference]:
    """Yield differences of kinds and limits.

    Args:
        a: The joint of A.
        b: The joint of B.
        tolerance: Relative tolerance. For two values below 1, it is an absolute tolerance.
        single_roundoff: Relative rounding error of single precision; 0 for double precision.
        zero: (sign, offset) of the conversion of joint values: value in B = sign * (value in A) + offset.
    """
    place, (sense, offset) = f"joint {a.name}", zero
    if a.kind is not b.kind:
        yield Difference(place, "kind", a.kind.value, b.kind.value)
    back = sorted(sense * (end - offset) for end in joint_limits(b))
    ours = joint_limits(a)
    if not all(_is_close(x, y, tolerance, single_roundoff) for x, y in zip(ours, back, strict=True)):
        detail = "converted" if sense < 0 or offset else ""
        yield Difference(place, "limits", tuple(map(_finite, ours)), tuple(map(_finite, back)), detail=detail)
    for what in ("velocity", "effort"):
        x, y = (getattr(joint.limit, what, math.inf) for joint in (a, b))
        if not _is_close(x, y, tolerance, single_roundoff):
            yield Difference(place, what, _finite(x), _finite(y))


def _is_close(x: float, y: float, tolerance: float, single_roundoff: float) -> bool:
    return x == y or abs(x - y) <= tolerance * max(1.0, abs(x), abs(y)) + single_roundoff * max(
        abs(x), abs(y)
    )


def _finite(x: float) -> float | None:
    return x if math.isfinite(x) else None
