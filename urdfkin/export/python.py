"""Write Python code for NumPy, any array API namespace, Numba, JAX, PyTorch, CasADi or SymPy.

The expressions are the same for all libraries, except for `sympy-exact`, which has exact constants. A
`Dialect` describes the code around the expressions for one library.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from urdfkin.compiled.plan import CompiledTree, JointMotion, StepField
from urdfkin.errors import InputError
from urdfkin.export.code import FrameCode, Writer
from urdfkin.export.expression import Node, Number
from urdfkin.export.function import Function
from urdfkin.verify.bounds import sum_multipliers


@dataclass(frozen=True)
class Dialect:
    """The code for one Python library.

    Attributes:
        result: Generator of the code lines that return the results.
        imports: Import lines. The names of the used functions replace `{}`, for example `cos, sin`.
        values_body: Body of the exported function `_values`, which evaluates several configurations.
        input_format: Pattern of the code for one number of an input, such as `q[0]`.
        check_parameter: Parameter of the exported `check`.
    """

    about: str
    imports: str
    result: Callable[[Writer], Iterator[str]]
    values_body: str
    decorator: str = ""
    first_lines: Callable[[Writer], list[str]] = lambda writer: []
    helpers: str = ""
    input_format: str = "{}[{}]"
    check_parameter: str = ""
    has_single_precision: bool = False
    more_code: Callable[[FrameCode], str] = lambda code: ""
    more_checks: str = ""
    exact: bool = False


def _rows(values: Sequence[str], width: int) -> list[Sequence[str]]:
    return [values[i : i + width] for i in range(0, len(values), width)] if width else []


def _make_array_result(create: str, index: str) -> Callable[[Writer], Iterator[str]]:
    def result(writer: Writer) -> Iterator[str]:
        shape = writer.function.shape
        yield f"out = {create.format(shape, ', '.join(map(str, shape)))}"
        for indices, value in zip(np.ndindex(shape), writer.results(), strict=True):
            yield f"out[{index}{', '.join(map(str, indices))}] = {value}"
        yield "return out"

    return result


def _make_nested_result(opening: str, closing: str, row: str = "[{}]") -> Callable[[Writer], Iterator[str]]:
    """Return a `result` function; a Hessian becomes a matrix (6 nv, nv)."""

    def result(writer: Writer) -> Iterator[str]:
        values, shape = writer.results(), writer.function.shape
        yield f"return {opening}"
        if len(shape) == 1:
            yield from (f"    {value}," for value in values)
        for line in _rows(values, shape[-1]) if len(shape) > 1 else ():
            first, last = row.split("{}")
            yield f"    {first}"
            yield from (f"        {value}," for value in line)
            yield f"    {last},"
        yield closing

    return result


def _numpy_first_lines(writer: Writer) -> list[str]:
    inputs = writer.function.inputs
    shapes = ", ".join(f"{x}.shape[:-1]" for x in inputs)
    return [
        *(f"{x} = np.asanyarray({x})" for x in inputs),
        *_input_check_lines(writer),
        *(f"{x} = np.asarray({x}, dtype=np.float64)" for x in inputs),
        f"shape = np.broadcast_shapes({shapes})",
    ]


# -- array API ---------------------------------------------------------------------------------------------


def _zero_line(writer: Writer, xp: str) -> str:
    """Make code that creates zeros of the inputs' batch shape, type and device."""
    widths = writer.code.widths(writer.function)
    columns = (f"{x}[..., 0]" if width else f"{xp}.sum({x}, axis=-1)" for x, width in widths.items())
    return "zero = " + " + ".join(f"{xp}.zeros_like({column})" for column in columns)


def _input_check_lines(writer: Writer, namespace: str = "") -> list[str]:
    return [
        f'_demand({namespace}"{x}", {x}, {width})' for x, width in writer.code.widths(writer.function).items()
    ]


def _make_length_check(text: str) -> Callable[[Writer], list[str]]:
    def first_lines(writer: Writer) -> list[str]:
        lines = list[str]()
        for x, width in writer.code.widths(writer.function).items():
            lines += [f"if len({x}) != {width}:", f"    raise ValueError({text.format(x=x, width=width)})"]
        return lines

    return first_lines


def _array_first_lines(writer: Writer) -> list[str]:
    used = [name for name in _MATH_FUNCTIONS if any(node.op == name for node in writer.function.nodes)]
    names = [f"{', '.join(used)} = {', '.join(f'xp.{name}' for name in used)}"] if used else []
    return ["xp = _namespace(q)", *_input_check_lines(writer, "xp, "), *names, _zero_line(writer, "xp")]


def _make_stacked_result(xp: str) -> Callable[[Writer], Iterator[str]]:
    """Return a `result` function; the code fills no array, because JAX's arrays are immutable."""

    def result(writer: Writer) -> Iterator[str]:
        function = writer.function
        yield f"return _stacked({xp}["
        for x, text in zip(function.results, writer.results(), strict=True):
            yield f"    {text if isinstance(x, Node) else f'zero + {text}' if x else 'zero'},"
        yield f"], zero, {function.shape})"

    return result


_NAMESPACE = '''
def _namespace(x):
    """Return the array API namespace of an array; for PyTorch that of array-api-compat."""
    if hasattr(x, "__array_namespace__"):
        return x.__array_namespace__()
    try:
        from array_api_compat import array_namespace

        return array_namespace(x)
    except (ImportError, TypeError):
        found = f"{type(x).__module__}.{type(x).__qualname__}"
        raise TypeError(
            f"q needs an array of an array API namespace: found {found}. PyTorch's tensors need the package"
            " array-api-compat."
        ) from None
'''

_INPUT_CHECK = '''
def _demand({given}name, x, width):
    """Raise an error if an input is not {array} (..., width) of {numbers}."""
{is_array}    if {wrong}:
        raise TypeError(f"{{name}} needs {numbers}: found {{x.dtype}}")
    if x.ndim == 0 or x.shape[-1] != width:
        found = tuple(x.shape)
        raise ValueError(f"{{name}} needs {{width}} numbers on its last axis: found the shape {{found}}")
'''
_IS_ARRAY = """    if not ({is_array}):
        raise TypeError(f"{{name}} needs {array}: found {{type(x).__name__}}")
"""


def _make_input_check(
    wrong_type: str,
    parameters: str = "",
    numbers: str = "a floating type",
    array: str = "an array",
    is_array: str = "",
) -> str:
    """Return code of the function `_demand`, which checks an input `x`.

    `wrong_type` and `is_array` are Python conditions on `x`. An empty `is_array` omits the test for an array.
    """
    first = _IS_ARRAY.format(is_array=is_array, array=array) if is_array else ""
    return _INPUT_CHECK.format(
        given=parameters, array=array, numbers=numbers, is_array=first, wrong=wrong_type
    )


_STACKED = '''
def _stacked({given}values, zero, shape):
    """Return an array (..., *shape) of the numbers `values`. The batch shape is the shape of `zero`."""
    batch = tuple(zero.shape)
    values = [{xp}.broadcast_to(x, batch) for x in values]
    return {xp}.reshape({xp}.stack(values, {axis}=-1), batch + shape)
'''


_TORCH_MODULE = '''
class Kinematics(torch.nn.Module):
    """The functions of this file; `forward` is `{first}`. Results have the inputs' type and device."""

{functions}

    def forward(self, {inputs}):
        """Return {first}({inputs})."""
        return {first}({inputs})


def gradients(device="cpu"):
    """Return, for each function, whether `torch.autograd.gradcheck` accepts its derivatives in float64.

    A difference quotient has two errors. The first error is the rounding error of two values, divided by
    twice the step. The second error is the truncation error: a sixth of the squared step times the third
    derivative. If a coordinate changes by 1 rad, a vector rotates by at most r rad. A product of F vectors
    (F <= 4) has a third derivative of at most (F r)^3 times its size, and an error bound of at least 24 F eps
    times its size. The tolerance is not a bound for a coordinate that moves a prismatic and a revolute joint.
    """
    accepted, step = {{}}, 1e-6 / {rate!r}  # r
    for function in ({all}):
        name = function.__name__
        kind = {{"dtype": torch.float64, "device": device, "requires_grad": True}}
        inputs = [torch.tensor(GIVEN[letter][:1], **kind) for letter in INPUTS[name]]
        most = max(WITHIN[name][0]) * (2.0**-52 / step + step**2 * {rate!r} ** 3 / 9.0)
        within = {{"eps": step, "atol": most, "rtol": 0.0}}
        accepted[name] = torch.autograd.gradcheck(function, inputs, raise_exception=False, **within)
    return accepted


'''


def _torch_module_code(code: FrameCode) -> str:
    # The method `forward` calls the exported function with the fewest of the inputs q, v and a.
    first = min(code.functions, key=lambda function: len(function.inputs))
    return _TORCH_MODULE.format(
        first=first.name,
        inputs=", ".join(first.inputs),
        functions="\n".join(f"    {f.name} = staticmethod({f.name})" for f in code.functions),
        all=_function_list(code),
        rate=_rotation_rate_bound(code.functions[0].plan),
    ).lstrip("\n")


def _rotation_rate_bound(plan: CompiledTree) -> float:
    """Bound the angle (rad) by which a vector rotates if one coordinate changes by 1 rad.

    For each coordinate, s is the sum of |multiplier| over the revolute joints that follow the coordinate
    (mimic rules). The bound is the maximum of 1 and the largest s. With a floating joint, the bound is at
    least 3.

    Derivation of 3: If one component of a unit quaternion changes by t, the body rotates about a fixed axis.
    In four dimensions, x is the angle between the quaternion and the component's coordinate axis. At t = 0,
    the rotation angle has the first three derivatives 2 sin x, -2 sin 2x and 4 sin 3x. The third derivative
    of a product of F rotated unit vectors is at most:

    `(2 F)^3 + 3 (2 F)(2 F) + 4 F <= (3 F)^3`
    """
    floats = bool((plan.steps[:, StepField.KIND] == JointMotion.FLOATING).any())
    return max(3.0 if floats else 1.0, float(sum_multipliers(plan)[0].max(initial=0.0)))


def _function_list(code: FrameCode) -> str:
    return ", ".join(f.name for f in code.functions) + ("," if len(code.functions) == 1 else "")


_VECTOR_CHECK = '''
def _demand(name, x, width):
    """Raise an error if an input is not a vector of `width` numbers."""
    found = tuple(x.shape) if hasattr(x, "shape") else (len(x),)
    if found not in ((width,), (width, 1), (1, width)):
        raise ValueError(f"{name} needs {width} numbers: found the shape {found}")
'''
_LENGTH_MESSAGE = 'f"{x} needs {width} numbers: found {{len({x})}}"'
_MATH_FUNCTIONS = ("cos", "sin", "sqrt")
_EVALUATE_EACH = "return [{} for one in zip(*inputs)]"

DIALECTS = {
    "numpy": Dialect(
        about="Arguments are arrays q (..., {nq}), v and a (..., {nv}). Batch axes broadcast.",
        imports="import numpy as np\nfrom numpy import {}",
        helpers=_make_input_check(
            'x.dtype.kind not in "biuf"',
            numbers="real numbers",
            is_array="not np.ma.is_masked(x)",
        ),
        first_lines=_numpy_first_lines,
        input_format="{}[..., {}]",
        result=_make_array_result("np.empty((*shape, {1}))", "..., "),
        values_body="return np.reshape(function(*map(np.array, inputs)), (len(inputs[0]), -1)).tolist()",
    ),
    "array": Dialect(
        about="Arguments are arrays q (..., {nq}), v and a (..., {nv}) of any array API namespace, type and\n"
        "device. Batch axes are broadcast. PyTorch's tensors need the package array-api-compat. No array\n"
        "is changed in place. check(xp) runs the test vectors in a namespace, for example check(jax.numpy).",
        imports="import numpy",
        helpers=_NAMESPACE
        + "\n"
        + _make_input_check(
            'not xp.isdtype(x.dtype, "real floating")',
            "xp, ",
            is_array='hasattr(x, "ndim") and not hasattr(x, "mask")',
        )
        + "\n"
        + _STACKED.format(given="xp, ", xp="xp", axis="axis"),
        first_lines=_array_first_lines,
        input_format="{}[..., {}]",
        result=_make_stacked_result("xp, "),
        values_body="arrays = [xp.asarray(x, dtype=getattr(xp, kind)) for x in inputs]\n"
        "    if arrays[0].dtype != getattr(xp, kind):\n"
        '        raise TypeError(f"the namespace makes {arrays[0].dtype} of {kind}; in JAX, first call "\n'
        "                        \"jax.config.update('jax_enable_x64', True)\")\n"
        "    found = function(*arrays)\n"
        "    found = xp.reshape(found, (len(inputs[0]), -1))\n"
        "    return [[float(found[i, k]) for k in range(found.shape[1])] for i in range(found.shape[0])]",
        check_parameter="xp=numpy",
        has_single_precision=True,
    ),
    "numba": Dialect(
        about="Arguments are float64 arrays of one configuration: q ({nq},), v and a ({nv},).\n"
        "The first call of a function compiles the function.",
        imports="from math import {}\n\nimport numpy as np\nfrom numba import njit",
        decorator='@njit(error_model="numpy")',
        first_lines=_make_length_check(
            '"{x} needs {width} numbers"'
        ),  # Numba supports only constant messages.
        result=_make_array_result("np.empty({0})", ""),
        values_body=_EVALUATE_EACH.format("function(*map(np.array, one)).ravel().tolist()"),
    ),
    "jax": Dialect(
        about="Arguments are arrays q (..., {nq}), v and a (..., {nv}) of any precision.\n"
        "Batch axes broadcast. The functions support jit, vmap and grad.\n"
        "For long chains, XLA's fusion pass takes minutes. The following code disables the fusion pass:\n"
        'jax.jit(function, compiler_options={{"xla_disable_hlo_passes": "fusion"}})',
        imports="import jax\nimport jax.numpy as jnp\nfrom jax.numpy import {}",
        helpers=_make_input_check("not jnp.issubdtype(x.dtype, jnp.floating)")
        + "\n"
        + _STACKED.format(given="", xp="jnp", axis="axis"),
        first_lines=lambda writer: [
            *(f"{x} = jnp.asarray({x})" for x in writer.function.inputs),
            *_input_check_lines(writer),
            _zero_line(writer, "jnp"),
        ],
        input_format="{}[..., {}]",
        result=_make_stacked_result(""),
        values_body='unfused, wide = {"xla_disable_hlo_passes": "fusion"}, jax.config.jax_enable_x64\n'
        '    jax.config.update("jax_enable_x64", True)  # otherwise JAX computes float64 in float32\n'
        "    try:\n"
        "        compiled = jax.jit(function, compiler_options=unfused)\n"
        "        found = compiled(*(jnp.array(x, dtype=kind) for x in inputs))\n"
        "        return found.reshape(len(inputs[0]), -1).tolist()\n"
        "    finally:\n"
        '        jax.config.update("jax_enable_x64", wide)',
        has_single_precision=True,
    ),
    "torch": Dialect(
        about="Arguments are tensors q (..., {nq}), v and a (..., {nv}) of any floating type and device.\n"
        "Batch axes broadcast. The functions support autograd, torch.func, vmap and compile.\n"
        "Kinematics() is a torch.nn.Module with these functions.",
        imports="import torch\nfrom torch import {}",
        helpers=_make_input_check(
            "not x.is_floating_point()", array="a tensor", is_array="isinstance(x, torch.Tensor)"
        )
        + "\n"
        + _STACKED.format(given="", xp="torch", axis="dim"),
        first_lines=lambda writer: [*_input_check_lines(writer), _zero_line(writer, "torch")],
        input_format="{}[..., {}]",
        result=_make_stacked_result(""),
        values_body="tensors = [torch.tensor(x, dtype=getattr(torch, kind), device=device) for x in inputs]\n"
        "    return function(*tensors).reshape(len(inputs[0]), -1).tolist()",
        check_parameter='device="cpu"',
        has_single_precision=True,
        more_code=_torch_module_code,
        more_checks="    for name, good in gradients().items():\n"
        "        wrong |= not good\n"
        '        print("good" if good else "WRONG", f"{name}: derivatives by gradcheck (float64)")\n',
    ),
    "casadi": Dialect(
        about="Arguments are columns SX, MX or DM: q ({nq}), v and a ({nv}).\n"
        "A Hessian has {nv} times 6 rows.",
        imports="import casadi\nfrom casadi import {}",
        helpers=_VECTOR_CHECK,
        first_lines=_input_check_lines,
        result=_make_nested_result("casadi.vertcat(", ")", "casadi.horzcat({})"),
        values_body=_EVALUATE_EACH.format(
            "[float(x) for row in casadi.DM(function(*map(casadi.DM, one))).full().tolist() for x in row]"
        ),
    ),
    "sympy": Dialect(
        about="Arguments are lists of symbols or numbers: q ({nq}), v and a ({nv}).\n"
        "Each result is a Matrix. A Hessian has {nv} times 6 rows and {nv} columns.",
        imports="import sympy\nfrom sympy import {}",
        first_lines=_make_length_check(_LENGTH_MESSAGE),
        result=_make_nested_result("sympy.Matrix([", "])"),
        values_body=_EVALUATE_EACH.format("[float(x) for x in function(*one)]"),
    ),
    "sympy-exact": Dialect(
        about="Arguments are lists of symbols or numbers: q ({nq}), v and a ({nv}).\n"
        "Each result is a Matrix of exact numbers. A Hessian has {nv} times 6 rows and {nv} columns.\n"
        "For example: placement(sympy.symbols('q:{nq}'))",
        imports="import types\n\nimport mpmath\nfrom sympy import Matrix, Rational, pi\nfrom sympy import {}",
        first_lines=_make_length_check(_LENGTH_MESSAGE),
        result=_make_nested_result("Matrix([", "])"),
        # SymPy simplifies large expressions slowly, so the check runs the same code with mpmath's numbers.
        values_body='numbers = {name: getattr(mpmath, name) for name in ("cos", "sin", "sqrt", "pi")}\n'
        '    numbers |= {"Rational": lambda x, y: mpmath.mpf(x) / y, "Matrix": mpmath.matrix}\n'
        "    with mpmath.workdps(60):\n"
        "        same = types.FunctionType(function.__code__, numbers)\n"
        "        return [[float(x) for x in same(*([mpmath.mpf(x) for x in y] for y in one))]"
        " for one in zip(*inputs)]",
        exact=True,
    ),
}


def write(code: FrameCode, to: str) -> str:
    """Return a Python module with functions and a check."""
    dialect = DIALECTS[to]
    about = dialect.about.format(nq=code.nq, nv=code.nv)
    lines = [
        '"""' + code.header[0],
        *code.header[1:],
        "",
        about,
        f"To try it: python {code.name}_{to.replace('-', '_')}.py",
        '"""',
        "",
    ]
    lines += [_imports(code, dialect), "", *([dialect.helpers] if dialect.helpers else [])]
    for function in code.functions:
        lines += ["", *_function(code, function, dialect), ""]
    return "\n".join([*lines, *_self_test_lines(code, dialect), ""])


def _imports(code: FrameCode, dialect: Dialect) -> str:
    nodes = [node.op for function in code.functions for node in function.nodes]
    used = ", ".join(name for name in _MATH_FUNCTIONS if name in nodes)
    lines = [line for line in dialect.imports.split("\n") if used or "{}" not in line]
    return "\n".join(lines).strip().format(used)


def _function(code: FrameCode, function: Function, dialect: Dialect) -> Iterator[str]:
    literal: Callable[[Number], str] = repr
    if dialect.exact:
        from urdfkin.export.exact import format_exact_literal

        literal = format_exact_literal
    writer = Writer(code, function, literal)
    if dialect.decorator:
        yield dialect.decorator
    yield f"def {function.name}({', '.join(function.inputs)}):"
    size = ", ".join(map(str, function.shape)) + ("," if len(function.shape) == 1 else "")
    numbers = ", ".join(function.quantity.equations)
    yield f'    """({size}), eq. {numbers}; {function.operation_count} operations."""'
    yield from (f"    {line}" for line in dialect.first_lines(writer))
    for node in writer.inputs:
        yield f"    {writer.names[node]} = {dialect.input_format.format(node.op, node.operands[0])}"
    for head, lines in writer.statements():
        yield f"    # {head}"
        yield from (f"    {name} = {value}" for name, value in lines)
    yield from (f"    {line}" for line in dialect.result(writer))


_CHECK_TEMPLATE = '''
{classes}def _values(function, inputs, kind{more}):
    {values}


def check({given}):
    """Return the largest error of each function as a share of its tolerance: at most 1."""
    shares = {{}}
    for kind, eps, tolerance in {kinds}:
        for function in ({functions}):
            name, worst = function.__name__, 0.0
            inputs = [GIVEN[letter] for letter in INPUTS[name]]
            numbers = _values(function, inputs, kind{more})
            for found, true, within in zip(numbers, TRUE[name], tolerance[name], strict=True):
                for x, y, k in zip(found, true, within, strict=True):
                    error, least = abs(x - float(y)), k * eps
                    share = error / least if least else (0.0 if error == 0.0 else float("inf"))
                    if share != share:  # NaN counts as larger than any number
                        share = float("inf")
                    worst = max(worst, share)
            shares[name, kind] = worst
    return shares


if __name__ == "__main__":
    wrong = False
    for (name, kind), worst in check().items():
        good = worst <= 1.0
        wrong |= not good
        line = f"{{name}}: {{len(TRUE[name])}} test vectors, worst error {{worst:.3g}} of the bound{told}"
        print("good" if good else "WRONG", line)
{after}    raise SystemExit(wrong)
'''


_DOUBLE_TOLERANCES = '[("float64", 2.0**-52, WITHIN)]'
_BOTH_TOLERANCES = '[("float64", 2.0**-52, WITHIN), ("float32", 2.0**-23, SINGLE)]'


def _self_test_lines(code: FrameCode, dialect: Dialect) -> Iterator[str]:
    yield "\n# Test vectors: inputs, true values at fifty digits, and tolerances in eps = 2^-52."
    if dialect.has_single_precision:
        yield "# SINGLE contains tolerances in single precision, in eps = 2^-23."
    vectors = code.proof.vectors
    yield "INPUTS = {" + ", ".join(f'"{f.name}": "{f.inputs}"' for f in code.functions) + "}"
    yield "GIVEN = {"
    for k, letter in enumerate(code.inputs):
        yield f'    "{letter}": ['
        yield from (f"        {v.inputs[k]!r}," for v in vectors)
        yield "    ],"
    yield "}"
    tables = [
        ("TRUE", "results", '"{}"'),
        ("WITHIN", "tolerances", "{}"),
        ("SINGLE", "single_tolerances", "{}"),
    ]
    for constant, attribute, form in tables if dialect.has_single_precision else tables[:2]:
        yield f"{constant} = {{"
        for function in code.functions:
            yield f'    "{function.name}": ['
            for vector in vectors:
                yield "        ["
                values = [form.format(x) for x in getattr(vector, attribute)[function.name]]
                for row in _rows(values, 2 if constant == "TRUE" else 4):
                    yield f"            {', '.join(row)},"
                yield "        ],"
            yield "    ],"
        yield "}"
    yield _CHECK_TEMPLATE.format(
        values=dialect.values_body,
        kinds=_BOTH_TOLERANCES if dialect.has_single_precision else _DOUBLE_TOLERANCES,
        told=" ({kind})" if dialect.has_single_precision else "",
        given=dialect.check_parameter,
        more=f", {dialect.check_parameter.partition('=')[0]}" if dialect.check_parameter else "",
        functions=_function_list(code),
        classes=dialect.more_code(code),
        after=dialect.more_checks,
    ).rstrip()


def load_torch_module(text: str) -> Any:
    require_torch()
    scope: dict[str, Any] = {"__name__": "urdfkin_torch"}
    exec(compile(text, "<urdfkin export --to torch>", "exec"), scope)
    kinematics = scope["Kinematics"]

    def reduce(module: Any, protocol: Any) -> Any:
        if type(module) is kinematics:  # pickle cannot import this class
            return load_torch_module, (text,), module.__dict__
        return super(kinematics, module).__reduce_ex__(protocol)

    kinematics.__reduce_ex__ = reduce
    return kinematics()


def require_torch() -> None:
    if importlib.util.find_spec("torch") is None:
        raise InputError("robot.torch needs PyTorch", found="no module torch", remedy="pip install torch")
