"""Inertials, shapes, materials and meshes."""

from tests.urdf.lint.cases.arm import ACCEPT, BALL, REJECT, WARN, Case, arm, base_link, inertial, shape

_RED = '<material name="m"><color rgba="1 0 0 1"/></material>'

CASES = [
    # Inertials.
    Case("inertial-right", inertial(BALL), ACCEPT),
    Case("inertial-empty", base_link("<inertial/>"), WARN, "URDF701:3"),
    Case("inertial-no-izz", inertial('ixx="1" ixy="0" ixz="0" iyy="1" iyz="0"'), WARN, "URDF701:3"),
    Case("inertial-negative", inertial(BALL.replace('izz="1"', 'izz="-1"')), WARN, "URDF702:3"),
    Case("inertial-triangle", inertial(BALL.replace('izz="1"', 'izz="9"')), WARN, "URDF702:3"),
    Case("inertial-products", inertial(BALL.replace('ixy="0"', 'ixy="5"')), WARN, "URDF702:3"),
    Case("inertial-zero", inertial(BALL.replace('"1"', '"0"'), '<mass value="0"/>'), ACCEPT),
    Case("inertial-no-mass-but-moments", inertial(BALL, '<mass value="0"/>'), WARN, "URDF702:3"),
    Case("inertial-rounding", inertial(BALL.replace('"1"', '"-1e-20"')), ACCEPT),
    Case("inertial-nan", inertial(BALL.replace('ixx="1"', 'ixx="nan"')), WARN, "URDF704:3"),
    Case("inertial-mass-text", inertial(BALL, '<mass value="1kg"/>'), WARN, "URDF704:3"),
    # Shapes.
    Case("visual-no-geometry", base_link("<visual/>"), WARN, "URDF705:3"),
    Case("visual-no-shape", base_link(shape("")), WARN, "URDF705:3"),
    Case("visual-unknown-shape", base_link(shape("<cone/>")), WARN, "URDF705:3"),
    Case("visual-bad-number", base_link(shape('<sphere radius="big"/>')), WARN, "URDF704:3"),
    Case("visual-no-radius", base_link(shape('<cylinder length="1"/>')), WARN, "URDF705:3"),
    Case("capsule-too-early", base_link(shape('<capsule radius="1" length="1"/>')), WARN, "URDF705:3"),
    Case("mesh-no-file", base_link(shape("<mesh/>")), WARN, "URDF705:3"),
    # Materials.
    Case("material-twice", arm(more='<material name="a"/><material name="a"/>'), REJECT, "URDF709:8"),
    Case("material-inside", base_link(shape('<box size="1 1 1"/>').replace("</v", f"{_RED}</v")), ACCEPT),
    # Meshes.
    Case("mesh-https", base_link(shape('<mesh filename="https://x.org/a.stl"/>')), WARN, "URDF707:3"),
    Case("mesh-package", base_link(shape('<mesh filename="package://no_such_pkg/a"/>')), WARN, "URDF706:3"),
]
