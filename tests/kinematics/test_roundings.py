"""The rounding errors in the bounds are measured with numbers that record each rounding."""

import ast
import itertools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.counted import Counted, Matrix, all_conspiring, deviation, eq, matrix, sine_cosine, unit
from urdfkin.dh.snapping import _round_rotation, rotation_angle
from urdfkin.dh.table import nearest_twelfth
from urdfkin.kinematics import roundings
from urdfkin.kinematics.rotation import rotation_from_rpy
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.tree import FloatArray

PACKAGE = Path(roundings.__file__).parent


def turn(x: FloatArray, *, fused: bool) -> Matrix:
    return matrix(rotation_from_rpy(x[:3]), fused=fused)


def about_z(angle: float, *, fused: bool) -> Matrix:
    return eq.about_z(*sine_cosine(angle, fused=fused), 0, 1)  # type: ignore[no-any-return]


def of_sines(x: FloatArray) -> Matrix:
    """Return the rotation of roll, pitch and yaw without fused sums, as fused numbers for the recursion."""
    (sr, cr), (sp, cp), (sy, cy) = (sine_cosine(float(angle), fused=False) for angle in x[:3])
    cc, cs, sc, ss = cr * cy, cr * sy, sr * cy, sr * sy
    R = (
        (cp * cy, sp * sc - cs, sp * cc + ss),
        (cp * sy, sp * ss + cc, sp * cs - sc),
        (-sp, cp * sr, cp * cr),
    )
    return tuple(tuple(Counted(c.value, c.errors, fused=True) for c in row) for row in R)  # type: ignore[return-value]


def through_a_quaternion(x: FloatArray) -> Matrix:
    (sa, ca), (sb, cb), (sc, cc) = (sine_cosine(0.5 * float(angle), fused=False) for angle in x[:3])
    quaternion = (
        sa * cb * cc - ca * sb * sc,
        ca * sb * cc + sa * cb * sc,
        ca * cb * sc - sa * sb * cc,
        ca * cb * cc + sa * sb * sc,
    )
    return eq.rotation_of_quaternion(*unit(quaternion))  # type: ignore[no-any-return]


def ours(x: FloatArray) -> Matrix:
    constant = eq.product(turn(x[4:], fused=True), of_sines(x))
    return eq.product(constant, about_z(float(x[3]), fused=True))  # type: ignore[no-any-return]


def theirs(x: FloatArray) -> Matrix:
    joint = eq.product(through_a_quaternion(x), about_z(float(x[3]), fused=False))
    return eq.product(turn(x[4:], fused=False), joint)  # type: ignore[no-any-return]


def quaternion(angles: FloatArray, *, exact: bool) -> list[Counted]:
    parts = []
    for i, angle in enumerate(angles[:3]):
        s, c = sine_cosine(0.5 * float(angle), fused=False)
        nothing = Counted(0.0)
        parts.append([c, *(s if j == i else nothing for j in range(3))])
    found = unit(hamilton(hamilton(parts[2], parts[1]), parts[0]))
    return [Counted(x.value) for x in found] if exact else found


def hamilton(p: list[Counted], q: list[Counted]) -> list[Counted]:
    """`mju_mulQuat`."""
    return [
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    ]


def matrix_of(q: list[Counted]) -> Matrix:
    """`mju_quat2Mat`."""
    w, x, y, z = q
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    return (
        (ww + xx - yy - zz, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), ww - xx + yy - zz, 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), ww - xx - yy + zz),
    )


def mujocos(x: FloatArray) -> Matrix:
    """Multiply an orientation by a constant rotation and a joint's rotation, and normalise the quaternion."""
    s, c = sine_cosine(0.5 * float(x[3]), fused=False)
    turned = hamilton(quaternion(x[4:], exact=True), quaternion(x, exact=False))
    axis = unit([Counted(float(a)) for a in rotation_from_rpy(x[1:4])[0]])
    return matrix_of(unit(hamilton(turned, [c, *(s * a for a in axis)])))


def most(measure: Callable[[Matrix], float], part: Callable[[FloatArray], Matrix]) -> float:
    """Return the largest value of a search that starts at random angles."""
    rng = np.random.default_rng(0)
    found = sorted(((measure(part(x)), tuple(x)) for x in rng.uniform(-4.0, 4.0, (60, 7))), reverse=True)[:3]
    for _ in range(80):
        for i, (size, x) in enumerate(found):
            y = np.array(x) + rng.normal(size=7) * 10.0 ** rng.uniform(-2.5, 0.0) * (rng.random(7) < 0.5)
            if (larger := measure(part(y))) > size:
                found[i] = larger, tuple(y)
    return max(found)[0]


PARTS: dict[str, tuple[Callable[[FloatArray], Matrix], float]] = {
    "urdfkin's product with a constant": (
        lambda x: eq.product(turn(x, fused=True), turn(x[3:], fused=True)),
        1.5,
    ),
    "Pinocchio's": (lambda x: eq.product(turn(x, fused=False), turn(x[3:], fused=False)), 1.8),
    "urdfkin's turn": (lambda x: eq.product(turn(x, fused=True), about_z(float(x[3]), fused=True)), 1.5),
    "Pinocchio's turn": (lambda x: eq.product(turn(x, fused=False), about_z(float(x[3]), fused=False)), 1.7),
    "urdfkin's reading": (of_sines, 3.1),
    "Pinocchio's reading": (through_a_quaternion, 12.5),
    "a joint of urdfkin's": (ours, 5.7),
    "a joint of Pinocchio's": (theirs, 16.8),
    "a joint of MuJoCo's": (mujocos, 21.5),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PARTS)
def test_the_table_of_roundings_is_sufficient_and_not_much_too_large(name: str) -> None:
    part, counted = PARTS[name]
    assert 0.8 * counted < most(all_conspiring, part) <= counted
    table = (roundings.__doc__ or "").split("**A base.**")[0]
    assert f" {counted} |" in table


@pytest.mark.slow
def test_the_sum_of_all_roundings_of_a_joint_is_within_the_count() -> None:
    together = PARTS["a joint of urdfkin's"][1] + PARTS["a joint of Pinocchio's"][1]
    assert together == pytest.approx(22.5)
    assert together < roundings.PINOCCHIO_ROUNDINGS
    assert math.hypot(most(deviation, ours), most(deviation, theirs)) < roundings.PINOCCHIO_ROUNDINGS / 9.0
    with_mujoco = PARTS["a joint of urdfkin's"][1] + PARTS["a joint of MuJoCo's"][1]
    assert with_mujoco + 1.5 < roundings.MUJOCO_ROUNDINGS


def test_snapping_rounded_angles_changes_them_less_than_one_rotation_may_round() -> None:
    angles = [nearest_twelfth(k * math.pi / 12.0) for k in range(-11, 13)]
    rpy = np.array(list(itertools.product(angles[::2], angles[5:18], angles[::2])))
    for R in rotation_from_rpy(rpy):
        assert rotation_angle(_round_rotation(R, 0.0), R) <= 0.25 * roundings.ROTATION_ROUNDINGS * EPS


def multiples_of_eps(tree: ast.AST) -> list[int]:
    lines = list[int]()
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div):
            sides = [
                x.id if isinstance(x, ast.Name) else getattr(x, "attr", "") for x in (node.left, node.right)
            ]
            typed = any(isinstance(x, ast.Constant) for x in (node.left, node.right))
            lines += [node.lineno] if typed and "EPS" in "".join(sides).upper() else []
        elif isinstance(node, ast.Attribute) and node.attr in ("finfo", "float_info"):
            lines.append(node.lineno)
    return lines


def test_no_other_file_contains_a_tolerance() -> None:
    homes = {"roundings.py", "bounds.py"}
    lone = [
        f"{path.relative_to(PACKAGE)}:{line}"
        for path in sorted(PACKAGE.rglob("*.py"))
        if path.name not in homes
        for line in multiples_of_eps(ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert lone == []
    assert multiples_of_eps(ast.parse("x <= 4.0 * EPS * scale")) == [1]
    assert multiples_of_eps(ast.parse("np.finfo(float).eps")) == [1]
