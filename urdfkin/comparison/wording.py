"""Describe an alignment in words: the changes that make B equal to A, the differences and the remarks."""

from __future__ import annotations

import math
from collections.abc import Iterator

from urdfkin.comparison.result import Difference, angle, length
from urdfkin.dh.table import nearest_twelfth
from urdfkin.dh.units import units_of
from urdfkin.kinematics.rotation.euler import rpy_of
from urdfkin.model.mechanisms.alignment import IDENTITY, Alignment, FramePair, Step
from urdfkin.model.mechanisms.mechanism import JointTransform, Mechanism, Tolerance, apart, tolerance_of
from urdfkin.model.mechanisms.variables import Variables, limits
from urdfkin.model.tree import FloatArray, Joint, KinematicTree


def put_right(found: Alignment, rounding: Tolerance, *, tables: bool = False) -> tuple[tuple[str, str], ...]:
    """Return the changes that turn B into A: a kind of `result.FREE` and a line each. Correct the tools.

    Args:
        found: The alignment of the models; differing tools are corrected in it.
        rounding: The tolerance within which numbers are equal.
        tables: Whether one model is a table. The frames of a table depend on its convention, so all of them
            count as tools.
    """
    lines = list[tuple[str, str]]()
    tree_a, tree_b = found.a.tree, found.b.tree
    for which, mechanism, link in (("A", found.a, found.base[0]), ("B", found.b, found.base[1])):
        if mechanism.body_of[link]:
            root, base = mechanism.tree.links[0], mechanism.tree.links[link]
            lines.append(
                ("base", f"{which}'s root is {root}; as seen from {base}, the joints between are reversed")
            )
    if found.X is not IDENTITY:
        lines.append(("base", f"B's root is in A's root frame at {pose_words(found.X, rounding)}"))
    for step in found.steps:
        if step.conversion is not None:
            lines.append(("free joints", _conversion_words(found, step, step.conversion, rounding)))
        if step.sense < 0 or step.offset:
            sign = "-" if step.sense < 0 else ""
            least = rounding.angle if step.kind == "turns" else rounding.way
            offset = _rounded(step.offset, least)
            twelfth = nearest_twelfth(offset)
            if step.kind == "turns" and abs(offset - twelfth) <= 2.0 * least:
                size = units_of().angle(abs(twelfth))
            else:
                size = repr(abs(offset))
            constant = f" {'-' if offset < 0 else '+'} {size}" if offset else ""
            words = f"q[{tree_b.joints[step.b].name}] = {sign}q[{tree_a.joints[step.a].name}]{constant}"
            lines += [("zeros", words)] if step.offset else []
            lines += [("senses", words)] if step.sense < 0 else []
    return (*lines, *_tools_put_right(found, rounding, tables=tables))


def _tools_put_right(found: Alignment, rounding: Tolerance, *, tables: bool) -> Iterator[tuple[str, str]]:
    """Treat frames without children and frames around the base as tools; yield a line for each."""
    around, links = _around(found), (found.a.tree.links, found.b.tree.links)
    for k, frame in enumerate(found.frames):
        beside = (frame.a, frame.b) in around
        if frame.differs and (beside or tables or _is_tool(found, frame)):
            found.frames[k] = frame.put_right()
            if beside and rounding.holds(*apart(found.a.homes[frame.a], found.b.homes[frame.b])):
                continue  # its pose in the root frame is unchanged: the line about the base is enough
        if (tool := found.frames[k].tool) is not IDENTITY:
            moved = pose_words(tool, rounding)
            yield "tools", f"frame {links[1][frame.b]} is A's {links[0][frame.a]} moved by {moved}"


def _around(found: Alignment) -> set[tuple[int, int]]:
    """Return the common frames on the fixed body whose pose only states where the robot is mounted.

    These are links before all links that carry moving joints. They are also links without moving joints
    whose pose in the root frame is the same in both models, such as a world or a table.
    """
    if found.a.body_of[found.base[0]] or found.b.body_of[found.base[1]]:
        return set()
    (before_a, idle_a), (before_b, idle_b) = (_beside_the_joints(m) for m in (found.a, found.b))
    rounding = tolerance_of(found.a, found.b)
    return {
        (frame.a, frame.b)
        for frame in found.frames
        if (frame.a in before_a and frame.b in before_b)
        or (
            (frame.a in before_a | idle_a and frame.b in before_b | idle_b)
            and rounding.holds(*apart(found.a.homes[frame.a], found.b.homes[frame.b]))
        )
    }


def _beside_the_joints(mechanism: Mechanism) -> tuple[set[int], set[int]]:
    """Return the links of the root body before all moving joints, and those that carry no moving joint.

    Both sets are empty if no joint moves.
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
    before = {link for link in body if any(carried[child] == carried[0] for child in children[link])}
    return before, {link for link in body if not carried[link]}


def _conversion_words(found: Alignment, step: Step, made: JointTransform, rounding: Tolerance) -> str:
    names = found.b.tree.joints[step.b].name, found.a.tree.joints[step.a].name
    own = f"the {'inverse of the ' if made.back else ''}pose of q[{names[1]}]"
    M, N = (
        "" if T is IDENTITY else f"the pose {pose_words(T, rounding)}" for T in (made.before, made.behind)
    )
    return f"the pose of q[{names[0]}] is {' times '.join(part for part in (M, own, N) if part)}"


def pose_words(T: FloatArray, rounding: Tolerance) -> str:
    """Return a pose in URDF `<origin>` notation."""
    xyz, rpy = T[:3, 3], rpy_of(T[:3, :3])
    words = (
        " ".join(repr(_rounded(float(x), least)) for x in numbers)
        for numbers, least in ((xyz, rounding.way), (rpy, rounding.angle))
    )
    return 'xyz="{}" rpy="{}"'.format(*words)


def _rounded(x: float, rounding: float) -> float:
    """Return the shortest decimal number within the rounding."""
    return round(x, math.ceil(-math.log10(rounding))) + 0.0


def _is_tool(found: Alignment, frame: FramePair) -> bool:
    """Return whether a frame is fixed and has no children in both models."""
    for tree, link in ((found.a.tree, frame.a), (found.b.tree, frame.b)):
        if link == 0 or tree.joints[link - 1].kind.nv or any(joint.parent == link for joint in tree.joints):
            return False
    return True


def differences(found: Alignment, variables: Variables) -> tuple[Difference, ...]:
    """Return the differences that affect motion, ordered from the base to the tips."""
    tree_a, tree_b = found.a.tree, found.b.tree
    placed: list[tuple[float, list[Difference]]] = [
        (len(found.path(i)), _of_step(found, variables, i)) for i in range(len(found.steps))
    ]
    placed += [
        (len(found.path(frame.previous)) + 0.5, [_of_frame(found, frame)])
        for frame in found.frames
        if frame.differs
    ]
    ordered = [one for _, some in sorted(placed, key=lambda pair: pair[0]) for one in some]
    for tree, joints, which in ((tree_a, found.only_a, "A"), (tree_b, found.only_b, "B")):
        alone = [f"joint {tree.joints[j].name}" for j in sorted(joints) if tree.joints[j].kind.nv]
        ordered += [Difference(place, f"only in {which}", f"{place} is only in {which}") for place in alone]
    have = {tree_a.links[frame.a] for frame in found.frames}
    for link in tree_a.links:
        if link in tree_b.links and link not in have and _of_the_pair(found, tree_a, tree_b, link):
            ours, theirs = (_carrier(tree, link) for tree in (tree_a, tree_b))
            words = f"link {link} is carried by {ours} in A, by {theirs} in B"
            ordered.append(Difference(f"link {link}", "carried by", words))
    return tuple(ordered)


def _of_the_pair(found: Alignment, tree_a: KinematicTree, tree_b: KinematicTree, link: str) -> bool:
    """Return whether the bodies of a common link are also common; otherwise a joint is reported already."""
    alone_a = {found.a.body_of[j + 1] for j in found.only_a}
    alone_b = {found.b.body_of[j + 1] for j in found.only_b}
    return (
        found.a.body_of[tree_a.link_index(link)] not in alone_a
        and found.b.body_of[tree_b.link_index(link)] not in alone_b
    )


def _carrier(tree: KinematicTree, link: str) -> str:
    """Return the last moving joint before a link, in words."""
    path = [tree.joints[i] for i in tree.path(tree.link_index(link)) if tree.joints[i].kind.nv]
    return f"joint {path[-1].name}" if path else "the base"


def _of_step(found: Alignment, variables: Variables, i: int) -> list[Difference]:
    step, tree_a, tree_b = found.steps[i], found.a.tree, found.b.tree
    joint, other = tree_a.joints[step.a], tree_b.joints[step.b]
    place = f"joint {joint.name}"
    if step.unlike == "kind":
        return [Difference(place, "kind", f"{place} is {joint.kind.value} in A, {other.kind.value} in B")]
    if step.unlike:
        fixed, moves = ("A", "B") if step.unlike == "a" else ("B", "A")
        return [Difference(place, "fixed", f"{place} moves in {moves} and is fixed in {fixed}")]
    some = []
    if step.differs:
        what, said = _axis_words(place, step, tolerance_of(found.a, found.b))
        some.append(Difference(place, what, said, step.tilt, step.shift))
    for steps, words in (
        (variables.freer_a, "{0} is free in A and a mimic joint in B: {2}"),
        (variables.freer_b, "{0} is a mimic joint in A and free in B: {1}"),
        (variables.rules, "{0} has another mimic rule: {1} in A, {2} in B"),
    ):
        if i in steps:
            some.append(Difference(place, "mimic rule", words.format(place, _rule(joint), _rule(other))))
    return some


def _rule(joint: Joint) -> str:
    rule = joint.mimic
    return f"{rule.multiplier!r} {rule.leader} {rule.offset:+.17g}" if rule else "free"


def _axis_words(place: str, step: Step, rounding: Tolerance) -> tuple[str, str]:
    """Return the parameter that differs by more than rounding, and a line about it."""
    if step.kind in ("planar", "floating"):
        return "frame", f"{place}: its plane is tilted by {angle(step.tilt)}"
    parts = [f"tilted by {angle(step.tilt)}"] if step.tilt > rounding.angle else []
    parts += [f"{length(step.shift)} off"] if step.shift > rounding.way else []
    alone = " (the links behind it are not)" if step.other is not step.axis else ""
    return "axis", f"{place}: its axis is {' and '.join(parts)}{alone}"


def _of_frame(found: Alignment, frame: FramePair) -> Difference:
    place, rounding = f"link {found.a.tree.links[frame.a]}", tolerance_of(found.a, found.b)
    parts = [f"{length(frame.shift)} off"] if frame.shift > rounding.way else []
    parts += [f"turned by {angle(frame.tilt)}"] if frame.tilt > rounding.angle else []
    return Difference(
        place, "place", f"{place} is {' and '.join(parts)} on its body", frame.tilt, frame.shift
    )


def remarks(found: Alignment, variables: Variables, tolerance: Tolerance) -> tuple[Difference, ...]:
    """Return the differences that do not affect motion: limits, kinds, and links of one model only."""
    some = list[Difference]()
    for step in found.steps:
        if not step.unlike:
            some += _of_limits(step, found.a.tree.joints[step.a], found.b.tree.joints[step.b], tolerance)
    for tree, other, which in ((found.a.tree, found.b.tree, "A"), (found.b.tree, found.a.tree, "B")):
        paired = {tree.links[frame.a if which == "A" else frame.b] for frame in found.frames}
        lacking = [link for link in tree.links if link not in other.links and link not in paired]
        if lacking:
            words = f"links only in {which}: {', '.join(lacking)}"
            some.append(Difference(f"links of {which}", f"only in {which}", words))
    return tuple(some)


def _of_limits(step: Step, a: Joint, b: Joint, tolerance: Tolerance) -> Iterator[Difference]:
    place = f"joint {a.name}"
    if a.kind is not b.kind:
        yield Difference(place, "kind", f"{place} is {a.kind.value} in A, {b.kind.value} in B")
    back = sorted(step.sense * (end - step.offset) for end in limits(b))
    ours = limits(a)
    if any(not _close(x, y, tolerance.angle) for x, y in zip(ours, back, strict=True)):
        words = f"{place}: limits {_range(ours)} in A, {_range((back[0], back[1]))} in B"
        converted = " (in A's coordinate)" if step.sense < 0 or step.offset else ""
        yield Difference(place, "limits", words + converted)
    for what in ("velocity", "effort"):
        x, y = (getattr(joint.limit, what, math.inf) for joint in (a, b))
        if not _close(x, y, tolerance.angle):
            yield Difference(place, what, f"{place}: {what} limit {x:g} in A, {y:g} in B")


def _close(x: float, y: float, share: float) -> bool:
    return x == y or abs(x - y) <= share * max(1.0, abs(x), abs(y))


def _range(ends: tuple[float, float]) -> str:
    return f"{ends[0]:.12g} to {ends[1]:.12g}"
