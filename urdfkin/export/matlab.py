"""Write a file for MATLAB and Octave.

The main function returns handles of the exported functions and of the check.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from urdfkin.export.code import FrameCode, Writer
from urdfkin.export.function import Function

_CHECK_TEMPLATE = """
function check()
% For each function the largest error as a share of its tolerance: at most 1.
{inputs}
{functions}
end

function report(name, found, right, within)
off = abs(found(:) - right(:));
share = off ./ (within(:) * 2^-52);
share(off == 0) = 0;
worst = max([0; share]);
word = 'WRONG';
if all(share <= 1)
    word = 'good';
end
fprintf('%s %s: %d test vectors, worst error %.3g of the bound\\n', word, name, {n}, worst);
end
"""


def write(code: FrameCode, to: str = "matlab") -> str:
    name = f"{code.name}_kinematics"
    head = [
        *code.header,
        "",
        f"f = {name}();  J = f.jacobian(q);  f.check() runs the test vectors. Indices begin at 1.",
    ]
    lines = [*(f"% {line}".rstrip() for line in head), f"function f = {name}()"]
    lines += [f"f.{function.name} = @{function.name};" for function in code.functions]
    lines += ["f.check = @check;", "end"]
    for function in code.functions:
        lines += ["", *_function(code, function)]
    return "\n".join(lines) + "\n" + _check(code)


def _function(code: FrameCode, function: Function) -> Iterator[str]:
    writer = Writer(code, function)
    shape = function.shape if len(function.shape) > 1 else (*function.shape, 1)
    yield f"function out = {function.name}({', '.join(function.inputs)})"
    numbers = ", ".join(function.quantity.equations)
    yield f"% {' x '.join(map(str, shape))}, eq. {numbers}; {function.operation_count} operations."
    for x, width in code.widths(function).items():
        yield f"if numel({x}) ~= {width}, error('{x} needs {width} numbers: found %d', numel({x})), end"
    for node in writer.inputs:
        yield f"{writer.names[node]} = {node.op}({node.operands[0] + 1});"
    for head, lines in writer.statements():
        yield f"% {head}"
        yield from (f"{name} = {value};" for name, value in lines)
    yield f"out = zeros({', '.join(map(str, shape))});"
    for indices, value in zip(np.ndindex(shape), writer.results(), strict=True):
        yield f"out({', '.join(str(i + 1) for i in indices)}) = {value};"
    yield "end"


def _check(code: FrameCode) -> str:
    vectors = code.proof.vectors
    inputs = [
        f"{letter} = {_matrix([list(map(repr, vector.inputs[k])) for vector in vectors])}"
        for k, letter in enumerate(code.inputs)
    ]
    checks = []
    for function in code.functions:
        name = function.name
        arguments = ", ".join(f"{letter}(k, :)" for letter in function.inputs)
        checks += [
            f"right = {_matrix([vector.results[name] for vector in vectors])}",
            f"within = {_matrix([vector.tolerances[name] for vector in vectors])}",
            "found = zeros(size(right));",
            f"for k = 1:{len(vectors)}",
            f"    x = {name}({arguments});",
            "    found(k, :) = reshape(permute(x, ndims(x):-1:1), 1, []);",
            "end",
            f"report('{name}', found, right, within);",
        ]
    return _CHECK_TEMPLATE.format(inputs="\n".join(inputs), functions="\n".join(checks), n=len(vectors))


def _matrix(rows: Sequence[Sequence[str]]) -> str:
    if not rows[0]:
        return f"zeros({len(rows)}, 0);"
    return "[\n" + "\n".join("    " + ", ...\n    ".join(row) + ";" for row in rows) + "\n];"
