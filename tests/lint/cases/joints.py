"""Types, axes, limits, quaternions and mimic."""

from tests.lint.cases.arm import ACCEPT, REJECT, WARN, Case, arm, axis, limit


def joints_cases() -> list[Case]:
    return [
        Case("type-capital", arm(attributes='type="Revolute"'), REJECT, [("URDF501", 6)]),
        Case("type-blank", arm(attributes='type=" revolute"'), REJECT, [("URDF501", 6)]),
        Case("type-screw", arm(attributes='type="screw"'), REJECT, [("URDF501", 6)]),
        Case("axis-zero-prismatic", axis("0 0 0", "prismatic"), REJECT, [("URDF502", 6)]),
        Case("axis-zero-continuous", axis("0 0 0", "continuous"), REJECT, [("URDF502", 6)]),
        Case("axis-zero-floating", axis("0 0 0", "floating"), ACCEPT),
        Case("axis-huge", axis("1e200 0 0"), REJECT, [("URDF502", 6)]),
        Case("axis-small-but-sane", axis("0 0 1e-6"), WARN, [("URDF503", 6)]),
        Case("axis-rounded-well", axis("0.707107 0.707107 0"), ACCEPT, [("URDF503", 6)]),
        Case("axis-negative-unit", axis("0 0 -1"), ACCEPT),
        Case("axis-nearly-z", axis("1e-13 0 1"), ACCEPT, [("URDF514", 6)]),
        Case("axis-nearly-z-continuous", axis("0 -1e-12 1", "continuous"), WARN, [("URDF514", 6)]),
        Case(
            "axis-nearly-x-prismatic", axis("1.0000000000001 3e-16 0", "prismatic"), ACCEPT, [("URDF514", 6)]
        ),
        Case("axis-z-but-for-rounding", axis("6.123e-17 0 1"), ACCEPT),
        Case("axis-nearly-minus-z", axis("1e-13 0 -1"), ACCEPT),
        Case("axis-nan", axis("0 0 nan"), REJECT, [("URDF301", 6)]),
        Case("axis-bad-on-fixed", axis("x", "fixed"), WARN, [("URDF510", 6)]),
        Case("axis-empty-element", arm(axis="<axis/>"), REJECT, [("URDF504", 6)]),
        Case("axis-other-attribute", arm(axis='<axis a="1">0 0 1</axis>'), REJECT, [("URDF504", 6)]),
        Case("axis-empty-element-fixed", arm(axis="<axis/>", attributes='type="fixed"'), ACCEPT),
        Case("axis-empty-planar", arm(axis="<axis/>", attributes='type="planar"'), WARN, [("URDF504", 6)]),
        Case("planar-z", axis("0 0 1", "planar"), ACCEPT),
        Case("planar-z-long", axis("0 0 3", "planar"), ACCEPT),
        Case("planar-negative-z", axis("0 0 -1", "planar"), WARN, [("URDF505", 6)]),
        Case("planar-default", arm(axis="", attributes='type="planar"', limit=""), WARN, [("URDF505", 6)]),
        Case(
            "prismatic-without-limit", arm(attributes='type="prismatic"', limit=""), REJECT, [("URDF506", 6)]
        ),
        Case("continuous-without-limit", arm(attributes='type="continuous"', limit=""), ACCEPT),
        Case(
            "continuous-zero-bounds",
            limit('lower="0" upper="0" effort="1" velocity="1"', "continuous"),
            ACCEPT,
        ),
        Case(
            "limit-inverted", limit('lower="1" upper="-1" effort="1" velocity="1"'), REJECT, [("URDF507", 6)]
        ),
        Case("limit-only-lower", limit('lower="1" effort="1" velocity="1"'), REJECT, [("URDF507", 6)]),
        Case("limit-only-upper", limit('upper="1" effort="1" velocity="1"'), ACCEPT),
        Case("limit-neither", limit('effort="1" velocity="1"'), WARN, [("URDF508", 6)]),
        Case("limit-no-effort", limit('lower="-1" upper="1" velocity="1"'), REJECT, [("URDF211", 6)]),
        Case(
            "limit-negative-effort",
            limit('lower="-1" upper="1" effort="-1" velocity="1"'),
            WARN,
            [("URDF509", 6)],
        ),
        Case("limit-partial-on-fixed", arm(attributes='type="fixed"', limit='<limit lower="0"/>'), REJECT),
        Case(
            "version-1.2-needs-no-effort",
            arm(robot='name="r" version="1.2"', limit='<limit lower="-1" upper="1"/>'),
            WARN,
        ),
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
            "quaternion-three",
            arm(robot='name="r" version="1.1"', origin='<origin quat_xyzw="0 0 1"/>'),
            REJECT,
            [("URDF302", 6)],
        ),
        Case(
            "quaternion-beside-rpy",
            arm(robot='name="r" version="1.1"', origin='<origin rpy="0 0 0" quat_xyzw="0 0 0 1"/>'),
            REJECT,
            [("URDF513", 6)],
        ),
        Case("mimic-unknown", arm(follow='<mimic joint="j9"/>'), REJECT, [("URDF520", 7)]),
        Case("mimic-a-link", arm(follow='<mimic joint="l1"/>'), REJECT, [("URDF520", 7)]),
        Case("mimic-empty-joint", arm(follow='<mimic joint=""/>'), REJECT, [("URDF211", 7)]),
        Case(
            "mimic-circle",
            arm(inside='<mimic joint="j2"/>', follow='<mimic joint="j1"/>'),
            REJECT,
            [("URDF521", 6), ("URDF521", 7)],
        ),
        Case(
            "mimic-planar-leader",
            arm(attributes='type="planar"', follow='<mimic joint="j1"/>'),
            REJECT,
            [("URDF522", 7)],
        ),
        Case(
            "mimic-floating-leader",
            arm(attributes='type="floating"', follow='<mimic joint="j1"/>'),
            REJECT,
            [("URDF522", 7)],
        ),
        Case(
            "mimic-planar-follower",
            arm(second='type="planar"', follow='<mimic joint="j1"/>'),
            REJECT,
            [("URDF522", 7)],
        ),
        Case(
            "mimic-continuous-leader",
            arm(attributes='type="continuous"', limit="", follow='<mimic joint="j1"/>'),
            ACCEPT,
        ),
        Case(
            "mimic-prismatic-of-revolute",
            arm(second='type="prismatic"', follow='<mimic joint="j1"/>'),
            ACCEPT,
        ),
        Case(
            "mimic-huge",
            arm(follow='<mimic joint="j1" multiplier="1e300"/>'),
            WARN,
            [("URDF526", 7)],
        ),
        Case("mimic-nan", arm(follow='<mimic joint="j1" multiplier="nan"/>'), REJECT, [("URDF301", 7)]),
        Case("mimic-twice", arm(follow='<mimic joint="j1"/><mimic joint="j1"/>'), WARN, [("URDF209", 7)]),
    ]
