"""Write a header with function templates for any number type: for C++11, or for CUDA.

The number types are `double`, `float`, and the types of libraries for automatic differentiation. The header
for CUDA has the same functions for the host and the device. It also has a kernel for batches, and C functions
that start the kernel.
"""

from __future__ import annotations

from collections.abc import Iterator

from urdfkin.export.c import comment, framed, main, parameters, vectors, what
from urdfkin.export.code import FrameCode, Writer
from urdfkin.export.function import Function


def write(code: FrameCode, to: str = "cpp") -> str:
    """Return the text of a header. If `NAME_MAIN` is defined, it is a program that checks itself."""
    return _cuda(code) if to == "cuda" else _cpp(code)


def _cpp(code: FrameCode) -> str:
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
        start=framed("main.hpp", title=name, UP=up).rstrip(),
        functions="\n".join(line for function in code.functions for line in _function(code, function)),
        main="\n".join([*vectors(code), main(code, "check_one.hpp")]),
    )


def _cuda(code: FrameCode) -> str:
    name, up = code.name, code.name.upper()
    first = code.functions[0]
    inputs = ", ".join(first.inputs)
    head = [
        *code.head,
        "",
        f"To try it:     nvcc -O2 -D{up}_MAIN -x cu {name}.cuh -o check && ./check",
        f"Without a GPU: c++ -std=c++11 -O2 -D{up}_MAIN -x c++ {name}.cuh && ./a.out",
        f"In float:      add -D{up}_REAL=float",
        f"A library:     nvcc -O3 -shared -Xcompiler -fPIC -D{up}_ENTRY_POINTS -x cu {name}.cuh \\",
        f"                 -o lib{name}.so",
        f"To call it:    {name}_kinematics::{first.name}({inputs}, out) on host and device;",
        f"               {name}_kinematics::{first.name}_batch(n, {inputs}, out, stream) for a batch;",
        f"               from C: {name}_{first.name}_double(n, {inputs}, out, stream) of the library, with",
        f'               #define {up}_DECLARATIONS, then #include "{name}.cuh"',
        "Options:       not -use_fast_math: the bounds in float do not allow for it, and nvcc defines no",
        "               macro by which this file could refuse it.",
        "CMake:         enable_language(CUDA)",
        f"               configure_file({name}.cuh {name}.cu COPYONLY)",
        f"               add_library({name} ${{CMAKE_CURRENT_BINARY_DIR}}/{name}.cu)",
        f"               target_compile_definitions({name} PRIVATE {up}_ENTRY_POINTS)",
        f"               target_include_directories({name} PUBLIC ${{CMAKE_CURRENT_SOURCE_DIR}})",
    ]
    functions = (line for function in code.functions for line in _function(code, function, f"{up}_BOTH "))
    return framed(
        "file.cuh",
        head=comment(head),
        title=name,
        UP=up,
        start=framed("main.hpp", title=name, UP=up).rstrip(),
        declarations="\n".join(f"{line};" for f in code.functions for line in _entries(code, f)),
        functions="\n".join(functions),
        kernels="".join(_kernel(code, function) for function in code.functions),
        entries="\n".join(_started(code, function) for function in code.functions),
        main="\n".join([*vectors(code), main(code, "check_one.hpp", "check_one.cuh")]),
    )


def _entries(code: FrameCode, function: Function) -> list[str]:
    name = f"{code.name}_{function.name}"
    return [
        f"int {name}_{real}(size_t n, {parameters(function, real)}, struct CUstream_st *stream)"
        for real in ("double", "float")
    ]


def _started(code: FrameCode, function: Function) -> str:
    call = f"{code.name}_kinematics::{function.name}_batch(n, {', '.join(function.inputs)}, out, stream)"
    return "\n".join(f"{line}\n{{\n    return {call};\n}}" for line in _entries(code, function))


def _kernel(code: FrameCode, function: Function) -> str:
    widths = code.widths(function)
    return framed(
        "kernel.cuh",
        name=function.name,
        given=parameters(function, "T"),
        count=len(function.results),
        own=", ".join(f"own_{x}[{max(1, width)}]" for x, width in widths.items()),
        reads="\n".join(
            f"        read_rows<{width}>({x} + first * {width}, count, tile, own_{x});"
            for x, width in widths.items()
        ),
        passed=", ".join(f"own_{x}" for x in widths),
        addresses=", ".join(f"&{x}" for x in widths),
    )


def _function(code: FrameCode, function: Function, before: str = "") -> Iterator[str]:
    writer = Writer(code, function, lambda x: f"T({x!r})")
    yield f"\n/* {what(function)}, row by row; {function.operations} operations. */"
    yield f"template <class T> {before}void {function.name}({parameters(function, 'T')})\n{{"
    yield "    using std::cos;\n    using std::sin;\n    using std::sqrt;"
    yield from (f"    (void){letter};" for letter in function.inputs)
    for node in writer.given:
        yield f"    const T {writer.words[node]} = {node.op}[{node.of[0]}];"
    for head, lines in writer.statements():
        yield f"    /* {head} */"
        yield from (f"    const T {word} = {value};" for word, value in lines)
    yield from (f"    out[{k}] = {value};" for k, value in enumerate(writer.results()))
    yield "}"
