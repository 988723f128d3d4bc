"""Expand a xacro file with xacrodoc, in the confined process.

A xacro file can run Python code and read environment variables. Therefore, the module `expressions` evaluates
the expressions of the file, and the module `confinement` limits the files that the process can read. The
process has no environment variables.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from urdfkin.system.files import read_text
from urdfkin.urdf.catalogue import find_package
from urdfkin.urdf.confinement import MAX_MEMORY, AllowedPaths, confine, limit_process
from urdfkin.urdf.expressions import RefusedError, evaluate
from urdfkin.urdf.xacro import find_arguments

#: Functions of xacro that would reveal types and attributes.
_FORBIDDEN_SYMBOLS = ("type", "vars")

#: A test expression, which xacro's own function evaluates, but urdfkin's function refuses.
_TEST_EXPRESSION = "${(lambda: 1)()}"

_TOO_MUCH_MEMORY = f"the expansion takes more than {MAX_MEMORY / 1024**3:g} GiB of memory"


def serve() -> None:
    """Read a request from standard input, and write the result as the last line of standard output."""
    request = json.load(sys.stdin)
    limit_process(request["seconds"])
    os.environ.clear()
    os.chdir(Path(request["path"]).parent)  # Paths in includes may be relative to the folder of the file.
    allowed_paths = AllowedPaths(**request["allowed_paths"])
    try:
        answer = _expand(Path(request["path"]), request["arguments"], request["search"], allowed_paths)
    except MemoryError:
        answer = {"error": _TOO_MUCH_MEMORY}
    except (Exception, SystemExit) as error:
        answer = {"error": f"{type(error).__name__}: {error}"[:2000]}
    sys.stdout.write("\n" + json.dumps(answer) + "\n")
    sys.stdout.flush()
    os._exit(0)  # The confinement may prevent a normal exit of Python.


def _expand(
    path: Path, arguments: dict[str, str], search_paths: Mapping[str, str], allowed_paths: AllowedPaths
) -> dict[str, Any]:
    import xacro
    import xacrodoc

    text = read_text(path)
    _replace_evaluation(path, search_paths, allowed_paths)
    importlib.import_module("xml.dom.expatbuilder")  # After `confine`, xacro cannot import this module.
    confine(allowed_paths.allows)
    # `XacroDoc.from_file` expands the result again, and so evaluates the text that `$${...}` protects.
    xacro.init_stacks(str(path))  # `xacro.abs_filename` needs the file's folder.
    document = xacro.parse(text)
    xacro.process_doc(document, mappings=arguments)
    urdf = xacrodoc.XacroDoc(document, rootdir=path.parent).to_urdf_string()
    declared = (
        find_arguments(path, _make_package_finder(path, search_paths, allowed_paths)) if arguments else None
    )
    return {"urdf": urdf, "arguments": None if declared is None else sorted(declared)}


def _replace_evaluation(path: Path, search_paths: Mapping[str, str], allowed_paths: AllowedPaths) -> None:
    """Make xacro call urdfkin's functions to evaluate expressions and to find packages.

    Raise RefusedError if this version of xacro still evaluates an expression itself.
    """
    import xacro
    import xacrodoc.packages
    from xacro import substitution_args

    symbols = xacro._global_symbols
    for name in _FORBIDDEN_SYMBOLS:
        dict.pop(symbols["python"], name, None)
    namespaces = [dict(symbols), *(value for value in symbols.values() if isinstance(value, dict))]
    functions = [value for names in namespaces for value in dict.values(names) if callable(value)]

    def evaluate_expression(expression: str, names: Mapping[str, Any], local: object = None) -> object:
        try:
            return evaluate(expression, names, functions)
        except MemoryError:  # A MemoryError has no message.
            raise RefusedError(_TOO_MUCH_MEMORY) from None

    def evaluate_substitution(expression: str, context: Mapping[str, Any]) -> str:
        names = {
            name: substitution_args.convert_value(x, "auto") for name, x in context.get("arg", {}).items()
        }
        return str(evaluate(expression, {**symbols, "true": True, "false": False, **names}, functions))

    xacro.safe_eval = evaluate_expression
    substitution_args._eval = evaluate_substitution  # This function evaluates `$(eval ...)`.
    xacrodoc.packages.get_path = _make_package_finder(path, search_paths, allowed_paths)
    try:
        xacro.eval_text(_TEST_EXPRESSION, symbols)
    except xacro.XacroException as error:
        if isinstance(error.exc, RefusedError):
            return
    raise RefusedError("this version of xacro evaluates expressions in an unknown way and is not supported")


def _make_package_finder(
    path: Path, search_paths: Mapping[str, str], allowed_paths: AllowedPaths
) -> Callable[[str], str]:
    def is_allowed_or_package(folder: Path) -> bool:
        # Without this condition, `$(find etc)` would find /etc.
        return allowed_paths.allows(str(folder)) or (folder / "package.xml").is_file()

    def find_package_folder(name: str) -> str:
        folder = find_package(name, path, search_paths, is_allowed_or_package)
        if folder is None:
            raise LookupError(f"package {name!r} is not found")
        if not allowed_paths.allows(str(folder)):
            allowed_paths.roots.append(str(folder.resolve()))
        return str(folder)

    return find_package_folder
