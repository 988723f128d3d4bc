"""Check materials: those without a definition, and those with two."""

from __future__ import annotations

from urdfkin.lint.finding import quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import ERROR, WARNING, Rule
from urdfkin.urdf.element import Element
from urdfkin.urdf.records import RobotRecord

MATERIAL_UNKNOWN = Rule("URDF708", "material-unknown", WARNING)
MATERIAL_TWICE = Rule("URDF709", "material-twice", ERROR)


def check_materials(report: Reporter, robot: RobotRecord) -> None:
    """Check the materials of the robot and of each visual."""
    defined = _materials(report, robot)
    for link in robot.links.values():
        for visual in link.all("visual"):
            _check_material(report, visual, defined)


def _materials(report: Reporter, robot: RobotRecord) -> set[str]:
    """Return the names of the defined materials, and report names with two definitions."""
    defined: dict[str, Element] = {}
    for material in robot.element.all("material"):
        name = material.attributes.get("name", "")
        if name in defined:
            report.add(
                MATERIAL_TWICE,
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
            MATERIAL_UNKNOWN,
            "the material has no name" if name is None else "the material is not defined",
            material,
            attribute="name",
            found=None if name is None else quoted(name),
            remedy='write <material name="..."> with a <color>',
        )
