"""Generate code for one robot, frame and quantity; its speed is an upper limit for a general kernel.

The textbook's equations run once on CasADi's symbols. The resulting expressions contain the robot's
constants, without products with 0 and 1. CasADi writes these expressions as straight-line C code, which the
system's compiler compiles. Each number of the C code is a vector register of doubles, with one double for
each of several configurations (`generated.c`). The time includes sine, cosine and the transposition of the
arrays, which are the same for all contenders. The code does not check its inputs, so a non-finite number or
an angle of a million turns gives a wrong result. The generated code also lacks urdfkin's correction of the
last digit of sine and cosine.
"""

from __future__ import annotations

import ctypes
import re
import subprocess
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scripts.benchmarking.subject import Subject
from scripts.benchmarking.timing import Work
from urdfkin.compiled import python_numbers
from urdfkin.compiled.plan import CompiledTree, Motion, Step
from urdfkin.kinematics import equations
from urdfkin.model.tree import FloatArray

GENERATED = "generated for this robot, 1 thread"
COMPILER = "cc"
_REMARK = "C written by CasADi for one robot, one frame, one quantity; it does not look at its inputs"
_FRAME = Path(__file__).with_suffix(".c")
_FLAGS = ("-std=gnu11", "-O3", "-march=native", "-shared", "-fPIC")

# -- the equations along one path ------------------------------------------------------------------------


def columns(
    plan: CompiledTree, x: Any, sines: Any, cosines: Any, eq: Any = equations
) -> Iterator[tuple[Any, Any]]:
    """Compute 7.85 in the world's axes: (linear, angular) columns of each joint of the path.

    Args:
        plan: The compiled tree of one frame.
        x: The coordinate of each joint, which may be any kind of number, such as a float or a symbol.
        sines: The sine of each coordinate.
        cosines: The cosine of each coordinate.
        eq: The textbook's equations, implemented for the same kind of number.
    """
    R, p, passed = np.eye(3).tolist(), [0.0] * 3, []
    for i, motion in enumerate(_motions(plan)):
        S, d = _pose(plan.geometry[i])
        p = eq.point_position(p, R, d)
        R = eq.product(R, S)
        z = eq.rotate(R, _Z)
        passed.append((motion, z, p))
        if motion is Motion.TURN:
            R = eq.product(R, eq.about_z(sines[i], cosines[i], 0.0, 1.0))
        else:
            p = eq.plus(p, eq.times(x[i], z))
    end = eq.point_position(p, R, _pose(plan.offsets[0])[1])
    for motion, z, p in passed:
        yield eq.turning_column(z, eq.minus(end, p)) if motion is Motion.TURN else (z, [0.0] * 3)


def acceleration(
    plan: CompiledTree, x: Any, sines: Any, cosines: Any, v: Any, a: Any, eq: Any = equations
) -> tuple[Any, Any]:
    """Compute 7.127 to 7.130 in each link's axes, like urdfkin; return (linear, angular) in world axes."""
    R, w, alpha, acc = np.eye(3).tolist(), [0.0] * 3, [0.0] * 3, [0.0] * 3

    def turned(S: Any) -> tuple[Any, ...]:
        back = eq.transposed(S)
        return eq.product(R, S), *(eq.rotate(back, vector) for vector in (w, alpha, acc))

    for i, motion in enumerate(_motions(plan)):
        S, d = _pose(plan.geometry[i])
        acc = eq.point_acceleration(acc, alpha, w, d)
        R, w, alpha, acc = turned(S)
        if motion is Motion.TURN:
            alpha = eq.angular_acceleration(alpha, w, _Z, v[i], a[i])
            w = eq.angular_velocity(w, _Z, v[i])
            R, w, alpha, acc = turned(eq.about_z(sines[i], cosines[i], 0.0, 1.0))
        else:
            acc = eq.point_acceleration(acc, alpha, w, eq.times(x[i], _Z))
            acc = eq.sliding_acceleration(acc, w, _Z, v[i], a[i])
    acc = eq.point_acceleration(acc, alpha, w, _pose(plan.offsets[0])[1])
    return eq.rotate(R, acc), eq.rotate(R, alpha)


_Z = [0.0, 0.0, 1.0]


def _motions(plan: CompiledTree) -> list[Motion]:
    found = [Motion(kind) for kind in plan.steps[:, Step.KIND].tolist()]
    if set(found) - {Motion.TURN, Motion.SLIDE}:
        raise ValueError("a joint with more than one coordinate")
    return found


def _pose(row: FloatArray) -> tuple[list[list[float]], list[float]]:
    """Return the constant rotation R and translation p in a row of a compiled tree."""
    return row[:9].reshape(3, 3).tolist(), row[9:12].tolist()


# -- as C ------------------------------------------------------------------------------------------------


def batches(subject: Subject, quantity: str) -> Iterator[Work]:
    """Yield the timed task in which generated C code computes a whole batch in one call."""
    compute = compiled(subject, quantity)
    inputs = subject.inputs(quantity, subject.n)
    out = np.empty((subject.n, *subject.width(quantity)))
    addresses = [x.ctypes.data for x in (*inputs, *inputs, *inputs)[:3]]  # a Jacobian does not need v and a

    def run() -> None:
        compute(subject.n, *addresses, out.ctypes.data)

    yield Work(GENERATED, subject.n, run, lambda: out, remark=_REMARK)


def compiled(subject: Subject, quantity: str) -> Callable[..., None]:
    """Return a function of the number of configurations and the addresses of q, v, a and the results.

    Raises:
        subprocess.CalledProcessError: the compiler rejects the code.
    """
    plan, folder = subject.plan, subject.folder
    sizes = {"NQ": plan.nq, "NV": plan.nv, "STEPS": len(plan.steps), "RESULTS": subject.numbers(quantity)}
    sizes["MOVING"] = int(quantity == "acceleration")
    tables = {
        "Q_AT": plan.steps[:, Step.Q],
        "V_AT": plan.steps[:, Step.V],
        "TURNS": plan.steps[:, Step.KIND] == Motion.TURN,
    }
    lines = [f"#define {name} {size}" for name, size in sizes.items()]
    lines += [
        f"static const int {name}[] = {{{_listed(column.astype(int).tolist())}}};"
        for name, column in tables.items()
    ]
    lines += [f"#define {name} {_listed(getattr(python_numbers, name))}" for name in ("SINE", "COSINE")]
    lines += [f"#define PI_2_REST {python_numbers.PI_2_REST}", _straight_line(plan, quantity)]
    (folder / f"{quantity}.h").write_text("\n".join(lines), "utf-8")
    library = folder / f"{quantity}.so"
    here = [f"-I{folder}", f'-DROBOT="{quantity}.h"', str(_FRAME), "-o", str(library)]
    subprocess.run([COMPILER, *_FLAGS, *here], check=True)
    function = ctypes.CDLL(str(library)).compute
    function.argtypes, function.restype = [ctypes.c_long, *4 * [ctypes.c_void_p]], None
    return function


def _listed(numbers: Sequence[float]) -> str:
    return ", ".join(map(repr, numbers))


def _straight_line(plan: CompiledTree, quantity: str) -> str:
    """Return CasADi's C code of a function for one configuration.

    The arguments of the function are (x, sines, cosines, v, a).
    """
    import casadi  # noqa: PLC0415  installed or not

    names = [casadi.SX.sym(name, len(plan.steps)) for name in ("x", "sine", "cosine", "v", "a")]
    x, sines, cosines, v, a = map(casadi.vertsplit, names)
    if quantity == "jacobian":
        J = [[0.0] * plan.nv for _ in range(6)]
        for k, column in zip(plan.steps[:, Step.V], columns(plan, x, sines, cosines), strict=True):
            for row, number in zip(J, (*column[0], *column[1]), strict=True):
                row[k] = number
        results = [number for row in J for number in row]
    else:
        linear, angular = acceleration(plan, x, sines, cosines, v, a)
        results = [*linear, *angular]
    function = casadi.Function("numbers", names, [casadi.vertcat(*results)], {"cse": True})
    generator = casadi.CodeGenerator("generated")
    generator.add(function)
    whole = re.search(r"static int casadi_f0\(.*?\n}", generator.dump(), re.DOTALL)
    if whole is None:
        raise ValueError("CasADi wrote no function")
    # CasADi's code computes with single doubles, and tests whether an argument is missing.
    # The next lines replace the doubles by vectors, and remove the tests.
    text = re.sub(r"(arg\[\d+\])\? (\1\[\d+\]) : 0", r"\2", whole[0])
    text = text.replace("if (res[0]!=0) ", "")
    return re.sub(r"(a\d+)=(-?[\d.][\d.e+-]*);", r"\1=in_all_lanes(\2);", text)
