"""Make mutants of the code between a user's input and the result, and report the outcome of each mutant.

    python -m tests.attacks.input_to_result_mutants [--sample N --seed S] [MODULE...]

Each mutant is a change by `scripts.mutating.operators` of an imported function in a new process. The process
then loads a robot with all kinds of joints, chains of mimic joints and unusual names. It computes every
quantity in many ways. The program prints the outcomes as JSON:

    caught      a call raised VerificationError, OracleError or TableError, or a wrong result is not verified
    refused     a call raised another error, or the process ended without an answer
    same        every result is right
    WRONG       a result is wrong, and the certificate states that it was verified
    BLIND       urdfkin reads numbers of a robot with an error of 1e-9, and a result is verified all the same
    unreached   the change cannot be applied to the imported function
"""

import argparse
import ast
import importlib
import inspect
import json
import os
import random
import re
import signal
import traceback
import types
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

import urdfkin
from scripts.mutating.operators import apply_change, list_changes
from tests.reading import tree_of
from tests.urdfs import joint, limit, mimic, robot
from urdfkin import BaseMotion
from urdfkin.dh import table_from_rows
from urdfkin.errors import OracleError
from urdfkin.kinematics.rotation import exp_rotation
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.urdf.sources import Origin

#: Modules between a user's input and the result, and between the input and Pinocchio.
MODULES = (
    "verify.oracle", "verify.call", "model.chain", "model.configuration", "model.mimic",
    "dh.convert", "model.configuration_like",
    "verify.conversions", "kinematics.bodies", "verify.pinocchio", "model.base_motion",
    "compiled.evaluate", "compiled.plan", "model.reference", "robot",
    "kinematics.rotation", "kinematics.inputs",
    "model.path", "model.tree", "urdf.reader", "urdf.writer",
    "verify.bounds", "verify.derived", "verify.certificate", "verify.analytical_reference",
    "verify.quantities", "verify.tables", "verify.verifier",
)  # fmt: skip

#: Maximum error of a right result, as a fraction of its largest number.
TOLERANCE = 1e-9
#: Results that are checked, but not counted in the robot's certificate.
UNCOUNTED = ("table", "robot of a table")
#: Time limit of the process of one mutant, seconds.
_TIME_LIMIT = 60


def _joint(name: str, kind: str, parent: str, child: str, more: str = "", axis: str = "1 -2 0.5") -> str:
    number = len(name) + len(parent)
    origin = f'xyz="0.{number} -0.2 0.1" rpy="0.{number} 1 -0.4"'
    return joint(name, kind, parent, child, origin, axis, limit(-2, 1.5) + more)


URDF = robot(
    _joint("b", "revolute", "base", "c"),
    _joint("slide", "prismatic", "c", "b", axis="0 0 1"),
    _joint("turn", "continuous", "b", "joint:b", axis="0 -1 0"),
    _joint("first", "revolute", "joint:b", "d", mimic("slide", -1.5, 0.3)),
    _joint("bolt", "fixed", "d", "e"),
    _joint("second", "continuous", "e", "f", mimic("first", 0.7, -0.2)),
    _joint("free", "floating", "base", "g"),
    _joint("table", "planar", "g", "h", axis="0 0 1"),
    _joint("link:c", "prismatic", "h", "link:b", '<mimic joint="b" offset="0.1"/>'),
    name="everything",
)

#: Names of the robot's coordinates, in order.
COORDINATES = (
    "b", "slide", "turn", *(f"free.{x}" for x in ("x", "y", "z", "qx", "qy", "qz", "qw")),
    *(f"table.{x}" for x in ("x", "y", "angle")),
)  # fmt: skip


def results() -> Iterator[tuple[str, Callable[[Robot], FloatArray]]]:
    """Yield the name and the computation of each result, always with the same inputs."""
    generator = np.random.default_rng(3)
    q = generator.uniform(-1.0, 1.4, (2, 1, 13))
    q[..., 6:10] *= (1.0 + 4e-7) / np.linalg.norm(q[..., 6:10], axis=-1, keepdims=True)
    v, a = generator.normal(size=(3, 12)), generator.normal(size=(2, 3, 12))
    T = np.tile(np.eye(4), (3, 1, 1))
    T[:, :3, :3] = np.round(exp_rotation(generator.normal(size=(3, 3))), 9)
    T[:, :3, 3] = generator.normal(size=(3, 3))
    moves = BaseMotion(T, generator.normal(size=6), generator.normal(size=(2, 1, 6)))
    stands = BaseMotion(T[0])
    one = q[1, 0], v[1], a[0, 2]
    yield "placement", lambda r: r.placement(q, "f")
    yield "placement of a link like a joint", lambda r: r.placement(list(one[0]), "link:b", base=stands)
    yield "placement of a joint", lambda r: r.placement(q, "joint:slide", base=moves)
    yield "placements", lambda r: r.placement(q[:, 0], r.link_frames)
    yield "velocity", lambda r: r.velocity(q, v, "link:b", "WORLD", base=moves)
    yield "velocity, alone", lambda r: r.velocity(one[0], one[1], "joint:b", "local")
    yield "velocities", lambda r: r.velocity(q, v, ["f", "h"], "local", base=stands, verify="sample")
    yield "jacobian", lambda r: r.jacobian(q, "second", "local", base=moves)
    yield "jacobian into out", lambda r: r.jacobian(q, "link:b", out=np.empty((2, 1, 6, 12)))
    yield "jacobians", lambda r: r.jacobian(one[0], ["f", "link:b"], "world")
    yield "jacobian rate", lambda r: r.jacobian_rate(q, v, "f", "local", base=moves)
    yield "hessian", lambda r: r.hessian(q, "second", "local", base=moves)
    yield "hessians", lambda r: r.hessian(one[0], ["f", "link:b"], "world")
    yield "acceleration", lambda r: r.acceleration(q, v, a, "f", "local", base=moves)
    yield "acceleration, alone", lambda r: r.acceleration(*one, "link:b")
    yield "accelerations", lambda r: r.acceleration(q, v, a, ["f", "g", "link:b"], "world", base=moves)
    yield "analytical jacobian", lambda r: r.analytical_jacobian(q, "f", "xyz", base=moves)
    yield "of a quaternion", lambda r: r.analytical_jacobian(one[0], "link:b", "quaternion", base=stands)
    named = dict(zip(COORDINATES, np.moveaxis(q, -1, 0), strict=True))
    yield "placement by names", lambda r: r.placement(named, "f")
    of_joint = {name: x for name, x in named.items() if not name.startswith("table.")} | {
        "table": q[..., 10:]
    }
    yield "placement by a joint's name", lambda r: r.placement(of_joint, "h")
    written = "neutral, turn=0.3rad, table.y=5mm, free.x = 0.25, slide=-0.5, b=30deg, table.angle=pi/5"
    yield "placements by a text", lambda r: r.placement(written, r.link_frames)
    rates = "neutral, table.vx=5mm/s, free.wy=0.25, slide=-0.5, b=30deg/s"
    yield "velocities by a text", lambda r: r.velocity(one[0], rates, ["f", "h", "g"])
    yield "breakdown", lambda r: r.acceleration_breakdown(q, v, a, "f", base=moves).total
    yield "table", lambda r: _by_table(r, q)
    yield "robot of a table", lambda r: _of_table(q[..., :3])


def _by_table(robot: Robot, q: FloatArray) -> FloatArray:
    table = robot.dh("f", base="base")
    return table.placement(robot.select(table, q))


def _of_table(q: FloatArray) -> FloatArray:
    rows = [[0.1, 0.7, 0.2, 0.3], [0.0, -0.4, 0.1, 0.2], [0.2, 0.5, -0.3, 0.1, "P"]]
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = exp_rotation([0.3, -0.2, 0.5]), (0.1, 0.2, 0.3)
    robot = urdfkin.load(replace(table_from_rows(rows, "standard"), base=T, tool=T @ T))
    return robot.placement(q, robot.tip_frame)


def misread() -> Robot:
    """Return the robot with a relative error of 1e-9 in all numbers of urdfkin, but not of Pinocchio."""
    tree = tree_of(
        re.sub(r'(?<=[" ])-?[0-9.]+(?=[" ])', lambda x: repr(float(x[0]) * (1 + 1e-9)), URDF).encode()
    )
    return Robot(tree, URDF, origin=Origin("<text>"))


def blind() -> list[str]:
    """Return the names of the results of the misread robot that are verified by mistake."""
    warnings.simplefilter("ignore")
    found = []
    for name, compute in results():
        if name in UNCOUNTED:  # only the check itself can find this error
            continue
        robot = misread()
        try:
            compute(robot)
        except Exception:
            continue
        if not robot.verifier.find_refusal() and robot.certificate().verified:
            found.append(name)
    return found


def outcome(right: dict[str, FloatArray] | None) -> tuple[str, dict[str, FloatArray]]:
    """Return the outcome of loading the robot and computing all results."""
    warnings.simplefilter("ignore")
    found: dict[str, FloatArray] = {}
    words, wrong = set[str](), list[str]()
    try:
        robot = urdfkin.load(URDF)
    except Exception as error:
        return f"refused: {type(error).__name__}: {error}"[:200], found
    for name, compute in results():
        robot.verifier.ledger = type(robot.verifier.ledger)()
        try:
            found[name] = compute(robot)
        except (urdfkin.VerificationError, OracleError, urdfkin.TableError):
            words.add("caught")
            continue
        except Exception as error:
            words.add(f"refused: {name}: {type(error).__name__}: {error}"[:200])
            continue
        if right is not None and not _is_close(found[name], right[name]):
            if robot.verifier.find_refusal() or not (robot.certificate().verified or name in UNCOUNTED):
                words.add("caught")  # the result is returned as not verified
            else:
                wrong.append(name)
    if wrong:
        return "WRONG: " + ", ".join(wrong), found
    return ("caught" if "caught" in words else min(words, default="same")), found


def _is_close(x: FloatArray, y: FloatArray) -> bool:
    return x.shape == y.shape and bool((np.abs(x - y) <= TOLERANCE * max(1.0, float(np.abs(y).max()))).all())


# -- making a mutant ---------------------------------------------------------------------------------


def _code_objects(code: types.CodeType) -> Iterator[tuple[str, types.CodeType]]:
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield constant.co_qualname, constant
            if "<" not in constant.co_name:
                yield from _code_objects(constant)


def _functions(module: types.ModuleType) -> Iterator[types.FunctionType]:
    """Yield the functions and methods that a module defines, including wrapped functions."""
    for value in list(vars(module).values()):
        members = list(vars(value).values()) if inspect.isclass(value) else [value]
        for member in members:
            for function in _unwrapped(member):
                if function.__module__ == module.__name__:
                    yield function


def _unwrapped(member: Any) -> Iterator[types.FunctionType]:
    if isinstance(member, property):
        member = member.fget
    elif isinstance(member, cached_property):
        member = member.func
    elif isinstance(member, classmethod | staticmethod):
        member = member.__func__
    while member is not None:
        if isinstance(member, types.FunctionType):
            yield member
        member = getattr(member, "__wrapped__", None)


def make(module: types.ModuleType, tree: ast.Module) -> bool:
    """Replace the code of a module's functions; return whether any function has changed."""
    codes = dict(_code_objects(compile(tree, str(module.__file__), "exec")))
    changed = False
    for function in _functions(module):
        code = codes.get(function.__qualname__)
        if code is None or code.co_freevars != function.__code__.co_freevars:
            continue
        if (code.co_code, code.co_consts) != (function.__code__.co_code, function.__code__.co_consts):
            function.__code__ = code
            changed = True
    return changed


def attempt(name: str, change: Callable[[str], ast.Module], right: dict[str, FloatArray]) -> str:
    """Return the outcome of a changed module in a new process."""
    module = importlib.import_module(f"urdfkin.{name}")
    tree = change(source_of(name))
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        signal.alarm(_TIME_LIMIT)
        os.close(reading)
        answer = "unreached"
        try:
            if make(module, tree):
                answer = outcome(right)[0]
                if answer == "same" and (unseen := blind()):
                    answer = "BLIND: " + ", ".join(unseen)
        except BaseException:
            answer = "refused: " + traceback.format_exc()[-150:]
        os.write(writing, answer.encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        answer = pipe.read().decode()
    os.waitpid(child, 0)
    return answer or "refused: died"


def source_of(name: str) -> str:
    return Path(str(importlib.import_module(f"urdfkin.{name}").__file__)).read_text(encoding="utf-8")


def truth() -> dict[str, FloatArray]:
    """Return all results without a mutant; raise RuntimeError if one is refused or not checked."""
    (word, found), unseen = outcome(None), blind()
    if word != "same" or unseen:
        raise RuntimeError(f"without a mutant: {word}; not detected: {unseen}")
    return found


def mutants_of(names: Sequence[str], sample: int | None, seed: int) -> list[tuple[str, int]]:
    """Return mutants as (module, number): all mutants of the modules, or `sample` random mutants."""
    places = [(name, i) for name in names for i in range(len(list_changes(ast.parse(source_of(name)))))]
    return places if sample is None else random.Random(seed).sample(places, min(sample, len(places)))


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("modules", nargs="*")
    arguments.add_argument("--sample", type=int)
    arguments.add_argument("--seed", type=int, default=0)
    asked = arguments.parse_args()
    right = truth()
    for name, number in mutants_of(asked.modules or MODULES, asked.sample, asked.seed):
        change = list_changes(ast.parse(source_of(name)))[number]
        answer = attempt(name, lambda source, number=number: apply_change(source, number), right)  # type: ignore[misc]
        row = {"mutant": f"{name}:{number}", "line": change.line, "what": change.text, "outcome": answer}
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
