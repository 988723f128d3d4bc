"""Write docs/libraries.json and the tables of docs/libraries.md: how libraries read each feature of URDF.

    python scripts/make_libraries.py [LIBRARY ...] [--environments FOLDER]  # install, run, write both
    python scripts/make_libraries.py --page  # write the page from the JSON file

Each library gets its own environment outside the repository; docs/libraries.toml states its version. In this
environment, the library loads small robots with one feature of URDF each (robots/features.toml,
docs/libraries.toml). urdfkin/verify/adapters.py calls the library. urdfkin computes the expected poses, and
Pinocchio checks these poses. tests/test_libraries.py compares the expected poses with those of a reader that
was written from the URDF standard.
"""

import argparse
import json
import subprocess
import tomllib
import venv
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs

import urdfkin
from scripts.pages import DOCS, insert_parts, table
from urdfkin.comparison.readers import joint_values
from urdfkin.validation.vectors import Feature, load_features
from urdfkin.verify import adapters
from urdfkin.verify.adapters import LIBRARIES

PAGE, FIGURES, VERSIONS = (DOCS / f"libraries.{suffix}" for suffix in ("md", "json", "toml"))
DATA: dict[str, Any] = tomllib.loads(VERSIONS.read_text("utf-8"))
FEATURES = {name: load_features()[name] for name in DATA["features"]}
CONFIGURATIONS = 3
#: Tolerance for each element of a pose: a coordinate (m) or an entry of the rotation matrix. Rounding errors
#: are below 1e-14. If a library misreads an element, the error is above 1e-3.
TOLERANCE = 1e-9
#: Time limit of a library's process, s.
_SECONDS = 60
_MESSAGE_LENGTH = 160
VERDICTS = {
    "right": "right",
    "wrong": "different, without an error",
    "documented": "different, and stated",
    "refused": "refused",
}


def draw_configurations(robot: urdfkin.Robot) -> list[dict[str, Any]]:
    return [joint_values(robot, q) for q in robot.sample(CONFIGURATIONS, seed=0)]


def compute_expected_poses(robot: urdfkin.Robot) -> list[dict[str, Any]]:
    links = list(robot.link_names)
    T = robot.placement(robot.sample(CONFIGURATIONS, seed=0), links)
    return [dict(zip(links, one, strict=True)) for one in T]


def make_cell(
    feature: Feature, robot: urdfkin.Robot, library: str, answer: Mapping[str, Any]
) -> dict[str, Any]:
    if "error" in answer:
        return {"verdict": "refused", "message": answer["error"][:_MESSAGE_LENGTH]}
    if any("tip" not in theirs for theirs in answer["poses"]):
        return {"verdict": "refused", "message": "the link tip is missing"}
    worst = max(
        float(np.abs(mine[link] - theirs[link]).max())
        for mine, theirs in zip(compute_expected_poses(robot), answer["poses"], strict=True)
        for link in mine
        if link in theirs
    )
    if worst <= TOLERANCE:
        return {"verdict": "right"}
    cell: dict[str, Any] = {"verdict": "wrong", "difference": float(f"{worst:.3g}")}
    free = [name for name in answer["joints"] if name not in draw_configurations(robot)[0]]
    notes = [f"{name} has no coordinate" for name in answer["unset"]]
    notes += [f"{name} is free" for name in free]
    if notes:
        cell["note"] = "; ".join(notes)
    documented = DATA.get("documented", ())
    if any(feature.name in note["features"] and note["library"] == library for note in documented):
        cell["verdict"] = "documented"
    return cell


def make_environment(folder: Path, library: str) -> Path:
    environment, package = folder / library, LIBRARIES[library].package
    python = environment / "bin" / "python"
    requirement = f"{package}=={DATA['versions'][library]}"
    check = [str(python), "-I", str(Path(adapters.__file__)), library]
    if not python.exists() or subprocess.run(check, input="[]", text=True, check=False).returncode:
        venv.create(environment, with_pip=True)
    subprocess.run([str(python), "-m", "pip", "install", "--quiet", requirement], check=True)
    return python


def run_library(python: Path, library: str, cases: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    todo = list(cases)
    while todo:
        try:
            command = [str(python), "-I", str(Path(adapters.__file__)), library]
            process = subprocess.run(
                command, input=json.dumps(todo).encode(), capture_output=True, timeout=_SECONDS, check=False
            )
            output, reason = process.stdout, f"its process ended with {process.returncode}"
        except subprocess.TimeoutExpired as late:
            output, reason = late.stdout or b"", f"no answer in {_SECONDS} s"
        answers = [json.loads(line) for line in output.splitlines()]
        yield from answers
        todo = todo[len(answers) :]
        if todo:
            yield {"name": todo.pop(0)["name"], "error": reason}


def measure(folder: Path, libraries: list[str], before: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of the figures `before` with new results for the given libraries."""
    robots = {name: urdfkin.load(feature.text) for name, feature in FEATURES.items()}
    cases = [
        {"name": name, "text": feature.text, "configurations": draw_configurations(robots[name])}
        for name, feature in FEATURES.items()
    ]
    versions, cells = dict(before.get("versions", {})), dict(before.get("cells", {}))
    for library in libraries:
        print(library, flush=True)
        python = make_environment(folder, library)
        answers = {answer["name"]: answer for answer in run_library(python, library, cases)}
        versions[library] = DATA["versions"][library]
        cells[library] = {
            name: make_cell(feature, robots[name], library, answers[name])
            for name, feature in FEATURES.items()
        }
    order = [name for name in LIBRARIES if name in cells]
    return {
        "tolerance": TOLERANCE,
        "configurations": CONFIGURATIONS,
        "versions": {name: versions[name] for name in order},
        "cells": {name: cells[name] for name in order},
    }


def make_page(text: str, figures: Mapping[str, Any]) -> str:
    cells, versions = figures["cells"], figures["versions"]
    titles = {name: LIBRARIES[name].title for name in cells}
    notes: dict[str, Any] = {}  # Maps a footnote's letter to a difference that a library documents.
    for note in DATA.get("documented", ()):
        verdicts = [cells.get(note["library"], {}).get(name, {}).get("verdict") for name in note["features"]]
        if "documented" in verdicts:
            notes[chr(ord("a") + len(notes))] = note

    def words(library: str, feature: str) -> str:
        cell = cells[library][feature]
        if "difference" not in cell:
            return str(cell["verdict"])
        letters = (
            f" *{x}*" for x, n in notes.items() if n["library"] == library and feature in n["features"]
        )
        return f"{cell['difference']:.2g}{next(letters, '')}"

    rows = [(name, *(words(library, name) for library in cells)) for name in FEATURES]
    counts = {name: Counter(cell["verdict"] for cell in cells[name].values()) for name in cells}
    rows += [
        (f"*{title}*", *(str(counts[name][verdict]) for name in cells)) for verdict, title in VERDICTS.items()
    ]
    stated = [
        f"- *{letter}*, {titles[n['library']]}: {n['words']} ([source]({n['source']}))"
        for letter, n in notes.items()
    ]
    reasons: dict[tuple[str, str], list[str]] = {}
    for library, column in cells.items():
        for feature, cell in column.items():
            if reason := cell.get("message") or cell.get("note"):
                clean = reason.replace("|", r"\|").replace("`", "'")
                quoted = f"`{clean}`" if cell["verdict"] == "refused" else clean
                reasons.setdefault((library, quoted), []).append(feature)
    return insert_parts(
        text,
        cells=table(["", *(f"{titles[name]} {versions[name]}" for name in cells)], rows),
        stated="\n".join(stated),
        features=table(
            ("Feature", "Rule of the standard"), [(name, feature.rule) for name, feature in FEATURES.items()]
        ),
        reasons=table(
            ("Library", "Features", "Message, or the joints"),
            [(titles[name], "; ".join(features), reason) for (name, reason), features in reasons.items()],
        ),
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    names, folder = list(DATA["versions"]), platformdirs.user_cache_path("urdfkin-libraries")
    parser.add_argument("libraries", nargs="*", choices=[*names, []], help="libraries; by default all")
    parser.add_argument("--environments", type=Path, default=folder, help=f"default: {folder}")
    parser.add_argument("--page", action="store_true", help="write the page from the JSON file")
    options = parser.parse_args()
    figures = json.loads(FIGURES.read_text("utf-8")) if FIGURES.exists() else {}
    if not options.page:
        figures = measure(options.environments, options.libraries or names, figures)
        FIGURES.write_text(json.dumps(figures, indent=1) + "\n", "utf-8")
    PAGE.write_text(make_page(PAGE.read_text("utf-8"), figures), "utf-8")
