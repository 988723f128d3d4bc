"""Exported files run and compute true values; a wrong file reports its error."""

import ast
import copy
import importlib.machinery
import importlib.util
import pickle
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from flint import arb

import urdfkin
from tests import urdfs
from tests.cli.running import good
from tests.cli.running import urdfkin as command
from tests.export.writing import ALL, built, code, file, module, need, ran
from tests.high_precision import mp, true_motion
from tests.laws.subjects import robot_of, state
from tests.reading import module_of
from tests.urdfs import joint, limit, mimic
from urdfkin.cli.export import _LANGUAGES_OF_SUFFIXES
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.export import LANGUAGES, write
from urdfkin.export.check import _COMPILE_COMMANDS, check
from urdfkin.export.proof import format_decimal
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.reference import Reference
from urdfkin.model.tree import LinkFrame
from urdfkin.verify.call import Call
from urdfkin.verify.exact.numbers import precision
from urdfkin.verify.quantities import QUANTITIES
from urdfkin.verify.verifier import compute_bound

RUN = [to for to in LANGUAGES if to != "latex"]
_THREE = ("placement", "jacobian", "acceleration")
#: Languages whose check runs in double and in single precision
BOTH = ("c", "cpp", "cuda", "array", "jax", "torch")


def refuses(function: Any, wrong: Any, right: Any, error: type[Exception], words: str) -> None:
    """A function of q and v refuses `wrong` in both arguments; `words` follow the argument's name."""
    for letter, inputs in (("q", (wrong, right)), ("v", (right, wrong))):
        with pytest.raises(error, match=f"{letter} {words}"):
            function(*inputs)


@pytest.mark.slow
@pytest.mark.parametrize("to", RUN)
def test_the_exported_file_of_an_arm_agrees_with_values_of_fifty_digits(to: str, tmp_path: Path) -> None:
    need(to)
    found = check(file(code(urdfkin.load("ur5", verify=False), quantities=_THREE), to, tmp_path))
    assert found.passed, found.lines
    gradients = len(_THREE) if to == "torch" else 0
    assert len(found.lines) == len(_THREE) * (2 if to in BOTH else 1) + gradients


def test_the_fifty_digits_of_a_test_vector_are_those_of_the_true_value() -> None:
    robot = urdfkin.load("ur5", verify=False)
    vector, link = code(robot, quantities=_THREE).proof.vectors[0], robot.tree.frame_link(robot.tip_frame)
    motion = true_motion(robot, [np.array(x) for x in vector.inputs])
    for name, digits in vector.results.items():
        true = QUANTITIES[name.replace("_", " ")].enclose(motion, link, Reference.LOCAL_WORLD_ALIGNED)
        for text, value in zip(digits, true.ravel(), strict=True):
            assert abs(mp.mpf(text) - value) <= max(abs(value) * mp.mpf(10) ** -49, mp.mpf(10) ** -58)


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (0, "0.0"), (1, "1.0"), (-0.375, "-0.375"), ("0.1", "0.1"), ("1e70", "1.0e+70"),
        ("-2.5e-7", "-2.5e-7"),
        ("0.6666666666666666666666666666666666666666666666666666666", f"0.{'6' * 49}7"),
    ],
)  # fmt: skip
def test_a_ball_is_written_with_fifty_digits_without_trailing_zeros(number: Any, text: str) -> None:
    with precision(90):
        ball = arb(number)
        assert format_decimal(ball) == text
        assert format_decimal(ball - ball) == "0.0"
        assert format_decimal(1 / (1 / (ball + 3)) - 3) == text


@pytest.mark.slow
@pytest.mark.parametrize("to", ["c", "cuda", "numpy", "array", "torch", "sympy-exact"])
@pytest.mark.parametrize("name", ["planar_and_floating_in_the_middle", "sizes", "mimic_hand_40_sliding"])
def test_exported_files_of_all_joint_kinds_extreme_lengths_and_a_hand_compute_true_values(
    to: str, name: str, tmp_path: Path
) -> None:
    need(to)
    # A Hessian of so many rates takes a compiler half a minute.
    asked = tuple(row for row in ALL if row != "hessian" or to in ("numpy", "array", "sympy-exact"))
    found = check(file(code(robot_of(name), quantities=asked), to, tmp_path))
    assert found.passed, found.lines
    assert len(found.lines) == len(asked) * (3 if to == "torch" else 2 if to in BOTH else 1)


@pytest.mark.slow
@pytest.mark.parametrize("to", ["c", "numpy", "sympy-exact"])
def test_the_exported_file_of_a_small_robot_computes_true_values_in_every_reference_frame(
    to: str, tmp_path: Path
) -> None:
    need(to)
    robot = urdfkin.load("planar_two_link")
    for reference in Reference:
        written = code(robot, quantities=("jacobian_rate", "hessian", "acceleration"), reference=reference)
        found = check(file(written, to, tmp_path))
        assert found.passed
        assert found.verified


@pytest.mark.slow
@pytest.mark.parametrize(
    ("compiler", "options"),
    [
        ("gcc", ["-std=c99", "-O1"]),
        ("clang", ["-std=c99", "-O1"]),
        # Code for registers of eight numbers; the compiler splits them into smaller ones here.
        ("gcc", ["-std=c99", "-O1", "-D__AVX512F__", "-Wno-psabi"]),
        ("gcc", ["-std=c11", "-O3", "-march=native", "-ffp-contract=fast"]),
    ],
)
def test_c_code_compiles_without_a_warning_with_every_compiler_and_option(
    compiler: str, options: Any, tmp_path: Path
) -> None:
    written = code(robot_of("mimic_hand_40_sliding"), quantities=("jacobian", "acceleration"))
    path, name = file(written, "c", tmp_path), written.name.upper()
    for more in ([], [f"-D{name}_PORTABLE"], [f"-D{name}_REAL=float"]):
        said = built(path, compiler, *options, *more)
        assert said.count("good ") == 2
        assert "WRONG" not in said


@pytest.mark.slow
def test_c_code_has_no_invalid_memory_access_and_no_undefined_behaviour(tmp_path: Path) -> None:
    need("c")
    path = file(code(robot_of("planar_and_floating_in_the_middle"), quantities=_THREE), "c", tmp_path)
    said = built(path, "cc", "-std=c99", "-g", "-fsanitize=address,undefined")
    assert said.count("good ") == len(_THREE)


@pytest.mark.parametrize(
    ("to", "compiler"),
    [("c", "gcc"), ("c", "clang"), *((to, x) for to in ("cpp", "cuda") for x in ("g++", "clang++"))],
)
def test_options_that_let_compilers_reorder_sums_are_refused(to: str, compiler: str, tmp_path: Path) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    path = file(code(urdfkin.load("planar_two_link"), quantities=("placement",)), to, tmp_path)
    command = [compiler, "-x", "c" if to == "c" else "c++", "-fsyntax-only", str(path)]
    assert subprocess.run(command, check=False).returncode == 0
    # Clang has one macro only.
    for rest in [[], ["-fno-finite-math-only"]] if compiler in ("gcc", "g++") else [[]]:
        done = subprocess.run([*command, "-ffast-math", *rest], capture_output=True, text=True, check=False)
        assert done.returncode != 0
        assert "-ffast-math" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("to", RUN)
def test_the_check_of_a_file_detects_a_changed_constant(to: str, tmp_path: Path) -> None:
    need(to)
    path = file(code(urdfkin.load("ur5"), quantities=("placement", "acceleration")), to, tmp_path)
    old, new = ("1569, 4000", "1570, 4000") if to == "sympy-exact" else (r"0\.39225", "0.39226")
    text, count = re.subn(old, new, path.read_text("utf-8"), count=1)
    assert count == 1
    path.write_text(text, "utf-8")
    found = check(path)
    assert not found.passed
    assert any(line.startswith("WRONG placement") for line in found.lines)
    assert any(line.startswith("good acceleration") for line in found.lines)


@pytest.mark.slow
@pytest.mark.parametrize("to", ["numpy", "array", "torch", "sympy-exact"])
def test_the_check_of_a_file_detects_a_change_of_any_constant_by_a_billionth(to: str, tmp_path: Path) -> None:
    need(to)
    text = file(code(robot_of("panda"), quantities=_THREE), to, tmp_path).read_text("utf-8")
    functions = [x for x in ast.parse(text).body if isinstance(x, ast.FunctionDef) and x.name in _THREE]
    lines, changed = text.splitlines(keepends=True), 0
    for node in (node for function in functions for node in ast.walk(function)):
        fraction = isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Rational"
        if fraction == (to == "sympy-exact") and (fraction or isinstance(getattr(node, "value", 0), float)):
            assert isinstance(node, ast.expr)
            row, first, last = node.lineno - 1, node.col_offset, node.end_col_offset
            line, scope = lines[row], dict[str, Any](__name__="changed")
            other = f"{line[:first]}({line[first:last]} + 1e-9){line[last:]}"
            exec("".join([*lines[:row], other, *lines[row + 1 :]]), scope)
            assert max(scope["check"]().values()) > 1.0, line
            changed += 1
    assert changed > 20


@pytest.mark.slow
@pytest.mark.parametrize("to", ["c", "cuda", "numpy", "array", "torch", "matlab", "sympy-exact"])
def test_a_frame_that_no_joint_moves_can_be_exported(to: str, tmp_path: Path) -> None:
    need(to)
    robot = urdfkin.load("planar_two_link")
    assert check(file(code(robot, robot.link_names[0]), to, tmp_path)).passed
    still = robot_of("single_link")
    assert check(file(code(still, quantities=("placement",)), to, tmp_path)).passed


@pytest.mark.slow
def test_an_exported_python_file_can_check_the_results_without_urdfkin(tmp_path: Path) -> None:
    path = file(code(urdfkin.load("ur5"), quantities=("jacobian",)), "numpy", tmp_path)
    imports = re.findall(r"^(?:from|import) .*$", path.read_text("utf-8"), re.MULTILINE)
    assert "urdfkin" not in "".join(imports)
    done = ran(path)
    assert done.returncode == 0
    assert done.stdout.startswith("good jacobian: 4 test vectors")


def test_numpys_functions_accept_any_batch(tmp_path: Path) -> None:
    robot = robot_of("panda")
    own = module(robot, "numpy", tmp_path)
    q, v, a = state(robot, 6, 1)
    q = q.reshape(2, 3, -1)
    assert own.jacobian(q).shape == (2, 3, 6, robot.nv)
    found, right = own.acceleration(q, v[0], a[0]), robot.acceleration(q, v[0], a[0], robot.tip_frame)
    assert found.shape == (2, 3, 6)
    assert np.allclose(found, right, rtol=0, atol=1e-12)


#: Namespaces of the array API in which exported code runs here
NAMESPACES = ("numpy", "array_api_strict", "jax.numpy", "array_api_compat.torch")


def namespace(name: str) -> Any:
    """Return a namespace in double precision; skip the test without the library."""
    if name == "jax.numpy":
        pytest.importorskip("jax").config.update("jax_enable_x64", True)
    if name == "array_api_compat.torch":
        pytest.importorskip("torch")
    return pytest.importorskip(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMESPACES)
def test_the_file_for_any_array_computes_true_values_in_a_namespace(name: str, tmp_path: Path) -> None:
    xp = namespace(name)
    for robot in (urdfkin.load("ur5"), robot_of("planar_and_floating_in_the_middle")):
        asked = [row for row in ALL if row != "hessian"]
        found = module(robot, "array", tmp_path, *asked).check(xp)
        assert len(found) == 2 * len(asked)
        assert max(found.values()) < 1.0


@pytest.mark.parametrize("to", ["array", "jax", "torch"])
def test_exported_functions_modify_no_array_in_place(to: str) -> None:
    tree = ast.parse(write(code(robot_of("planar_and_floating_in_the_middle"), quantities=_THREE), to))
    functions = [x for x in tree.body if isinstance(x, ast.FunctionDef) and x.name in _THREE]
    assert len(functions) == len(_THREE)
    for node in (node for function in functions for node in ast.walk(function)):
        assert not isinstance(node, ast.AugAssign)
        if isinstance(node, ast.Assign):
            assert all(isinstance(x, ast.Name | ast.Tuple) for x in node.targets)


@pytest.mark.parametrize("name", NAMESPACES)
def test_functions_of_any_array_refuse_a_wrong_length_and_whole_numbers(name: str, tmp_path: Path) -> None:
    xp = namespace(name)
    velocity = module("planar_two_link", "array", tmp_path, "velocity").velocity
    right = xp.zeros((5, 2), dtype=xp.float64)
    for wrong in (xp.zeros((5, 3), dtype=xp.float64), right[:, :1], right[0, 0]):
        shape = re.escape(str(tuple(wrong.shape)))
        refuses(
            velocity, wrong, right, ValueError, f"needs 2 numbers on its last axis: found the shape {shape}"
        )
    whole = xp.zeros((5, 2), dtype=xp.int64)
    refuses(velocity, whole, right, TypeError, "needs a floating type: found .*int64")
    assert velocity(right, right[0, :]).shape == (5, 6)


def test_numpys_functions_refuse_a_wrong_length_and_convert_whole_numbers(tmp_path: Path) -> None:
    own = module("planar_two_link", "numpy", tmp_path, "placement")
    assert np.array_equal(own.placement([0, 1]), own.placement([0.0, 1.0]))
    for wrong in ([0.0], [0.0, 1.0, 2.0], 0.0):
        with pytest.raises(ValueError, match="q needs 2 numbers on its last axis"):
            own.placement(wrong)


@pytest.mark.parametrize(
    ("wrong", "found"),
    [
        ([1j, 0.0], "complex128"), (["1", "2"], "<U1"), ("ab", "<U2"), ([None, 0.0], "object"),
        ({"q": 1.0}, "object"), (np.array(["2026-11-24"] * 2, dtype="datetime64[D]"), r"datetime64\[D\]"),
    ],
)  # fmt: skip
def test_numpys_functions_refuse_inputs_that_are_not_real_numbers(
    wrong: Any, found: str, tmp_path: Path
) -> None:
    velocity = module("planar_two_link", "numpy", tmp_path, "velocity").velocity
    refuses(velocity, wrong, [0.0, 0.0], TypeError, rf"needs real numbers: found {found}$")


@pytest.mark.parametrize("to", ["numpy", "array"])
def test_functions_refuse_a_masked_value(to: str, tmp_path: Path) -> None:
    velocity = module("planar_two_link", to, tmp_path, "velocity").velocity
    masked = np.ma.array([0.3, 0.4], mask=[True, False])
    refuses(velocity, masked, np.zeros(2), TypeError, "needs an array: found MaskedArray")


@pytest.mark.parametrize("to", ["numpy", "array"])
def test_nan_in_an_input_reaches_every_result_that_depends_on_it(to: str, tmp_path: Path) -> None:
    robot = robot_of("planar_and_floating_in_the_middle")
    own = module(robot, to, tmp_path, *_THREE)
    for name, given in zip(_THREE, (1, 1, 3), strict=True):
        function, inputs = getattr(own, name), [x[0] for x in state(robot, 1, 4)][:given]
        right = function(*inputs)
        for k, i in ((k, i) for k, x in enumerate(inputs) for i in range(len(x))):
            moved, unknown = ([x.copy() for x in inputs] for _ in range(2))
            moved[k][i] += 0.3
            unknown[k][i] = np.nan
            depends = function(*moved) != right
            found = function(*unknown)
            assert np.all(np.isnan(found[depends]))
            assert np.all((found == right) | np.isnan(found))


@pytest.mark.parametrize("installed", [True, False])
def test_functions_of_any_array_refuse_an_input_that_is_no_array(
    installed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not installed:
        monkeypatch.setitem(sys.modules, "array_api_compat", None)
    own = module("planar_two_link", "array", tmp_path, "velocity")
    right = np.zeros(2)
    for wrong, found in (([0.0, 0.0], "list"), ("ab", "str"), (None, "NoneType")):
        words = rf"q needs an array of an array API .*: found builtins\.{found}\."
        with pytest.raises(TypeError, match=words):
            own.velocity(wrong, right)
        with pytest.raises(TypeError, match=f"v needs an array: found {found}$"):
            own.velocity(right, wrong)


def test_functions_of_casadi_refuse_a_wrong_length(tmp_path: Path) -> None:
    casadi: Any = pytest.importorskip("casadi")
    velocity = module("planar_two_link", "casadi", tmp_path, "velocity").velocity
    for kind in (casadi.SX, casadi.MX):
        for right in (kind.sym("q", 2), kind.sym("q", 1, 2), [0.0, kind.sym("q")], np.zeros(2)):
            assert velocity(right, [0.0, 1.0]).shape == (6, 1)
        three, four = kind.sym("q", 3), kind.sym("q", 2, 2)
        for wrong, found in ((three, r"\(3, 1\)"), (four, r"\(2, 2\)"), ([0.0], r"\(1,\)")):
            refuses(velocity, wrong, [0.0, 1.0], ValueError, f"needs 2 numbers: found the shape {found}")


@pytest.mark.parametrize("to", ["sympy", "sympy-exact"])
def test_functions_of_sympy_refuse_a_wrong_length(to: str, tmp_path: Path) -> None:
    sympy: Any = pytest.importorskip("sympy")
    velocity = module("planar_two_link", to, tmp_path, "velocity").velocity
    right = sympy.symbols("q:2")
    assert velocity(right, sympy.Matrix(right)).shape == (6, 1)
    for wrong in (sympy.symbols("q:3"), [0]):
        refuses(velocity, wrong, right, ValueError, f"needs 2 numbers: found {len(wrong)}$")


@pytest.mark.slow
def test_functions_of_matlab_refuse_a_wrong_length(tmp_path: Path) -> None:
    need("matlab")
    path = file(code(urdfkin.load("planar_two_link"), quantities=("velocity",)), "matlab", tmp_path)
    calls = ("[0 1 2], [0 1]", "[0 1], 0", "[0; 1], [0 1]")
    lines = [f"try, disp(size(f.velocity({x}))), catch e, disp(e.message), end" for x in calls]
    command = ["octave-cli", "--no-init-file", "--eval", f"f = {path.stem}(); {'; '.join(lines)}"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    said = [" ".join(line.split()) for line in done.stdout.splitlines()]
    assert said == ["q needs 2 numbers: found 3", "v needs 2 numbers: found 1", "6 1"]


@pytest.mark.slow
def test_numbas_functions_refuse_a_wrong_length(tmp_path: Path) -> None:
    velocity, q = module("planar_two_link", "numba", tmp_path, "velocity").velocity, np.zeros(3)
    for wrong in (q, q[:1]):
        refuses(velocity, wrong, q[:2], ValueError, "needs 2 numbers")
    assert velocity(q[:2], q[:2]).shape == (6,)


def test_the_check_refuses_an_array_namespace_that_converts_float64_to_float32(tmp_path: Path) -> None:
    own = module("planar_two_link", "array", tmp_path, "placement")
    narrow = SimpleNamespace(float64=np.float64, float32=np.float32)
    narrow.asarray = lambda x, dtype: np.asarray(x, dtype=np.float32)
    with pytest.raises(TypeError, match=r"makes float32 of float64.*jax_enable_x64"):
        own.check(narrow)


class _Tensor(np.ndarray):
    """An array with the only method of PyTorch's tensors that exported code calls."""

    def is_floating_point(self) -> bool:
        return bool(np.issubdtype(self.dtype, np.floating))


def _torch(gradcheck: Callable[..., bool]) -> ModuleType:
    """Return a module with the functions of PyTorch that exported code calls, computed by NumPy."""
    made = ModuleType("torch")
    found = {name: getattr(np, name) for name in ("cos", "sin", "zeros_like", "broadcast_to", "reshape")}
    found |= {"stack": lambda x, dim: np.stack(x, axis=dim), "float64": np.float64, "int64": np.int64}
    found |= {"nn": SimpleNamespace(Module=object), "autograd": SimpleNamespace(gradcheck=gradcheck)}
    found |= {"Tensor": _Tensor, "tensor": lambda x, dtype, **_: np.array(x, dtype=dtype).view(_Tensor)}
    made.__dict__.update(found)
    return made


_GEARED = urdfs.robot(
    joint("end", "fixed", "c", "d", 'xyz="0.5 0 0.2"', axis=""),
    joint("j", "revolute", "a", "b", more=limit(-2, 2)),
    joint("k", "revolute", "b", "c", 'xyz="1 0 0"', "0 1 0", mimic("j", "{}") + limit(-1e9, 1e9)),
)


@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
@pytest.mark.parametrize("multiplier", [1.0, 30.0, 2000.0])
def test_the_tolerance_of_difference_quotients_includes_their_truncation(
    multiplier: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = urdfkin.load(_GEARED.format(multiplier))
    slopes = {
        "placement": lambda q: np.hstack((robot.jacobian(q, "d")[..., :3, 0], np.zeros((1, 1)))),
        "jacobian": lambda q: robot.hessian(q, "d")[..., 0],
    }
    seen = []

    def gradcheck(function: Any, inputs: Any, *, eps: float, atol: float, **_: Any) -> bool:
        (q,), name = inputs, function.__name__
        quotient = (function(q + eps) - function(q - eps)) / (2.0 * eps)
        seen.append((name, atol))
        found = quotient[..., 3] if name == "placement" else quotient
        return bool(np.all(np.abs(found - slopes[name](np.asarray(q))) <= atol))

    monkeypatch.setitem(sys.modules, "torch", _torch(gradcheck))
    own = module(robot, "torch", tmp_path, "placement", "jacobian", frame="d")
    assert own.gradients() == {"placement": True, "jacobian": True}
    # The tolerance is still small compared with the derivatives.
    assert all(atol < 1e-5 * (1.0 + multiplier) ** (1 + (name == "jacobian")) for name, atol in seen)
    monkeypatch.setitem(slopes, "placement", lambda q: 1.0001 * robot.jacobian(q, "d")[..., :3, 0].sum())
    assert not own.gradients()["placement"]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMESPACES)
def test_functions_of_any_array_broadcast_leading_axes_and_keep_the_type(name: str, tmp_path: Path) -> None:
    xp, robot = namespace(name), robot_of("panda")
    own = module(robot, "array", tmp_path)
    q, v, a = state(robot, 6, 1)
    q = q.reshape(2, 3, -1)
    for kind, exact in ((xp.float64, 1e-12), (xp.float32, 1e-4)):
        arrays = [xp.asarray(x.tolist(), dtype=kind) for x in (q, v[0], a[:3])]
        for row, inputs in (("placement", 1), ("jacobian", 1), ("velocity", 2), ("acceleration", 3)):
            found = getattr(own, row)(*arrays[:inputs])
            right = getattr(robot, row)(*(q, v[0], a[:3])[:inputs], robot.tip_frame)
            assert tuple(found.shape) == right.shape
            assert found.dtype == kind
            assert np.abs(np.array(found.tolist() if name != NAMESPACES[1] else found) - right).max() < exact


@pytest.mark.slow
def test_gradients_through_any_array_are_the_hessian_within_its_bound(tmp_path: Path) -> None:
    namespace("jax.numpy")
    jax: Any = pytest.importorskip("jax")
    robot = robot_of("panda")
    own = module(robot, "array", tmp_path, "jacobian")
    q, _, _ = state(robot, 5, 2)
    call = Call(robot.tree, robot.plan, robot.tip_frame, Reference.LOCAL_WORLD_ALIGNED, None, (q,))
    bound = compute_bound(QUANTITIES["hessian"], call.select(slice(0, 5)))
    within = (EPS * bound.k * bound.scale)[:, 0]
    right = robot.hessian(q, robot.tip_frame)
    for slopes in (jax.jacfwd, jax.jacrev):
        found = np.asarray(jax.vmap(slopes(own.jacobian))(q))
        assert np.all(np.abs(found - right) <= within)


def test_functions_of_pytorch_refuse_an_input_that_is_no_tensor_of_floating_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    try:
        torch: Any = importlib.import_module("torch")
    except ModuleNotFoundError:
        monkeypatch.setitem(sys.modules, "torch", torch := _torch(lambda *_, **__: True))
    velocity = module("planar_two_link", "torch", tmp_path, "velocity").velocity
    right = torch.tensor([0.0, 1.0], dtype=torch.float64)
    assert velocity(right, right).shape == (6,)
    whole = torch.tensor([0, 1], dtype=torch.int64)
    refuses(velocity, [0.0, 1.0], right, TypeError, "needs a tensor: found list")
    refuses(velocity, np.zeros(2), right, TypeError, "needs a tensor: found ndarray")
    refuses(velocity, whole, right, TypeError, "needs a floating type: found .*int64")
    words = r"needs 2 numbers on its last axis: found the shape \(1,\)"
    refuses(velocity, right[:1], right, ValueError, words)


def test_a_module_of_pytorch_can_be_pickled_with_its_attributes(monkeypatch: pytest.MonkeyPatch) -> None:
    torch = _torch(lambda *_, **__: True)
    torch.__spec__ = importlib.machinery.ModuleSpec("torch", None)
    monkeypatch.setitem(sys.modules, "torch", torch)
    own, q = urdfkin.load("planar_two_link").torch("tip"), torch.tensor([0.1, 0.2], dtype=np.float64)
    own.training = False
    for again in (pickle.loads(pickle.dumps(own)), copy.deepcopy(own)):
        assert again.training is False
        assert np.array_equal(again.forward(q), own.forward(q))


@pytest.mark.slow
def test_a_module_of_pytorch_has_the_quantities_and_their_derivatives() -> None:
    torch: Any = pytest.importorskip("torch")
    robot = urdfkin.load("planar_two_link")
    own = robot.torch("tip")
    q, v, a = (torch.tensor(x) for x in state(robot, 5, 2))
    assert isinstance(own, torch.nn.Module)
    assert torch.equal(own(q), own.placement(q))
    assert np.abs(own.jacobian(q).numpy() - robot.jacobian(q.numpy(), "tip")).max() < 1e-15
    right = robot.acceleration(q.numpy(), v.numpy(), a.numpy(), "tip")
    assert np.abs(own.acceleration(q, v, a).numpy() - right).max() < 1e-13
    slopes = torch.func.vmap(torch.func.jacrev(own.jacobian))(q)
    assert np.abs(slopes.numpy() - robot.hessian(q.numpy(), "tip")).max() < 1e-15
    assert own(q.float()).dtype == torch.float32
    assert own.velocity(q.reshape(5, 1, 2), v).shape == (5, 5, 6)
    moving = robot.torch("tip", ["velocity"])
    assert torch.equal(moving(q, v), own.velocity(q, v))


def test_without_pytorch_the_error_names_the_package_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "torch" else found(name))
    words = r"robot\.torch needs PyTorch: found no module torch; pip install torch"
    with pytest.raises(InputError, match=words):
        urdfkin.load("planar_two_link").torch("tip")


@pytest.mark.slow
def test_the_check_of_an_imported_file_of_jax_computes_in_double_precision(tmp_path: Path) -> None:
    jax: Any = pytest.importorskip("jax")
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", False)
    try:
        assert max(module("ur5", "jax", tmp_path, "placement").check().values()) <= 1.0
        assert not jax.config.jax_enable_x64
    finally:
        jax.config.update("jax_enable_x64", before)


@pytest.mark.slow
def test_jax_differentiates_vectorizes_and_compiles_exported_functions(tmp_path: Path) -> None:
    jax: Any = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    robot = robot_of("panda")
    own = module(robot, "jax", tmp_path, "placement", "jacobian", "velocity")
    q, v, _ = state(robot, 5, 2)
    Js = np.asarray(jax.vmap(jax.jit(own.jacobian))(q))
    for differentiated in (jax.jacfwd, jax.jacrev):
        slopes = jax.vmap(differentiated(lambda x: own.placement(x)[:3, 3]))(q)
        assert np.abs(np.asarray(slopes) - Js[:, :3]).max() < 1e-13
    pushed = np.asarray(jax.vmap(lambda x, y: jax.jvp(own.placement, (x,), (y,))[1])(q, v))
    assert np.abs(pushed[:, :3, 3] - np.asarray(jax.vmap(own.velocity)(q, v))[:, :3]).max() < 1e-12


@pytest.mark.slow
def test_derivatives_of_placements_in_casadi_and_sympy_are_the_jacobian(tmp_path: Path) -> None:
    casadi: Any = pytest.importorskip("casadi")
    sympy: Any = pytest.importorskip("sympy")
    robot, q, x, y = urdfkin.load("planar_two_link"), [0.3, -0.7], casadi.SX.sym("q", 2), sympy.symbols("q:2")
    J = robot.jacobian(q, robot.tip_frame)[:3]
    p = module(robot, "casadi", tmp_path, "placement").placement(x)[:3, 3]
    slopes = casadi.Function("J", [x], [casadi.jacobian(p, x)])(q)
    assert np.abs(np.array(slopes) - J).max() < 1e-15
    p = module(robot, "sympy", tmp_path, "placement").placement(y)[:3, 3]
    symbolic = p.jacobian(y).subs(dict(zip(y, q, strict=True)))
    assert np.abs(np.array(symbolic, dtype=float) - J).max() < 1e-15


def test_the_check_refuses_a_file_that_urdfkin_export_did_not_write(tmp_path: Path) -> None:
    other = tmp_path / "other.c"
    other.write_text("int main(void) { return 0; }\n")
    with pytest.raises(InputError, match="this file was not written by `urdfkin export`"):
        check(other)
    mine = file(code(urdfkin.load("planar_two_link")), "numpy", tmp_path)
    broken = mine.with_name("broken.py")
    broken.write_text(mine.read_text("utf-8").replace("def check", "def ("), "utf-8")
    with pytest.raises(InputError, match="the file does not run"):
        check(broken)


@pytest.mark.slow
def test_the_check_accepts_each_suffix_that_selects_a_compiled_language(tmp_path: Path) -> None:
    compiled = {"c", "cpp", "cuda"}
    suffixes = {suffix for suffix, names in _LANGUAGES_OF_SUFFIXES.items() if compiled & {*names}}
    assert suffixes == set(_COMPILE_COMMANDS)
    for suffix in (".h", ".cc", ".cu"):
        path = tmp_path / f"arm{suffix}"
        good("export", "planar_two_link", "--quantity", "placement", "-o", str(path))
        assert check(path).verified


@pytest.mark.parametrize("suffix", [".c", ".C", ".PY"])
def test_the_check_accepts_the_line_ends_of_windows_and_a_suffix_in_capitals(
    suffix: str, tmp_path: Path
) -> None:
    need("c" if suffix.lower() == ".c" else "numpy")
    path = tmp_path / f"arm{suffix}"
    good("export", "planar_two_link", "--quantity", "placement", "-o", str(path))
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert check(path).verified


def test_an_invalid_export_is_refused_with_the_valid_choices() -> None:
    robot = urdfkin.load("planar_two_link")
    asked: tuple[tuple[tuple[Any, ...], type[Exception], str], ...] = (
        (("fortran",), UnknownNameError, "language"),
        (("c", "nowhere"), UnknownNameError, "frame"),
        (("c", None, ["placment"]), UnknownNameError, "quantity"),
        (("c", None, ["screws"]), InputError, "choose among placement, velocity"),
        (("c", None, []), InputError, "no quantity"),
    )
    for words, error, said in asked:
        with pytest.raises(error, match=said):
            robot.export(*words)
    with pytest.raises(UnknownNameError, match=r"unknown form 'hd'.*dh"):
        robot.export("c", form="hd")
    with pytest.raises(InputError, match="the Jacobian has no columns"):
        robot_of("single_link").export("c")
    assert "double" in robot_of("single_link").export("c", quantities=["placement"])


@pytest.mark.slow
@pytest.mark.parametrize("to", ["numpy", "c", "casadi", "matlab"])
@pytest.mark.parametrize("form", ["dh", "screws"])
def test_dh_tables_and_screws_are_exported_in_each_language_and_checked(
    form: str, to: str, tmp_path: Path
) -> None:
    need(to)
    path = tmp_path / f"arm{LANGUAGES[to][1]}"
    path.write_text(urdfkin.load("ur5").export(to, "tool0", form=form), encoding="utf-8")
    found = check(path)
    assert found.passed, found.lines
    assert found.verified
    assert len(found.lines) == len(_THREE) * (2 if to in BOTH else 1)
    head = path.read_text("utf-8")[:3000]
    assert {"dh": "Rz(theta) Tz(d) Tx(a) Rx(alpha)", "screws": "space screws S"}[form] in head


@pytest.mark.slow
@pytest.mark.parametrize("form", ["dh", "screws"])
def test_the_code_of_a_dh_table_or_of_screws_agrees_with_the_robot(form: str, tmp_path: Path) -> None:
    robot = urdfkin.load("panda")
    path = tmp_path / "arm.py"
    path.write_text(robot.export("numpy", "panda_hand", form=form), encoding="utf-8")
    found, q = module_of(path), robot.sample(20)
    own = q[:, :7]  # the fingers are not on the path
    T = robot.relative_placement(q, "panda_hand", robot.base_frame)
    np.testing.assert_allclose(found.placement(own), T, rtol=0.0, atol=1e-14)
    assert robot.base_frame == robot.tree.frame_name(0)
    J = robot.jacobian(q, "panda_hand")[..., :7]
    np.testing.assert_allclose(found.jacobian(own), J, rtol=0.0, atol=1e-14)


NAN = {
    "numpy": ("out[..., 0, 0] = R6_00", 'out[..., 0, 0] = float("nan") * R6_00'),
    "c": ("out[0 * L] = R6_00;", "out[0 * L] = R6_00 * (R(0.0) / R(0.0));"),
}


@pytest.mark.parametrize("to", NAN)
def test_the_check_of_a_file_detects_a_nan_before_correct_results(to: str, tmp_path: Path) -> None:
    text, (right, wrong) = urdfkin.load("ur5").export(to, "tool0", ["placement"]), NAN[to]
    assert right in text
    path = tmp_path / f"arm.{'py' if to == 'numpy' else to}"
    path.write_text(text.replace(right, wrong), encoding="utf-8")
    assert not check(path).passed


@pytest.mark.slow
@pytest.mark.parametrize("to", ["numpy", "c", "casadi", "matlab"])
def test_the_dh_command_and_export_with_the_form_dh_write_the_same_file(to: str) -> None:
    table = command("dh", "ur5", "--tip", "tool0", "--format", to)
    assert table.code == 0
    assert table.out == command("export", "ur5", "--frame", "tool0", "--form", "dh", "--to", to).out


@pytest.mark.slow
def test_an_unverified_export_states_this_in_the_first_line(tmp_path: Path) -> None:
    robot = urdfkin.load("planar_two_link")
    for to in LANGUAGES:
        first = robot.export(to, verify=False).splitlines()[0]
        assert "UNVERIFIED" in first
        assert "UNVERIFIED" not in write(code(robot), to)
    found = check(file(code(urdfkin.load("planar_two_link", verify=False)), "numpy", tmp_path))
    assert found.passed
    assert not found.verified


def test_an_export_adds_no_line_to_the_robots_certificate() -> None:
    robot = urdfkin.load("planar_two_link")
    robot.export("numpy")
    assert not robot.certificate().lines


def test_a_latex_document_escapes_the_whole_name_of_a_joint_with_a_colon() -> None:
    arm = urdfs.built(joint("axis 1: j_1", "revolute", "a", "b", axis="0 1 0", more=limit()))
    text = arm.export("latex", quantities=["placement"])
    assert "\naxis 1: j\\_1 is revolute" in text


_PARENT = joint("j", "revolute", "a", "b", axis="0 1 0", more=limit())


@pytest.mark.parametrize(
    ("joints", "tip"),
    [
        ([joint("tip", "revolute", "a", "tip", 'xyz="1 2 3"', more=limit())], "tip"),
        ([joint("tip", "revolute", "a", "tip_link", 'xyz="1 2 3"', more=limit())], "tip_link"),
        ([joint("tip_fixed", "revolute", "a", "tip", 'xyz="1 2 3"', more=limit())], "tip"),
        ([_PARENT], "a"),
        (
            [_PARENT, joint("k", "prismatic", "a", "tip", more=mimic("j", 0.5) + limit())],
            "tip",
        ),
    ],
    ids=["joint and tip", "link of a joint", "fixed joint", "base", "mimicked joint outside the path"],
)
def test_screws_with_equal_names_or_a_mimicked_joint_elsewhere_are_a_robot_and_are_exported(
    joints: list[str], tip: str
) -> None:
    robot = urdfs.built(*joints)
    screws, scope = robot.screws(tip), dict[str, Any]()
    exec(robot.export("numpy", tip, ["placement"], form="screws"), scope)
    again = urdfs.loaded(screws)
    q = robot.sample(5, seed=1)
    own = screws.coupling.select(robot.tree, q)
    T = robot.placement(q, tip)
    frame = LinkFrame.of(again.link_names[-1])
    whole = np.zeros((5, again.nq))
    whole[:, [again.coordinate_names.index(name) for name in screws.coupling.names]] = own
    np.testing.assert_allclose(again.placement(whole, frame), T, atol=1e-15)
    np.testing.assert_allclose(scope["placement"](whole), T, atol=1e-15)
