"""The oracle MuJoCo.

MuJoCo reads the origins and axes of joints from the URDF text with its own parser. Unlike urdfkin and
Pinocchio, MuJoCo computes with unit quaternions, and MuJoCo's six-vectors refer to a centre of mass. This
module changes the text before MuJoCo reads it:

- Each link becomes a body without meshes. In the compiled model, only the root has a mass.
  The centre of mass, to which MuJoCo's results refer, is therefore the root's origin.
- Links and joints get numbers as names, because MuJoCo reserves some names.
- A floating joint becomes three slide joints and a ball joint, because MuJoCo's free joint can only connect a
  body to the world. A planar joint becomes two slide joints and a hinge.
- Mimic rules are removed. MuJoCo would convert mimic rules to constraints, and MuJoCo's kinematics ignores
  constraints. This module computes the values of mimic joints with the rules from `parse_mimic_rules`.

MuJoCo's inputs are qpos(q), qvel = S v and qacc = S a + S' v, with the time derivative S' of S. The robot's
Jacobian is J S, where J is MuJoCo's Jacobian. The matrix S contains the multipliers of mimic joints. For a
floating or planar joint, urdfkin's linear velocity is in the axes of the child link. The velocities of
MuJoCo's slide joints are in the axes of the joint frame. S therefore also contains the rotation from the
child's axes to the joint frame's axes. The angular velocities are equal.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, assert_never
from xml.etree.ElementTree import Element, SubElement, tostring
from xml.parsers.expat import ExpatError

import numpy as np

from urdfkin.errors import OracleError
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, KinematicTree, Mimic
from urdfkin.system.plain_xml import parse_xml
from urdfkin.urdf.mujoco import compile_spec, import_mujoco
from urdfkin.verify.oracle import (
    WORLD,
    Frames,
    Oracle,
    QueryBatch,
    find_locked_values,
    nearest_quaternion,
    read_mimic_rules,
)
from urdfkin.verify.pinocchio import tree_depth

#: Placeholder for masses (kg) and moments of inertia (kg m^2).
_MASS = "1"
#: Maximum number of joints on a path. MuJoCo's loading time grows with the square of the number of links.
#: MuJoCo rejects a chain of more than 1,023 links only after loading the chain.
_MAX_DEPTH = 1_000
#: MuJoCo's joints for a planar or floating joint, in coordinate order.
_REPLACEMENT_JOINTS = {
    "planar": ("slide x", "slide y", "hinge"),
    "floating": ("slide x", "slide y", "slide z", "ball"),
}
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
#: Pairs (nq, nv). Kinds without an entry have (1, 1).
_JOINT_SIZES = {"fixed": (0, 0), "planar": (3, 3), "floating": (7, 6)}


@dataclass(frozen=True, slots=True)
class _Joint:
    name: str
    kind: str
    parent: str
    child: str
    element: Element | None = None


@dataclass(frozen=True, slots=True)
class _MujocoIndices:
    """First indices of a moving joint. A mimic joint has the `q` and `v` of the mimicked joint."""

    kind: str
    qpos: int
    qvel: int
    q: int  # -1 for a moving base.
    v: int  # -1 for a moving base or a locked joint.
    multiplier: float  # Multiplier of the mimic rule; 1 without a mimic rule, 0 for a locked joint.
    offset: float  # Offset of the mimic rule, or the value of a locked joint.


class MujocoOracle(Oracle):
    title = "MuJoCo"

    def __init__(self, text: str, tree: KinematicTree, **how: Any) -> None:
        super().__init__(text, tree, **how)
        self._mujoco, self.nv = import_mujoco(), tree.nv
        if (depth := tree_depth(tree)) > _MAX_DEPTH:
            raise OracleError(
                f"MuJoCo checks chains of up to {_MAX_DEPTH:,} links",
                where=tree.name,
                found=f"{depth:,}",
            )
        try:
            joints, links = _read_joints(text, self.root_joint)
        except (ValueError, KeyError, ExpatError) as error:
            raise OracleError("the oracle cannot read the text", where=tree.name, found=str(error)) from error
        moving = [joint.name for joint in joints if joint.kind != "fixed"]
        lock_mimic_joints = read_mimic_rules(text, moving, tree.name) if self.mimic else {}
        locked = find_locked_values(self.lock, lock_mimic_joints)  # Locked joints stay in MuJoCo's model.
        rules = self.read_and_check_rules([name for name in moving if name not in locked])
        base = [_Joint("", "floating", "", links[0])] if self.moving_base else []
        self._bodies = {link: f"l{i}" for i, link in enumerate([*([""] if base else []), *links])}
        self._model = self._compile_model([*base, *joints], links[0])
        self._indices = list(self._find_joint_indices([*base, *joints], rules, locked))
        bodies = {link: self._model.body(self._bodies[link]).id for link in links}
        children = {joint.name: bodies[joint.child] for joint in joints}
        self._frames = Frames(self.title, tree.name, bodies, children, {})
        self._constant = all(joint.kind not in _REPLACEMENT_JOINTS for joint in self._indices)
        self.new_data = lambda: self._mujoco.MjData(self._model)

    # -- the model -----------------------------------------------------------------------------------

    def _compile_model(self, joints: Sequence[_Joint], root: str) -> Any:
        mujoco = self._mujoco
        robot = Element("robot", name="r")
        options = {"fusestatic": "false", "boundmass": "0", "boundinertia": "0"}
        SubElement(SubElement(robot, "mujoco"), "compiler", options)
        for name in self._bodies.values():
            inertial = SubElement(SubElement(robot, "link", name=name), "inertial")
            SubElement(inertial, "mass", value=_MASS)
            moments = {f"i{a}{b}": _MASS if a == b else "0" for a, b in ("xx", "xy", "xz", "yy", "yz", "zz")}
            SubElement(inertial, "inertia", moments)
        for i, joint in enumerate(joints):
            robot.append(self._make_joint_element(i, joint))
        try:
            spec = mujoco.MjSpec.from_string(tostring(robot, encoding="unicode"))
            spec.option.gravity = (0.0, 0.0, 0.0)
            for i, joint in enumerate(joints):
                for part in _REPLACEMENT_JOINTS.get(joint.kind, ()):
                    joint_type, _, axis = part.partition(" ")
                    kind = getattr(mujoco.mjtJoint, f"mjJNT_{joint_type.upper()}")
                    body = spec.body(self._bodies[joint.child])
                    body.add_joint(name=f"j{i} {part}", type=kind, axis=_AXES[axis or "z"])
            return _move_mass_to_root(compile_spec(spec), self._bodies[root])
        except (ValueError, RuntimeError, mujoco.FatalError) as error:
            message = str(error).strip().replace("\n", "; ")
            raise OracleError(
                "MuJoCo does not accept this robot", where=self.tree.name, found=message
            ) from error

    def _make_joint_element(self, i: int, joint: _Joint) -> Element:
        kind = "fixed" if joint.kind in _REPLACEMENT_JOINTS else joint.kind
        element = Element("joint", name=f"j{i}", type="continuous" if kind == "revolute" else kind)
        SubElement(element, "parent", link=self._bodies[joint.parent])
        SubElement(element, "child", link=self._bodies[joint.child])
        for tag, names in (("origin", ("xyz", "rpy")), ("axis", ("xyz",))):
            source = None if joint.element is None else joint.element.find(tag)
            if source is not None and source.get("quat_xyzw") is not None:
                raise OracleError("MuJoCo does not read the attribute quat_xyzw", where=f"joint {joint.name}")
            if source is not None and (tag == "origin" or kind != "fixed"):
                SubElement(element, tag, {name: x for name in names if (x := source.get(name)) is not None})
        # MuJoCo requires limits of a prismatic joint, but MuJoCo's kinematics ignores the limits.
        if kind == "prismatic":
            SubElement(element, "limit", lower="-1", upper="1")
        return element

    def _find_joint_indices(
        self, joints: Sequence[_Joint], rules: Mapping[str, Mimic], locked: Mapping[str, float]
    ) -> Iterator[_MujocoIndices]:
        independent_joints, q, v = dict[str, tuple[int, int]](), 0, 0
        for joint in joints:
            if joint.name and joint.name not in rules and joint.name not in locked:
                nq, nv = _JOINT_SIZES.get(joint.kind, (1, 1))
                independent_joints[joint.name] = q, v
                q, v = q + nq, v + nv
        for i, joint in enumerate(joints):
            if joint.kind == "fixed":
                continue
            first = _REPLACEMENT_JOINTS.get(joint.kind, ("",))[0]
            compiled_joint = self._model.joint(f"j{i} {first}" if first else f"j{i}")
            indices = int(compiled_joint.qposadr[0]), int(compiled_joint.dofadr[0])
            if joint.name in locked:
                yield _MujocoIndices(joint.kind, *indices, 0, -1, 0.0, locked[joint.name])
                continue
            rule = rules.get(joint.name, Mimic(joint.name, 1.0, 0.0))
            if joint.name and rule.mimicked_joint not in independent_joints:
                raise OracleError(
                    "the mimicked joint does not exist",
                    where=f"joint {joint.name}",
                    found=rule.mimicked_joint,
                )
            ours = independent_joints.get(rule.mimicked_joint, (-1, -1))
            yield _MujocoIndices(joint.kind, *indices, *ours, rule.multiplier, rule.offset)

    # -- quantities ----------------------------------------------------------------------------------

    def placements(self, x: QueryBatch) -> FloatArray:
        return self._compute_poses(x, 1, lambda body, at: None)

    def velocities(self, x: QueryBatch) -> FloatArray:
        poses, velocity, _ = self._compute_motion(x, 2)
        return _change_reference(x.reference, poses, velocity)

    def accelerations(self, x: QueryBatch) -> FloatArray:
        poses, velocity, acceleration = self._compute_motion(x, 3)
        if not Reference.of(x.reference).at_world:
            return _change_reference(x.reference, poses, acceleration)
        # `_change_reference` can shift only spatial accelerations to the world origin.
        spatial = acceleration.copy()
        spatial[..., :3] -= np.cross(velocity[..., 3:], velocity[..., :3])
        out, velocity = (
            _change_reference(x.reference, poses, spatial),
            _change_reference(x.reference, poses, velocity),
        )
        out[..., :3] += np.cross(velocity[..., 3:], velocity[..., :3])
        return out

    def jacobians(self, x: QueryBatch) -> FloatArray:
        J = np.empty((len(x.q), len(x.frames), 6, self.nv))
        S_all = self._compute_velocity_matrix(x.q)

        def store(body: int, index: tuple[int, int]) -> None:
            J[index] = self._read_jacobian(self._mujoco.mj_jac, body) @ S_all[index[0] % len(S_all)]

        poses = self._compute_poses(x, 1, store)
        return _change_reference(x.reference, poses, J, columns=True)

    def jacobian_rates(self, x: QueryBatch) -> FloatArray:
        J, rate = np.empty((2, len(x.q), len(x.frames), 6, self.nv))
        velocity = np.empty((len(x.q), len(x.frames), 6))
        S_all = self._compute_velocity_matrix(x.q)
        S_rate_all = self._compute_velocity_matrix_rate(x.q, x.v)

        def store(body: int, index: tuple[int, int]) -> None:
            k = index[0]
            S, S_rate = S_all[k % len(S_all)], S_rate_all[k % len(S_rate_all)]
            J_full = self._read_jacobian(self._mujoco.mj_jac, body)
            J[index] = J_full @ S
            rate[index] = self._read_jacobian(self._mujoco.mj_jacDot, body) @ S + J_full @ S_rate
            velocity[index] = self._read_six_vector(self._mujoco.mj_objectVelocity, body)

        poses = self._compute_poses(x, 2, store)
        vel, w = velocity[..., None, :3], velocity[..., None, 3:]
        reference = Reference.of(x.reference)
        if reference.own_axes:  # In rotating axes, the derivative of J has the additional term -w x J.
            for rows in (slice(0, 3), slice(3, 6)):
                rate[..., rows, :] -= np.cross(w, J[..., rows, :].swapaxes(-1, -2)).swapaxes(-1, -2)
        out = _change_reference(reference, poses, rate, columns=True)
        if reference.at_world:  # The derivative of p x J_angular contains vel x J_angular.
            out[..., :3, :] += np.cross(vel, J[..., 3:, :].swapaxes(-1, -2)).swapaxes(-1, -2)
        return out

    def _compute_motion(self, x: QueryBatch, input_count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        velocity, acceleration = np.empty((2, len(x.q), len(x.frames), 6))

        def store(body: int, index: tuple[int, int]) -> None:
            velocity[index] = self._read_six_vector(self._mujoco.mj_objectVelocity, body)
            if input_count == len("qva"):
                acceleration[index] = self._read_six_vector(self._mujoco.mj_objectAcceleration, body)

        return self._compute_poses(x, input_count, store), velocity, acceleration

    def _compute_poses(
        self, x: QueryBatch, input_count: int, store: Callable[[int, tuple[int, int]], None]
    ) -> FloatArray:
        """Return all placements, and call `store(body, (k, f))` for each sample k and frame f.

        MuJoCo receives the first `input_count` of q, v and a.
        """
        mujoco, model, data = self._mujoco, self._model, self.data
        bodies = [self._frames.find_index(name) for name in x.frames]
        out = np.zeros((len(x.q), len(bodies), 4, 4))
        out[..., 3, 3] = 1.0
        qpos, qvel, qacc = self._convert_inputs(x, input_count)
        for k in range(len(x.q)):
            data.qpos[:] = qpos[k]
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            if qvel is not None:
                data.qvel[:] = qvel[k]
                mujoco.mj_comVel(model, data)
            if qacc is not None:
                data.qacc[:] = qacc[k]
                mujoco.mj_rnePostConstraint(model, data)
            for f, body in enumerate(bodies):
                out[k, f, :3, :3], out[k, f, :3, 3] = data.xmat[body].reshape(3, 3), data.xpos[body]
                store(body, (k, f))
        return out

    def _read_jacobian(self, function: Callable[..., None], body: int) -> FloatArray:
        J = np.zeros((6, self._model.nv))
        linear, angular = np.zeros((3, self._model.nv)), np.zeros((3, self._model.nv))
        function(self._model, self.data, linear, angular, self.data.xpos[body], body)
        J[:3], J[3:] = linear, angular
        return J

    def _read_six_vector(self, function: Callable[..., None], body: int) -> FloatArray:
        """Read a velocity or classical acceleration [linear; angular] in world axes."""
        six = np.empty(6)
        # MuJoCo returns [angular; linear].
        function(self._model, self.data, self._mujoco.mjtObj.mjOBJ_XBODY, body, six, 0)
        return np.roll(six, 3)

    # -- layout --------------------------------------------------------------------------------------

    def _convert_inputs(
        self, x: QueryBatch, input_count: int
    ) -> tuple[FloatArray, FloatArray | None, FloatArray | None]:
        q, base, n = x.q, x.base, len(x.q)
        qpos = np.zeros((n, self._model.nq))
        for joint in self._indices:
            at, coordinates = joint.qpos, q[:, joint.q : joint.q + 7]
            if joint.q < 0:
                T = np.eye(4) if base is None else np.asarray(base.placement)
                qpos[:, at : at + 3] = T[..., :3, 3]
                qpos[:, at + 3 : at + 7] = _move_scalar_first(nearest_quaternion(T[..., :3, :3]))
            elif joint.kind == "floating":
                qpos[:, at : at + 3] = coordinates[:, :3]
                qpos[:, at + 3 : at + 7] = _normalise_quaternion(coordinates)
            elif joint.kind == "planar":
                qpos[:, at : at + 3] = coordinates[:, :3]
            elif joint.v < 0:
                qpos[:, at] = joint.offset
            else:
                qpos[:, at] = joint.multiplier * coordinates[:, 0] + joint.offset
        if input_count == 1:
            return qpos, None, None
        S, v = self._compute_velocity_matrix(q), x.v
        qvel = (S @ v[..., None])[..., 0]
        qacc = None
        if input_count == len("qva"):
            qacc = (S @ x.a[..., None] + self._compute_velocity_matrix_rate(q, v) @ v[..., None])[..., 0]
        qvel = np.array(np.broadcast_to(qvel, (n, self._model.nv)))
        if self.moving_base and base is not None:
            # The slide joints' velocity is in world axes; the ball joint's velocity is in the base's axes.
            at, back = self._indices[0].qvel, np.swapaxes(_make_rotation_matrix(qpos[:, 3:7]), -1, -2)
            velocity, acceleration = np.asarray(base.velocity), np.asarray(base.acceleration)
            qvel[:, at : at + 3] = velocity[..., :3]
            qvel[:, at + 3 : at + 6] = (back @ velocity[..., 3:, None])[..., 0]
            if qacc is not None:
                qacc[:, at : at + 3] = acceleration[..., :3]
                qacc[:, at + 3 : at + 6] = (back @ acceleration[..., 3:, None])[..., 0]
        return qpos, qvel, qacc

    def _compute_velocity_matrix(self, q: FloatArray) -> FloatArray:
        """Return the matrix S that converts v to MuJoCo's qvel."""
        S = np.zeros((1 if self._constant else len(q), self._model.nv, self.nv))
        for joint in self._indices:
            at, v = joint.qvel, joint.v
            if v < 0:
                continue
            if joint.kind in _REPLACEMENT_JOINTS:
                R, slides = _compute_joint_rotations(joint, q)
                S[:, at : at + slides, v : v + slides] = R
                rotations = np.arange(slides, _JOINT_SIZES[joint.kind][1])
                S[:, at + rotations, v + rotations] = 1.0
            else:
                S[:, at, v] = joint.multiplier
        return S

    def _compute_velocity_matrix_rate(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Return the time derivative of S.

        The rotation R of a floating or planar joint has the derivative R [w]x.
        """
        S_rate = np.zeros((1 if self._constant else len(q), self._model.nv, self.nv))
        for joint in self._indices:
            at, first = joint.qvel, joint.v
            if first >= 0 and joint.kind in _REPLACEMENT_JOINTS:
                R, slides = _compute_joint_rotations(joint, q)
                w = np.zeros((len(q), 3))
                w[:, (0 if slides == 3 else 2) :] = v[:, first + slides : first + _JOINT_SIZES[joint.kind][1]]
                w_cross = np.cross(w[:, None, :], np.eye(3)[None]).swapaxes(-1, -2)
                S_rate[:, at : at + slides, first : first + slides] = R @ w_cross[:, :slides, :slides]
        return S_rate


def _compute_joint_rotations(joint: _MujocoIndices, q: FloatArray) -> tuple[FloatArray, int]:
    """Return rotations (n, s, s) and the number s of slide joints.

    A planar joint has s = 2, and a floating joint has s = 3.
    """
    coordinates = q[:, joint.q : joint.q + 7]
    if joint.kind == "floating":
        return _make_rotation_matrix(_normalise_quaternion(coordinates)), 3
    c, s = np.cos(coordinates[:, 2]), np.sin(coordinates[:, 2])
    return np.stack((np.stack((c, -s), -1), np.stack((s, c), -1)), -2), 2


def _normalise_quaternion(coordinates: FloatArray) -> FloatArray:
    quaternion = coordinates[:, 3:]
    return _move_scalar_first(quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True))


def _move_mass_to_root(model: Any, root: str) -> Any:
    # If only the root has a mass, the model's centre of mass is exactly the root's origin.
    body = model.body(root).id
    for mass in (model.body_mass, model.body_subtreemass):
        mass[:] = 0.0
    model.body_mass[body] = 1.0
    while body:
        model.body_subtreemass[body] = 1.0
        body = int(model.body_parentid[body])
    model.body_subtreemass[0] = 1.0
    return model


def _read_joints(text: str, root_joint: str | None) -> tuple[list[_Joint], list[str]]:
    """Return the joints depth first, with siblings sorted by name, and the links root first."""
    robot = parse_xml(text)
    links = [element.get("name", "") for element in robot.iterfind("link")]
    children, child_links = dict[str, list[_Joint]](), set[str]()
    for element in robot.iterfind("joint"):
        parent, child = (element.find(tag) for tag in ("parent", "child"))
        if parent is None or child is None:
            raise ValueError(f"joint {element.get('name')} has no parent or child link")
        names = (
            element.get("name", ""),
            element.get("type", ""),
            parent.get("link", ""),
            child.get("link", ""),
        )
        joint = _Joint(*names, element)
        children.setdefault(joint.parent, []).append(joint)
        child_links.add(joint.child)
    root = next(link for link in links if link not in child_links)
    if root_joint is not None:
        children[WORLD] = [_Joint("root_joint", root_joint, WORLD, root)]
        root = WORLD

    def find_child_joints(link: str) -> list[_Joint]:
        return sorted(children.get(link, []), key=lambda joint: joint.name.encode(), reverse=True)

    joints, stack = list[_Joint](), find_child_joints(root)
    while stack:
        joints.append(stack.pop())
        stack += find_child_joints(joints[-1].child)
    return joints, [root, *(joint.child for joint in joints)]


def _move_scalar_first(quaternion: FloatArray) -> FloatArray:
    return np.roll(quaternion, 1, axis=-1)


def _make_rotation_matrix(quaternion: FloatArray) -> FloatArray:
    w, x, y, z = np.moveaxis(np.asarray(quaternion), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, -1) for row in rows], -2)


def _change_reference(
    reference: Reference | str, poses: FloatArray, values: FloatArray, *, columns: bool = False
) -> FloatArray:
    """Convert values from LOCAL_WORLD_ALIGNED to another reference frame."""
    six = values if columns else values[..., None]
    linear, angular = six[..., :3, :], six[..., 3:, :]
    match Reference.of(reference):
        case Reference.LOCAL_WORLD_ALIGNED:
            return values
        case Reference.LOCAL:
            back = poses[..., :3, :3].swapaxes(-1, -2)
            out = np.concatenate((back @ linear, back @ angular), axis=-2)
        case Reference.WORLD:
            p = poses[..., None, :3, 3]
            moved = linear + np.cross(p, angular.swapaxes(-1, -2)).swapaxes(-1, -2)
            out = np.concatenate((moved, angular), axis=-2)
        case other:
            assert_never(other)
    return out if columns else out[..., 0]
