"""The summary of a robot: the tree of its links and joints, with columns for axes, indices and limits."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from urdfkin.errors.display import Displayable, Table, TextDocument
from urdfkin.model.configuration import range_reductions
from urdfkin.model.tree import Joint, KinematicTree

#: Columns of the joint table.
#: Limits of revolute joints are in rad and rad/s.
#: Limits of prismatic joints are in m and m/s.
COLUMNS = ("kind", "axis", "q", "v", "lower", "upper", "speed", "mimics")
LEFT_ALIGNED_COLUMNS = (0, 1, 2, 3, 4, 5, 9)
_LEFT_ALIGNED_JOINT_COLUMNS = (0, 1, 2, *(i + 1 for i in LEFT_ALIGNED_COLUMNS[2:]))


def summarize_robot(
    tree: KinematicTree, default_base: str, default_tip: str, order_sentence: str
) -> TextDocument:
    columns = COLUMNS if any(joint.mimic for joint in tree.joints) else COLUMNS[:-1]
    names = ["", *(joint.name for joint in tree.joints)]
    cells = [("",) * len(columns), *(joint_cells(tree, i)[: len(columns)] for i in range(len(tree.joints)))]
    rows = [
        (guide + link, joint, *own)
        for guide, link, joint, own in zip(tree_guides(tree), tree.links, names, cells, strict=True)
    ]
    tips = ", ".join(tree.links[leaf] for leaf in tree.leaves())
    return TextDocument(
        f"{tree.name}: nq {tree.nq}, nv {tree.nv}, {len(tree.links)} links, {len(tree.joints)} joints",
        (
            f"root {tree.links[0]}, default base {default_base}, default tip {default_tip}",
            Table(("link", "joint", *columns), rows, left=LEFT_ALIGNED_COLUMNS),
            *map(str, range_reductions(tree)),
            f"frames: {len(tree.frame_names)} (names of links and joints); tips: {tips}",
            order_sentence,
        ),
    )


class JointTable(dict[str, Joint], Displayable):
    """A robot's joints by name, displayed as a table."""

    def __init__(self, tree: KinematicTree) -> None:
        super().__init__((joint.name, joint) for joint in tree.joints)
        self._tree = tree

    def _text_document(self) -> TextDocument:
        tree = self._tree
        columns = COLUMNS if any(joint.mimic for joint in self.values()) else COLUMNS[:-1]
        links = zip(tree.joints, tree.links[1:], strict=True)
        rows = [
            (joint.name, tree.links[joint.parent], child, *joint_cells(tree, i)[: len(columns)])
            for i, (joint, child) in enumerate(links)
        ]
        heads = ("joint", "parent", "child", *columns)
        return TextDocument(
            f"{tree.name}: {len(self)} joints", [Table(heads, rows, left=_LEFT_ALIGNED_JOINT_COLUMNS)]
        )


def tree_guides(tree: KinematicTree) -> Iterator[str]:
    """Yield the box-drawing characters before each link's name."""
    children = [0] * len(tree.links)
    for joint in tree.joints:
        children[joint.parent] += 1
    remaining, indents = list(children), [""]
    yield ""
    for joint in tree.joints:
        remaining[joint.parent] -= 1
        own, below = ("├ ", "│ ") if remaining[joint.parent] else ("└ ", "  ")
        if children[joint.parent] == 1:
            own, below = "", ""
        yield indents[joint.parent] + own
        indents.append(indents[joint.parent] + below)


def joint_cells(tree: KinematicTree, i: int) -> tuple[str, ...]:
    joint = tree.joints[i]
    if not joint.kind.nv:
        words = joint.kind.value if joint.lock is None else f"locked at {joint.lock.value:.6g}"
        return (words, *[""] * (len(COLUMNS) - 1))
    q, v = _index_text("q", tree.q_index[i], joint.kind.nq), _index_text("v", tree.v_index[i], joint.kind.nv)
    limit = joint.limit
    limits = ("", "", "") if limit is None else map(_limit_text, (limit.lower, limit.upper, limit.velocity))
    axis = format_axis(joint.axis.tolist()) if joint.kind.has_axis else ""
    rule = joint.mimic
    mimics = format_mimic_rule(rule.mimicked_joint, rule.multiplier, rule.offset) if rule else ""
    return (joint.kind.value, axis, q, v, *limits, mimics)


def _index_text(letter: str, at: int, count: int) -> str:
    return f"{letter}[{at}]" if count == 1 else f"{letter}[{at}:{at + count}]"


def format_axis(axis: Sequence[float]) -> str:
    """Return a joint's axis as text.

    >>> format_axis((0.0, -1.0, 0.0)), format_axis((0.0, 0.6, 0.8))
    ('-y', '0 0.6 0.8')
    """
    if sorted(map(abs, axis)) == [0.0, 0.0, 1.0]:
        k = next(k for k, x in enumerate(axis) if x)
        return f"{'-' if axis[k] < 0.0 else ''}{'xyz'[k]}"
    return " ".join(f"{x:.4g}" for x in axis)


def format_mimic_rule(mimicked_joint: str, factor: float, offset: float) -> str:
    """Return a mimic rule as text.

    >>> format_mimic_rule("thumb", 2.0, -0.1), format_mimic_rule("thumb", 1.0, 0.0)
    ('2 * thumb -0.1', 'thumb')
    """
    return (f"{factor:g} * " if factor != 1.0 else "") + mimicked_joint + (f" {offset:+g}" if offset else "")


def _limit_text(value: float) -> str:
    return "" if math.isinf(value) else f"{value:.6g}"
