"""`urdfkin export` writes files with a proof, and checks them."""

import os
import re
import shutil
from pathlib import Path

import pytest

from tests.attacks.hostile import urdf
from tests.cli.running import good, refused, urdfkin
from tests.urdfs import joint, robot


@pytest.mark.slow
def test_an_exported_file_is_written_and_passes_the_check(tmp_path: Path) -> None:
    path = tmp_path / "elbow.py"
    words = "export planar_two_link --to numpy --quantity jacobian,velocity --quantity placement -o"
    done = urdfkin(words, str(path))
    assert (done.code, done.out) == (0, b"")
    assert "verified by Pinocchio" in done.err
    checked = re.findall(r"^good (\w+): 4 test vectors", good("export --check", str(path)).text, re.MULTILINE)
    assert checked == ["jacobian", "velocity", "placement"]
    path.write_text(path.read_text("utf-8").replace("cos(q_", "sin(q_"), "utf-8")
    wrong = urdfkin("export --check", str(path))
    assert (wrong.code, "WRONG placement" in wrong.text) == (1, True)


@pytest.mark.parametrize(("suffix", "words"), [("hpp", "namespace "), ("py", "import numpy"), ("c", "void ")])
def test_the_suffix_of_the_output_selects_the_language(suffix: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / f"elbow.{suffix}"
    good("export planar_two_link --quantity jacobian -o", str(path))
    text = path.read_text("utf-8")
    assert words in text
    assert re.search(rf"To try it: .* elbow\.{suffix}( |$)", text, re.MULTILINE), (
        "the command names this file"
    )
    good("export planar_two_link --quantity jacobian --to latex -o", str(path.with_suffix(".txt")))
    assert words not in path.with_suffix(".txt").read_text("utf-8")


def test_a_language_that_contradicts_the_suffix_is_refused_and_no_file_is_written(tmp_path: Path) -> None:
    path = tmp_path / "elbow.py"
    command = "export planar_two_link --quantity jacobian"
    assert "--to c contradicts the file's suffix" in refused(f"{command} --to c -o", str(path))
    assert "use .c, .h, .hpp" in refused(f"{command} -o", str(path.with_suffix(".rs")))
    assert not list(tmp_path.iterdir())
    good(f"{command} --to numba -o", str(path))
    good(f"{command} -o", str(path.with_suffix(".h")))
    assert "good jacobian: 4 test vectors" in good("export --check", str(path.with_suffix(".h"))).text


def test_a_quantity_has_one_function_and_the_message_about_a_wrong_one_names_exportable_ones() -> None:
    names = "jacobian rate,jacobian_rate"
    text = good("export planar_two_link --to numpy --quantity", names).text
    assert text.count("def jacobian_rate(") == 1
    message = refused("export planar_two_link --quantity jacobian-rate")
    assert "unknown quantity 'jacobian-rate'; did you mean jacobian_rate, jacobian?" in message


def test_an_export_on_standard_output_contains_no_log_command() -> None:
    done = good("export planar_two_link --to c --name", "my arm")
    assert "void my_arm_jacobian_batch(size_t n" in done.text
    done = urdfkin("export - --to numpy --no-verify", stdin=urdf("x ##vso[task.setvariable]y ::error::"))
    assert done.code == 3
    assert "##vso[" not in done.text


def test_an_unverified_export_is_marked_in_the_file_and_in_the_check(tmp_path: Path) -> None:
    path = tmp_path / "arm.py"
    assert urdfkin("export planar_two_link --no-verify --to numpy -o", str(path)).code == 3
    assert "UNVERIFIED" in path.read_text("utf-8").splitlines()[0]
    checked = urdfkin("export --check", str(path))
    assert (checked.code, "UNVERIFIED" in checked.err) == (3, True)


@pytest.fixture(scope="module")
def exported() -> str:
    return urdfkin("export planar_two_link --to numpy --quantity placement").text


CHANGES = {
    "the URDF's digest": (r"URDF sha256 \w{8}", "URDF sha256 00000000"),
    "the bound's share": (r"[\d.]+% of the bound", "900.00% of the bound"),
    "the number of configurations": (r"103 configurations", "999 configurations"),
    "the robot's name": (r"Kinematics of planar_two_link", "Kinematics of another"),
    "the oracle": (r"Pinocchio \S+,", "Pinocchio 9.9.9,"),
    "a comment in the code": (r"    # tip", "    # top"),
    "the seal": (r"Seal sha256 \w{8}", "Seal sha256 00000000"),
    "no seal": (r"Seal sha256 \w{64}\n", ""),
}


@pytest.mark.slow
@pytest.mark.parametrize("change", CHANGES)
def test_an_exported_file_with_a_changed_head_is_not_verified(
    change: str, exported: str, tmp_path: Path
) -> None:
    pattern, by = CHANGES[change]
    changed = re.sub(pattern, by, exported, count=1)
    assert changed != exported
    path = tmp_path / "arm.py"
    path.write_text(changed, "utf-8")
    done = urdfkin("export --check", str(path))
    assert done.code == 3
    assert "good placement: 4 test vectors" in done.text
    assert "UNVERIFIED: the file " in done.err
    assert "export the file again" in done.err


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_check_accepts_other_line_ends_and_includes_no_file_beside_the_export(
    exported: str, tmp_path: Path
) -> None:
    path = tmp_path / "arm.py"
    path.write_bytes(exported.replace("\n", "\r\n").encode())
    assert urdfkin("export --check", str(path)).code == 0
    path = tmp_path / "arm.c"
    path.write_text(urdfkin("export planar_two_link --to c --quantity placement").text, "utf-8")
    (tmp_path / "math.h").write_text("#error run by urdfkin")
    assert urdfkin("export --check", str(path)).code == 0
    path.write_text('#include "own.h"\n' + path.read_text("utf-8"), "utf-8")
    (tmp_path / "own.h").write_text("")
    assert urdfkin("export --check", str(path)).code == 2


@pytest.mark.slow
@pytest.mark.parametrize("beside", ["numpy.py", "math.py", "numpy/__init__.py", "sitecustomize.py"])
def test_the_check_of_an_export_runs_no_file_beside_the_export(
    beside: str, exported: str, tmp_path: Path
) -> None:
    mark, planted = tmp_path / "mark", tmp_path / "arm" / beside
    planted.parent.mkdir(parents=True)
    planted.write_text(f"open({str(mark)!r}, 'w').close()")
    (tmp_path / "arm" / "arm.py").write_text(exported, "utf-8")
    good("export --check", str(tmp_path / "arm" / "arm.py"))
    assert not mark.exists()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["x'); system('touch mark'); y=('.m", "2 x.m", "disp.m"])
def test_octave_receives_the_name_of_the_function_and_not_of_the_file(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # This program replaces Octave, and writes its arguments to a file.
    octave, path = tmp_path / "bin" / "octave-cli", tmp_path / name
    octave.parent.mkdir()
    octave.write_text(
        f'#!/bin/sh\nprintf "%s\\n" "$@" > "{tmp_path}/said"; ls > "{tmp_path}/there"; echo good x'
    )
    octave.chmod(0o700)
    monkeypatch.setenv("PATH", f"{octave.parent}:{os.environ['PATH']}")
    path.write_text(urdfkin("export planar_two_link --to matlab --quantity placement").text, "utf-8")
    assert urdfkin("export --check", str(path)).code == 0
    assert (tmp_path / "said").read_text().splitlines()[-1] == "planar_two_link_tip_kinematics().check();"
    assert (tmp_path / "there").read_text() == "planar_two_link_tip_kinematics.m\n"


@pytest.mark.parametrize("form", ["dh", "screws"])
def test_a_form_that_cannot_contain_a_joint_advises_no_option_of_other_commands(
    form: str, tmp_path: Path
) -> None:
    path = tmp_path / "moving.urdf"
    joints = joint("free", "floating", "world", "body"), joint("elbow", "continuous", "body", "hand")
    path.write_text(robot(*joints), "utf-8")
    message = refused("export", str(path), "--form", form)
    assert f"joint free: the form {form} cannot contain a floating joint" in message
    assert message.rstrip().endswith("use the form tree, or another frame")
