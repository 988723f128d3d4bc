"""Numbers and vectors."""

from tests.lint.cases.arm import ACCEPT, REJECT, WARN, Case, arm, axis, limit, xyz

_BAD = {
    "infinity": "inf 0 0",
    "negative-infinity": "-Infinity 0 0",
    "overflow": "1e400 0 0",
    "comma-decimal": "0,5 0 0",
    "commas": "0,0,1",
    "underscore": "1_0 0 0",
    "plus-plus": "++1 0 0",
    "no-mantissa": "e5 0 0",
    "no-exponent": "1e 0 0",
    "only-a-point": ". 0 0",
    "octal": "0o7 0 0",
    "fraction": "1/2 0 0",
    "expression": "pi/2 0 0",
    "wide-digits": "\uff11 0 0",
    "unicode-minus": "\u22121 0 0",
    "no-break-space": "0\u00a00 1",
    "unit": "100mm 0 0",
    "hex-float": "0x1p-3 0 0",
}

CASES = [
    *(Case(f"xyz-{name}", xyz(value), REJECT, [("URDF301", 6)]) for name, value in _BAD.items()),
    Case("xyz-one", xyz("1"), REJECT, [("URDF302", 6)]),
    Case("xyz-four", xyz("1 2 3 4"), REJECT, [("URDF302", 6)]),
    Case("xyz-odd-but-right", xyz("+1. .5e0 -0"), ACCEPT),
    Case("xyz-many-digits", xyz("0." + "1" * 400 + " 0 0"), ACCEPT),
    Case("xyz-underflow", xyz("1e-400 0 0"), WARN, [("URDF304", 6)]),
    Case("xyz-line-end", xyz("1\n0 0"), WARN, [("URDF303", 6)]),
    Case("xyz-tab-by-reference", xyz("1&#9;0 0"), WARN, [("URDF303", 6)]),
    Case("xyz-spaces-around", xyz("  1 0 0  "), ACCEPT),
    Case(
        "limit-trailing-blank",
        limit('lower="-1 " upper="1" effort="1" velocity="1"'),
        WARN,
        [("URDF303", 6)],
    ),
    Case("limit-leading-blank", limit('lower=" -1" upper="1" effort="1" velocity="1"'), ACCEPT),
    Case("limit-empty", limit('lower="" upper="1" effort="1" velocity="1"'), REJECT, [("URDF301", 6)]),
    Case("limit-two-numbers", limit('lower="-1 1" upper="1" effort="1" velocity="1"'), REJECT),
    Case("effort-infinite", limit('lower="-1" upper="1" effort="inf" velocity="1"'), REJECT),
    Case(
        "attribute-on-a-later-line",
        arm(origin='<origin\n rpy="0 0 0"\n xyz="a b c"/>'),
        REJECT,
        [("URDF301", 8)],
    ),
    Case("damping-no-number", arm(inside='<dynamics damping="x"/>'), REJECT, [("URDF301", 6)]),
    Case("calibration-no-number", arm(inside='<calibration rising="x"/>'), REJECT, [("URDF301", 6)]),
    Case("calibration-empty", arm(inside="<calibration/>"), ACCEPT),
    Case("dynamics-one-is-enough", arm(inside='<dynamics friction="0.1"/>'), ACCEPT),
    Case("axis-nan", axis("0 0 nan"), REJECT, [("URDF301", 6)]),
    Case(
        "quaternion-three",
        arm(robot='name="r" version="1.1"', origin='<origin quat_xyzw="0 0 1"/>'),
        REJECT,
        [("URDF302", 6)],
    ),
    Case("mimic-nan", arm(follow='<mimic joint="j1" multiplier="nan"/>'), REJECT, [("URDF301", 7)]),
]
