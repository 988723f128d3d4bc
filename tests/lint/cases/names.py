"""Names."""

from tests.lint.cases.arm import REJECT, WARN, Case, arm, fixed

CASES = [
    Case("no-robot-name", arm(robot=""), REJECT, [("URDF401", 2)]),
    Case("empty-robot-name", arm(robot='name=""'), WARN, [("URDF405", 2)]),
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
    Case("name-very-long", arm(more=f'<link name="{"n" * 5000}"/>' + fixed("k", "tool", "n" * 5000)), WARN),
]
