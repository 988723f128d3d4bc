"""Inertials."""

from tests.lint.cases.arm import ACCEPT, BALL, WARN, Case, base_link, inertial

CASES = [
    Case("inertial-right", inertial(BALL), ACCEPT),
    Case("inertial-empty", base_link("<inertial/>"), WARN, [("URDF701", 3)]),
    Case("inertial-no-izz", inertial('ixx="1" ixy="0" ixz="0" iyy="1" iyz="0"'), WARN, [("URDF701", 3)]),
    Case("inertial-negative", inertial(BALL.replace('izz="1"', 'izz="-1"')), WARN, [("URDF702", 3)]),
    Case("inertial-triangle", inertial(BALL.replace('izz="1"', 'izz="9"')), WARN, [("URDF702", 3)]),
    Case("inertial-products", inertial(BALL.replace('ixy="0"', 'ixy="5"')), WARN, [("URDF702", 3)]),
    Case("inertial-zero", inertial(BALL.replace('"1"', '"0"'), '<mass value="0"/>'), ACCEPT),
    Case("inertial-no-mass-but-moments", inertial(BALL, '<mass value="0"/>'), WARN, [("URDF702", 3)]),
    Case("inertial-rounding", inertial(BALL.replace('"1"', '"-1e-20"')), ACCEPT),
]
