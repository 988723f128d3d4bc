"""Legal and odd."""

from tests.lint.cases.arm import ACCEPT, REJECT, WARN, Case, arm, limit, xyz

_FAR = "<origin xyz='10 0 0'/>"


def rpy(value: str) -> str:
    return arm(origin=f'<origin xyz="0 0 1" rpy="{value}"/>')


CASES = [
    Case("rpy-exact", rpy("1.5707963267948966 0 0"), ACCEPT),
    Case("rpy-3.1416", rpy("0 3.1416 0"), ACCEPT, [("URDF601", 6)]),
    Case("rpy-cut-off", rpy("0 0 1.5707"), ACCEPT, [("URDF601", 6)]),
    Case("rpy-pi-third", rpy("0 0 1.0472"), ACCEPT, [("URDF601", 6)]),
    Case("rpy-plain-number", rpy("0.5 0.25 -1.25"), ACCEPT),
    Case("rpy-3.14-far", arm(origin='<origin rpy="3.14 0 0"/>', follow=_FAR), WARN, [("URDF601", 6)]),
    Case("rpy-degrees", rpy("90 0 0"), WARN, [("URDF602", 6)]),
    Case("limit-degrees", limit('lower="-180" upper="180" effort="1" velocity="1"'), WARN, [("URDF602", 6)]),
    Case("limit-several-turns", limit('lower="-12.56" upper="12.56" effort="1" velocity="1"'), ACCEPT),
    Case("limit-as-good-as-none", limit('lower="-1e6" upper="1e6" effort="1" velocity="1"'), ACCEPT),
    Case("millimetres", xyz("0 0 350"), WARN, [("URDF603", 6)]),
    Case(
        "prismatic-millimetres",
        limit('lower="0" upper="500" effort="1" velocity="1"', "prismatic"),
        WARN,
        [("URDF603", 6)],
    ),
    Case("huge-but-finite", xyz("1e308 0 0"), WARN, [("URDF603", 6)]),
    Case("overflow-of-the-sum", arm(origin='<origin xyz="1.7e308 1.7e308 0"/>'), REJECT, [("URDF606", 6)]),
    Case(
        "neutral-above-the-limits",
        limit('lower="-2" upper="-0.1" effort="1" velocity="1"'),
        ACCEPT,
        [("URDF608", 6)],
    ),
    Case(
        "neutral-below-the-limits",
        limit('lower="0.1" effort="1" velocity="1" upper="2"'),
        ACCEPT,
        [("URDF608", 6)],
    ),
    Case("neutral-at-a-limit", limit('lower="0" upper="2" effort="1" velocity="1"'), ACCEPT),
    Case("tiny-robot", xyz("0 0 1e-7"), WARN, [("URDF604", 2)]),
    Case("all-origins-zero", xyz("0 0 0"), ACCEPT),
]
