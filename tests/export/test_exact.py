"""Exported code with exact constants has no double; the rounding errors of exported code are as derived."""

from __future__ import annotations

import ctypes
import math
import operator
import re
import shutil
import subprocess
from collections.abc import Callable
from fractions import Fraction
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests import urdfs
from tests.cli.running import good
from tests.cli.running import urdfkin as command
from tests.counted import Counted, Matrix, all_conspiring, deviation, eq
from tests.export.writing import ALL, code
from tests.kinematics.test_roundings import PARTS, most, of_sines, theirs, turn
from tests.laws.subjects import robot_of
from tests.reading import present
from urdfkin.export import FORMS, recursion, write
from urdfkin.export import exact as exact_module
from urdfkin.export.c import fill_template
from urdfkin.export.exact import ExactGraph, ExactProof, PiMultiple, evaluate_intervals, format_exact_literal
from urdfkin.export.expression import Graph, Node, find_dependencies
from urdfkin.export.proof import format_decimal
from urdfkin.kinematics import roundings
from urdfkin.kinematics.rotation import rotation_from_rpy
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.verify.exact.numbers import precision


def arm(rpy: str, axis: str = "0 0 1", offset: str = "1.5707963267948966") -> Robot:
    rule = urdfs.mimic("j", -0.5, offset) + urdfs.limit(-4, 4)
    joints = (
        urdfs.joint("j", "revolute", "a", "b", f'xyz="0.1 0 0.425" rpy="{rpy}"', axis, urdfs.limit(-3, 3)),
        urdfs.joint("k", "prismatic", "b", "c", 'xyz="0 0.3 0"', "0 -1 0", urdfs.limit()),
        urdfs.joint("m", "revolute", "c", "d", "", "0 0 -1", rule),
    )
    return urdfs.loaded(urdfs.robot(*joints, name="arm"))  # an axis that is not a unit vector


def algebra(robot: Robot, *quantities: str) -> tuple[Any, dict[str, Any]]:
    """Return SymPy and the functions of a file."""
    sympy, scope = pytest.importorskip("sympy"), dict[str, Any]()
    exec(robot.export("sympy-exact", quantities=quantities), scope)
    return sympy, scope


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["0 0 1", "1 2 2", "1 1 -1", "0.1 0 0"])
@pytest.mark.parametrize("rpy", ["0.3 -0.2 0.7", "1.57 0 0", "0 0 0"])
def test_expressions_are_equal_to_the_chain_at_fifty_digits(rpy: str, axis: str) -> None:
    robot = arm(rpy, axis, "0.25")
    exact = present(code(robot).exact)
    found = exact()
    assert found.proof.certificate.verified
    assert {function.name for function in found.functions} == set(ALL)
    with precision(90):
        for function in found.functions:
            for vector in found.proof.vectors:
                true = vector.results[function.name]
                for x, text in zip(evaluate_intervals(function, vector.inputs), true, strict=True):
                    room = abs(x) * type(x)("1e-49") + type(x)("1e-57")
                    assert abs(x - type(x)(text)) <= room, format_decimal(x)


@pytest.mark.slow
def test_symbolic_placements_contain_no_double_and_multiples_of_pi_are_simplified() -> None:
    sympy, scope = algebra(arm("1.5707963267948966 0 -0.5235987755982988"), "placement")
    q = sympy.symbols("q:2", real=True)
    T = scope["placement"](q)
    assert not T.atoms(sympy.Float)
    height = sympy.Rational(17, 40) + (sympy.Rational(3, 10) - q[1]) * sympy.cos(q[0])
    assert sympy.simplify(T[2, 3] - height) == 0
    at = T.subs(dict.fromkeys(q, 0))
    assert at[0, 3] == sympy.Rational(1, 10)
    assert sympy.simplify(T[:3, :3] * T[:3, :3].T) == sympy.eye(3)
    assert sympy.sqrt(3) / 2 in at.atoms(sympy.Mul)


@pytest.mark.slow
def test_the_exact_jacobian_is_the_symbolic_derivative_of_the_placement() -> None:
    sympy, scope = algebra(urdfkin.load("planar_two_link"), "placement", "jacobian")
    q = sympy.symbols("q:2", real=True)
    p = scope["placement"](q)[:3, 3]
    right = sympy.cos(q[0]) / 2 + 2 * sympy.cos(q[0] + q[1]) / 5
    assert sympy.simplify(sympy.expand_trig(p[0] - right)) == 0
    assert sympy.simplify(p.jacobian(q) - scope["jacobian"](q)[:3, :]) == sympy.zeros(3, 2)


@pytest.mark.slow
def test_an_exact_file_states_the_angles_that_became_multiples_of_pi() -> None:
    text = arm("1.5707963267948966 0 -0.5235987755982988").export("sympy-exact", quantities=["placement"])
    assert "2 different angles are multiples of pi, changed by at most 7.3e-17 rad" in text
    assert "the expressions below evaluated at 50 digits:" in text
    assert "single precision" not in text
    assert "rpy" not in text
    written = code(robot_of("panda"), quantities=("placement",))
    assert written.exact is not None
    assert isinstance(written.exact().proof, ExactProof)
    assert "Rational" not in write(written, "sympy")


@pytest.mark.slow
def test_the_command_states_the_proof_of_the_exact_expressions(tmp_path: Path) -> None:
    path, worst = tmp_path / "arm.py", re.compile(r"worst disagreement (\S+) eps")
    done = good("export panda --frame panda_hand --to sympy-exact -o", str(path))
    words = "The expressions were evaluated at 50 digits. Constants are the URDF's decimals; 3 diff"
    assert words in done.err
    exact = worst.findall(path.read_text("utf-8"))
    assert len(exact) == 3
    assert worst.findall(done.err) == exact
    double = good("export panda --frame panda_hand --to sympy -o", str(path)).err
    assert worst.findall(double) != exact
    assert "evaluated" not in double


@pytest.mark.slow
def test_the_command_reports_exact_expressions_that_were_not_compared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_functions: Any = exact_module.make_exact_functions
    # Only the comparison of the exact expressions is turned off.
    monkeypatch.setattr(
        exact_module, "make_exact_functions", lambda *given: make_functions(*given[:-1], False)
    )
    done = command("export planar_two_link --to sympy-exact -o", str(tmp_path / "arm.py"))
    assert done.code == 3
    assert "NOT VERIFIED" in done.err
    assert "evaluated" not in done.err
    assert "UNVERIFIED" in (tmp_path / "arm.py").read_text("utf-8").splitlines()[0]


@pytest.mark.slow
def test_a_difference_between_exact_expressions_and_pinocchio_is_an_error_of_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    zeros: Any = lambda function, inputs: np.zeros((103, *function.shape))  # noqa: E731
    monkeypatch.setattr(exact_module, "_evaluate_exactly", zeros)
    done = command("export", "planar_two_link", "--to", "sympy-exact", "-o", str(tmp_path / "arm.py"))
    assert done.code == 1
    assert "placement" in done.err
    assert not (tmp_path / "arm.py").exists()


def test_a_double_cannot_enter_an_exact_expression() -> None:
    graph = ExactGraph()
    x = graph.make_input("q", 0)
    assert format_exact_literal(Fraction(17, 40)) == "Rational(17, 40)"
    with pytest.raises(TypeError, match="is a double"):
        _ = 0.5 * x


@pytest.mark.parametrize(
    ("decimals", "text"),
    [
        ("1.5707963267948966", "pi/2"), ("-3.141592653589793", "(-pi)"), ("1.3089969389957472", "5*pi/12"),
        ("1.5708", "Rational(3927, 2500)"), ("0", "0"),
    ],
)  # fmt: skip
def test_an_angle_is_a_multiple_of_pi_if_its_double_is_the_nearest_one(decimals: str, text: str) -> None:
    assert format_exact_literal(ExactGraph().exact_angle(Fraction(decimals))) == text


def test_sines_and_roots_that_are_fractions_are_constants() -> None:
    graph = ExactGraph()
    assert graph.sine_cosine(PiMultiple(Fraction(-1, 2))) == (-1, 0)
    assert graph.sine_cosine(Fraction(0)) == (0, 1)
    assert graph.root(Fraction(9, 4)) == Fraction(3, 2)
    assert graph.root(Fraction(2)).op == "sqrt"


# Rounding errors of exported code, computed with numbers that count their rounding errors.


#: Numbers of rounding errors for omitted entries, different from those that `Counted` creates
_LEFT_OUT = count(-1, -1)
#: Largest error of sine and cosine, in halves of an eps
SINE = 2.0
_OPERATIONS: dict[str, Callable[..., Counted]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "neg": operator.neg,
}  # fmt: skip


def of_constant(R: Matrix, S: FloatArray) -> Matrix:
    """Return R S by the exported expressions; each omitted entry of S has the largest possible size."""
    graph, kept = Graph(), [recursion._drop_tiny_entries(row) for row in S.tolist()]
    letters = [[graph.make_input("q", 3 * r + c) for c in range(3)] for r in range(3)]
    results = graph.chapter.product(letters, kept)
    value: dict[Node, Counted] = {}
    for node in find_dependencies([x for row in results for x in row]):
        of = [value[x] if isinstance(x, Node) else Counted(float(x)) for x in node.operands if node.op != "q"]
        value[node] = _OPERATIONS[node.op](*of) if of else R[node.operands[0] // 3][node.operands[0] % 3]
    names = [[next(_LEFT_OUT) for _ in row] for row in S]

    def number(r: int, c: int) -> Counted:
        x = results[r][c]
        found = value[x] if isinstance(x, Node) else Counted(float(x))
        left = {names[k][c]: R[r][k].value * float(np.abs(S[k]).max()) for k in range(3) if kept[k][c] == 0.0}
        return Counted(found.value, found.errors | left)

    return tuple((number(r, 0), number(r, 1), number(r, 2)) for r in range(3))  # type: ignore[return-value]


def partly_zero(x: FloatArray) -> FloatArray:
    """Return a rotation about a coordinate axis, or one that exchanges axes, with tiny numbers."""
    exchange = rotation_from_rpy(np.round(x[4:7]) * math.pi / 2.0)
    about_z = rotation_from_rpy(np.array([0.0, 0.0, x[3] if x[6] > 0.0 else 0.0]))
    S = about_z @ exchange if x[5] > 0.0 else exchange @ about_z
    return np.where(np.abs(S) < 1e-9, 0.4 * EPS, S)


def turned(R: Matrix, angle: float, *, fused: bool) -> Matrix:
    """Return R times a joint's rotation, with the sine and cosine of C's batches."""
    numbers = (Counted(f(angle), {next(_LEFT_OUT): SINE}, fused) for f in (math.sin, math.cos))
    return eq.product(R, eq.about_z(*numbers, 0, 1))  # type: ignore[no-any-return]


def joint(x: FloatArray, *, fused: bool) -> Matrix:
    """Return a rotation times a joint's constant rotation times the joint's motion."""
    rows = of_sines(x)
    constant = tuple(tuple(Counted(c.value, c.errors, fused) for c in row) for row in rows)
    return turned(eq.product(turn(x[4:], fused=fused), constant), float(x[3]), fused=fused)


COUNTS: dict[str, tuple[Callable[[FloatArray], Matrix], float]] = {
    "a constant of which something is left out":
        (lambda x: of_constant(turn(x, fused=False), partly_zero(x)), 1.5),
    "a turn, fused": (lambda x: turned(turn(x, fused=True), float(x[3]), fused=True), 2.5),
    "a turn": (lambda x: turned(turn(x, fused=False), float(x[3]), fused=False), 2.6),
    "a joint, fused": (lambda x: joint(x, fused=True), 6.5),
    "a joint": (lambda x: joint(x, fused=False), 7.2),
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("name", COUNTS)
def test_the_largest_roundings_of_exported_code_are_those_in_the_table(name: str) -> None:
    part, counted = COUNTS[name]
    assert 0.8 * counted < most(all_conspiring, part) <= counted
    table = (roundings.__doc__ or "").partition("**An export.**")[2].partition("**MuJoCo.**")[0]
    assert f" {counted} |" in table


@pytest.mark.long
def test_the_roundings_of_a_joint_in_exported_code_are_within_the_count_of_the_bound() -> None:
    assert COUNTS["a constant of which something is left out"][1] < PARTS["Pinocchio's"][1]
    assert COUNTS["a joint"][1] + PARTS["a joint of Pinocchio's"][1] <= roundings.PINOCCHIO_ROUNDINGS
    own = most(deviation, lambda x: joint(x, fused=False))
    assert math.hypot(own, most(deviation, theirs)) < roundings.PINOCCHIO_ROUNDINGS / 9.0


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("fusing", ["off", "fast"])
def test_the_sines_and_cosines_of_the_c_code_have_errors_of_at_most_one_eps(
    real: str, fusing: str, tmp_path: Path
) -> None:
    source, library = tmp_path / "sines.c", tmp_path / "sines.so"
    head = f"#include <tgmath.h>\ntypedef {real} real;\n#define INLINE static\n"
    head += "#define SELDOM static\n#define R(x) ((real)(x))\n#define LANES 8\n"
    entrance = "void of(long n, const real *x, real *s, real *c) {\n"
    entrance += "    for (; n > 0; n -= 16, x += 16, s += 16, c += 16) sines_cosines(x, s, c, 2);\n}\n"
    source.write_text(head + fill_template("sines.c") + entrance, encoding="utf-8")
    flags = ["-std=c99", "-O2", "-march=native", f"-ffp-contract={fusing}", "-fPIC", "-shared"]
    subprocess.run(["cc", *flags, str(source), "-o", str(library), "-lm"], check=True)
    kind, far = (np.float64, 823_549.0) if real == "double" else (np.float32, 8192.0)
    rng = np.random.default_rng(0)
    ranges = [rng.uniform(-size, size, 40_000) for size in (1.0, 7.0, far, 2.0 * far)]
    zeros = np.arange(1, 4993) * (0.5 * np.pi)  # a sine or a cosine is nearly 0
    x = np.concatenate([*ranges, zeros]).astype(kind)
    found = np.empty((2, len(x)), kind)
    arrays = (ctypes.c_void_p(a.ctypes.data) for a in (x, *found))
    ctypes.CDLL(str(library)).of(ctypes.c_long(len(x)), *arrays)
    wide = x.astype(np.longdouble)
    error = np.abs(found - np.array([np.sin(wide), np.cos(wide)]))
    assert 0.3 < float(error.max()) / np.finfo(kind).eps < 0.5 * SINE
    # The error of a small sine of a large angle can be eps, more than eps times the sine.
    # So the bound in single precision needs both terms.
    within = (
        roundings.SINGLE_OPERATION_ERRORS["sin"] * np.finfo(kind).eps * np.abs([np.sin(wide), np.cos(wide)])
    )
    assert np.any(error > within) == (kind is np.float32)
    assert SINE == 2.0 * roundings.SINGLE_POLYNOMIAL_ERROR


def test_at_most_half_an_eps_of_the_largest_number_is_omitted_from_a_constant() -> None:
    for largest in (1.0, 0.3, 7e5, 5e-324):
        for share in (0.0, 0.49, 0.51, 1e3):
            row = largest, -share * EPS * largest, 0.0
            kept = recursion._drop_tiny_entries(row)
            assert kept[0] == largest
            assert abs(kept[1] - row[1]) <= 0.5 * EPS * largest
            assert kept[1] == row[1] or share < 0.5
    assert re.search(r"less\s+than\s+half\s+an\s+eps", roundings.__doc__ or "")


@pytest.mark.parametrize("form", FORMS)
def test_exact_code_names_the_locked_joints_in_every_form(form: str) -> None:
    held = arm("0 0 0").with_locked_joints({"k": 0.125})
    assert "Joint k is locked at 0.125" in held.export("sympy-exact", quantities=["placement"], form=form)
