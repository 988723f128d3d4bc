"""Exported code runs and agrees with Pinocchio; exported text and drawings show the table."""

import itertools
import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scripts.check_forms import RUN, Job, MissingProgramError
from tests.comparison.pairs import with_joint
from tests.dh.arms import CONVENTIONS, EPS, arm
from tests.oracle import TreeOracle
from tests.random_chains import configurations, rotation, shift
from urdfkin.dh import FORMATS, export, make_dh_table, parse_units, table_from_rows
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.model.tree import KinematicTree, Mimic
from urdfkin.view.dh_drawing import draw_table_svg, row_corners

LINK = shift(0.3, 0.1, 0.2) @ rotation("x", 1.0) @ rotation("z", 0.4)
NEAR = shift(0.3, 0.2, 0.0) @ rotation("x", 1e-4) @ rotation("y", 2e-4)


def coupled() -> KinematicTree:
    """Return an arm with revolute and prismatic joints, a mimic joint, and nearly parallel axes."""
    tree = arm(LINK, NEAR, LINK, LINK, kinds="RRPR", tip=LINK)
    return with_joint(tree, 3, replace(tree.joints[3], mimic=Mimic("j1", -0.5, 0.2)))


PLAIN_ARM = arm(LINK, LINK, LINK, kinds="RPR", tip=LINK)
TREES = {
    "coupled": coupled(),
    "plain": PLAIN_ARM,
    "nearly parallel": arm(LINK, NEAR, LINK, tip=LINK),  # one row of its table has a fifth parameter
    "nothing moves": arm(tip=LINK),
}
#: Formats that contain code, and the trees whose code is run.
CODE = [
    *itertools.product(("numpy", "c", "matlab", "sympy", "casadi"), ("coupled", "plain", "nothing moves")),
    *itertools.product(("roboticstoolbox", "ets"), ("plain", "nearly parallel")),
    ("matlab-rst", "plain"),
]


def check(
    form: str, tree: KinematicTree, convention: str, where: Path, samples: int = 5, **options: Any
) -> None:
    table = make_dh_table(tree, "tip", convention=convention, **options)
    q = configurations(tree.nq, samples)
    theirs = TreeOracle(tree).placement(q, "tip", "l0")
    try:
        (found,) = RUN[form]([Job(table, q)], where)
    except MissingProgramError as error:
        pytest.skip(f"{error} is missing")
    assert found.shape == theirs.shape
    assert np.abs(found - theirs).max() <= 300 * EPS * (1 + table.span)


@pytest.mark.slow
@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize(("form", "name"), CODE)
def test_exported_code_agrees_with_pinocchio(form: str, name: str, convention: str, tmp_path: Path) -> None:
    check(form, TREES[name], convention, tmp_path, flip=["j2", "j3"] if name == "plain" else [])


@pytest.mark.slow
def test_symbolic_matlab_code_agrees_with_pinocchio(tmp_path: Path) -> None:
    check("matlab-symbolic", arm(rotation("x", math.pi / 2) @ shift(0.3, 0.1, 0)), "standard", tmp_path, 1)


@pytest.mark.parametrize("form", ["roboticstoolbox", "ets", "matlab-rst"])
def test_a_format_without_mimic_joints_refuses_mimic_joints(form: str) -> None:
    with pytest.raises(InputError, match="does not support mimic joints"):
        export(make_dh_table(TREES["coupled"], "tip"), form)


def test_beta_is_exported_as_a_separate_transform_and_limits_are_exported() -> None:
    text = export(make_dh_table(TREES["nearly parallel"], "tip"), "roboticstoolbox")
    assert "ET.Ry(" in text
    assert "DHRobot" not in text
    assert "rtb.DHRobot(" in export(make_dh_table(PLAIN_ARM, "tip"), "roboticstoolbox")
    row = {"a": 1, "alpha": 0, "d": 0, "theta": 0, "limit": {"lower": -1.5, "upper": 2.5}}
    limited = table_from_rows([row, [1, 0, 0, 0]], "standard")
    for form in ("roboticstoolbox", "ets"):
        assert export(limited, form).count("qlim=[-1.5, 2.5]") == export(limited, form).count("qlim") == 1


def test_symbolic_code_contains_short_decimal_numbers_as_rationals() -> None:
    rows = [[0.425, 90, 0, 0], [1.0 / 3.0, 15, -0.1, -75], [0, 1e-7, 2, 0, "P"]]
    table = table_from_rows(rows, "standard", angles="degrees")
    lines = export(table, "sympy").splitlines()
    first = lines.index("    return [")
    assert [line.strip() for line in lines[first + 1 : first + 4]] == [
        "(Rational(17, 40), pi/2, 0, q1),",
        "(0.3333333333333333, pi/12, -Rational(1, 10), q2 - 5*pi/12),",
        f"(0, {math.radians(1e-7)!r}, q3 + 2, 0),",
    ]
    matlab = export(table, "matlab-symbolic")
    assert "sym(17)/40, sym(pi)/2, 0, q1\n" in matlab
    assert "vpa('0.3333333333333333'), sym(pi)/12, -sym(1)/10, q2 - 5*sym(pi)/12\n" in matlab


@pytest.mark.slow
def test_the_sympy_placement_of_a_table_is_exact() -> None:
    sympy = pytest.importorskip("sympy")
    scope: dict[str, Any] = {}
    exec(export(PLAIN, "sympy"), scope)
    q1, q2, q3 = sympy.symbols("q1:4")
    T = scope["placement"]([q1, q2, q3])
    assert sympy.simplify(T[2, 3] - sympy.Rational(3, 10) + sympy.Rational(2, 5) * sympy.cos(q2)) == 0


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_every_format_names_the_convention_of_the_table(form: str, convention: str) -> None:
    text = export(make_dh_table(PLAIN_ARM, "tip", convention=convention), form)
    other = "modified" if convention == "standard" else "standard"
    assert convention in text or form == "matlab-rst"
    assert other not in text
    assert text.endswith("\n")


def test_an_unknown_format_lists_similar_names() -> None:
    with pytest.raises(UnknownNameError, match="did you mean markdown"):
        export(make_dh_table(PLAIN_ARM, "tip"), "markdwon")


ROWS = [[0, 90, 0.3, 0], [0.4, 0, 0, -90], [0, 180, 0.1, 0, "P"]]
PLAIN = table_from_rows(ROWS, "standard", angles="degrees")


def test_the_terminal_table_has_the_documented_layout() -> None:
    text = export(PLAIN, "terminal", parse_units("degrees", "millimetres"))
    assert text.splitlines() == [
        "robot: base to tip, standard Denavit-Hartenberg parameters",
        "T(i-1, i) = Rz(theta) Tz(d) Tx(a) Rx(alpha)",
        "",
        "i  joint    a [mm]  alpha [deg]    d [mm]  theta [deg]",
        "------------------------------------------------------",
        "1  joint_1       0           90       300           q1",
        "2  joint_2     400            0         0      q2 - 90",
        "3  joint_3       0          180  q3 + 100            0",
        "",
        "base: the identity",
        "tool: the identity",
    ]


@pytest.mark.parametrize("form", ["terminal", "markdown", "html", "latex"])
def test_a_table_in_other_units_states_the_unit_of_the_factor_of_a_sliding_mimic_joint(form: str) -> None:
    rule = {"mimicked_joint": "a", "multiplier": 0.02}
    tables = [
        table_from_rows([{"joint": "a"}, {"joint": "b", "kind": kind, "mimic": rule}], "standard")
        for kind in ("P", "R")
    ]
    units = parse_units("degrees", "millimetres"), parse_units()
    stated = ["the factors of q are in metres" in export(table, form, u) for table in tables for u in units]
    assert stated == [True, False, False, False]


def test_matlabs_bodies_and_joints_have_different_names_if_the_names_are_not_ascii() -> None:
    rows = [{"joint": "\u03b1"}, {"joint": "\u03b8"}]
    text = export(table_from_rows(rows, "standard", base_frame="__link", tip_frame="_"), "matlab-rst")
    for pattern in (r"(?:BaseName = |rigidBody\()'(.*?)'", r"rigidBodyJoint\('(.*?)'"):
        names = re.findall(pattern, text)
        assert len(names) == len(set(names)) >= 2


def test_the_latex_table_states_the_convention_in_the_caption_and_escapes_names() -> None:
    text = export(PLAIN, "latex")
    assert "standard convention" in text
    assert r"\toprule" in text
    assert r"joint\_2 & $0.4$ & $0$ & $0$ & $q_{2} - \pi/2$ \\" in text
    assert r"R_z(\theta_i)\,T_z(d_i)\,T_x(a_i)\,R_x(\alpha_i)" in text


def test_mimic_joints_are_written_as_expressions_of_the_mimicked_joint() -> None:
    text = export(make_dh_table(TREES["coupled"], "tip"), "terminal")
    assert "-0.5 q1 " in text
    assert "with q1 = j1, q2 = j2, q3 = j3" in text
    assert "beta [rad]" in text


def test_snapped_values_are_listed_with_rows_and_effect() -> None:
    tree = arm(np.eye(4), rotation("x", 1.5708) @ shift(0.3, 0, 0), tip=shift(0.2, 0, 0))
    text = export(make_dh_table(tree, "tip", snap=1e-4), "terminal")
    assert "row 1: origin of j2, turned by 3.67e-06 rad, tip moves by at most 7.35e-07 m" in text
    assert math.isclose(3.6732e-06 * 0.2, 7.3464e-07)


# -- drawings ------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_a_drawing_is_an_svg_with_every_frame_and_joint(convention: str) -> None:
    pytest.importorskip("matplotlib")
    root = ET.fromstring(draw_table_svg(make_dh_table(PLAIN_ARM, "tip", convention=convention)))
    assert root.tag.endswith("svg")
    written = "".join("".join(node.itertext()) for node in root.iter() if node.tag.endswith("text"))
    for name in ("j1", "j2", "j3", "tip", f"{convention} Denavit-Hartenberg frames"):
        assert name in written
    assert written.count("x") >= 4
    assert written.count("z") >= 4
    backgrounds = [node for node in root.iter() if "opacity: 0.75" in node.get("style", "")]
    assert len(backgrounds) >= 7, "a label is legible above a line"


@pytest.mark.slow
def test_equal_tables_give_equal_drawings() -> None:
    pytest.importorskip("matplotlib")
    table = make_dh_table(arm(LINK, LINK), "tip")
    assert draw_table_svg(table) == draw_table_svg(table)
    assert draw_table_svg(table) != draw_table_svg(table, [0.5, 0.5])


def test_a_chain_without_motion_can_be_drawn_and_a_batch_cannot() -> None:
    pytest.importorskip("matplotlib")
    assert "<svg" in draw_table_svg(make_dh_table(TREES["nothing moves"], "tip"))
    with pytest.raises(InputError, match="needs exactly one configuration"):
        draw_table_svg(make_dh_table(arm(LINK), "tip"), np.zeros((2, 1)))


@pytest.mark.parametrize(("convention", "beta"), [("standard", 0.0), ("standard", 0.3), ("modified", 0.0)])
def test_the_two_lines_of_a_row_lie_on_the_joint_axis_and_on_the_common_normal(
    convention: str, beta: float
) -> None:
    table = make_dh_table(arm(LINK, LINK), "tip", convention=convention)
    table = replace(table, rows=tuple(replace(row, beta=beta) for row in table.rows))
    frames = table.frames([0.5, -0.7])
    corners, standard = row_corners(table, frames), convention == "standard"
    starts, ends = frames[:-1, :3, 3], frames[1:, :3, 3]
    z = (frames[:-1] if standard else frames[1:])[:, :3, 2]
    along, across = (corners - starts, ends - corners) if standard else (ends - corners, corners - starts)
    np.testing.assert_allclose(np.cross(along, z), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(across, axis=1), [abs(row.a) for row in table.rows], atol=1e-12)
