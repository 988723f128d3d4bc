"""`load` and `same` run through few files, so that a reader can follow them."""

from collections.abc import Callable

from scripts.count_files import ROOT, A, B, files_of_load, files_of_same, files_run
from urdfkin.urdf.catalogue import catalogue


def test_load_of_a_urdf_file_runs_through_at_most_17_files() -> None:
    files = files_of_load(A)
    some = {"robot/loading.py", "urdf/parser.py", "urdf/lint/rules/joints.py", "urdf/reader.py"}
    assert some <= set(files)
    assert len(files) <= 17, files


def test_load_of_a_file_with_mimic_joints_and_warnings_runs_through_at_most_19_files() -> None:
    files = files_of_load(catalogue()["panda"].path)
    assert len(files) <= 19, files


def test_same_of_two_urdf_files_runs_through_at_most_33_files() -> None:
    files = files_of_same(A, B)
    assert {"robot/loading.py", "comparison/verdict.py"} <= set(files)
    assert len(files) <= 33, files


def test_code_that_runs_during_an_import_does_not_count() -> None:
    names: dict[str, Callable[[], None]] = {}
    imported = compile("def f(): pass\nf()", ROOT / "invented.py", "exec")
    assert files_run(lambda: exec(imported, names)) == []
    assert files_run(names["f"]) == ["invented.py"]
