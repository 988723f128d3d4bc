"""Export a table for two toolboxes: roboticstoolbox (Python) and MATLAB's Robotics System Toolbox.

For roboticstoolbox the code makes a `DHRobot` of Revolute and Prismatic links (DH or MDH) with their limits.
A DHRobot cannot have a fifth parameter, and must have at least one joint. A table with Hayati rows, or
without rows, therefore becomes a `Robot` of elementary transforms (Haviland and Corke). The fifth parameter
of a Hayati row is an additional transform.

For the Robotics System Toolbox the code makes a `rigidBodyTree`. The toolbox's "dh" and "mdh" transforms
ignore theta of a revolute joint and d of a prismatic joint, so they would lose the table's offsets. These
transforms also have no fifth parameter for Hayati rows. The code therefore sets each joint's frame by a
matrix from the table, and the joint's axis is the z axis.

The MATLAB code is tested in Octave with substitutes for the toolbox's classes (`scripts/forms/octave`). The
code has not been tested in MATLAB.
"""

from __future__ import annotations

import json
from collections.abc import Callable

from urdfkin.dh.convert import frame_poses
from urdfkin.dh.export.code import bounds, demand_free, docstring, header, identifier, matrix, numbers, plain
from urdfkin.dh.export.text import fitted, is_identity, maths, pose, pose_matrix
from urdfkin.dh.screws import ProductOfExponentials
from urdfkin.dh.structure import axes_and_steps
from urdfkin.dh.table import DHConvention, DHRow, DHTable
from urdfkin.errors.display import CodeLine, Matrix, Table, TextDocument, six_digits
from urdfkin.errors.escape import latex_text
from urdfkin.model.tree import FloatArray


def write_roboticstoolbox(table: DHTable) -> str:
    """Return a module with `robot`, a DHRobot or a Robot; raise InputError for a mimic joint."""
    if table.has_hayati_rows or not table.rows:
        return write_ets(table)
    demand_free(table, "DHRobot")
    lines = docstring(table)
    lines += ["import numpy as np", "import roboticstoolbox as rtb", "", "robot = rtb.DHRobot(", "    ["]
    lines += [f"        {_link(row, table.convention)}," for row in table.rows]
    lines += ["    ],", f'    name="{plain(table.robot)}",']
    for what, T in (("base", table.base), ("tool", table.tool)):
        lines.append(f"    {what}=np.array([{numbers(T.ravel())}]).reshape(4, 4),")
    return "\n".join([*lines, ")"]) + "\n"


def _link(row: DHRow, convention: DHConvention) -> str:
    suffix = "DH" if convention is DHConvention.STANDARD else "MDH"
    kind, constant, offset = (
        ("Revolute", f"d={row.d!r}", row.theta)
        if row.kind.turns
        else ("Prismatic", f"theta={row.theta!r}", row.d)
    )
    given = [constant, f"a={row.a!r}", f"alpha={row.alpha!r}", f"offset={offset!r}"]
    return f"rtb.{kind}{suffix}({', '.join([*given, *joint_transform(row)])})"


def write_matlab_rst(table: DHTable) -> str:
    """Return a function file `ROBOT_tree.m`; its function returns a rigidBodyTree."""
    demand_free(table, "rigidBodyTree")
    poses = frame_poses(table)
    lines = [f"function robot = {identifier(table.robot)}_tree()", *(f"% {line}" for line in header(table))]
    lines += ["robot = rigidBodyTree('DataFormat', 'row');", f"robot.BaseName = '{plain(table.base_frame)}';"]
    parent = "robot.BaseName"
    for row, T in zip(table.rows, poses[:-1], strict=True):
        kind = "revolute" if row.kind.turns else "prismatic"
        lines += matrix("T", T.tolist(), 4)
        lines += [
            f"body = rigidBody('{plain(row.joint)}_link');",
            f"joint = rigidBodyJoint('{plain(row.joint)}', '{kind}');",
            "setFixedTransform(joint, T);",
            f"joint.JointAxis = [0 0 {row.sense}];",
        ]
        if limits := bounds(row):
            lines.append(f"joint.PositionLimits = [{limits}];")
        lines += ["body.Joint = joint;", f"addBody(robot, body, {parent});"]
        parent = f"'{plain(row.joint)}_link'"
    lines += [*matrix("T", poses[-1].tolist(), 4), f"body = rigidBody('{plain(table.tip_frame)}_tip');"]
    lines += ["setFixedTransform(body.Joint, T);", f"addBody(robot, body, {parent});", "end"]
    return "\n".join(lines) + "\n"


def write_ets(table: DHTable) -> str:
    """Return a module with `ets`, and `robot` of these transforms; raise InputError for a mimic joint."""
    demand_free(table, "a sequence of elementary transforms")
    lines = docstring(table)
    lines += ["import numpy as np", "import roboticstoolbox as rtb", "from roboticstoolbox import ET", ""]
    lines += ["ets = rtb.ETS(", "    [", *_pose(table.base, always=not table.rows)]
    lines += [
        f"        {', '.join(_row(row, table.convention))},  # {plain(row.joint)}" for row in table.rows
    ]
    lines += [*_pose(table.tool), "    ]", ")", f'robot = rtb.Robot(ets, name="{plain(table.robot)}")']
    return "\n".join(lines) + "\n"


def joint_transform(row: DHRow) -> list[str]:
    """Return roboticstoolbox's arguments for a joint's sense and limits."""
    limits = bounds(row)
    return ["flip=True"] * (row.sense < 0) + ([f"qlim=[{limits}]"] if limits else [])


def _row(row: DHRow, convention: DHConvention) -> list[str]:
    moves = ", ".join(joint_transform(row))
    along = [
        *_unless_zero("Rz", row.theta),
        *([f"ET.Rz({moves})"] * row.kind.turns),
        *_unless_zero("tz", row.d),
    ]
    along += [f"ET.tz({moves})"] * (not row.kind.turns)
    across = [*_unless_zero("tx", row.a), *_unless_zero("Rx", row.alpha), *_unless_zero("Ry", row.beta)]
    return along + across if convention is DHConvention.STANDARD else across + along


def _unless_zero(name: str, value: float) -> list[str]:
    return [f"ET.{name}({value!r})"] if value else []


def _pose(T: FloatArray, *, always: bool = False) -> list[str]:
    if is_identity(T) and not always:
        return []
    return [f"        ET.SE3(np.array([{numbers(T.ravel())}]).reshape(4, 4)),"]


FORMULA = "T(q) = exp([S1] q1) ... exp([Sn] qn) M = M exp([B1] q1) ... exp([Bn] qn), screws (w, v)"


def write_screws(screws: ProductOfExponentials, form: str, digits: int = 10) -> str:
    """Return the screws as "terminal", "markdown", "html", "latex", "toml", "json", "numpy" or "matlab".

    The numbers in TOML, JSON and code are exact.
    """
    if form == "latex":
        return _latex(screws, digits)
    return _CODE[form](screws) if form in _CODE else screws_document(screws, digits).written(form)


def screws_document(screws: ProductOfExponentials, digits: int = 10) -> TextDocument:
    parts: list[str | Table | Matrix] = [CodeLine(FORMULA)]
    heads = ("i", "joint", "w_x", "w_y", "w_z", "v_x", "v_y", "v_z")
    for what, rows in (("space screws S", screws.space), ("body screws B", screws.body)):
        body = [
            (str(i), joint.name, *(six_digits(x, digits=digits) for x in row))
            for i, (joint, row) in enumerate(zip(screws.joints, rows, strict=True), 1)
        ]
        parts += ["", what, Table(heads, body, left=(1,), names=(1,))]
    parts += ["", "M, the tip in the zero configuration (metres):", pose_matrix(screws.M, digits), ""]
    path = f"{screws.robot}: {screws.base_frame} to {screws.tip_frame}"
    return TextDocument(f"{path}, product of exponentials (metres, angular first)", parts)


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


def _numpy(screws: ProductOfExponentials) -> str:
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


def _matlab(screws: ProductOfExponentials) -> str:
    lines = [f"function [M, Slist, Blist] = {identifier(screws.robot)}_screws()"]
    lines += [f"% {plain(screws.robot)}: screws are columns (w; v), metres, as in Modern Robotics"]
    lines += matrix("M", screws.M, 4)
    for name, rows in (("Slist", screws.space), ("Blist", screws.body)):
        lines += [*matrix(name, rows, 6), f"{name} = {name}';"]
    return "\n".join([*lines, "end"]) + "\n"


#: These functions write exact numbers.
_CODE: dict[str, Callable[[ProductOfExponentials], str]] = {
    "toml": lambda screws: "".join(f"{key} = {json.dumps(x)}\n" for key, x in screws.as_mapping().items()),
    "json": lambda screws: json.dumps(screws.as_mapping(), indent=2) + "\n",
    "numpy": _numpy,
    "matlab": _matlab,
}
