"""Generate C code for one robot, one frame and one quantity.

The benchmark compares the speed of this code with the speed of urdfkin's kernels, which work for all robots.
CasADi writes the textbook's equations as C code without loops and branches. The code contains the robot's
constants, and omits products with 0 and 1. SIMD vectors of doubles compute several configurations together;
`generated.c` contains the loop over the configurations. The measured time includes sine, cosine and the
transposition of the arrays.

The generated code does not check inputs. Infinite inputs, nan, and angles of 10^15 turns or more cause wrong
results. On processors without fused multiply-adds, a million turns cause errors of 1e-9 in sine and cosine.
Unlike urdfkin, the generated code does not correct the last digit of sine and cosine.
"""

import ctypes
import re
import subprocess
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scripts.benchmarking.timing import TimedTask
from scripts.benchmarking.workload import Workload
from urdfkin.compiled import python_numbers
from urdfkin.compiled.plan import CompiledTree, JointMotion, StepField
from urdfkin.kinematics import equations
from urdfkin.model.recursion import Column, LinkState, Recursion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray

GENERATED = "generated for this robot, 1 thread"
COMPILER = "cc"
_REMARK = (
    "C code that CasADi writes for one robot, one frame and one quantity; the code does not check its inputs"
)
_FRAME = Path(__file__).with_suffix(".c")
_FLAGS = ("-std=gnu11", "-O3", "-march=native", "-shared", "-fPIC")


_Z = (0.0, 0.0, 1.0)


def frame_results(
    plan: CompiledTree, quantity: str, x: Any, sines: Any, cosines: Any, v: Any, a: Any, eq: Any = equations
) -> list[Any]:
    """Return a frame's results in world axes (7.85 and 7.127 to 7.130).

    Each joint must have one coordinate. `eq` has the functions of `equations` for the type of the arguments.
    """
    recursion, state, columns = Recursion(eq, own_axes=quantity == "acceleration"), LinkState(), []
    for i, (kind, _, velocity_index) in enumerate(plan.steps.tolist()):
        R, d = _pose(plan.geometry[i])
        state = recursion.rotate_frame(recursion.translate_frame(state, d), R)
        is_revolute = JointMotion(kind) is JointMotion.REVOLUTE
        columns.append(Column(eq.rotate(state.R, _Z), is_revolute, state, i, velocity_index, 1.0))
        if is_revolute:
            S = eq.about_z(sines[i], cosines[i], 0.0, 1.0)
            state = recursion.after_revolute(state, _Z, S, v[i], a[i])
        elif JointMotion(kind) is JointMotion.PRISMATIC:
            state = recursion.after_prismatic(state, _Z, x[i], v[i], a[i])
        else:
            raise ValueError("a joint with more than one coordinate")
    state = recursion.translate_frame(state, _pose(plan.offsets[0])[1])
    if quantity == "acceleration":
        return [*eq.rotate(state.R, state.acc), *eq.rotate(state.R, state.alpha)]
    J = recursion.jacobian(state, columns, plan.nv, Reference.LOCAL_WORLD_ALIGNED)
    return [number for row in zip(*J, strict=True) for number in row]


def _pose(row: FloatArray) -> tuple[Any, Any]:
    return row[:9].reshape(3, 3).tolist(), row[9:12].tolist()


def generated_tasks(workload: Workload, quantity: str) -> Iterator[TimedTask]:
    compute = compile_function(workload, quantity)
    inputs = workload.inputs(quantity, workload.n)
    out = np.empty((workload.n, *workload.result_shape(quantity)))
    addresses = [x.ctypes.data for x in (*inputs, *inputs, *inputs)[:3]]  # A Jacobian does not need v and a.

    def run() -> None:
        compute(workload.n, *addresses, out.ctypes.data)

    yield TimedTask(GENERATED, workload.n, run, lambda: out, remark=_REMARK)


def compile_function(workload: Workload, quantity: str) -> Callable[..., None]:
    """Return a function of the batch size and of the addresses of q, v, a and `out`."""
    plan, folder = workload.plan, workload.folder
    is_revolute = plan.steps[:, StepField.KIND] == JointMotion.REVOLUTE
    tables = {
        "Q_AT": plan.steps[:, StepField.Q],
        "V_AT": plan.steps[:, StepField.V],
        "TURNS": is_revolute.astype(int),
    }
    macros = {
        **{"NQ": plan.nq, "NV": plan.nv, "STEPS": len(plan.steps), "RESULTS": workload.result_size(quantity)},
        **{"MOVING": int(quantity == "acceleration"), "PI_2_REST": python_numbers.PI_2_REST},
        **{name: _join(getattr(python_numbers, name)) for name in ("SINE", "COSINE")},
    }
    lines = [f"#define {name} {value}" for name, value in macros.items()]
    lines += [
        f"static const int {name}[] = {{{_join(indices.tolist())}}};" for name, indices in tables.items()
    ]
    lines.append(_generate_code(plan, quantity))
    (folder / f"{quantity}.h").write_text("\n".join(lines), "utf-8")
    library = folder / f"{quantity}.so"
    here = [f"-I{folder}", f'-DROBOT="{quantity}.h"', str(_FRAME), "-o", str(library)]
    subprocess.run([COMPILER, *_FLAGS, *here], check=True)
    function = ctypes.CDLL(str(library)).compute
    function.argtypes, function.restype = [ctypes.c_long, *4 * [ctypes.c_void_p]], None
    return function


def _join(numbers: Sequence[float]) -> str:
    return ", ".join(map(repr, numbers))


def _generate_code(plan: CompiledTree, quantity: str) -> str:
    import casadi

    names = [casadi.SX.sym(name, len(plan.steps)) for name in ("x", "sine", "cosine", "v", "a")]
    numbers = frame_results(plan, quantity, *map(casadi.vertsplit, names))
    function = casadi.Function("numbers", names, [casadi.vertcat(*numbers)], {"cse": True})
    generator = casadi.CodeGenerator("generated")
    generator.add(function)
    whole = re.search(r"static int casadi_f0\(.*?\n}", generator.dump(), re.DOTALL)
    if whole is None:
        raise ValueError("CasADi wrote no function")
    # Replace doubles by SIMD vectors, and remove CasADi's tests for missing arguments.
    text = re.sub(r"(arg\[\d+\])\? (\1\[\d+\]) : 0", r"\2", whole[0])
    text = text.replace("if (res[0]!=0) ", "")
    return re.sub(r"(a\d+)=(-?[\d.][\d.e+-]*);", r"\1=in_all_lanes(\2);", text)
