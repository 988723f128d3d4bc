"""The way from a base to a tip as elementary motions, of which some are parameters and some are joints.

Every model here is a product of constants and of motions about or along a coordinate axis of the frame that
they are met in,

    T_base_tip = C_0 E_1 C_1 E_2 C_2 ...,      E_k = R_x(phi), T_x(s), R_y(phi), ...

a URDF's origins as well as the rows of a Denavit-Hartenberg table. A motion by the parameter p moves the tip
by a twist, like a joint's: with e the axis and O its origin, both in the base,

    turning   dp_tip/dp = e x (p_tip - O),   w = e;       sliding   dp_tip/dp = e,   w = 0

which is a column of 7.85. A joint that turns (1 + g) times as far as it says has g for a parameter, and its
column is the joint's times the joint's value.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdfkin.errors.printable import log_line
from urdfkin.kinematics.arrays import chapter as eq
from urdfkin.kinematics.rotation.euler import coordinate_rotation
from urdfkin.kinematics.roundings import EPS, ROUNDINGS
from urdfkin.model.tree import FloatArray


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
class Way:
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
