"""Followers."""

from tests.lint.cases.arm import ACCEPT, REJECT, WARN, Case, arm

CASES = [
    Case("mimic-unknown", arm(follow='<mimic joint="j9"/>'), REJECT, [("URDF520", 7)]),
    Case("mimic-a-link", arm(follow='<mimic joint="l1"/>'), REJECT, [("URDF520", 7)]),
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
        WARN,
        [("URDF527", 7)],
    ),
    Case("mimic-beyond-its-limits", arm(follow='<mimic joint="j1" offset="1"/>'), WARN, [("URDF527", 7)]),
    Case("mimic-nowhere-within", arm(follow='<mimic joint="j1" offset="5"/>'), WARN, [("URDF527", 7)]),
    Case("mimic-mirrored-within", arm(follow='<mimic joint="j1" multiplier="-1"/>'), ACCEPT),
    Case("mimic-beyond-by-a-digit", arm(follow='<mimic joint="j1" multiplier="1.0005"/>'), ACCEPT),
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
]
