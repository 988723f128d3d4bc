"""Convert q, v, a, Jacobians and six-vectors between urdfkin and another program.

The target program has these joint velocities, joint accelerations and Jacobians:

    v_tool = M v
    a_tool = M a + M' v
    J_tool = S J M^-1

M is the matrix `Conversion.matrix`, and M' is its time derivative. S exchanges the linear and the angular
rows if the target program has the angular rows first. urdfkin expresses the velocity of a floating or planar
joint in the axes of the child link. M depends on q if, and only if, the target program expresses a part of
this velocity in the axes of the parent link.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, cast, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from urdfkin.errors import InputError, QuestionsSection, UnknownNameError
from urdfkin.errors.numbers import parse_float
from urdfkin.errors.validators import as_int, as_str, safe_repr
from urdfkin.kinematics.inputs import as_finite, as_floats, check_range, common_batch_shape
from urdfkin.kinematics.rotation import rotation_from_quaternion, skew
from urdfkin.model import configuration
from urdfkin.model.configuration_like import ConfigurationLike, CoordinateLayout, as_text_or_mapping
from urdfkin.model.conventions.convention import Convention, JointRule, check_unique, spell_name
from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree
from urdfkin.system.plain_xml import parse_xml

#: Allowed deviation from a mimic rule, relative to max(1, |`_TargetNumber.factor`|, |expected value|) in the
#: target program's unit.
_MIMIC_TOLERANCE = 1e-9
_ANGULAR_FIRST = [3, 4, 5, 0, 1, 2]


@dataclass(frozen=True, slots=True)
class _TargetNumber:
    """An entry of the target program's q or v: `factor * x[index] + zero`, where x is urdfkin's q or v.

    If `cos_or_sin` is not empty, the entry is the cosine or sine of this value.
    """

    name: str
    index: int
    factor: float = 1.0
    zero: float = 0.0
    cos_or_sin: str = ""
    unit: str = ""
    is_mimic: bool = False


@dataclass(frozen=True, slots=True)
class _FreeJoint:
    """A planar or floating joint with a block in `Conversion.matrix`."""

    joint: Joint
    q_index: int  #: First index in urdfkin's q.
    v_index: int  #: First index in urdfkin's v.
    target_slice: slice  #: Indices in the target program's v.
    #: (3,) position of the link's origin or centre of mass in the link's frame (m); None if it is unknown.
    velocity_point: FloatArray | None


class Conversion:
    """Names and conversions of one robot in a convention.

    Args:
        tree: The robot.
        urdf: The robot's URDF text.
        convention: The convention.
        joints: Order of the joints, which replaces the convention's order. `joints` is required if the
            convention has no order.
        has_masses: False if `urdf` is converted from a source whose masses urdfkin does not read.

    Raises:
        InputError: The order is wrong, two joints get the same name, or a rule does not fit its joint.
        UnknownNameError: A joint is unknown.

    >>> import urdfkin
    >>> robot = urdfkin.load("a1", root_joint="floating", verify=False)
    >>> mujoco = robot.convention("mujoco")
    >>> mujoco.joint_names[:3]  # the file begins with the right front leg
    ('root_joint', 'FR_hip_joint', 'FR_thigh_joint')
    >>> mujoco.to(robot.neutral())[:7].tolist()  # w first
    [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    """

    def __init__(
        self,
        tree: KinematicTree,
        urdf: str,
        convention: Convention,
        joints: Sequence[str] | None = None,
        *,
        has_masses: bool = True,
    ) -> None:
        if joints is not None:
            convention = replace(convention, order="given", joints=tuple(joints))
        self.tree, self.convention = tree, convention
        self._urdf, self._has_masses = urdf, has_masses
        for name in convention.rules:
            self._find_joint_index(name)
        self._order = self._find_order()
        self._columns, self._rates = list[_TargetNumber](), list[_TargetNumber]()
        self._blocks = list[_FreeJoint]()
        self.joint_names = tuple(self._add_joint(i) for i in self._order)
        check_unique(self.joint_names, convention.name)
        self._precompute()

    def __repr__(self) -> str:
        return f"<Conversion of {self.tree.name} to {self.convention.name}: nq {self.nq}, nv {self.nv}>"

    # -- layout --------------------------------------------------------------------------------------

    def _find_order(self) -> list[int]:
        tree, how = self.tree, self.convention
        moving = {i for i, joint in enumerate(tree.joints) if joint.kind.nv}
        if how.order == "given":
            return self._read_given_order(moving)
        if how.mimic == "none":
            moving -= {i for i in moving if tree.joints[i].mimic}
        return [i for i in self._sort_joints() if i in moving]

    def _read_given_order(self, moving: set[int]) -> list[int]:
        how = self.convention
        if not how.joints:
            raise InputError(
                f"{how.title} has no known order of joints",
                where=how.name,
                remedy="pass joints=[...] in the order of this tool, or set `joints` in a TOML file",
            )
        own = {self._tool_name(one): one.name for one in self.tree.joints if one.original.kind.nv}
        all_names = [(name, self._find_joint_index(own.get(name, name))) for name in how.joints]
        named = [(name, i) for name, i in all_names if self.tree.joints[i].lock is None]
        order = [i for _, i in named]
        for name, i in named:
            if i not in moving:
                raise InputError("the order of joints contains a fixed joint", where=how.name, found=name)
        check_unique([self.tree.joints[i].name for i in order], how.name)
        joints, covered = (
            self.tree.joints,
            {self.tree.q_index[i] for i in order if self._determines_coordinate(i)},
        )
        missing = [joints[i].name for i in sorted(moving - set(order)) if self.tree.q_index[i] not in covered]
        if missing:
            raise InputError(
                "the order of joints lacks a joint", where=how.name, found=", ".join(missing[:8])
            )
        return order

    def _find_joint_index(self, joint: str) -> int:
        if joint not in (names := [one.name for one in self.tree.joints]):
            raise UnknownNameError("joint", joint, names, where=f"{self.convention.name}, {self.tree.name}")
        return self.tree.joint_index(joint)

    def _determines_coordinate(self, i: int) -> bool:
        rule = self.tree.joints[i].mimic
        return rule is None or rule.multiplier != 0.0

    def _sort_joints(self) -> list[int]:
        tree, order = self.tree, self.convention.order
        all_joints = range(len(tree.joints))
        if order == "depth first, by name":
            return list(all_joints)
        tag = "link" if order.endswith("link") else "joint"
        written = {e.get("name", ""): k for k, e in enumerate(parse_xml(self._urdf).iterfind(tag))}
        names = tree.links[1:] if tag == "link" else [joint.name for joint in tree.joints]
        # A root joint that urdfkin added is not in the URDF text. The rank -1 sorts the root joint first.
        ranks = [written.get(name, -1) for name in names]
        if order == "name":
            return sorted(all_joints, key=lambda i: (ranks[i] >= 0, tree.joints[i].name))
        if order == "file":
            return sorted(all_joints, key=ranks.__getitem__)
        children: dict[int, list[int]] = {}
        for i, joint in enumerate(tree.joints):
            children.setdefault(joint.parent, []).append(i)
        if order.startswith("breadth first"):
            joint_names = [joint.name for joint in tree.joints]
            keys = joint_names if order.endswith(("by name", "fixed joints")) else ranks
            return self._breadth_first(children, keys, merge_fixed=not order.endswith("fixed joints"))
        ordered_joints, stack = [], sorted(children.get(0, []), key=ranks.__getitem__, reverse=True)
        while stack:
            ordered_joints.append(i := stack.pop())
            stack += sorted(children.get(i + 1, []), key=ranks.__getitem__, reverse=True)
        return ordered_joints

    def _breadth_first(
        self, children: Mapping[int, list[int]], keys: Sequence[Any], *, merge_fixed: bool
    ) -> list[int]:
        """Sort siblings by `keys`.

        With `merge_fixed`, links that fixed joints connect count as one link.
        """

        def below(link: int) -> list[int]:
            joints, links = list[int](), [link]
            # The loop appends links to the list and visits these links later.
            for parent in links:
                for i in children.get(parent, []):
                    # A locked joint is still a moving joint in the target program.
                    if self.tree.joints[i].original.kind.nv or not merge_fixed:
                        joints.append(i)
                    else:
                        links.append(i + 1)
            return sorted(joints, key=keys.__getitem__)

        order = below(0)
        for i in order:
            order += below(i + 1)
        return order

    def _add_joint(self, i: int) -> str:
        how, joint = self.convention, self.tree.joints[i]
        rule, name = how.rules.get(joint.name, JointRule()), self._tool_name(joint)
        q, v = self.tree.q_index[i], self.tree.v_index[i]
        if joint.kind is JointKind.FLOATING:
            self._refuse_rule(joint)
            self._add_floating(i, name, q, v)
        elif joint.kind is JointKind.PLANAR:
            self._refuse_rule(joint)
            self._add_planar(i, name, q, v)
        elif joint.kind.has_axis:
            self._add_axis(joint, rule, name, q, v)
        else:
            raise NotImplementedError(f"a {joint.kind} joint in another convention")
        return name

    def _tool_name(self, joint: Joint) -> str:
        rule = self.convention.rules.get(joint.name)
        return rule.name if rule and rule.name else spell_name(joint.name, self.convention.names)

    def _refuse_rule(self, joint: Joint) -> None:
        rule = self.convention.rules.get(joint.name)
        if rule is not None and (rule.factor is not None or rule.zero or rule.sign != 1.0):
            raise InputError(
                "`sign`, `zero` and `unit` need a joint with one coordinate",
                where=f"{self.convention.name}: joint {joint.name}",
                found=joint.kind.value,
            )

    def _add_axis(self, joint: Joint, rule: JointRule, name: str, q: int, v: int) -> None:
        how, turns = self.convention, joint.kind.turns
        if rule.unit_kind and (rule.unit_kind == "angle") != turns:
            raise InputError(
                f"this `unit` is for a joint with {'an angle' if rule.unit_kind == 'angle' else 'a length'}",
                where=f"{how.name}: joint {joint.name}",
                found=joint.kind.value,
            )
        factor = rule.factor
        if factor is None:
            factor = rule.sign * (how.angle_factor if turns else 1.0)
        multiplier, offset = (joint.mimic.multiplier, joint.mimic.offset) if joint.mimic else (1.0, 0.0)
        unit = ("rad" if turns else "m") if abs(factor) == 1.0 else ""
        is_mimic = bool(joint.mimic)
        if joint.kind is JointKind.CONTINUOUS and how.continuous == 2:
            # The cosine and sine need an angle in rad, whatever the convention's unit of angles is.
            size, sign = abs(factor), math.copysign(1.0, factor)
            self._columns += [
                _TargetNumber(
                    f"{name}.{part}",
                    q,
                    sign * multiplier,
                    sign * offset + rule.zero / size,
                    part,
                    is_mimic=is_mimic,
                )
                for part in ("cos", "sin")
            ]
        else:
            zero = factor * offset + rule.zero
            self._columns.append(_TargetNumber(name, q, factor * multiplier, zero, "", unit, is_mimic))
        self._rates.append(_TargetNumber(name, v, factor * multiplier, unit=unit, is_mimic=is_mimic))

    def _add_floating(self, i: int, name: str, q: int, v: int) -> None:
        how, joint = self.convention, self.tree.joints[i]
        position = [_TargetNumber(f"{name}.{x}", q + k, unit="m") for k, x in enumerate("xyz")]
        turn = [_TargetNumber(f"{name}.q{x}", q + 3 + "xyzw".index(x)) for x in how.quaternion]
        self._columns += position + turn if how.base_q == "position first" else turn + position
        point = np.zeros(3) if how.point == "origin" else self._centre_of_mass(self.tree.links[i + 1])
        linear = [_TargetNumber(f"{name}.v{x}", v + k, unit="m") for k, x in enumerate("xyz")]
        angular = [
            _TargetNumber(f"{name}.w{x}", v + 3 + k, how.angle_factor, unit=how.angle_unit)
            for k, x in enumerate("xyz")
        ]
        first = len(self._rates)
        self._rates += linear + angular if how.base_v == "linear first" else angular + linear
        if "parent" in (how.linear, how.angular) or point is None or point.any():
            self._blocks.append(_FreeJoint(joint, q, v, slice(first, first + 6), point))

    def _add_planar(self, i: int, name: str, q: int, v: int) -> None:
        how, joint = self.convention, self.tree.joints[i]
        self._columns += [_TargetNumber(f"{name}.{x}", q + k, unit="m") for k, x in enumerate("xy")]
        if how.continuous == 2:
            self._columns += [
                _TargetNumber(f"{name}.{part}", q + 2, cos_or_sin=part) for part in ("cos", "sin")
            ]
        else:
            self._columns.append(_TargetNumber(f"{name}.angle", q + 2, how.angle_factor, unit=how.angle_unit))
        first = len(self._rates)
        self._rates += [_TargetNumber(f"{name}.v{x}", v + k, unit="m") for k, x in enumerate("xy")]
        self._rates.append(_TargetNumber(f"{name}.wz", v + 2, how.angle_factor, unit=how.angle_unit))
        if how.planar == "parent":
            self._blocks.append(_FreeJoint(joint, q, v, slice(first, first + 3), np.zeros(3)))

    def _centre_of_mass(self, link: str) -> FloatArray | None:
        """Return the centre of mass (3,) in the link's frame (m).

        The result is zero if the URDF has no centre of mass, and None if the source's masses are unknown.
        """
        if not self._has_masses:
            return None
        for element in parse_xml(self._urdf).iterfind("link"):
            if element.get("name") == link and (origin := element.find("inertial/origin")) is not None:
                text = origin.get("xyz", "0 0 0")
                point = [parse_float(word) for word in text.split()]
                if len(point) != 3 or None in point:
                    claim = "the origin of <inertial> must be three finite numbers"
                    raise InputError(claim, where=f"link {link}", found=safe_repr(text))
                return np.array(point, dtype=np.float64)
        return np.zeros(3)

    def _precompute(self) -> None:
        columns, rates = self._columns, self._rates
        self.nq, self.nv = len(columns), len(rates)
        self._q_index = np.array([c.index for c in columns], dtype=np.intp)
        self._q_factor = np.array([1.0 if c.cos_or_sin else c.factor for c in columns])
        self._q_zero = np.array([0.0 if c.cos_or_sin else c.zero for c in columns])
        self._plain_q = bool((self._q_factor == 1.0).all() and not self._q_zero.any())
        self._plain_q &= not any(c.cos_or_sin for c in columns)
        self._same_q = self._plain_q and np.array_equal(self._q_index, np.arange(self.tree.nq))
        self._q_target_index = _target_indices(columns, self.tree.nq)
        self._v_index = np.array([rate.index for rate in rates], dtype=np.intp)
        self._v_factor = np.array([rate.factor for rate in rates])
        self._plain_v = bool((self._v_factor == 1.0).all()) and not self._blocks
        self._same_v = self._plain_v and np.array_equal(self._v_index, np.arange(self.tree.nv))
        self._v_target_index = _target_indices(rates, self.tree.nv)
        self.angular_first = self.convention.six_vectors == "angular first"

    @property
    def has_pairs(self) -> bool:
        """True if the target program's q contains cosines and sines."""
        return any(column.cos_or_sin for column in self._columns)

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """Names of the coordinates in the target program's q."""
        return tuple(column.name for column in self._columns)

    @property
    def velocity_names(self) -> tuple[str, ...]:
        """Names of the target program's v and Jacobian columns."""
        return tuple(rate.name for rate in self._rates)

    def layout(self, symbol: str) -> CoordinateLayout:
        """Return names and units of the target program's "q", "v" or "a"."""
        if as_str(symbol, "symbol") not in ("q", "v", "a"):
            raise UnknownNameError("symbol", symbol, "qva")
        if symbol != "q":
            rest = {"neutral": np.zeros(self.nv)}
            units = tuple(rate.unit for rate in self._rates)
            return CoordinateLayout(symbol, self.velocity_names, units, poses=lambda: rest)

        def convert_poses() -> dict[str, FloatArray]:
            return {name: self.to(q) for name, q in configuration.named_poses(self.tree).items()}

        units = tuple(column.unit for column in self._columns)
        return CoordinateLayout(symbol, self.coordinate_names, units, poses=convert_poses)

    @property
    def permutation(self) -> NDArray[np.intp] | None:
        """Indices with which `q[..., permutation]` is the target program's q.

        The property is None if the conversion also changes values.
        """
        return self._q_index.copy() if self._plain_q else None

    @property
    def is_constant(self) -> bool:
        """True if `matrix` does not depend on q."""
        how = self.convention
        return not any(
            block.joint.kind is JointKind.PLANAR or "parent" in (how.linear, how.angular)
            for block in self._blocks
        )

    @property
    def velocity_permutation(self) -> NDArray[np.intp] | None:
        """Indices with which `v[..., velocity_permutation]` is the target program's v.

        The property is None if the conversion also changes values.
        """
        return self._v_index.copy() if self._plain_v else None

    @cached_property
    def q_and_v_indices(self) -> dict[str, tuple[list[int], list[int]]]:
        """Indices in the target program's q and v, by the joint's name in the URDF."""
        names = [self.tree.joints[i].name for i in self._order]
        indices, q, v = {}, 0, 0
        for i, name in zip(self._order, names, strict=True):
            kind = self.tree.joints[i].kind
            nq = kind.nq_pinocchio if self.convention.continuous == 2 else kind.nq
            indices[name] = list(range(q, q + nq)), list(range(v, v + kind.nv))
            q, v = q + nq, v + kind.nv
        return indices

    # -- vectors -------------------------------------------------------------------------------------

    @overload
    def to(self, q: ConfigurationLike) -> FloatArray: ...
    @overload
    def to(
        self, q: ConfigurationLike, v: ConfigurationLike, a: ConfigurationLike | None = None
    ) -> tuple[FloatArray, ...]: ...
    def to(
        self, q: ConfigurationLike, v: ConfigurationLike | None = None, a: ConfigurationLike | None = None
    ) -> FloatArray | tuple[FloatArray, ...]:
        """Convert q, v and a to the target program's convention.

        If q, v or a is equal in both conventions, the result can be the given array itself.

        Raises:
            InputError: A length is wrong, or a number is not finite.
            UnknownNameError: A coordinate, joint velocity or named pose is unknown.
            RangeError: A result leaves the range of double precision.

        >>> import urdfkin
        >>> robot = urdfkin.load("a1", root_joint="floating", verify=False)
        >>> q, v = robot.sample(1)[0], [1.0, *[0.0] * 17]  # forwards, in the axes of the base
        >>> _, qvel = robot.convention("mujoco").to(q, v)
        >>> bool(abs(qvel[:3] - robot.placement(q, "trunk")[:3, 0]).max() < 1e-15)  # in world axes
        True
        """
        inputs = self._parse_inputs(q, v, a)
        with np.errstate(over="ignore", invalid="ignore"):  # RangeError replaces these warnings.
            results = [self._to_target_q(inputs[0])]
            if self.has_pairs and (omitted := set(range(len(self.tree.joints))) - set(self._order)):
                recovered = self._recover_q(results[0])
                configuration.check_turns(
                    self.tree, sorted(omitted), inputs[0], recovered, self.convention.name
                )
            if len(inputs) > 1:
                results.append(self._to_target_rates(inputs[0], inputs[1]))
            if len(inputs) > 2:
                results.append(self._to_target_rates(inputs[0], inputs[2], inputs[1]))
        results = list(map(check_range, results))
        return results[0] if len(results) == 1 else tuple(results)

    @overload
    def from_(self, q: ConfigurationLike) -> FloatArray: ...
    @overload
    def from_(
        self, q: ConfigurationLike, v: ConfigurationLike, a: ConfigurationLike | None = None
    ) -> tuple[FloatArray, ...]: ...
    def from_(
        self, q: ConfigurationLike, v: ConfigurationLike | None = None, a: ConfigurationLike | None = None
    ) -> FloatArray | tuple[FloatArray, ...]:
        """Convert q, v and a from the target program's convention.

        If q, v or a is equal in both conventions, the result can be the given array itself.

        Raises:
            InputError: A length is wrong, or a number is not finite.
                A mimic joint's value contradicts its rule.
                The norm of a (cos, sin) pair or of a quaternion is not 1 within 1e-6.
            RangeError: A result leaves the range of double precision.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> arm.convention("drake").from_([0.5, -1.0]).tolist()
        [0.5, -1.0]
        """
        if a is not None and v is None:
            raise InputError("`a` can only be converted together with `v`")
        inputs = [self._check_target(q, "q")]
        inputs += [self._check_target(x, symbol) for symbol, x in (("v", v), ("a", a)) if x is not None]
        common_batch_shape((x.shape[:-1] for x in inputs), "q, v and a")
        with np.errstate(over="ignore", invalid="ignore"):
            results = [configuration.with_unit_quaternions(self.tree, self._from_target_q(inputs[0]))]
            if len(inputs) > 1:
                results.append(self._from_target_rates(results[0], inputs[1]))
            if len(inputs) > 2:
                results.append(self._from_target_rates(results[0], inputs[2], results[1]))
        results = list(map(check_range, results))
        return results[0] if len(results) == 1 else tuple(results)

    def _parse_inputs(
        self, q: ConfigurationLike, v: ConfigurationLike | None, a: ConfigurationLike | None
    ) -> list[FloatArray]:
        if v is None and a is not None:
            raise InputError("`a` can only be converted together with `v`")
        inputs = [configuration.parse_finite(self.tree, q, "q")]
        rates = [(letter, x) for letter, x in (("v", v), ("a", a)) if x is not None]
        inputs += [configuration.parse_finite(self.tree, x, letter) for letter, x in rates]
        common_batch_shape((x.shape[:-1] for x in inputs), "q, v and a")
        return inputs

    def _check_target(self, value: ConfigurationLike, symbol: str) -> FloatArray:
        named = as_text_or_mapping(value, symbol)
        numbers = cast("ArrayLike", value) if named is None else self.layout(symbol).parse(named)
        array, width = as_finite(numbers, symbol), self.nq if symbol == "q" else self.nv
        if array.shape[-1:] != (width,):
            names = self.coordinate_names if symbol == "q" else self.velocity_names
            raise InputError(
                f"{symbol} needs {width} numbers in the convention {self.convention.name}:"
                f" {', '.join(names)}",
                found=f"shape {array.shape}",
                question=QuestionsSection.JOINT_ORDER,
            )
        return array

    def _to_target_q(self, q: FloatArray) -> FloatArray:
        if self._same_q:
            return q
        target_q: FloatArray = q[..., self._q_index]
        if self._plain_q:
            return target_q
        target_q = target_q * self._q_factor + self._q_zero
        for k, column in enumerate(self._columns):
            if column.cos_or_sin:
                value = q[..., column.index] * column.factor + column.zero
                target_q[..., k] = np.cos(value) if column.cos_or_sin == "cos" else np.sin(value)
        return target_q

    def _from_target_q(self, target_q: FloatArray) -> FloatArray:
        q = self._recover_q(target_q)
        expected = self._to_target_q(q) if any(column.is_mimic for column in self._columns) else target_q
        _check_mimic_numbers(self._columns, target_q, expected, "q")
        return q

    def _recover_q(self, target_q: FloatArray) -> FloatArray:
        if self._same_q:
            return target_q
        source = self._q_target_index
        q: FloatArray = target_q[..., source]
        if not self._plain_q:
            q = (q - self._q_zero[source]) / self._q_factor[source]
        for at, k in enumerate(source):
            column = self._columns[k]
            if column.cos_or_sin:
                angle = _angle_of_column(target_q, k, column) - column.zero
                shown = self._find_shown_turns(target_q, column)
                angle = angle + math.tau * configuration.count_turns(angle, shown)
                q[..., at] = angle / column.factor
        return q

    def _find_shown_turns(
        self, target_q: FloatArray, source: _TargetNumber
    ) -> list[tuple[float, float, FloatArray, bool]]:
        """Return the arguments of `count_turns` for the mimic joints of a source column."""
        return [
            (
                column.factor / source.factor,
                column.zero,
                _angle_of_column(target_q, k, column) if column.cos_or_sin else target_q[..., k],
                bool(column.cos_or_sin),
            )
            for k, column in enumerate(self._columns)
            if column.is_mimic and column.index == source.index and column.cos_or_sin != "sin"
        ]

    def _to_target_rates(
        self, q: FloatArray, own_rates: FloatArray, v: FloatArray | None = None
    ) -> FloatArray:
        """Return M x + M' v for x = `own_rates`, or M x if `v` is None."""
        if self._same_v:
            return own_rates
        rates: FloatArray = own_rates[..., self._v_index]
        if self._plain_v:
            return rates
        rates = rates * self._v_factor
        for block in self._blocks:
            own = slice(block.v_index, block.v_index + block.joint.kind.nv)
            B = self._block(block, q)
            part = _multiply(B, own_rates[..., own])
            if v is not None:
                part = part + _multiply(self._block(block, q, v[..., own]), v[..., own])
            rates = _replace_slice(rates, block.target_slice, part)
        return rates

    def _from_target_rates(
        self, q: FloatArray, target_rates: FloatArray, v: FloatArray | None = None
    ) -> FloatArray:
        """Return M^-1 (x - M' v) for x = `target_rates`, or M^-1 x if `v` is None."""
        if self._same_v:
            return target_rates
        rates: FloatArray = target_rates[..., self._v_target_index] / self._v_factor[self._v_target_index]
        expected = rates[..., self._v_index] * self._v_factor
        _check_mimic_numbers(self._rates, target_rates, expected, "v" if v is None else "a")
        for block in self._blocks:
            own = slice(block.v_index, block.v_index + block.joint.kind.nv)
            part = target_rates[..., block.target_slice]
            if v is not None:
                part = part - _multiply(self._block(block, q, v[..., own]), v[..., own])
            rates = _replace_slice(rates, own, _multiply(_inverse(self._block(block, q)), part))
        return rates

    # -- matrices ------------------------------------------------------------------------------------

    def matrix(self, q: ConfigurationLike | None = None) -> FloatArray:
        """Return the matrix M with v_tool = M v.

        Returns:
            (..., program's nv, nv) matrix.

        Raises:
            InputError: q is None, but M depends on q.
        """
        M = np.zeros((self.nv, self.tree.nv))
        M[np.arange(self.nv), self._v_index] = self._v_factor
        if not self._blocks:
            return M
        if self.is_constant:
            q = configuration.neutral(self.tree)
        elif q is None:
            raise InputError(
                "the matrix of a floating or planar joint depends on q",
                where=self.convention.name,
                remedy="pass q",
            )
        configurations = configuration.parse_finite(self.tree, q, "q")
        M = np.tile(M, (*configurations.shape[:-1], 1, 1))
        for block in self._blocks:
            M[..., block.target_slice, block.v_index : block.v_index + block.joint.kind.nv] = self._block(
                block, configurations
            )
        return M

    def matrix_rate(self, q: ConfigurationLike, v: ConfigurationLike) -> FloatArray:
        """Return M', the time derivative of `matrix`.

        Returns:
            (..., program's nv, nv) matrix.
        """
        configurations = configuration.parse_finite(self.tree, q, "q")
        velocities = configuration.parse_finite(self.tree, v, "v")
        shape = common_batch_shape((configurations.shape[:-1], velocities.shape[:-1]), "q and v")
        M_rate = np.zeros((*shape, self.nv, self.tree.nv))
        for block in self._blocks:
            own = slice(block.v_index, block.v_index + block.joint.kind.nv)
            M_rate[..., block.target_slice, own] = self._block(block, configurations, velocities[..., own])
        return M_rate

    def inverse_matrix(self, q: ConfigurationLike | None = None) -> FloatArray:
        """Return M^-1 with v = M^-1 v_tool.

        If v_tool contains a mimic joint and its mimicked joint, the mimic joint's column in M^-1 is 0.

        Returns:
            (..., nv, program's nv) matrix.
        """
        if not self._blocks:
            M_inverse = np.zeros((self.tree.nv, self.nv))
            M_inverse[np.arange(self.tree.nv), self._v_target_index] = (
                1.0 / self._v_factor[self._v_target_index]
            )
            return M_inverse
        M = self.matrix(q)
        M_inverse = np.zeros((*M.shape[:-2], self.tree.nv, self.nv))
        M_inverse[..., self._v_target_index] = _inverse(M[..., self._v_target_index, :])
        return M_inverse

    def _block(self, block: _FreeJoint, q: FloatArray, v: FloatArray | None = None) -> FloatArray:
        """Return the joint's part (..., 3, 3) or (..., 6, 6) of `matrix`, or the part's time derivative.

        `q` is the robot's q. `v` is the joint's velocity, which only the derivative needs.
        """
        how, unit = self.convention, self.convention.angle_factor
        if block.joint.kind is JointKind.PLANAR:
            angle = q[..., block.q_index + 2]
            cosine, sine = np.cos(angle), np.sin(angle)
            if v is not None:
                cosine, sine, unit = -sine * v[..., 2], cosine * v[..., 2], 0.0
            B = np.zeros((*cosine.shape, 3, 3))
            B[..., 0, 0] = B[..., 1, 1] = cosine
            B[..., 1, 0], B[..., 0, 1], B[..., 2, 2] = sine, -sine, unit
            return B
        assert block.joint.kind is JointKind.FLOATING
        if block.velocity_point is None:
            raise InputError(
                "velocities of a centre of mass need masses; urdfkin reads masses only from a URDF file",
                where=f"{how.name}: joint {block.joint.name}",
                remedy='load a URDF file, or write a convention file with point = "origin"',
            )
        R, own_axes = rotation_from_quaternion(q[..., block.q_index + 3 : block.q_index + 7]), np.eye(3)
        if v is not None:
            R, own_axes = R @ skew(v[..., 3:]), np.zeros((3, 3))
        own_axes = np.broadcast_to(own_axes, R.shape)
        A = R if how.linear == "parent" else own_axes
        turn = R if how.angular == "parent" else own_axes
        return self._assemble_block(A, -A @ skew(block.velocity_point), unit * turn)

    def _assemble_block(self, linear: FloatArray, lever: FloatArray, angular: FloatArray) -> FloatArray:
        B = np.zeros((*linear.shape[:-2], 6, 6))
        B[..., :3, :3], B[..., :3, 3:], B[..., 3:, 3:] = linear, lever, angular
        return B if self.convention.base_v == "linear first" else B[..., _ANGULAR_FIRST, :]

    # -- results -------------------------------------------------------------------------------------

    def reorder_six_vector(self, x: ArrayLike, axis: int = -1) -> FloatArray:
        """Convert six-vectors to the target program's order of linear and angular part.

        A second call restores the original order.

        >>> import urdfkin
        >>> drake = urdfkin.load("planar_two_link").convention("drake")
        >>> drake.reorder_six_vector([1, 2, 3, 4, 5, 6]).tolist()
        [4.0, 5.0, 6.0, 1.0, 2.0, 3.0]
        """
        array = as_floats(x, "six-vectors")
        axis = as_int(axis, "axis", -max(1, array.ndim), max(1, array.ndim) - 1)
        if array.ndim < 1 or array.shape[axis] != 6:
            raise InputError("a six-vector must have six numbers", found=f"shape {array.shape}")
        return np.take(array, _ANGULAR_FIRST, axis) if self.angular_first else array

    def jacobian(self, q: ConfigurationLike, J: ArrayLike) -> FloatArray:
        """Convert a Jacobian J (..., 6, nv) to S J M^-1."""
        return self.columns(q, self.reorder_six_vector(_as_matrices(J, "J", self.tree.nv), -2))

    def columns(self, q: ConfigurationLike, J: ArrayLike) -> FloatArray:
        """Convert the columns of a matrix J to the target program, as J M^-1.

        Each row of J must have the same meaning in both conventions.

        Args:
            q: Configuration.
            J: (..., rows, nv) matrix.

        Raises:
            InputError: The target program has additional columns for mimic joints, or J has not nv columns.
        """
        self._refuse_mimic_columns()
        array = _as_matrices(J, "J", self.tree.nv)
        if self._plain_v:
            return array if self._same_v else array[..., self._v_index]
        return array @ _add_frame_axis(self.inverse_matrix(q), array.ndim)

    def from_jacobian(self, q: ConfigurationLike, J: ArrayLike) -> FloatArray:
        """Convert the target program's Jacobian J to urdfkin's Jacobian S J M.

        The column of a mimic joint is added to the mimicked joint's column.

        Args:
            q: Configuration.
            J: (..., 6, program's nv) Jacobian.
        """
        array = self.reorder_six_vector(_as_matrices(J, "J", self.nv), -2)
        return array @ _add_frame_axis(self.matrix(q), array.ndim)

    def jacobian_rate(
        self, q: ConfigurationLike, v: ConfigurationLike, J: ArrayLike, rate: ArrayLike
    ) -> FloatArray:
        """Convert the time derivative J' of urdfkin's Jacobian J to the target program.

        The result is `S (J' M^-1 + J (M^-1)')`.
        """
        converted = self.jacobian(q, rate)
        if self.is_constant:
            return converted
        inverse = self.inverse_matrix(q)
        change = -inverse @ self.matrix_rate(q, v) @ inverse
        # v can have more batch axes than J.
        return converted + self.reorder_six_vector(J, -2) @ _add_frame_axis(change, converted.ndim)

    def hessian(self, q: ConfigurationLike, J: ArrayLike, H: ArrayLike) -> FloatArray:
        """Convert urdfkin's kinematic Hessian to the target program's Hessian.

        Args:
            q: Configuration.
            J: (..., 6, nv) Jacobian.
            H: (..., 6, nv, nv) derivatives of J with respect to the joint motions.
        """
        self._refuse_mimic_columns()
        inverse, tensor, columns = (
            self.inverse_matrix(q),
            self.reorder_six_vector(_as_matrices(H, "H", self.tree.nv, self.tree.nv), -3),
            self.reorder_six_vector(_as_matrices(J, "J", self.tree.nv), -2),
        )
        W = _add_frame_axis(inverse, columns.ndim)
        converted: FloatArray = np.einsum("...rkl,...ki,...lj->...rij", tensor, W, W)
        if not self.is_constant:
            change = np.zeros((*inverse.shape, self.nv))
            for j in range(self.nv):
                along = self.matrix_rate(q, inverse[..., j])
                change[..., j] = -inverse @ along @ inverse
            lifted = change if columns.ndim == change.ndim - 1 else change[..., None, :, :, :]
            converted += np.asarray(np.einsum("...rk,...kij->...rij", columns, lifted), dtype=np.float64)
        return converted

    def convert_result(
        self,
        quantity: str,
        inputs: Sequence[FloatArray],
        result: FloatArray,
        jacobian: Callable[[], FloatArray],
    ) -> FloatArray:
        """Convert a result to the target program's rows and columns.

        Args:
            quantity: Name of the quantity, for example "velocity".
            inputs: The inputs of the quantity (q, v and a), in urdfkin's convention.
            result: The quantity in urdfkin's convention.
            jacobian: Computes the Jacobian, which only "jacobian rate" and "hessian" need.

        Raises:
            InputError: No convention defines the quantity.
        """
        if quantity == "placement":
            return result
        if quantity in ("velocity", "acceleration"):
            return self.reorder_six_vector(result)
        if quantity == "jacobian":
            return self.jacobian(inputs[0], result)
        if quantity == "jacobian rate":
            return self.jacobian_rate(inputs[0], inputs[1], jacobian(), result)
        if quantity == "hessian":
            return self.hessian(inputs[0], jacobian(), result)
        raise InputError(
            "a convention does not define how to convert this quantity",
            where=self.convention.name,
            found=quantity,
        )

    def _refuse_mimic_columns(self) -> None:
        copies = (
            rate.name for k, rate in enumerate(self._rates) if rate.is_mimic and k not in self._v_target_index
        )
        if (name := next(copies, None)) is not None:
            raise InputError(
                f"{self.convention.title or self.convention.name} has a Jacobian column for each mimic"
                " joint, but urdfkin adds this column to the mimicked joint's column",
                where=f"joint {name}",
                remedy="load with mimic=False (--no-mimic)",
                question=QuestionsSection.MIMIC_JOINTS,
            )


@dataclass(frozen=True, slots=True)
class Reordering:
    """The conversion of q or v from one convention to another.

    A vector x with `size` elements is converted to `x[..., index] * factor + zero`.
    """

    index: tuple[int, ...]
    factor: tuple[float, ...]
    zero: tuple[float, ...]
    size: int

    def code(self, target: str, source: str) -> str:
        """Return a line of NumPy code for the conversion.

        >>> Reordering((1, 0), (1.0, 1.0), (0.0, 0.0), 2).code("q_b", "q_a")
        'q_b = q_a[..., [1, 0]]'
        """
        same = self.index == tuple(range(self.size))
        line = source if same else f"{source}[..., {list(self.index)}]"
        if any(factor != 1.0 for factor in self.factor):
            line += f" * np.array({list(self.factor)})"
        if any(self.zero):
            line += f" + np.array({list(self.zero)})"
        return f"{target} = {line}"


def find_reordering(symbol: str, start: Conversion, end: Conversion) -> Reordering | None:
    """Return the reordering that converts "q" or "v" from one convention to another, or None.

    The result is None if the robot has one of these numbers:

    - an angle that only one convention stores as cosine and sine
    - the cosine and sine of an angle with different signs or zeros in the two conventions
    - the velocity of a planar or floating joint, with different axes or points in the two conventions

    >>> import urdfkin
    >>> robot = urdfkin.load("a1", verify=False)
    >>> find_reordering("q", robot.convention("isaaclab"), robot.convention("mujoco")).index
    (1, 5, 9, 0, 4, 8, 3, 7, 11, 2, 6, 10)
    """
    if symbol == "q":
        if start.convention.continuous != end.convention.continuous and (start.has_pairs or end.has_pairs):
            return None
        own, other = start._columns, end._columns
        index = tuple(k for x in other if (k := _find_source(own, x)) is not None)
        if len(index) < len(other) or any(
            x.cos_or_sin and (x.factor, x.zero) != (own[k].factor, own[k].zero)
            for k, x in zip(index, other, strict=True)
        ):
            return None
        factor = [
            1.0 if x.cos_or_sin else x.factor / own[k].factor for k, x in zip(index, other, strict=True)
        ]
        zero = [
            0.0 if x.cos_or_sin else x.zero - own[k].zero * f
            for k, x, f in zip(index, other, factor, strict=True)
        ]
        return Reordering(index, tuple(factor), tuple(zero), start.nq)
    axes = ("linear", "angular", "point", "planar")
    if any(getattr(start.convention, axis) != getattr(end.convention, axis) for axis in axes) and (
        start._blocks or end._blocks
    ):
        return None
    index = tuple(start._v_target_index[rate.index] for rate in end._rates)
    pairs = zip(end._rates, index, strict=True)
    factors = tuple(rate.factor / start._rates[k].factor for rate, k in pairs)
    return Reordering(index, factors, (0.0,) * len(index), start.nv)


def _find_source(numbers: Sequence[_TargetNumber], target: _TargetNumber) -> int | None:
    """Return the index of a number that determines `target`, or None.

    Independent joints are preferred to mimic joints.
    """
    candidates = (
        k
        for k, x in enumerate(numbers)
        if (x.index, x.cos_or_sin) == (target.index, target.cos_or_sin) and x.factor
    )
    return min(candidates, key=lambda k: numbers[k].is_mimic, default=None)


def _target_indices(numbers: Sequence[_TargetNumber], count: int) -> list[int]:
    """Return an index in `numbers` for each of urdfkin's coordinates.

    Independent joints are preferred to mimic joints.
    """
    return [
        min(
            (k for k, x in enumerate(numbers) if x.index == at and x.factor),
            key=lambda k: numbers[k].is_mimic,
        )
        for at in range(count)
    ]


def _angle_of_column(target_q: FloatArray, k: int, column: _TargetNumber) -> FloatArray:
    return configuration.angle_of_pair(target_q[..., k], target_q[..., k + 1], column.name)


def _check_mimic_numbers(
    numbers: Sequence[_TargetNumber], found: FloatArray, expected: FloatArray, symbol: str
) -> None:
    for k, number in enumerate(numbers):
        if not number.is_mimic:
            continue
        difference = np.abs(found[..., k] - expected[..., k])
        allowed = _MIMIC_TOLERANCE * np.maximum(max(1.0, abs(number.factor)), np.abs(expected[..., k]))
        if (difference > allowed).any():
            raise InputError(
                "the value of a mimic joint contradicts its mimic rule",
                where=f"{symbol}, {number.name}",
                found=f"a difference of {difference.max():.3g}, in the unit of this value in the convention",
                remedy="correct the value, or load with mimic=False (--no-mimic)",
                question=QuestionsSection.MIMIC_JOINTS,
            )


def _as_matrices(value: ArrayLike, name: str, *columns: int) -> FloatArray:
    array, n = as_floats(value, name), len(columns)
    if array.ndim <= n or array.shape[-n:] != columns:
        shape = ", ".join(map(str, ("...", "rows", *columns)))
        raise InputError(f"{name} must have the shape ({shape})", found=str(array.shape))
    return array


def _multiply(B: FloatArray, x: FloatArray) -> FloatArray:
    return (B @ x[..., np.newaxis])[..., 0]


def _inverse(B: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(B), dtype=np.float64)


def _replace_slice(array: FloatArray, where: slice, part: FloatArray) -> FloatArray:
    shape = np.broadcast_shapes(array.shape[:-1], part.shape[:-1])
    if array.shape[:-1] != shape:
        array = np.broadcast_to(array, (*shape, array.shape[-1])).copy()
    array[..., where] = part
    return array


def _add_frame_axis(M: FloatArray, ndim: int) -> FloatArray:
    """Reshape a batch of matrices to (..., 1, k, l) for Jacobians of several frames."""
    return M[..., np.newaxis, :, :] if M.ndim > 2 and ndim == M.ndim + 1 else M
