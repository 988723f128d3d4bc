"""Axes."""

from tests.lint.cases.arm import ACCEPT, REJECT, WARN, Case, arm, axis

CASES = [
    Case("axis-zero-prismatic", axis("0 0 0", "prismatic"), REJECT, [("URDF502", 6)]),
    Case("axis-zero-continuous", axis("0 0 0", "continuous"), REJECT, [("URDF502", 6)]),
    Case("axis-zero-floating", axis("0 0 0", "floating"), ACCEPT),
    Case("axis-huge", axis("1e200 0 0"), REJECT, [("URDF502", 6)]),
    Case("axis-small-but-sane", axis("0 0 1e-6"), WARN, [("URDF503", 6)]),
    Case("axis-rounded-well", axis("0.707107 0.707107 0"), ACCEPT, [("URDF503", 6)]),
    Case("axis-negative-unit", axis("0 0 -1"), ACCEPT),
    Case("axis-nearly-z", axis("1e-13 0 1"), ACCEPT, [("URDF514", 6)]),
    Case("axis-nearly-z-continuous", axis("0 -1e-12 1", "continuous"), WARN, [("URDF514", 6)]),
    Case("axis-nearly-x-prismatic", axis("1.0000000000001 3e-16 0", "prismatic"), ACCEPT, [("URDF514", 6)]),
    Case("axis-z-but-for-rounding", axis("6.123e-17 0 1"), ACCEPT),
    Case("axis-nearly-minus-z", axis("1e-13 0 -1"), ACCEPT),
    Case("axis-empty-element-fixed", arm(axis="<axis/>", attributes='type="fixed"'), ACCEPT),
    Case("planar-z", axis("0 0 1", "planar"), ACCEPT),
    Case("planar-z-long", axis("0 0 3", "planar"), ACCEPT),
    Case("planar-negative-z", axis("0 0 -1", "planar"), WARN, [("URDF505", 6)]),
    Case("planar-default", arm(axis="", attributes='type="planar"', limit=""), WARN, [("URDF505", 6)]),
]
