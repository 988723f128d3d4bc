"""Export example-robot-data's tables in every format, run the exported code, and compare it with Pinocchio.

    python scripts/check_forms.py                      # the tip of every robot, standard and modified
    python scripts/check_forms.py --leaves             # every leaf of every robot
    python scripts/check_forms.py --toolbox PYTHON     # another interpreter, with roboticstoolbox
    python scripts/check_forms.py --forms sympy latex  # some formats only

LaTeX tables are compiled and must fit on the page of an article. The code of a format is not run if its
interpreter or library is missing. Exit 1: results of a format differ by more than rounding, or a LaTeX table
is too wide.
"""

import argparse
import ctypes
import importlib.util
import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

import urdfkin
from scripts.forms import poses
from scripts.pages import table as markdown
from urdfkin.dh import FORMATS, DHTable, export, read_table, to_urdf
from urdfkin.dh.convert import link_names, to_tree
from urdfkin.dh.export.code import sanitize
from urdfkin.errors import InputError
from urdfkin.export import LANGUAGES
from urdfkin.kinematics.roundings import EPS, table_roundings
from urdfkin.model.configuration import coordinate_names, sample
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import example_robot_data_names
from urdfkin.verify.oracle import QueryBatch

SAMPLES = 4
#: Maximum numbers of tables, and of rows per table, for the format `matlab-symbolic`, because Octave's
#: symbolic package takes 20 s for six joints.
MAX_SYMBOLIC_TABLES, MAX_SYMBOLIC_ROWS = 6, 4
_STRICT = ("-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror")
#: First line of the Octave program, for each format.
_FIRST = {
    "matlab-symbolic": "try, pkg load symbolic, catch, disp('missing'), exit(0), end",
    "matlab-rst": f"addpath('{Path(__file__).parent / 'forms' / 'octave'}');",
}
_DOCUMENT = r"""\documentclass{article}
\usepackage{amsmath,booktabs,graphicx}
\usepackage[utf8]{inputenc}
\begin{document}
"""


class MissingProgramError(Exception):
    """An interpreter or a library is missing."""


@dataclass(frozen=True, slots=True)
class Job:
    table: DHTable
    q: FloatArray

    def coordinates(self, form: str) -> list[list[float]]:
        if form not in LANGUAGES or form == "sympy":
            return list(self.q.tolist())
        names = coordinate_names(to_tree(self.table))
        return list(self.q[:, [self.table.joint_names.index(name) for name in names]].tolist())


Poses = list[FloatArray]
#: A function that runs the code of all jobs, and returns the poses of each job. The function may write into
#: the folder.
Run = Callable[[Sequence[Job], Path], Poses]


def run_in_python(form: str, jobs: Sequence[Job], folder: Path) -> Poses:
    library = form if form != "ets" else "roboticstoolbox"
    if importlib.util.find_spec(library) is None:
        raise MissingProgramError(library)
    return [
        np.array(poses.compute_poses(form, export(job.table, form), job.coordinates(form))) for job in jobs
    ]


def run_in_other_python(form: str, interpreter: str, jobs: Sequence[Job], folder: Path) -> Poses:
    jobs_file, poses_file = folder / "jobs.json", folder / "poses.json"
    data = [{"form": form, "text": export(job.table, form), "q": job.q.tolist()} for job in jobs]
    jobs_file.write_text(json.dumps(data), "utf-8")
    subprocess.run([interpreter, poses.__file__, str(jobs_file), str(poses_file)], check=True)
    return [np.array(one) for one in json.loads(poses_file.read_text("utf-8"))]


def run_in_c(jobs: Sequence[Job], folder: Path) -> Poses:
    compiler, results = _find_program("cc"), Poses()
    for k, job in enumerate(jobs):
        text, library = export(job.table, "c"), folder / f"code{k}.so"
        name = re.findall(r"^void (\w+_placement)\(", text, re.MULTILINE)[0]
        (folder / "code.c").write_text(text, "utf-8")
        command = [compiler, *_STRICT, "-shared", "-fPIC", "code.c", "-o", str(library), "-lm"]
        subprocess.run(command, cwd=folder, check=True)
        function = ctypes.CDLL(str(library))[name]
        configurations, T = np.array(job.coordinates("c")), np.empty((len(job.q), 4, 4))
        for q, out in zip(configurations, T, strict=True):
            function(ctypes.c_void_p(q.ctypes.data), ctypes.c_void_p(out.ctypes.data))
        results.append(T)
    return results


def run_in_octave(form: str, jobs: Sequence[Job], folder: Path) -> Poses:
    octave, lines = _find_program("octave-cli"), [_FIRST.get(form, "")]
    for k, job in enumerate(jobs):
        text = export(replace(job.table, robot=f"t{k}"), form)
        name = re.findall(r"^function .*= (\w+)\(", text, re.MULTILINE)[0]
        (folder / f"{name}.m").write_text(text, "utf-8")
        lines.append(f"{'[f, x]' if form == 'matlab-symbolic' else 'f'} = {name}();")
        for q in job.coordinates(form):
            numbers, tip = "; ".join(map(repr, q)), f"{sanitize(job.table.tip_frame)}_tip"
            exact = "; ".join(f"vpa('{x!r}')" for x in q)
            value = {
                "matlab": f"f.placement([{numbers}])",
                "matlab-symbolic": f"double(subs(f, x, [{exact}]))",
                "matlab-rst": f"getTransform(f, [{numbers}]', '{tip}')",
            }[form]
            lines.append(f"printf('%.17g\\n', ({value})');")
        lines.append("printf('end\\n');")
    (folder / "tables.m").write_text("\n".join(lines), "utf-8")
    command = [octave, "--no-init-file", "--quiet", "tables.m"]
    process = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    if process.stdout.startswith("missing"):
        raise MissingProgramError("Octave's package symbolic")
    # Octave's package `symbolic` also prints the version of Python; `re.sub` removes this line.
    parts = (re.sub(r".*[a-df-z].*\n", "", part) for part in process.stdout.split("end\n")[:-1])
    return [np.array(part.split(), dtype=np.float64).reshape(-1, 4, 4) for part in parts]


def read_written_table(form: str, jobs: Sequence[Job], folder: Path) -> Poses:
    found, file = Poses(), folder / f"table.{form}"
    for job in jobs:
        file.write_text(export(job.table, form), "utf-8")
        found.append(read_table(file).placement(job.q))
    return found


def load_as_urdf(jobs: Sequence[Job], folder: Path) -> Poses:
    found = Poses()
    for job in jobs:
        base, *_, tip = link_names(job.table)
        with warnings.catch_warnings():  # hide warnings about the robot's limits and axes
            warnings.simplefilter("ignore", urdfkin.UrdfWarning)
            path = urdfkin.load(to_urdf(job.table), verify=False).chain(tip, base)
        order = [job.table.joint_names.index(name) for name in path.joint_names]
        found.append(path.placement(job.q[:, order]))
    return found


RUN: dict[str, Run] = {
    **{form: partial(run_in_python, form) for form in ("numpy", "sympy", "casadi", "roboticstoolbox", "ets")},
    "c": run_in_c,
    # Octave runs `matlab-rst` with substitutes for the classes of MATLAB's Robotics System Toolbox. This
    # format has not been run in MATLAB.
    **{form: partial(run_in_octave, form) for form in ("matlab", "matlab-symbolic", "matlab-rst")},
    **{form: partial(read_written_table, form) for form in ("toml", "json", "csv")},
    "urdf": load_as_urdf,
}


def measure_excess_widths(tables: Sequence[str], folder: Path) -> list[float]:
    """Return each table's excess over the width of the text (points); 0 if the table fits."""
    latex = _find_program("pdflatex")
    marked_tables = (f"\\typeout{{table {k}}}\n{table}\n\\clearpage\n" for k, table in enumerate(tables))
    (folder / "tables.tex").write_text(_DOCUMENT + "".join(marked_tables) + "\\end{document}\n", "utf-8")
    command = [latex, "-interaction=nonstopmode", "-halt-on-error", "tables.tex"]
    process = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, errors="replace", check=False
    )
    if process.returncode:
        raise RuntimeError(next(line for line in process.stdout.splitlines() if line.startswith("!")))
    log = (folder / "tables.log").read_text("utf-8", errors="replace")
    parts = re.split(r"^table \d+$", log, flags=re.MULTILINE)[1:]
    excesses = (re.findall(r"Overfull \\hbox \((\S+)pt too wide\)", part) for part in parts)
    return [max(map(float, widths), default=0.0) for widths in excesses]


def _find_program(name: str) -> str:
    if (found := shutil.which(name)) is None:
        raise MissingProgramError(name)
    return found


@dataclass(frozen=True, slots=True)
class Case:
    """A Denavit-Hartenberg table with poses from Pinocchio."""

    name: str
    job: Job
    pinocchio_poses: FloatArray  # tip poses relative to the table's base

    @property
    def table(self) -> DHTable:
        return self.job.table

    def measure_errors(self, found: FloatArray) -> tuple[float, float]:
        """Compare the poses from a table's exported code with Pinocchio and with urdfkin.

        Returns:
            Largest difference from Pinocchio's position (m).
            Largest difference from urdfkin's pose, divided by the bound.
        """
        apart = np.abs(found - self.table.placement(self.job.q))[:, :3].max(axis=(-1, -2))
        # `rounding` is 0 for a table without lengths, but sine and cosine have rounding errors, so `allowed`
        # must not be 0.
        allowed = 2.0 * np.maximum(
            self.table.rounding(self.job.q), EPS * table_roundings(len(self.table.rows))
        )
        return float(np.abs(found - self.pinocchio_poses)[:, :3, 3].max()), float((apart / allowed).max())


def make_cases(leaves: bool) -> Iterator[Case]:
    for name in example_robot_data_names():
        robot = urdfkin.load(name)
        tips = [robot.tree.frame_name(leaf) for leaf in robot.tree.leaves()] if leaves else [robot.tip_frame]
        for tip in tips:
            for convention in ("standard", "modified"):
                yield make_case(robot, f"{name} {tip} {convention}", robot.dh(tip, convention=convention))


def make_case(robot: Robot, name: str, table: DHTable) -> Case:
    q = sample(robot.tree, SAMPLES, np.random.default_rng(0))
    ends = [table.base_frame, table.tip_frame]
    base, tip = np.moveaxis(robot.verifier.oracle().placements(QueryBatch(ends, (q,))), 1, 0)
    return Case(name, Job(table, table.coupling.select(robot.tree, q)), np.linalg.inv(base) @ tip)


def can_represent(form: str, table: DHTable) -> bool:
    if form in LANGUAGES:
        return True
    try:
        export(table, form)
    except InputError:
        return False
    return True


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument(
        "--leaves", action="store_true", help="check every leaf link of each robot, not only its default tip"
    )
    parser.add_argument("--toolbox", metavar="PYTHON", help="Python interpreter that has roboticstoolbox")
    forms = (*RUN, "latex")
    parser.add_argument("--forms", nargs="+", choices=forms, default=forms, metavar="FORM")
    options = parser.parse_args(words)
    warnings.simplefilter("ignore", urdfkin.UrdfWarning)
    if options.toolbox:
        RUN.update(
            {form: partial(run_in_other_python, form, options.toolbox) for form in ("roboticstoolbox", "ets")}
        )
    cases = list(make_cases(options.leaves))
    heads = ("form", "tables", "refused", "from Pinocchio at most", "of the bound", "seconds")
    print(markdown(heads, [], left=1), flush=True)
    wrong = 0
    for form in options.forms:
        begin = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            try:
                cells, faults = (_check_widths if form == "latex" else _compare_form)(
                    form, cases, Path(folder)
                )
            except MissingProgramError as error:
                cells, faults = [f"not run: {error} is missing", "", "", ""], []
        print(f"| {form} | {' | '.join(cells)} | {time.perf_counter() - begin:.0f} |", flush=True)
        print(*(f"WRONG {form}: {fault}" for fault in faults), sep="\n", end="\n" * bool(faults), flush=True)
        wrong += len(faults)
    return int(wrong > 0)


def _compare_form(form: str, cases: Sequence[Case], folder: Path) -> tuple[list[str], list[str]]:
    selected = [case for case in cases if form not in FORMATS or can_represent(form, case.table)]
    if form == "matlab-symbolic":
        selected = [case for case in selected if 0 < len(case.table.rows) <= MAX_SYMBOLIC_ROWS]
        selected = selected[:MAX_SYMBOLIC_TABLES]
    figures = [
        case.measure_errors(pose)
        for case, pose in zip(selected, RUN[form]([case.job for case in selected], folder), strict=True)
    ]
    wrong = [case.name for case, (_, share) in zip(selected, figures, strict=True) if not share <= 1.0]
    metres, share = map(max, zip(*figures, strict=True))
    return [str(len(selected)), str(len(cases) - len(selected)), f"{metres:.1e} m", f"{share:.0%}"], wrong


def _check_widths(form: str, cases: Sequence[Case], folder: Path) -> tuple[list[str], list[str]]:
    excesses = measure_excess_widths([export(case.table, form) for case in cases], folder)
    wide = [f"{case.name} is {x} pt too wide" for case, x in zip(cases, excesses, strict=True) if x]
    return [str(len(cases)), "0", f"{len(wide)} wider than the page", ""], wide


if __name__ == "__main__":
    sys.exit(main())
