"""Meshes."""

from tests.lint.cases.arm import WARN, Case, base_link, shape

CASES = [
    Case("mesh-https", base_link(shape('<mesh filename="https://x.org/a.stl"/>')), WARN, [("URDF707", 3)]),
    Case(
        "mesh-package",
        base_link(shape('<mesh filename="package://no_such_pkg/a"/>')),
        WARN,
        [("URDF706", 3)],
    ),
]
