"""Other formats, xacro, versions, elements and attributes."""

from tests.lint.cases.arm import ACCEPT, LIMIT, MESH, REJECT, SPHERE, WARN, Case, arm, fixed


def dialect_cases() -> list[Case]:
    include = '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="/etc/passwd"/>'
    xacro = 'name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"'
    return [
        Case("sdf", '<sdf version="1.6"><model name="m"/></sdf>', REJECT, [("URDF201", 1)]),
        Case("mjcf", "<mujoco><worldbody/></mujoco>", REJECT, [("URDF201", 1)]),
        Case("capital-robot", arm().replace("robot", "Robot"), REJECT, [("URDF201", 2)]),
        Case("no-robot-name", arm(robot=""), REJECT, [("URDF401", 2)]),
        Case("empty-robot-name", arm(robot='name=""'), WARN, [("URDF405", 2)]),
        Case("xinclude", arm(more=include), REJECT, [("URDF112", 8)]),
        Case(
            "xacro-other-prefix",
            arm(robot=xacro.replace("xmlns:xacro", "xmlns:x"), more="<x:macro/>"),
            REJECT,
        ),
        Case("xacro-property", arm(robot=xacro, more='<xacro:property name="a" value="1"/>'), REJECT),
        Case(
            "xacro-expression", arm(robot=xacro, origin='<origin xyz="0 0 ${h}"/>'), REJECT, [("URDF202", 6)]
        ),
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
        Case("prefixed-extension", arm(robot='name="r" xmlns:d="http://d"', more="<d:joint/>"), ACCEPT),
        Case("capital-link", arm(more='<Link name="x"/>'), REJECT, [("URDF206", 8)]),
        Case("misspelt-joint", arm(more='<jiont name="x" type="fixed"/>'), REJECT, [("URDF206", 8)]),
        Case("joint-in-link", arm(base=f'<link name="base">{fixed("n", "a", "b")}</link>'), REJECT),
        Case(
            "robot-in-robot", arm(more='<robot name="s"><link name="z"/></robot>'), REJECT, [("URDF206", 8)]
        ),
        Case(
            "joint-in-transmission",
            arm(more='<transmission name="t"><joint name="j1"/></transmission>'),
            ACCEPT,
        ),
        Case("links-in-gazebo", arm(more='<gazebo><model><link name="g"/></model></gazebo>'), ACCEPT),
        Case("loop-joint-extension", arm(more='<loop_joint name="c" type="ball"/>'), WARN, [("URDF207", 8)]),
        Case("known-extension", arm(base='<link name="base"><contact/></link>'), ACCEPT, [("URDF207", 3)]),
        Case("unknown-attribute", arm(attributes='type="fixed" colour="red"'), WARN, [("URDF208", 6)]),
        Case("misspelt-origin", arm(origin='<orign xyz="1 0 0"/>'), WARN, [("URDF207", 6)]),
        Case("capital-origin", arm(origin='<Origin xyz="1 0 0"/>'), WARN, [("URDF207", 6)]),
        Case("misspelt-rpy", arm(origin='<origin rp="1 0 0"/>'), WARN, [("URDF208", 6)]),
        Case("transposed-xyz", arm(origin='<origin xzy="1 0 0"/>'), WARN, [("URDF208", 6)]),
        Case("sdf-pose", arm(origin="<pose>0 0 1 0 0 0</pose>"), WARN, [("URDF207", 6)]),
        Case("origin-as-text", arm(origin="<origin>0 0 1</origin>"), REJECT, [("URDF212", 6)]),
        Case("axis-as-text", arm(axis="<axis>0 0 1</axis>"), REJECT, [("URDF212", 6)]),
        Case("axis-sdf-style", arm(axis="<axis><xyz>0 0 1</xyz></axis>"), REJECT, [("URDF212", 6)]),
        Case("text-in-robot", arm(more="hello"), WARN, [("URDF212", 2)]),
        Case("two-limits", arm(inside=LIMIT), WARN, [("URDF209", 6)]),
        Case("two-parents-in-a-joint", arm(inside='<parent link="tool"/>'), WARN, [("URDF209", 6)]),
        Case("two-visuals", arm(base=f'<link name="base">{SPHERE * 2}</link>'), ACCEPT),
        Case("no-child", arm(ends='<parent link="base"/>'), REJECT, [("URDF210", 6)]),
        Case("child-without-link", arm(ends='<parent link="base"/><child/>'), REJECT, [("URDF211", 6)]),
        Case("no-type", arm(attributes=""), REJECT, [("URDF211", 6)]),
    ]
