"""Code that urdfkin writes runs, and computes what Pinocchio computes; text says what the table says."""

from __future__ import annotations

import importlib.util
import math
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.dh.arms import arm
from tests.oracle import TreeOracle
from tests.random_chains import configurations, rotation, shift
from urdfkin.dh import FORMATS, dh_table, export, table_from_rows, units_of
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.model.tree import FloatArray, KinematicTree, Mimic

EPS = float(np.finfo(np.float64).eps)
LINK = shift(0.3, 0.1, 0.2) @ rotation("x", 1.0) @ rotation("z", 0.4)


def coupled() -> KinematicTree:
    """Turning and sliding joints, a follower, a nearly parallel pair."""
    near = shift(0.3, 0.2, 0.0) @ rotation("x", 1e-4) @ rotation("y", 2e-4)
    tree = arm(LINK, near, LINK, LINK, kinds="RRPR", tip=LINK)
    joints = list(tree.joints)
    follower = joints[3]
    joints[3] = type(follower)(
        follower.name,
        follower.kind,
        follower.parent,
        follower.T_parent_joint,
        follower.axis,
        None,
        Mimic("j1", -0.5, 0.2),
    )
    return KinematicTree(tree.name, tree.links, tuple(joints))


TREES: dict[str, Callable[[], KinematicTree]] = {
    "coupled": coupled,
    "plain": lambda: arm(LINK, LINK, LINK, kinds="RPR", tip=LINK),
    "nothing moves": lambda: arm(tip=LINK),
}


def run_numpy(table: DHTable, q: FloatArray, where: Path) -> FloatArray:
    file = where / "code.py"
    file.write_text(export(table, "numpy"))
    spec = importlib.util.spec_from_file_location("code", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return np.asarray(module.placement(q))


def run_c(table: DHTable, q: FloatArray, where: Path) -> FloatArray:
    compiler = shutil.which("cc") or pytest.skip("no C compiler")
    main = f"""
    #include <stdio.h>
    int main(void) {{
        double q[{max(q.shape[1], 1)}], T[16];
        for (int s = 0; s < {len(q)}; ++s) {{
            for (int k = 0; k < {q.shape[1]}; ++k) if (scanf("%lf", &q[k]) != 1) return 1;
            arm_placement(q, T);
            for (int i = 0; i < 16; ++i) printf("%.17g\\n", T[i]);
        }}
        return 0;
    }}"""
    (where / "code.c").write_text(export(table, "c") + main)
    strict = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror"]
    subprocess.run([compiler, *strict, "code.c", "-o", "code", "-lm"], cwd=where, check=True)
    numbers = "\n".join(repr(float(x)) for x in q.ravel())
    done = subprocess.run([str(where / "code")], input=numbers, capture_output=True, text=True, check=True)
    return np.array(done.stdout.split(), dtype=float).reshape(-1, 4, 4)


def run_roboticstoolbox(table: DHTable, q: FloatArray, where: Path) -> FloatArray:
    pytest.importorskip("roboticstoolbox", exc_type=ImportError)
    file = where / "code.py"
    file.write_text(export(table, "roboticstoolbox"))
    scope: dict[str, object] = {}
    exec(file.read_text(), scope)
    robot = scope["robot"]
    return np.array([robot.fkine(one).A for one in q])  # type: ignore[attr-defined]


def run_octave(table: DHTable, q: FloatArray, where: Path) -> FloatArray:
    octave = shutil.which("octave-cli") or pytest.skip("no Octave")
    (where / "arm_placement.m").write_text(export(table, "matlab"))
    calls = "".join(
        f"printf('%.17g\\n', arm_placement([{', '.join(map(repr, one.tolist()))}])');" for one in q
    )
    done = subprocess.run([octave, "--eval", calls], cwd=where, capture_output=True, text=True, check=True)
    return np.array(done.stdout.split(), dtype=float).reshape(-1, 4, 4)


def check(
    run: Callable[[DHTable, FloatArray, Path], FloatArray], tree: KinematicTree, convention: str, where: Path
) -> None:
    table = dh_table(tree, "tip", convention=convention)
    q = configurations(tree.nq, 5)
    theirs = TreeOracle(tree).placement(q, "tip", "l0")
    found = run(table, q, where)
    assert found.shape == theirs.shape
    assert np.abs(found - theirs).max() <= 300 * EPS * (1 + table.span)


@pytest.mark.slow
@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("name", TREES)
@pytest.mark.parametrize("run", [run_numpy, run_c, run_octave])
def test_written_code_computes_what_pinocchio_computes(
    run: Callable[[DHTable, FloatArray, Path], FloatArray], name: str, convention: str, tmp_path: Path
) -> None:
    check(run, TREES[name](), convention, tmp_path)


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_code_for_roboticstoolbox_computes_what_pinocchio_computes(convention: str, tmp_path: Path) -> None:
    check(run_roboticstoolbox, TREES["plain"](), convention, tmp_path)


def test_a_flipped_joint_reaches_the_written_code(tmp_path: Path) -> None:
    tree = TREES["plain"]()
    table, q = dh_table(tree, "tip", flip=["j2", "j3"]), configurations(3, 4)
    theirs = TreeOracle(tree).placement(q, "tip", "l0")
    for run in (run_numpy, run_c):
        np.testing.assert_allclose(run(table, q, tmp_path), theirs, atol=1e-14)


def test_roboticstoolbox_is_told_what_it_cannot_hold() -> None:
    with pytest.raises(InputError, match="fifth parameter"):
        export(dh_table(coupled(), "tip"), "roboticstoolbox")
    with pytest.raises(InputError, match="follows another"):
        export(dh_table(coupled(), "tip", near_parallel="strict"), "roboticstoolbox")


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_every_form_names_its_convention(form: str, convention: str) -> None:
    text = export(dh_table(TREES["plain"](), "tip", convention=convention), form)
    other = "modified" if convention == "standard" else "standard"
    assert convention in text or form == "matlab-rst"
    assert other not in text
    assert text.endswith("\n")


def test_an_unknown_form_offers_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="did you mean markdown"):
        export(dh_table(TREES["plain"](), "tip"), "markdwon")


PLAIN = table_from_rows(
    [[0, 90, 0.3, 0], [0.4, 0, 0, -90], [0, 180, 0.1, 0, "P"]], "standard", angles="degrees"
)


def test_the_terminal_table_reads_as_one_writes_it() -> None:
    text = export(PLAIN, "terminal", units_of("degrees", "millimetres"))
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


def test_the_latex_table_has_its_convention_in_the_caption_and_escapes_names() -> None:
    text = export(PLAIN, "latex")
    assert "standard convention" in text
    assert r"\toprule" in text
    assert r"joint\_2 & $0.4$ & $0$ & $0$ & $q_{2} - \pi/2$ \\" in text
    assert r"R_z(\theta_i)\,T_z(d_i)\,T_x(a_i)\,R_x(\alpha_i)" in text


def test_followers_are_written_in_terms_of_their_leader() -> None:
    text = export(dh_table(coupled(), "tip"), "terminal")
    assert "-0.5 q1 " in text
    assert "with q1 = j1, q2 = j2, q3 = j3" in text
    assert "beta [rad]" in text


def test_what_was_snapped_is_said_with_the_rows() -> None:
    tree = arm(np.eye(4), rotation("x", 1.5708) @ shift(0.3, 0, 0), tip=shift(0.2, 0, 0))
    text = export(dh_table(tree, "tip", snap=1e-4), "terminal")
    assert "row 1: origin of j2, turned 3.67e-06 rad, tip at most 7.35e-07 m" in text
    assert math.isclose(3.6732e-06 * 0.2, 7.3464e-07)
