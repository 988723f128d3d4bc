"""In any shell, disk or terminal, a command has a result, or one line of error and the right exit code."""

import json
import os
import re
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import pytest

import urdfkin
from tests.cli import running
from tests.report.documents import arms, failing
from tests.urdfs import joint, robot
from urdfkin.cli import exit
from urdfkin.errors import InputError, SourceError
from urdfkin.report import html, junit
from urdfkin.system import files
from urdfkin.system.files import read_bytes, read_start
from urdfkin.validation import campaign
from urdfkin.verify.tables import TableError

pytestmark = pytest.mark.slow
ARM = robot(joint("Gelenk_θ", "continuous", "a", "Hand Größe 3 手"), name="Ärmchen")


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM, encoding="utf-8")
    return path


def shell(line: str, cwd: Path | None = None, **env: str) -> tuple[int, str, str]:
    """Run a line of bash, in which `$URDFKIN` is the command."""
    command = ["bash", "-c", line.replace("$URDFKIN", f"{sys.executable} -m urdfkin")]
    how = {"encoding": "utf-8", "errors": "surrogateescape", "cwd": cwd, "timeout": 120}
    done = subprocess.run(command, env=os.environ | env, capture_output=True, check=False, **how)  # type: ignore[call-overload]
    assert "Traceback" not in done.stderr, done.stderr
    assert "Exception ignored" not in done.stderr, done.stderr
    return done.returncode, done.stdout, done.stderr


def good_shell(line: str, cwd: Path | None = None, **env: str) -> str:
    """Return the standard output of a line of bash, which must end with exit code 0."""
    code, out, err = shell(line, cwd, **env)
    assert code == 0, err
    return out


# -- standard streams --------------------------------------------------------------------------------------

FULL = "standard output: cannot be written: found No space left on device"
CLOSED = "standard output: cannot be written: found Bad file descriptor"
#: Exit code, and a text in the only line of standard error, of each shell line.
STREAMS = {
    **{f"{words} > /dev/full": (2, FULL) for words in ("robots", "--help", "--version", "info ur5")},
    "explain URDF101 > /dev/full": (2, FULL),
    **{f"{words} >&-": (2, CLOSED) for words in ("robots", "--help", "info ur5")},
    "info - <&-": (2, "standard input: cannot be read: found Bad file descriptor"),
    **{f"info nothing_of_this_name {closed}": (2, "") for closed in ("2>&-", "2>/dev/full", "2>&- >&-")},
}


@pytest.mark.parametrize("line", STREAMS)
def test_a_full_or_closed_standard_stream_is_reported_in_one_line(line: str) -> None:
    code, words = STREAMS[line]
    found, out, err = shell(f"$URDFKIN {line}")
    assert (found, out) == (code, "")
    if words:
        (only,) = err.splitlines()
        assert words in only


def test_a_file_is_written_although_standard_output_is_closed(tmp_path: Path) -> None:
    good_shell("$URDFKIN placement ur5 -o T.csv >&-", tmp_path)
    assert (tmp_path / "T.csv").read_text().startswith("sample,T00")


@pytest.mark.parametrize("words", ["robots", "--help", "explain 7.130"])
def test_a_command_ends_silently_with_exit_code_141_if_the_pipe_is_closed(words: str) -> None:
    code, _, err = shell(f"set -o pipefail; (sleep 0.01; $URDFKIN {words}) | true")
    assert (code, err) == (141, "")


# -- properties of the terminal ------------------------------------------------------------------------


@pytest.mark.parametrize("columns", ["", "abc", "0", "-5", "1_0", "1e3", "9999", "7", "1"])
def test_every_value_of_columns_gives_a_table(columns: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    assert "shoulder_pan_joint" in "".join(running.good("info ur5").text.split())


ASCII = (
    {"PYTHONIOENCODING": "ascii"},
    {"PYTHONIOENCODING": "ascii:strict", "LC_ALL": "C"},
    {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    {"LC_ALL": "POSIX"},
    {"PYTHONIOENCODING": "latin-1"},
)


@pytest.mark.parametrize(
    ("words", "env"),
    [
        *(("info", env) for env in ASCII),
        *((f"check{form}", ASCII[0]) for form in ("", " --format json", " --format github")),
    ],
    ids=str,
)
def test_names_of_any_script_are_printed_on_any_terminal(words: str, env: dict[str, str], arm: Path) -> None:
    out = good_shell(f"$URDFKIN {words} arm.urdf", arm.parent, **env)
    assert out or "github" in words  # this format has no output for a correct file


@pytest.mark.parametrize("form", ["terminal", "latex", "toml", "csv", "urdf", "c"])
def test_a_table_with_names_of_any_script_is_the_same_file_on_an_ascii_terminal(
    form: str, arm: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(arm.parent)
    words = f"dh arm.urdf --format {form}"
    good_shell(f"$URDFKIN {words} > table", arm.parent, **ASCII[0])
    if form != "terminal":
        assert (arm.parent / "table").read_bytes() == running.good(words).out


def test_commands_and_cached_kernels_work_with_numba_disable_jit(tmp_path: Path) -> None:
    assert "verified by Pinocchio" in good_shell("$URDFKIN placement ur5", NUMBA_DISABLE_JIT="1")
    compiling = (
        "from urdfkin.compiled.machine.single import one_configuration as made; print(made.compiled_function)"
    )
    env = {"NUMBA_DISABLE_JIT": "1", "XDG_CACHE_HOME": str(tmp_path), "NUMBA_CACHE_DIR": ""}
    assert "<Numba C callback" in running.python(compiling, env=os.environ | env).stdout
    assert list(tmp_path.rglob("*.kernel"))


# -- names of files ----------------------------------------------------------------------------------------

LONG = {"a name": "x" * 300 + ".urdf", "a path": "x/" * 3000 + "arm.urdf", "a word": "x" * 70_000}
WITH_FILES = (
    "info {}", "check {}", "validate {}", "dh {}", "dh ur5 --compare {}", "placement ur5 --q @{}",
    "placement ur5 -o {} --format csv", "report {}", "compare {} {}", "plot ur5 --trajectory {} -o x.svg",
    "validate ur5 --json {}",
)  # fmt: skip


@pytest.mark.parametrize("long", LONG)
@pytest.mark.parametrize("words", WITH_FILES)
def test_a_too_long_file_name_is_reported_in_one_line(
    words: str, long: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = running.urdfkin(*words.replace("{}", LONG[long]).split())
    assert done.code == 2, done.err
    if not words.startswith("validate {}"):
        assert "Traceback" not in done.err
        lines = [line for line in done.err.splitlines() if not line.startswith(("warning: ", "Usage", "Try"))]
        assert any("File name too long" in line or "unknown" in line for line in lines), done.err[:500]


@pytest.mark.parametrize("name", ["~nobody_of_this_name/arm.urdf", "a\x00b.urdf", "\udcff.urdf"])
def test_an_unusual_file_name_raises_an_error_of_urdfkin(name: str) -> None:
    with pytest.raises(urdfkin.UrdfkinError):
        urdfkin.load(name)


# -- pipes -------------------------------------------------------------------------------------------------


def test_a_pipe_without_a_writer_is_refused_and_reading_ends_at_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(files, "PIPE_TIMEOUT", 0.1)
    os.mkfifo(tmp_path / "pipe.urdf")
    os.mkfifo(tmp_path / "pipe.toml")
    with pytest.raises(SourceError, match="a pipe without a writer"):
        urdfkin.read_table(tmp_path / "pipe.toml")
    for take in (urdfkin.load, urdfkin.check):
        with pytest.raises(SourceError, match=r"a pipe without a writer: found nothing in 0.1 s"):
            take(tmp_path / "pipe.urdf")
    (tmp_path / "file").write_bytes(bytes(5000))
    assert len(read_start(tmp_path / "file", 1000)) == 1000
    assert len(read_start(Path("/dev/zero"), 3_000_000, pipes=True)) == 3_000_000
    assert len(read_bytes(tmp_path / "file", 5000)) == 5000


@pytest.mark.parametrize("pause", [0.0, 0.3])
def test_a_named_pipe_with_a_slow_writer_is_read_completely(pause: float, tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    content = bytes(range(256)) * 1000  # more than the buffer of a pipe

    def write() -> None:
        with path.open("wb") as pipe:  # `open` waits until the command opens the pipe
            threading.Event().wait(pause)
            pipe.write(content[:100])
            pipe.flush()
            threading.Event().wait(pause)
            pipe.write(content[100:])

    writer = threading.Thread(target=write)
    writer.start()
    try:
        assert read_bytes(path, pipes=True) == content
    finally:
        writer.join()


def test_a_process_substitution_is_read_like_a_file(arm: Path) -> None:
    assert "good" in good_shell("$URDFKIN check <(sleep 0.3; cat arm.urdf) && echo good", arm.parent)
    code, out, _ = shell("$URDFKIN check <(true)", arm.parent)
    assert (code, "URDF101" in out) == (1, True)
    good_shell("cat arm.urdf | $URDFKIN check /dev/stdin", arm.parent)


# -- exit codes ------------------------------------------------------------------------------------


def _raising(error: BaseException) -> Callable[..., Any]:
    def call(*_: object, **__: object) -> None:
        raise error

    return call


@pytest.mark.parametrize("error", [RuntimeError("odd"), MemoryError(), OSError(5, "odd"), RecursionError()])
def test_a_crash_has_exit_code_70_and_asks_for_a_report(
    error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(campaign, "validate", _raising(error))
    done = running.urdfkin("validate ur5")
    assert done.code == 70
    assert "Traceback (most recent call last)" in done.err
    last = done.err.splitlines()[-1]
    assert re.match(f"urdfkin: this is a defect of urdfkin.*{type(error).__name__}", last)
    assert "Please report it" in last


RAISED = [
    (InputError("no"), 2), (TableError("they disagree"), 1), (click.UsageError("no"), 2),
    (KeyboardInterrupt(), 130), (EOFError(), 130), (click.exceptions.Exit(3), 3),
]  # fmt: skip


@pytest.mark.parametrize(("error", "code"), RAISED)
def test_each_expected_exception_has_its_exit_code(
    error: BaseException, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["test"])
    assert exit.run(click.Command("test", callback=_raising(error)), "test") == code


def test_a_command_with_a_closed_output_pipe_exits_with_0_or_141() -> None:
    _, _, err = shell("( $URDFKIN report --schema; echo $? >&2 ) | head -c 1 >/dev/null")
    assert err.split()[-1] in ("0", "141")


@pytest.mark.parametrize("broken", ["write", "render"])
def test_if_one_format_fails_the_other_formats_are_written_and_the_report_is_printed(
    broken: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    right, full = Path.replace, _raising(OSError(28, "No space left on device"))
    code, words = {"write": (2, "r.html: cannot be written"), "render": (70, "RuntimeError: odd")}[broken]
    if broken == "render":
        monkeypatch.setattr(html, "as_files", _raising(RuntimeError("odd")))
    else:
        monkeypatch.setattr(
            Path, "replace", lambda self, to: (full if to.suffix == ".html" else right)(self, to)
        )
    forms = "--html r.html --json r.json --junit r.xml --markdown r.md"
    done = running.urdfkin(f"validate planar_two_link --samples 2 {forms}")
    assert done.code == code
    assert words in done.err
    assert {path.name for path in tmp_path.iterdir()} == {"r.json", "r.xml", "r.md"}
    assert json.loads((tmp_path / "r.json").read_text())["verdict"] == "verified"
    assert "1 robot, " in done.text


@pytest.mark.parametrize(("make", "code"), [(failing, 1), (arms, 70)])
def test_a_disagreement_exits_with_1_even_if_the_report_cannot_be_written(
    make: Callable[[], Any], code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(junit, "as_junit", _raising(RuntimeError("odd")))
    (tmp_path / "r.json").write_text(json.dumps(make()))
    done = running.urdfkin("report", str(tmp_path / "r.json"), "--junit", str(tmp_path / "r.xml"))
    assert done.code == code
    assert "RuntimeError: odd" in done.err
