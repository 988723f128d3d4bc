"""A process of ours that answers chunks, and how it ended. It imports no more than that takes.

A machine of a cluster has it imported beside its own work: what computes is imported in the process alone.
"""

from __future__ import annotations

import os
import signal
import subprocess
from contextlib import suppress
from multiprocessing import Pipe

from urdfkin.system.interpreter import own_python

#: The module whose `serve` a process runs.
WORKER = "urdfkin.validation.worker"
#: Seconds that lie at most between the end of a worker's pipe and its own.
_GRACE = 5.0


class Child:
    """A process, and the connection to it: chunks go in, answers come out."""

    def __init__(self) -> None:
        self.connection, theirs = Pipe()
        try:
            self._process = _interpreter(theirs.fileno())
        except BaseException:
            self.connection.close()
            raise
        finally:
            theirs.close()  # so that the end of the process is the end of the pipe

    @property
    def alive(self) -> bool:
        """Whether it has not ended by itself."""
        return self._process.poll() is None

    def end(self) -> None:
        """End the process at once."""
        self.connection.close()
        self._process.kill()
        self._process.wait()

    def cause(self) -> str:
        """How the process ended, which is at its end: what it said is over."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_GRACE)
        self.end()
        return _cause(self._process.returncode)


def _interpreter(pipe: int) -> subprocess.Popen[bytes]:
    """An interpreter that imports what this one does, but nothing from the current folder or the main module.

    It leaves an interrupt by the terminal to this process, which keeps what is there: hence its own group.
    """
    command = own_python(f"from {WORKER} import serve; serve({pipe}, {os.getpid()})")
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, pass_fds=[pipe], process_group=0)


def _cause(status: int) -> str:
    """What an exit status says: a signal's name, or the number.

    >>> _cause(-11), _cause(3)
    ('signal SIGSEGV', 'exit status 3')
    """
    if status >= 0:
        return f"exit status {status}"
    try:
        name = signal.Signals(-status).name
    except ValueError:
        name = str(-status)
    return f"signal {name}" + (", as when memory runs out" if status == -signal.SIGKILL else "")
