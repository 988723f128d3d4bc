"""What joints are made of."""

from tests.lint.cases.arm import REJECT, WARN, Case, arm, axis, limit

CASES = [
    Case(
        "version-1.2-needs-no-effort",
        arm(robot='name="r" version="1.2"', limit='<limit lower="-1" upper="1"/>'),
        WARN,
    ),
    Case("no-child", arm(ends='<parent link="base"/>'), REJECT, [("URDF210", 6)]),
    Case("child-without-link", arm(ends='<parent link="base"/><child/>'), REJECT, [("URDF211", 6)]),
    Case("no-type", arm(attributes=""), REJECT, [("URDF211", 6)]),
    Case("safety-without-k", arm(inside="<safety_controller/>"), REJECT, [("URDF211", 6)]),
    Case("type-capital", arm(attributes='type="Revolute"'), REJECT, [("URDF501", 6)]),
    Case("type-blank", arm(attributes='type=" revolute"'), REJECT, [("URDF501", 6)]),
    Case("type-screw", arm(attributes='type="screw"'), REJECT, [("URDF501", 6)]),
    Case("axis-bad-on-fixed", axis("x", "fixed"), WARN, [("URDF510", 6)]),
    Case("axis-empty-element", arm(axis="<axis/>"), REJECT, [("URDF504", 6)]),
    Case("axis-other-attribute", arm(axis='<axis a="1">0 0 1</axis>'), REJECT, [("URDF504", 6)]),
    Case("axis-empty-planar", arm(axis="<axis/>", attributes='type="planar"'), WARN, [("URDF504", 6)]),
    Case("prismatic-without-limit", arm(attributes='type="prismatic"', limit=""), REJECT, [("URDF506", 6)]),
    Case("limit-no-effort", limit('lower="-1" upper="1" velocity="1"'), REJECT, [("URDF211", 6)]),
    Case("limit-partial-on-fixed", arm(attributes='type="fixed"', limit='<limit lower="0"/>'), REJECT),
    Case(
        "version-1.2-needs-both-bounds",
        arm(robot='name="r" version="1.2"', limit='<limit lower="-1"/>'),
        REJECT,
        [("URDF211", 6)],
    ),
    Case(
        "quaternion-zero",
        arm(robot='name="r" version="1.1"', origin='<origin quat_xyzw="0 0 0 0"/>'),
        REJECT,
        [("URDF513", 6)],
    ),
    Case(
        "quaternion-beside-rpy",
        arm(robot='name="r" version="1.1"', origin='<origin rpy="0 0 0" quat_xyzw="0 0 0 1"/>'),
        REJECT,
        [("URDF513", 6)],
    ),
    Case("mimic-empty-joint", arm(follow='<mimic joint=""/>'), REJECT, [("URDF211", 7)]),
]
