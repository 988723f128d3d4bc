"""Elements and attributes."""

from tests.lint.cases.arm import ACCEPT, LIMIT, REJECT, SPHERE, WARN, Case, arm, fixed

CASES = [
    Case("capital-link", arm(more='<Link name="x"/>'), REJECT, [("URDF206", 8)]),
    Case("misspelt-joint", arm(more='<jiont name="x" type="fixed"/>'), REJECT, [("URDF206", 8)]),
    Case("joint-in-link", arm(base=f'<link name="base">{fixed("n", "a", "b")}</link>'), REJECT),
    Case("robot-in-robot", arm(more='<robot name="s"><link name="z"/></robot>'), REJECT, [("URDF206", 8)]),
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
    Case("mimic-twice", arm(follow='<mimic joint="j1"/><mimic joint="j1"/>'), WARN, [("URDF209", 7)]),
]
