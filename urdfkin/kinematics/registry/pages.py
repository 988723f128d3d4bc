"""A page for each equation, as `urdfkin explain 7.130` prints it."""

from __future__ import annotations

import inspect
import re
import textwrap

from urdfkin.kinematics import equations as chapter
from urdfkin.kinematics.latex import latex
from urdfkin.kinematics.registry.entries import LAST, LOST, Equation, equations, sections

_NUMBER = re.compile(r"^\(?(?:eq\.?|equation)?\s*(7\.\d{1,3})\)?$", re.IGNORECASE)


def explain(number: str) -> str | None:
    """The equation, its meaning, its function and its check; None for what is no equation's number.

    Args:
        number: "7.130", "(7.130)" or "eq. 7.130".

    Returns:
        A page of plain text, or None.

    Example:
        >>> print(explain("7.5").splitlines()[2])
        R_0_1 = R(theta1) = [[cos, -sin], [sin, cos]]
    """
    match = _NUMBER.match(number.strip())
    if match is None or not 1 <= int(match[1].split(".")[1]) <= LAST:
        return None
    if match[1] in LOST:
        return _lost(match[1])
    return _page(equations()[match[1]])


def _lost(number: str) -> str:
    return (
        f"Equation {number}\n\nIt stood on page 2 of the chapter, which is lost: {', '.join(LOST)} are not "
        "known.\nEvery other equation up to 7.130 is here."
    )


def _page(equation: Equation) -> str:
    section = next(section for section in sections() if equation in section.equations)
    lines = [
        f"Equation {equation.number}    section {section.number}: {section.title}",
        "",
        equation.statement,
        "",
        equation.meaning,
        "",
        *(f"computed by   {function.replace(':', '.')}" for function in equation.functions),
        *(f"tested by     {test}" for test in equation.tests),
        f"checked with  {equation.against}",
    ]
    for name in equation.written:
        lines += ["", *_source(name), "", f"    {latex(name)}"]
    return "\n".join(lines)


def _source(name: str) -> list[str]:
    """The equation as it runs, on every kind of number."""
    source = textwrap.indent(inspect.getsource(getattr(chapter, name)).rstrip(), "    ")
    return ["written once, in urdfkin/kinematics/equations.py; in code, and in LaTeX", "", source]
