"""Names, and how joints connect links."""

from tests.lint.cases.arm import ACCEPT, REJECT, WARN, Case, arm, fixed


def structure_cases() -> list[Case]:
    chain = "".join(f'<link name="c{i}"/>' for i in range(3))
    return [
        Case("duplicate-link", arm(more='<link name="l1"/>'), REJECT, [("URDF402", 8)]),
        Case(
            "duplicate-joint",
            arm(more='<link name="x"/>' + fixed("j1", "base", "x")),
            REJECT,
            [("URDF402", 8)],
        ),
        Case(
            "joint-without-name",
            arm(more='<link name="x"/>' + fixed("", "base", "x")),
            REJECT,
            [("URDF401", 8)],
        ),
        Case("child-unknown", arm(ends='<parent link="base"/><child link="l2"/>'), REJECT, [("URDF408", 6)]),
        Case("parent-case", arm(ends='<parent link="Base"/><child link="l1"/>'), REJECT, [("URDF408", 6)]),
        Case(
            "two-components",
            arm(more=chain + fixed("a", "c0", "c1") + fixed("b", "c1", "c2")),
            REJECT,
            [("URDF411", 8)],
        ),
        Case(
            "loop-apart",
            arm(more=chain + fixed("a", "c0", "c1") + fixed("b", "c1", "c0")),
            REJECT,
            [("URDF412", 8)],
        ),
        Case("loop-of-all", arm(more=fixed("back", "tool", "base")), REJECT, [("URDF412", 8)]),
        Case("self-parent-root", arm(more=fixed("self", "base", "base")), REJECT, [("URDF409", 8)]),
        Case("same-two-links-twice", arm(more=fixed("again", "base", "l1")), REJECT, [("URDF410", 8)]),
        Case("single-link", '<robot name="r"><link name="only"/></robot>', ACCEPT),
        Case("link-universe", arm(more='<link name="universe"/>' + fixed("u", "tool", "universe")), WARN),
        Case(
            "joint-universe",
            arm(more='<link name="x"/>' + fixed("universe", "tool", "x")),
            WARN,
            [("URDF404", 8)],
        ),
        Case(
            "name-with-blank-end",
            arm(
                robot='name="r"',
                base='<link name="base"/><!-- -->',
                more='<link name="x "/>' + fixed("k", "tool", "x "),
            ),
            WARN,
            [("URDF405", 8)],
        ),
        Case(
            "name-escape-sequence",
            arm(more='<link name="&#x9b;31m"/>' + fixed("k", "tool", "&#x9b;31m")),
            WARN,
        ),
        Case(
            "name-line-end",
            arm(more='<link name="a\nb"/>' + fixed("k", "tool", "a\nb")),
            WARN,
            [("URDF406", 8)],
        ),
        Case("name-shell", arm(more='<link name="$(rm x)"/>' + fixed("k", "tool", "$(rm x)")), WARN),
        Case("name-html", arm(more='<link name="&lt;b&gt;"/>' + fixed("k", "tool", "&lt;b&gt;")), WARN),
        Case(
            "name-very-long", arm(more=f'<link name="{"n" * 5000}"/>' + fixed("k", "tool", "n" * 5000)), WARN
        ),
    ]
