"""One row of a table, and the two conventions in which rows are written.

The elementary transforms of Denavit and Hartenberg, for one row or for a batch.

Every table here is a product of two kinds of factors, in turns:

    S = Rz(theta) Tz(d)              along and about a joint's axis
    X = Tx(a) Rx(alpha) Ry(beta)     from one axis to the next; beta = 0 except in a Hayati row

Standard rows are S_i X_i, modified rows X_{i-1} S_i: the same factors, bracketed differently.


What snapping moved, said in metres and radians that are guaranteed, and measured besides.

Turning one constant rotation of the chain by an angle eps about a joint's origin moves the tip by at most
eps times the tip's distance from that origin. That distance never exceeds the length of the way: the sum of
the constant offsets in between and the travel of the sliding joints. The changes add up. The bound so holds
for every configuration; nothing in it was sampled.


The Denavit-Hartenberg table: rows, a base and a tool, in a convention that is always named.

Section 7.5 of the text. With S_i = Rz(theta_i) Tz(d_i) and X = Tx(a) Rx(alpha) Ry(beta):

    standard   T_base_tip = base . S_1 X_1 . S_2 X_2 ... S_n X_n . tool        (X_i from row i)
    modified   T_base_tip = base . X_0 S_1 . X_1 S_2 ... X_{n-1} S_n . tool    (X_{i-1} from row i)

The variable of row i is theta_i for a turning joint and d_i for a sliding one: the constant in the row plus
`sense` times the joint's value. The standard convention is the text's: joint i turns about z_{i-1}, and
d_{i-1,i} = d_i z_{i-1} + a_i x_i (7.64).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.dh.units import Units, units_of
from urdfkin.errors import InputError, Question
from urdfkin.errors.display import Displayable
from urdfkin.errors.escape import log_line
from urdfkin.kinematics.roundings import ANGLE, EPS, of_rows
from urdfkin.model.configuration_like import Given
from urdfkin.model.mimic import Coupling, coupling_of
from urdfkin.model.tree import FloatArray, JointKind, Limit, Mimic, frozen
from urdfkin.system.lazy_import import hook


class Convention(StrEnum):
    """Where a joint's axis stands: z_{i-1} (standard, distal) or z_i (modified, proximal, Craig)."""

    STANDARD = "standard"
    MODIFIED = "modified"


def convention_of(name: str) -> Convention:
    """The convention by name; raises InputError for anything else."""
    try:
        return Convention(name)
    except (ValueError, TypeError):
        raise InputError(
            "unknown convention",
            found=repr(name),
            remedy="say 'standard' or 'modified'",
            question=Question.WHICH_DH_CONVENTION,
        ) from None


@dataclass(frozen=True, slots=True)
class DHRow:
    """One joint: the constant parts of its parameters, metres and radians.

    Attributes:
        a: Length along x: a_i in a standard table, a_{i-1} in a modified one.
        alpha: Turn about x, likewise.
        d: Offset along the joint's axis; the joint's value is added for a prismatic joint.
        theta: Turn about the joint's axis; the joint's value is added for a turning joint.
        kind: Revolute, continuous or prismatic.
        joint: The joint's name.
        sense: +1, or -1 where the row counts the joint's value the other way.
        beta: Turn about y, after alpha: 0 except in a Hayati row.
        mimic: Whom the joint follows; None if it has a coordinate of its own.
        limit: Its bounds, None where there are none.
    """

    a: float
    alpha: float
    d: float
    theta: float
    kind: JointKind
    joint: str
    sense: int = 1
    beta: float = 0.0
    mimic: Mimic | None = None
    limit: Limit | None = None

    def __post_init__(self) -> None:
        where = f"row of joint {self.joint}"
        for name in ("a", "alpha", "d", "theta", "beta"):
            if not math.isfinite(getattr(self, name)):
                raise InputError(
                    f"{name} is not a finite number", where=where, found=str(getattr(self, name))
                )
        if self.sense not in (1, -1):
            raise InputError("the sense is +1 or -1", where=where, found=str(self.sense))
        if not self.kind.has_axis:
            raise InputError(
                "a row is a revolute, continuous or prismatic joint", where=where, found=self.kind.value
            )

    @property
    def cells(self) -> tuple[float, float, float, float, float]:
        """(a, alpha, d, theta, beta)."""
        return (self.a, self.alpha, self.d, self.theta, self.beta)

    @property
    def foot(self) -> float:
        """Metres: how far away four parameters would put the foot of this row's common normal.

        A Hayati row's x reaches the next axis at `a`, where that axis leans by `beta` along x and by `alpha`
        across. The common normal stands across both; its foot lies at a sin(beta) / sin^2(tilt).
        """
        across, along = math.sin(self.alpha) * math.cos(self.beta), math.sin(self.beta)
        return abs(self.a * along) / (across**2 + along**2) if self.beta else 0.0

    @property
    def X(self) -> FloatArray:
        """(4, 4) Tx(a) Rx(alpha) Ry(beta)."""
        return between_axes(self.a, self.alpha, self.beta)

    def S(self, value: ArrayLike = 0.0) -> FloatArray:
        """(..., 4, 4) Rz(theta) Tz(d) with the joint at `value`, rad or m."""
        moved = self.sense * np.asarray(value, dtype=np.float64)
        return (
            along_axis(self.theta + moved, self.d)
            if self.kind.turns
            else along_axis(self.theta, self.d + moved)
        )


#: How far from a multiple of 15 degrees people write one, as a share of 15 degrees.
_WRITTEN = 1e-3


def along_axis(theta: ArrayLike, d: ArrayLike) -> FloatArray:
    """(..., 4, 4) S = Rz(theta) Tz(d), radians and metres; the arguments are broadcast."""
    theta, d = np.broadcast_arrays(np.asarray(theta, np.float64), np.asarray(d, np.float64))
    S = np.zeros((*theta.shape, 4, 4))
    S[..., 0, 0] = S[..., 1, 1] = np.cos(theta)
    S[..., 1, 0] = np.sin(theta)
    S[..., 0, 1] = -S[..., 1, 0]
    S[..., 2, 2] = S[..., 3, 3] = 1.0
    S[..., 2, 3] = d
    return S


def between_axes(a: float, alpha: float, beta: float = 0.0) -> FloatArray:
    """(4, 4) X = Tx(a) Rx(alpha) Ry(beta), metres and radians."""
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    return np.array(
        [
            [cb, 0.0, sb, a],
            [sa * sb, ca, -sa * cb, 0.0],
            [-ca * sb, sa, ca * cb, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def as_step(T: FloatArray) -> tuple[float, float] | None:
    """(a, alpha) where a pose is Tx(a) Rx(alpha) to rounding of its rotation, else None.

    Example:
        >>> as_step(between_axes(0.5, math.pi))
        (0.5, 3.141592653589793)
    """
    crossed = (T[0, 1], T[0, 2], T[1, 0], T[2, 0])
    if max(map(abs, crossed)) > ANGLE * EPS or T[0, 0] < 0.0 or T[1, 3] or T[2, 3]:
        return None
    alpha = math.atan2(T[2, 1], T[2, 2])
    twelfth = nearest_twelfth(alpha)
    return float(T[0, 3]), wrapped(twelfth if abs(alpha - twelfth) <= ANGLE * EPS else alpha) + 0.0


def wrapped(angle: float) -> float:
    """The angle's representative in (-pi, pi], where a rounding error below -pi counts as pi.

    Example:
        >>> wrapped(-math.pi) == math.pi, wrapped(7.0) == 7.0 - 2 * math.pi
        (True, True)
    """
    turned = math.remainder(angle, 2.0 * math.pi)
    return math.pi if turned <= -math.pi * (1.0 - EPS) else turned


def looks_round(angle: float, twelfth: float = math.pi / 12.0) -> bool:
    """Whether an angle is a multiple of 15 degrees, and not 0, as far as people write them: 1.571 is.

    >>> looks_round(1.571), looks_round(0.0), looks_round(0.25), looks_round(90.0, twelfth=15.0)
    (True, False, False, True)
    """
    return abs(angle) > 0.5 * twelfth and abs(math.remainder(angle, twelfth)) <= _WRITTEN * twelfth


def nearest_twelfth(angle: float) -> float:
    """The multiple of pi/12 (15 degrees) nearest to an angle."""
    return round(angle * 12.0 / math.pi) * math.pi / 12.0


@dataclass(frozen=True, slots=True)
class SnapChange:
    """One constant rotation that was made round.

    Attributes:
        row: Index of the row in which it shows (0 is the first); -1 for the base, the number of rows for the
            tool.
        what: The joint and the quantity.
        angle: By how much everything beyond turned, radians.
        lever: Metres: the tip is never farther from the pivot than this while sliding joints are at zero.
        sliders: Names of the sliding joints beyond the pivot, whose travel lengthens the lever.
    """

    row: int
    what: str
    angle: float
    lever: float
    sliders: tuple[str, ...] = ()

    @property
    def tip(self) -> float:
        """Metres: how far this change moves the tip at most, with the sliding joints at zero."""
        return self.angle * self.lever


@dataclass(frozen=True, slots=True)
class SnapReport:
    """All that was snapped, and how far the tip moves.

    Attributes:
        tolerance: Radians, as asked for.
        changes: What was moved, base to tip.
        metres: Guaranteed: the tip's position moves by no more, within the limits of sliding joints.
        radians: Guaranteed: its orientation turns by no more.
        per_metre: What each metre of travel of a sliding joint adds, for joints without limits too.
        measured_metres: The largest displacement seen on samples.
        measured_radians: The largest turn seen on them.
        samples: How many.
    """

    tolerance: float
    changes: tuple[SnapChange, ...]
    metres: float
    radians: float
    per_metre: Mapping[str, float]
    measured_metres: float = 0.0
    measured_radians: float = 0.0
    samples: int = 0

    @property
    def rows(self) -> tuple[int, ...]:
        """Rows (from 0) that show a change, in order; -1 is the base, the number of rows the tool."""
        return tuple(sorted({change.row for change in self.changes}))

    def bound(self, values: Mapping[str, FloatArray]) -> FloatArray:
        """(...,) metres: the guarantee at given values (by joint name) of the sliding joints."""
        at_zero = sum(change.tip for change in self.changes)
        travel = [np.abs(values[name]) * rate for name, rate in self.per_metre.items()]
        return np.asarray(at_zero + sum(travel, np.zeros(())), dtype=np.float64)


#: How far the rotation of a pose may be from one: people type seven digits.
_TYPED = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class DHTable(Displayable):
    """A Denavit-Hartenberg table: data, and the products of its own matrices.

    `urdfkin.load` makes a robot of it; `urdfkin.dh` has its motion and its other forms.

    Attributes:
        convention: Standard or modified.
        rows: One for each moving joint, base to tip.
        base: (4, 4) T_base_0, constant, metres.
        tool: (4, 4) T_n_tip, constant, metres.
        robot: The robot's name.
        base_frame: What the base is called.
        tip_frame: What the tip is called.
        snap: What was moved to make cells round, and how far that moves the tip; None for an exact table.

    Raises:
        InputError: when two rows name one joint, or base or tool is no rigid transform.
    """

    convention: Convention
    rows: tuple[DHRow, ...]
    base: FloatArray = field(default_factory=lambda: np.eye(4))
    tool: FloatArray = field(default_factory=lambda: np.eye(4))
    robot: str = "robot"
    base_frame: str = "base"
    tip_frame: str = "tip"
    snap: SnapReport | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "convention", convention_of(self.convention))
        for name in ("base", "tool"):
            object.__setattr__(
                self, name, _rigid(getattr(self, name), f"{name} of the table of {self.robot}")
            )
        names = [row.joint for row in self.rows]
        for name in names:
            if names.count(name) > 1:
                raise InputError(
                    "two rows name the same joint", where=f"table of {self.robot}", found=repr(name)
                )

    # -- how it shows itself -------------------------------------------------------------------------

    def __repr__(self) -> str:
        ends = f"{self.base_frame} to {self.tip_frame}"
        return log_line(f"<DHTable {self.robot}: {ends}, {len(self.rows)} rows, {self.convention}>")

    def __str__(self) -> str:
        return "\n".join(map(log_line, self._written("terminal", units_of()).split("\n")))

    def to_markdown(self, angles: str = "radians", lengths: str = "metres", digits: int = 10) -> str:
        """The table in Markdown, for a README or an issue.

        Args:
            angles: "radians" (pi as a fraction where that is exact) or "degrees".
            lengths: "metres" or "millimetres".
            digits: Significant digits.

        Raises:
            InputError: no such unit.
        """
        return self._written("markdown", units_of(angles, lengths, digits))

    def to_latex(self, angles: str = "radians", lengths: str = "metres", digits: int = 10) -> str:
        """The table in LaTeX, for a paper; it needs booktabs and amsmath. Arguments as `to_markdown`."""
        return self._written("latex", units_of(angles, lengths, digits))

    def to_html(self, angles: str = "radians", lengths: str = "metres", digits: int = 10) -> str:
        """The table in HTML, to stand in a page. Arguments as `to_markdown`."""
        return self._written("html", units_of(angles, lengths, digits))

    def _written(self, form: str, units: Units) -> str:
        return str(hook("a table in a form")(self, form, units)).rstrip("\n")

    def _repr_html_(self) -> str:
        return self.to_html()

    def _repr_markdown_(self) -> str:
        return self.to_markdown()

    def _repr_latex_(self) -> str:
        return self.to_latex()

    # -- coordinates ---------------------------------------------------------------------------------

    @cached_property
    def coupling(self) -> Coupling:
        """How the table's coordinates move its joints."""
        return coupling_of([(row.joint, row.mimic, row.kind) for row in self.rows])

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The table's coordinates: its independent joints in row order, leaders of followers included."""
        return self.coupling.names

    # -- sizes ---------------------------------------------------------------------------------------

    @property
    def has_hayati_rows(self) -> bool:
        """Whether any row needs its fifth parameter, beta."""
        return any(row.beta != 0.0 for row in self.rows)

    @cached_property
    def span(self) -> float:
        """Metres: the sum of all |a| and |d| and of the tool's length, without any motion."""
        lengths = sum(abs(row.a) + abs(row.d) for row in self.rows)
        return lengths + math.hypot(*self.tool[:3, 3])

    def rounding(self, q: Given) -> FloatArray:
        """(...,) metres: what rounding may do to `placement(q)`; divided by `span`, radians.

        What the rows round (`urdfkin.kinematics.roundings`), and their angles, times the lever arm.
        """
        values = np.abs(self.coupling.values(q))
        turns = np.array([row.kind.turns for row in self.rows], dtype=bool)
        angle = values[..., turns].sum(axis=-1)
        lever = self.span + values[..., ~turns].sum(axis=-1) + float(np.linalg.norm(self.base[:3, 3]))
        return np.asarray(EPS * (of_rows(len(self.rows)) + angle) * lever)

    def tolerance(self, q: Given) -> tuple[FloatArray, FloatArray]:
        """(...,) metres and (...,) radians: how far `placement(q)` may be from the URDF's.

        That is rounding for an exact table; what snapping declares is added.
        """
        metres = self.rounding(q)
        radians = EPS * of_rows(len(self.rows)) + np.zeros_like(metres)
        if self.snap is None:
            return metres, radians
        values = self.coupling.values(q)
        by_name = {row.joint: values[..., i] for i, row in enumerate(self.rows)}
        return metres + self.snap.bound(by_name), radians + self.snap.radians

    # -- placement -----------------------------------------------------------------------------------

    def frames(self, q: Given | None = None) -> FloatArray:
        """(..., n + 1, 4, 4) poses of the frames 0 ... n in the base frame.

        Args:
            q: (..., coordinates) in the order of `joint_names`, or by name, as a mapping or text;
                None is all zero.

        Raises:
            InputError: `q` has the wrong length.
        """
        values = self.coupling.values(np.zeros(len(self.joint_names)) if q is None else q)
        poses = np.empty((*values.shape[:-1], len(self.rows) + 1, 4, 4))
        poses[..., 0, :, :] = self.base
        for i, row in enumerate(self.rows):
            S = row.S(values[..., i])
            step = S @ row.X if self.convention is Convention.STANDARD else row.X @ S
            poses[..., i + 1, :, :] = poses[..., i, :, :] @ step
        return poses

    def placement(self, q: Given) -> FloatArray:
        """(..., 4, 4) T_base_tip: base, rows and tool multiplied.

        Args:
            q: (..., coordinates) in the order of `joint_names`, rad or m, or by name, as a mapping or text.

        Raises:
            InputError: `q` has the wrong length.

        Example:
            >>> import math
            >>> from urdfkin.model.tree import JointKind
            >>> arm = DHTable(Convention.STANDARD, (DHRow(2.0, 0.0, 0.0, 0.0, JointKind.REVOLUTE, "j"),))
            >>> arm.placement([math.pi / 2])[:3, 3].round(12).tolist()
            [0.0, 2.0, 0.0]
        """
        return np.ascontiguousarray(self.frames(q)[..., -1, :, :] @ self.tool)


def _rigid(T: ArrayLike, where: str) -> FloatArray:
    """A read-only (4, 4) rigid transform; rejects what is none."""
    pose = frozen(T)
    if pose.shape != (4, 4) or not np.isfinite(pose).all():
        raise InputError(
            "a pose is a (4, 4) array of finite numbers", where=where, found=f"shape {pose.shape}"
        )
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is no rotation
        off = np.abs(pose[:3, :3].T @ pose[:3, :3] - np.eye(3)).max()
    if off > _TYPED or np.linalg.det(pose[:3, :3]) < 0.0 or pose[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
        raise InputError("a pose must be a rotation and a translation", where=where, found=str(pose.tolist()))
    return pose
