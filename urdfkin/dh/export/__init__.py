"""Export a table as text, data or code."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, cast

from urdfkin.dh.units import Units
from urdfkin.errors import UnknownNameError
from urdfkin.errors.validators import as_bool, as_instance, as_str
from urdfkin.system.lazy_import import get_hook

if TYPE_CHECKING:
    from urdfkin.dh.table import DHTable

_TEXT_MODULE = "urdfkin.dh.export.text"
#: Module and description of each format. The module contains the function `write_NAME` for a format NAME. The
#: module name is "" if the package `urdfkin.export` writes the format.
FORMATS: dict[str, tuple[str, str]] = {
    "terminal": (_TEXT_MODULE, "aligned text"),
    "markdown": (_TEXT_MODULE, "a Markdown table"),
    "html": (_TEXT_MODULE, "HTML, for a page or a notebook"),
    "latex": (_TEXT_MODULE, "a LaTeX table (booktabs)"),
    "csv": ("urdfkin.dh.export.data", "comma-separated, read back by urdfkin"),
    "json": ("urdfkin.dh.export.data", "JSON, read back by urdfkin"),
    "toml": ("urdfkin.dh.export.data", "TOML, read back by urdfkin"),
    "numpy": ("", "Python code for NumPy, with a self-test"),
    "matlab": ("", "MATLAB and Octave code, with a self-test"),
    "sympy": ("urdfkin.dh.export.code", "Python code for SymPy, exact"),
    "casadi": ("", "Python code for CasADi, with a self-test"),
    "matlab-symbolic": ("urdfkin.dh.export.code", "MATLAB code for the Symbolic Math Toolbox"),
    "matlab-rst": ("urdfkin.dh.export.toolboxes", "MATLAB code for the Robotics System Toolbox"),
    "roboticstoolbox": ("urdfkin.dh.export.toolboxes", "Python code for roboticstoolbox's DHRobot"),
    "ets": ("urdfkin.dh.export.toolboxes", "elementary transforms, Python code for roboticstoolbox"),
    "c": ("", "C99 code, with a self-test"),
}


def export(table: DHTable, format: str, units: Units | None = None, *, verify: bool = True) -> str:
    """Export a table in a format of `FORMATS`.

    Only printed tables use `units`. With `verify`, Pinocchio checks numeric code.

    Raises:
        InputError: an argument has a wrong type.
        UnknownNameError: the format does not exist.
    """
    from urdfkin.dh.table import as_table

    table, verify = as_table(table), as_bool(verify, "verify")
    units = Units() if units is None else as_instance(units, Units, "units", "call parse_units")
    if as_str(format, "format") not in FORMATS:
        raise UnknownNameError("format", format, FORMATS)
    module, _ = FORMATS[format]
    if not module:
        return str(get_hook("code in a language")(get_hook("code of a chain")(table, verify=verify), format))
    write = getattr(importlib.import_module(module), "write_" + format.replace("-", "_"))
    return cast("str", write(table, units) if module == _TEXT_MODULE else write(table))
