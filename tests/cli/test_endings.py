"""A file's ending says what is in it, and what was written is named."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.cli.running import urdfkin
from urdfkin.dh import read_table

ELBOW = str(Path(__file__).parents[2] / "robots" / "elbow.urdf")
WORDS = ("jacobian", "elbow", "--q", "random:2")


def test_each_ending_gets_its_form_and_the_same_numbers(tmp_path: Path) -> None:
    for ending in ("npy", "json", "csv", "CSV"):
        assert urdfkin(*WORDS, "-o", str(tmp_path / f"J.{ending}")).code == 0
    J = np.load(tmp_path / "J.npy")
    assert J.shape == (2, 6, 6)
    assert (np.array(json.loads((tmp_path / "J.json").read_text())["result"]) == J).all()
    lines = [line.split(",") for line in (tmp_path / "J.csv").read_text().splitlines()]
    assert (np.array([line[2:] for line in lines[1:]], dtype=float).reshape(2, 6, 6) == J).all()
    assert (tmp_path / "J.CSV").read_bytes() == (tmp_path / "J.csv").read_bytes()


def test_the_form_stands_where_the_ending_says_nothing(tmp_path: Path) -> None:
    assert urdfkin(*WORDS, "--format", "json", "-o", str(tmp_path / "J.dat")).code == 0
    assert len(json.loads((tmp_path / "J.dat").read_text())["result"]) == 2
    assert urdfkin(*WORDS, "-o", str(tmp_path / "J")).code == 0
    assert (tmp_path / "J").read_text().startswith("sample,row,joint_1")


def test_a_breakdown_goes_by_the_ending_too(tmp_path: Path) -> None:
    words = ("acceleration", "elbow", "--breakdown", "--v", "random", "-o", str(tmp_path / "parts.json"))
    assert urdfkin(*words).code == 0
    assert json.loads((tmp_path / "parts.json").read_text())["quantity"] == "acceleration breakdown"


@pytest.mark.slow
def test_a_table_goes_by_the_ending_too(tmp_path: Path) -> None:
    for ending in ("toml", "json", "csv", "urdf", "tex", "md", "c", "py", "m"):
        assert urdfkin("dh", "elbow", "-o", str(tmp_path / f"t.{ending}")).code == 0
    rows = [read_table(tmp_path / f"t.{ending}").rows for ending in ("toml", "json", "csv")]
    assert rows[0] == rows[1] == rows[2]
    assert tomllib.loads((tmp_path / "t.toml").read_text())["convention"] == "standard"
    starts = {
        "urdf": "<robot",
        "md": "**elbow: ",
        "tex": "\\begin{table}",
        "m": "% Kinematics of elbow",
        "c": "/*",
    }
    for ending, start in starts.items():
        assert (tmp_path / f"t.{ending}").read_text().startswith(start), ending
    assert urdfkin("dh", "elbow", "--format", "roboticstoolbox", "-o", str(tmp_path / "r.py")).code == 0
    assert "roboticstoolbox" in (tmp_path / "r.py").read_text()
    done = urdfkin("dh", "elbow", "--format", "toml", "-o", str(tmp_path / "t.json"))
    assert (done.code, "contradicts the file's suffix" in done.err) == (2, True)


@pytest.mark.slow
def test_a_validation_names_its_verdict_and_the_files_it_wrote(tmp_path: Path) -> None:
    html, data = str(tmp_path / "r.html"), str(tmp_path / "r.json")
    done = urdfkin("validate", "elbow", "--samples", "1", "--html", html, "--json", data)
    *_, summary, wrote = done.text.splitlines()
    assert summary.startswith("verified: 1 robot, ")
    assert wrote == f"wrote {data}, {html}"


@pytest.mark.parametrize("style", ["terminal", "json"])
def test_a_file_that_could_not_be_read_was_not_checked(style: str, tmp_path: Path) -> None:
    done = urdfkin("check", ELBOW, str(tmp_path / "none.urdf"), "--format", style)
    assert done.code == 2
    if style == "json":
        assert done.data["files"] == [ELBOW]
    else:
        assert done.text == "no findings in 1 file\n"
