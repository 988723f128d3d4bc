"""Check inertials: incomplete or impossible ones. Kinematics does not use them, so no finding is an error."""

from __future__ import annotations

import math
from collections.abc import Sequence

from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import WARNING, Rule
from urdfkin.lint.rules import shapes
from urdfkin.lint.rules.numbers import NumberReader
from urdfkin.urdf.element import Element
from urdfkin.urdf.records import RobotRecord

INERTIAL_INCOMPLETE = Rule("URDF701", "inertial-incomplete", WARNING)
INERTIAL_IMPOSSIBLE = Rule("URDF702", "inertial-impossible", WARNING)
INERTIAL_SCALE = Rule("URDF703", "inertial-scale", WARNING)

#: Larger masses (kg) and distances of the centre of mass (m) are reported as mistakes.
HEAVIEST, FARTHEST = 1e9, 1e6

#: Bodies below this mass (kg) are placeholders; their moments are not checked.
NEGLIGIBLE = 1e-3

#: Moments of inertia per kg (m^2) that are rounding errors: those of a body of 0.03 mm.
ROUNDING = 1e-9

#: Relative rounding error of moments, from the number of digits that exporters write.
_WRITTEN = 1e-6

_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def check_inertials(report: Reporter, robot: RobotRecord) -> None:
    """Check the inertial of each link."""
    numbers = NumberReader(report, shapes.UNREADABLE, shapes.UNREADABLE)
    for link in robot.links.values():
        inertial = link.first("inertial")
        if inertial is not None:
            _check_inertial(report, inertial, numbers)


def _check_inertial(report: Reporter, inertial: Element, numbers: NumberReader) -> None:
    origin, mass_element, tensor = (inertial.first(tag) for tag in ("origin", "mass", "inertia"))
    missing = [f"<{tag}>" for tag in ("mass", "inertia") if inertial.first(tag) is None]
    if mass_element is not None and "value" not in mass_element.attributes:
        missing.append("value of <mass>")
    if tensor is not None:
        missing += [name for name in _MOMENTS if name not in tensor.attributes]
    if missing:
        report.add(
            INERTIAL_INCOMPLETE,
            "the inertial is incomplete",
            inertial,
            found=f"no {', '.join(missing)}",
            remedy="write mass and all six moments, or no inertial",
        )
    lever = None
    if origin is not None:
        lever = numbers.vector(origin, "xyz")
        numbers.vector(origin, "rpy")
    mass = None if mass_element is None else numbers.scalar(mass_element, "value")
    _check_mass(report, inertial, mass, lever)
    if tensor is not None:
        moments = [numbers.scalar(tensor, name) for name in _MOMENTS]
        if all(moment is not None for moment in moments):
            _check_moments(report, tensor, [moment for moment in moments if moment is not None], mass)


def _check_mass(
    report: Reporter, inertial: Element, mass: float | None, lever: tuple[float, ...] | None
) -> None:
    if mass is not None and mass < 0.0:
        report.add(
            INERTIAL_IMPOSSIBLE,
            "the mass is negative",
            inertial.first("mass"),
            attribute="value",
            found=f"{mass:g}",
            remedy="write kilograms",
            weight=1.0,
        )
    heavy = mass is not None and abs(mass) > HEAVIEST
    if heavy or (lever is not None and max(abs(x) for x in lever) > FARTHEST):
        what = f"mass {mass:g} kg" if heavy else f"centre of mass {max(abs(x) for x in lever or ()):g} m away"
        report.add(
            INERTIAL_SCALE,
            "the inertial is far too large",
            inertial,
            found=what,
            remedy="write kilograms and metres",
        )


def _check_moments(report: Reporter, tensor: Element, moments: list[float], mass: float | None) -> None:
    kilograms = 1.0 if mass is None else abs(mass)
    if mass == 0.0 and any(moments):
        report.add(
            INERTIAL_IMPOSSIBLE,
            "the body has moments of inertia, but no mass",
            tensor,
            remedy="write kilograms, or no moments",
        )
        return
    if 0.0 < kilograms < NEGLIGIBLE:
        return
    small, middle, large = principal_moments(moments)
    slack = _WRITTEN * max(abs(small), abs(large)) + ROUNDING * kilograms
    if small < -slack:
        what, found = "a principal moment of inertia is negative", f"{small:.3g}"
    elif large > middle + small + slack:
        what = "the largest principal moment exceeds the sum of the others"
        found = f"{small:.3g}, {middle:.3g} and {large:.3g}"
    else:
        return
    report.add(
        INERTIAL_IMPOSSIBLE,
        f"no body has this inertia: {what}",
        tensor,
        found=found,
        remedy="check units and signs; kinematics does not use them",
    )


def principal_moments(moments: Sequence[float]) -> tuple[float, float, float]:
    """Return the eigenvalues of an inertia tensor, smallest first, by the trigonometric cubic formula.

    Args:
        moments: ixx, ixy, ixz, iyy, iyz, izz.

    >>> principal_moments([1.0, 0.0, 0.0, 2.0, 0.0, 3.0])
    (1.0, 2.0, 3.0)
    """
    scale = max(map(abs, moments))
    if scale == 0.0:
        return (0.0, 0.0, 0.0)
    xx, xy, xz, yy, yz, zz = (value / scale for value in moments)
    off = xy * xy + xz * xz + yz * yz
    if off == 0.0:
        low, middle, high = sorted((moments[0], moments[3], moments[5]))
        return low, middle, high
    mean = (xx + yy + zz) / 3.0
    p = math.sqrt(((xx - mean) ** 2 + (yy - mean) ** 2 + (zz - mean) ** 2 + 2.0 * off) / 6.0)
    a, b, c, d, e, f = (xx - mean) / p, xy / p, xz / p, (yy - mean) / p, yz / p, (zz - mean) / p
    half_determinant = (a * (d * f - e * e) - b * (b * f - e * c) + c * (b * e - d * c)) / 2.0
    angle = math.acos(min(1.0, max(-1.0, half_determinant))) / 3.0
    high = mean + 2.0 * p * math.cos(angle)
    low = mean + 2.0 * p * math.cos(angle + 2.0 * math.pi / 3.0)
    return low * scale, (3.0 * mean - high - low) * scale, high * scale
