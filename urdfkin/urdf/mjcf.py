"""Convert an MJCF file to a kinematic tree.

MuJoCo compiles the file, which resolves defaults and classes. The tree is built from the compiled model:

- Each body becomes a link with the body's frame. Each site with a name also becomes a link; a fixed joint
  connects this link with the link of the site's body.
- MuJoCo applies the joints of a body in sequence. Joint k has the anchor p_k and the motion J_k. Joint k
  changes the pose F of the body to F Trans(p_k) J_k Trans(-p_k). Trans(p) is the translation by p. A body
  with several joints becomes a chain of joints and links. The last link of the chain is the body.
- A joint has the same value in urdfkin's q and in MuJoCo's qpos, because the joint origin includes MuJoCo's
  reference value (`ref`). Only quaternions differ: MuJoCo stores the scalar part first.

`Mjcf.remarks` names the parts of the file that a kinematic tree cannot represent, for example tendons.

MuJoCo can align the frame of a free body with the body's inertial frame (options `align` and `alignfree`).
The inertial frame depends on the shapes. With these options, MuJoCo therefore needs the meshes.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from urdfkin.errors import InputError
from urdfkin.kinematics.number_kinds import norm
from urdfkin.kinematics.rotation import rotation_about, rotation_from_quaternion
from urdfkin.model.tree import (
    MAX_PLAUSIBLE_ANGLE,
    FloatArray,
    Joint,
    JointKind,
    KinematicTree,
    Limit,
    Mimic,
    build_tree,
    pose,
)
from urdfkin.system.files import expand_home, read_start
from urdfkin.urdf.mujoco import compile_spec, import_mujoco

#: Limit (m) that replaces a missing limit of a prismatic joint, because URDF requires limits.
FALLBACK_PRISMATIC_LIMIT = 1000.0
#: The beginning of an MJCF text. Possessive quantifiers keep the matching time linear.
_ROOT_ELEMENT = re.compile(r"(?>\s+|<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>]*+>)*+<mujoco[\s/>]", re.DOTALL)
_SUFFIXES = (".xml", ".mjcf")
_SEARCHED_BYTES = 65_536


@dataclass(frozen=True, slots=True)
class MjcfRemark:
    """A part of the file that the tree omits or changes, or a probable mistake in the file.

    Attributes:
        where: The tag and the name of the element, or the tag alone; None for the whole file.
        moves: Whether the reported part of the file affects the motion of the links.
        remedy: None, unless the file probably contains a mistake.
    """

    what: str
    where: str | None = None
    moves: bool = False
    remedy: str | None = None


@dataclass(frozen=True, slots=True)
class Mjcf:
    """A robot from an MJCF file.

    Attributes:
        model: MuJoCo's compiled model, in which all bodies remain separate.
        fused_model: The model with fused static bodies. None if `with_shapes` is False or the file does not
            set `fusestatic`.
        frames: For each link, the word "body" or "site", and the index of this body or site in `model`.
        qpos_index: Index in MuJoCo's qpos of each moving joint, including mimic joints.
        mimic_equalities: Name of the mimic joint, by the index of the equality with the mimic rule.
        other_equalities: Indices of the active joint equalities that are not mimic rules of the tree.
        with_shapes: Whether `model` contains the shapes and inertias of the file.
        aligns_free_bodies: Whether MuJoCo aligns the frame of a free body with the body's inertial frame.
        joint_names: Names of all joints, in the order of the file.
    """

    tree: KinematicTree
    model: Any
    fused_model: Any
    frames: dict[str, tuple[str, int]]
    qpos_index: dict[str, int]
    mimic_equalities: dict[int, str]
    other_equalities: frozenset[int]
    remarks: tuple[MjcfRemark, ...]
    with_shapes: bool
    aligns_free_bodies: bool
    joint_names: tuple[str, ...]

    def qpos(self, q: FloatArray) -> FloatArray:
        """Return MuJoCo's qpos (n, `model.nq`), with the values of mimic joints, for urdfkin's q (n, nq)."""
        tree, full = self.tree, np.tile(self.model.qpos0, (len(q), 1))
        for joint, at in zip(tree.joints, tree.q_index, strict=True):
            if joint.name not in self.qpos_index:
                continue
            to = self.qpos_index[joint.name]
            if joint.kind is JointKind.FLOATING:
                unit = q[:, at + 3 : at + 7] / np.linalg.norm(q[:, at + 3 : at + 7], axis=1, keepdims=True)
                full[:, to : to + 3], full[:, to + 3 : to + 7] = q[:, at : at + 3], np.roll(unit, 1, axis=1)
            else:
                rule = joint.mimic
                full[:, to] = q[:, at] if rule is None else rule.multiplier * q[:, at] + rule.offset
        return full

    def placements(self, q: FloatArray) -> FloatArray:
        """Return MuJoCo's placements (n, frames, 4, 4) of `frames` for q (n, nq).

        If `fused_model` is not None, it computes the frames that it contains, and `model` computes the other
        frames.
        """
        qpos = self.qpos(q)
        out = _placements(self.model, qpos, dict(enumerate(self.frames.values())))
        if self.fused_model is not None:
            own = {
                f: at
                for f, at in enumerate(map(self._find_in_fused_model, self.frames.values()))
                if at is not None
            }
            out[:, list(own)] = _placements(self.fused_model, qpos, own)
        return out

    def _find_in_fused_model(self, frame: tuple[str, int]) -> tuple[str, int] | None:
        mujoco, (kind, i) = import_mujoco(), frame
        what = mujoco.mjtObj.mjOBJ_BODY if kind == "body" else mujoco.mjtObj.mjOBJ_SITE
        name = mujoco.mj_id2name(self.model, what, i)
        index = mujoco.mj_name2id(self.fused_model, what, name) if name else -1
        return (kind, index) if index >= 0 else None

    def origin_distance_bounds(self, q: FloatArray) -> FloatArray:
        """Return an upper bound (n, frames), in m, on each frame's distance from the world's origin.

        The bound is the sum of the lengths of all translations from the world to the frame.
        """
        m, qpos = self.model, np.abs(self.qpos(q))
        at_body = np.zeros((len(q), m.nbody))
        for i in range(1, m.nbody):
            added_length = np.full(len(q), float(norm(m.body_pos[i])))
            for j, kind, address in self._body_joints(i):
                if kind == "free":
                    added_length = norm(qpos[:, address : address + 3])
                elif kind == "slide":
                    added_length = added_length + qpos[:, address] + abs(m.qpos0[address])
                added_length = added_length + 2.0 * norm(m.jnt_pos[j])
            at_body[:, i] = at_body[:, m.body_parentid[i]] + added_length
        return self._make_frame_values(at_body, norm(m.site_pos))

    def hinge_angle_sums(self, q: FloatArray) -> FloatArray:
        """Return the sum (n, frames) of |q| + |ref| (rad) over the hinges between the world and each frame.

        A hinge is omitted if its reference value `ref` is zero.
        """
        m, qpos = self.model, np.abs(self.qpos(q))
        at_body = np.zeros((len(q), m.nbody))
        for i in range(1, m.nbody):
            at_body[:, i] = at_body[:, m.body_parentid[i]]
            for _, kind, address in self._body_joints(i):
                if kind == "hinge" and m.qpos0[address]:
                    at_body[:, i] += qpos[:, address] + abs(m.qpos0[address])
        return self._make_frame_values(at_body, np.zeros(m.nsite))

    def _body_joints(self, body: int) -> Iterator[tuple[int, str, int]]:
        m, kinds = self.model, import_mujoco().mjtJoint
        words = {int(kinds.mjJNT_FREE): "free", int(kinds.mjJNT_SLIDE): "slide"}
        for j in _joint_indices(m, body):
            yield j, words.get(int(m.jnt_type[j]), "hinge"), int(m.jnt_qposadr[j])

    def _make_frame_values(self, body_values: FloatArray, site_values: FloatArray) -> FloatArray:
        """Return values (n, frames) from `body_values` (n, bodies) and `site_values` (sites,).

        The value of a site is the sum of the site's own value and the value of its body.
        """
        columns = [
            body_values[:, i]
            if kind == "body"
            else body_values[:, self.model.site_bodyid[i]] + site_values[i]
            for kind, i in self.frames.values()
        ]
        return np.stack(columns, axis=1)

    def residuals(self, q: FloatArray) -> FloatArray:
        """Return MuJoCo's residuals (n, equalities) of active joint equalities; NaN for other equalities."""
        mujoco, m = import_mujoco(), self.model
        off = mujoco.mjtDisableBit
        m.opt.disableflags |= int(off.mjDSBL_CONTACT) | int(off.mjDSBL_LIMIT) | int(off.mjDSBL_FRICTIONLOSS)
        data, out = mujoco.MjData(m), np.full((len(q), m.neq), np.nan)
        for k, qpos in enumerate(self.qpos(q)):
            data.qpos[:] = qpos
            mujoco.mj_fwdPosition(m, data)
            rows = np.asarray(data.efc_type) == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
            ids = np.asarray(data.efc_id)[rows]
            between_joints = np.asarray(m.eq_type)[ids] == int(mujoco.mjtEq.mjEQ_JOINT)
            out[k, ids[between_joints]] = np.asarray(data.efc_pos)[rows][between_joints]
        return out

    def rule_scales(self, q: FloatArray) -> FloatArray:
        """Return a scale for each equality, shape (n, equalities); 0 if the equality is not a mimic rule.

        The rounding error of a mimic rule is at most `MJCF_MIMIC_ROUNDINGS` * `EPS` * scale.

        A joint y with the rule y = y0 + c0 + c1 (x - x0) has the scale (k + 1) s(y). Here k is the number of
        rules in the chain from y to an independent joint. The size s of a joint is:

        - for an independent joint: `s(x) = |x|`
        - for a mimic joint: `s(y) = |y0| + |c0| + |c1| (s(x) + |x0|)`
        """
        m, qpos = self.model, np.abs(self.qpos(q))
        by_joint = {int(m.eq_obj1id[i]): i for i in self.mimic_equalities}
        known: dict[int, tuple[FloatArray, int]] = {}
        for i in self.mimic_equalities:
            chain = [i]
            while (above := by_joint.get(int(m.eq_obj2id[chain[-1]]))) is not None and above not in known:
                chain.append(above)
            for one in reversed(chain):
                y, x = (int(m.jnt_qposadr[j]) for j in (m.eq_obj1id[one], m.eq_obj2id[one]))
                independent = qpos[:, x], 0
                size, depth = known.get(by_joint.get(int(m.eq_obj2id[one]), -1), independent)
                y0, x0 = abs(m.qpos0[y]), abs(m.qpos0[x])
                c0, c1 = np.abs(m.eq_data[one, :2])
                known[one] = y0 + c0 + c1 * (size + x0), depth + 1
        out = np.zeros((len(q), m.neq))
        for i, (size, depth) in known.items():
            out[:, i] = (depth + 1) * size
        return out


def _placements(model: Any, qpos: FloatArray, frames: dict[int, tuple[str, int]]) -> FloatArray:
    mujoco = import_mujoco()
    data = mujoco.MjData(model)
    out = np.zeros((len(qpos), len(frames), 4, 4))
    out[..., 3, 3] = 1.0
    for k, numbers in enumerate(qpos):
        data.qpos[:] = numbers
        mujoco.mj_kinematics(model, data)
        for f, (kind, i) in enumerate(frames.values()):
            R, p = (data.xmat[i], data.xpos[i]) if kind == "body" else (data.site_xmat[i], data.site_xpos[i])
            out[k, f, :3, :3], out[k, f, :3, 3] = R.reshape(3, 3), p
    return out


def is_mjcf(source: object) -> TypeGuard[str | bytes | os.PathLike[str]]:
    """Return whether a text, bytes, or a .xml or .mjcf file has the root element <mujoco>.

    The root element of a file must be in the first 65,536 bytes.
    """
    if isinstance(source, bytes):
        return _ROOT_ELEMENT.match(source.decode("utf-8-sig", "replace")) is not None
    if is_text(source):
        return _ROOT_ELEMENT.match(str(source).lstrip("\ufeff")) is not None
    if not isinstance(source, str | os.PathLike) or Path(source).suffix.lower() not in _SUFFIXES:
        return False
    try:
        return is_mjcf(read_start(expand_home(source), _SEARCHED_BYTES))
    except OSError:
        return False  # `load` reports the error later.


def read_mjcf(source: str | os.PathLike[str], name: str, *, with_shapes: bool = False) -> Mjcf:
    """Read an MJCF file or text in this process (`urdfkin.verify.mjcf_check` confines the process).

    If `with_shapes` is False, shapes and inertias are removed first, so that MuJoCo needs no mesh files.
    `name` is the name of the source in messages. Raise InputError if MuJoCo is not installed or refuses the
    file, or if the tree cannot represent a joint.
    """
    mujoco = import_mujoco()
    fused_model = None
    try:
        spec = _load_spec(mujoco, source)
        aligned, fuses = list(_find_aligned_bodies(mujoco, spec)), bool(spec.compiler.fusestatic)
        if with_shapes and fuses:
            if merged := [body for body in aligned if body.bodies]:
                what = (
                    "MuJoCo fuses static bodies into this free body and aligns the frame with the inertial"
                    " frame of the fused body"
                )
                where, remedy = f"{name}: body {merged[0].name}", 'write fusestatic="false" or align="false"'
                raise InputError(what, where=where, remedy=remedy)
            fused_model = compile_spec(_load_spec(mujoco, source))
        spec.compiler.fusestatic = False
        notes = list(_find_omissions(mujoco, spec))
        # Removing constraints changes the indices of the remaining constraints, so the names are read first.
        equalities = [
            one.name or str(i)
            for i, one in enumerate(spec.equalities)
            if with_shapes or one.type == mujoco.mjtEq.mjEQ_JOINT
        ]
        if not with_shapes:
            _remove_unused_elements(mujoco, spec)
        model = compile_spec(spec)
        reader = _MjcfReader(mujoco, model, spec.modelname or "robot", name, equalities)
        tree = reader.make_tree()
    except UnicodeDecodeError as error:
        message = "this MJCF contains a name that is not UTF-8"
        remedy = "save the file as UTF-8"
        raise InputError(message, where=name, found=repr(error.object)[:80], remedy=remedy) from None
    except InputError:
        raise
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        found = str(error).strip().replace("\n", "; ")
        raise InputError("MuJoCo does not accept this MJCF", where=name, found=found) from None
    notes += [_make_alignment_remark(body.name, with_shapes=with_shapes) for body in aligned]
    # Limits in radians are not checked, because large limits are plausible: some hinges turn several times.
    notes += _check_angle_unit(mujoco, model) if spec.compiler.degree else ()
    return Mjcf(
        tree, model, fused_model, reader.frames, reader.qpos_index, reader.mimic_equalities,
        frozenset(reader.other_equalities), (*reader.remarks, *notes), with_shapes, bool(aligned),
        reader.joint_names,
    )  # fmt: skip


def _load_spec(mujoco: Any, source: str | os.PathLike[str]) -> Any:
    spec = mujoco.MjSpec.from_string(source) if is_text(source) else mujoco.MjSpec.from_file(str(source))
    spec.compiler.usethread = False  # A confined process cannot start threads.
    # The file can set memory sizes for dynamics. The value -1 selects MuJoCo's default sizes.
    spec.memory = spec.njmax = spec.nconmax = spec.nstack = -1
    return spec


def _find_aligned_bodies(mujoco: Any, spec: Any) -> Iterator[Any]:
    kinds, choices = mujoco.mjtJoint, mujoco.mjtAlignFree
    for joint in spec.joints:
        if joint.type != kinds.mjJNT_FREE:
            continue
        align = spec.compiler.alignfree if joint.align == choices.mjALIGNFREE_AUTO else joint.align
        bodies = joint.parent.bodies
        if (
            align
            and not (bodies and not spec.compiler.fusestatic)
            and not _has_moving_descendants(joint.parent)
        ):
            yield joint.parent


def _has_moving_descendants(body: Any) -> bool:
    descendants = list(body.bodies)
    for one in descendants:
        descendants += one.bodies
    return any(list(one.joints) for one in descendants)


def _make_alignment_remark(body: str, *, with_shapes: bool) -> MjcfRemark:
    what = "MuJoCo aligns the frame of this free body with the body's inertial frame"
    if not with_shapes:
        what += "; the file was read without shapes and inertias, so urdfkin uses the body frame in the file"
    return MjcfRemark(what, f"body {body}" if body else "body", moves=not with_shapes)


def source_name(source: str | bytes | os.PathLike[str]) -> str:
    return "<bytes>" if isinstance(source, bytes) else "<text>" if is_text(source) else str(source)


def is_text(source: object) -> bool:
    return isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<")


#: Elements that urdfkin does not use: maps an attribute of `MjSpec` to its singular for messages.
_UNUSED_ELEMENTS = {
    "keys": "key", "sensors": "sensor", "actuators": "actuator", "tendons": "tendon", "excludes": "exclude",
    "pairs": "pair", "skins": "skin", "flexes": "flex", "geoms": "geom", "cameras": "camera",
    "lights": "light", "meshes": "mesh", "hfields": "hfield", "materials": "material", "textures": "texture",
}  # fmt: skip


def _find_unused_elements(spec: Any) -> Iterator[tuple[str, list[Any]]]:
    for words in _UNUSED_ELEMENTS:
        if found := list(getattr(spec, words, ())):
            yield words, found


def _find_omissions(mujoco: Any, spec: Any) -> Iterator[MjcfRemark]:
    """Yield the parts that the tree does not represent, except equalities between joints."""
    disabled = _disables_equalities(mujoco, spec.option)
    for i, one in enumerate(spec.equalities):
        if one.type != mujoco.mjtEq.mjEQ_JOINT:
            kind, names = str(one.type).rpartition("_")[2].lower(), _join_names(one.name1, one.name2)
            what = f"a constraint ({kind}{names and ' of '}{names}) that a tree cannot represent"
            yield MjcfRemark(what, f"equality {one.name or i}", moves=bool(one.active) and not disabled)
    useless = dict(_find_unused_elements(spec))
    for words, tag in (("tendons", "tendon"), ("flexes", "flex")):
        if useless.pop(words, None):
            yield MjcfRemark(f"urdfkin ignores {words}", tag, moves=True)
    if useless:
        counts = ", ".join(
            f"{len(found)} {words if len(found) > 1 else _UNUSED_ELEMENTS[words]}"
            for words, found in useless.items()
        )
        yield MjcfRemark(f"kinematics does not use {counts}")


def _disables_equalities(mujoco: Any, option: Any) -> bool:
    off = mujoco.mjtDisableBit
    return bool(option.disableflags & (int(off.mjDSBL_CONSTRAINT) | int(off.mjDSBL_EQUALITY)))


def _check_angle_unit(mujoco: Any, model: Any) -> Iterator[MjcfRemark]:
    hinges = (model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE) & (model.jnt_limited != 0)
    largest = float(np.degrees(np.abs(model.jnt_range[hinges]).max(initial=0.0)))
    if 0.0 < largest <= MAX_PLAUSIBLE_ANGLE:
        what = f"the largest limit of a hinge is {largest:.4g} degrees: the limits are probably radians"
        yield MjcfRemark(
            what, "compiler", remedy='write angle="radian" in <compiler>, or convert the limits to degrees'
        )


def _remove_unused_elements(mujoco: Any, spec: Any) -> None:
    """Remove elements that kinematics does not need, so that MuJoCo reads no mesh files."""
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    for one in list(spec.equalities):
        if one.type != mujoco.mjtEq.mjEQ_JOINT:
            spec.delete(one)
    for _, found in _find_unused_elements(spec):
        for one in found:
            spec.delete(one)
    for site in spec.sites:
        site.material = ""
    for joint in spec.joints:
        # `align` would use the inertial frame, but the loop below replaces all inertias by placeholders.
        joint.align = mujoco.mjtAlignFree.mjALIGNFREE_FALSE
    for body in spec.bodies[1:]:
        body.explicitinertial, body.mass, body.ipos = True, 1.0, (0.0, 0.0, 0.0)
        body.inertia, body.iquat, body.fullinertia = (1.0,) * 3, (1.0, 0.0, 0.0, 0.0), (np.nan,) * 6


def _join_names(*names: str) -> str:
    return " and ".join(name for name in names if name)


def _joint_indices(model: Any, body: int) -> range:
    first = int(model.body_jntadr[body])
    return range(first, first + int(model.body_jntnum[body]))


@dataclass(slots=True)
class _MjcfReader:
    mujoco: Any
    model: Any
    name: str
    source: str
    equality_names: list[str]
    frames: dict[str, tuple[str, int]] = field(default_factory=dict)
    qpos_index: dict[str, int] = field(default_factory=dict)
    remarks: list[MjcfRemark] = field(default_factory=list)
    mimic_equalities: dict[int, str] = field(default_factory=dict)
    other_equalities: set[int] = field(default_factory=set)
    _joints: list[tuple[Joint, str, str]] = field(default_factory=list)
    _used_link_names: set[str] = field(default_factory=set)
    _used_joint_names: set[str] = field(default_factory=set)
    _links: list[str] = field(default_factory=list)
    _joint_name_by_index: dict[int, str] = field(default_factory=dict)

    def make_tree(self) -> KinematicTree:
        m = self.model
        self._refuse_infinite_numbers()
        self._links = [
            make_unique(m.body(i).name or f"body{i}", self._used_link_names) for i in range(m.nbody)
        ]
        self._joint_name_by_index = {
            i: make_unique(m.joint(i).name or f"joint{i}", self._used_joint_names) for i in range(m.njnt)
        }
        for i in range(m.nbody):
            self.frames[self._links[i]] = "body", i
            if i:
                self._add_body(i)
        for i in range(m.nsite):
            if name := m.site(i).name:
                link = make_unique(name, self._used_link_names)
                self.frames[link] = "site", i
                T = _pose_from_quaternion(m.site_pos[i], m.site_quat[i])
                self._add_fixed_joint(T, self._links[m.site_bodyid[i]], link)
        rules = dict(self._read_rules())
        joints = [(replace(joint, mimic=rules.get(joint.name)), a, b) for joint, a, b in self._joints]
        return build_tree(self.name, self._links[0], joints)

    def _refuse_infinite_numbers(self) -> None:
        m = self.model
        for tag, elements, numbers in (
            ("body", m.body, (m.body_pos, m.body_quat)),
            ("joint", m.joint, (m.jnt_pos, m.jnt_axis, m.qpos0[m.jnt_qposadr][:, None])),
            ("site", m.site, (m.site_pos, m.site_quat)),
        ):
            for i, row in enumerate(np.hstack(numbers)):
                if not np.isfinite(row).all():
                    where = f"{self.source}: {tag} {elements(i).name or i}"
                    found = f"{row[~np.isfinite(row)][0]:g}"
                    message = "a position, orientation or axis is not finite"
                    raise InputError(message, where=where, found=found, remedy="write finite numbers")

    @property
    def joint_names(self) -> tuple[str, ...]:
        return tuple(joint.name for joint, _, _ in self._joints)

    def _add_fixed_joint(self, T: FloatArray, parent: str, child: str) -> None:
        name = make_unique(f"{child}_fixed", self._used_joint_names)
        self._joints.append((make_fixed_joint(name, T), parent, child))

    def _add_body(self, i: int) -> None:
        m, here = self.model, self._links[self.model.body_parentid[i]]
        T, link = _pose_from_quaternion(m.body_pos[i], m.body_quat[i]), self._links[i]
        if m.body_mocapid[i] >= 0:
            what = "a mocap body is fixed at its pose in the file"
            self.remarks.append(MjcfRemark(what, f"body {link}", moves=True))
        joints = _joint_indices(m, i)
        for j in joints:
            anchor, name = pose(p=m.jnt_pos[j]), self._joint_name_by_index[j]
            ends_here = j == joints[-1] and not m.jnt_pos[j].any()
            child = link if ends_here else make_unique(f"{name}_link", self._used_link_names)
            joint, back = self._make_joint(j, name, T @ anchor)
            self._joints.append((joint, here, child))
            self.qpos_index[name] = int(m.jnt_qposadr[j])
            T, here = back, child
        if here != link:
            self._add_fixed_joint(T, here, link)

    def _make_joint(self, j: int, name: str, T: FloatArray) -> tuple[Joint, FloatArray]:
        """Convert MuJoCo's joint `j`; return the joint and the pose of its body in the joint frame.

        T is the pose of the joint frame in the parent link when the joint has its reference value `ref`.
        """
        m, kinds = self.model, self.mujoco.mjtJoint
        kind, axis, back = m.jnt_type[j], m.jnt_axis[j], pose(p=-m.jnt_pos[j])
        if kind == kinds.mjJNT_BALL:
            message = "urdfkin does not support ball joints"
            remedy = "use three hinges in one body (singular if the middle hinge is at a right angle)"
            raise InputError(message, where=f"{self.source}: joint {name}", remedy=remedy)
        at = int(m.jnt_qposadr[j])
        if kind == kinds.mjJNT_FREE:
            place, turn = (", ".join(f"{x:g}" for x in part) for part in np.split(m.qpos0[at : at + 7], [3]))
            is_turned = m.qpos0[at + 3] != 1.0
            if m.qpos0[at : at + 3].any() or is_turned:
                turned = f" with the quaternion (w, x, y, z) = ({turn})" if is_turned else ""
                zero = "in the neutral configuration the body is at the origin"
                zero += ", not turned" if is_turned else ""
                what = f"qpos0 places this body at ({place}){turned}; {zero}"
                self.remarks.append(MjcfRemark(what, f"joint {name}"))
            return Joint(name, JointKind.FLOATING, 0, np.eye(4), np.array([1.0, 0.0, 0.0])), np.eye(4)
        reference, turns = float(m.qpos0[at]), kind == kinds.mjJNT_HINGE
        if reference:
            T = T @ (pose(rotation_about(axis, -reference)) if turns else pose(p=-reference * axis))
        urdf_kind, limit = self._make_limit(j, name, turns=turns)
        return Joint(name, urdf_kind, 0, T, axis, limit), back

    def _make_limit(self, j: int, name: str, *, turns: bool) -> tuple[JointKind, Limit | None]:
        m = self.model
        effort = float(np.abs(m.jnt_actfrcrange[j]).max()) if m.jnt_actfrclimited[j] else np.inf
        if m.jnt_limited[j]:
            lower, upper = map(float, m.jnt_range[j])
            kind = JointKind.REVOLUTE if turns else JointKind.PRISMATIC
            return kind, Limit(lower, upper, np.inf, effort)
        if turns:
            return JointKind.CONTINUOUS, None if effort == np.inf else Limit(-np.inf, np.inf, np.inf, effort)
        what = (
            f"a slide joint without limits gets +-{FALLBACK_PRISMATIC_LIMIT:g} m,"
            " because URDF requires limits"
        )
        self.remarks.append(MjcfRemark(what, f"joint {name}"))
        return JointKind.PRISMATIC, Limit(-FALLBACK_PRISMATIC_LIMIT, FALLBACK_PRISMATIC_LIMIT, np.inf, effort)

    def _read_rules(self) -> Iterator[tuple[str, Mimic]]:
        m, rules = self.model, dict[str, Mimic]()
        disabled = _disables_equalities(self.mujoco, m.opt)
        for i in range(m.neq):
            if m.eq_type[i] != self.mujoco.mjtEq.mjEQ_JOINT:
                continue
            where = f"equality {self.equality_names[i]}"
            rule = self._read_rule(i)
            if disabled or not m.eq_active0[i]:
                what = "a constraint that <flag> disables" if disabled else "a constraint that is not active"
                self.remarks.append(MjcfRemark(what, where))
                continue
            if rule is None:
                names = _join_names(
                    *(self._joint_name_by_index[j] for j in (m.eq_obj1id[i], m.eq_obj2id[i]) if j >= 0)
                )
                what = f"a constraint ({names}) that is not a linear relation of two joints"
            elif rule[0] in rules or depends_on(rules, rule[1].mimicked_joint, rule[0]):
                what = f"joint {rule[0]} has two rules, or its rules form a cycle"
            else:
                rules[rule[0]] = rule[1]
                self.mimic_equalities[i] = rule[0]
                continue
            self.other_equalities.add(i)
            self.remarks.append(MjcfRemark(what, where, moves=True))
        for name in rules:
            yield name, resolve_rule(rules, name)

    def _read_rule(self, i: int) -> tuple[str, Mimic] | None:
        """Return the mimic joint y and the mimic rule of equality `i`, or None.

        The equality must have the form y - y0 = c0 + c1 (x - x0). Here x0 and y0 are reference values.
        """
        m = self.model
        y, x = int(m.eq_obj1id[i]), int(m.eq_obj2id[i])
        c = m.eq_data[i, :5]
        if x < 0 or c[2:].any():
            return None
        y0, x0 = (float(m.qpos0[m.jnt_qposadr[j]]) for j in (y, x))
        return self._joint_name_by_index[y], Mimic(
            self._joint_name_by_index[x], float(c[1]), float(y0 + c[0] - c[1] * x0)
        )


def replace_missing_limits(lower: float, upper: float) -> tuple[float, float]:
    """Replace infinite limits (m) of a prismatic joint.

    >>> replace_missing_limits(-1.0, math.inf), replace_missing_limits(2500.0, math.inf)
    ((-1.0, 1000.0), (2500.0, 3500.0))
    """
    far = FALLBACK_PRISMATIC_LIMIT
    low, high = (x if math.isfinite(x) else math.copysign(far, x) for x in (lower, upper))
    if lower == -math.inf and high <= -far:
        low = high - far
    if upper == math.inf and far <= lower < math.inf:
        high = lower + far
    return low, high


def make_unique(name: str, used_names: set[str]) -> str:
    """Append underscores to a name until the name is unique, and add the result to `used_names`."""
    while name in used_names:
        name += "_"
    used_names.add(name)
    return name


def make_fixed_joint(name: str, T: FloatArray) -> Joint:
    return Joint(name, JointKind.FIXED, 0, T, np.array([1.0, 0.0, 0.0]))


def depends_on(rules: Mapping[str, Mimic], joint: str, other: str) -> bool:
    """Return whether the chain of mimicked joints that begins at `joint` contains `other`."""
    while joint in rules and joint != other:
        joint = rules[joint].mimicked_joint
    return joint == other


def resolve_rule(rules: Mapping[str, Mimic], joint: str) -> Mimic:
    """Combine the mimic rules from `joint` to an independent joint into one rule."""
    rule = rules[joint]
    while rule.mimicked_joint in rules:
        end = rules[rule.mimicked_joint]
        rule = Mimic(
            end.mimicked_joint, rule.multiplier * end.multiplier, rule.multiplier * end.offset + rule.offset
        )
    return rule


def _pose_from_quaternion(p: FloatArray, quaternion: FloatArray) -> FloatArray:
    return pose(rotation_from_quaternion(np.roll(quaternion, -1) / np.linalg.norm(quaternion)), p)
