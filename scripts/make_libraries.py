"""Write docs/libraries.md and docs/libraries.json: how robotics libraries read each feature of URDF.

    python scripts/make_libraries.py [LIBRARY ...] [--environments FOLDER]  # install, run, write both
    python scripts/make_libraries.py --page  # write the page from the JSON file

Each library gets its own environment outside the repository; docs/libraries.toml states its version. In this
environment, the library loads small robots with one feature of URDF each (robots/features.toml,
docs/libraries.toml). urdfkin/verify/adapters.py calls the library. The expected poses are urdfkin's, which
Pinocchio checks; tests/test_libraries.py compares them with a reader that was written from the URDF standard.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tomllib
import venv
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs

sys.path.insert(0, str(Path(__file__).parents[1]))  # import from this checkout without an installation

import urdfkin
from urdfkin.comparison.readers import values_of
from urdfkin.validation.vectors import Feature, features
from urdfkin.verify import adapters
from urdfkin.verify.adapters import LIBRARIES

DOCS = Path(__file__).parents[1] / "docs"
PAGE, FIGURES, LISTED = (DOCS / f"libraries.{suffix}" for suffix in ("md", "json", "toml"))
DATA: dict[str, Any] = tomllib.loads(LISTED.read_text("utf-8"))
#: The features of the table, by name.
FEATURES = {name: features()[name] for name in DATA["features"]}
#: Number of random configurations for which each feature is tested.
CONFIGURATIONS = 3
#: Largest difference (m, and entries of a rotation matrix) of a pose that counts as right.
#: For these robots, libraries that compute in double precision differ by less than 1e-14.
#: A misread element causes a difference of more than 1e-3.
RIGHT = 1e-9
#: Time limit (seconds) for a library to read all features.
#: After a crash or a timeout, the limit begins again for the remaining features.
_SECONDS = 60
_QUOTED = 160

_HEAD = """# How libraries read URDF

Each row is a feature of the [URDF standard](https://wiki.ros.org/urdf/XML), as a robot of two or three
joints (`robots/features.toml`). Each cell compares the poses of all links with the expected ones, at
{configurations} random configurations. The expected poses are urdfkin's, checked by Pinocchio. A test
compares them with a second reader, which was written from the standard alone (`tests/urdf_standard.py`).

| Cell | Meaning |
|---|---|
| right | The poses agree to {right:g}. |
| a number | The library raised no error. Largest difference of a position (m) or an entry of a rotation. |
| a number *and a letter* | The library states this difference; the note below says how. |
| refused | The library raised an error, which is quoted below. |

Each library is used in its own convention, in the order of its own joints, by an adapter of about 20 lines
(`urdfkin/verify/adapters.py`). The adapter sets the independent joints only. If a library leaves a mimic
joint free, the joint stays at zero. This table says nothing about other qualities of a library, and nothing
about other versions. pytorch_kinematics is missing because it needs PyTorch, whose package installs
CUDA's libraries. PyRoki is missing because pip found no release of it.

"""
_FOOT = """
`python scripts/make_libraries.py` installs the libraries, each in an environment of its own, and writes this
page and `docs/libraries.json`. [Defects of other libraries](upstream.md) has programs that show some of these
differences.

## How do libraries read your file?

`urdfkin readers ROBOT` makes the same comparison for your robot, with the libraries that are installed beside
urdfkin. For each joint that a library reads differently, it names the element of the file:

```sh
urdfkin readers talos --with mujoco,yourdfpy
```

In Python, `urdfkin.comparison.readers.compare_readers(robot)` returns the same result.
"""


def configurations(robot: urdfkin.Robot) -> list[dict[str, Any]]:
    """Return random values within limits, by the names of the independent joints."""
    return [values_of(robot, q) for q in robot.sample(CONFIGURATIONS, seed=0)]


def expected(robot: urdfkin.Robot) -> list[dict[str, Any]]:
    """Return the poses of all links in the base frame for each configuration; Pinocchio checks each pose."""
    q = robot.sample(CONFIGURATIONS, seed=0)
    links = list(robot.link_names)
    T = robot.placement(q, links)
    return [dict(zip(links, one, strict=True)) for one in T]


def cell(feature: Feature, robot: urdfkin.Robot, library: str, answer: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table's cell for a feature and a library.

    The cell has a verdict, and the largest difference or a message.
    """
    if "error" in answer:
        return {"verdict": "refused", "message": answer["error"][:_QUOTED]}
    if any("tip" not in theirs for theirs in answer["poses"]):
        return {"verdict": "refused", "message": "the link tip is missing"}
    worst = max(
        float(np.abs(mine[link] - theirs[link]).max())
        for mine, theirs in zip(expected(robot), answer["poses"], strict=True)
        for link in mine
        if link in theirs
    )
    if worst <= RIGHT:
        return {"verdict": "right"}
    found: dict[str, Any] = {"verdict": "wrong", "difference": float(f"{worst:.3g}")}
    free = [name for name in answer["joints"] if name not in configurations(robot)[0]]
    notes = [f"{name} has no coordinate" for name in answer["unset"]]
    notes += [f"{name} is free" for name in free]
    if notes:
        found["note"] = "; ".join(notes)
    if any(
        feature.name in one["features"] and one["library"] == library for one in DATA.get("documented", ())
    ):
        found["verdict"] = "documented"
    return found


def environment(folder: Path, library: str) -> Path:
    """Return the Python of a library's environment; install the environment if it is missing."""
    place, package = folder / library, LIBRARIES[library].package
    python = place / "bin" / "python"
    wanted = f"{package}=={DATA['versions'][library]}"
    check = [str(python), "-I", str(Path(adapters.__file__)), library]
    if not python.exists() or subprocess.run(check, input="[]", text=True, check=False).returncode:
        venv.create(place, with_pip=True)
    subprocess.run([str(python), "-m", "pip", "install", "--quiet", wanted], check=True)
    return python


def answers(python: Path, library: str, cases: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Yield a library's answer to each case.

    After a case that ends the library's process, start a new process.
    """
    todo = list(cases)
    while todo:
        try:
            command = [str(python), "-I", str(Path(adapters.__file__)), library]
            done = subprocess.run(
                command, input=json.dumps(todo).encode(), capture_output=True, timeout=_SECONDS, check=False
            )
            written, how = done.stdout, f"its process ended with {done.returncode}"
        except subprocess.TimeoutExpired as late:
            written, how = late.stdout or b"", f"no answer in {_SECONDS} s"
        found = [json.loads(line) for line in written.splitlines()]
        yield from found
        todo = todo[len(found) :]
        if todo:
            yield {"name": todo.pop(0)["name"], "error": how}


def measure(folder: Path, libraries: list[str], before: Mapping[str, Any]) -> dict[str, Any]:
    """Return the versions and cells of the given libraries; all other libraries keep their earlier values."""
    robots = {name: urdfkin.load(feature.text) for name, feature in FEATURES.items()}
    cases = [
        {"name": name, "text": feature.text, "configurations": configurations(robots[name])}
        for name, feature in FEATURES.items()
    ]
    versions, cells = dict(before.get("versions", {})), dict(before.get("cells", {}))
    for library in libraries:
        print(library, flush=True)
        python = environment(folder, library)
        found = {answer["name"]: answer for answer in answers(python, library, cases)}
        versions[library] = DATA["versions"][library]
        cells[library] = {
            name: cell(feature, robots[name], library, found[name]) for name, feature in FEATURES.items()
        }
    order = [name for name in LIBRARIES if name in cells]
    return {
        "tolerance": RIGHT,
        "configurations": CONFIGURATIONS,
        "versions": {name: versions[name] for name in order},
        "cells": {name: cells[name] for name in order},
    }


def page(figures: Mapping[str, Any]) -> str:
    """Return the text of the page."""
    cells, versions = figures["cells"], figures["versions"]
    notes = _documented(figures)
    letters = {id(one): chr(ord("a") + i) for i, one in enumerate(notes)}

    def words(library: str, feature: str) -> str:
        one = cells[library][feature]
        if "difference" not in one:
            return str(one["verdict"])
        number = f"{one['difference']:.2g}"
        for note in notes:
            if note["library"] == library and feature in note["features"]:
                return f"{number} *{letters[id(note)]}*"
        return number

    titles = [f"{LIBRARIES[name].title} {versions[name]}" for name in cells]
    names = list(FEATURES)
    lines = [f"| | {' | '.join(titles)} |", "|---" * (1 + len(titles)) + "|"]
    lines += [f"| {name} | {' | '.join(words(library, name) for library in cells)} |" for name in names]
    verdicts = {name: Counter(one["verdict"] for one in cells[name].values()) for name in cells}
    lines += [
        f"| *{title}* | {' | '.join(str(verdicts[name][verdict]) for name in cells)} |"
        for verdict, title in (
            ("right", "right"), ("wrong", "different, without an error"),
            ("documented", "different, and stated"), ("refused", "refused"),
        )
    ]  # fmt: skip
    parts = [
        _HEAD.format(configurations=figures["configurations"], right=figures["tolerance"]),
        _joined(lines),
    ]
    parts += ["\n## Stated differences\n\n"] if notes else []
    parts += [
        f"- *{letters[id(n)]}*, {LIBRARIES[n['library']].title}: {n['words']} ([source]({n['source']}))\n"
        for n in notes
    ]
    parts += ["\n## The features\n\n| Feature | Rule of the standard |\n|---|---|\n"]
    parts += [f"| {name} | {feature.rule} |\n" for name, feature in FEATURES.items()]
    parts += ["\n## Why a cell differs\n\n", *_reasons(cells)]
    return "".join(parts) + _FOOT


def _documented(figures: Mapping[str, Any]) -> list[dict[str, Any]]:
    return [
        note
        for note in DATA.get("documented", ())
        if any(
            figures["cells"].get(note["library"], {}).get(feature, {}).get("verdict") == "documented"
            for feature in note["features"]
        )
    ]


def _reasons(cells: Mapping[str, Any]) -> Iterator[str]:
    """Yield the Markdown table of messages and notes: each row has a library and one of its messages."""
    yield "| Library | Features | Message, or the joints |\n|---|---|---|\n"
    for library, column in cells.items():
        reasons: dict[str, list[str]] = {}
        for feature, one in column.items():
            if reason := one.get("message") or one.get("note"):
                quoted = one["verdict"] == "refused"
                clean = reason.replace("|", r"\|").replace("`", "'")
                reasons.setdefault(f"`{clean}`" if quoted else clean, []).append(feature)
        for reason, names in reasons.items():
            yield f"| {LIBRARIES[library].title} | {'; '.join(names)} | {reason} |\n"


def _joined(lines: list[str]) -> str:
    return "".join(f"{line}\n" for line in lines)


def main() -> None:
    """Install and run the libraries, and write the page and the JSON file."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "libraries", nargs="*", choices=[*DATA["versions"], []], help="libraries; by default all"
    )
    parser.add_argument(
        "--environments", type=Path, default=platformdirs.user_cache_path("urdfkin-libraries")
    )
    parser.add_argument("--page", action="store_true", help="write the page from the JSON file")
    given = parser.parse_args()
    before = json.loads(FIGURES.read_text("utf-8")) if FIGURES.exists() else {}
    if not given.page:
        before = measure(given.environments, given.libraries or list(DATA["versions"]), before)
        FIGURES.write_text(json.dumps(before, indent=1) + "\n", "utf-8")
    PAGE.write_text(page(before), "utf-8")


if __name__ == "__main__":
    main()
