"""Commands that compute a quantity of a frame, such as `urdfkin jacobian`.

Each row of the table of quantities gives one command. All share their options, their input and their output.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

import click

from urdfkin.cli.arguments import (
    Inputs,
    a_option,
    convention_option,
    frame_option,
    load_robot,
    oracle_option,
    q_option,
    read_inputs,
    reference_option,
    robot_argument,
    seed_option,
    together,
    v_option,
    verify_option,
)
from urdfkin.cli.base import base_options, with_base
from urdfkin.cli.breakdown import emit_breakdown
from urdfkin.cli.options import format_from_suffix, reject_unused_options
from urdfkin.cli.output import ENDINGS, compiling, emit, exit_code, format_option, output_option
from urdfkin.cli.report_options import check_writable
from urdfkin.verify.quantities import ACCELERATION_BREAKDOWN, SIX, Quantity

if TYPE_CHECKING:
    from urdfkin.conventions import Conversion
    from urdfkin.model.tree import FloatArray


_F = TypeVar("_F", bound=Callable[..., Any])
_VALUES = {"q": q_option, "v": v_option, "a": a_option}


def computing_options(inputs: str, *own: Any, last: tuple[Any, ...] = ()) -> Callable[[_F], _F]:
    """Combine the options: robot and frame, `own`, values, base, seed, checks, `last`, format and output."""
    return together(
        *(robot_argument, frame_option, *own, *(_VALUES[letter] for letter in inputs), base_options(inputs)),
        *(seed_option, verify_option, oracle_option, *last, format_option, output_option, click.pass_context),
    )


class Computing:
    """A running command that computes a quantity of a frame.

    Attributes:
        robot: The robot of the command.
        format_: The output format.
        output: The output file, or None.
    """

    def __init__(self, context: click.Context) -> None:
        self._context, self._options = context, context.params
        self.output = self._options["output"]
        self.format_ = format_from_suffix(context, self.output, ENDINGS, "csv")
        check_writable(self.output)
        options = self._options
        self.robot = load_robot(options["robot"], verify=options["verify"], oracle=options["oracle"])

    def inputs(self) -> Inputs:
        """Read the values of q, v, a and the base."""
        options, base = self._options, ("base_placement", "base_velocity", "base_acceleration")
        values: dict[str, Any] = {letter: options[letter] for letter in "qva" if letter in options}
        name = options.get("convention")
        values["conversion"] = None if name is None else self.robot.convention(name)
        return with_base(
            read_inputs(self.robot, options["frame"], options["seed"], **values), *map(options.get, base)
        )

    def answer(
        self, x: Inputs, quantity: Quantity, result: FloatArray, reference: str | None = None
    ) -> NoReturn:
        """Print or write the result, and exit."""
        x = x.converted()
        if x.conversion and x.conversion.angular_first and quantity.labels == SIX:
            units = dict(reversed(list(quantity.units.items())))
            quantity = replace(quantity, labels=(*SIX[3:], *SIX[:3]), units=units)
        emit(x, quantity, reference, result, self.format_, self.output)
        self.end()

    def end(self) -> NoReturn:
        """Exit with the code of the checks."""
        self._context.exit(exit_code(self.robot.certificate()))


_ROBOT = (
    "ROBOT is a path, a name from `urdfkin robots`, or - for standard input. The path can also be a table"
    " of a robot: .toml, .json or .csv."
)
_breakdown = click.option(
    "--breakdown", is_flag=True, help="Split the acceleration by joint and term; the parts add up to it."
)


def _converted(
    x: Inputs, conversion: Conversion, quantity: Quantity, reference: str, result: FloatArray
) -> FloatArray:
    """Return a result with the rows and columns of a convention."""
    if quantity.axes == 1:
        return conversion.six(result)
    if quantity.name == "jacobian":
        return conversion.jacobian(x.q, result)
    J = x.robot.jacobian(x.q, x.frame, reference, base=x.base)
    if quantity.name == "hessian":
        return conversion.hessian(x.q, J, result)
    return conversion.jacobian_rate(x.q, x.v, J, result)


def command_of(quantity: Quantity) -> click.Command:
    """Make the command that computes a quantity."""
    has_breakdown = ACCELERATION_BREAKDOWN.command == f"{quantity.command} --breakdown"

    own = [*([reference_option] if quantity.referred else []), convention_option]

    @computing_options(quantity.inputs, *own, last=(_breakdown,) if has_breakdown else ())
    def compute(
        context: click.Context, /, reference: str = "local_world_aligned", breakdown: bool = False, **_: Any
    ) -> None:
        if breakdown:
            reject_unused_options(context, ("convention",), "with --breakdown")
        run = Computing(context)
        x = run.inputs()
        with compiling():
            if breakdown:
                parts = run.robot.acceleration_breakdown(x.q, x.v, x.a, x.frame, reference, base=x.base)
            else:
                inputs = [getattr(x, letter) for letter in quantity.inputs]
                result = run.robot.compute(quantity.name, inputs, x.frame, reference, base=x.base)
                if x.conversion is not None:
                    result = _converted(x, x.conversion, quantity, reference, result)
        if breakdown:
            emit_breakdown(x, reference, parts, run.format_, run.output)
            run.end()
        run.answer(x, quantity, result, reference if quantity.referred else None)

    summary = f"{quantity.summary[0].upper()}{quantity.summary[1:]} (eq. {', '.join(quantity.equations)})."
    compute.__doc__ = f"{summary}\n\n{quantity.page}\n\n{_ROBOT}"
    return click.command(quantity.command, epilog=f"Example: {quantity.example}")(compute)
