"""The tree, axes, limits, mimic rules and suspicious values."""

from tests.urdf.lint.cases.arm import (
    ACCEPT,
    REJECT,
    WARN,
    Case,
    arm,
    axis,
    bounds,
    fixed,
    follows,
    limit,
    xyz,
)

_FAR = "<origin xyz='10 0 0'/>"
_FREE = {"attributes": 'type="continuous"', "limit": ""}
_REST = 'joint="j1" multiplier="0" offset="5"'
_MIMIC = '<mimic joint="j1"/>'


def apart(*joints: str) -> str:
    """Write the arm with three additional links, and with joints."""
    return arm(more="".join([*(f'<link name="c{i}"/>' for i in range(3)), *joints]))


def rpy(value: str) -> str:
    return arm(origin=f'<origin xyz="0 0 1" rpy="{value}"/>')


CASES = [
    # How joints connect links.
    Case("child-unknown", arm(ends='<parent link="base"/><child link="l2"/>'), REJECT, "URDF408:6"),
    Case("parent-case", arm(ends='<parent link="Base"/><child link="l1"/>'), REJECT, "URDF408:6"),
    Case("two-components", apart(fixed("a", "c0", "c1"), fixed("b", "c1", "c2")), REJECT, "URDF411:8"),
    Case("loop-apart", apart(fixed("a", "c0", "c1"), fixed("b", "c1", "c0")), REJECT, "URDF412:8"),
    Case("loop-of-all", arm(more=fixed("back", "tool", "base")), REJECT, "URDF412:8"),
    Case("self-parent-root", arm(more=fixed("self", "base", "base")), REJECT, "URDF409:8"),
    Case("same-two-links-twice", arm(more=fixed("again", "base", "l1")), REJECT, "URDF410:8"),
    Case("single-link", '<robot name="r"><link name="only"/></robot>', ACCEPT),
    # Axes.
    Case("axis-zero-prismatic", axis("0 0 0", "prismatic"), REJECT, "URDF502:6"),
    Case("axis-zero-continuous", axis("0 0 0", "continuous"), REJECT, "URDF502:6"),
    Case("axis-zero-floating", axis("0 0 0", "floating"), ACCEPT),
    Case("axis-huge", axis("1e200 0 0"), REJECT, "URDF502:6"),
    Case("axis-small-but-sane", axis("0 0 1e-6"), WARN, "URDF503:6"),
    Case("axis-rounded-well", axis("0.707107 0.707107 0"), ACCEPT, "URDF503:6"),
    Case("axis-negative-unit", axis("0 0 -1"), ACCEPT),
    Case("axis-nearly-z", axis("1e-13 0 1"), ACCEPT, "URDF514:6"),
    Case("axis-nearly-z-continuous", axis("0 -1e-12 1", "continuous"), WARN, "URDF514:6"),
    Case("axis-nearly-x-prismatic", axis("1.0000000000001 3e-16 0", "prismatic"), ACCEPT, "URDF514:6"),
    Case("axis-z-but-for-rounding", axis("6.123e-17 0 1"), ACCEPT),
    Case("axis-nearly-minus-z", axis("1e-13 0 -1"), ACCEPT),
    Case("axis-empty-element-fixed", arm(axis="<axis/>", attributes='type="fixed"'), ACCEPT),
    Case("planar-z", axis("0 0 1", "planar"), ACCEPT),
    Case("planar-z-long", axis("0 0 3", "planar"), ACCEPT),
    Case("planar-negative-z", axis("0 0 -1", "planar"), WARN, "URDF505:6"),
    Case("planar-default", arm(axis="", attributes='type="planar"', limit=""), WARN, "URDF505:6"),
    # Limits.
    Case("continuous-without-limit", arm(attributes='type="continuous"', limit=""), ACCEPT),
    Case("continuous-zero-bounds", bounds('lower="0" upper="0"', "continuous"), ACCEPT),
    Case("limit-inverted", bounds('lower="1" upper="-1"'), REJECT, "URDF507:6"),
    Case("limit-only-lower", bounds('lower="1"'), REJECT, "URDF507:6"),
    Case("limit-only-upper", bounds('upper="1"'), ACCEPT),
    Case("limit-neither", limit('effort="1" velocity="1"'), WARN, "URDF508:6"),
    Case("limit-negative-effort", limit('lower="-1" upper="1" effort="-1" velocity="1"'), WARN, "URDF509:6"),
    # Mimic joints.
    Case("mimic-unknown", arm(follow='<mimic joint="j9"/>'), REJECT, "URDF520:7"),
    Case("mimic-a-link", arm(follow='<mimic joint="l1"/>'), REJECT, "URDF520:7"),
    Case("mimic-cycle", arm(inside='<mimic joint="j2"/>', follow=_MIMIC), REJECT, "URDF521:6 URDF521:7"),
    Case("mimic-planar-leader", arm(attributes='type="planar"', follow=_MIMIC), REJECT, "URDF522:7"),
    Case("mimic-floating-leader", arm(attributes='type="floating"', follow=_MIMIC), REJECT, "URDF522:7"),
    Case("mimic-planar-follower", arm(second='type="planar"', follow=_MIMIC), REJECT, "URDF522:7"),
    Case("mimic-continuous-leader", arm(**_FREE, follow=_MIMIC), WARN, "URDF527:7"),
    Case("mimic-beyond-its-limits", follows('joint="j1" offset="1"'), WARN, "URDF527:7"),
    Case("mimic-at-rest-outside-its-limits", follows(_REST), WARN, "URDF523:7 URDF527:7"),
    Case("mimic-nowhere-within", follows('joint="j1" offset="5"'), WARN, "URDF527:7"),
    Case("mimic-within-at-one-value", follows('joint="j1" offset="4"'), WARN, "URDF527:7"),
    Case("mimic-mirrored-within", follows('joint="j1" multiplier="-1"'), ACCEPT),
    Case("mimic-beyond-by-a-digit", follows('joint="j1" multiplier="1.0005"'), ACCEPT),
    Case("mimic-prismatic-of-revolute", arm(second='type="prismatic"', follow=_MIMIC), ACCEPT),
    Case("mimic-huge", follows('joint="j1" multiplier="1e300"'), WARN, "URDF526:7"),
    # Suspicious values.
    Case("rpy-exact", rpy("1.5707963267948966 0 0"), ACCEPT),
    Case("rpy-3.1416", rpy("0 3.1416 0"), ACCEPT, "URDF601:6"),
    Case("rpy-cut-off", rpy("0 0 1.5707"), ACCEPT, "URDF601:6"),
    Case("rpy-pi-third", rpy("0 0 1.0472"), ACCEPT, "URDF601:6"),
    Case("rpy-plain-number", rpy("0.5 0.25 -1.25"), ACCEPT),
    Case("rpy-3.14-far", arm(origin='<origin rpy="3.14 0 0"/>', follow=_FAR), WARN, "URDF601:6"),
    Case("rpy-degrees", rpy("90 0 0"), WARN, "URDF602:6"),
    Case("limit-degrees", bounds('lower="-180" upper="180"'), WARN, "URDF602:6"),
    Case("limit-several-turns", bounds('lower="-12.56" upper="12.56"'), ACCEPT),
    Case("limit-as-good-as-none", bounds('lower="-1e6" upper="1e6"'), ACCEPT),
    Case("millimetres", xyz("0 0 350"), WARN, "URDF603:6"),
    Case("prismatic-millimetres", bounds('lower="0" upper="500"', "prismatic"), WARN, "URDF603:6"),
    Case("huge-but-finite", xyz("1e308 0 0"), WARN, "URDF603:6"),
    Case("overflow-of-the-sum", arm(origin='<origin xyz="1.7e308 1.7e308 0"/>'), REJECT, "URDF606:6"),
    Case("neutral-above-the-limits", bounds('lower="-2" upper="-0.1"'), ACCEPT, "URDF608:6"),
    Case("neutral-below-the-limits", bounds('lower="0.1" upper="2"'), ACCEPT, "URDF608:6"),
    Case("neutral-at-a-limit", bounds('lower="0" upper="2"'), ACCEPT),
    Case("tiny-robot", xyz("0 0 1e-7"), WARN, "URDF604:2"),
    Case("all-origins-zero", xyz("0 0 0"), ACCEPT),
]
