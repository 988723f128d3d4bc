"""Known changes of a robot: which of them are the same robot, and which are not, is known beforehand."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from functools import cache, partial, reduce

import numpy as np
from numpy.typing import ArrayLike

from tests import urdfs
from urdfkin.kinematics.rotation import exp_rotation, rotation_from_rpy, rpy_of
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, Mimic, build_tree, inverse
from urdfkin.robot import Robot

#: Load a robot or a tree, unverified.
loaded = partial(urdfs.loaded, verify=False)
Change = Callable[[KinematicTree], KinematicTree]
Branch = tuple[Joint, str, str]


def branches(tree: KinematicTree) -> list[Branch]:
    """Every joint with the names of its links."""
    return [(joint, tree.links[joint.parent], tree.links[i + 1]) for i, joint in enumerate(tree.joints)]


def pose(vector: ArrayLike, shift: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
    """A turn and a way."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = exp_rotation(vector), shift
    return T


def fixed(name: str, T: FloatArray) -> Joint:
    return Joint(name, JointKind.FIXED, 0, T, np.array([1.0, 0.0, 0.0]))


def on_a_stand(tree: KinematicTree) -> KinematicTree:
    """The base moved: a new root, to which the old one is fixed."""
    stand = fixed("stand_joint", pose([0.3, -0.2, 0.9], [0.5, -1.0, 0.25]))
    return build_tree(tree.name, "stand", [*branches(tree), (stand, "stand", tree.links[0])])


def split(tree: KinematicTree) -> KinematicTree:
    """A fixed link put into every moving joint's way."""
    rows: list[Branch] = []
    for joint, parent, child in branches(tree):
        if not joint.kind.nv:
            rows.append((joint, parent, child))
            continue
        T = pose([0.4, 0.1, -0.7], [0.01, -0.02, 0.03])
        between = f"{child}_mount"
        rows.append((fixed(f"{joint.name}_mount", joint.T_parent_joint @ T), parent, between))
        rows.append((replace(joint, T_parent_joint=inverse(T)), between, child))
    return build_tree(tree.name, tree.links[0], rows)


def merged(tree: KinematicTree) -> KinematicTree:
    """Fixed links taken out, what hung on them hung on what they were fixed to."""
    carrier: list[tuple[str, FloatArray]] = [(tree.links[0], np.eye(4))]
    rows: list[Branch] = []
    for i, joint in enumerate(tree.joints):
        link, T = carrier[joint.parent]
        T = T @ joint.T_parent_joint
        if joint.kind.nv:
            rows.append((replace(joint, T_parent_joint=T), link, tree.links[i + 1]))
            carrier.append((tree.links[i + 1], np.eye(4)))
        else:
            carrier.append((link, T))
    return build_tree(tree.name, tree.links[0], rows)


def flipped(tree: KinematicTree) -> KinematicTree:
    """Every other axis turned round, so that the coordinate counts the other way."""
    return with_axes_reversed(tree, {joint.name for joint in tree.joints[1::2] if joint.kind.has_axis})


def with_axes_reversed(tree: KinematicTree, turned: Collection[str]) -> KinematicTree:
    """Some axes turned round."""

    def one(joint: Joint) -> Joint:
        if joint.mimic is not None:
            own, leader = (-1.0 if name in turned else 1.0 for name in (joint.name, joint.mimic.leader))
            rule = Mimic(joint.mimic.leader, own * leader * joint.mimic.multiplier, own * joint.mimic.offset)
            joint = replace(joint, mimic=rule)
        if joint.name not in turned:
            return joint
        limit = joint.limit and replace(joint.limit, lower=-joint.limit.upper, upper=-joint.limit.lower)
        return replace(joint, axis=-joint.axis, limit=limit)

    return build_tree(tree.name, tree.links[0], [(one(j), p, c) for j, p, c in branches(tree)])


def shifted(tree: KinematicTree) -> KinematicTree:
    """Every other joint's zero elsewhere: its coordinate reads more by 0.7 rad, or 0.07 m, at one place."""
    some = [joint for joint in tree.joints[::2] if joint.kind.has_axis]
    return with_zeros_moved(tree, {joint.name: 0.7 if joint.kind.turns else 0.07 for joint in some})


def with_zeros_moved(tree: KinematicTree, off: Mapping[str, float]) -> KinematicTree:
    """Some joints' zeros elsewhere, so that their coordinates read more."""

    def one(joint: Joint) -> Joint:
        if joint.mimic is not None:  # its own value reads off[name] more, its leader's off[leader] more
            rule = joint.mimic
            more = off.get(joint.name, 0.0) - rule.multiplier * off.get(rule.leader, 0.0)
            joint = replace(joint, mimic=replace(rule, offset=rule.offset + more))
        if joint.name not in off:
            return joint
        o, limit = off[joint.name], joint.limit
        back = pose(-o * joint.axis) if joint.kind.turns else pose([0.0] * 3, -o * joint.axis)
        limit = limit and replace(limit, lower=limit.lower + o, upper=limit.upper + o)
        return replace(joint, T_parent_joint=joint.T_parent_joint @ back, limit=limit)

    return build_tree(tree.name, tree.links[0], [(one(j), p, c) for j, p, c in branches(tree)])


def renamed(tree: KinematicTree) -> KinematicTree:
    """Other names for all joints and links, and so another order of siblings and of coordinates."""
    joints = {joint.name: f"j{len(tree.joints) - i:03d}" for i, joint in enumerate(tree.joints)}
    return with_names(tree, joints, {link: f"part{i}" for i, link in enumerate(tree.links)})


def with_names(tree: KinematicTree, joints: Mapping[str, str], links: Mapping[str, str]) -> KinematicTree:
    """All joints and links under other names."""
    rows = []
    for joint, parent, child in branches(tree):
        rule = joint.mimic and replace(joint.mimic, leader=joints[joint.mimic.leader])
        rows.append((replace(joint, name=joints[joint.name], mimic=rule), links[parent], links[child]))
    return build_tree(tree.name, links[tree.links[0]], rows)


def rerooted(tree: KinematicTree) -> KinematicTree:
    """The other way up: the last leaf behind moving joints is the root, and joints on its way run back."""
    leaf = max(tree.leaves(), key=lambda link: len(tree.path(link)))
    path = tree.path(leaf)
    rows: list[Branch] = []
    # What stands on a link of the path is seen from the frame of the joint that now carries it.
    seen = {tree.joints[i].parent: inverse(tree.joints[i].T_parent_joint) for i in path}
    names = {link: f"{tree.links[link]}_body" for link in seen}
    names[leaf] = tree.links[leaf]
    for i, joint in enumerate(tree.joints):
        parent, child = joint.parent, i + 1
        T = seen.get(parent, np.eye(4)) @ joint.T_parent_joint
        if i in path:  # its frame is the child's; run back, it counts about its axis turned round
            back = replace(joint, axis=-joint.axis, T_parent_joint=seen.get(child, np.eye(4)))
            rows.append((back, names[child], names[parent]))
        else:
            carrier = names.get(parent, tree.links[parent])
            rows.append((replace(joint, T_parent_joint=T), carrier, tree.links[child]))
    rows += [(fixed(f"{tree.links[k]}_seen", T), names[k], tree.links[k]) for k, T in seen.items()]
    return build_tree(tree.name, names[leaf], rows)


def counted_elsewhere(tree: KinematicTree) -> KinematicTree:
    """Every planar and floating joint in another frame, and what hangs on it seen from another one."""
    rows: list[Branch] = []
    over, lift = np.diag([1.0, -1.0, -1.0, 1.0]), pose([0.0] * 3, [0.0, 0.0, 0.2])
    for joint, parent, child in branches(tree):
        if joint.kind not in (JointKind.PLANAR, JointKind.FLOATING):
            rows.append((joint, parent, child))
            continue
        C, D = pose([0.3, 0.5, -0.9], [0.4, 0.1, -0.2]), pose([-0.2, 0.8, 0.1], [0.0, 0.3, 0.1])
        if joint.kind is JointKind.PLANAR:  # in its plane, but lifted and turned over, and back
            C = pose([0.0, 0.0, 0.7], [0.4, 0.1, 0.0]) @ over @ lift
            D = inverse(lift) @ over @ pose([0.0, 0.0, -1.1], [-0.3, 0.2, 0.0])
        between = f"{child}_counted"
        rows.append((replace(joint, T_parent_joint=joint.T_parent_joint @ C), parent, between))
        rows.append((fixed(f"{joint.name}_counted", D), between, child))
    return build_tree(tree.name, tree.links[0], rows) if len(rows) > len(tree.joints) else tree


def exchanged(tree: KinematicTree) -> KinematicTree:
    """Two slides one behind the other, or a slide along a turn's axis, in the other order; the first such."""
    for j, outer in enumerate(tree.joints):
        i = outer.parent - 1
        if i < 0 or sum(joint.parent == outer.parent for joint in tree.joints) > 1:
            continue
        inner, T = tree.joints[i], outer.T_parent_joint
        if JointKind.PRISMATIC not in (inner.kind, outer.kind) or not (inner.kind.has_axis and outer.nv):
            continue
        both_slide = inner.kind is outer.kind
        if not both_slide and np.linalg.norm(np.cross(inner.axis, T[:3, :3] @ outer.axis)) > 1e-14:
            continue
        first, last, child = tree.links[inner.parent], tree.links[i + 1], tree.links[j + 1]
        rows = [row for k, row in enumerate(branches(tree)) if k not in (i, j)]
        rows.append((replace(outer, T_parent_joint=inner.T_parent_joint @ T), first, f"{last}_exchanged"))
        rows.append((replace(inner, T_parent_joint=inverse(T)), f"{last}_exchanged", f"{child}_behind"))
        rows.append((fixed(f"{child}_seen", T), f"{child}_behind", child))
        return build_tree(tree.name, tree.links[0], rows)
    return tree


def moving(tree: KinematicTree) -> list[int]:
    """Joints with an axis, the deepest chain's first."""
    deepest = max(tree.leaves(), key=lambda link: sum(tree.joints[i].nv for i in tree.path(link)))
    return [i for i in tree.path(deepest) if tree.joints[i].kind.has_axis and tree.joints[i].nv]


def middle(tree: KinematicTree) -> tuple[int, Joint]:
    """The joint in the middle of the longest chain."""
    chain = moving(tree)
    at = chain[len(chain) // 2]
    return at, tree.joints[at]


def with_joint(tree: KinematicTree, at: int, joint: Joint) -> KinematicTree:
    """The tree with one joint exchanged."""
    joints = (*tree.joints[:at], joint, *tree.joints[at + 1 :])
    return KinematicTree(tree.name, tree.links, joints)


def across(axis: FloatArray) -> FloatArray:
    """A unit vector across another."""
    other = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.8 else [0.0, 1.0, 0.0])
    return np.asarray(other / np.linalg.norm(other))


def tilted(tree: KinematicTree, angle: float) -> KinematicTree:
    """One joint in the middle of the longest chain tilted, with all that hangs on it."""
    at, joint = middle(tree)
    T = joint.T_parent_joint @ pose(angle * across(joint.axis))
    return with_joint(tree, at, replace(joint, T_parent_joint=T))


def lengthened(tree: KinematicTree, metres: float) -> KinematicTree:
    """One joint in the middle of the longest chain moved across its axis, with all that hangs on it."""
    at, joint = middle(tree)
    T = joint.T_parent_joint @ pose([0.0] * 3, metres * across(joint.axis))
    return with_joint(tree, at, replace(joint, T_parent_joint=T))


def bent_axis(tree: KinematicTree, angle: float) -> KinematicTree:
    """One joint's axis alone tilted: at home everything stands where it stood."""
    at, joint = middle(tree)
    return with_joint(tree, at, replace(joint, axis=exp_rotation(angle * across(joint.axis)) @ joint.axis))


def with_another_rule(tree: KinematicTree) -> KinematicTree:
    """The first follower moves by a tenth more; the tree itself where nobody follows."""
    for at, joint in enumerate(tree.joints):
        if joint.mimic is not None:
            rule = replace(joint.mimic, multiplier=1.1 * joint.mimic.multiplier)
            return with_joint(tree, at, replace(joint, mimic=rule))
    return tree


def rounded(tree: KinematicTree, digits: int = 4) -> KinematicTree:
    """Rotations and places as a file of so many digits has them."""
    rows = []
    for joint, parent, child in branches(tree):
        T = np.eye(4)
        T[:3, :3] = rotation_from_rpy(np.round(rpy_of(joint.T_parent_joint[:3, :3]), digits))
        T[:3, 3] = np.round(joint.T_parent_joint[:3, 3], digits)
        rows.append((replace(joint, T_parent_joint=T), parent, child))
    return build_tree(tree.name, tree.links[0], rows)


def bounded(tree: KinematicTree) -> KinematicTree:
    """With limits that a URDF can hold."""
    rows = []
    for joint, parent, child in branches(tree):
        limit = joint.limit or Limit(-1.0, 1.0, 1.0, 1.0)
        ends = limit.lower, limit.upper
        ends = ends if np.isfinite(ends).all() else (-1.0, 1.0)
        finite = [x if np.isfinite(x) else 1.0 for x in (limit.velocity, limit.effort)]
        limited = replace(joint, limit=Limit(*ends, *finite))
        held = joint.kind in (JointKind.REVOLUTE, JointKind.PRISMATIC)
        rows.append((limited if held else joint, parent, child))
    return build_tree(tree.name, tree.links[0], rows)


def everything(tree: KinematicTree) -> KinematicTree:
    """Five of them, one after the other."""
    changes: list[Change] = [merged, split, flipped, shifted, on_a_stand]
    return reduce(lambda changed, change: change(changed), changes, tree)


def disguised(tree: KinematicTree, seed: int = 0) -> KinematicTree:
    """Random senses, zeros and names, on a stand, each moving joint split."""
    rng = np.random.default_rng(seed)
    with_axis = [joint for joint in tree.joints if joint.kind.has_axis]
    tree = with_axes_reversed(tree, {joint.name for joint in with_axis if rng.random() < 0.5})
    turns = (0.5 * np.pi, np.pi, -0.5 * np.pi)
    off = {
        joint.name: float(rng.choice([*turns, rng.uniform(-3.0, 3.0)]) * (1.0 if joint.kind.turns else 0.05))
        for joint in with_axis
        if rng.random() < 0.6
    }
    tree = on_a_stand(split(with_zeros_moved(tree, off)))
    joints = {joint.name: f"j{k:03d}" for joint, k in zip(tree.joints, rng.permutation(1000), strict=False)}
    links = {link: f"part{k}" for link, k in zip(tree.links, rng.permutation(1000), strict=False)}
    return with_names(tree, joints, links)


#: Changes that leave a robot the same.
ALIKE: dict[str, Change] = {
    "base moved": on_a_stand, "links split": split, "links merged": merged, "axes flipped": flipped,
    "zeros shifted": shifted, "all renamed": renamed, "other way up": rerooted,
    "counted elsewhere": counted_elsewhere, "slides exchanged": exchanged, "all of it": everything,
    "all of it, no name left": disguised,
}  # fmt: skip
#: Changes that do not; a file rounded to four digits may be what it was.
UNLIKE: dict[str, Change] = {
    **{f"tilted by {a:g}": partial(tilted, angle=a) for a in (1e-9, 1e-7, 1e-5, 1e-3, 1e-2)},
    **{f"moved by {x:g}": partial(lengthened, metres=x) for x in (1e-9, 1e-4)},
    "axis bent": partial(bent_axis, angle=1e-3),
    "other rule": with_another_rule,
    "rounded": rounded,
}


@cache
def robot(name: str) -> Robot:
    """A robot of the catalogue, unverified, with limits that a URDF can hold."""
    return loaded(bounded(loaded(name).tree))


def changed(name: str, what: str) -> Robot | None:
    """The robot after a change by its name; None where there is nothing to change."""
    change = (ALIKE | UNLIKE)[what]
    if what in UNLIKE and not moving(robot(name).tree):
        return None
    tree = change(robot(name).tree)
    return None if tree is robot(name).tree else loaded(tree)
