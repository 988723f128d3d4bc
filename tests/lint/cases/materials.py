"""Materials."""

from tests.lint.cases.arm import ACCEPT, REJECT, Case, arm, base_link

CASES = [
    Case("material-twice", arm(more='<material name="a"/><material name="a"/>'), REJECT, [("URDF709", 8)]),
    Case(
        "material-inside",
        base_link(
            '<visual><geometry><box size="1 1 1"/></geometry>'
            '<material name="m"><color rgba="1 0 0 1"/></material></visual>'
        ),
        ACCEPT,
    ),
]
