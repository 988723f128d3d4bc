"""Run tables exported as code, and return the poses that the code computes.

A format without its interpreter or library raises `Missing`.
"""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
import subprocess
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scripts.forms import poses
from urdfkin.dh import DHTable, export, read_table, to_urdf
from urdfkin.dh.convert import link_names, to_tree
from urdfkin.dh.export.code import plain
from urdfkin.export import LANGUAGES
from urdfkin.model.configuration import coordinate_names
from urdfkin.model.tree import FloatArray
from urdfkin.robot.loading import load
from urdfkin.urdf.lint import UrdfWarning

_STRICT = ("-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror")
_MAIN = """
#include <stdio.h>
int main(void) {{
    double q[{length}], T[16];
    for (int s = 0; s < {count}; ++s) {{
        for (int k = 0; k < {n}; ++k) if (scanf("%lf", &q[k]) != 1) return 1;
        {name}_placement(q, T);
        for (int i = 0; i < 16; ++i) printf("%.17g\\n", T[i]);
    }}
    return 0;
}}"""
_PACKAGE = "try, pkg load symbolic, catch, disp('missing'), exit(0), end"
_DOCUMENT = r"""\documentclass{article}
\usepackage{amsmath,booktabs,graphicx}
\usepackage[utf8]{inputenc}
\begin{document}
"""


class Missing(Exception):  # noqa: N818  not an error: the run continues
    """Error if an interpreter or library of a format is not installed."""


@dataclass(frozen=True, slots=True)
class Job:
    """A table, and configurations (n, coordinates) of the table's coordinates."""

    table: DHTable
    q: FloatArray

    def given(self, form: str) -> list[list[float]]:
        """Return the configurations in the order of the coordinates of the exported code."""
        if form not in LANGUAGES or form == "sympy":
            return list(self.q.tolist())
        names = coordinate_names(to_tree(self.table))
        return list(self.q[:, [self.table.joint_names.index(name) for name in names]].tolist())


Poses = list[FloatArray]
Run = Callable[[Sequence[Job], Path], Poses]


def in_python(form: str) -> Run:
    """Run the Python formats in this interpreter."""

    def run(jobs: Sequence[Job], folder: Path) -> Poses:
        library = form if form != "ets" else "roboticstoolbox"
        if importlib.util.find_spec(library) is None:
            raise Missing(library)
        return [np.array(poses.poses(form, export(job.table, form), job.given(form))) for job in jobs]

    return run


def elsewhere(form: str, interpreter: str) -> Run:
    """Run the Python formats in another interpreter."""

    def run(jobs: Sequence[Job], folder: Path) -> Poses:
        given, found = folder / "jobs.json", folder / "poses.json"
        data = [{"form": form, "text": export(job.table, form), "q": job.q.tolist()} for job in jobs]
        given.write_text(json.dumps(data), "utf-8")
        subprocess.run([interpreter, poses.__file__, str(given), str(found)], check=True)
        return [np.array(one) for one in json.loads(found.read_text("utf-8"))]

    return run


def in_c(jobs: Sequence[Job], folder: Path) -> Poses:
    """Compile and run the C format, with warnings as errors."""
    compiler, found = _program("cc"), Poses()
    for job in jobs:
        n = job.q.shape[1]
        text = export(job.table, "c")
        name = re.findall(r"^void (\w+)_placement\(", text, re.MULTILINE)[0]
        main = _MAIN.format(length=max(n, 1), n=n, count=len(job.q), name=name)
        (folder / "code.c").write_text(text + main, "utf-8")
        subprocess.run([compiler, *_STRICT, "code.c", "-o", "code", "-lm"], cwd=folder, check=True)
        numbers = "\n".join(repr(x) for row in job.given("c") for x in row)
        done = subprocess.run(
            [str(folder / "code")], input=numbers, capture_output=True, text=True, check=True
        )
        found.append(_read(done.stdout))
    return found


def in_octave(form: str, lines_of: Callable[[str, Job], list[str]], first: str = "") -> Run:
    """Run MATLAB's formats in Octave, all tables in one process.

    Args:
        form: Name of the format.
        lines_of: Returns the statements that print the poses of a table, given its function.
        first: Statements before all others.
    """

    def run(jobs: Sequence[Job], folder: Path) -> Poses:
        octave, lines = _program("octave-cli"), [first]
        for k, job in enumerate(jobs):
            text = export(replace(job.table, robot=f"t{k}"), form)
            name = re.findall(r"^function .*= (\w+)\(", text, re.MULTILINE)[0]
            (folder / f"{name}.m").write_text(text, "utf-8")
            lines += [*lines_of(name, job), "printf('end\\n');"]
        (folder / "tables.m").write_text("\n".join(lines), "utf-8")
        command = [octave, "--no-init-file", "--quiet", "tables.m"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
        if done.stdout.startswith("missing"):
            raise Missing("Octave's package symbolic")
        # Octave's package also prints the version of Python that it found.
        parts = (re.sub(r".*[a-df-z].*\n", "", part) for part in done.stdout.split("end\n")[:-1])
        return [_read(part) for part in parts]

    return run


def _printed(value: str) -> str:
    return f"printf('%.17g\\n', ({value})');"


def _plainly(name: str, job: Job) -> list[str]:
    numbers = ("; ".join(map(repr, q)) for q in job.given("matlab"))
    return [f"f = {name}();", *(_printed(f"f.placement([{q}])") for q in numbers)]


def _symbolically(name: str, job: Job) -> list[str]:
    exact = ("; ".join(f"vpa('{x!r}')" for x in q) for q in job.q.tolist())
    return [f"[T, q] = {name}();", *(_printed(f"double(subs(T, q, [{q}]))") for q in exact)]


def _as_bodies(name: str, job: Job) -> list[str]:
    tip = f"{plain(job.table.tip_frame)}_tip"
    numbers = (", ".join(map(repr, q)) for q in job.q.tolist())
    return [f"robot = {name}();", *(_printed(f"getTransform(robot, [{q}], '{tip}')") for q in numbers)]


def read_back(form: str) -> Run:
    """Read exported tables back from the formats that urdfkin reads without loss."""

    def run(jobs: Sequence[Job], folder: Path) -> Poses:
        found, file = Poses(), folder / f"table.{form}"
        for job in jobs:
            file.write_text(export(job.table, form), "utf-8")
            found.append(read_table(file).placement(job.q))
        return found

    return run


def as_urdf(jobs: Sequence[Job], folder: Path) -> Poses:
    """Load the URDF of a table and compute its poses."""
    found = Poses()
    for job in jobs:
        base, *_, tip = link_names(job.table)
        with warnings.catch_warnings():  # the robot's own limits and axes cause warnings
            warnings.simplefilter("ignore", UrdfWarning)
            path = load(to_urdf(job.table), verify=False).chain(tip, base)
        order = [job.table.joint_names.index(name) for name in path.joint_names]
        found.append(path.placement(job.q[:, order]))
    return found


RUN: dict[str, Run] = {
    **{form: in_python(form) for form in ("numpy", "sympy", "casadi", "roboticstoolbox", "ets")},
    "c": in_c,
    "matlab": in_octave("matlab", _plainly),
    "matlab-symbolic": in_octave("matlab-symbolic", _symbolically, _PACKAGE),
    # Octave uses substitutes for the toolbox's classes; this format has not been run in MATLAB.
    "matlab-rst": in_octave("matlab-rst", _as_bodies, f"addpath('{Path(__file__).parent / 'octave'}');"),
    **{form: read_back(form) for form in ("toml", "json", "csv")},
    "urdf": as_urdf,
}


def too_wide(tables: Sequence[str], folder: Path) -> list[float]:
    """Return the excess width of each LaTeX table on the page of an `article`, in points; 0 if it fits."""
    latex = _program("pdflatex")
    marked = (f"\\typeout{{table {k}}}\n{table}\n\\clearpage\n" for k, table in enumerate(tables))
    (folder / "tables.tex").write_text(_DOCUMENT + "".join(marked) + "\\end{document}\n", "utf-8")
    command = [latex, "-interaction=nonstopmode", "-halt-on-error", "tables.tex"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace", check=False)
    if done.returncode:
        raise RuntimeError(next(line for line in done.stdout.splitlines() if line.startswith("!")))
    log = (folder / "tables.log").read_text("utf-8", errors="replace")
    parts = re.split(r"^table \d+$", log, flags=re.MULTILINE)[1:]
    over = (re.findall(r"Overfull \\hbox \((\S+)pt too wide\)", part) for part in parts)
    return [max(map(float, found), default=0.0) for found in over]


def _program(name: str) -> str:
    if (found := shutil.which(name)) is None:
        raise Missing(name)
    return found


def _read(text: str) -> FloatArray:
    return np.array(text.split(), dtype=np.float64).reshape(-1, 4, 4)
