"""`urdfkin check` through its real entry point: exit codes, formats, options."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

GOOD = '<robot name="r">\n  <link name="a"/>\n</robot>\n'
WARNED = '<robot name="">\n  <link name="a"/>\n</robot>\n'
BAD = '<robot name="r">\n  <link name="a"/>\n  <link name="a"/>\n</robot>\n'


def urdfkin(*arguments: str, stdin: str = "", cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "urdfkin", *arguments],
        input=stdin,
        capture_output=True,
        text=True,
        check=False,
        cwd=cwd,
        env={"PYTHONPATH": str(Path(__file__).parents[2]), "PATH": ""},
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in (("good", GOOD), ("warned", WARNED), ("bad", BAD)):
        (tmp_path / f"{name}.urdf").write_text(text)
    return tmp_path


def test_a_clean_file_exits_0(folder: Path) -> None:
    done = urdfkin("check", "good.urdf", cwd=folder)
    assert (done.returncode, done.stdout, done.stderr) == (0, "no findings in 1 file\n", "")


def test_an_error_exits_1_with_its_place_and_where_to_read_on(folder: Path) -> None:
    done = urdfkin("check", "good.urdf", "bad.urdf", cwd=folder)
    assert done.returncode == 1
    lines = done.stdout.splitlines()
    assert lines[0].startswith("bad.urdf:3:9: URDF402 error: link 'a': another link has this name")
    assert lines[1:3] == ['  3 |   <link name="a"/>', "    |         ^^^^^^^^"]
    assert lines[3] == "1 error in 2 files"
    assert lines[4].startswith("'urdfkin explain URDF402'")


@pytest.mark.slow
def test_a_warning_exits_0_and_1_when_strict(folder: Path) -> None:
    assert urdfkin("check", "warned.urdf", cwd=folder).returncode == 0
    done = urdfkin("check", "--strict", "warned.urdf", cwd=folder)
    assert (done.returncode, "URDF405 error" in done.stdout) == (1, True)


@pytest.mark.slow
def test_an_ignored_code_does_not_count(folder: Path) -> None:
    done = urdfkin("check", "--ignore", "URDF402", "bad.urdf", cwd=folder)
    assert (done.returncode, done.stdout) == (0, "no findings in 1 file\n")


@pytest.mark.slow
def test_a_missing_file_exits_2_and_the_others_are_checked(folder: Path) -> None:
    done = urdfkin("check", "nowhere.urdf", "bad.urdf", cwd=folder)
    assert done.returncode == 2
    assert "URDF402" in done.stdout
    assert done.stderr == "urdfkin: error: nowhere.urdf: no such file; did you mean warned.urdf?\n"


def test_an_unknown_code_exits_2_with_the_nearest(folder: Path) -> None:
    done = urdfkin("check", "--ignore", "URDF4022", "bad.urdf", cwd=folder)
    assert done.returncode == 2
    assert "did you mean URDF402" in done.stderr


def test_standard_input_is_a_file_like_any_other() -> None:
    done = urdfkin("check", "-", stdin=BAD)
    assert (done.returncode, done.stdout.split(":")[0]) == (1, "<stdin>")


@pytest.mark.slow
@pytest.mark.parametrize("style", ["json", "sarif"])
def test_the_machine_formats_are_one_document(folder: Path, style: str) -> None:
    done = urdfkin("check", "--format", style, "bad.urdf", "good.urdf", cwd=folder)
    assert done.returncode == 1
    assert "URDF402" in json.dumps(json.loads(done.stdout))


def test_github_prints_nothing_for_a_clean_file(folder: Path) -> None:
    assert urdfkin("check", "--format", "github", "good.urdf", cwd=folder).stdout == ""


def test_limits_can_be_lowered(folder: Path) -> None:
    done = urdfkin("check", "--max-bytes", "10", "good.urdf", cwd=folder)
    assert (done.returncode, "URDF108" in done.stdout) == (1, True)


@pytest.mark.slow
def test_explain_prints_a_page_and_lists_all_codes() -> None:
    page = urdfkin("explain", "urdf502")
    assert page.returncode == 0
    assert page.stdout.startswith("URDF502 axis-without-direction (error)")
    assert urdfkin("explain").stdout.count("\n") > 60
    assert urdfkin("explain", "URDF999").returncode == 2


def test_checking_imports_neither_yourdfpy_nor_pinocchio_nor_a_compiler() -> None:
    program = (
        "import sys; from urdfkin.lint import check; check('<robot/>');"
        "print({'numba', 'yourdfpy', 'pinocchio', 'lxml', 'trimesh'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
