"""`urdfkin verify`: check a function or a program of the user."""

from __future__ import annotations

import importlib.util
import shlex
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from urdfkin.cli.options import (
    FILE,
    NumberInRange,
    convention_option,
    frame_option,
    load_robot,
    oracle_option,
    reference_option,
    reject_unused_options,
    robot_argument,
    samples_option,
    seed_option,
)
from urdfkin.cli.output import TEXT_FORMATS, Answer, answer_command, check_writable, report_compilation
from urdfkin.errors import InputError, SourceError, UnknownNameError, UrdfkinError
from urdfkin.errors.display import Strong, TextDocument
from urdfkin.system.files import write_file

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from types import ModuleType

    from urdfkin.validation.functions import FunctionCheck

_QUANTITIES = ("placement", "velocity", "jacobian", "jacobian-rate", "hessian", "acceleration", "imu")


@click.command(
    "verify", epilog="Example: urdfkin verify my_robot.py:jacobian panda --frame panda_hand --samples 1000"
)
@click.argument("target")
@robot_argument
@click.option(
    "--quantity",
    type=click.Choice(_QUANTITIES),
    help="Quantity that the function or program computes.",
    show_default="the quantity in the function's name; jacobian for a program",
)
@frame_option
@reference_option
@convention_option
@samples_option(1000, "Number of random configurations.")
@seed_option
@click.option(
    "--factor",
    type=NumberInRange(min=0, min_open=True),
    default=1.0,
    help="Multiply the error bound by this factor. Use a factor above 1 if the function rounds more often"
    " than urdfkin's recursion.",
)
@click.option(
    "--batch", is_flag=True, help="Call the function with n configurations at once: q is an array (n, nq)."
)
@click.option(
    "--program", is_flag=True, help="TARGET is the command of a program that reads and writes lines of JSON."
)
@click.option(
    "--timeout",
    type=NumberInRange(min=0, max=86400, min_open=True),
    default=10.0,
    help="With --program: time limit for each result, in seconds.",
)
@click.option(
    "--junit", type=FILE, help="Also write JUnit XML to this file, with a test case for each function."
)
@oracle_option()
@answer_command(*TEXT_FORMATS, "json")
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
    junit: Path | None,
    oracle: Any,
) -> Answer:
    """Compare your function or program with urdfkin and Pinocchio, within an error bound.

    TARGET is FILE.py:FUNCTION. If TARGET is FILE.py, the command checks each function of the file that is
    named after a quantity, for example `jacobian`.

    The arguments of a function are the arrays q (nq,), v (nv,) and a (nv,), in rad, m and seconds. A function
    for a pose or a Jacobian has only the argument q. The function returns an array.

    The option --program checks a program in any language. The program reads lines of JSON, and answers each
    line with a line {"result": [...]}. The file and the program run with the permissions of your user
    account.

    The command uses the zero configuration, the joint limits and random configurations. If a common mistake
    explains wrong results, the command names the mistake. Examples are a missing term, or a wrong frame,
    reference frame, joint order, sign or unit.

    Exit 0: all results agree. 1: a result disagrees. 2: bad input. 3: the robot cannot be checked.
    """
    from urdfkin.validation.functions import verify_function
    from urdfkin.validation.programs import Program

    if not program:
        reject_unused_options(click.get_current_context(), ("timeout",), "without --program")
    check_writable(junit)
    loaded = load_robot(robot, oracle=oracle)
    with ExitStack() as stack:
        stack.enter_context(report_compilation())
        functions: dict[str, Callable[..., object]]
        if program:
            if batch:
                raise click.UsageError("--batch is for a function in Python, and --program for a program")
            name = quantity or "jacobian"
            reference_ = None if name in ("placement", "imu") else reference
            frame_ = loaded.tip_frame if frame is None else frame
            try:
                words = shlex.split(target)
            except ValueError as error:
                raise click.UsageError(f"the command of the program cannot be read: {error}") from None
            command = Program(words, loaded, name.replace("-", " "), frame_, reference_, convention, timeout)
            functions = {name: stack.enter_context(command)}
        else:
            functions = _functions(target)
        checks = [
            verify_function(
                function,
                loaded,
                (quantity or _require_quantity(name)).replace("-", " "),
                frame=frame,
                reference=reference,
                convention=convention,
                samples=samples,
                seed=seed,
                factor=factor,
                batch=batch,
            )
            for name, function in functions.items()
        ]
    if junit is not None:
        from urdfkin.report.junit import function_checks_as_junit

        write_file(junit, function_checks_as_junit(checks))
    codes = [(3 if check.oracle_bound_ratio is None else 0) if check.agrees else 1 for check in checks]
    code = 1 if 1 in codes else max(codes)
    return Answer(lambda: _document(checks), {"json": lambda: _data(checks)}, "", code)


def _document(checks: Sequence[FunctionCheck]) -> TextDocument:
    documents = [check._text_document() for check in checks]
    if len(documents) == 1:
        return documents[0]
    parts = [part for document in documents for part in (Strong(document.title), *document.parts, "")]
    return TextDocument("", parts[:-1])


def _data(checks: Sequence[FunctionCheck]) -> dict[str, Any]:
    if len(checks) == 1:
        return checks[0].as_dict()
    return {"agrees": all(check.agrees for check in checks), "checks": [check.as_dict() for check in checks]}


def _require_quantity(function: str) -> str:
    name = _find_quantity(function)
    if name is None:
        raise click.UsageError(
            f"the name of the function {function!r} contains no quantity; pass --quantity NAME, where"
            f" NAME is one of {', '.join(_QUANTITIES)}"
        )
    return name


def _find_quantity(function: str) -> str | None:
    """Return the quantity in a function's name: "jacobian-rate" for `jacobian_rate_of_tool0`."""
    names = sorted(_QUANTITIES, key=len, reverse=True)
    return next((name for name in names if name.replace("-", "_") in function), None)


def _functions(target: str) -> dict[str, Callable[..., object]]:
    """Return the function of FILE.py:FUNCTION, or all functions of FILE.py named after a quantity."""
    path, _, name = target.rpartition(":") if not target.endswith(".py") else (target, "", "")
    if not path.endswith(".py"):
        raise InputError(
            "TARGET must be FILE.py or FILE.py:FUNCTION",
            found=target,
            remedy="to check a program, add --program and give the command that starts the program",
        )
    module = _import_file(path)
    functions = {key: value for key, value in vars(module).items() if callable(value) and key[0] != "_"}
    if name:
        if not callable(getattr(module, name, None)):
            raise UnknownNameError("function", name, functions)
        return {name: getattr(module, name)}
    named = {key: value for key, value in functions.items() if _find_quantity(key)}
    if not named:
        raise InputError(
            "no function in the file is named after a quantity",
            where=path,
            found=", ".join(functions) or "no function",
            remedy=f"name a function {' or '.join(_QUANTITIES[:3])}, or pass FILE.py:FUNCTION",
        )
    return named


def _import_file(path: str) -> ModuleType:
    file = Path(path).resolve()
    if not file.is_file():
        raise SourceError("no such file", where=path)
    # The prefix prevents clashes with installed modules.
    name = f"_urdfkin_checks_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    # The folder is at the end of sys.path, so that its files cannot replace installed modules.
    sys.path.append(str(file.parent))
    try:
        spec.loader.exec_module(module)
    except UrdfkinError:
        raise
    except (Exception, SystemExit) as error:
        raise InputError(
            "the file raises an exception", where=path, found=f"{type(error).__name__}: {error}"
        ) from error
    return module
