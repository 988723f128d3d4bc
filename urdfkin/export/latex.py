r"""Write a LaTeX document with the formulas of the straight-line code, in the textbook's symbols.

Symbols such as s_2 and R^(2) belong to the joint with this number on the path. A list at the beginning of the
document contains the joints' names.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from urdfkin.errors.escape import latex_text
from urdfkin.export.code import FrameCode, Writer
from urdfkin.export.expression import Node
from urdfkin.export.function import Function

#: The textbook's symbols of a link's state.
_LETTERS = {
    "R": "R",
    "p": "p",
    "w": r"\omega",
    "vel": r"\dot{p}",
    "alpha": r"\dot{\omega}",
    "acc": r"\ddot{p}",
}
_NAME = re.compile(r"(R|p|w|vel|alpha|acc)(\d+)_(\w+)")
_FUNCTION = re.compile(r"\b(sin|cos|sqrt)\(")
_RESULTS = {
    "placement": "T",
    "velocity": "v",
    "jacobian": "J",
    "jacobian_rate": r"\dot{J}",
    "hessian": "H",
    "acceleration": "a",
}


def write(code: FrameCode, to: str = "latex") -> str:
    lines = [f"% {line}".rstrip() for line in code.head]
    lines += [
        r"\documentclass{article}",
        r"\usepackage{amsmath}",
        r"\allowdisplaybreaks",
        r"\begin{document}",
    ]
    lines += [rf"\section*{{{latex_text(code.robot)}, frame {latex_text(code.frame)}}}", r"\begin{itemize}"]
    lines += [r"\item In metres, radians and seconds."]
    lines += [rf"\item joint {k + 1} of the path: {latex_text(name)}" for k, name in enumerate(code.joints)]
    lines += [rf"\item $q_{{{k + 1}}}$: {latex_text(name)}" for k, name in enumerate(code.coordinates)]
    lines += [
        rf"\item $v_{{{k + 1}}}$, $a_{{{k + 1}}}$: {latex_text(name)}" for k, name in enumerate(code.rates)
    ]
    lines += [r"\end{itemize}"]
    for function in code.functions:
        lines += _function(code, function)
    return "\n".join([*lines, r"\end{document}", ""])


def _function(code: FrameCode, function: Function) -> Iterator[str]:
    writer = Writer(code, function, _literal)
    writer.words = {node: _symbol(node, word) for node, word in writer.words.items()}
    yield rf"\subsection*{{{function.quantity.title}, eq. {', '.join(function.quantity.equations)}}}"
    for head, lines in writer.statements():
        place, _, numbers = head.partition(": ")
        yield rf"{latex_text(place)}{f' ({numbers})' if numbers else ''}:"
        yield from _aligned((word, value) for word, value in lines)
    letter = _RESULTS[function.name]
    yield from _aligned(
        (f"{letter}_{{{','.join(str(i + 1) for i in place)}}}", value)
        for place, value in zip(np.ndindex(function.shape), writer.results(), strict=True)
    )


def _aligned(lines: Iterator[tuple[str, str]]) -> Iterator[str]:
    yield r"\begin{align*}"
    yield " \\\\\n".join(f"{word} &= {_formula(value)}" for word, value in lines)
    yield r"\end{align*}"


def _symbol(node: Node, word: str) -> str:
    if node.op in ("q", "v", "a"):
        return f"{node.op}_{{{node.of[0] + 1}}}"
    if node.op in ("sin", "cos"):
        return f"{node.op[0]}_{{{node.place + 1}}}"
    if found := _NAME.fullmatch(word):
        return f"{_LETTERS[found[1]]}^{{({found[2]})}}_{{{found[3]}}}"
    return f"t_{{{word[1:]}}}"


def _formula(text: str) -> str:
    return _FUNCTION.sub(r"\\operatorname{\1}(", text).replace(" * ", r" \, ")


def _literal(x: float) -> str:
    mantissa, _, exponent = repr(x).partition("e")
    return rf"{mantissa} \cdot 10^{{{int(exponent)}}}" if exponent else mantissa
