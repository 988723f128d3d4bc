"""Export a table for two toolboxes: roboticstoolbox (Python) and MATLAB's Robotics System Toolbox.

| Table | Object of roboticstoolbox |
|---|---|
| rows with four parameters | `DHRobot` |
| Hayati rows, or no rows | `Robot` of elementary transforms (Haviland and Corke) |

For MATLAB, the code makes a `rigidBodyTree`. The toolbox's "dh" and "mdh" transforms ignore theta of a
revolute joint and d of a prismatic joint, and have no fifth parameter. The code therefore sets each joint's
frame by a matrix, and the joint's axis is the z axis. The code is tested in Octave with substitutes for the
toolbox's classes (`scripts/forms/octave`), but has not been tested in MATLAB.
"""

from __future__ import annotations

import json
from collections.abc import Callable

from urdfkin.dh.convert import make_unique, relative_frame_poses
from urdfkin.dh.export.code import (
    check_no_mimic,
    docstring_lines,
    format_limits,
    format_numbers,
    header_lines,
    make_identifier,
    matrix_lines,
    sanitize,
)
from urdfkin.dh.export.data import format_toml_value
from urdfkin.dh.export.text import latex_math, latex_pose, scale_to_fit
from urdfkin.dh.screws import ProductOfExponentials, screws_document
from urdfkin.dh.structure import axes_and_connecting_vectors
from urdfkin.dh.table import DHConvention, DHRow, DHTable, is_identity
from urdfkin.errors.display import format_number
from urdfkin.errors.escape import latex_text
from urdfkin.model.tree import FloatArray


def write_roboticstoolbox(table: DHTable) -> str:
    """Return a module with `robot`."""
    if table.has_hayati_rows or not table.rows:
        return write_ets(table)
    check_no_mimic(table, "DHRobot")
    lines = docstring_lines(table)
    lines += ["import numpy as np", "import roboticstoolbox as rtb", "", "robot = rtb.DHRobot(", "    ["]
    lines += [f"        {_link_code(row, table.convention)}," for row in table.rows]
    lines += ["    ],", f'    name="{sanitize(table.robot)}",']
    for what, T in (("base", table.base), ("tool", table.tool)):
        lines.append(f"    {what}=np.array([{format_numbers(T.ravel())}]).reshape(4, 4),")
    return "\n".join([*lines, ")"]) + "\n"


def _link_code(row: DHRow, convention: DHConvention) -> str:
    suffix = "DH" if convention is DHConvention.STANDARD else "MDH"
    kind, constant, offset = (
        ("Revolute", f"d={row.d!r}", row.theta)
        if row.kind.turns
        else ("Prismatic", f"theta={row.theta!r}", row.d)
    )
    arguments = [constant, f"a={row.a!r}", f"alpha={row.alpha!r}", f"offset={offset!r}"]
    return f"rtb.{kind}{suffix}({', '.join([*arguments, *_sense_and_limits(row)])})"


def write_matlab_rst(table: DHTable) -> str:
    """Return a MATLAB function file that makes a rigidBodyTree."""
    check_no_mimic(table, "rigidBodyTree")
    poses = relative_frame_poses(table)
    lines = [
        f"function robot = {make_identifier(table.robot)}_tree()",
        *(f"% {line}" for line in header_lines(table)),
    ]
    lines += [
        "robot = rigidBodyTree('DataFormat', 'row');",
        f"robot.BaseName = '{sanitize(table.base_frame)}';",
    ]
    parent, bodies, joints = "robot.BaseName", [sanitize(table.base_frame)], list[str]()
    for row, T in zip(table.rows, poses[:-1], strict=True):
        kind = "revolute" if row.kind.turns else "prismatic"
        joints.append(make_unique(sanitize(row.joint), joints))
        bodies.append(make_unique(f"{sanitize(row.joint)}_link", bodies))
        lines += matrix_lines("T", T.tolist(), 4)
        lines += [
            f"body = rigidBody('{bodies[-1]}');",
            f"joint = rigidBodyJoint('{joints[-1]}', '{kind}');",
            "setFixedTransform(joint, T);",
            f"joint.JointAxis = [0 0 {row.sense}];",
        ]
        if limits := format_limits(row):
            lines.append(f"joint.PositionLimits = [{limits}];")
        lines += ["body.Joint = joint;", f"addBody(robot, body, {parent});"]
        parent = f"'{bodies[-1]}'"
    tip = make_unique(f"{sanitize(table.tip_frame)}_tip", bodies)
    lines += [*matrix_lines("T", poses[-1].tolist(), 4), f"body = rigidBody('{tip}');"]
    lines += ["setFixedTransform(body.Joint, T);", f"addBody(robot, body, {parent});", "end"]
    return "\n".join(lines) + "\n"


def write_ets(table: DHTable) -> str:
    """Return a module of elementary transforms."""
    check_no_mimic(table, "a sequence of elementary transforms")
    lines = docstring_lines(table)
    lines += ["import numpy as np", "import roboticstoolbox as rtb", "from roboticstoolbox import ET", ""]
    lines += ["ets = rtb.ETS(", "    [", *_pose_transform(table.base, always=not table.rows)]
    lines += [
        f"        {', '.join(_row_transforms(row, table.convention))},  # {sanitize(row.joint)}"
        for row in table.rows
    ]
    lines += [
        *_pose_transform(table.tool),
        "    ]",
        ")",
        f'robot = rtb.Robot(ets, name="{sanitize(table.robot)}")',
    ]
    return "\n".join(lines) + "\n"


def _sense_and_limits(row: DHRow) -> list[str]:
    limits = format_limits(row)
    return ["flip=True"] * (row.sense < 0) + ([f"qlim=[{limits}]"] if limits else [])


def _row_transforms(row: DHRow, convention: DHConvention) -> list[str]:
    variable = ", ".join(_sense_and_limits(row))
    S = _transform("Rz", row.theta)
    S += [f"ET.Rz({variable})"] * row.kind.turns
    S += _transform("tz", row.d)
    S += [f"ET.tz({variable})"] * (not row.kind.turns)
    X = [*_transform("tx", row.a), *_transform("Rx", row.alpha), *_transform("Ry", row.beta)]
    return S + X if convention is DHConvention.STANDARD else X + S


def _transform(name: str, value: float) -> list[str]:
    return [f"ET.{name}({value!r})"] if value else []


def _pose_transform(T: FloatArray, *, always: bool = False) -> list[str]:
    if is_identity(T) and not always:
        return []
    return [f"        ET.SE3(np.array([{format_numbers(T.ravel())}]).reshape(4, 4)),"]


def write_screws(screws: ProductOfExponentials, form: str, digits: int = 10) -> str:
    """Export screws in one format.

    `form` is "terminal", "markdown", "html", "latex", "toml", "json", "numpy" or "matlab".
    """
    if form == "latex":
        return _latex(screws, digits)
    if form in _EXACT_FORMS:
        return _EXACT_FORMS[form](screws)
    return screws_document(screws, digits).render(form)


def _latex(screws: ProductOfExponentials, digits: int) -> str:
    names = f"{latex_text(screws.robot)}, {latex_text(screws.base_frame)} to {latex_text(screws.tip_frame)}"
    heads = r"$i$ & joint & $\omega_x$ & $\omega_y$ & $\omega_z$ & $v_x$ & $v_y$ & $v_z$ \\"
    rows = []
    for i, (joint, row) in enumerate(zip(screws.joints, screws.space, strict=True), 1):
        cells = " & ".join(latex_math(format_number(x, digits=min(digits, 6))) for x in row)
        rows.append(rf"  {i} & {latex_text(joint.name)} & {cells} \\")
    frame = [r"\begin{tabular}{rlrrrrrr}", r"  \toprule", f"  {heads}", r"  \midrule"]
    lines = [r"\begin{table}", r"  \centering", rf"  \caption{{Space screws of {names}, metres.}}"]
    lines += scale_to_fit([*frame, *rows, r"  \bottomrule", r"\end{tabular}"])
    return "\n".join([*lines, *latex_pose("$M$", screws.M), r"\end{table}"]) + "\n"


def _numpy(screws: ProductOfExponentials) -> str:
    title = f"{sanitize(screws.robot)}: zero pose M, space screws Slist and body screws Blist, in metres."
    lines = [f'"""{title}', "", "Each screw is a column (w, v), as in Modern Robotics.", '"""']
    lines += ["", "import numpy as np", ""]
    for name, rows in (("M", screws.M), ("Slist", screws.space), ("Blist", screws.body)):
        lines += _array(name, rows, ")" if name == "M" else ").reshape(-1, 6).T")
    if all(joint.kind.turns for joint in screws.joints):
        H, P = axes_and_connecting_vectors(screws)
        lines += [
            "",
            "# EAIK's HPRobot(H, P), ik-geo: p = P0 + R(h1, q1) (P1 + R(h2, q2) (P2 + ...)).",
            "# Give these solvers the rotation R @ R6T.T, where R is the rotation of the tip.",
        ]
        for name, rows in (("H", H), ("P", P)):
            lines += _array(name, rows, ").reshape(-1, 3)")
        lines.append("R6T = M[:3, :3]")
    return "\n".join(lines) + "\n"


def _array(name: str, rows: FloatArray, end: str) -> list[str]:
    return [
        f"{name} = np.array(",
        "    [",
        *(f"        [{format_numbers(row)}]," for row in rows),
        "    ]",
        end,
    ]


def _matlab(screws: ProductOfExponentials) -> str:
    lines = [f"function [M, Slist, Blist] = {make_identifier(screws.robot)}_screws()"]
    lines += [f"% {sanitize(screws.robot)}: each screw is a column (w; v), in metres, as in Modern Robotics"]
    lines += matrix_lines("M", screws.M, 4)
    for name, rows in (("Slist", screws.space), ("Blist", screws.body)):
        lines += [*matrix_lines(name, rows, 6), f"{name} = {name}';"]
    return "\n".join([*lines, "end"]) + "\n"


_EXACT_FORMS: dict[str, Callable[[ProductOfExponentials], str]] = {
    "toml": lambda screws: "".join(
        f"{key} = {format_toml_value(x)}\n" for key, x in screws.as_mapping().items()
    ),
    "json": lambda screws: json.dumps(screws.as_mapping(), indent=2) + "\n",
    "numpy": _numpy,
    "matlab": _matlab,
}
