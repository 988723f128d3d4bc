"""Limits."""

from tests.lint.cases.arm import ACCEPT, REJECT, WARN, Case, arm, limit

CASES = [
    Case("continuous-without-limit", arm(attributes='type="continuous"', limit=""), ACCEPT),
    Case(
        "continuous-zero-bounds",
        limit('lower="0" upper="0" effort="1" velocity="1"', "continuous"),
        ACCEPT,
    ),
    Case("limit-inverted", limit('lower="1" upper="-1" effort="1" velocity="1"'), REJECT, [("URDF507", 6)]),
    Case("limit-only-lower", limit('lower="1" effort="1" velocity="1"'), REJECT, [("URDF507", 6)]),
    Case("limit-only-upper", limit('upper="1" effort="1" velocity="1"'), ACCEPT),
    Case("limit-neither", limit('effort="1" velocity="1"'), WARN, [("URDF508", 6)]),
    Case(
        "limit-negative-effort",
        limit('lower="-1" upper="1" effort="-1" velocity="1"'),
        WARN,
        [("URDF509", 6)],
    ),
]
