"""Shapes."""

from tests.lint.cases.arm import BALL, WARN, Case, base_link, inertial, shape

CASES = [
    Case("inertial-nan", inertial(BALL.replace('ixx="1"', 'ixx="nan"')), WARN, [("URDF704", 3)]),
    Case("inertial-mass-text", inertial(BALL, '<mass value="1kg"/>'), WARN, [("URDF704", 3)]),
    Case("visual-no-geometry", base_link("<visual/>"), WARN, [("URDF705", 3)]),
    Case("visual-no-shape", base_link(shape("")), WARN, [("URDF705", 3)]),
    Case("visual-unknown-shape", base_link(shape("<cone/>")), WARN, [("URDF705", 3)]),
    Case("visual-bad-number", base_link(shape('<sphere radius="big"/>')), WARN, [("URDF704", 3)]),
    Case("visual-no-radius", base_link(shape('<cylinder length="1"/>')), WARN, [("URDF705", 3)]),
    Case(
        "capsule-too-early",
        base_link(shape('<capsule radius="1" length="1"/>')),
        WARN,
        [("URDF705", 3)],
    ),
    Case("mesh-no-file", base_link(shape("<mesh/>")), WARN, [("URDF705", 3)]),
]
