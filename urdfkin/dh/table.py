"""Define the Denavit-Hartenberg table: rows, base and tool, in the standard or the modified convention.

A table represents a product of two kinds of transforms (section 7.5 of the textbook):

    S = Rz(theta) Tz(d)              rotation about a joint's axis, and translation along this axis
    X = Tx(a) Rx(alpha) Ry(beta)     from one axis to the next; beta = 0 except in a Hayati row

The two conventions group these transforms differently into rows:

    standard   T_base_tip = base . S_1 X_1 . S_2 X_2 ... S_n X_n . tool
    modified   T_base_tip = base . X_0 S_1 . X_1 S_2 ... X_{n-1} S_n . tool

Row i contains S_i and one X: X_i in a standard table, X_{i-1} in a modified table. The variable of row i is
theta_i for a revolute joint and d_i for a prismatic joint. The value of the variable is the constant in the
row plus `sense` times the joint's value. The standard convention is the textbook's: z_{i-1} is the axis of
joint i, and d_{i-1,i} = d_i z_{i-1} + a_i x_i (7.64).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.dh.units import Units, parse_units
from urdfkin.errors import InputError, QuestionsSection
from urdfkin.errors.display import Displayable
from urdfkin.errors.escape import log_line
from urdfkin.errors.validators import (
    as_finite_float,
    as_instance,
    as_str,
    float_or_infinity,
    is_real,
    safe_repr,
)
from urdfkin.kinematics.inputs import check_range
from urdfkin.kinematics.roundings import ANGLE_ROUNDINGS, EPS, table_roundings
from urdfkin.model.configuration_like import ConfigurationLike
from urdfkin.model.mimic import Coupling, make_coupling
from urdfkin.model.path import ElementaryMotion, Path
from urdfkin.model.tree import FloatArray, JointKind, Limit, Mimic, freeze, is_bounded, is_rigid
from urdfkin.system.lazy_import import get_hook


class DHConvention(StrEnum):
    """Convention of a table.

    In a standard (distal) table, joint i has the axis z_{i-1}. In a modified table (Craig), joint i has the
    axis z_i.
    """

    STANDARD = "standard"
    MODIFIED = "modified"


def convention_of(name: str) -> DHConvention:
    try:
        return DHConvention(name)
    except (ValueError, TypeError):
        raise InputError(
            "unknown convention",
            found=repr(name),
            remedy="write convention = 'standard' or 'modified'",
            question=QuestionsSection.WHICH_DH_CONVENTION,
        ) from None


@dataclass(frozen=True, slots=True)
class DHRow:
    """One row of a table: constant parameters in metres and radians.

    Attributes:
        a: Length along x. In a modified table, row i contains a_{i-1}.
        alpha: Rotation about x. In a modified table, row i contains alpha_{i-1}.
        d: Offset along the joint's axis, with the joint at zero.
        theta: Rotation about the joint's axis, with the joint at zero.
        kind: Revolute, continuous or prismatic.
        joint: The joint's name.
        sense: +1, or -1 if the row subtracts the joint's value.
        beta: Rotation about y after the rotation about x. Only a Hayati row has a nonzero beta.
        mimic: The mimic rule, or None for an independent joint.
        limit: The joint's limits, or None.

    Raises:
        InputError: a number is not finite, `sense` is neither 1 nor -1, or the joint is fixed, planar or
            floating.

    >>> import urdfkin
    >>> table = urdfkin.load("planar_two_link").dh("tip", "base")
    >>> row = table.rows[0]
    >>> row.joint, row.a, row.alpha
    ('joint_1', 0.5, 0.0)
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
        where = f"row of joint {as_str(self.joint, 'joint')}"
        for name in ("a", "alpha", "d", "theta", "beta"):
            value = getattr(self, name)
            if not is_real(value) or not math.isfinite(number := float_or_infinity(value)):
                raise InputError(f"{name} is not a finite number", where=where, found=safe_repr(value))
            object.__setattr__(self, name, number)
        if not is_real(self.sense) or float_or_infinity(self.sense) not in (1.0, -1.0):
            raise InputError("`sense` must be +1 or -1", where=where, found=safe_repr(self.sense))
        object.__setattr__(self, "sense", int(float_or_infinity(self.sense)))
        if not isinstance(self.kind, JointKind) or not self.kind.has_axis:
            raise InputError(
                "the joint of a row must be revolute, continuous or prismatic",
                where=where,
                found=self.kind.value if isinstance(self.kind, JointKind) else safe_repr(self.kind),
                remedy="give a `JointKind`",
            )
        self._check_mimic_and_limit(where)

    def _check_mimic_and_limit(self, where: str) -> None:
        for name, kind in (("mimic", Mimic), ("limit", Limit)):
            if not isinstance(value := getattr(self, name), kind | None):
                raise InputError(f"{name} must be a {kind.__name__}", where=where, found=safe_repr(value))
        if self.mimic is not None:
            as_str(self.mimic.mimicked_joint, "mimicked_joint")
            for number in (self.mimic.multiplier, self.mimic.offset):
                as_finite_float(number, f"{where}: each number of mimic")
        if (limit := self.limit) is not None:
            numbers = (limit.lower, limit.upper, limit.velocity, limit.effort)
            if not all(is_real(x) and not math.isnan(float_or_infinity(x)) for x in numbers):
                raise InputError("the limits must be numbers", where=where, found=safe_repr(limit))
            if limit.lower > limit.upper:
                raise InputError("`lower` is above `upper`", where=where, found=safe_repr(limit))

    @property
    def cells(self) -> tuple[float, float, float, float, float]:
        """The numbers of the row: (a, alpha, d, theta, beta).

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").dh("tip", "base").rows[0].cells
        (0.5, 0.0, 0.0, 0.0, 0.0)
        """
        return (self.a, self.alpha, self.d, self.theta, self.beta)

    @property
    def distance_to_normal(self) -> float:
        """Distance (m), along the next axis, between the row's x axis and the end of the common normal.

        Only a Hayati row has a nonzero distance. With the angle `tilt` between the two joint axes, the
        distance is:

        `|a sin(beta)| / sin^2(tilt)`

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").dh("tip", "base").rows[0].distance_to_normal
        0.0
        """
        across, along = math.sin(self.alpha) * math.cos(self.beta), math.sin(self.beta)
        return abs(self.a * along) / (across**2 + along**2) if self.beta else 0.0

    @property
    def X(self) -> FloatArray:
        """The (4, 4) transform Tx(a) Rx(alpha) Ry(beta).

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").dh("tip", "base").rows[0].X[:3, 3].tolist()
        [0.5, 0.0, 0.0]
        """
        return link_transform(self.a, self.alpha, self.beta)

    @property
    def S(self) -> FloatArray:
        """The (4, 4) transform Rz(theta) Tz(d), with the joint at zero.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").dh("tip", "base").rows[0].S[0].tolist()
        [1.0, -0.0, 0.0, 0.0]
        """
        return joint_transform(self.theta, self.d)


#: Largest distance between a round angle and a multiple of 15 degrees, as a fraction of 15 degrees.
_ROUND_TOLERANCE = 1e-3
#: Tolerance of handwritten rotation matrices, because they often have only seven digits.
_RIGID_TOLERANCE = 1e-6


def joint_transform(theta: ArrayLike, d: ArrayLike) -> FloatArray:
    """Return S = Rz(theta) Tz(d), with theta in radians and d in metres.

    Returns:
        (..., 4, 4) poses. The arguments broadcast.
    """
    theta, d = np.broadcast_arrays(np.asarray(theta, np.float64), np.asarray(d, np.float64))
    S = np.zeros((*theta.shape, 4, 4))
    S[..., 0, 0] = S[..., 1, 1] = np.cos(theta)
    S[..., 1, 0] = np.sin(theta)
    S[..., 0, 1] = -S[..., 1, 0]
    S[..., 2, 2] = S[..., 3, 3] = 1.0
    S[..., 2, 3] = d
    return S


def link_transform(a: float, alpha: float, beta: float = 0.0) -> FloatArray:
    """Return X = Tx(a) Rx(alpha) Ry(beta), with a in metres and both angles in radians."""
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    return np.array(
        [
            [cb, 0.0, sb, a],
            [sa * sb, ca, -sa * cb, 0.0],
            [-ca * sb, sa, ca * cb, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def as_a_and_alpha(T: FloatArray) -> tuple[float, float] | None:
    """Factor a pose into Tx(a) Rx(alpha).

    Returns:
        (a, alpha), or None if the pose has another form.

    >>> as_a_and_alpha(link_transform(0.5, math.pi))
    (0.5, 3.141592653589793)
    """
    tilt_of_x = max(abs(T[0, 1]), abs(T[0, 2]))
    if tilt_of_x > ANGLE_ROUNDINGS * EPS or T[0, 0] < 0.0 or T[1, 3] or T[2, 3]:
        return None
    return float(T[0, 3]), clean_angle(math.atan2(T[2, 1], T[2, 2]))


def is_identity(T: FloatArray) -> bool:
    return bool(np.array_equal(T, np.eye(4)))


def angle_difference(first: float, second: float) -> float:
    """Return first - second modulo 2 pi, in [-pi, pi]."""
    return math.remainder(first - second, 2.0 * math.pi)


def wrap_angle(angle: float) -> float:
    """Return the equivalent angle in (-pi, pi].

    An angle that is -pi up to rounding becomes pi.

    >>> wrap_angle(-math.pi) == math.pi, wrap_angle(7.0) == 7.0 - 2 * math.pi
    (True, True)
    """
    equivalent = math.remainder(angle, 2.0 * math.pi)
    return math.pi if equivalent <= -math.pi * (1.0 - EPS) else equivalent


def clean_angle(angle: float) -> float:
    """Wrap an angle, and make multiples of pi/12 exact."""
    angle = wrap_angle(angle)
    twelfth = nearest_twelfth(angle)
    return wrap_angle(twelfth) + 0.0 if abs(angle - twelfth) <= ANGLE_ROUNDINGS * EPS else angle


def looks_round(angle: float, twelfth: float = math.pi / 12.0) -> bool:
    """Return whether an angle is nearly a nonzero multiple of `twelfth`.

    >>> looks_round(1.571), looks_round(0.0), looks_round(0.25), looks_round(90.0, twelfth=15.0)
    (True, False, False, True)
    """
    return abs(angle) > 0.5 * twelfth and abs(math.remainder(angle, twelfth)) <= _ROUND_TOLERANCE * twelfth


def nearest_twelfth(angle: float) -> float:
    """Return the nearest multiple of pi/12."""
    return round(angle * 12.0 / math.pi) * math.pi / 12.0


@dataclass(frozen=True, slots=True)
class SnapChange:
    """The change of one angle to a multiple of 15 degrees.

    Attributes:
        row: Index of the row. The base has the index -1, and the tool has the index n.
        angle: Angle (rad) by which the change rotates the rest of the chain.
        lever: Upper bound of the distance (m) between the rotation's centre and the tip. Prismatic joints are
            at zero.
        prismatic_joints: Prismatic joints between the rotation's centre and the tip.
    """

    row: int
    what: str
    angle: float
    lever: float
    prismatic_joints: tuple[str, ...] = ()

    @property
    def tip_displacement(self) -> float:
        """Bound of the tip's displacement (m), with prismatic joints at zero."""
        return self.angle * self.lever


@dataclass(frozen=True, slots=True)
class SnapReport:
    """All snapped angles of a table, and their effect on the tip.

    Each change rotates the rest of the chain about a joint's origin, and moves the tip by at most:

    `angle * distance from the joint's origin to the tip`

    Attributes:
        tolerance: The requested tolerance (rad).
        changes: The snapped angles, base to tip.
        metres: Guaranteed bound of the tip's displacement. The bound holds within the joint limits. A
            prismatic joint without limits is assumed within 10 m of zero.
        radians: Guaranteed bound of the tip's rotation.
        per_metre: For each prismatic joint, the increase of the bound per metre of travel.
        measured_metres: Largest displacement of the tip in the sampled configurations.
        measured_radians: Largest rotation of the tip in the sampled configurations.
        samples: Number of sampled configurations.
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
        """Sorted indices of the changed rows.

        The base has the index -1, and the tool has the index n.
        """
        return tuple(sorted({change.row for change in self.changes}))

    def bound(self, values: Mapping[str, FloatArray]) -> FloatArray:
        """Return a guaranteed bound (...,) of the tip's displacement (m) due to the snapped angles.

        `values` contains the values of the prismatic joints by name.
        """
        at_zero = sum(change.tip_displacement for change in self.changes)
        travel = [np.abs(values[name]) * rate for name, rate in self.per_metre.items()]
        return np.asarray(at_zero + sum(travel, np.zeros(())), dtype=np.float64)


@dataclass(frozen=True, eq=False, repr=False)
class DHTable(Displayable):
    """A Denavit-Hartenberg table of a path.

    `urdfkin.load(table)` returns a robot.

    Attributes:
        convention: Standard or modified.
        rows: One row for each moving joint, base to tip.
        base: (4, 4) T_base_0, constant (metres).
        tool: (4, 4) T_n_tip, constant (metres).
        robot: The robot's name.
        base_frame: Name of the base frame.
        tip_frame: Name of the tip frame.
        snap: The effect of snapped angles, or None for an exact table.

    Raises:
        InputError: the convention is unknown, two rows name the same joint, or base or tool is not a rigid
            transform.

    >>> import urdfkin
    >>> print(urdfkin.load("planar_two_link").dh("tip", "base"))
    planar_two_link: base to tip, standard Denavit-Hartenberg parameters
    T(i-1, i) = Rz(theta) Tz(d) Tx(a) Rx(alpha)
    <BLANKLINE>
    i  joint    a [m]  alpha [rad]  d [m]  theta [rad]
    --------------------------------------------------
    1  joint_1    0.5            0      0           q1
    2  joint_2    0.4            0      0           q2
    <BLANKLINE>
    base: the identity
    tool: the identity
    """

    convention: DHConvention
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
                self, name, _check_pose(getattr(self, name), f"{name} of the table of {self.robot}")
            )
        for name in ("robot", "base_frame", "tip_frame"):
            as_str(getattr(self, name), name)
        if not isinstance(self.rows, Sequence) or not all(isinstance(row, DHRow) for row in self.rows):
            raise InputError(
                "rows must be a list of DHRow",
                where=f"table of {self.robot}",
                found=safe_repr(self.rows),
                remedy="for numbers use table_from_rows",
            )
        object.__setattr__(self, "rows", tuple(self.rows))
        names = [row.joint for row in self.rows]
        for name in names:
            if names.count(name) > 1:
                raise InputError(
                    "two rows name the same joint", where=f"table of {self.robot}", found=repr(name)
                )

    # -- display --------------------------------------------------------------------------------------

    def __repr__(self) -> str:
        ends = f"{self.base_frame} to {self.tip_frame}"
        return log_line(f"<DHTable {self.robot}: {ends}, {len(self.rows)} rows, {self.convention}>")

    def __str__(self) -> str:
        return "\n".join(map(log_line, self._export_text("terminal", parse_units()).split("\n")))

    def to_markdown(self, angles: str = "radians", lengths: str = "metres", digits: int = 10) -> str:
        """Return the table in Markdown.

        Args:
            angles: "radians" or "degrees". In radians, exact multiples of pi/12 become fractions of pi.
            lengths: "metres" or "millimetres".
            digits: Significant digits.

        Raises:
            InputError: an unknown unit.

        >>> import urdfkin
        >>> table = urdfkin.load("planar_two_link").dh("tip", "base")
        >>> print(table.to_markdown("degrees", "millimetres").splitlines()[6])
        | 1 | `joint_1` | 500 | 0 | 0 | q1 |
        """
        return self._export_text("markdown", parse_units(angles, lengths, digits))

    def to_latex(self, angles: str = "radians", lengths: str = "metres", digits: int = 10) -> str:
        """Return the table in LaTeX (amsmath, booktabs, graphicx).

        The arguments are the same as for `to_markdown`.

        >>> import urdfkin
        >>> "tabular" in urdfkin.load("planar_two_link").dh("tip", "base").to_latex()
        True
        """
        return self._export_text("latex", parse_units(angles, lengths, digits))

    def to_html(self, angles: str = "radians", lengths: str = "metres", digits: int = 10) -> str:
        """Return the table in HTML.

        The arguments are the same as for `to_markdown`.

        >>> import urdfkin
        >>> table = urdfkin.load("planar_two_link").dh("tip", "base")
        >>> "<table" in table.to_html()
        True
        """
        return self._export_text("html", parse_units(angles, lengths, digits))

    def _export_text(self, form: str, units: Units) -> str:
        return str(get_hook("a table in a form")(self, form, units)).rstrip("\n")

    def _repr_html_(self) -> str:
        return self.to_html()

    def _repr_markdown_(self) -> str:
        return self.to_markdown()

    def _repr_latex_(self) -> str:
        return self.to_latex()

    # -- coordinates ---------------------------------------------------------------------------------

    @cached_property
    def coupling(self) -> Coupling:
        """The map from coordinates to joint values.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").dh("tip", "base").coupling.names
        ('joint_1', 'joint_2')
        """
        return make_coupling([(row.joint, row.mimic, row.kind) for row in self.rows])

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the coordinates, in row order.

        The row of a mimic joint has the name of the mimicked joint. Each name is listed once.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").dh("tip", "base").joint_names
        ('joint_1', 'joint_2')
        """
        return self.coupling.names

    # -- sizes ---------------------------------------------------------------------------------------

    @property
    def has_hayati_rows(self) -> bool:
        """True if any row has a fifth parameter, beta.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").dh("tip", "base").has_hayati_rows
        False
        """
        return any(row.beta != 0.0 for row in self.rows)

    @property
    def unlimited(self) -> tuple[str, ...]:
        """Names of the prismatic joints without limits.

        Error bounds assume that joints without limits stay within 10 m of zero.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").dh("tip", "base").unlimited
        ()
        """
        return tuple(row.joint for row in self.rows if not row.kind.turns and not is_bounded(row.limit))

    @cached_property
    def span(self) -> float:
        """Sum (metres) of all |a|, all |d| and the tool's length.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").dh("tip", "base").span
        0.9
        """
        lengths = sum(abs(row.a) + abs(row.d) for row in self.rows)
        return lengths + math.hypot(*self.tool[:3, 3])

    @np.errstate(over="ignore")  # The bound is then inf.
    def rounding(self, q: ConfigurationLike) -> FloatArray:
        """Return a bound (...,) of the rounding error of the position (metres).

        `eps * (8 (n + 1) + sum of |angles|) * length`

        The angles are the values of the revolute joints. The length is the sum of `span`, the absolute values
        of the prismatic joints, and the length of the base's translation. The bound divided by `span` bounds
        the orientation error in radians. `urdfkin.kinematics.roundings` derives the factor 8.

        >>> import urdfkin
        >>> bool(urdfkin.load("planar_two_link").dh("tip", "base").rounding([0.0, 0.0]) < 1e-13)
        True
        """
        values = np.abs(self.coupling.values(q))
        turns = np.array([row.kind.turns for row in self.rows], dtype=bool)
        angle = values[..., turns].sum(axis=-1)
        lever = self.span + values[..., ~turns].sum(axis=-1) + float(np.linalg.norm(self.base[:3, 3]))
        return np.asarray(EPS * (table_roundings(len(self.rows)) + angle) * lever)

    def tolerance(self, q: ConfigurationLike) -> tuple[FloatArray, FloatArray]:
        """Return bounds of the difference between the table's and the URDF's tip.

        The bounds cover rounding errors and the effect of snapped angles.

        Returns:
            Two bounds (...,), the first in metres and the second in radians.

        >>> import urdfkin
        >>> table = urdfkin.load("planar_two_link").dh("tip", "base")
        >>> metres, radians = table.tolerance([0.0, 0.0])
        >>> bool(metres < 1e-13), bool(radians < 1e-13)
        (True, True)
        """
        values, metres = self.coupling.values(q), self.rounding(q)
        turns = np.array([row.kind.turns for row in self.rows], dtype=bool)
        radians = EPS * (table_roundings(len(self.rows)) + np.abs(values[..., turns]).sum(axis=-1))
        if self.snap is None:
            return metres, radians
        by_name = {row.joint: values[..., i] for i, row in enumerate(self.rows)}
        return metres + self.snap.bound(by_name), radians + self.snap.radians

    # -- placement -----------------------------------------------------------------------------------

    @np.errstate(over="ignore", invalid="ignore")  # RangeError replaces these warnings.
    def frames(self, q: ConfigurationLike | None = None) -> FloatArray:
        """Return the (..., n + 1, 4, 4) poses of the frames 0 to n in the base frame.

        Args:
            q: (..., coordinates) in the order of `joint_names` (rad or m), or values by name (mapping or
                text). None means the zero configuration.

        Raises:
            InputError: `q` has the wrong length, or a number is not finite.
            RangeError: a result leaves the range of double precision.

        >>> import urdfkin
        >>> table = urdfkin.load("planar_two_link").dh("tip", "base")
        >>> table.frames([0.0, 0.0])[:, 0, 3].tolist()  # x of the base, of link 1 and of the tip, m
        [0.0, 0.5, 0.9]
        """
        values = self.coupling.values(np.zeros(len(self.joint_names)) if q is None else q)
        constants = np.array([row.theta if row.kind.turns else row.d for row in self.rows])
        senses = np.array([row.sense for row in self.rows])
        return self._path.finite_frames(constants + senses * values)[..., ::2, :, :]

    @cached_property
    def _path(self) -> Path:
        steps: list[FloatArray | ElementaryMotion] = [self.base]
        for row in self.rows:
            motion = ElementaryMotion(2, row.kind.turns)
            constant = joint_transform(0.0, row.d) if row.kind.turns else joint_transform(row.theta, 0.0)
            standard = self.convention is DHConvention.STANDARD
            steps += [motion, constant @ row.X] if standard else [row.X @ constant, motion]
        return Path(tuple(steps))

    @np.errstate(over="ignore", invalid="ignore")  # RangeError replaces these warnings.
    def placement(self, q: ConfigurationLike) -> FloatArray:
        """Return the (..., 4, 4) pose T_base_tip, the product of base, rows and tool.

        Args:
            q: (..., coordinates) in the order of `joint_names` (rad or m), or values by name (mapping or
                text).

        Raises:
            InputError: `q` has the wrong length, or a number is not finite.
            RangeError: a result leaves the range of double precision.

        Example:
            >>> import math
            >>> from urdfkin.model.tree import JointKind
            >>> arm = DHTable(DHConvention.STANDARD, (DHRow(2.0, 0.0, 0.0, 0.0, JointKind.REVOLUTE, "j"),))
            >>> arm.placement([math.pi / 2])[:3, 3].round(12).tolist()
            [0.0, 2.0, 0.0]
        """
        return check_range(np.ascontiguousarray(self.frames(q)[..., -1, :, :] @ self.tool))


def as_table(table: object, name: str = "table") -> DHTable:
    return as_instance(table, DHTable, name, "read one with urdfkin.read_table(FILE)")


def _check_pose(T: ArrayLike, where: str) -> FloatArray:
    pose = freeze(T)
    if pose.shape != (4, 4) or not np.isfinite(pose).all():
        raise InputError(
            "a pose must be a (4, 4) array of finite numbers", where=where, found=f"shape {pose.shape}"
        )
    if not is_rigid(pose, _RIGID_TOLERANCE):
        raise InputError("a pose must be a rotation and a translation", where=where, found=str(pose.tolist()))
    return pose
