"""Export a product of exponentials as text, LaTeX, TOML, JSON and code; data and code are exact."""

from __future__ import annotations

import json
from collections.abc import Callable

from urdfkin.dh.export.numeric_code import identifier, matrix, numbers, plain
from urdfkin.dh.export.text import aligned, fitted, maths, pose, pose_lines
from urdfkin.dh.screws import ProductOfExponentials
from urdfkin.dh.structure import axes_and_steps
from urdfkin.errors.display import six_digits
from urdfkin.errors.escape import latex_text, printable
from urdfkin.model.tree import FloatArray

FORMULA = "T(q) = exp([S1] q1) ... exp([Sn] qn) M = M exp([B1] q1) ... exp([Bn] qn), screws (w, v)"


def write_screws(screws: ProductOfExponentials, form: str, digits: int = 10) -> str:
    """Return the screws as "terminal", "latex", "toml", "json", "numpy" or "matlab"."""
    return _FORMS[form](screws, digits)


def _terminal(screws: ProductOfExponentials, digits: int) -> str:
    path = f"{screws.robot}: {screws.base_frame} to {screws.tip_frame}"
    lines = [f"{path}, product of exponentials (metres, angular first)", FORMULA]
    for what, rows in (("space screws S", screws.space), ("body screws B", screws.body)):
        body = [["i", "joint", "w_x", "w_y", "w_z", "v_x", "v_y", "v_z"]]
        body += [
            [str(i), joint.name, *(six_digits(x, digits=digits) for x in row)]
            for i, (joint, row) in enumerate(zip(screws.joints, rows, strict=True), 1)
        ]
        lines += ["", what, *aligned(body)]
    lines += ["", "M, the tip in the zero configuration (metres):"]
    lines += ["  " + line for line in pose_lines(screws.M, digits)]
    return "\n".join(map(printable, lines)) + "\n"


def _latex(screws: ProductOfExponentials, digits: int) -> str:
    names = f"{latex_text(screws.robot)}, {latex_text(screws.base_frame)} to {latex_text(screws.tip_frame)}"
    heads = r"$i$ & joint & $\omega_x$ & $\omega_y$ & $\omega_z$ & $v_x$ & $v_y$ & $v_z$ \\"
    rows = []
    for i, (joint, row) in enumerate(zip(screws.joints, screws.space, strict=True), 1):
        numbers = " & ".join(maths(six_digits(x, digits=min(digits, 6))) for x in row)
        rows.append(rf"  {i} & {latex_text(joint.name)} & {numbers} \\")
    frame = [r"\begin{tabular}{rlrrrrrr}", r"  \toprule", f"  {heads}", r"  \midrule"]
    lines = [r"\begin{table}", r"  \centering", rf"  \caption{{Space screws of {names}, metres.}}"]
    lines += fitted([*frame, *rows, r"  \bottomrule", r"\end{tabular}"])
    return "\n".join([*lines, *pose("$M$", screws.M), r"\end{table}"]) + "\n"


def _toml(screws: ProductOfExponentials, _digits: int) -> str:
    return "".join(f"{key} = {json.dumps(value)}\n" for key, value in screws.as_mapping().items())


def _json(screws: ProductOfExponentials, _digits: int) -> str:
    return json.dumps(screws.as_mapping(), indent=2) + "\n"


def _numpy(screws: ProductOfExponentials, _digits: int) -> str:
    lines = [
        f'"""{plain(screws.robot)}: M, space and body screws as columns (w, v), metres: Modern Robotics."""'
    ]
    lines += ["", "import numpy as np", ""]
    for name, rows in (("M", screws.M), ("Slist", screws.space), ("Blist", screws.body)):
        lines += _array(name, rows, ")" if name == "M" else ").reshape(-1, 6).T")
    if all(joint.kind.turns for joint in screws.joints):
        H, P = axes_and_steps(screws)
        lines += [
            "",
            "# EAIK's HPRobot(H, P), ik-geo: p = P0 + R(h1, q1) (P1 + R(h2, q2) (P2 + ...)).",
            "# Give them the rotation R @ R6T.T, where R is the rotation of the tip.",
        ]
        for name, rows in (("H", H), ("P", P)):
            lines += _array(name, rows, ").reshape(-1, 3)")
        lines.append("R6T = M[:3, :3]")
    return "\n".join(lines) + "\n"


def _array(name: str, rows: FloatArray, end: str) -> list[str]:
    return [f"{name} = np.array(", "    [", *(f"        [{numbers(row)}]," for row in rows), "    ]", end]


def _matlab(screws: ProductOfExponentials, _digits: int) -> str:
    lines = [f"function [M, Slist, Blist] = {identifier(screws.robot)}_screws()"]
    lines += [f"% {plain(screws.robot)}: screws are columns (w; v), metres, as in Modern Robotics"]
    lines += matrix("M", screws.M, 4)
    for name, rows in (("Slist", screws.space), ("Blist", screws.body)):
        lines += [*matrix(name, rows, 6), f"{name} = {name}';"]
    return "\n".join([*lines, "end"]) + "\n"


_FORMS: dict[str, Callable[[ProductOfExponentials, int], str]] = {
    "terminal": _terminal,
    "latex": _latex,
    "toml": _toml,
    "json": _json,
    "numpy": _numpy,
    "matlab": _matlab,
}
