"""Export the catalogue's tables in every format, run the exported code, and compare it with Pinocchio.

    python scripts/check_forms.py                      # the tip of every robot, standard and modified
    python scripts/check_forms.py --leaves             # every leaf of every robot
    python scripts/check_forms.py --toolbox PYTHON     # another interpreter, with roboticstoolbox
    python scripts/check_forms.py --forms sympy latex  # some formats only

LaTeX tables are compiled and must fit on the page of an article. Exit 1: results of a format differ by more
than rounding, or a LaTeX table is too wide.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # import from this checkout without an installation

import urdfkin
from scripts.forms.running import RUN, Job, Missing, elsewhere, too_wide
from urdfkin.dh import FORMATS, DHTable, export
from urdfkin.errors import InputError
from urdfkin.export import LANGUAGES
from urdfkin.kinematics.roundings import EPS, of_rows
from urdfkin.model.configuration import sample
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import examples
from urdfkin.verify.oracle import QueryBatch

#: Number of configurations of each table.
SAMPLES = 4
#: Octave's symbolic package takes 20 s for six joints, so it only computes 6 tables with at most 4 joints.
FEW, SMALL = 6, 4


@dataclass(frozen=True, slots=True)
class Subject:
    """A table, its coordinates at some configurations, and Pinocchio's poses of its tip in its base."""

    name: str
    job: Job
    theirs: FloatArray

    @property
    def table(self) -> DHTable:
        """The table of the job."""
        return self.job.table

    def off(self, found: FloatArray) -> tuple[float, float]:
        """Return the tip's distance from Pinocchio's (m), and the table's error as a share of its bound."""
        apart = np.abs(found - self.table.placement(self.job.q))[:, :3].max(axis=(-1, -2))
        # urdfkin and Pinocchio round differently.
        # A table without lengths still has rounding errors of its angles.
        allowed = 2.0 * np.maximum(self.table.rounding(self.job.q), EPS * of_rows(len(self.table.rows)))
        return float(np.abs(found - self.theirs)[:, :3, 3].max()), float((apart / allowed).max())


def subjects(leaves: bool) -> Iterator[Subject]:
    """Yield tables that agree with Pinocchio; `robot.dh` raises an error otherwise."""
    for name in examples():
        robot = urdfkin.load(name)
        tips = [robot.tree.frame_name(leaf) for leaf in robot.tree.leaves()] if leaves else [robot.tip_frame]
        for tip in tips:
            for convention in ("standard", "modified"):
                yield subject(robot, f"{name} {tip} {convention}", robot.dh(tip, convention=convention))


def subject(robot: Robot, name: str, table: DHTable) -> Subject:
    """Return one table of a robot with its configurations."""
    q = sample(robot.tree, SAMPLES, np.random.default_rng(0))
    ends = [table.base_frame, table.tip_frame]
    base, tip = np.moveaxis(robot.verifier.oracle().placements(QueryBatch(ends, (q,))), 1, 0)
    return Subject(name, Job(table, table.coupling.select(robot.tree, q)), np.linalg.inv(base) @ tip)


def fits(form: str, table: DHTable) -> bool:
    """Return whether the format can represent the table; the code formats of `urdfkin export` always can."""
    if form in LANGUAGES:
        return True
    try:
        export(table, form)
    except InputError:
        return False
    return True


def main(words: Sequence[str] | None = None) -> int:
    """Run the checks; return 1 for an error."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--leaves", action="store_true", help="check every leaf link, not only the tips")
    parser.add_argument("--toolbox", metavar="PYTHON", help="Python interpreter that has roboticstoolbox")
    parser.add_argument(
        "--forms", nargs="+", choices=(*RUN, "latex"), default=(*RUN, "latex"), metavar="FORM"
    )
    arguments = parser.parse_args(words)
    warnings.simplefilter("ignore", urdfkin.UrdfWarning)
    if arguments.toolbox:
        RUN.update({form: elsewhere(form, arguments.toolbox) for form in ("roboticstoolbox", "ets")})
    found = list(subjects(arguments.leaves))
    print("| form | tables | refused | from Pinocchio at most | of the bound | seconds |", flush=True)
    print("|---|---:|---:|---:|---:|---:|", flush=True)
    wrong = 0
    for form in arguments.forms:
        with tempfile.TemporaryDirectory() as folder:
            wrong += _checked(form, found, Path(folder))
    return int(wrong > 0)


def _checked(form: str, found: Sequence[Subject], folder: Path) -> int:
    """Print the results of an export format as one row; return the number of wrong exported tables."""
    begin = time.perf_counter()
    if form == "latex":
        return _compiled(found, folder)
    taken = [one for one in found if form not in FORMATS or fits(form, one.table)]
    if form == "matlab-symbolic":
        taken = [one for one in taken if 0 < len(one.table.rows) <= SMALL][:FEW]
    try:
        poses = RUN[form]([one.job for one in taken], folder)
    except Missing as error:
        print(f"| {form} | not run: {error} is missing | | | | |", flush=True)
        return 0
    figures = [one.off(pose) for one, pose in zip(taken, poses, strict=True)]
    wrong = [one.name for one, (_, share) in zip(taken, figures, strict=True) if not share <= 1.0]
    metres, share = map(max, zip(*figures, strict=True))
    seconds = time.perf_counter() - begin
    counts = f"{len(taken)} | {len(found) - len(taken)}"
    print(f"| {form} | {counts} | {metres:.1e} m | {share:.0%} | {seconds:.0f} |", flush=True)
    for name in wrong:
        print(f"WRONG {form}: {name}", flush=True)
    return len(wrong)


def _compiled(found: Sequence[Subject], folder: Path) -> int:
    try:
        over = too_wide([export(one.table, "latex") for one in found], folder)
    except Missing as error:
        print(f"| latex | not run: {error} is missing | | | | |")
        return 0
    print(f"| latex | {len(found)} | 0 | {sum(x > 0.0 for x in over)} wider than the page | | |")
    for one, points in zip(found, over, strict=True):
        if points:
            print(f"TOO WIDE by {points} pt: {one.name}")
    return sum(x > 0.0 for x in over)


if __name__ == "__main__":
    sys.exit(main())
