"""Run exported Python files in this interpreter, and print one JSON line for each file.

The interpreter does not need urdfkin.

    python scripts/run_exported.py torch robot_torch.py robot_array.py
    python scripts/run_exported.py jax robot_jax.py robot_array.py

The first argument names the library, `torch` or `jax`. The script calls `check`, a function in each file.
Files of the format `array` use this library. If a file contains a Hessian, the script differentiates the
file's Jacobian with the library. The derivative must agree with the expected Hessian that the file contains,
within the file's error bounds. For the first file of PyTorch code, `torch.compile` compiles all functions
except `hessian`. `scripts/check_exports.py --library` calls this script.
"""

import importlib
import json
import math
import runpy
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any


def error_ratios(path: str, library: str, compiled: bool) -> Iterator[tuple[str, float]]:
    scope = runpy.run_path(path)
    if library == "jax":
        import jax

        jax.config.update("jax_enable_x64", True)
    any_library = path.endswith("_array.py")
    name = "array" if any_library else library
    modules = ["jax.numpy" if library == "jax" else "array_api_compat.torch"] * any_library
    checked = scope["check"](*map(importlib.import_module, modules))
    for (_, kind), share in checked.items():
        yield f"{name} {kind}", share
    if "hessian" in scope["TRUE"]:
        yield f"{name} gradient", check_hessian(scope, library)
    if any_library:
        return
    for good in scope.get("gradients", dict)().values():
        yield "gradcheck", 0.0 if good else float("inf")
    if compiled and library == "torch":
        yield "torch.compile", check_compiled(scope)


def check_hessian(scope: dict[str, Any], library: str) -> float:
    if library == "torch":
        import torch

        q = torch.tensor(scope["GIVEN"]["q"], dtype=torch.float64)
        slopes = torch.func.vmap(torch.func.jacrev(scope["jacobian"]))
    else:
        import jax

        q, slopes = jax.numpy.array(scope["GIVEN"]["q"]), jax.vmap(jax.jacrev(scope["jacobian"]))
    found = slopes(q).reshape(len(q), -1).tolist()
    return max_error_ratio(found, scope["TRUE"]["hessian"], scope["WITHIN"]["hessian"], 2.0**-52)


def check_compiled(scope: dict[str, Any]) -> float:
    import torch

    largest = 0.0
    for name, letters in scope["INPUTS"].items():
        if name == "hessian":  # The compilation takes minutes.
            continue
        compiled = torch.compile(scope[name], fullgraph=True)
        inputs = [scope["GIVEN"][letter] for letter in letters]
        for kind, eps, table in (("float64", 2.0**-52, "WITHIN"), ("float32", 2.0**-23, "SINGLE")):
            values = scope["_values"](compiled, inputs, kind, "cpu")
            largest = larger(largest, max_error_ratio(values, scope["TRUE"][name], scope[table][name], eps))
    return largest


def max_error_ratio(found: Any, true: Any, within: Any, eps: float) -> float:
    largest = 0.0
    for rows in zip(found, true, within, strict=True):
        for x, y, k in zip(*rows, strict=True):
            error, least = abs(x - float(y)), k * eps
            share = error / least if least else (0.0 if error == 0.0 else float("inf"))
            largest = larger(largest, share)
    return largest


def larger(x: float, y: float) -> float:
    """Return the larger ratio; NaN counts as larger than any number."""
    return x if math.isnan(x) or x >= y else y


def main(library: str, paths: list[str]) -> None:
    compiled = True
    for path in paths:
        ratios: dict[str, float] = {}
        for name, share in error_ratios(path, library, compiled):
            ratios[name] = larger(ratios.get(name, 0.0), share)
        compiled = compiled and not path.endswith("_torch.py")
        print(json.dumps({"file": Path(path).stem, "library": library, **ratios}), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
