"""How joints connect links."""

from tests.lint.cases.arm import ACCEPT, REJECT, Case, arm, fixed

_CHAIN = "".join(f'<link name="c{i}"/>' for i in range(3))

CASES = [
    Case("child-unknown", arm(ends='<parent link="base"/><child link="l2"/>'), REJECT, [("URDF408", 6)]),
    Case("parent-case", arm(ends='<parent link="Base"/><child link="l1"/>'), REJECT, [("URDF408", 6)]),
    Case(
        "two-components",
        arm(more=_CHAIN + fixed("a", "c0", "c1") + fixed("b", "c1", "c2")),
        REJECT,
        [("URDF411", 8)],
    ),
    Case(
        "loop-apart",
        arm(more=_CHAIN + fixed("a", "c0", "c1") + fixed("b", "c1", "c0")),
        REJECT,
        [("URDF412", 8)],
    ),
    Case("loop-of-all", arm(more=fixed("back", "tool", "base")), REJECT, [("URDF412", 8)]),
    Case("self-parent-root", arm(more=fixed("self", "base", "base")), REJECT, [("URDF409", 8)]),
    Case("same-two-links-twice", arm(more=fixed("again", "base", "l1")), REJECT, [("URDF410", 8)]),
    Case("single-link", '<robot name="r"><link name="only"/></robot>', ACCEPT),
]
