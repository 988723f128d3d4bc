"""Check shapes: invalid or incomplete ones. Kinematics does not use them, so no finding is an error."""

from __future__ import annotations

from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import WARNING, Rule
from urdfkin.lint.rules.meshes import check_address
from urdfkin.lint.rules.numbers import NumberReader
from urdfkin.urdf.element import Element
from urdfkin.urdf.records import RobotRecord

UNREADABLE = Rule("URDF704", "unreadable-extra", WARNING)
GEOMETRY = Rule("URDF705", "geometry-incomplete", WARNING)

#: Shape -> its numbers: (attribute, count, required).
_SHAPES: dict[str, tuple[tuple[str, int, bool], ...]] = {
    "box": (("size", 3, True),),
    "sphere": (("radius", 1, True),),
    "cylinder": (("radius", 1, True), ("length", 1, True)),
    "capsule": (("radius", 1, True), ("length", 1, True)),
    "mesh": (("scale", 3, False),),
}


def check_shapes(report: Reporter, robot: RobotRecord) -> None:
    """Report invalid and incomplete shapes."""
    numbers = NumberReader(report, UNREADABLE, UNREADABLE)
    for link in robot.links.values():
        for shape in link.children:
            if shape.tag in ("visual", "collision"):
                _check_geometry(report, shape, numbers)
                _check_capsule(report, shape, robot.version)


def _check_geometry(report: Reporter, owner: Element, numbers: NumberReader) -> None:
    origin, geometry = owner.first("origin"), owner.first("geometry")
    if origin is not None:
        numbers.vector(origin, "xyz")
        numbers.vector(origin, "rpy")
    shape = geometry.children[0] if geometry is not None and geometry.children else None
    if shape is None or shape.tag not in _SHAPES:
        lacks = "no <geometry>" if geometry is None else "an empty <geometry>"
        report.add(
            GEOMETRY,
            f"the {owner.tag} has no shape of URDF",
            geometry or owner,
            found=lacks if shape is None else f"<{shape.tag}>",
            remedy="the shapes are box, cylinder, sphere and mesh",
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
    if shape.tag == "mesh" and not shape.attributes.get("filename", "").strip():
        _missing(report, owner, shape, "filename")
    elif shape.tag == "mesh":
        check_address(report, shape)


def _check_capsule(report: Reporter, owner: Element, version: tuple[int, int]) -> None:
    """Report a capsule in a file of version 1.0, where readers skip it."""
    geometry = owner.first("geometry")
    capsule = None if geometry is None else geometry.first("capsule")
    if capsule is not None and version < (1, 1):
        report.add(
            GEOMETRY,
            'a capsule needs version="1.1" and is ignored',
            capsule,
            remedy="use a cylinder and two spheres",
        )


def _missing(report: Reporter, owner: Element, shape: Element, attribute: str) -> None:
    report.add(
        GEOMETRY,
        f"the {shape.tag} of a {owner.tag} has no {attribute}",
        shape,
        remedy=f'write <{shape.tag} {attribute}="..."/>',
    )
