"""Inertials, shapes and materials: kinematics needs none of them, so almost nothing here is an error."""

from __future__ import annotations

import math
from collections.abc import Sequence

from urdfkin.lint.codes import extras as codes
from urdfkin.lint.escape import quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rules.document import Element
from urdfkin.lint.rules.joints import RobotRecord
from urdfkin.lint.rules.numbers import NumberReader

#: Heaviest mass in kg and longest lever in m that are taken for real.
HEAVIEST, FARTHEST = 1e9, 1e6

#: Lighter bodies, in kg, are placeholders, whose moments mean nothing.
NEGLIGIBLE = 1e-3

#: Moments of inertia for each kg, in m^2, that are nothing but rounding: a body of 0.03 mm.
ROUNDING = 1e-9

_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")

#: Shape -> its numbers: (attribute, how many, required).
_SHAPES: dict[str, tuple[tuple[str, int, bool], ...]] = {
    "box": (("size", 3, True),),
    "sphere": (("radius", 1, True),),
    "cylinder": (("radius", 1, True), ("length", 1, True)),
    "capsule": (("radius", 1, True), ("length", 1, True)),
    "mesh": (("scale", 3, False),),
}


def check_extras(report: Reporter, robot: RobotRecord) -> None:
    """Inertials that are incomplete or impossible, shapes that are none, materials that are undefined."""
    numbers = NumberReader(report, codes.UNREADABLE, codes.UNREADABLE)
    defined = _materials(report, robot)
    for element in robot.links.values():
        inertial = element.first("inertial")
        if inertial is not None:
            _check_inertial(report, inertial, numbers)
        for shape in element.children:
            if shape.tag in ("visual", "collision"):
                _check_shape(report, shape, numbers)
                _check_capsule(report, shape, robot.version)
            if shape.tag == "visual":
                _check_material(report, shape, defined)


def _check_inertial(report: Reporter, inertial: Element, numbers: NumberReader) -> None:
    origin, mass_element, tensor = (inertial.first(tag) for tag in ("origin", "mass", "inertia"))
    missing = [f"<{tag}>" for tag in ("mass", "inertia") if inertial.first(tag) is None]
    if mass_element is not None and "value" not in mass_element.attributes:
        missing.append("value of <mass>")
    if tensor is not None:
        missing += [name for name in _MOMENTS if name not in tensor.attributes]
    if missing:
        report.add(
            codes.INERTIAL_INCOMPLETE,
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
            codes.INERTIAL_IMPOSSIBLE,
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
            codes.INERTIAL_SCALE,
            "the inertial is out of all proportion",
            inertial,
            found=what,
            remedy="write kilograms and metres",
        )


def _check_moments(report: Reporter, tensor: Element, moments: list[float], mass: float | None) -> None:
    kilograms = 1.0 if mass is None else abs(mass)
    if mass == 0.0 and any(moments):
        report.add(
            codes.INERTIAL_IMPOSSIBLE,
            "the body has moments of inertia and no mass",
            tensor,
            remedy="write kilograms, or no moments",
        )
        return
    if 0.0 < kilograms < NEGLIGIBLE:
        return
    small, middle, large = principal_moments(moments)
    slack = 1e-6 * max(abs(small), abs(large)) + ROUNDING * kilograms
    if small < -slack:
        what, found = "a principal moment of inertia is negative", f"{small:.3g}"
    elif large > middle + small + slack:
        what = "the largest principal moment exceeds the sum of the others"
        found = f"{small:.3g}, {middle:.3g} and {large:.3g}"
    else:
        return
    report.add(
        codes.INERTIAL_IMPOSSIBLE,
        f"no body has this inertia: {what}",
        tensor,
        found=found,
        remedy="check units and signs; kinematics is untouched",
    )


def principal_moments(
    moments: Sequence[float],
) -> tuple[float, float, float]:
    """Eigenvalues of an inertia tensor, smallest first, by the trigonometric solution of the cubic.

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


def _check_shape(report: Reporter, owner: Element, numbers: NumberReader) -> None:
    origin, geometry = owner.first("origin"), owner.first("geometry")
    if origin is not None:
        numbers.vector(origin, "xyz")
        numbers.vector(origin, "rpy")
    shape = geometry.children[0] if geometry is not None and geometry.children else None
    if shape is None or shape.tag not in _SHAPES:
        lacks = "no <geometry>" if geometry is None else "an empty <geometry>"
        report.add(
            codes.GEOMETRY,
            f"the {owner.tag} has no shape that URDF knows",
            geometry or owner,
            found=lacks if shape is None else f"<{shape.tag}>",
            remedy="shapes are box, cylinder, sphere and mesh",
        )
        return
    for attribute, count, required in _SHAPES[shape.tag]:
        if attribute not in shape.attributes:
            if required:
                _missing(report, owner, shape, attribute)
        elif count == 1:
            numbers.scalar(shape, attribute)
        else:
            numbers.vector(shape, attribute, count)
    if shape.tag == "mesh":
        _check_mesh(report, owner, shape)


def _check_capsule(report: Reporter, owner: Element, version: tuple[int, int]) -> None:
    """A capsule is a shape from version 1.1 on; before, readers skip it."""
    geometry = owner.first("geometry")
    capsule = None if geometry is None else geometry.first("capsule")
    if capsule is not None and version < (1, 1):
        report.add(
            codes.GEOMETRY,
            'a capsule needs version="1.1" and is ignored',
            capsule,
            remedy="use a cylinder and two spheres",
        )


def _missing(report: Reporter, owner: Element, shape: Element, attribute: str) -> None:
    report.add(
        codes.GEOMETRY,
        f"the {shape.tag} of a {owner.tag} has no {attribute}",
        shape,
        remedy=f'write <{shape.tag} {attribute}="..."/>',
    )


def _check_mesh(report: Reporter, owner: Element, mesh: Element) -> None:
    filename = mesh.attributes.get("filename", "")
    if not filename.strip():
        _missing(report, owner, mesh, "filename")
    elif filename.lower().startswith(("http:", "https:", "ftp:")):
        report.add(
            codes.MESH_REMOTE,
            "the mesh lies on the network; nothing was fetched",
            mesh,
            attribute="filename",
            found=quoted(filename),
            remedy="copy it into a package",
        )


def _materials(report: Reporter, robot: RobotRecord) -> set[str]:
    """Names of materials that are defined: at the top, or where they are first used."""
    defined: dict[str, Element] = {}
    for material in robot.element.all("material"):
        name = material.attributes.get("name", "")
        if name in defined:
            report.add(
                codes.MATERIAL_TWICE,
                "another material of the robot has this name; urdfdom refuses the file",
                material,
                attribute="name",
                found=quoted(name),
                remedy=f"the first is on line {defined[name].line}; remove one",
            )
        defined.setdefault(name, material)
    inside = {
        material.attributes.get("name", "")
        for link in robot.links.values()
        for visual in link.all("visual")
        for material in visual.all("material")
        if material.first("color") is not None or material.first("texture") is not None
    }
    return set(defined) | inside


def _check_material(report: Reporter, visual: Element, defined: set[str]) -> None:
    material = visual.first("material")
    if material is None:
        return
    name = material.attributes.get("name")
    anonymous = name is None or (not name and (material.first("color") or material.first("texture")))
    if name is None or (name not in defined and not anonymous):
        report.add(
            codes.MATERIAL_UNKNOWN,
            "the material has no name" if name is None else "the material is defined nowhere",
            material,
            attribute="name",
            found=None if name is None else quoted(name),
            remedy='write <material name="..."> with a <color>',
        )
