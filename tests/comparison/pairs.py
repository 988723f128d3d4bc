"""Changes of a robot; for each change it is known whether the changed robot is still the same robot."""

import json
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from functools import cache, partial, reduce
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tests import urdfs
from urdfkin.comparison.certificate import certificate, recheck
from urdfkin.comparison.result import Sameness
from urdfkin.kinematics.rotation import exp_rotation, rotation_from_rpy, rpy_of
from urdfkin.model.mechanisms.mechanism import Mechanism
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, Mimic, build_tree, inverse
from urdfkin.robot import Robot

#: Load a robot or a tree, unverified.
loaded = partial(urdfs.loaded, verify=False)
Change = Callable[[KinematicTree], KinematicTree]
Branch = tuple[Joint, str, str]


def written(found: Sameness) -> Any:
    """Return the certificate of a comparison, after it was written as JSON and read."""
    return json.loads(json.dumps(certificate(found)))


def files_of(folder: Path, *texts: str) -> list[str]:
    """Write each URDF to a file, and return the paths of the files."""
    files = [folder / f"model_{number}.urdf" for number in range(len(texts))]
    for file, text in zip(files, texts, strict=True):
        file.write_text(text)
    return [str(file) for file in files]


def certified(found: Sameness, a: Robot, b: Robot) -> bool:
    """Return whether the certificate of a comparison holds, after it was written and read."""
    return recheck(written(found), a, b) == []


def moves_alike(found: Sameness, a: Robot, b: Robot, tolerance: float = 1e-12) -> bool:
    """Return whether matched links have the predicted poses at random configurations."""
    tools = {(tool.a, tool.b): tool.pose for tool in found.tools}
    q = a.sample(5, 1)
    poses = []
    for k, (robot, values) in enumerate(((a, q), (b, found.to_b(q)))):
        base = found.base_links[k]
        T = robot.placement(values, [f"link:{name}" for name in (base, *(pair[k] for pair in found.links))])
        home = Mechanism(robot.tree).zero_poses[robot.tree.link_index(base)]
        poses.append(home @ np.linalg.inv(T[:, :1]) @ T[:, 1:])
    T_a = poses[0] @ np.array([tools.get(pair, np.eye(4)) for pair in found.links])
    return bool(np.abs(T_a - found.base @ poses[1]).max() <= tolerance)


def branches(tree: KinematicTree) -> list[Branch]:
    """Return each joint with the names of its parent link and its child link."""
    return [(joint, tree.links[joint.parent], tree.links[i + 1]) for i, joint in enumerate(tree.joints)]


def rebuilt(tree: KinematicTree, rows: Iterable[Branch]) -> KinematicTree:
    return build_tree(tree.name, tree.links[0], list(rows))


def with_joints(tree: KinematicTree, change: Callable[[Joint], Joint]) -> KinematicTree:
    return rebuilt(tree, [(change(joint), parent, child) for joint, parent, child in branches(tree)])


def pose(vector: ArrayLike, shift: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
    """Return the pose with a rotation vector and a position."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = exp_rotation(vector), shift
    return T


def fixed(name: str, T: FloatArray) -> Joint:
    return Joint(name, JointKind.FIXED, 0, T, np.array([1.0, 0.0, 0.0]))


def on_a_stand(tree: KinematicTree) -> KinematicTree:
    """Fix the root to a new root."""
    stand = fixed("stand_joint", pose([0.3, -0.2, 0.9], [0.5, -1.0, 0.25]))
    return build_tree(tree.name, "stand", [*branches(tree), (stand, "stand", tree.links[0])])


def split(tree: KinematicTree) -> KinematicTree:
    """Insert a fixed link before each moving joint."""
    rows: list[Branch] = []
    for joint, parent, child in branches(tree):
        if not joint.kind.nv:
            rows.append((joint, parent, child))
            continue
        T, between = pose([0.4, 0.1, -0.7], [0.01, -0.02, 0.03]), f"{child}_mount"
        rows.append((fixed(f"{joint.name}_mount", joint.T_parent_joint @ T), parent, between))
        rows.append((replace(joint, T_parent_joint=inverse(T)), between, child))
    return rebuilt(tree, rows)


def merged(tree: KinematicTree) -> KinematicTree:
    """Remove links that are attached by fixed joints; their child joints move to the parent link."""
    carrier: list[tuple[str, FloatArray]] = [(tree.links[0], np.eye(4))]
    rows: list[Branch] = []
    for i, joint in enumerate(tree.joints):
        link, T = carrier[joint.parent]
        T = T @ joint.T_parent_joint
        if joint.kind.nv:
            rows.append((replace(joint, T_parent_joint=T), link, tree.links[i + 1]))
            link, T = tree.links[i + 1], np.eye(4)
        carrier.append((link, T))
    return rebuilt(tree, rows)


def flipped(tree: KinematicTree) -> KinematicTree:
    return with_axes_reversed(tree, {joint.name for joint in tree.joints[1::2] if joint.kind.has_axis})


def with_axes_reversed(tree: KinematicTree, names: Collection[str]) -> KinematicTree:
    """Reverse the axes of some joints, so that their values change sign."""

    def change(joint: Joint) -> Joint:
        if joint.mimic is not None:
            own, mimicked_joint = (
                -1.0 if name in names else 1.0 for name in (joint.name, joint.mimic.mimicked_joint)
            )
            rule = Mimic(
                joint.mimic.mimicked_joint,
                own * mimicked_joint * joint.mimic.multiplier,
                own * joint.mimic.offset,
            )
            joint = replace(joint, mimic=rule)
        if joint.name not in names:
            return joint
        limit = joint.limit and replace(joint.limit, lower=-joint.limit.upper, upper=-joint.limit.lower)
        return replace(joint, axis=-joint.axis, limit=limit)

    return with_joints(tree, change)


def shifted(tree: KinematicTree) -> KinematicTree:
    """Move every other joint's zero by 0.7 rad or 0.07 m."""
    some = [joint for joint in tree.joints[::2] if joint.kind.has_axis]
    return with_zeros_moved(tree, {joint.name: 0.7 if joint.kind.turns else 0.07 for joint in some})


def with_zeros_moved(tree: KinematicTree, offsets: Mapping[str, float]) -> KinematicTree:
    """Move the zeros of some joints, so that their values increase by the offsets."""

    def change(joint: Joint) -> Joint:
        if joint.mimic is not None:
            rule = joint.mimic
            more = offsets.get(joint.name, 0.0) - rule.multiplier * offsets.get(rule.mimicked_joint, 0.0)
            joint = replace(joint, mimic=replace(rule, offset=rule.offset + more))
        if joint.name not in offsets:
            return joint
        o, limit = offsets[joint.name], joint.limit
        back = pose(-o * joint.axis) if joint.kind.turns else pose([0.0] * 3, -o * joint.axis)
        limit = limit and replace(limit, lower=limit.lower + o, upper=limit.upper + o)
        return replace(joint, T_parent_joint=joint.T_parent_joint @ back, limit=limit)

    return with_joints(tree, change)


def renamed(tree: KinematicTree) -> KinematicTree:
    """Rename all joints and links, which also changes the order of siblings and of coordinates."""
    joints = {joint.name: f"j{len(tree.joints) - i:03d}" for i, joint in enumerate(tree.joints)}
    return with_names(tree, joints, {link: f"part{i}" for i, link in enumerate(tree.links)})


def with_names(tree: KinematicTree, joints: Mapping[str, str], links: Mapping[str, str]) -> KinematicTree:
    rows = []
    for joint, parent, child in branches(tree):
        rule = joint.mimic and replace(joint.mimic, mimicked_joint=joints[joint.mimic.mimicked_joint])
        rows.append((replace(joint, name=joints[joint.name], mimic=rule), links[parent], links[child]))
    return build_tree(tree.name, links[tree.links[0]], rows)


def rerooted(tree: KinematicTree) -> KinematicTree:
    """Make the leaf with the most joints before it the root, and reverse the joints on its path."""
    leaf = max(tree.leaves(), key=lambda link: len(tree.path(link)))
    path = tree.path(leaf)
    rows: list[Branch] = []
    # A link of the path has the frame of the joint that is now its parent joint.
    frames = {tree.joints[i].parent: inverse(tree.joints[i].T_parent_joint) for i in path}
    names = {link: f"{tree.links[link]}_body" for link in frames}
    names[leaf] = tree.links[leaf]
    for i, joint in enumerate(tree.joints):
        parent, child = joint.parent, i + 1
        T = frames.get(parent, np.eye(4)) @ joint.T_parent_joint
        if i in path:  # the reversed joint turns about the reversed axis
            back = replace(joint, axis=-joint.axis, T_parent_joint=frames.get(child, np.eye(4)))
            rows.append((back, names[child], names[parent]))
        else:
            carrier = names.get(parent, tree.links[parent])
            rows.append((replace(joint, T_parent_joint=T), carrier, tree.links[child]))
    rows += [(fixed(f"{tree.links[k]}_seen", T), names[k], tree.links[k]) for k, T in frames.items()]
    return build_tree(tree.name, names[leaf], rows)


def counted_elsewhere(tree: KinematicTree) -> KinematicTree:
    """Change the frames before and after each planar and floating joint."""
    rows: list[Branch] = []
    over, lift = np.diag([1.0, -1.0, -1.0, 1.0]), pose([0.0] * 3, [0.0, 0.0, 0.2])
    for joint, parent, child in branches(tree):
        if joint.kind not in (JointKind.PLANAR, JointKind.FLOATING):
            rows.append((joint, parent, child))
            continue
        C, D = pose([0.3, 0.5, -0.9], [0.4, 0.1, -0.2]), pose([-0.2, 0.8, 0.1], [0.0, 0.3, 0.1])
        if joint.kind is JointKind.PLANAR:  # lifted and turned over, and back
            C = pose([0.0, 0.0, 0.7], [0.4, 0.1, 0.0]) @ over @ lift
            D = inverse(lift) @ over @ pose([0.0, 0.0, -1.1], [-0.3, 0.2, 0.0])
        between = f"{child}_counted"
        rows.append((replace(joint, T_parent_joint=joint.T_parent_joint @ C), parent, between))
        rows.append((fixed(f"{joint.name}_counted", D), between, child))
    return rebuilt(tree, rows) if len(rows) > len(tree.joints) else tree


def exchanged(tree: KinematicTree) -> KinematicTree:
    """Exchange the first two neighbouring joints that commute; at least one of them is prismatic."""
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
        return rebuilt(tree, rows)
    return tree


def moving(tree: KinematicTree) -> list[int]:
    """Return the indices of the independent joints with an axis, on the path with the most velocities."""
    deepest = max(tree.leaves(), key=lambda link: sum(tree.joints[i].nv for i in tree.path(link)))
    return [i for i in tree.path(deepest) if tree.joints[i].kind.has_axis and tree.joints[i].nv]


def middle(tree: KinematicTree) -> tuple[int, Joint]:
    """Return the index of the middle joint of `moving`, and the joint."""
    chain = moving(tree)
    at = chain[len(chain) // 2]
    return at, tree.joints[at]


def with_joint(tree: KinematicTree, at: int, joint: Joint) -> KinematicTree:
    joints = (*tree.joints[:at], joint, *tree.joints[at + 1 :])
    return KinematicTree(tree.name, tree.links, joints)


def across(axis: FloatArray) -> FloatArray:
    """Return a unit vector perpendicular to an axis."""
    other = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.8 else [0.0, 1.0, 0.0])
    return np.asarray(other / np.linalg.norm(other))


def tilted(tree: KinematicTree, angle: float) -> KinematicTree:
    """Tilt the middle joint, with all links after it."""
    at, joint = middle(tree)
    T = joint.T_parent_joint @ pose(angle * across(joint.axis))
    return with_joint(tree, at, replace(joint, T_parent_joint=T))


def lengthened(tree: KinematicTree, metres: float) -> KinematicTree:
    """Shift the middle joint perpendicular to its axis, with all links after it."""
    at, joint = middle(tree)
    T = joint.T_parent_joint @ pose([0.0] * 3, metres * across(joint.axis))
    return with_joint(tree, at, replace(joint, T_parent_joint=T))


def bent_axis(tree: KinematicTree, angle: float) -> KinematicTree:
    """Tilt only the axis of the middle joint."""
    at, joint = middle(tree)
    return with_joint(tree, at, replace(joint, axis=exp_rotation(angle * across(joint.axis)) @ joint.axis))


def with_another_rule(tree: KinematicTree) -> KinematicTree:
    """Multiply the multiplier of the first mimic joint by 1.1; return the tree if there is none."""
    for at, joint in enumerate(tree.joints):
        if joint.mimic is not None:
            rule = replace(joint.mimic, multiplier=1.1 * joint.mimic.multiplier)
            return with_joint(tree, at, replace(joint, mimic=rule))
    return tree


def rounded(tree: KinematicTree, digits: int = 4) -> KinematicTree:
    """Round the angles and positions of all origins."""

    def change(joint: Joint) -> Joint:
        T = np.eye(4)
        T[:3, :3] = rotation_from_rpy(np.round(rpy_of(joint.T_parent_joint[:3, :3]), digits))
        T[:3, 3] = np.round(joint.T_parent_joint[:3, 3], digits)
        return replace(joint, T_parent_joint=T)

    return with_joints(tree, change)


def bounded(tree: KinematicTree) -> KinematicTree:
    """Give each revolute and prismatic joint limits that a URDF can contain."""

    def change(joint: Joint) -> Joint:
        if joint.kind not in (JointKind.REVOLUTE, JointKind.PRISMATIC):
            return joint
        limit = joint.limit or Limit(-1.0, 1.0, 1.0, 1.0)
        ends = limit.lower, limit.upper
        ends = ends if np.isfinite(ends).all() else (-1.0, 1.0)
        finite = [x if np.isfinite(x) else 1.0 for x in (limit.velocity, limit.effort)]
        return replace(joint, limit=Limit(*ends, *finite))

    return with_joints(tree, change)


def everything(tree: KinematicTree) -> KinematicTree:
    changes: list[Change] = [merged, split, flipped, shifted, on_a_stand]
    return reduce(lambda changed, change: change(changed), changes, tree)


def disguised(tree: KinematicTree, seed: int = 0) -> KinematicTree:
    """Apply random senses, zeros and names, a stand, and a fixed link before each moving joint."""
    rng = np.random.default_rng(seed)
    with_axis = [joint for joint in tree.joints if joint.kind.has_axis]
    tree = with_axes_reversed(tree, {joint.name for joint in with_axis if rng.random() < 0.5})
    turns = (0.5 * np.pi, np.pi, -0.5 * np.pi)
    offsets = {
        joint.name: float(rng.choice([*turns, rng.uniform(-3.0, 3.0)]) * (1.0 if joint.kind.turns else 0.05))
        for joint in with_axis
        if rng.random() < 0.6
    }
    tree = on_a_stand(split(with_zeros_moved(tree, offsets)))
    joints = {joint.name: f"j{k:03d}" for joint, k in zip(tree.joints, rng.permutation(1000), strict=False)}
    links = {link: f"part{k}" for link, k in zip(tree.links, rng.permutation(1000), strict=False)}
    return with_names(tree, joints, links)


#: Changes after which a robot is still the same robot.
ALIKE: dict[str, Change] = {
    "base moved": on_a_stand, "links split": split, "links merged": merged, "axes flipped": flipped,
    "zeros shifted": shifted, "all renamed": renamed, "other way up": rerooted,
    "counted elsewhere": counted_elsewhere, "slides exchanged": exchanged, "all of it": everything,
    "all of it, no name left": disguised,
}  # fmt: skip
#: Changes after which a robot differs; rounding to four digits may change nothing.
UNLIKE: dict[str, Change] = {
    **{f"tilted by {a:g}": partial(tilted, angle=a) for a in (1e-9, 1e-7, 1e-5, 1e-3, 1e-2)},
    **{f"moved by {x:g}": partial(lengthened, metres=x) for x in (1e-9, 1e-4)},
    "axis bent": partial(bent_axis, angle=1e-3),
    "other rule": with_another_rule,
    "rounded": rounded,
}


@cache
def robot(name: str) -> Robot:
    """Return a robot of the catalogue, unverified, with limits that a URDF can contain."""
    return loaded(bounded(loaded(name).tree))


def changed(name: str, what: str) -> Robot | None:
    """Return the robot after a change, or None if the change does not apply to the robot."""
    change = (ALIKE | UNLIKE)[what]
    if what in UNLIKE and not moving(robot(name).tree):
        return None
    tree = change(robot(name).tree)
    return None if tree is robot(name).tree else loaded(tree)
