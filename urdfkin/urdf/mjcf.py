"""MJCF to a kinematic tree, through MuJoCo's compiled model: a file's meaning with defaults and classes in.

A body's link is its frame. Its joints turn and slide one after the other, each about its anchor p_k in it:
F <- F Trans(p_k) J_k Trans(-p_k), so that a body of several joints is several joints and links here, the last
of them the body's own. A joint's reference value is put into its place, so that q is MuJoCo's qpos (but for a
free joint's quaternion, whose scalar is first there). Sites become links that are fixed.

What a tree cannot hold is listed, never dropped in silence.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from urdfkin.errors import InputError
from urdfkin.kinematics.rotation.axis_angle import rotation_about
from urdfkin.kinematics.rotation.quaternion import rotation_of
from urdfkin.model.pose import pose
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, Mimic, build_tree
from urdfkin.system.files import at_home, read_start
from urdfkin.urdf.mujoco import compiled, library

#: A sliding joint that the file does not bound: a URDF must say something. A kilometre either way.
UNBOUNDED = 1000.0
#: Nothing that matched is tried another way: a text with many comments takes no longer than it is long.
_ROOT = re.compile(r"(?>\s+|<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>]*+>)*+<mujoco[\s/>]", re.DOTALL)
_ENDINGS = (".xml", ".mjcf")
#: How much of a file is looked at to see what it is.
_HEAD = 65_536


@dataclass(frozen=True, slots=True)
class Listed:
    """Something that the tree does not hold, or holds in another way.

    Attributes:
        what: In one clause.
        where: Which element, or None for the file.
        moves: Whether motion depends on it.
    """

    what: str
    where: str | None = None
    moves: bool = False


@dataclass(frozen=True, slots=True)
class Mjcf:
    """A robot from an MJCF file.

    Attributes:
        tree: Its links and joints.
        model: MuJoCo's compiled model, without shapes.
        frames: Names of links, each with its body's or site's number in MuJoCo's model.
        coordinates: Names of the joints that move, each with its place in MuJoCo's qpos; followers too.
        listed: What the tree does not hold.
        is_text: Whether it was text, not a file.
    """

    tree: KinematicTree
    model: Any
    frames: dict[str, tuple[str, int]]
    coordinates: dict[str, int]
    listed: tuple[Listed, ...]
    is_text: bool

    def qpos(self, q: FloatArray) -> FloatArray:
        """(n, MuJoCo's nq) for (n, nq): followers stand where their leaders put them."""
        tree, full = self.tree, np.tile(self.model.qpos0, (len(q), 1))
        for joint, at in zip(tree.joints, tree.q_index, strict=True):
            if joint.name not in self.coordinates:
                continue
            to = self.coordinates[joint.name]
            if joint.kind is JointKind.FLOATING:
                unit = q[:, at + 3 : at + 7] / np.linalg.norm(q[:, at + 3 : at + 7], axis=1, keepdims=True)
                full[:, to : to + 3], full[:, to + 3 : to + 7] = q[:, at : at + 3], np.roll(unit, 1, axis=1)
            else:
                own = q[:, at]
                full[:, to] = (
                    own if joint.mimic is None else joint.mimic.multiplier * own + joint.mimic.offset
                )
        return full

    def placements(self, q: FloatArray) -> FloatArray:
        """(n, frames, 4, 4) of `frames`, by `mj_kinematics` on the file's own model."""
        mujoco = library()
        data = mujoco.MjData(self.model)
        out = np.zeros((len(q), len(self.frames), 4, 4))
        out[..., 3, 3] = 1.0
        for k, qpos in enumerate(self.qpos(q)):
            data.qpos[:] = qpos
            mujoco.mj_kinematics(self.model, data)
            for f, (kind, i) in enumerate(self.frames.values()):
                R, p = (
                    (data.xmat[i], data.xpos[i]) if kind == "body" else (data.site_xmat[i], data.site_xpos[i])
                )
                out[k, f, :3, :3], out[k, f, :3, 3] = R.reshape(3, 3), p
        return out


def is_mjcf(source: object) -> TypeGuard[str | bytes | os.PathLike[str]]:
    """Whether a source is MJCF: text, bytes, or a file ending in .xml or .mjcf, whose root is <mujoco>.

    >>> is_mjcf("<mujoco/>"), is_mjcf(b"<mujoco/>"), is_mjcf("<robot/>"), is_mjcf("panda")
    (True, True, False, False)
    """
    if isinstance(source, bytes):
        return _ROOT.match(source.decode("utf-8-sig", "replace")) is not None
    if _is_text(source):
        return _ROOT.match(str(source).lstrip("\ufeff")) is not None
    if not isinstance(source, str | os.PathLike) or Path(source).suffix.lower() not in _ENDINGS:
        return False
    try:
        head = read_start(at_home(source), _HEAD)
    except OSError:
        return False  # whoever reads it says so
    return _ROOT.match(head.decode("utf-8-sig", "replace")) is not None


def read_mjcf(source: str | bytes | os.PathLike[str]) -> Mjcf:
    """The robot of an MJCF file or text.

    Args:
        source: A path, or text, or its bytes; files that the file includes are read, meshes are not.

    Raises:
        InputError: MuJoCo is not installed, does not accept the file, or the robot has a ball joint.
    """
    mujoco = library()
    try:
        if isinstance(source, bytes):
            spec = mujoco.MjSpec.from_string(source.decode("utf-8-sig"))
        elif _is_text(source):
            spec = mujoco.MjSpec.from_string(str(source).lstrip("\ufeff"))
        else:
            spec = mujoco.MjSpec.from_file(str(at_home(source)))
        left = list(_stripped(mujoco, spec))
        model = compiled(spec)
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        found = str(error).strip().replace("\n", "; ")
        raise InputError("MuJoCo does not accept this MJCF", where=name_of(source), found=found) from None
    reader = _Reader(mujoco, model, spec.modelname or "robot", name_of(source))
    tree = reader.tree()
    text = isinstance(source, bytes) or _is_text(source)
    return Mjcf(tree, model, reader.frames, reader.coordinates, (*reader.listed, *left), text)


def name_of(source: str | bytes | os.PathLike[str]) -> str:
    """What to call a source in messages."""
    return "<bytes>" if isinstance(source, bytes) else "<text>" if _is_text(source) else str(source)


def _is_text(source: object) -> bool:
    return isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<")


def _stripped(mujoco: Any, spec: Any) -> Iterator[Listed]:
    """Take out what kinematics does not need, so that no mesh has to be there; say what it was."""
    spec.compiler.fusestatic = False
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    for i, one in enumerate(list(spec.equalities)):
        if one.type != mujoco.mjtEq.mjEQ_JOINT:
            kind, names = str(one.type).rpartition("_")[2].lower(), _joined(one.name1, one.name2)
            what = f"a constraint ({kind}{names and ' of '}{names}) that a tree cannot hold"
            yield Listed(what, f"equality {one.name or i}", moves=bool(one.active))
            spec.delete(one)
    gone = []
    for words in (
        "keys", "sensors", "actuators", "tendons", "excludes", "pairs", "skins", "flexes", "geoms", "cameras",
        "lights", "meshes", "hfields", "materials", "textures",
    ):  # fmt: skip
        found = list(getattr(spec, words, ()))
        for one in found:
            spec.delete(one)
        if found:
            gone.append(f"{len(found)} {words}")
            if words in ("tendons", "flexes"):
                yield Listed(f"{words} move nothing here", words, moves=True)
    if gone:
        yield Listed(f"left out, since kinematics does not use them: {', '.join(gone)}")
    for site in spec.sites:
        site.material = ""
    spec.memory = -1  # what the file has measured for its own dynamics
    for body in spec.bodies[1:]:
        body.explicitinertial, body.mass, body.ipos = True, 1.0, (0.0, 0.0, 0.0)
        body.inertia, body.iquat, body.fullinertia = (1.0,) * 3, (1.0, 0.0, 0.0, 0.0), (np.nan,) * 6


def _joined(*names: str) -> str:
    return " and ".join(name for name in names if name)


@dataclass(slots=True)
class _Reader:
    """Reads one compiled model; `source` is what it is called in messages."""

    mujoco: Any
    model: Any
    name: str
    source: str
    frames: dict[str, tuple[str, int]] = field(default_factory=dict)
    coordinates: dict[str, int] = field(default_factory=dict)
    listed: list[Listed] = field(default_factory=list)
    _joints: list[tuple[Joint, str, str]] = field(default_factory=list)
    _names: dict[str, set[str]] = field(default_factory=lambda: {"link": set(), "joint": set()})
    _links: list[str] = field(default_factory=list)
    _hinges: dict[int, str] = field(default_factory=dict)

    def tree(self) -> KinematicTree:
        """The links and joints."""
        m = self.model
        self._links = [self._new("link", m.body(i).name or f"body{i}") for i in range(m.nbody)]
        self._hinges = {i: self._new("joint", m.joint(i).name or f"joint{i}") for i in range(m.njnt)}
        for i in range(m.nbody):
            self.frames[self._links[i]] = "body", i
            if i:
                self._body(i)
        for i in range(m.nsite):
            if name := m.site(i).name:
                link = self._new("link", name)
                self.frames[link] = "site", i
                T = _pose(m.site_pos[i], m.site_quat[i])
                self._fix(T, self._links[m.site_bodyid[i]], link)
        rules = dict(self._rules())
        joints = [(replace(joint, mimic=rules.get(joint.name)), a, b) for joint, a, b in self._joints]
        return build_tree(self.name, self._links[0], joints)

    def _new(self, kind: str, name: str) -> str:
        """The name, or one like it where it is taken."""
        while name in self._names[kind]:
            name += "_"
        self._names[kind].add(name)
        return name

    def _fix(self, T: FloatArray, parent: str, child: str) -> None:
        name = self._new("joint", f"{child}_fixed")
        self._joints.append((Joint(name, JointKind.FIXED, 0, T, np.array([1.0, 0.0, 0.0])), parent, child))

    def _body(self, i: int) -> None:
        """A body's joints one after the other, then its own frame."""
        m, here = self.model, self._links[self.model.body_parentid[i]]
        T, link = _pose(m.body_pos[i], m.body_quat[i]), self._links[i]
        if m.body_mocapid[i] >= 0:
            self.listed.append(
                Listed("a mocap body stands where the file puts it", f"body {link}", moves=True)
            )
        first, count = int(m.body_jntadr[i]), int(m.body_jntnum[i])
        for j in range(first, first + count):
            anchor, name = pose(p=m.jnt_pos[j]), self._hinges[j]
            ends_here = j == first + count - 1 and not m.jnt_pos[j].any()
            child = link if ends_here else self._new("link", f"{name}_link")
            joint, back = self._joint(j, name, T @ anchor)
            self._joints.append((joint, here, child))
            self.coordinates[name] = int(m.jnt_qposadr[j])
            T, here = back, child
        if here != link:
            self._fix(T, here, link)

    def _joint(self, j: int, name: str, T: FloatArray) -> tuple[Joint, FloatArray]:
        """A joint that stands at T, and the way from its frame back to the body's."""
        m, kinds = self.model, self.mujoco.mjtJoint
        kind, axis, back = m.jnt_type[j], m.jnt_axis[j], pose(p=-m.jnt_pos[j])
        if kind == kinds.mjJNT_BALL:
            raise InputError(
                "a ball joint cannot be held: urdfkin has no joint for it yet",
                where=f"{self.source}: joint {name}",
                remedy="three hinges in one body turn likewise, but where the middle one is at a right angle",
            )
        at = int(m.jnt_qposadr[j])
        if kind == kinds.mjJNT_FREE:
            place = ", ".join(f"{x:g}" for x in m.qpos0[at : at + 3])
            if m.qpos0[at : at + 3].any() or m.qpos0[at + 3] != 1.0:
                said = f"qpos0 places it at ({place}); the neutral configuration has it at the origin"
                self.listed.append(Listed(said, f"joint {name}"))
            return Joint(name, JointKind.FLOATING, 0, np.eye(4), np.array([1.0, 0.0, 0.0])), np.eye(4)
        zero, turns = float(m.qpos0[at]), kind == kinds.mjJNT_HINGE
        if zero:
            T = T @ (pose(rotation_about(axis, -zero)) if turns else pose(p=-zero * axis))
        held_as, limit = self._range(j, name, turns=turns)
        return Joint(name, held_as, 0, T, axis, limit), back

    def _range(self, j: int, name: str, *, turns: bool) -> tuple[JointKind, Limit | None]:
        """What kind of joint a URDF makes of it, and its limits."""
        m = self.model
        effort = float(m.jnt_actfrcrange[j].max()) if m.jnt_actfrclimited[j] else np.inf
        if m.jnt_limited[j]:
            lower, upper = map(float, m.jnt_range[j])
            kind = JointKind.REVOLUTE if turns else JointKind.PRISMATIC
            return kind, Limit(lower, upper, np.inf, effort)
        if turns:
            return JointKind.CONTINUOUS, None
        said = Listed(
            f"a slide without limits: a URDF must have some, {UNBOUNDED:g} m either way", f"joint {name}"
        )
        if said not in self.listed:
            self.listed.append(said)
        return JointKind.PRISMATIC, Limit(-UNBOUNDED, UNBOUNDED, np.inf, effort)

    def _rules(self) -> Iterator[tuple[str, Mimic]]:
        """Equalities between two joints that are y = m x + c: mimic rules. What they lead to is free."""
        m, rules = self.model, dict[str, Mimic]()
        for i in range(m.neq):
            where = f"equality {m.equality(i).name or i}"
            rule = self._rule(i)
            if not m.eq_active0[i]:
                self.listed.append(Listed("a constraint that is not active", where))
            elif rule is None:
                names = _joined(*(self._hinges[j] for j in (m.eq_obj1id[i], m.eq_obj2id[i]) if j >= 0))
                said = f"a constraint ({names}) that is no line between two joints"
                self.listed.append(Listed(said, where, moves=True))
            elif rule[0] in rules or _leads(rules, rule[1].leader, rule[0]):
                self.listed.append(
                    Listed(f"joint {rule[0]} is held twice, or in a circle", where, moves=True)
                )
            else:
                rules[rule[0]] = rule[1]
        for follower in rules:
            yield follower, _resolved(rules, follower)

    def _rule(self, i: int) -> tuple[str, Mimic] | None:
        """Of y - y0 = c0 + c1 (x - x0), with the reference values y0 and x0."""
        m = self.model
        y, x = int(m.eq_obj1id[i]), int(m.eq_obj2id[i])
        c = m.eq_data[i, :5]
        if x < 0 or c[2:].any():
            return None
        y0, x0 = (float(m.qpos0[m.jnt_qposadr[j]]) for j in (y, x))
        return self._hinges[y], Mimic(self._hinges[x], float(c[1]), float(y0 + c[0] - c[1] * x0))


def _leads(rules: dict[str, Mimic], joint: str, to: str) -> bool:
    """Whether following a joint's leaders ends at, or passes, another."""
    while joint in rules and joint != to:
        joint = rules[joint].leader
    return joint == to


def _resolved(rules: dict[str, Mimic], follower: str) -> Mimic:
    """Followed to the joint that moves by itself."""
    rule = rules[follower]
    while rule.leader in rules:
        end = rules[rule.leader]
        rule = Mimic(end.leader, rule.multiplier * end.multiplier, rule.multiplier * end.offset + rule.offset)
    return rule


def _pose(p: FloatArray, quaternion: FloatArray) -> FloatArray:
    return pose(rotation_of(np.roll(quaternion, -1) / np.linalg.norm(quaternion)), p)
