"""Write C99 code in double or single precision, for one configuration and for batches.

The exported code allocates no memory and has no global variables. Each function is straight-line code for one
configuration, or for `LANES` configurations. Consecutive numbers of one configuration are `L` elements apart:

| Configurations | `L` |
|---|---|
| one | 1 |
| `LANES` | `LANES`; a compiler turns each line into vector instructions |

The folder `templates/` contains the code that all robots share.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from urdfkin.export.code import FrameCode, Writer
from urdfkin.export.expression import Node
from urdfkin.export.function import Function

_TEMPLATE_FOLDER = Path(__file__).with_name("templates")
_FAST_FLAGS = "-O3 -march=native -ffp-contract=fast -fno-math-errno"
_PLACEHOLDER = re.compile(r"@(\w+)@")


def write(code: FrameCode, to: str = "c") -> str:
    """Return a C file.

    If the macro `NAME_DECLARATIONS` is defined, the compiler reads only the declarations.
    """
    return c_file(
        code,
        comment_block(_file_comment_lines(code)),
        "\n".join([*declare_test_vectors(code), main_program(code, "check_one.c")]),
    )


def c_file(code: FrameCode, head: str = "", main: str = "") -> str:
    return fill_template(
        "file.c",
        head=head,
        UP=code.name.upper(),
        declarations="\n".join(_declarations(code)),
        sines=fill_template("sines.c") if any(function.angles for function in code.functions) else "",
        functions="".join(_function(code, function) for function in code.functions),
        main=main,
    )


def fill_template(name: str, /, **texts: str | int) -> str:
    """Fill a template's placeholders, `@name@`."""
    template = (_TEMPLATE_FOLDER / name).read_text(encoding="utf-8")
    return _PLACEHOLDER.sub(lambda found: str(texts[found[1]]), template)


def format_literal(x: float) -> str:
    return f"R({x!r})"


def comment_block(lines: Sequence[str]) -> str:
    return "/* " + "\n".join(f" * {line}".rstrip() for line in lines)[3:] + "\n */"


def _file_comment_lines(code: FrameCode) -> list[str]:
    name, up = code.name, code.name.upper()
    return [
        *code.header,
        "",
        f"To try it:     cc -std=c99 -O2 -D{up}_MAIN {name}.c -lm && ./a.out",
        f"To compile it: cc -std=c99 {_FAST_FLAGS} -c {name}.c",
        f"In float:      add -D{up}_REAL=float",
        f'To call it:    #define {up}_DECLARATIONS, then #include "{name}.c"',
        f"CMake:         add_library({name} STATIC {name}.c)",
        f"               target_compile_options({name} PRIVATE {_FAST_FLAGS})",
        f"               target_link_libraries({name} PUBLIC m)",
        f"               target_include_directories({name} PUBLIC ${{CMAKE_CURRENT_SOURCE_DIR}})",
        f"pkg-config:    Name: {name}",
        f"               Description: kinematics of {code.robot}",
        "               Version: 1",
        f"               Libs: -l{name} -lm",
    ]


def describe_result(function: Function) -> str:
    """Return text such as "4 x 4, eq. 7.77"."""
    return f"{' x '.join(map(str, function.shape))}, eq. {', '.join(function.quantity.equations)}"


def parameter_list(function: Function, real: str) -> str:
    return ", ".join([*(f"const {real} *{letter}" for letter in function.inputs), f"{real} *out"])


def _declarations(code: FrameCode) -> Iterator[str]:
    yield "/* A function writes its result to `out`, row by row. A batch has n consecutive configurations. */"
    for function in code.functions:
        declared = parameter_list(function, f"{code.name.upper()}_REAL")
        yield f"/* {describe_result(function)} */"
        yield f"void {code.name}_{function.name}({declared});"
        yield f"void {code.name}_{function.name}_batch(size_t n, {declared});"


# -- a function --------------------------------------------------------------------------------------------


def _function(code: FrameCode, function: Function) -> str:
    writer, layout = Writer(code, function, format_literal, sine=False), InputLayout(function)
    widths = code.widths(function)

    def lines(lines_: Iterable[str], indent: str = "    ") -> str:
        return "\n".join(f"{indent}{line}" for line in lines_)

    return fill_template(
        "function.c",
        name=function.name,
        title=code.name,
        operations=function.operation_count,
        parameters=parameter_list(function, "real"),
        count=len(function.results),
        size=layout.size,
        inputs=", ".join(f"{x.op}[{x.operands[0]}]" for x in layout.inputs) or "R(0.0)",
        unused=lines(f"(void){x};" for x in widths),
        lines=lines(_body_lines(writer, layout)),
        sines=lines(_sine_lines(writer, layout)),
        reads=lines(_lane_read_lines(layout, widths)),
        lane_sines=lines(_lane_sine_lines(writer, layout)),
        reserve=min_configuration_count(code, function),
        passed=", ".join(widths),
        advance=advance_pointers(code, function),
        advance_m=lines((f"{x} += m * {width};" for x, width in widths.items()), " " * 8),
        copies=", ".join(f"own_{x}[LANES * {width} + 8] = {{R(0.0)}}" for x, width in widths.items()),
        copy=lines(
            (
                f"for (size_t i = 0; i < m * {width}; ++i) own_{x}[i] = {x}[i];"
                for x, width in widths.items()
                if width
            ),
            " " * 8,
        ),
        own=", ".join(f"own_{x}" for x in widths),
    )


def min_configuration_count(code: FrameCode, function: Function) -> int:
    """Return the least number of configurations with at least eight numbers in every non-empty array."""
    widths = (*code.widths(function).values(), len(function.results))
    return max(-(-8 // width) if width else 0 for width in widths)


def advance_pointers(code: FrameCode, function: Function) -> str:
    return ", ".join(f"{x} += LANES * {width}" for x, width in code.widths(function).items())


class InputLayout:
    """Layout of the C array `in`.

    The order is: inputs that are not angles, input angles, computed angles, sines of all angles, cosines of
    all angles.
    """

    def __init__(self, function: Function) -> None:
        inputs = [node for node in function.nodes if node.op in function.inputs]
        input_angles = [node for node in inputs if node in function.angles]
        self.inputs = [*(node for node in inputs if node not in input_angles), *input_angles]
        self.computed_angles = [node for node in function.angles if node not in input_angles]
        self.angles = [*input_angles, *self.computed_angles]
        self.first_angle = len(self.inputs) - len(input_angles)
        self.size = max(1, self.first_angle + 3 * len(self.angles))

    def index(self, node: Node) -> int:
        if node.op in ("sin", "cos"):
            return self.index(node.operands[0]) + len(self.angles) * (1 if node.op == "sin" else 2)
        if node in self.angles:
            return self.first_angle + self.angles.index(node)
        return self.inputs.index(node)


def _body_lines(writer: Writer, layout: InputLayout) -> Iterator[str]:
    for node in writer.inputs:
        yield f"const real {writer.names[node]} = in[{layout.index(node)} * L];"
    for head, lines in writer.statements():
        yield f"/* {head} */"
        yield from (f"const real {name} = {value};" for name, value in lines)
    yield from (f"out[{k} * L] = {value};" for k, value in enumerate(writer.results()))


def _sine_lines(writer: Writer, layout: InputLayout) -> Iterator[str]:
    count = len(layout.angles)
    yield from (f"{angle};" for angle in _computed_angle_lines(writer, layout, "in[{}]"))
    for k in range(layout.first_angle, layout.first_angle + count):
        yield f"in[{k + count}] = sin(in[{k}]);"
        yield f"in[{k + 2 * count}] = cos(in[{k}]);"


def _computed_angle_lines(writer: Writer, layout: InputLayout, at: str) -> Iterator[str]:
    for node in layout.computed_angles:
        value = writer.expand(node, lambda x: at.format(layout.index(x)))
        yield f"{at.format(layout.index(node))} = {value}"


def _lane_read_lines(layout: InputLayout, widths: dict[str, int]) -> Iterator[str]:
    for x, width in widths.items():
        for first in range(0, width, 8):
            found = [node for node in layout.inputs if node.op == x and node.operands[0] // 8 == first // 8]
            if found:
                yield f"{{ eight x[8]; columns({x} + {first}, {width}, x);"
                for node in found:
                    yield f"  put(in + {layout.index(node)} * LANES, x + {node.operands[0] % 8});"
                yield "}"
        yield f"(void){x};"
    yield "(void)in;"


def _lane_sine_lines(writer: Writer, layout: InputLayout) -> Iterator[str]:
    if count := len(layout.angles):
        for assignment in _computed_angle_lines(writer, layout, "in[{} * LANES + k]"):
            yield f"for (int k = 0; k < LANES; ++k) {assignment};"
        arrays = (f"in + {layout.first_angle + k * count} * LANES" for k in range(3))
        yield f"sines_cosines({', '.join(arrays)}, {count});"


# -- the test vectors of a function ------------------------------------------------------------------------


def declare_test_vectors(code: FrameCode) -> Iterator[str]:
    found, n = code.proof.vectors, len(code.proof.vectors)
    yield "/* True values at fifty digits; the tolerances in double and single precision, in eps. */"
    for k, letter in enumerate(code.inputs):
        rows = [[repr(x) for x in vector.inputs[k]] or ["0.0"] for vector in found]
        yield _array(f"given_{letter}[{n}][{len(rows[0])}]", rows)
    for function in code.functions:
        size = f"{function.name}[{n}][{len(function.results)}]"
        yield _array(f"true_{size}", [vector.results[function.name] for vector in found])
        yield _array(f"within_{size}", [vector.tolerances[function.name] for vector in found])
        yield _array(f"single_{size}", [vector.single_tolerances[function.name] for vector in found])


def _array(declared: str, rows: Sequence[Sequence[str]]) -> str:
    inside = ",\n".join(f"    {{\n{_wrap_numbers(row)}}}" for row in rows)
    return f"static const double {declared} = {{\n{inside}\n}};"


def _wrap_numbers(values: Sequence[str]) -> str:
    lines, line = list[str](), "       "
    for value in values:
        if len(line) + len(value) > 108:
            lines.append(line)
            line = "       "
        line += f" {value},"
    return "\n".join([*lines, line.rstrip(",")])


def main_program(code: FrameCode, *templates: str) -> str:
    """Return a program that checks the test vectors with templates such as "check_one.c"."""
    checks = (_check(code, function, template) for function in code.functions for template in templates)
    return fill_template("check.c", checks="".join(checks))


def _check(code: FrameCode, function: Function, template: str) -> str:
    widths, n = code.widths(function), len(code.proof.vectors)
    sizes = {x: max(1, width) for x, width in widths.items()}

    def fill_inputs(index: str, vector: str) -> str:
        return "\n".join(
            f"            for (int i = 0; i < {size}; ++i) {x}{index} = R(given_{x}[{vector}][i]);"
            for x, size in sizes.items()
        )

    return fill_template(
        template,
        title=code.name,
        UP=code.name.upper(),
        name=function.name,
        n=n,
        count=len(function.results),
        arrays=", ".join(f"{x}[N][{size}]" for x, size in sizes.items()),
        fill=fill_inputs("[k][i]", f"k % {n}"),
        fill_one=fill_inputs("[i]", "k"),
        passed=", ".join(widths),
        all=", ".join(f"&{x}[0][0]" for x in widths),
        each_array=", ".join(f"{x}[{size}]" for x, size in sizes.items()),
        each=", ".join(f"{x}[k]" for x in widths),
        on_device=", ".join(f"device_{x}(&{x}[0][0], sizeof {x})" for x in widths),
        device=", ".join(f"device_{x}.at" for x in widths),
    )
