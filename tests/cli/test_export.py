"""`urdfkin export`: a file with its proof, and its check."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.attacks.hostile import urdf
from tests.cli.running import urdfkin


@pytest.mark.slow
def test_a_file_is_written_and_checks_itself(tmp_path: Path) -> None:
    path = tmp_path / "elbow.py"
    words = ("--to", "numpy", "--quantity", "jacobian,velocity", "--quantity", "placement", "-o", str(path))
    done = urdfkin("export", "planar_two_link", *words)
    assert (done.code, done.out) == (0, b"")
    assert "verified by Pinocchio" in done.err
    checked = urdfkin("export", "--check", str(path))
    assert checked.code == 0
    assert re.findall(r"^good (\w+): 4 test vectors", checked.text, re.MULTILINE) == [
        "jacobian",
        "velocity",
        "placement",
    ]
    path.write_text(path.read_text("utf-8").replace("cos(q_", "sin(q_"), "utf-8")
    wrong = urdfkin("export", "--check", str(path))
    assert wrong.code == 1
    assert "WRONG placement" in wrong.text


def test_it_goes_to_standard_output_where_no_file_is_named() -> None:
    done = urdfkin("export", "planar_two_link", "--to", "c", "--name", "my arm")
    assert done.code == 0
    assert "void my_arm_jacobian_batch(size_t n" in done.text


def test_what_was_not_verified_says_so_everywhere(tmp_path: Path) -> None:
    path = tmp_path / "arm.py"
    done = urdfkin("export", "planar_two_link", "--no-verify", "--to", "numpy", "-o", str(path))
    assert done.code == 3
    assert "UNVERIFIED" in path.read_text("utf-8").splitlines()[0]
    checked = urdfkin("export", "--check", str(path))
    assert checked.code == 3
    assert "UNVERIFIED" in checked.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "give a ROBOT to export, or --check FILE"),
        (("planar_two_link", "--check", "x.c"), "give a ROBOT to export, or --check FILE"),
        (("--check", "x.c", "--to", "c"), "--to does nothing with --check"),
        (("--check", "nowhere.c"), "cannot be read"),
        (("planar_two_link", "--quantity", "speed"), "speed"),
        (("planar_two_link", "--frame", "nowhere"), "nowhere"),
    ],
)
def test_a_mistake_is_one_clear_line(words: tuple[str, ...], said: str) -> None:
    done = urdfkin("export", *words)
    assert done.code == 2
    assert said in done.err
    assert done.err.count("\n") == 1


def test_a_file_on_a_terminal_commands_nobody() -> None:
    done = urdfkin(
        "export", "-", "--to", "numpy", "--no-verify", stdin=urdf("x ##vso[task.setvariable]y ::error::")
    )
    assert done.code == 3
    assert "##vso[" not in done.text
