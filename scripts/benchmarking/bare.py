"""A robot's URDF with its joints and nothing else: what every library reads, without meshes or rules.

Links get the same unit inertia, since some libraries refuse a link without one; no kinematics depends on it.
Mimic rules are dropped: everyone computes with the same free coordinates.
"""

from __future__ import annotations

from xml.etree import ElementTree as ET

_INERTIA = {"ixx": "1", "iyy": "1", "izz": "1", "ixy": "0", "ixz": "0", "iyz": "0"}
#: What a joint keeps.
_KEPT = ("origin", "parent", "child", "axis", "limit")


def bare_urdf(urdf: str, *, flags: dict[str, str] | None = None) -> str:
    """The links and joints of `urdf`.

    Args:
        urdf: The text of a URDF.
        flags: Attributes of MuJoCo's own element `mujoco/compiler`; None to leave it out.
    """
    whole = ET.fromstring(urdf)
    robot = ET.Element("robot", name=whole.get("name", "robot"))
    if flags is not None:
        ET.SubElement(ET.SubElement(robot, "mujoco"), "compiler", flags)
    for link in whole.findall("link"):
        inertial = ET.SubElement(ET.SubElement(robot, "link", name=link.attrib["name"]), "inertial")
        ET.SubElement(inertial, "mass", value="1")
        ET.SubElement(inertial, "inertia", _INERTIA)
    for joint in whole.findall("joint"):
        copy = ET.SubElement(robot, "joint", joint.attrib)
        copy.extend(part for tag in _KEPT for part in joint.findall(tag))
    return ET.tostring(robot, encoding="unicode")
