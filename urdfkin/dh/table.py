"""The Denavit-Hartenberg table: rows, a base and a tool, in a convention that is always named.

Section 7.5 of the text. With S_i = Rz(theta_i) Tz(d_i) and X = Tx(a) Rx(alpha) Ry(beta):

    standard   T_base_tip = base . S_1 X_1 . S_2 X_2 ... S_n X_n . tool        (X_i from row i)
    modified   T_base_tip = base . X_0 S_1 . X_1 S_2 ... X_{n-1} S_n . tool    (X_{i-1} from row i)

The variable of row i is theta_i for a turning joint and d_i for a sliding one: the constant in the row plus
`sense` times the joint's value. The standard convention is the text's: joint i turns about z_{i-1}, and
d_{i-1,i} = d_i z_{i-1} + a_i x_i (7.64).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.dh.row import Convention, DHRow, convention_of
from urdfkin.dh.statement import SnapStatement
from urdfkin.dh.units import Units, units_of
from urdfkin.errors import InputError
from urdfkin.errors.printable import log_line
from urdfkin.errors.showing import Shown
from urdfkin.kinematics.roundings import EPS, of_rows
from urdfkin.model.coupling import Coupling, coupling_of
from urdfkin.model.given import Given
from urdfkin.model.tree import FloatArray, frozen
from urdfkin.system.asking import ask

#: How far the rotation of a pose may be from one: people type seven digits.
_TYPED = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class DHTable(Shown):
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
    snap: SnapStatement | None = None

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
        return str(ask("a table in a form")(self, form, units)).rstrip("\n")

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
