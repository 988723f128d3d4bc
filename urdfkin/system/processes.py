"""Child processes, and threads with a large stack.

The current folder may contain untrusted files. With the options -c and -m, Python searches the current folder
for modules first. Python would therefore run a file `json.py` beside a robot. The function `python_command`
prevents this search. Libraries also search the current folder for settings files.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

from urdfkin.system.locks import make_fork_safe_lock

#: Environment variables that a Python interpreter may need to start.
_INHERITED_VARIABLES = ("LD_LIBRARY_PATH",)
#: Linear algebra uses a single thread, because a confined process has little address space for threads.
_EXTRA_VARIABLES = {"OPENBLAS_NUM_THREADS": "1"}


def python_command(code: str, *, options: Sequence[str] = ()) -> list[str]:
    """Return a command that runs code in a new interpreter.

    The new interpreter imports from the absolute paths in `sys.path`, except Dask's temporary folder, and
    from the folder that contains the package urdfkin. It searches the current folder only if the absolute
    path of this folder is one of these paths, for example by PYTHONPATH.
    """
    return [sys.executable, "-I", *options, "-c", f"import sys; sys.path[:] = {_import_path()!r}; {code}"]


def _import_path() -> list[str]:
    # Empty and relative `sys.path` entries depend on the current folder.
    package_parent = str(Path(__file__).resolve().parents[2])
    return [
        *(entry for entry in sys.path if Path(entry).is_absolute() and not _is_dask_folder(entry)),
        package_parent,
    ]


def _is_dask_folder(entry: str) -> bool:
    """Return whether an entry of `sys.path` is in Dask's temporary folder, which other users can change."""
    return any(part.startswith("dask-scratch-space") for part in Path(entry).parts)


def run_python(
    command: list[str], request: bytes, timeout: float, max_bytes: int
) -> tuple[bytes, int | None]:
    """Run a process with a minimal environment and a request on standard input.

    The process is killed after `timeout` seconds, or if the output exceeds `max_bytes` bytes. Return at most
    `max_bytes` + 1 bytes of the output, and the exit status. After a timeout, the status is None.
    """
    import subprocess

    environ = _EXTRA_VARIABLES | {
        name: os.environ[name] for name in _INHERITED_VARIABLES if name in os.environ
    }
    pipe = subprocess.PIPE
    timed_out = threading.Event()
    with subprocess.Popen(
        command, env=environ, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL
    ) as process:

        def give_up() -> None:
            timed_out.set()
            process.kill()

        timer = threading.Timer(timeout, give_up)
        timer.start()
        try:
            assert process.stdin is not None
            assert process.stdout is not None
            with suppress(BrokenPipeError), process.stdin:
                process.stdin.write(request)
            output = process.stdout.read(max_bytes + 1)
            if len(output) > max_bytes:
                process.kill()
            status = process.wait()
        finally:
            timer.cancel()
            process.kill()
    return output, None if timed_out.is_set() else status


@contextmanager
def leave_folder_with_settings(settings_file: str) -> Iterator[None]:
    """Leave the current folder if it contains a settings file that must not be read.

    Inside the context, the current folder is then `/`.
    """
    if not os.path.lexists(settings_file):
        yield
        return
    folder_descriptor = os.open(".", os.O_PATH)
    os.chdir("/")
    try:
        yield
    finally:
        os.fchdir(folder_descriptor)
        os.close(folder_descriptor)


_T = TypeVar("_T")

_DEFAULT_STACK_BYTES = 8 * 2**20
_stack_size_lock = make_fork_safe_lock()


def call_with_stack(size: int, function: Callable[[], _T]) -> _T:
    """Call `function` on a stack of at least `size` bytes, and return the result.

    Pinocchio and its parser are recursive: a chain of about 3,000 links overflows a stack of 8 MiB.
    """
    from concurrent.futures import Future

    future: Future[_T] = Future()

    def run() -> None:
        try:
            future.set_result(function())
        except BaseException as error:
            future.set_exception(error)

    # The stack size is a global setting of the process.
    with _stack_size_lock:
        before = threading.stack_size(max(size, _DEFAULT_STACK_BYTES))
        try:
            thread = threading.Thread(target=run)
            thread.start()
        finally:
            threading.stack_size(before)
    thread.join()
    return future.result()
