"""Write a C++11 header with function templates for any number type.

Examples are `double`, `float`, and the types of libraries for automatic differentiation.
"""

from __future__ import annotations

from collections.abc import Iterator

from urdfkin.export.c import comment, framed, main, vectors, what
from urdfkin.export.code import Code, Writer
from urdfkin.export.function import Function


def write(code: Code, to: str = "cpp") -> str:
    """Return the text of a header. If `NAME_MAIN` is defined, it is a program that checks itself."""
    name, up = code.name, code.name.upper()
    first = code.functions[0]
    head = [
        *code.head,
        "",
        f"To try it:  c++ -std=c++11 -O2 -D{up}_MAIN -x c++ {name}.hpp && ./a.out",
        f"In float:   add -D{up}_REAL=float",
        f"To call it: {name}_kinematics::{first.name}({', '.join(first.inputs)}, out);",
        f"CMake:      add_library({name} INTERFACE)",
        f"            target_include_directories({name} INTERFACE ${{CMAKE_CURRENT_SOURCE_DIR}})",
    ]
    return framed(
        "file.hpp",
        head=comment(head),
        title=name,
        UP=up,
        functions="\n".join(line for function in code.functions for line in _function(code, function)),
        main="\n".join([*vectors(code), main(code, "check_one.hpp")]),
    )


def _function(code: Code, function: Function) -> Iterator[str]:
    writer = Writer(code, function, lambda x: f"T({x!r})")
    given = ", ".join([*(f"const T *{letter}" for letter in function.inputs), "T *out"])
    yield f"\n/* {what(function)}, row by row; {function.operations} operations. */"
    yield f"template <class T> void {function.name}({given})\n{{"
    yield "    using std::cos;\n    using std::sin;\n    using std::sqrt;"
    yield from (f"    (void){letter};" for letter in function.inputs)
    for node in writer.given:
        yield f"    const T {writer.words[node]} = {node.op}[{node.of[0]}];"
    for head, lines in writer.statements():
        yield f"    /* {head} */"
        yield from (f"    const T {word} = {value};" for word, value in lines)
    yield from (f"    out[{k}] = {value};" for k, value in enumerate(writer.results()))
    yield "}"
