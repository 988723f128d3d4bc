"""SIGTERM and SIGHUP end a validation as Ctrl-C does, and workers end with their parent, however it dies."""

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

from tests.cli.running import python
from urdfkin.cli.exit import Stop, stoppable

pytestmark = pytest.mark.long

#: The command, which says when a chunk of the second robot is done.
_SCRIPT = """
import sys
from urdfkin.validation import campaign
right = campaign.validate

def told(*args, **how):
    def tell(standing):
        if standing.label == "talos" and standing.robots_done == 1:
            print("talos", flush=True)
    return right(*args, **how | {"progress": tell})

campaign.validate = told
from urdfkin.cli import main
main()
"""


@contextmanager
def running(*words: str, cwd: Path) -> Iterator[subprocess.Popen[str]]:
    """A validation that has finished one robot and will not finish the next for a long time."""
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


def gone(processes: list[int]) -> bool:
    """Whether all of them end within a time that is long for this."""
    for _ in range(300):
        if not any(_alive(process) for process in processes):
            return True
        time.sleep(0.1)
    return False


def _alive(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except (OSError, IndexError):
        return False
    return state not in "ZX"


ENDED = [
    (signal.SIGTERM, "--jobs 2"),
    (signal.SIGTERM, ""),
    (signal.SIGHUP, "--isolate"),
    (signal.SIGINT, "--jobs 2"),
]


@pytest.mark.parametrize(("number", "how"), ENDED)
def test_a_signal_keeps_what_had_finished_and_says_so(
    number: signal.Signals, how: str, tmp_path: Path
) -> None:
    with running(
        "--samples", "1000", "--json", "r.json", "--junit", "r.xml", *how.split(), cwd=tmp_path
    ) as process:
        workers = children(process.pid)
        assert len(workers) == {"--jobs 2": 2, "--isolate": 1}.get(how, 0)
        process.send_signal(number)
        out, err = process.communicate(timeout=120)
    assert process.returncode == 128 + number, err
    assert gone(workers)
    document = json.loads((tmp_path / "r.json").read_text())
    assert (document["interrupted"], document["verdict"], document["asked"]) == (True, "interrupted", 2)
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
        assert gone(workers)


def test_a_worker_ends_at_the_end_of_its_pipe_alone(tmp_path: Path) -> None:
    """Where the kernel does not do it: the parent lives, the pipe has ended."""
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


def test_a_worker_whose_parent_is_gone_does_not_begin_and_a_disagreement_stays_one() -> None:
    code = "from urdfkin.validation.worker_processes import _end_with; _end_with(1 << 22); print('began')"
    done = python(code, check=False)
    assert (done.returncode, done.stdout) == (0, "")
    assert Stop(signal.SIGTERM).exit_code(130) == 143
    assert Stop(signal.SIGTERM).exit_code(1) == 1
    assert Stop().exit_code(3) == 3


def test_only_the_first_signal_interrupts_and_the_handlers_are_put_back() -> None:
    before = [signal.getsignal(each) for each in (signal.SIGTERM, signal.SIGHUP)]
    try:
        signal.signal(signal.SIGHUP, signal.SIG_IGN)  # nohup
        with stoppable() as stop:
            os.kill(os.getpid(), signal.SIGHUP)
        assert stop.signal is None
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGTERM) is before[0]
        interrupts = 0
        with stoppable() as stop:
            try:
                os.kill(os.getpid(), signal.SIGTERM)
            except KeyboardInterrupt:
                interrupts += 1
            os.kill(os.getpid(), signal.SIGTERM)
        assert (interrupts, stop.signal) == (1, signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGTERM)  # what had finished is being written
    finally:
        for each, handler in zip((signal.SIGTERM, signal.SIGHUP), before, strict=True):
            signal.signal(each, handler)
