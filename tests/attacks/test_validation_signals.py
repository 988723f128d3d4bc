"""SIGTERM and SIGHUP end a validation as Ctrl-C does, and workers end with their parent process."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.cli.running import Done, python, urdfkin
from urdfkin.cli.exit import Stop, handle_signals
from urdfkin.errors import InputError
from urdfkin.robot import Robot
from urdfkin.validation import accuracy, answer
from urdfkin.validation.chunk import Chunk, ChunkResult, run_chunk

pytestmark = pytest.mark.long

#: The command `urdfkin`, which also prints a line when a chunk of the second robot is done.
_SCRIPT = """
import sys
from urdfkin.validation import campaign
right = campaign.validate

def validate(*args, **how):
    def progress(state):
        if state.label == "talos" and state.robots_done == 1:
            print("talos", flush=True)
    return right(*args, **how | {"progress": progress})

campaign.validate = validate
from urdfkin.cli import main
main()
"""


@contextmanager
def running(*words: str, cwd: Path) -> Iterator[subprocess.Popen[str]]:
    """Yield a validation that has finished the first robot and is far from finishing the second."""
    command = [sys.executable, "-c", _SCRIPT, "validate", "planar_two_link", "talos", *words]
    with subprocess.Popen(
        command, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, process_group=0
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "talos\n", process.communicate()
            yield process
        finally:
            with suppress(ProcessLookupError):
                process.kill()


def children(of: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{of}/task/{of}/children").read_text().split()]


def end_soon(processes: list[int]) -> bool:
    """Return whether all processes end within 30 s."""
    deadline = time.monotonic() + 30
    while any(map(_is_alive, processes)) and time.monotonic() < deadline:
        time.sleep(0.1)
    return not any(map(_is_alive, processes))


def _is_alive(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except (OSError, IndexError):
        return False
    return state not in "ZX"


@pytest.mark.parametrize(
    ("how", "number"),
    [
        ("--jobs 2", signal.SIGTERM),
        ("", signal.SIGTERM),
        ("--isolate", signal.SIGHUP),
        ("--jobs 2", signal.SIGINT),
    ],
)
def test_a_signal_keeps_finished_results_in_every_report(
    number: signal.Signals, how: str, tmp_path: Path
) -> None:
    options = ("--samples", "1000", "--json", "r.json", "--junit", "r.xml", *how.split())
    with running(*options, cwd=tmp_path) as process:
        workers = children(process.pid)
        assert len(workers) == {"--jobs 2": 2, "--isolate": 1}.get(how, 0)
        process.send_signal(number)
        out, err = process.communicate(timeout=120)
    assert process.returncode == 128 + number, err
    assert end_soon(workers)
    document = json.loads((tmp_path / "r.json").read_text())
    assert (document["interrupted"], document["verdict"], document["robots_requested"]) == (
        True,
        "interrupted",
        2,
    )
    first, second = document["robots"]
    assert (first["verdict"], first["samples"]) == ("verified", 1_003)
    assert (second["verdict"], second["failed"]) == ("not verified", 0)
    assert 0 < second["samples"] < 1_003
    assert second["reason"].startswith("interrupted: ")
    assert "the validation was interrupted before everything was compared" in out
    assert 'message="the validation was interrupted before' in (tmp_path / "r.xml").read_text()
    assert "Traceback" not in err


def test_workers_end_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    with running("--samples", "1000", "--jobs", "2", cwd=tmp_path) as process:
        workers = children(process.pid)
        assert len(workers) == 2
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        assert end_soon(workers)


def test_a_worker_ends_when_its_pipe_closes() -> None:
    code = (
        "import os, sys, time; from multiprocessing import Pipe\n"
        "from urdfkin.validation import worker_processes as worker\n"
        "ours, theirs = Pipe()\n"
        "child = os.fork()\n"
        "if not child:\n"
        "    ours.close(); worker._end_with = lambda parent: None; worker.serve(theirs.fileno(), 0)\n"
        "theirs.close(); ours.close()\n"
        "deadline = time.monotonic() + 30\n"
        "while os.waitpid(child, os.WNOHANG) == (0, 0):\n"
        "    if time.monotonic() > deadline: os.kill(child, 9); sys.exit('still there')\n"
        "    time.sleep(0.05)\n"
    )
    python(code)


def test_a_worker_without_a_parent_does_not_start_and_a_disagreement_keeps_its_exit_code() -> None:
    code = "from urdfkin.validation.worker_processes import _end_with; _end_with(1 << 22); print('began')"
    done = python(code, check=False)
    assert (done.returncode, done.stdout) == (0, "")
    assert Stop(signal.SIGTERM).exit_code(130) == 143
    assert Stop(signal.SIGTERM).exit_code(1) == 1
    assert Stop().exit_code(3) == 3


def test_only_the_first_signal_interrupts_and_the_handlers_are_restored() -> None:
    before = [signal.getsignal(each) for each in (signal.SIGTERM, signal.SIGHUP)]
    try:
        signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as the command nohup does
        with handle_signals() as stop:
            os.kill(os.getpid(), signal.SIGHUP)
        assert stop.signal is None
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGTERM) is before[0]
        interrupts = 0
        with handle_signals() as stop:
            try:
                os.kill(os.getpid(), signal.SIGTERM)
            except KeyboardInterrupt:
                interrupts += 1
            os.kill(os.getpid(), signal.SIGTERM)
        assert (interrupts, stop.signal) == (1, signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGTERM)  # while finished results are written
    finally:
        for each, handler in zip((signal.SIGTERM, signal.SIGHUP), before, strict=True):
            signal.signal(each, handler)


class Dying:
    def __del__(self) -> None:
        signal.raise_signal(signal.SIGTERM)  # Python ignores the KeyboardInterrupt of the handler.


def run_and_restore_the_handlers(command: str) -> Done:
    before = [signal.getsignal(each) for each in (signal.SIGTERM, signal.SIGHUP)]
    try:
        return urdfkin(command)
    finally:
        for each, handler in zip((signal.SIGTERM, signal.SIGHUP), before, strict=True):
            signal.signal(each, handler)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_signal_in_a_destructor_during_the_accuracy_study_stops_the_run_after_the_robot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def study(robot: Robot, **_: object) -> None:
        studies.append(robot.name)
        Dying()
        raise InputError("not to be studied")

    studies: list[str] = []
    monkeypatch.setattr(accuracy, "accuracy_study", study)
    done = run_and_restore_the_handlers("validate planar_two_link ur5 --samples 0 --accuracy")
    assert (done.code, studies) == (143, ["planar_two_link"])


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_signal_in_a_destructor_stops_the_run_after_the_chunk(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(chunk: Chunk) -> ChunkResult:
        chunks.append(chunk)
        Dying()
        return run_chunk(chunk)

    chunks: list[Chunk] = []
    monkeypatch.setattr(answer, "run_chunk", run)
    done = run_and_restore_the_handlers("validate planar_two_link --samples 200")
    assert (done.code, len(chunks)) == (143, 1)
    assert "interrupted: 28 of 203 samples" in done.text
