"""Check inertials, shapes, materials and meshes. Kinematics does not use these elements."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from urdfkin.urdf.catalogue import find_package, split_uri
from urdfkin.urdf.findings import ERROR, WARNING, Reporter, Rule, quote
from urdfkin.urdf.parser import NumberReader
from urdfkin.urdf.records import Element, RobotRecord

INERTIAL_INCOMPLETE = Rule("URDF701", "inertial-incomplete", WARNING)
INERTIAL_IMPOSSIBLE = Rule("URDF702", "inertial-impossible", WARNING)
INERTIAL_SCALE = Rule("URDF703", "inertial-scale", WARNING)

#: Largest plausible mass (kg), and largest plausible coordinate of a centre of mass (m).
MAX_MASS, MAX_COORDINATE = 1e9, 1e6

#: A nonzero mass (kg) below this number is probably a placeholder, so the moments of inertia of the body are
#: not checked.
NEGLIGIBLE_MASS = 1e-3

#: Tolerance of the checks of the principal moments, divided by the mass (m^2). No moment may be negative, or
#: larger than the sum of the other two. A body of 1 kg with a radius of gyration of 0.03 mm has about this
#: moment.
NEGLIGIBLE_MOMENT = 1e-9

#: Relative rounding error of the moments of inertia, which exporters write with few digits.
_MOMENT_PRECISION = 1e-6

_INERTIA_ATTRIBUTES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def check_inertials(report: Reporter, robot: RobotRecord) -> None:
    numbers = NumberReader(report, UNREADABLE_NUMBER, UNREADABLE_NUMBER)
    for link in robot.links.values():
        inertial = link.find("inertial")
        if inertial is not None:
            _check_inertial(report, inertial, numbers)


def _check_inertial(report: Reporter, inertial: Element, numbers: NumberReader) -> None:
    origin, mass_element, tensor = (inertial.find(tag) for tag in ("origin", "mass", "inertia"))
    missing = [f"<{tag}>" for tag in ("mass", "inertia") if inertial.find(tag) is None]
    if mass_element is not None and "value" not in mass_element.attributes:
        missing.append("value of <mass>")
    if tensor is not None:
        missing += [name for name in _INERTIA_ATTRIBUTES if name not in tensor.attributes]
    if missing:
        message = "<inertial> is incomplete"
        remedy = "write <mass> and all six moments of <inertia>, or remove <inertial>"
        report.add(INERTIAL_INCOMPLETE, message, inertial, found=f"no {', '.join(missing)}", remedy=remedy)
    centre_of_mass = None
    if origin is not None:
        centre_of_mass = numbers.read_vector(origin, "xyz")
        numbers.read_vector(origin, "rpy")
    mass = None if mass_element is None else numbers.read_scalar(mass_element, "value")
    _check_mass(report, inertial, mass, centre_of_mass)
    if tensor is not None:
        read = (numbers.read_scalar(tensor, name) for name in _INERTIA_ATTRIBUTES)
        moments = [moment for moment in read if moment is not None]
        if len(moments) == len(_INERTIA_ATTRIBUTES):
            _check_moments(report, tensor, moments, mass)


def _check_mass(
    report: Reporter, inertial: Element, mass: float | None, centre_of_mass: tuple[float, ...] | None
) -> None:
    if mass is not None and mass < 0.0:
        report.add(
            INERTIAL_IMPOSSIBLE,
            "the mass is negative",
            inertial.find("mass"),
            attribute="value",
            found=f"{mass:g}",
            remedy="write the mass in kilograms",
            weight=1.0,
        )
    heavy = mass is not None and abs(mass) > MAX_MASS
    distance = max(map(abs, centre_of_mass or (0.0,)))
    if heavy or distance > MAX_COORDINATE:
        message = "the mass or the centre of mass is far too large"
        remedy = "write the mass in kilograms and the centre of mass in metres"
        found = f"mass {mass:g} kg" if heavy else f"centre of mass {distance:g} m away"
        report.add(INERTIAL_SCALE, message, inertial, found=found, remedy=remedy)


def _check_moments(report: Reporter, tensor: Element, moments: list[float], mass: float | None) -> None:
    kilograms = 1.0 if mass is None else abs(mass)
    if mass == 0.0 and any(moments):
        remedy = "write the mass in kilograms, or remove the moments"
        report.add(INERTIAL_IMPOSSIBLE, "the body has moments of inertia, but no mass", tensor, remedy=remedy)
        return
    if 0.0 < kilograms < NEGLIGIBLE_MASS:
        return
    small, middle, large = principal_moments(moments)
    slack = _MOMENT_PRECISION * max(abs(small), abs(large)) + NEGLIGIBLE_MOMENT * kilograms
    if small < -slack:
        what, found = "a principal moment of inertia is negative", f"{small:.3g}"
    elif large > middle + small + slack:
        what = "the largest principal moment exceeds the sum of the other two"
        found = f"{small:.3g}, {middle:.3g} and {large:.3g}"
    else:
        return
    remedy = "check the units and signs of the moments; kinematics does not use moments of inertia"
    report.add(INERTIAL_IMPOSSIBLE, f"no body has this inertia: {what}", tensor, found=found, remedy=remedy)


def principal_moments(moments: Sequence[float]) -> tuple[float, float, float]:
    """Return the eigenvalues of an inertia tensor, smallest first.

    The eigenvalues are the roots of a cubic equation. The trigonometric formula gives the roots.
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


UNREADABLE_NUMBER = Rule("URDF704", "unreadable-extra", WARNING)
GEOMETRY_INCOMPLETE = Rule("URDF705", "geometry-incomplete", WARNING)

#: Numeric attributes of each shape. A tuple contains the attribute's name, its count of numbers, and whether
#: it is required.
_SHAPES: dict[str, tuple[tuple[str, int, bool], ...]] = {
    "box": (("size", 3, True),),
    "sphere": (("radius", 1, True),),
    "cylinder": (("radius", 1, True), ("length", 1, True)),
    "capsule": (("radius", 1, True), ("length", 1, True)),
    "mesh": (("scale", 3, False),),
}


def check_shapes(report: Reporter, robot: RobotRecord) -> None:
    numbers = NumberReader(report, UNREADABLE_NUMBER, UNREADABLE_NUMBER)
    for link in robot.links.values():
        for shape in link.children:
            if shape.tag in ("visual", "collision"):
                _check_geometry(report, shape, numbers, robot.version)


def _check_geometry(
    report: Reporter, owner: Element, numbers: NumberReader, version: tuple[int, int]
) -> None:
    origin, geometry = owner.find("origin"), owner.find("geometry")
    if origin is not None:
        numbers.read_vector(origin, "xyz")
        numbers.read_vector(origin, "rpy")
    capsule = None if geometry is None else geometry.find("capsule")
    if capsule is not None and version < (1, 1):  # URDF readers skip capsules in files before version 1.1.
        message = 'a capsule needs version="1.1" and is ignored'
        remedy = 'write version="1.1" in <robot>, or use a cylinder and two spheres'
        report.add(GEOMETRY_INCOMPLETE, message, capsule, remedy=remedy)
    shape = geometry.children[0] if geometry is not None and geometry.children else None
    if shape is None or shape.tag not in _SHAPES:
        lacks = "no <geometry>" if geometry is None else "an empty <geometry>"
        report.add(
            GEOMETRY_INCOMPLETE,
            f"the {owner.tag} contains no shape that URDF defines",
            geometry or owner,
            found=lacks if shape is None else f"<{shape.tag}>",
            remedy="write a <box>, <cylinder>, <sphere> or <mesh>",
        )
        return
    for attribute, count, required in _SHAPES[shape.tag]:
        if attribute not in shape.attributes:
            if required:
                _report_missing(report, owner, shape, attribute)
        elif count == 1:
            numbers.read_scalar(shape, attribute)
        else:
            numbers.read_vector(shape, attribute, count)
    if shape.tag == "mesh" and not shape.attributes.get("filename", "").strip():
        _report_missing(report, owner, shape, "filename")
    elif shape.tag == "mesh":
        report_remote_mesh(report, shape)


def _report_missing(report: Reporter, owner: Element, shape: Element, attribute: str) -> None:
    message = f"the {shape.tag} of a {owner.tag} has no {attribute}"
    report.add(GEOMETRY_INCOMPLETE, message, shape, remedy=f'write <{shape.tag} {attribute}="..."/>')


MATERIAL_UNKNOWN = Rule("URDF708", "material-unknown", WARNING)
MATERIAL_TWICE = Rule("URDF709", "material-twice", ERROR)


def check_materials(report: Reporter, robot: RobotRecord) -> None:
    defined = _find_defined_materials(report, robot)
    for link in robot.links.values():
        for visual in link.find_all("visual"):
            _check_material(report, visual, defined)


def _find_defined_materials(report: Reporter, robot: RobotRecord) -> set[str]:
    defined: dict[str, Element] = {}
    for material in robot.element.find_all("material"):
        name = material.attributes.get("name", "")
        if name in defined:
            what, found = "two materials of the robot have no name", None
            if name:
                what, found = "another material of the robot has this name", quote(name)
            message = f"{what}; urdfdom refuses the file"
            remedy = f"the first is on line {defined[name].line}; remove one of these materials"
            report.add(MATERIAL_TWICE, message, material, attribute="name", found=found, remedy=remedy)
        defined.setdefault(name, material)
    inside = {
        material.attributes.get("name", "")
        for link in robot.links.values()
        for visual in link.find_all("visual")
        for material in visual.find_all("material")
        if material.find("color") is not None or material.find("texture") is not None
    }
    return set(defined) | inside


def _check_material(report: Reporter, visual: Element, defined: set[str]) -> None:
    material = visual.find("material")
    if material is None:
        return
    name = material.attributes.get("name")
    anonymous = name is None or (not name and (material.find("color") or material.find("texture")))
    if name is None or (name not in defined and not anonymous):
        message = "the material has no name" if name is None else "the material is not defined"
        remedy = 'write <material name="..."> with a <color>'
        found = None if name is None else quote(name)
        report.add(MATERIAL_UNKNOWN, message, material, attribute="name", found=found, remedy=remedy)


MESH_MISSING = Rule("URDF706", "mesh-missing", WARNING)
MESH_REMOTE = Rule("URDF707", "mesh-remote", WARNING)


def check_meshes(report: Reporter, root: Element, urdf_path: Path | None) -> None:
    """Report missing meshes and packages; without `urdf_path`, check only `package://` and `model://`."""
    packages: dict[str, Path | None] = {}
    missing: dict[str, list[Element]] = {}
    for mesh in _find_meshes(root):
        filename = mesh.attributes.get("filename", "").strip()
        parts = split_uri(filename)
        if parts is not None:
            package, path = parts
            if package not in packages:
                packages[package] = find_package(package, urdf_path)
            folder = packages[package]
            if folder is None:
                missing.setdefault(package, []).append(mesh)
            elif not _is_existing_file(folder / path):
                _report_missing_mesh(report, mesh, filename)
        elif _is_missing_file(filename, urdf_path):
            _report_missing_mesh(report, mesh, filename)
    for package, meshes in missing.items():
        remedy = "add the package's folder to ROS_PACKAGE_PATH" if package else "write package://NAME/PATH"
        report.add(
            MESH_MISSING,
            f"package {quote(package)} of {_mesh_count_text(len(meshes))} is not found"
            if package
            else f"the address of {_mesh_count_text(len(meshes))} names no package",
            meshes[0],
            attribute="filename",
            found=quote(meshes[0].attributes["filename"]),
            remedy=f"{remedy}; kinematics needs no mesh",
        )


def report_remote_mesh(report: Reporter, mesh: Element) -> None:
    filename = mesh.attributes["filename"]
    if filename.lower().startswith(("http:", "https:", "ftp:")):
        message = "the mesh is on the network and was not downloaded"
        remedy = "copy the mesh into a package"
        report.add(MESH_REMOTE, message, mesh, attribute="filename", found=quote(filename), remedy=remedy)


def _find_meshes(root: Element) -> Iterator[Element]:
    for link in root.find_all("link"):
        for shape in link.children:
            geometry = shape.find("geometry") if shape.tag in ("visual", "collision") else None
            if geometry is not None:
                yield from geometry.find_all("mesh")


def _is_missing_file(filename: str, urdf_path: Path | None) -> bool:
    local = filename and ("://" not in filename or filename.startswith("file://"))
    if urdf_path is None or not local:
        return False
    return not _is_existing_file(urdf_path.absolute().parent / filename.removeprefix("file://"))


def _is_existing_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _report_missing_mesh(report: Reporter, mesh: Element, filename: str) -> None:
    message = "the mesh is not found"
    remedy = "correct the filename, or add the file; kinematics needs no mesh"
    report.add(MESH_MISSING, message, mesh, attribute="filename", found=quote(filename), remedy=remedy)


def _mesh_count_text(number: int) -> str:
    return "a mesh" if number == 1 else f"{number} meshes"
