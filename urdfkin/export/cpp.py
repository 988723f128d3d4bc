"""Write a header in C++11 or CUDA, with function templates for any number type.

The number type may be `double`, `float`, or the type of a library for automatic differentiation. The header
for CUDA has the same functions for the host and the device, a kernel for batches, and C functions that start
the kernel.
"""

from __future__ import annotations

from collections.abc import Iterator

from urdfkin.export.c import (
    comment_block,
    declare_test_vectors,
    describe_result,
    fill_template,
    main_program,
    parameter_list,
)
from urdfkin.export.code import FrameCode, Writer
from urdfkin.export.function import Function


def write(code: FrameCode, to: str = "cpp") -> str:
    """Return the text of a header.

    The macro `NAME_MAIN` adds a program that runs the test vectors.
    """
    return _cuda(code) if to == "cuda" else _cpp(code)


def _header(
    file: str, code: FrameCode, head: list[str], qualifier: str, *templates: str, **texts: str
) -> str:
    name, up = code.name, code.name.upper()
    functions = (line for function in code.functions for line in _function(code, function, qualifier))
    return fill_template(
        file,
        head=comment_block([*code.header, "", *head]),
        title=name,
        UP=up,
        start=fill_template("main.hpp", title=name, UP=up).rstrip(),
        functions="\n".join(functions),
        main="\n".join([*declare_test_vectors(code), main_program(code, *templates)]),
        **texts,
    )


def _cpp(code: FrameCode) -> str:
    name, up = code.name, code.name.upper()
    first = code.functions[0]
    head = [
        f"To try it:  c++ -std=c++11 -O2 -D{up}_MAIN -x c++ {name}.hpp && ./a.out",
        f"In float:   add -D{up}_REAL=float",
        f"To call it: {name}_kinematics::{first.name}({', '.join(first.inputs)}, out);",
        f"CMake:      add_library({name} INTERFACE)",
        f"            target_include_directories({name} INTERFACE ${{CMAKE_CURRENT_SOURCE_DIR}})",
    ]
    return _header("file.hpp", code, head, "", "check_one.hpp")


def _cuda(code: FrameCode) -> str:
    name, up = code.name, code.name.upper()
    first = code.functions[0]
    inputs = ", ".join(first.inputs)
    head = [
        f"To try it:     nvcc -O2 -D{up}_MAIN -x cu {name}.cuh -o check && ./check",
        f"Without a GPU: c++ -std=c++11 -O2 -D{up}_MAIN -x c++ {name}.cuh && ./a.out",
        f"In float:      add -D{up}_REAL=float",
        f"A library:     nvcc -O3 -shared -Xcompiler -fPIC -D{up}_ENTRY_POINTS -x cu {name}.cuh \\",
        f"                 -o lib{name}.so",
        f"To call it:    {name}_kinematics::{first.name}({inputs}, out) on host and device;",
        f"               {name}_kinematics::{first.name}_batch(n, {inputs}, out, stream) for a batch;",
        f"               from C: {name}_{first.name}_double(n, {inputs}, out, stream) of the library, with",
        f'               #define {up}_DECLARATIONS, then #include "{name}.cuh"',
        "Options:       Do not use -use_fast_math: its errors are larger than the error bounds in float.",
        "               The file cannot detect this option, because nvcc defines no macro for it.",
        "CMake:         enable_language(CUDA)",
        f"               configure_file({name}.cuh {name}.cu COPYONLY)",
        f"               add_library({name} ${{CMAKE_CURRENT_BINARY_DIR}}/{name}.cu)",
        f"               target_compile_definitions({name} PRIVATE {up}_ENTRY_POINTS)",
        f"               target_include_directories({name} PUBLIC ${{CMAKE_CURRENT_SOURCE_DIR}})",
    ]
    return _header(
        "file.cuh",
        code,
        head,
        f"{up}_BOTH ",
        "check_one.hpp",
        "check_one.cuh",
        declarations="\n".join(
            f"{line};" for f in code.functions for line in _entry_point_declarations(code, f)
        ),
        kernels="".join(_cuda_kernel(code, function) for function in code.functions),
        entries="\n".join(_entry_points(code, function) for function in code.functions),
    )


def _entry_point_declarations(code: FrameCode, function: Function) -> list[str]:
    name = f"{code.name}_{function.name}"
    return [
        f"int {name}_{real}(size_t n, {parameter_list(function, real)}, struct CUstream_st *stream)"
        for real in ("double", "float")
    ]


def _entry_points(code: FrameCode, function: Function) -> str:
    call = f"{code.name}_kinematics::{function.name}_batch(n, {', '.join(function.inputs)}, out, stream)"
    return "\n".join(
        f"{line}\n{{\n    return {call};\n}}" for line in _entry_point_declarations(code, function)
    )


def _cuda_kernel(code: FrameCode, function: Function) -> str:
    widths = code.widths(function)
    return fill_template(
        "kernel.cuh",
        name=function.name,
        parameters=parameter_list(function, "T"),
        count=len(function.results),
        own=", ".join(f"own_{x}[{max(1, width)}]" for x, width in widths.items()),
        reads="\n".join(
            f"        read_rows<{width}>({x} + first * {width}, count, tile, own_{x});"
            for x, width in widths.items()
        ),
        passed=", ".join(f"own_{x}" for x in widths),
        addresses=", ".join(f"&{x}" for x in widths),
    )


def _function(code: FrameCode, function: Function, qualifier: str) -> Iterator[str]:
    writer = Writer(code, function, lambda x: f"T({x!r})")
    yield f"\n/* {describe_result(function)}, row by row; {function.operation_count} operations. */"
    yield f"template <class T> {qualifier}void {function.name}({parameter_list(function, 'T')})\n{{"
    yield "    using std::cos;\n    using std::sin;\n    using std::sqrt;"
    yield from (f"    (void){letter};" for letter in function.inputs)
    for node in writer.inputs:
        yield f"    const T {writer.names[node]} = {node.op}[{node.operands[0]}];"
    for head, lines in writer.statements():
        yield f"    /* {head} */"
        yield from (f"    const T {name} = {value};" for name, value in lines)
    yield from (f"    out[{k}] = {value};" for k, value in enumerate(writer.results()))
    yield "}"
