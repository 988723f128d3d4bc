"""Export a table as text for a terminal, Markdown, HTML and LaTeX.

All formats contain the convention, the formula, the cells, base and tool. LaTeX omits a base or a tool that
is the identity. `measure_printed_table` computes the tip error due to the rounding of the printed numbers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from urdfkin.dh.snapping import SNAP_SAMPLES, largest_travel, sample_within_limits, travel_condition
from urdfkin.dh.table import DHConvention, DHRow, DHTable, is_identity
from urdfkin.dh.units import AngleUnit, Units
from urdfkin.errors.display import CodeLine, Matrix, Table, TextDocument
from urdfkin.errors.escape import latex_text
from urdfkin.model.configuration import joint_value_range
from urdfkin.model.tree import FloatArray

_FORMULA = {
    DHConvention.STANDARD: "T(i-1, i) = Rz(theta) Tz(d) Tx(a) Rx(alpha)",
    DHConvention.MODIFIED: "T(i-1, i) = Tx(a(i-1)) Rx(alpha(i-1)) Rz(theta) Tz(d)",
}
_LATEX_FORMULA = {
    DHConvention.STANDARD: r"R_z(\theta_i)\,T_z(d_i)\,T_x(a_i)\,R_x(\alpha_i)",
    DHConvention.MODIFIED: r"T_x(a_{i-1})\,R_x(\alpha_{i-1})\,R_z(\theta_i)\,T_z(d_i)",
}
#: With this factor, a tiny rounding error of a bound does not increase the last digit when the bound is
#: rounded up.
_ROUND_UP_FACTOR = 1.0 - 1e-12


def formula(table: DHTable) -> str:
    text = _FORMULA[table.convention]
    return re.sub(r"Rx\(alpha(\S*)\)", r"\g<0> Ry(beta\1)", text) if table.has_hayati_rows else text


def format_variable(
    table: DHTable,
    row: DHRow,
    times: str = " ",
    name: str = "q{}",
    number: Callable[[float], str] = "{:.10g}".format,
) -> str:
    """Format a variable, such as -q2."""
    mimicked_joint = row.mimic.mimicked_joint if row.mimic else row.joint
    q = name.format(table.joint_names.index(mimicked_joint) + 1)
    multiplier = row.sense * (row.mimic.multiplier if row.mimic else 1.0)
    return {1.0: q, -1.0: f"-{q}"}.get(multiplier, f"{number(multiplier)}{times}{q}")


def format_coordinate_names(table: DHTable, name: str = "q{}", escape: Callable[[str], str] = str) -> str:
    """Return text such as "with q1 = left", or "" if each qi is the joint of row i."""
    if [row.joint for row in table.rows] == list(table.joint_names):
        return ""
    return "with " + ", ".join(
        f"{name.format(i)} = {escape(joint)}" for i, joint in enumerate(table.joint_names, 1)
    )


def format_factor_units(table: DHTable, units: Units) -> str:
    """Return a sentence on the factors' units if a revolute joint mimics a prismatic joint, or vice versa."""
    turns = {row.joint: row.kind.turns for row in table.rows}
    is_mixed = any(
        row.mimic and turns.get(row.mimic.mimicked_joint, row.kind.turns) != row.kind.turns
        for row in table.rows
    )
    in_si = not units.uses_millimetres and units.angles is AngleUnit.RADIANS
    return "" if in_si or not is_mixed else "the factors of q are in metres and radians"


def _mimic_offsets(row: DHRow) -> tuple[float, float]:
    """Return the numbers that the mimic rule adds to theta and d."""
    offset = row.sense * row.mimic.offset if row.mimic else 0.0
    return (offset, 0.0) if row.kind.turns else (0.0, offset)


def format_sum(variable: str, constant: str) -> str:
    if constant == "0":
        return variable
    return f"{variable} - {constant[1:]}" if constant.startswith("-") else f"{variable} + {constant}"


def format_cells(table: DHTable, row: DHRow, units: Units, pi: str = "pi", **style: Any) -> list[str]:
    q = format_variable(table, row, **style)
    theta_offset, d_offset = _mimic_offsets(row)
    theta, d = units.format_angle(row.theta + theta_offset, pi), units.format_length(row.d + d_offset)
    if row.kind.turns:
        theta = format_sum(q, theta)
    else:
        d = format_sum(q, d)
    a, alpha, beta = (
        units.format_length(row.a),
        units.format_angle(row.alpha, pi),
        units.format_angle(row.beta, pi),
    )
    texts = {"a": a, "alpha": alpha, "d": d, "theta": theta, "beta": beta}
    return [texts[name] for name in _column_names(table, units)]


def _column_names(table: DHTable, units: Units) -> list[str]:
    return [*units.columns, *["beta"] * table.has_hayati_rows]


def headings(table: DHTable, units: Units) -> list[str]:
    at = "(i-1)" if table.convention is DHConvention.MODIFIED else ""
    symbols = {"a": f"a{at}", "alpha": f"alpha{at}", "d": "d", "theta": "theta", "beta": f"beta{at}"}
    return _add_units(table, units, symbols, units.angle_name)


def _add_units(table: DHTable, units: Units, symbols: dict[str, str], angle: str) -> list[str]:
    return [
        f"{symbols[name]} [{units.length_name if name in ('a', 'd') else angle}]"
        for name in _column_names(table, units)
    ]


def pose_matrix(T: FloatArray, digits: int = 10) -> Matrix:
    return Matrix([[f"{x + 0.0:.{digits}g}" for x in row] for row in T[:3]])


def format_error_bound(value: float) -> str:
    """Format a bound with three digits, rounded up.

    >>> format_error_bound(7.5912e-06), format_error_bound(0.0)
    ('7.60e-06', '0')
    """
    if value == 0.0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return f"{math.ceil(value / unit * _ROUND_UP_FACTOR) * unit:.2e}"


def snap_lines(table: DHTable) -> list[str]:
    snap = table.snap
    if snap is None:
        return []
    if not snap.changes:
        return [f"Snapped within {snap.tolerance:.3g} rad: no angle changed."]
    metres, radians = format_error_bound(snap.metres), format_error_bound(snap.radians)
    measured = f"{snap.measured_metres:.2e} m and {snap.measured_radians:.2e} rad"
    condition = f"; this holds if {holds_if}" if (holds_if := travel_condition(table)) else ""
    lines = [
        f"Snapped within {snap.tolerance:.3g} rad: the tip moves by at most {metres} m and turns by at most",
        f"{radians} rad{condition}",
        f"({measured} measured on {snap.samples} samples).",
    ]
    for change in snap.changes:
        n = len(table.rows)
        row = "base" if change.row < 0 else "tool" if change.row >= n else f"row {change.row + 1}"
        displacement = format_error_bound(change.tip_displacement)
        effect = f"turned by {change.angle:.2e} rad, tip moves by at most {displacement} m"
        effect += " with prismatic joints at 0" if change.prismatic_joints else ""
        lines.append(f"  {row}: {change.what}, {effect}")
    return lines


def table_document(table: DHTable, units: Units, pi: str = "pi", *, wrap: bool = False) -> TextDocument:
    rows = [(str(i), row.joint, *format_cells(table, row, units, pi)) for i, row in enumerate(table.rows, 1)]
    parts: list[str | Table | Matrix] = [CodeLine(formula(table)), ""]
    parts.append(Table(("i", "joint", *headings(table, units)), rows, left=(1,), names=(1,)))
    parts += [] if table.rows else ["(no joint between the two frames moves)"]
    parts += ["", names] if (names := format_coordinate_names(table)) else []
    parts += [note] if (note := format_factor_units(table, units)) else []
    for what, T in (("base", table.base), ("tool", table.tool)):
        if not is_identity(T):
            parts += ["", f"{what} (metres):", pose_matrix(T, units.digits)]
        else:
            parts += [] if what == "tool" and is_identity(table.base) else [""]
            parts.append(f"{what}: the identity")
    report = snap_lines(table)
    changes = table.snap.changes if table.snap is not None else ()
    if not wrap and changes:
        report = [" ".join(report[: -len(changes)]), *report[-len(changes) :]]
    parts += ["", *report] if report else []
    title = f"{table.robot}: {table.base_frame} to {table.tip_frame}"
    return TextDocument(f"{title}, {table.convention} Denavit-Hartenberg parameters", parts)


def write_terminal(table: DHTable, units: Units) -> str:
    return table_document(table, units, wrap=True).text() + "\n"


def write_markdown(table: DHTable, units: Units) -> str:
    return table_document(table, units).markdown() + "\n"


def write_html(table: DHTable, units: Units) -> str:
    return table_document(table, units, pi="\u03c0").html() + "\n"


def write_latex(table: DHTable, units: Units) -> str:
    """Return a LaTeX table environment that needs amsmath, booktabs and graphicx."""
    at = "_{i-1}" if table.convention is DHConvention.MODIFIED else "_i"
    angle = "rad" if units.angles is AngleUnit.RADIANS else r"$^\circ$"
    symbols = {"a": f"$a{at}$", "alpha": rf"$\alpha{at}$", "d": "$d_i$", "theta": r"$\theta_i$"}
    symbols["beta"] = rf"$\beta{at}$"
    heads = [r"$i$", "joint", *_add_units(table, units, symbols, angle)]
    rows = []
    for i, row in enumerate(table.rows, 1):
        texts = format_cells(table, row, units, pi=r"\pi", times=r"\,", name="q_{{{}}}")
        rows.append([str(i), latex_text(row.joint), *map(latex_math, texts)])
    poses = {what: T for what, T in (("Base", table.base), ("Tool", table.tool)) if not is_identity(T)}
    frame = [rf"\begin{{tabular}}{{rl{'r' * (len(heads) - 2)}}}", r"  \toprule"]
    frame += [f"  {' & '.join(heads)} \\\\", r"  \midrule", *(f"  {' & '.join(row)} \\\\" for row in rows)]
    frame += [r"  \bottomrule", r"\end{tabular}"]
    lines = [
        r"\begin{table}",
        r"  \centering",
        f"  \\caption{{{_latex_caption(table)}}}",
        *scale_to_fit(frame),
    ]
    if names := format_coordinate_names(table, name="$q_{{{}}}$", escape=latex_text):
        lines.append(rf"  \par\medskip {names}")
    if note := format_factor_units(table, units):
        lines.append(rf"  \par {note}")
    lines += [line for what, T in poses.items() for line in latex_pose(what, T)]
    return "\n".join([*lines, r"\end{table}"]) + "\n"


def _latex_caption(table: DHTable) -> str:
    names = f"{latex_text(table.robot)}, {latex_text(table.base_frame)} to {latex_text(table.tip_frame)}"
    product = _LATEX_FORMULA[table.convention]
    if table.has_hayati_rows:
        product = re.sub(r"R_x\(\\alpha(\S*?)\)", r"\g<0>\\,R_y(\\beta\1)", product)
    caption = f"Denavit--Hartenberg parameters of {names}, {table.convention} convention, $T = {product}$."
    if table.snap is not None and table.snap.changes:
        caption += (
            f" Angles were rounded within {latex_math(f'{table.snap.tolerance:.2g}')}\\,rad,"
            f" which moves the tip by at most {latex_math(format_error_bound(table.snap.metres))}\\,m"
        )
        caption += f" if {holds_if}." if (holds_if := travel_condition(table)) else "."
    return caption


def scale_to_fit(lines: list[str]) -> list[str]:
    """Scale a wide LaTeX table to the text width."""
    size = r"\ifdim\width>\linewidth\linewidth\else\width\fi"
    return [rf"  \resizebox{{{size}}}{{!}}{{%", *(f"    {line}" for line in lines), "  }"]


def latex_pose(what: str, T: FloatArray) -> list[str]:
    rows = (" & ".join(_write_powers_of_ten(f"{x + 0.0:.6g}") for x in row) for row in T)
    matrix = r"\begin{bmatrix}" + r" \\ ".join(rows) + r"\end{bmatrix}"
    return [r"  \par\medskip", *scale_to_fit([rf"{what} (m): ${matrix}$"])]


def latex_math(text: str) -> str:
    return f"${_write_powers_of_ten(text)}$"


def _write_powers_of_ten(text: str) -> str:
    return re.sub(r"e([+-])0*(\d+)", lambda m: rf"\cdot 10^{{{'-' if m[1] == '-' else ''}{m[2]}}}", text)


# -- the tip error of a printed table -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class PrintedPrecision:
    """Tip error of a printed table.

    Attributes:
        metres: Largest position error on the samples.
        bound: Proven bound within the joint limits, m; None if no finite bound is known.
        condition: Condition of the bound, for example on the travel of a joint; "" without a condition.
    """

    digits: int
    metres: float
    bound: float | None
    samples: int
    condition: str = ""

    def __str__(self) -> str:
        proven = "" if self.bound is None else f"; the proven bound is {format_error_bound(self.bound)} m"
        condition = f"; this holds if {self.condition}" if self.condition else ""
        return (
            f"printed with {self.digits} digits, the table reproduces the tip within"
            f" {format_error_bound(self.metres)} m of its exact position on {self.samples} samples"
            f"{proven}{condition}"
        )


def measure_printed_table(table: DHTable, units: Units, pose_digits: int | None = None) -> PrintedPrecision:
    """Return a printed table's tip error; `pose_digits` applies to base and tool."""
    rows = tuple(_round_row(row, units) for row in table.rows)
    base, tool = (_round_pose(T, pose_digits or units.digits) for T in (table.base, table.tool))
    q = sample_within_limits(table)
    # `DHTable` rejects a base or tool if its rotation is rounded to few digits.
    T_0_n = replace(table, rows=rows, base=np.eye(4), tool=np.eye(4)).placement(q)
    distances = np.linalg.norm((base @ T_0_n @ tool - table.placement(q))[:, :3, 3], axis=-1)
    bound = _bound_tip_error(table, rows, base, tool)
    finite_bound = bound if math.isfinite(bound) else None
    measured = float(distances.max(initial=0.0))
    return PrintedPrecision(units.digits, measured, finite_bound, SNAP_SAMPLES, travel_condition(table))


def _round_row(row: DHRow, units: Units) -> DHRow:
    rule = row.mimic
    theta_offset, d_offset = _mimic_offsets(row)
    return replace(
        row,
        a=units.round_length(row.a),
        alpha=units.round_angle(row.alpha),
        d=units.round_length(row.d + d_offset) - d_offset,
        theta=units.round_angle(row.theta + theta_offset) - theta_offset,
        beta=units.round_angle(row.beta),
        mimic=rule and replace(rule, multiplier=float(f"{rule.multiplier:.10g}")),
    )


def _round_pose(T: FloatArray, digits: int) -> FloatArray:
    return T if is_identity(T) else np.array([[float(f"{x:.{digits}g}") for x in row] for row in T])


def _largest_mimicked_value(table: DHTable, row: DHRow) -> float:
    """Return the largest absolute value of the row's mimicked joint, or 0 without a mimic rule."""
    if row.mimic is None or row.mimic.multiplier == 0.0:
        return 0.0
    for other in table.rows:
        if other.joint == row.mimic.mimicked_joint:
            return max(map(abs, joint_value_range(other.kind, other.limit)))
    largest = max(map(abs, joint_value_range(row.kind, row.limit)))
    return (largest + abs(row.mimic.offset)) / abs(row.mimic.multiplier)


def _bound_tip_error(table: DHTable, rows: tuple[DHRow, ...], base: FloatArray, tool: FloatArray) -> float:
    """Bound the tip error (m) due to rounded table numbers.

    The rounding error of an angle moves the tip by at most error * lever. The lever is an upper bound of the
    distance from the row's frame to the tip.
    """
    lever = float(np.linalg.norm(table.tool[:3, 3]))
    total = float(np.linalg.norm((tool - table.tool)[:3, 3]))
    for row, printed_row in zip(reversed(table.rows), reversed(rows), strict=True):
        lever += abs(row.a) + abs(row.d) + (0.0 if row.kind.turns else largest_travel(table, row))
        if row.mimic is not None and printed_row.mimic is not None:
            multiplier_error = abs(row.mimic.multiplier - printed_row.mimic.multiplier)
            total += multiplier_error * _largest_mimicked_value(table, row) * max(lever, 1.0)
        errors = np.abs(np.subtract(row.cells, printed_row.cells))
        total += float(errors[[0, 2]].sum() + errors[[1, 3, 4]].sum() * lever)
    base_error = base - table.base
    rotation_error = float(np.linalg.norm(base_error[:3, :3]))
    total = total * (1.0 + rotation_error) + rotation_error * lever + float(np.linalg.norm(base_error[:3, 3]))
    return total + table.rounding(np.zeros(len(table.joint_names))).item()
