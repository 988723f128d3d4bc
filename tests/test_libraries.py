"""The table of libraries: its expected poses, its cells, and the page."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from scripts import make_libraries as maker
from tests.urdf_standard import poses
from urdfkin.verify.adapters import LIBRARIES, evaluate_case, version

pytestmark = pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
FIGURES = json.loads(maker.FIGURES.read_text("utf-8"))
FEATURES = maker.FEATURES


@pytest.mark.parametrize("name", FEATURES)
def test_the_expected_poses_are_those_of_a_reader_written_from_the_standard(name: str) -> None:
    text = FEATURES[name].text
    robot = urdfkin.load(text)
    for values, found in zip(
        maker.draw_configurations(robot), maker.compute_expected_poses(robot), strict=True
    ):
        other = poses(text, values)
        assert other.keys() == found.keys()
        # rpy="90 -45 30" loses eps * 90 in an angle, which turns entries by as much
        assert max(float(np.abs(found[link] - other[link]).max()) for link in found) < 4e-14


def test_the_page_shows_the_figures_of_its_file() -> None:
    text = maker.PAGE.read_text("utf-8")
    assert text == maker.make_page(text, FIGURES), "run python scripts/make_libraries.py --page"
    assert f"{FIGURES['configurations']} random configurations" in " ".join(text.split())
    assert f"The poses agree to {FIGURES['tolerance']:g}." in text


def test_each_library_has_a_cell_for_each_feature_and_the_stated_version() -> None:
    assert FIGURES["versions"] == maker.DATA["versions"]
    assert list(FIGURES["cells"]) == [name for name in LIBRARIES if name in FIGURES["versions"]]
    assert all(list(column) == list(FEATURES) for column in FIGURES["cells"].values())


def test_each_documented_difference_belongs_to_a_cell() -> None:
    for note in maker.DATA["documented"]:
        for feature in note["features"]:
            assert FIGURES["cells"][note["library"]][feature]["verdict"] == "documented", feature


@pytest.mark.parametrize("library", ["pinocchio", "mujoco", "yourdfpy"])
def test_the_cells_of_an_installed_library_can_be_measured_again(library: str) -> None:
    if version(library) != FIGURES["versions"][library]:
        pytest.skip(f"{library} is not installed in the version of the table")
    robots = {name: urdfkin.load(feature.text) for name, feature in FEATURES.items()}
    for name, feature in FEATURES.items():
        case = {"text": feature.text, "configurations": maker.draw_configurations(robots[name])}
        found = maker.make_cell(feature, robots[name], library, evaluate_case(library, case))
        assert found["verdict"] == FIGURES["cells"][library][name]["verdict"], name


def test_a_library_that_crashes_or_prints_does_not_end_the_run(tmp_path: Path) -> None:
    python = tmp_path / "python"
    python.write_text(
        f"#!{sys.executable}\nimport json, os, sys\n"
        "for case in json.load(sys.stdin):\n"
        "    if case['name'] == 'b':\n        os.abort()\n"
        "    print(json.dumps({'name': case['name'], 'error': 'x'}), flush=True)\n"
    )
    python.chmod(0o755)
    found = list(maker.run_library(python, "kinpy", [{"name": name} for name in "abc"]))
    assert [one["name"] for one in found] == ["a", "b", "c"]
    assert "ended with -6" in found[1]["error"]
