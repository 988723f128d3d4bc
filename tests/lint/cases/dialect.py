"""Other formats, xacro, versions."""

from tests.lint.cases.arm import ACCEPT, MESH, REJECT, WARN, Case, arm

_INCLUDE = '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="/etc/passwd"/>'
_XACRO = 'name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"'

CASES = [
    Case("sdf", '<sdf version="1.6"><model name="m"/></sdf>', REJECT, [("URDF201", 1)]),
    Case("mjcf", "<mujoco><worldbody/></mujoco>", REJECT, [("URDF201", 1)]),
    Case("capital-robot", arm().replace("robot", "Robot"), REJECT, [("URDF201", 2)]),
    Case("xinclude", arm(more=_INCLUDE), REJECT, [("URDF112", 8)]),
    Case(
        "xacro-other-prefix",
        arm(robot=_XACRO.replace("xmlns:xacro", "xmlns:x"), more="<x:macro/>"),
        REJECT,
    ),
    Case("xacro-property", arm(robot=_XACRO, more='<xacro:property name="a" value="1"/>'), REJECT),
    Case("xacro-expression", arm(robot=_XACRO, origin='<origin xyz="0 0 ${h}"/>'), REJECT, [("URDF202", 6)]),
    Case("xacro-expression-in-name", arm(base='<link name="${p}base"/>'), REJECT, [("URDF202", 3)]),
    Case("xacro-expression-in-mesh", arm(base=MESH.format("$(arg side)/a.stl")), WARN, [("URDF202", 3)]),
    Case("xacro-expression-in-material", arm(more='<material name="${c}"/>'), WARN, [("URDF202", 8)]),
    Case("xacro-expression-in-robot", arm(robot='name="$(arg name)"'), WARN, [("URDF202", 2)]),
    Case("xacro-expression-in-leader", arm(follow='<mimic joint="${p}j1"/>'), REJECT, [("URDF202", 7)]),
    Case("xacro-expressions-both", arm(base=MESH.format("${m}"), axis='<axis xyz="${a}"/>'), REJECT),
    Case("xacro-macro-in-link", arm(base='<link name="base"><xacro:mass m="1"/></link>'), WARN),
    Case("xacro-macro-in-joint", arm(inside="<xacro:origin/>"), REJECT, [("URDF202", 6)]),
    Case("xacro-never-closed", arm(more='<material name="${"/>'), ACCEPT),
    Case("dollar-in-gazebo", arm(more='<gazebo><plugin name="$(arg x)"/></gazebo>'), ACCEPT),
    Case("version-1.1", arm(robot='name="r" version="1.1"'), WARN, [("URDF204", 2)]),
    Case("version-1.2", arm(robot='name="r" version="1.2"'), WARN, [("URDF204", 2)]),
    Case("version-2.0", arm(robot='name="r" version="2.0"'), REJECT, [("URDF203", 2)]),
    Case("version-0.9", arm(robot='name="r" version="0.9"'), REJECT, [("URDF203", 2)]),
    Case("version-1", arm(robot='name="r" version="1"'), REJECT, [("URDF203", 2)]),
    Case("version-empty", arm(robot='name="r" version=""'), REJECT, [("URDF203", 2)]),
    Case("version-three", arm(robot='name="r" version="1.0.0"'), REJECT, [("URDF203", 2)]),
    Case("default-namespace", arm(robot='name="r" xmlns="http://example.org"'), WARN, [("URDF213", 2)]),
]
