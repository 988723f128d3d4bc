"""Exit 1 is a disagreement and nothing else; a crash says that it is one; what can be written is."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import pytest

from tests.cli.running import process, urdfkin
from tests.report.documents import arms
from urdfkin.cli import exit
from urdfkin.errors import InputError
from urdfkin.report import html, junit
from urdfkin.validation import campaign
from urdfkin.verify.tables import TableError


def _raising(error: BaseException) -> Callable[..., Any]:
    def call(*_: object, **__: object) -> None:
        raise error

    return call


def _run(error: BaseException) -> int:
    return exit.run(click.Command("test", callback=_raising(error)), "test")


@pytest.mark.parametrize("error", [RuntimeError("odd"), MemoryError(), OSError(5, "odd"), RecursionError()])
def test_a_crash_has_a_code_of_its_own_and_says_what_to_do(
    error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(campaign, "validate", _raising(error))
    done = urdfkin("validate", "ur5")
    assert done.code == 70
    assert "Traceback (most recent call last)" in done.err
    last = done.err.splitlines()[-1]
    assert last.startswith("urdfkin: this is a defect of urdfkin")
    assert type(error).__name__ in last
    assert "Please report it" in last


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (InputError("no"), 2),
        (TableError("they disagree"), 1),
        (click.UsageError("no"), 2),
        (KeyboardInterrupt(), 130),
        (EOFError(), 130),
        (click.exceptions.Exit(3), 3),
    ],
)
def test_what_is_raised_on_purpose_has_its_code(
    error: BaseException, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["test"])
    assert _run(error) == code


@pytest.mark.slow
def test_nobody_who_reads_the_output_is_no_success() -> None:
    done = process("robots", stdin=b"")
    assert done.code == 0
    import subprocess  # noqa: PLC0415
    import sys  # noqa: PLC0415

    command = f"{sys.executable} -m urdfkin report --schema; echo $? >&2"
    ended = subprocess.run(
        ["bash", "-c", f"( {command} ) | head -c 1 >/dev/null"], capture_output=True, text=True, check=False
    )
    assert "Traceback" not in ended.stderr
    assert ended.stderr.split()[-1] in ("0", "141")


@pytest.mark.slow
@pytest.mark.parametrize("broken", ["write", "render"])
def test_when_one_form_fails_the_others_are_written_and_the_report_is_printed(
    broken: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    if broken == "render":
        monkeypatch.setattr(html, "as_files", _raising(RuntimeError("odd")))
    else:
        right = Path.replace
        monkeypatch.setattr(
            Path, "replace", lambda self, to: right(self, to) if to.suffix != ".html" else _full(self)
        )
    forms = ("--html", "r.html", "--json", "r.json", "--junit", "r.xml", "--markdown", "r.md")
    done = urdfkin("validate", "planar_two_link", "--samples", "2", *forms)
    assert done.code == {"write": 2, "render": 70}[broken]
    assert ("r.html: cannot be written" if broken == "write" else "RuntimeError: odd") in done.err
    assert {path.name for path in tmp_path.iterdir()} == {"r.json", "r.xml", "r.md"}
    assert json.loads((tmp_path / "r.json").read_text())["verdict"] == "verified"
    assert "1 robot, " in done.text


def _full(_: Path) -> None:
    raise OSError(28, "No space left on device")


@pytest.mark.slow
def test_a_disagreement_stays_exit_1_when_its_report_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tests.report.documents import failing  # noqa: PLC0415

    monkeypatch.setattr(junit, "as_junit", _raising(RuntimeError("odd")))
    path = tmp_path / "r.json"
    path.write_text(json.dumps(failing()))
    done = urdfkin("report", str(path), "--junit", str(tmp_path / "r.xml"))
    assert done.code == 1
    assert "RuntimeError: odd" in done.err
    path.write_text(json.dumps(arms()))
    assert urdfkin("report", str(path), "--junit", str(tmp_path / "r.xml")).code == 70
