"""The way from a base to a tip as elementary motions, of which some are parameters and some are joints.

Every model here is a product of constants and of motions about or along a coordinate axis of the frame that
they are met in,

    T_base_tip = C_0 E_1 C_1 E_2 C_2 ...,      E_k = R_x(phi), T_x(s), R_y(phi), ...

a URDF's origins as well as the rows of a Denavit-Hartenberg table. A motion by the parameter p moves the tip
by a twist, like a joint's: with e the axis and O its origin, both in the base,

    turning   dp_tip/dp = e x (p_tip - O),   w = e;       sliding   dp_tip/dp = e,   w = 0

which is a column of 7.85. A joint that turns (1 + g) times as far as it says has g for a parameter, and its
column is the joint's times the joint's value.


A URDF's path and a Denavit-Hartenberg table as ways with parameters, and what they are when these move.

**Of a URDF** each joint of the path has the six of its origin: with A the turn that makes its axis z, the
origin becomes  T . A . Tx(x) Ty(y) Tz(z) Rx(rx) Ry(ry) Rz(rz) . A^-1. So z slides along the joint's axis and
rz turns about it, which is the joint's zero, whatever axis the file gives it; the four others move the axis.
A joint's gain, the seventh, is no number of a URDF. `base` and `tool` are six likewise, before the first
constant and after the last: where the instrument stands and what it looks at.

**Of a table** each row has its cells, and beta where its axis is parallel to the next within `PARALLEL`
(Hayati's fifth number: there d says nothing, and alpha alone cannot tilt the axis both ways).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from urdfkin.compiled.plan import turned
from urdfkin.dh.table import Convention, DHRow, DHTable
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.errors.escape import log_line
from urdfkin.kinematics.number_kinds import array_equations as eq
from urdfkin.kinematics.rotation.euler import coordinate_rotation
from urdfkin.kinematics.roundings import EPS, ROUNDINGS
from urdfkin.model.chain import FrameChain, chain, steps_between
from urdfkin.model.mimic import Coupling
from urdfkin.model.pose import inverse, pose
from urdfkin.model.tree import FloatArray, Joint, KinematicTree


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of a model.

    Attributes:
        where: "base", "tool", or the name of a joint.
        what: "x", "rx" and so on of an origin, "gain"; or a cell of a table: "theta", "d", ...
        unit: "m", "rad", or "" for a gain.
        end: Whether `where` is one of the ends, and no joint of that name.
    """

    where: str
    what: str
    unit: str
    end: bool = False

    def __str__(self) -> str:
        return log_line(f"{self.where} {self.what}")


@dataclass(frozen=True, slots=True)
class Motion:
    """A turn about, or a slide along, a coordinate axis of the frame in which it is met.

    Attributes:
        axis: 0, 1 or 2.
        turns: Whether it turns.
        parameter: Which parameter it is; of a joint, which one its gain is. None: neither.
        joint: Which joint it is; None for a parameter.
        sense: -1 where it is passed backwards, or a row counts the other way.
    """

    axis: int
    turns: bool
    parameter: int | None
    joint: int | None = None
    sense: float = 1.0


@dataclass(frozen=True, eq=False)
class ParametricChain:
    """A model as it depends on its parameters and on its joints' values.

    Attributes:
        steps: (4, 4) constants and motions, base to tip.
        parameters: What can be moved, each once in the steps.
        start: (p,) their values in the model as it is.
    """

    steps: tuple[FloatArray | Motion, ...]
    parameters: tuple[Parameter, ...]
    start: FloatArray

    @property
    def size(self) -> float:
        """Metres: all lengths of the model added up, 1 if there are none: what a radian counts as much as."""
        lengths = [float(np.linalg.norm(step[:3, 3])) for step in self.steps if not isinstance(step, Motion)]
        slides = sum(
            abs(self.start[k]) for k, parameter in enumerate(self.parameters) if parameter.unit == "m"
        )
        return sum(lengths) + float(slides) or 1.0

    def poses(self, values: FloatArray, at: FloatArray | None = None) -> FloatArray:
        """(s, 4, 4) of the tip in the base for joint values (s, n), the parameters at `at` (p,)."""
        return self._walked(values, self.start if at is None else at)[0]

    def columns(self, values: FloatArray, at: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """Poses (s, 4, 4), and (s, 6, p): how the tip [linear; angular] moves with each parameter."""
        T, origins, axes, factors = self._walked(values, self.start if at is None else at)
        columns = np.zeros((len(values), 6, len(self.parameters)))
        for k, turns in self._turning.items():
            linear, angular = axes[k], np.zeros_like(axes[k])
            if turns:
                linear, angular = eq.turning_column(axes[k], T[:, :3, 3] - origins[k])
            columns[:, :, k] = factors[k] * np.hstack([linear, angular])
        return T, columns

    @property
    def _turning(self) -> dict[int, bool]:
        return {
            step.parameter: step.turns
            for step in self.steps
            if isinstance(step, Motion) and step.parameter is not None
        }

    def _walked(
        self, values: FloatArray, at: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Tip poses; then origins and axes (p, s, 3) and factors (p, s, 1) of the parameters' motions."""
        p, s = len(self.parameters), len(values)
        origins, axes, factors = np.zeros((p, s, 3)), np.zeros((p, s, 3)), np.ones((p, s, 1))
        T = np.broadcast_to(np.eye(4), (s, 4, 4)).copy()
        for step in self.steps:
            if not isinstance(step, Motion):
                T = T @ step
                continue
            amount = np.full(s, step.sense) if step.joint is None else step.sense * values[:, step.joint]
            if (k := step.parameter) is not None:
                origins[k], axes[k], factors[k] = T[:, :3, 3], T[:, :3, step.axis], amount[:, np.newaxis]
                amount = amount * (at[k] if step.joint is None else 1.0 + at[k])
            T = _moved(T, step, amount)
        return T, origins, axes, factors

    def rounding(self, values: FloatArray) -> float:
        """How far (m; divided by `size`, rad) rounding may put a number of `columns`, two factors each."""
        slid = max((float(np.abs(values[:, j]).max(initial=0.0)) for j in self._slides), default=0.0)
        return 2.0 * ROUNDINGS * (len(self.steps) + 1) * EPS * (self.size + slid * len(self._slides))

    @property
    def _slides(self) -> list[int]:
        return [
            step.joint
            for step in self.steps
            if isinstance(step, Motion) and step.joint is not None and not step.turns
        ]


def _moved(T: FloatArray, step: Motion, amount: FloatArray) -> FloatArray:
    if step.turns:
        turned = T.copy()
        turned[:, :3, :3] = T[:, :3, :3] @ coordinate_rotation(step.axis, amount)
        return turned
    slid = T.copy()
    slid[:, :3, 3] += amount[:, np.newaxis] * T[:, :3, step.axis]
    return slid


#: Radians within which two axes of a table count as parallel: assembled arms are some mrad off, and where a
#: common normal is used, its foot is a link's length over this angle away.
PARALLEL = math.radians(5.0)

#: What can be fitted.
FITTED = ("base", "tool", "offsets", "origins", "gains")
#: An origin's six as they act: what each is called, whether it turns, and its axis.
SIX = (("x", False, 0), ("y", False, 1), ("z", False, 2), ("rx", True, 0), ("ry", True, 1), ("rz", True, 2))
_ALL = tuple(what for what, *_ in SIX)
#: The order in which they are kept where some do what others do, of a joint that turns and of one that
#: slides: the joint's zero, what moves its axis, what only moves its frame.
_KEPT = {True: ("rz", "x", "y", "rx", "ry", "z", "gain"), False: ("z", "rx", "ry", "x", "y", "rz", "gain")}
_ROW = (("theta", True, 2), ("d", False, 2), ("a", False, 0), ("alpha", True, 0), ("beta", True, 1))
_KEPT_CELLS = ("theta", "a", "alpha", "beta", "d", "gain")


@dataclass(frozen=True, eq=False)
class Model:
    """A way, and which of its parameters belong together.

    Attributes:
        way: Base to tip.
        groups: Numbers of the parameters of each place, in the order in which they are kept.
        coupling: From the path's coordinates to its joints' values.
        base: The frame where it starts.
        tip: The frame where it ends.
        source: What it was made of: tree, or table.
    """

    way: ParametricChain
    groups: tuple[tuple[int, ...], ...]
    coupling: Coupling
    base: str
    tip: str
    source: KinematicTree | DHTable

    def end(self, which: str, at: FloatArray) -> FloatArray | None:
        """(4, 4) of the base or tool at parameters (p,); None where it is none of them."""
        if not any(parameter.end and parameter.where == which for parameter in self.way.parameters):
            return None
        return self._push(which, at, end=True)

    def origins(self, at: FloatArray) -> dict[str, FloatArray]:
        """(4, 4) new origins of the URDF's joints that moved, by name."""
        found: dict[str, FloatArray] = {}
        if not isinstance(self.source, KinematicTree):
            return found
        for name in dict.fromkeys(p.where for p in self.way.parameters if not p.end):
            push = self._push(name, at)
            if (push != np.eye(4)).any():
                joint = self.source.joints[self.source.joint_index(name)]
                A = turned(joint)
                found[name] = joint.T_parent_joint @ A @ push @ A.T
        return found

    def table(self, at: FloatArray) -> DHTable | None:
        """The table with its parameters at `at`; None for a URDF's model."""
        if not isinstance(self.source, DHTable):
            return None
        cells = {(p.where, p.what): float(at[k]) for k, p in enumerate(self.way.parameters) if not p.end}

        def moved(row: DHRow) -> DHRow:
            theta, d, a, alpha, beta = (cells.get((row.joint, cell), getattr(row, cell)) for cell, *_ in _ROW)
            return replace(row, theta=theta, d=d, a=a, alpha=alpha, beta=beta)

        rows = [moved(row) for row in self.source.rows]
        ends = [self._push(end, at, end=True) for end in ("base", "tool")]
        T_base, T_tool = ends[0] @ self.source.base, self.source.tool @ ends[1]
        return replace(self.source, rows=tuple(rows), base=T_base, tool=T_tool, snap=None)

    def _push(self, where: str, at: FloatArray, *, end: bool = False) -> FloatArray:
        """(4, 4) what the six of a place, those that are there, do together."""
        parameters = enumerate(self.way.parameters)
        values = {p.what: float(at[k]) for k, p in parameters if (p.where, p.end) == (where, end)}
        push = np.eye(4)
        for what, turns, axis in SIX:
            if what in values:
                push = push @ elementary(turns, axis, values[what])
        return push


class _Maker:
    """Collects steps and parameters on the way from base to tip."""

    def __init__(self, fit: Collection[str]) -> None:
        for name in fit:
            if name not in FITTED:
                raise UnknownNameError("set of parameters", name, FITTED)
        if not fit:
            raise InputError("nothing is to be fitted", remedy=f"there are {', '.join(FITTED)}")
        self.fit = fit
        self.steps: list[FloatArray | Motion] = []
        self.parameters: list[Parameter] = []
        self.start: list[float] = []

    def parameter(self, where: str, what: str, unit: str, value: float = 0.0, *, end: bool = False) -> int:
        self.parameters.append(Parameter(where, what, unit, end))
        self.start.append(value)
        return len(self.parameters) - 1

    def end(self, which: str) -> None:
        """The six of the base or the tool, where they are wanted."""
        if which in self.fit:
            self.push(which, _ALL, end=True)

    def push(self, where: str, only: Collection[str], *, backwards: bool = False, end: bool = False) -> None:
        """The six of a place, or some of them."""
        moves = [
            Motion(axis, turns, self.parameter(where, what, "rad" if turns else "m", end=end))
            for what, turns, axis in SIX
            if what in only
        ]
        self.steps += [replace(move, sense=-1.0) for move in reversed(moves)] if backwards else moves

    def joint(self, where: str, number: int, *, turns: bool, sense: float) -> None:
        gain = self.parameter(where, "gain", "") if "gains" in self.fit else None
        self.steps.append(Motion(2, turns, gain, number, sense))

    def model(
        self,
        source: KinematicTree | DHTable,
        path: FrameChain | DHTable,
        ends: tuple[str, str],
        kept: Mapping[str, tuple[str, ...]],
    ) -> Model:
        """All of it; `kept` says by place in which order its parameters are."""
        at = {(p.where, p.end, p.what): k for k, p in enumerate(self.parameters)}
        # Of the ends nothing is known, of the joints nearly everything: the ends take what they can.
        places = dict.fromkeys((p.where, p.end) for p in self.parameters)
        groups = tuple(
            tuple(at[*place, what] for what in kept.get(place[0], _KEPT[True]) if (*place, what) in at)
            for place in sorted(places, key=lambda place: not place[1])
        )
        way = ParametricChain(tuple(self.steps), tuple(self.parameters), np.array(self.start))
        return Model(way, groups, path.coupling, *ends, source)


def urdf_model(tree: KinematicTree, tip: str, base: str, fit: Collection[str]) -> Model:
    """The path of a URDF, with what is to be fitted of it.

    The fixed joint that is the last before the tip has an origin as well; other fixed joints stand still:
    what they could do the moving ones next to them do.

    Raises:
        UnknownNameError: no such frame, or no such set of parameters.
        InputError: a planar or floating joint on the way.
    """
    path: FrameChain = chain(tree, tip, base)
    maker, number = _Maker(fit), 0
    maker.end("base")
    steps = steps_between(tree, tip, base)
    last = max((i for i, (joint, _) in enumerate(steps) if joint.kind.has_axis), default=-1)
    ending = {len(steps) - 1} if last < len(steps) - 1 else set()
    for i, (joint, backwards) in enumerate(steps):
        A = turned(joint)
        wanted = _wanted(fit, joint, ending=i in ending)
        if backwards:
            maker.steps.append(A)
            if joint.kind.has_axis:
                maker.joint(joint.name, number, turns=joint.kind.turns, sense=-1.0)
            maker.push(joint.name, wanted, backwards=True)
            maker.steps.append(inverse(joint.T_parent_joint @ A))
        else:
            maker.steps.append(joint.T_parent_joint @ A)
            maker.push(joint.name, wanted)
            if joint.kind.has_axis:
                maker.joint(joint.name, number, turns=joint.kind.turns, sense=1.0)
            maker.steps.append(A.T)
        number += joint.kind.has_axis
    maker.end("tool")
    kept = {joint.name: _KEPT[joint.kind.turns or not joint.kind.has_axis] for joint, _ in steps}
    return maker.model(tree, path, (base, tip), kept)


def _wanted(fit: Collection[str], joint: Joint, *, ending: bool) -> Collection[str]:
    if "origins" in fit and (joint.kind.has_axis or ending):
        return _ALL
    own = "rz" if joint.kind.turns else "z"
    return (own,) if "offsets" in fit and joint.kind.has_axis else ()


def table_model(table: DHTable, fit: Collection[str]) -> Model:
    """A table, with what is to be fitted of it: "origins" are all cells, "offsets" those beside the values.

    Raises:
        UnknownNameError: no such set of parameters.
    """
    maker = _Maker(fit)
    maker.end("base")
    maker.steps.append(table.base)
    for i, row in enumerate(table.rows):
        own = "theta" if row.kind.turns else "d"
        cells = dict(zip(("a", "alpha", "d", "theta", "beta"), row.cells, strict=True))
        alone = abs(math.sin(row.alpha)) > PARALLEL and not row.beta
        motions = list[FloatArray | Motion]()
        for cell, turns, axis in _ROW:
            fitted = "origins" in fit and not (cell == "beta" and alone)
            if fitted or ("offsets" in fit and cell == own):
                unit = "rad" if turns else "m"
                motions.append(Motion(axis, turns, maker.parameter(row.joint, cell, unit, cells[cell])))
            else:
                motions.append(elementary(turns, axis, cells[cell]))
        gain = maker.parameter(row.joint, "gain", "") if "gains" in fit else None
        along = [*motions[:2], Motion(2, row.kind.turns, gain, i, float(row.sense))]
        between = motions[2:]
        standard = table.convention is Convention.STANDARD
        maker.steps += [*along, *between] if standard else [*between, *along]
    maker.steps.append(table.tool)
    maker.end("tool")
    kept = dict.fromkeys((row.joint for row in table.rows), _KEPT_CELLS)
    return maker.model(table, table, (table.base_frame, table.tip_frame), kept)


def elementary(turns: bool, axis: int, value: float) -> FloatArray:
    """(4, 4) a turn about, or a slide along, a coordinate axis."""
    return (
        pose(coordinate_rotation(axis, np.array(value)))
        if turns
        else pose(p=np.where(np.arange(3) == axis, value, 0.0))
    )
