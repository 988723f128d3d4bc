"""Inertials, shapes and materials."""

from tests.lint.cases.arm import ACCEPT, REJECT, WARN, Case, arm


def extras_cases() -> list[Case]:
    def link(inside: str) -> str:
        return arm(base=f'<link name="base">{inside}</link>')

    def inertial(moments: str, mass: str = '<mass value="1"/>') -> str:
        return link(f"<inertial>{mass}<inertia {moments}/></inertial>")

    ball = 'ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"'
    shape = "<visual><geometry>{}</geometry></visual>"
    return [
        Case("inertial-right", inertial(ball), ACCEPT),
        Case("inertial-empty", link("<inertial/>"), WARN, [("URDF701", 3)]),
        Case("inertial-no-izz", inertial('ixx="1" ixy="0" ixz="0" iyy="1" iyz="0"'), WARN, [("URDF701", 3)]),
        Case("inertial-nan", inertial(ball.replace('ixx="1"', 'ixx="nan"')), WARN, [("URDF704", 3)]),
        Case("inertial-mass-text", inertial(ball, '<mass value="1kg"/>'), WARN, [("URDF704", 3)]),
        Case("inertial-negative", inertial(ball.replace('izz="1"', 'izz="-1"')), WARN, [("URDF702", 3)]),
        Case("inertial-triangle", inertial(ball.replace('izz="1"', 'izz="9"')), WARN, [("URDF702", 3)]),
        Case("inertial-products", inertial(ball.replace('ixy="0"', 'ixy="5"')), WARN, [("URDF702", 3)]),
        Case("inertial-zero", inertial(ball.replace('"1"', '"0"'), '<mass value="0"/>'), ACCEPT),
        Case("inertial-no-mass-but-moments", inertial(ball, '<mass value="0"/>'), WARN, [("URDF702", 3)]),
        Case("inertial-rounding", inertial(ball.replace('"1"', '"-1e-20"')), ACCEPT),
        Case("visual-no-geometry", link("<visual/>"), WARN, [("URDF705", 3)]),
        Case("visual-no-shape", link(shape.format("")), WARN, [("URDF705", 3)]),
        Case("visual-unknown-shape", link(shape.format("<cone/>")), WARN, [("URDF705", 3)]),
        Case("visual-bad-number", link(shape.format('<sphere radius="big"/>')), WARN, [("URDF704", 3)]),
        Case("visual-no-radius", link(shape.format('<cylinder length="1"/>')), WARN, [("URDF705", 3)]),
        Case(
            "capsule-too-early",
            link(shape.format('<capsule radius="1" length="1"/>')),
            WARN,
            [("URDF705", 3)],
        ),
        Case("mesh-no-file", link(shape.format("<mesh/>")), WARN, [("URDF705", 3)]),
        Case(
            "mesh-https", link(shape.format('<mesh filename="https://x.org/a.stl"/>')), WARN, [("URDF707", 3)]
        ),
        Case(
            "mesh-package",
            link(shape.format('<mesh filename="package://no_such_pkg/a"/>')),
            WARN,
            [("URDF706", 3)],
        ),
        Case(
            "material-twice", arm(more='<material name="a"/><material name="a"/>'), REJECT, [("URDF709", 8)]
        ),
        Case(
            "material-inside",
            link(
                '<visual><geometry><box size="1 1 1"/></geometry>'
                '<material name="m"><color rgba="1 0 0 1"/></material></visual>'
            ),
            ACCEPT,
        ),
    ]
