"""The table for a paper: booktabs, the convention in the caption, pi as a fraction, as wide as fits."""

from __future__ import annotations

import re

from urdfkin.dh.export.cells import at_most, cells, is_identity
from urdfkin.dh.row import Convention
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Angles, Units
from urdfkin.errors.printable import latex_text
from urdfkin.model.tree import FloatArray

_FORMULA = {
    Convention.STANDARD: r"R_z(\theta_i)\,T_z(d_i)\,T_x(a_i)\,R_x(\alpha_i)",
    Convention.MODIFIED: r"T_x(a_{i-1})\,R_x(\alpha_{i-1})\,R_z(\theta_i)\,T_z(d_i)",
}


def write(table: DHTable, units: Units) -> str:
    """A table environment that needs the packages amsmath, booktabs and graphicx."""
    modified = table.convention is Convention.MODIFIED
    at = "_{i-1}" if modified else "_i"
    angle = "rad" if units.angles is Angles.RADIANS else r"$^\circ$"
    length = units.length_name
    named = {
        "a": f"$a{at}$ [{length}]",
        "alpha": rf"$\alpha{at}$ [{angle}]",
        "d": f"$d_i$ [{length}]",
        "theta": rf"$\theta_i$ [{angle}]",
    }
    heads = [r"$i$", "joint", *(named[name] for name in units.columns)]
    if table.has_hayati_rows:
        heads.append(rf"$\beta{at}$ [{angle}]")
    rows = []
    for i, row in enumerate(table.rows, 1):
        texts = [maths(text) for text in cells(table, row, units, pi=r"\pi", times=r"\,", name="q_{{{}}}")]
        rows.append([str(i), latex_text(row.joint), *texts])
    poses = {what: T for what, T in (("Base", table.base), ("Tool", table.tool)) if not is_identity(T)}
    lines = [
        r"\begin{table}",
        r"  \centering",
        f"  \\caption{{{_caption(table)}}}",
        *fitted(
            [
                rf"\begin{{tabular}}{{rl{'r' * (len(heads) - 2)}}}",
                r"  \toprule",
                f"  {' & '.join(heads)} \\\\",
                r"  \midrule",
                *(f"  {' & '.join(row)} \\\\" for row in rows),
                r"  \bottomrule",
                r"\end{tabular}",
            ]
        ),
        *(line for what, T in poses.items() for line in pose(what, T)),
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def _caption(table: DHTable) -> str:
    names = f"{latex_text(table.robot)}, {latex_text(table.base_frame)} to {latex_text(table.tip_frame)}"
    product = _FORMULA[table.convention]
    if table.has_hayati_rows:
        product = product.replace(r"R_x(\alpha_i)", r"R_x(\alpha_i)\,R_y(\beta_i)")
        product = product.replace(r"R_x(\alpha_{i-1})", r"R_x(\alpha_{i-1})\,R_y(\beta_{i-1})")
    caption = f"Denavit--Hartenberg parameters of {names}, {table.convention} convention, $T = {product}$."
    if table.snap is not None and table.snap.changes:
        caption += (
            f" Angles were rounded within {maths(f'{table.snap.tolerance:.2g}')}\\,rad,"
            f" which moves the tip by at most {maths(at_most(table.snap.metres))}\\,m."
        )
    return caption


def fitted(lines: list[str]) -> list[str]:
    """What is wider than the page's text made as wide as that, and nothing else changed."""
    size = r"\ifdim\width>\linewidth\linewidth\else\width\fi"
    return [rf"  \resizebox{{{size}}}{{!}}{{%", *(f"    {line}" for line in lines), "  }"]


def pose(what: str, T: FloatArray) -> list[str]:
    """A line of its own with a pose, in metres."""
    rows = (" & ".join(_plain(f"{x + 0.0:.6g}") for x in row) for row in T)
    matrix = r"\begin{bmatrix}" + r" \\ ".join(rows) + r"\end{bmatrix}"
    return [r"  \par\medskip", *fitted([rf"{what} (m): ${matrix}$"])]


def maths(text: str) -> str:
    """A cell in math mode, a/b as it stands and 1e-6 as a power."""
    return f"${_plain(text)}$"


def _plain(text: str) -> str:
    return re.sub(r"e([+-])0*(\d+)", lambda m: rf"\cdot 10^{{{'-' if m[1] == '-' else ''}{m[2]}}}", text)
