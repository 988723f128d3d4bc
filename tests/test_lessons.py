"""The lessons run as notebooks in Jupyter's kernel, with the outputs of the pages."""

import json
import os
import re
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from scripts.docs_site import make_notebook
from tests.pages import DOCS, pages

if not os.environ.get("CI"):  # there it must be
    pytest.importorskip("nbclient", reason="the extra `test` is not installed")
    pytest.importorskip("ipykernel")

LESSONS = [page for page in pages() if page.startswith("lessons/")]
#: The object that the last line of a cell displays, with words of its output.
SHOWN = {
    "import urdfkin; robot = urdfkin.load('panda'); J = robot.jacobian('ready', 'panda_hand')": (),
    "robot": ("panda_joint4", "-3.0718"),
    "robot.dh()": ("standard Denavit-Hartenberg parameters", "panda_joint4"),
    "robot.certificate()": ("panda: verified by Pinocchio", "jacobian"),
}

Cell = dict[str, Any]


def cells_of(page: str) -> list[Cell]:
    cells: list[Cell] = make_notebook((DOCS / page).read_text("utf-8"))["cells"]
    return cells


def code(source: str) -> Cell:
    return {"cell_type": "code", "metadata": {}, "source": source, "execution_count": None, "outputs": []}


def executed(cells: list[Cell], home: Path) -> list[Cell]:
    """Run a notebook in a kernel with its own folder, and return the cells."""
    nbformat, client = (import_module(name) for name in ("nbformat", "nbclient"))  # without types
    book = nbformat.reads(json.dumps(make_notebook("") | {"cells": cells}), as_version=4)
    client.NotebookClient(book, timeout=300, resources={"metadata": {"path": str(home)}}).execute()
    done: list[Cell] = book["cells"]
    return done


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")  # of the client
def test_the_lessons_run_in_a_notebook_and_objects_are_displayed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR"):
        monkeypatch.setenv(name, str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(DOCS.parent))
    told = [cell for page in LESSONS for cell in [code("%reset -f"), *cells_of(page)]]
    done = executed([*told, *map(code, SHOWN)], tmp_path)
    assert len(LESSONS) >= 4
    for before, after in zip(told, done, strict=False):
        shown = "".join(output["text"] for output in before.get("outputs", ()))
        printed = "".join(output.get("text", "") for output in after.get("outputs", ()))
        assert printed == shown or not shown, after["source"]
    for (line, words), cell in zip(SHOWN.items(), done[-len(SHOWN) :], strict=True):
        for output in cell["outputs"]:
            assert set(output["data"]) >= {"text/plain", "text/html", "text/markdown", "text/latex"}
            html = re.sub(r"<[^>]*>", " ", output["data"]["text/html"])
            assert all(word in html for word in words), line
        assert len(cell["outputs"]) == bool(words)
