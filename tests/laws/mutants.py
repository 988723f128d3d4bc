"""Run as a program: change one term of one equation by a relative 1e-10, and see whether it is caught.

The recursion runs as plain Python (NUMBA_DISABLE_JIT=1) from sources that are changed while they are read:
each mutant is one piece of text in one module of `urdfkin.recursion`. Prints JSON, mutant by mutant: the
quantity that was found wrong, or null.
"""

from __future__ import annotations

import importlib
import importlib.abc
import importlib.machinery
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, ModuleType

import numpy as np

import urdfkin

#: The relative change that the issue asks to be caught.
FACTOR = "1.0000000001"
SAMPLES = 5
FRAMES = ("panda_hand_tcp", "panda_leftfinger")

#: Written in the machine's own language for the compiler; the same in Python, by the module they stand in.
_INTRINSICS = {
    "lanes": """
import ctypes


def pointer_to(array):
    return array.reshape(-1)


def numbers_at(address):
    return ctypes.cast(int(address), ctypes.POINTER(ctypes.c_double))


def whole_numbers_at(address):
    return ctypes.cast(int(address), ctypes.POINTER(ctypes.c_int64))


def copy_rows(m, s, source, target, count):
    s[target * LANES : (target + count) * LANES] = s[source * LANES : (source + count) * LANES]
""",
    "transposing": """

def read_rows(m, x, at, stride, count, s, row):
    for i in range(count):
        for k in range(m):
            s[(row + i) * LANES + k] = x[at + k * stride + i]


def write_rows(m, s, rows, first, count, to, at, stride):
    for i in range(count):
        for k in range(m):
            to[at + k * stride + i] = s[rows[first + i] * LANES + k]


def fetch_inputs(m, x, at, count):
    pass


def fetch_output(m, i, of, to, at, count):
    pass
""",
}


@dataclass(frozen=True)
class Mutant:
    """A term, and the text that computes it, before and after.

    Attributes:
        module: The module of `urdfkin.recursion`.
        before: Text that stands there exactly once.
        after: What to write instead.
        caught_by: Quantities that must be found wrong.
    """

    module: str
    before: str
    after: str
    caught_by: tuple[str, ...]


def _times(term: str) -> str:
    return f"times({FACTOR}, {term})"


_BOTH = ("velocity", "acceleration")
_VEL = ("velocity",)
_ACC = ("acceleration",)

MUTANTS = {
    # 7.127 to 7.130 in the world's axes
    "7.127 v z": Mutant("steps", "W, k), times(v, z)))", f"W, k), times({FACTOR} * v, z)))", _BOTH),
    "7.128 w x d": Mutant(
        "steps", "cross(load(s, at + W, k), load(s, D, k))",
        _times("cross(load(s, at + W, k), load(s, D, k))"), _VEL,
    ),
    "7.128 prismatic v z": Mutant(
        "steps", "store(s, V, k, plus(load(s, V, k), times(v, z)))",
        f"store(s, V, k, plus(load(s, V, k), times({FACTOR} * v, z)))", _VEL,
    ),
    "7.129 a z": Mutant("steps", "plus(times(a, z), times(v, cross(w, z)))",
                        f"plus(times({FACTOR} * a, z), times(v, cross(w, z)))", _ACC),
    "7.129 v w x z": Mutant("steps", "plus(times(a, z), times(v, cross(w, z)))",
                            f"plus(times(a, z), times({FACTOR} * v, cross(w, z)))", _ACC),
    "7.130 alpha x d": Mutant("steps", "cross(load(s, at + ALPHA, k), d)",
                              _times("cross(load(s, at + ALPHA, k), d)"), _ACC),
    "7.130 w x (w x d)": Mutant("steps", "cross(w, cross(w, d))", _times("cross(w, cross(w, d))"), _ACC),
    "7.130 prismatic a z": Mutant("steps", "plus(times(a, z), coriolis)",
                                  f"plus(times({FACTOR} * a, z), coriolis)", _ACC),
    "7.130 2 v w x z": Mutant("steps", "times(2.0 * v, cross(w, z))",
                              f"times(2.0 * {FACTOR} * v, cross(w, z))", _ACC),
    # the same in the frame's own axes
    "local 7.127 v z": Mutant("local_kernel", "s[(W + 2) * LANES + k] += s[RATE * LANES + k]",
                              f"s[(W + 2) * LANES + k] += {FACTOR} * s[RATE * LANES + k]", _BOTH),
    "local 7.128 prismatic v z": Mutant("local_kernel", "s[(V + 2) * LANES + k] += s[RATE * LANES + k]",
                                        f"s[(V + 2) * LANES + k] += {FACTOR} * s[RATE * LANES + k]", _VEL),
    "local 7.129 a z": Mutant("local_kernel", "(v * w[1], -v * w[0], s[RATE_2 * LANES + k])",
                              f"(v * w[1], -v * w[0], {FACTOR} * s[RATE_2 * LANES + k])", _ACC),
    "local 7.129 v w x z": Mutant("local_kernel", "(v * w[1], -v * w[0], s[RATE_2 * LANES + k])",
                                  f"({FACTOR} * v * w[1], -v * w[0], s[RATE_2 * LANES + k])", _ACC),
    "local 7.130 prismatic a z": Mutant("local_kernel", "-2.0 * v * w[0], s[RATE_2 * LANES + k])",
                                        f"-2.0 * v * w[0], {FACTOR} * s[RATE_2 * LANES + k])", _ACC),
    "local 7.130 2 v w x z": Mutant("local_kernel", "(2.0 * v * w[1], -2.0",
                                    f"({FACTOR} * 2.0 * v * w[1], -2.0", _ACC),
    # 7.85, its rate, and the placement
    "7.85 z x d": Mutant("jacobian_kernel", "cross(z, d), z", _times("cross(z, d)") + ", z", ("jacobian",)),
    "7.85 z": Mutant("jacobian_kernel", "store(s, ANGULAR, k, ang)",
                     f"store(s, ANGULAR, k, ({FACTOR} * ang[0], ang[1], {FACTOR} * ang[2]))", ("jacobian",)),
    "rate of 7.85, z-dot": Mutant(
        "jacobian_rate_kernel", "z_rate = cross(load(s, CARRIER_W, k), z)",
        f"z_rate = cross(load(s, CARRIER_W, k), ({FACTOR} * z[0], {FACTOR} * z[1], z[2]))",
        ("jacobian rate",),
    ),
    "rate of 7.85, z-dot x d": Mutant("jacobian_rate_kernel", "cross(z_rate, d), cross(z, d_rate)",
                                      _times("cross(z_rate, d)") + ", cross(z, d_rate)", ("jacobian rate",)),
    "rate of 7.85, z x d-dot": Mutant("jacobian_rate_kernel", "cross(z_rate, d), cross(z, d_rate)",
                                      "cross(z_rate, d), " + _times("cross(z, d_rate)"), ("jacobian rate",)),
    "7.77 d": Mutant("steps", "store(s, at + P, k, plus(load(s, at + P, k), load(s, D, k)))",
                     f"store(s, at + P, k, plus(load(s, at + P, k), {_times('load(s, D, k)')}))",
                     ("placement",)),
}  # fmt: skip


class _Changed(importlib.machinery.SourceFileLoader):
    """Compiles a module's source after the change; what was compiled before is not used."""

    mutant: Mutant | None = None

    def get_code(self, fullname: str) -> CodeType:
        path = str(self.path)
        source = Path(path).read_text(encoding="utf-8")
        name, mutant = fullname.rpartition(".")[2], type(self).mutant
        if mutant is not None and mutant.module == name:
            if source.count(mutant.before) != 1:
                raise SystemExit(f"{name} has {source.count(mutant.before)} times: {mutant.before}")
            source = source.replace(mutant.before, mutant.after)
            if mutant.module == "jacobian_kernel" or "times(" in mutant.after:
                source += "\nfrom urdfkin.recursion.lanes import times\n"
        source += _INTRINSICS.get(name, "")
        return compile(source, path, "exec")


class _Finder(importlib.abc.MetaPathFinder):
    """Has the recursion's modules loaded by `_Changed`."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if not fullname.startswith("urdfkin.recursion."):
            return None
        spec = importlib.machinery.PathFinder.find_spec(fullname, path)
        if spec is not None and spec.origin is not None:
            spec.loader = _Changed(fullname, spec.origin)
        return spec


_WALKED = ("lanes", "transposing", "steps", "walk", "columns", "motion_kernel", "local_kernel",
           "jacobian_kernel", "jacobian_rate_kernel")  # fmt: skip


def _forget() -> None:
    """The compiled walks are read anew; everything else stays."""
    package = sys.modules.get("urdfkin.recursion")
    for name in _WALKED:
        sys.modules.pop(f"urdfkin.recursion.{name}", None)
        if hasattr(package, name):
            delattr(package, name)


def caught(mutant: Mutant | None, robot: urdfkin.Robot) -> list[str]:
    """The quantities in which the robot then disagrees; only those are computed that a mutant may spoil."""
    _Changed.mutant = mutant
    _forget()
    generator = np.random.default_rng(0)
    q = robot.sample(SAMPLES, 0)
    v, a = generator.standard_normal((2, SAMPLES, robot.nv))
    calls: dict[str, Callable[[str, str], object]] = {
        "placement": lambda frame, reference: robot.placement(q, frame),
        "velocity": lambda frame, reference: robot.velocity(q, v, frame, reference),
        "acceleration": lambda frame, reference: robot.acceleration(q, v, a, frame, reference),
        "jacobian": lambda frame, reference: robot.jacobian(q, frame, reference),
        "jacobian rate": lambda frame, reference: robot.jacobian_rate(q, v, frame, reference),
    }
    found = set()
    for quantity in calls if mutant is None else mutant.caught_by:
        for frame in FRAMES:
            for reference in ("local", "world", "local_world_aligned"):
                try:
                    calls[quantity](frame, reference)
                except urdfkin.VerificationError as error:
                    found.add(str(error.quantity))
    return sorted(found)


def main() -> None:
    """Print what each mutant is caught by; the first is no mutant."""
    sys.meta_path.insert(0, _Finder())
    robot = urdfkin.load("panda")
    answer = {"nothing": caught(None, robot)}
    answer |= {name: caught(mutant, robot) for name, mutant in MUTANTS.items()}
    print(json.dumps(answer))


if __name__ == "__main__":
    main()
