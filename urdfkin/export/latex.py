r"""Write a LaTeX document with the formulas of the straight-line code, in the textbook's symbols.

In symbols such as s_2 and R^(2), the number 2 means the second joint on the path. On a path with n joints,
the number n + 1 means the frame. A list at the beginning of the document contains the joints' names.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from urdfkin.errors.escape import latex_text
from urdfkin.export.code import FrameCode, Writer
from urdfkin.export.expression import Node
from urdfkin.export.function import Function

#: The textbook's symbols for a link's pose, velocity and acceleration.
_STATE_SYMBOLS = {
    "R": "R",
    "p": "p",
    "w": r"\omega",
    "vel": r"\dot{p}",
    "alpha": r"\dot{\omega}",
    "acc": r"\ddot{p}",
}
_STATE_NAME = re.compile(r"(R|p|w|vel|alpha|acc)(\d+)_(\w+)")
_EQUATION_NUMBERS = re.compile(r": ([\d., ]+)\Z")
_FUNCTION_CALL = re.compile(r"\b(sin|cos|sqrt)\(")
_RESULT_SYMBOLS = {
    "placement": "T",
    "velocity": "v",
    "jacobian": "J",
    "jacobian_rate": r"\dot{J}",
    "hessian": "H",
    "acceleration": "a",
}


def write(code: FrameCode, to: str = "latex") -> str:
    code = replace(code, maybe_proof=replace(code.proof, vectors=()))  # A LaTeX document has no test vectors.
    joints, coordinates, rates = (
        enumerate(map(latex_text, names), 1) for names in (code.joints, code.coordinates, code.rates)
    )
    lines = [
        *(f"% {line}".rstrip() for line in code.header),
        r"\documentclass{article}",
        r"\usepackage{amsmath}",
        r"\allowdisplaybreaks",
        r"\begin{document}",
        rf"\section*{{{latex_text(code.robot)}, frame {latex_text(code.frame)}}}",
        r"\begin{itemize}",
        r"\item In metres, radians and seconds.",
        *(rf"\item joint {k} of the path: {name}" for k, name in joints),
        *(rf"\item $q_{{{k}}}$: {name}" for k, name in coordinates),
        *(rf"\item $v_{{{k}}}$, $a_{{{k}}}$: {name}" for k, name in rates),
        r"\end{itemize}",
    ]
    for function in code.functions:
        lines += _function(code, function)
    return "\n".join([*lines, r"\end{document}", ""])


def _function(code: FrameCode, function: Function) -> Iterator[str]:
    writer = Writer(code, function, _literal)
    writer.names = {node: _symbol(node, name) for node, name in writer.names.items()}
    yield rf"\subsection*{{{function.quantity.title}, eq. {', '.join(function.quantity.equations)}}}"
    for head, lines in writer.statements():
        numbers = _EQUATION_NUMBERS.search(head)
        step, equations = (head[: numbers.start()], f" ({numbers[1]})") if numbers else (head, "")
        yield f"{latex_text(step)}{equations}:"
        yield from _align_lines(lines)
    letter = _RESULT_SYMBOLS[function.name]
    yield from _align_lines(
        (f"{letter}_{{{','.join(str(i + 1) for i in indices)}}}", value)
        for indices, value in zip(np.ndindex(function.shape), writer.results(), strict=True)
    )


def _align_lines(lines: Iterable[tuple[str, str]]) -> Iterator[str]:
    yield r"\begin{align*}"
    yield " \\\\\n".join(f"{symbol} &= {_format_formula(value)}" for symbol, value in lines)
    yield r"\end{align*}"


def _symbol(node: Node, name: str) -> str:
    if node.op in ("q", "v", "a"):
        return f"{node.op}_{{{node.operands[0] + 1}}}"
    if node.op in ("sin", "cos"):
        return f"{node.op[0]}_{{{node.step + 1}}}"
    if found := _STATE_NAME.fullmatch(name):
        return f"{_STATE_SYMBOLS[found[1]]}^{{({found[2]})}}_{{{found[3]}}}"
    return f"t_{{{name[1:]}}}"


def _format_formula(text: str) -> str:
    return _FUNCTION_CALL.sub(r"\\operatorname{\1}(", text).replace(" * ", r" \, ")


def _literal(x: float) -> str:
    mantissa, _, exponent = repr(x).partition("e")
    return rf"{mantissa} \cdot 10^{{{int(exponent)}}}" if exponent else mantissa
