"""Run as a program: count the multiplications and additions that one configuration takes, by doing them.

The recursion runs as plain Python (NUMBA_DISABLE_JIT=1), one lane wide, on numbers that count.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any

import urdfkin
from tests.laws import mutants

SUBJECTS = (("panda", "panda_hand"), ("talos", "gripper_left_base_link"), ("panda", "panda_leftfinger"))


class Counted(float):
    """A number that counts what is done with it."""

    done = 0


def _counting(name: str) -> Callable[[Counted, float], Counted]:
    operation = getattr(float, name)

    def counted(self: Counted, other: float) -> Counted:
        Counted.done += 1
        return Counted(operation(self, other))

    return counted


for _name in ("add", "sub", "mul"):
    for _prefix in ("", "r"):
        setattr(Counted, f"__{_prefix}{_name}__", _counting(f"__{_prefix}{_name}__"))


def count(robot: urdfkin.Robot, frame: str) -> dict[str, int]:
    """How many operations each quantity takes."""
    modules: list[Any] = [
        import_module(f"urdfkin.recursion.{name}") for name in ("walk", "jacobian_kernel", "motion_kernel")
    ]
    walk, jacobian, motion = modules
    plan = robot.plan([robot.tree.frame_link(frame)])
    q, v, a = ([Counted(0.1 + 0.01 * i) for i in range(n)] for n in (robot.nq, robot.nv, robot.nv))
    base = [Counted(x) for x in walk.STILL_STATE[0]]
    walked, out = walk.walk_of(plan.packed), [0.0] * (6 * robot.nv + 16)
    # Whether inputs are ordinary is no part of the equations.
    jacobian.ordinary = lambda *_: True
    motion.inputs_ordinary = lambda *_: 1
    found = {}
    quantities: dict[str, Callable[[list[Counted]], object]] = {
        "jacobian": lambda s: jacobian._jacobian_block(1, s, walked, 0, 2, base, 0, q, out),
        "velocity": lambda s: motion._motion_block(1, s, walked, 0, 1, 2, base, 0, q, v, a, out),
        "acceleration": lambda s: motion._motion_block(1, s, walked, 0, 2, 2, base, 0, q, v, a, out),
    }
    for name, compute in quantities.items():
        Counted.done = 0
        compute([Counted(0.0)] * (plan.areas.rows * 16))
        found[name] = Counted.done
    return found


def main() -> None:
    """Print the counts."""
    sys.meta_path.insert(0, mutants._Finder())
    mutants._forget()
    print(json.dumps([count(urdfkin.load(name, mimic=False), frame) for name, frame in SUBJECTS]))


if __name__ == "__main__":
    main()
