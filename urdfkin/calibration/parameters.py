"""Model a path by parameters, and compute the Jacobian of the tip's pose with respect to the parameters.

The parameters are numbers of a URDF's joint origins, or cells of a Denavit-Hartenberg table. A model is a
path (`urdfkin.model.path`): a product of constant poses and elementary motions. Both a joint origin and a row
of a table have this form. An elementary motion is a rotation by an angle or a translation by a length. The
angle or length is a parameter or the value of a joint. A joint can have a gain g:

    q              value of the joint
    (1 + g) q      angle or length of the joint's motion
    D              derivative of the tip's pose by this angle or length
    q D            derivative of the tip's pose by g

**URDF.** Each moving joint of the path has six parameters, which change the joint's origin. A fixed joint at
an end of the path has the same six parameters in two cases:

- The fixed joint is directly before the tip.
- The fixed joint is directly after the base, and the path leads from child to parent.

Other fixed joints have no parameters, because the parameters of a moving joint have the same effect.

    T                                                            original origin of the joint
    A                                                            rotation from the z axis to the joint's axis
    T . A . Tx(x) Ty(y) Tz(z) Rx(rx) Ry(ry) Rz(rz) . A^-1        new origin

The parameter z shifts the origin along the joint's axis. A change of rz changes the zero position of a
revolute joint. The other four parameters move the axis. The gain is a seventh parameter, which a URDF cannot
store. `base` and `tool` have six parameters each. The path begins with the motions of `base`: the pose of the
robot's base in the instrument's frame. The path ends with the motions of `tool`: the pose of the target in
the tip's frame.

**Table.** The parameters of a row are the row's cells. Hayati's beta is a fifth parameter in two cases:

- The row's axis and the next axis are parallel within `PARALLEL_TOLERANCE`.
- beta is not 0 in the original table.

In a row with parallel axes, d has the same effect as parameters of other rows. A tilt of the axis in any
direction needs both alpha and beta.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdfkin.compiled.plan import axis_pose
from urdfkin.dh.table import DHConvention, DHRow, DHTable
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.errors.escape import log_line
from urdfkin.kinematics.roundings import EPS, PINOCCHIO_ROUNDINGS
from urdfkin.model.chain import FrameChain, joints_between, make_chain
from urdfkin.model.mimic import Coupling
from urdfkin.model.path import ElementaryMotion, Path, elementary_pose
from urdfkin.model.tree import FloatArray, Joint, KinematicTree, inverse


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a model.

    Attributes:
        element: "base", "tool", or the name of a joint.
        name: "x", "rx", ..., "gain", or a cell of a table ("theta", "d", ...).
        unit: "m", "rad", or "" for a gain.
    """

    element: str
    name: str
    unit: str
    is_base_or_tool: bool = False

    def __str__(self) -> str:
        return log_line(f"{self.element} {self.name}")


@dataclass(frozen=True, slots=True)
class ParametricMotion(ElementaryMotion):
    """An elementary motion that depends on a parameter or a joint.

    Attributes:
        parameter: Index of the parameter. A joint's motion has the index of the gain; None without a gain.
        joint: Index of the joint; None if the angle or length does not depend on a joint.
        sense: Sign of the angle or length: -1 if the path leads from child to parent, or if the row subtracts
            the joint's value. Otherwise 1.
    """

    parameter: int | None
    joint: int | None = None
    sense: float = 1.0


@dataclass(frozen=True, eq=False)
class ParametricChain:
    """The pose of a tip as a function of parameters and joint values.

    Each parameter occurs once in the path.

    Attributes:
        initial_values: (p,) values in the original model.
    """

    path: Path
    parameters: tuple[Parameter, ...]
    initial_values: FloatArray

    @cached_property
    def _parametric_motions(self) -> list[ParametricMotion]:
        return [step for step in self.path.steps if isinstance(step, ParametricMotion)]

    @property
    def characteristic_length(self) -> float:
        """Length (m) that converts angles to distances: the sum of the model's lengths, or 1 if it is 0."""
        constant = [
            float(np.linalg.norm(step[:3, 3]))
            for step in self.path.steps
            if not isinstance(step, ElementaryMotion)
        ]
        fitted = [abs(x) for x, p in zip(self.initial_values, self.parameters, strict=True) if p.unit == "m"]
        return sum(constant) + float(sum(fitted)) or 1.0

    def poses(self, joint_values: FloatArray, parameter_values: FloatArray | None = None) -> FloatArray:
        """Return the tip's poses (s, 4, 4).

        The poses are in the instrument's frame if the model has `base` parameters, else in the base frame.
        """
        return self.path.poses(
            self._amounts_and_derivatives(
                joint_values, self.initial_values if parameter_values is None else parameter_values
            )[0]
        )

    def frames(self, joint_values: FloatArray, parameter_values: FloatArray) -> FloatArray:
        """Return the poses (s, steps, 4, 4) after each transform of the path; the last pose is the tip's."""
        return self.path.frames(self._amounts_and_derivatives(joint_values, parameter_values)[0])

    def poses_and_jacobian(
        self,
        joint_values: FloatArray,
        parameter_values: FloatArray | None = None,
        frames: FloatArray | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the tip's poses (s, 4, 4), and their Jacobian (s, 6, p) with respect to the parameters.

        The linear rows come first. `frames` is the result of the method `frames` if it has already been
        computed.
        """
        amounts, factors = self._amounts_and_derivatives(
            joint_values, self.initial_values if parameter_values is None else parameter_values
        )
        T, twists = self.path.pose_and_jacobian_from_frames(
            self.path.frames(amounts) if frames is None else frames
        )
        columns = np.zeros((len(joint_values), 6, len(self.parameters)))
        for k, motion in enumerate(self._parametric_motions):
            if motion.parameter is not None:
                columns[:, :, motion.parameter] = factors[:, k, np.newaxis] * twists[:, :, k]
        return T, columns

    def _amounts_and_derivatives(
        self, joint_values: FloatArray, parameter_values: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return angles or lengths (s, motions), and their derivatives with respect to the parameters."""
        factors = np.empty((len(joint_values), len(self._parametric_motions)))
        numbers = np.ones(len(self._parametric_motions))
        for k, motion in enumerate(self._parametric_motions):
            factors[:, k] = motion.sense * (1.0 if motion.joint is None else joint_values[:, motion.joint])
            if motion.parameter is not None:
                numbers[k] = parameter_values[motion.parameter] + (0.0 if motion.joint is None else 1.0)
        return factors * numbers, factors

    def rounding_bound(self, joint_values: FloatArray) -> float:
        """Bound the rounding error of each number from `poses_and_jacobian`.

        The bound is for positions (m). For angles (rad), divide the bound by `characteristic_length`.
        """
        slides = [
            motion.joint
            for motion in self._parametric_motions
            if motion.joint is not None and not motion.turns
        ]
        slid = max((float(np.abs(joint_values[:, j]).max(initial=0.0)) for j in slides), default=0.0)
        total_length = self.characteristic_length + slid * len(slides)
        return 2.0 * PINOCCHIO_ROUNDINGS * (len(self.path.steps) + 1) * EPS * total_length


#: Largest angle (rad) between two axes of a table that are treated as parallel. Parallel axes of a real arm
#: deviate by some milliradians.
PARALLEL_TOLERANCE = math.radians(5.0)

PARAMETER_SETS = ("base", "tool", "offsets", "origins", "gains")
#: (name, is_rotation, axis) of each parameter of a joint origin. The axes 0, 1 and 2 are x, y and z. The new
#: origin is the product of the motions in this order.
ORIGIN_PARAMETERS = (
    ("x", False, 0),
    ("y", False, 1),
    ("z", False, 2),
    ("rx", True, 0),
    ("ry", True, 1),
    ("rz", True, 2),
)
_ORIGIN_PARAMETER_NAMES = tuple(name for name, *_ in ORIGIN_PARAMETERS)
#: Parameters in order of preference. The key is False for a prismatic joint, and True for another joint, base
#: or tool. If several parameters have the same effect, the first of them is fitted and the others stay fixed.
#: The order is: zero position, axis, other numbers of the joint's frame, gain.
_ORIGIN_PREFERENCES = {
    True: ("rz", "x", "y", "rx", "ry", "z", "gain"),
    False: ("z", "rx", "ry", "x", "y", "rz", "gain"),
}
_CELLS = (("theta", True, 2), ("d", False, 2), ("a", False, 0), ("alpha", True, 0), ("beta", True, 1))
_CELL_PREFERENCES = ("theta", "a", "alpha", "beta", "d", "gain")


@dataclass(frozen=True, eq=False)
class CalibrationModel:
    """A parametric chain with grouped parameters.

    Attributes:
        parameter_groups: Parameter indices of the base, the tool and each joint, in order of preference.
    """

    chain: ParametricChain
    parameter_groups: tuple[tuple[int, ...], ...]
    coupling: Coupling
    base: str
    tip: str
    source: KinematicTree | DHTable

    def base_or_tool_pose(self, element: str, parameter_values: FloatArray) -> FloatArray | None:
        if not any(
            parameter.is_base_or_tool and parameter.element == element for parameter in self.chain.parameters
        ):
            return None
        return self._pose_change(element, parameter_values, is_base_or_tool=True)

    def origins(self, parameter_values: FloatArray) -> dict[str, FloatArray]:
        """Return the changed joint origins (4, 4) by joint name.

        The origin of a locked joint does not include the value at which the joint is locked.
        """
        found: dict[str, FloatArray] = {}
        if not isinstance(self.source, KinematicTree):
            return found
        for name in dict.fromkeys(p.element for p in self.chain.parameters if not p.is_base_or_tool):
            change = self._pose_change(name, parameter_values)
            if (change != np.eye(4)).any():
                joint = self.source.joints[self.source.joint_index(name)]
                A = axis_pose(joint)
                origin = joint.T_parent_joint @ A @ change @ A.T
                found[name] = origin if joint.lock is None else origin @ inverse(joint.lock.motion)
        return found

    def table(self, parameter_values: FloatArray) -> DHTable | None:
        if not isinstance(self.source, DHTable):
            return None
        cells = {
            (p.element, p.name): float(parameter_values[k])
            for k, p in enumerate(self.chain.parameters)
            if not p.is_base_or_tool
        }

        def update_row(row: DHRow) -> DHRow:
            theta, d, a, alpha, beta = (
                cells.get((row.joint, cell), getattr(row, cell)) for cell, *_ in _CELLS
            )
            return replace(row, theta=theta, d=d, a=a, alpha=alpha, beta=beta)

        rows = [update_row(row) for row in self.source.rows]
        ends = [self._pose_change(end, parameter_values, is_base_or_tool=True) for end in ("base", "tool")]
        T_base, T_tool = ends[0] @ self.source.base, self.source.tool @ ends[1]
        return replace(self.source, rows=tuple(rows), base=T_base, tool=T_tool, snap=None)

    def _pose_change(
        self, element: str, parameter_values: FloatArray, *, is_base_or_tool: bool = False
    ) -> FloatArray:
        """Return Tx(x) Ty(y) Tz(z) Rx(rx) Ry(ry) Rz(rz), (4, 4), of a joint, base or tool."""
        parameters = enumerate(self.chain.parameters)
        values = {
            p.name: float(parameter_values[k])
            for k, p in parameters
            if (p.element, p.is_base_or_tool) == (element, is_base_or_tool)
        }
        motion = np.eye(4)
        for name, turns, axis in ORIGIN_PARAMETERS:
            if name in values:
                motion = motion @ elementary_pose(axis, turns, values[name])
        return motion


class _ModelBuilder:
    def __init__(self, fit: Collection[str]) -> None:
        for name in fit:
            if name not in PARAMETER_SETS:
                raise UnknownNameError("set of parameters", name, PARAMETER_SETS)
        if not fit:
            raise InputError("no parameters to fit", remedy=f"choose among {', '.join(PARAMETER_SETS)}")
        self.fit = fit
        self.steps: list[FloatArray | ParametricMotion] = []
        self.parameters: list[Parameter] = []
        self.initial_values: list[float] = []

    def add_parameter(
        self, element: str, name: str, unit: str, value: float = 0.0, *, is_base_or_tool: bool = False
    ) -> int:
        self.parameters.append(Parameter(element, name, unit, is_base_or_tool))
        self.initial_values.append(value)
        return len(self.parameters) - 1

    def add_base_or_tool(self, element: str) -> None:
        if element in self.fit:
            self.add_origin(element, _ORIGIN_PARAMETER_NAMES, is_base_or_tool=True)

    def add_origin(
        self, element: str, only: Collection[str], *, backwards: bool = False, is_base_or_tool: bool = False
    ) -> None:
        motions = [
            ParametricMotion(
                axis,
                turns,
                self.add_parameter(element, name, "rad" if turns else "m", is_base_or_tool=is_base_or_tool),
            )
            for name, turns, axis in ORIGIN_PARAMETERS
            if name in only
        ]
        self.steps += [replace(one, sense=-1.0) for one in reversed(motions)] if backwards else motions

    def make_joint_motion(self, element: str, number: int, *, turns: bool, sense: float) -> ParametricMotion:
        gain = self.add_parameter(element, "gain", "") if "gains" in self.fit else None
        return ParametricMotion(2, turns, gain, number, sense)

    def build(
        self,
        source: KinematicTree | DHTable,
        path: FrameChain | DHTable,
        ends: tuple[str, str],
        preferences: Mapping[str, tuple[str, ...]],
    ) -> CalibrationModel:
        if not self.parameters:
            raise InputError(
                "the path has no parameters to fit",
                where=f"{ends[0]} to {ends[1]}",
                found=f"fit={', '.join(sorted(self.fit))}",
                remedy="choose a path with a joint, or add base or tool to the fit",
            )
        index_of = {(p.element, p.is_base_or_tool, p.name): k for k, p in enumerate(self.parameters)}
        # Base and tool come first, because only the joint parameters are nearly known before the fit. A fixed
        # joint comes last, as on a path from parent to child.
        owners = sorted(
            dict.fromkeys((p.element, p.is_base_or_tool) for p in self.parameters),
            key=lambda one: (not one[1], one[0] not in path.coupling.joints),
        )
        groups = tuple(
            tuple(
                index_of[element, is_base_or_tool, what]
                for what in (_ORIGIN_PREFERENCES[True] if is_base_or_tool else preferences[element])
                if (element, is_base_or_tool, what) in index_of
            )
            for element, is_base_or_tool in owners
        )
        chain = ParametricChain(
            Path(tuple(self.steps)), tuple(self.parameters), np.array(self.initial_values)
        )
        return CalibrationModel(chain, groups, path.coupling, *ends, source)


def make_urdf_model(tree: KinematicTree, tip: str, base: str, fit: Collection[str]) -> CalibrationModel:
    path: FrameChain = make_chain(tree, tip, base)
    builder, number = _ModelBuilder(fit), 0
    builder.add_base_or_tool("base")
    steps = joints_between(tree, tip, base)
    for i, (joint, backwards) in enumerate(steps):
        A = axis_pose(joint)
        # Parameters of a moving joint act on its parent's side.
        is_end = i == len(steps) - 1 or (i == 0 and backwards)
        only = _parameters_to_fit(fit, joint, is_end=is_end)
        if backwards:
            builder.steps.append(A)
            if joint.kind.has_axis:
                builder.steps.append(
                    builder.make_joint_motion(joint.name, number, turns=joint.kind.turns, sense=-1.0)
                )
            builder.add_origin(joint.name, only, backwards=True)
            builder.steps.append(inverse(joint.T_parent_joint @ A))
        else:
            builder.steps.append(joint.T_parent_joint @ A)
            builder.add_origin(joint.name, only)
            if joint.kind.has_axis:
                builder.steps.append(
                    builder.make_joint_motion(joint.name, number, turns=joint.kind.turns, sense=1.0)
                )
            builder.steps.append(A.T)
        number += joint.kind.has_axis
    builder.add_base_or_tool("tool")
    preferences = {
        joint.name: _ORIGIN_PREFERENCES[joint.kind.turns or not joint.kind.has_axis] for joint, _ in steps
    }
    return builder.build(tree, path, (base, tip), preferences)


def _parameters_to_fit(fit: Collection[str], joint: Joint, *, is_end: bool) -> Collection[str]:
    if "origins" in fit and (joint.kind.has_axis or is_end):
        return _ORIGIN_PARAMETER_NAMES
    own = "rz" if joint.kind.turns else "z"
    return (own,) if "offsets" in fit and joint.kind.has_axis else ()


def make_table_model(table: DHTable, fit: Collection[str]) -> CalibrationModel:
    builder = _ModelBuilder(fit)
    builder.add_base_or_tool("base")
    builder.steps.append(table.base)
    for i, row in enumerate(table.rows):
        own = "theta" if row.kind.turns else "d"
        cells = dict(zip(("a", "alpha", "d", "theta", "beta"), row.cells, strict=True))
        without_beta = abs(math.sin(row.alpha)) > PARALLEL_TOLERANCE and not row.beta
        motions = list[FloatArray | ParametricMotion]()
        for cell, turns, axis in _CELLS:
            is_fitted = "origins" in fit and not (cell == "beta" and without_beta)
            if is_fitted or ("offsets" in fit and cell == own):
                unit = "rad" if turns else "m"
                motions.append(
                    ParametricMotion(axis, turns, builder.add_parameter(row.joint, cell, unit, cells[cell]))
                )
            else:
                motions.append(elementary_pose(axis, turns, cells[cell]))
        joint = builder.make_joint_motion(row.joint, i, turns=row.kind.turns, sense=float(row.sense))
        along, between = [*motions[:2], joint], motions[2:]
        standard = table.convention is DHConvention.STANDARD
        builder.steps += [*along, *between] if standard else [*between, *along]
    builder.steps.append(table.tool)
    builder.add_base_or_tool("tool")
    preferences = dict.fromkeys((row.joint for row in table.rows), _CELL_PREFERENCES)
    return builder.build(table, table, (table.base_frame, table.tip_frame), preferences)
