"""The command `urdfkin verify`: check a function or a program of the user."""

from __future__ import annotations

import importlib.util
import shlex
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.options import (
    NumberFrom,
    Whole,
    convention_option,
    frame_option,
    load_robot,
    oracle_option,
    reference_option,
    robot_argument,
    seed_option,
)
from urdfkin.cli.output import TEXTS, Answer, answering, compiling
from urdfkin.errors import InputError, SourceError, UnknownNameError, UrdfkinError

if TYPE_CHECKING:
    from collections.abc import Callable

#: Quantities of a function: commands of the table that have one result for each configuration.
_QUANTITIES = ("placement", "velocity", "jacobian", "jacobian-rate", "hessian", "acceleration", "imu")


@click.command(
    "verify", epilog="Example: urdfkin verify my_robot.py:jacobian panda --frame panda_hand --samples 1000"
)
@click.argument("target")
@robot_argument
@click.option(
    "--quantity",
    type=click.Choice(_QUANTITIES),
    help="Quantity that the function computes. By default the function has its name.",
)
@frame_option
@reference_option
@convention_option
@click.option("--samples", type=Whole(0), default=1000, show_default=True, help="Random configurations.")
@seed_option
@click.option(
    "--factor",
    type=NumberFrom(min=0, min_open=True),
    default=1.0,
    show_default=True,
    help="Multiply the derived bound, for a function that rounds more than the textbook's recursion.",
)
@click.option("--batch", is_flag=True, help="The function takes q (n, nq) and returns n results.")
@click.option("--program", is_flag=True, help="TARGET is the command of a program that answers JSON lines.")
@click.option(
    "--timeout",
    type=NumberFrom(min=0, min_open=True),
    default=10.0,
    show_default=True,
    help="Longest time for an answer of the program, in seconds.",
)
@oracle_option
@answering(*TEXTS, "json")
def verify_command(
    target: str,
    robot: str,
    quantity: str | None,
    frame: str | None,
    reference: str,
    convention: str | None,
    samples: int,
    seed: int,
    factor: float,
    batch: bool,
    program: bool,
    timeout: float,
    oracle: Any,
) -> Answer:
    """Check a function or a program of yours against urdfkin, Pinocchio and the derived bound.

    TARGET is FILE.py:FUNCTION. The function takes q (nq,), and v and a (nv,) if the quantity needs them, in
    rad, m and seconds. It returns the result as an array. --program checks a program in any language: it
    reads lines of JSON and answers each with a line {"result": [...]}. The file and the program run with your
    rights.

    The configurations are the zero configuration, the joint limits and random ones. A wrong function is
    explained by a usual mistake where one fits: another reference frame, joint order, sign, unit, frame or
    missing term. Exit code 0: all results agree; 1: they do not; 3: no oracle can check the robot.
    """
    from urdfkin.validation.functions import verify_function  # noqa: PLC0415  keeps --help fast
    from urdfkin.validation.programs import Program  # noqa: PLC0415

    loaded = load_robot(robot, oracle=oracle)
    with ExitStack() as stack:
        function: Callable[..., object]
        if program:
            if batch:
                raise click.UsageError("--batch is for a function in Python, and --program for a program")
            name = (quantity or "jacobian").replace("-", " ")
            of = None if name in ("placement", "imu") else reference
            words = shlex.split(target)
            at = frame or loaded.tip_frame
            function = stack.enter_context(Program(words, loaded.urdf, name, at, of, timeout))
        else:
            path, _, attribute = target.rpartition(":")
            function = _function(path, attribute)
            name = (quantity or _quantity_of(attribute)).replace("-", " ")
        with compiling():
            check = verify_function(
                function,
                loaded,
                name,
                frame=frame,
                reference=reference,
                convention=convention,
                samples=samples,
                seed=seed,
                factor=factor,
                batch=batch,
            )
    code = (3 if check.oracle_share is None else 0) if check.agrees else 1
    return Answer(check._sheet, {"json": check.as_dict}, "", code)


def _quantity_of(function: str) -> str:
    for name in sorted(_QUANTITIES, key=len, reverse=True):
        if name.replace("-", "_") in function:
            return name
    raise click.UsageError(
        f"the name of the function {function!r} states no quantity; pass --quantity, one of"
        f" {', '.join(_QUANTITIES)}"
    )


def _function(path: str, name: str) -> Callable[..., object]:
    """Return a function of a Python file, which is run."""
    if not path.endswith(".py") or not name:
        raise InputError(
            "a target is FILE.py:FUNCTION",
            found=f"{path}:{name}" if path else name,
            remedy="or use --program",
        )
    file = Path(path).resolve()
    if not file.is_file():
        raise SourceError("no such file", where=path)
    spec = importlib.util.spec_from_file_location(file.stem, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules.setdefault(file.stem, module)
    sys.path.append(str(file.parent))  # last, so that a file beside it replaces no installed module
    try:
        spec.loader.exec_module(module)
    except UrdfkinError:
        raise
    except Exception as error:
        raise InputError(
            "the file raises an exception", where=path, found=f"{type(error).__name__}: {error}"
        ) from error
    found = getattr(module, name, None)
    if not callable(found):
        known = [x for x in vars(module) if callable(getattr(module, x)) and not x.startswith("_")]
        raise UnknownNameError("function", name, known)
    function: Callable[..., object] = found
    return function
