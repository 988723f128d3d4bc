"""Python code on NumPy alone: the rows as an array and a function of ten lines."""

from __future__ import annotations

from urdfkin.dh.export.code import header, numbers, row_numbers
from urdfkin.dh.row import Convention
from urdfkin.dh.table import DHTable
from urdfkin.dh.units import Units

_BODY = '''

def placement(q):
    """(..., 4, 4) pose of the tip in the base for q (..., {n}), rad and m."""
    q = np.asarray(q, dtype=float) @ COUPLING.T + COUPLING_OFFSET
    T = np.broadcast_to(BASE, (*q.shape[:-1], 4, 4))
    for i, (a, alpha, d, theta, beta, turns, sense) in enumerate(ROWS):
        moved = sense * q[..., i]
        S = along_axis(theta + turns * moved, d + (1 - turns) * moved)
        X = between_axes(a, alpha, beta)
        T = T @ {product}
    return T @ TOOL


def along_axis(theta, d):
    """Rz(theta) Tz(d)."""
    S = np.zeros((*theta.shape, 4, 4))
    S[..., 0, 0] = S[..., 1, 1] = np.cos(theta)
    S[..., 1, 0] = np.sin(theta)
    S[..., 0, 1] = -S[..., 1, 0]
    S[..., 2, 2] = S[..., 3, 3] = 1.0
    S[..., 2, 3] = d
    return S


def between_axes(a, alpha, beta):
    """Tx(a) Rx(alpha) Ry(beta)."""
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    return np.array([[cb, 0, sb, a], [sa * sb, ca, -sa * cb, 0], [-ca * sb, sa, ca * cb, 0], [0, 0, 0, 1.0]])
'''


def write(table: DHTable, units: Units) -> str:
    """A module with `placement(q)`."""
    del units
    coupling = table.coupling
    lines = [
        '"""' + header(table)[0] + ".",
        "",
        *(f"{line}." for line in header(table)[1:]),
        '"""',
        "",
        "import numpy as np",
        "",
    ]
    lines += ["# a, alpha, d, theta, beta, 1 for turning and 0 for sliding, sense", "ROWS = np.array("]
    lines += [
        "    [",
        *(f"        [{numbers(row)}]," for row in row_numbers(table)),
        "    ]",
        ").reshape(-1, 7)",
    ]
    lines.append(
        f"COUPLING = np.array([{numbers(coupling.matrix.ravel())}]).reshape({coupling.matrix.shape})"
    )
    lines.append(f"COUPLING_OFFSET = np.array([{numbers(coupling.offset)}])")
    for name, T in (("BASE", table.base), ("TOOL", table.tool)):
        lines += [f"{name} = np.array(", "    [", *(f"        [{numbers(row)}]," for row in T), "    ]", ")"]
    product = "S @ X" if table.convention is Convention.STANDARD else "X @ S"
    return "\n".join(lines) + "\n" + _BODY.format(n=len(table.joint_names), product=product)
