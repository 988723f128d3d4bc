"""C99 code without dependencies: constant rows and one function."""

from __future__ import annotations

from urdfkin.dh.export.code import header, identifier, numbers, row_numbers
from urdfkin.dh.row import Convention
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units

_BODY = """
static void {name}_multiply(double T[16], const double M[16])
{{
    double P[16];
    for (int r = 0; r < 4; ++r)
        for (int c = 0; c < 4; ++c) {{
            P[4 * r + c] = 0.0;
            for (int k = 0; k < 4; ++k)
                P[4 * r + c] += T[4 * r + k] * M[4 * k + c];
        }}
    for (int i = 0; i < 16; ++i)
        T[i] = P[i];
}}

/* T: pose of the tip in the base, row by row; q: {n} numbers, rad and m. */
void {name}_placement(const double *q, double T[16])
{{
    for (int i = 0; i < 16; ++i)
        T[i] = {name}_base[i];
    for (int i = 0; i < {rows}; ++i) {{
        const double *row = {name}_rows[i];
        double value = {name}_coupling_offset[i];
        for (int k = 0; k < {n}; ++k)
            value += {name}_coupling[i][k] * q[k];
        const double turned = row[3] + (row[5] != 0.0 ? row[6] * value : 0.0);
        const double slid = row[2] + (row[5] != 0.0 ? 0.0 : row[6] * value);
        const double ct = cos(turned), st = sin(turned);
        const double ca = cos(row[1]), sa = sin(row[1]), cb = cos(row[4]), sb = sin(row[4]);
        const double S[16] = {{ct, -st, 0, 0, st, ct, 0, 0, 0, 0, 1, slid, 0, 0, 0, 1}};
        const double X[16] = {{cb, 0, sb, row[0], sa * sb, ca, -sa * cb, 0,
                              -ca * sb, sa, ca * cb, 0, 0, 0, 0, 1}};
        {name}_multiply(T, {first});
        {name}_multiply(T, {second});
    }}
    {name}_multiply(T, {name}_tool);
}}
"""


def write(table: DHTable, units: Units) -> str:
    """A translation unit with `ROBOT_placement`."""
    del units
    name, n, rows = identifier(table.robot), len(table.joint_names), row_numbers(table)
    lines = [
        "/* " + "\n * ".join(line.replace("/", "_") for line in header(table)) + " */",
        "#include <math.h>",
        "",
    ]
    # C has no empty arrays: a table without rows keeps one that the loop never reaches.
    lines += ["/* a, alpha, d, theta, beta, 1 for turning and 0 for sliding, sense */"]
    lines += [f"static const double {name}_rows[{max(len(rows), 1)}][7] = {{"]
    lines += [f"    {{{numbers(row)}}}," for row in rows or [[0.0] * 7]]
    lines += ["};", f"static const double {name}_coupling[{max(len(rows), 1)}][{max(n, 1)}] = {{"]
    lines += [f"    {{{numbers(row)}}}," for row in (table.coupling.matrix if rows else [[0.0]])]
    lines += ["};", f"static const double {name}_coupling_offset[{max(len(rows), 1)}] = {{"]
    lines += [f"    {numbers(table.coupling.offset) if rows else '0.0'}", "};"]
    for what, T in (("base", table.base), ("tool", table.tool)):
        lines += [f"static const double {name}_{what}[16] = {{", *(f"    {numbers(row)}," for row in T), "};"]
    order = ("S", "X") if table.convention is Convention.STANDARD else ("X", "S")
    return (
        "\n".join(lines)
        + "\n"
        + _BODY.format(name=name, n=n, rows=len(rows), first=order[0], second=order[1])
    )
