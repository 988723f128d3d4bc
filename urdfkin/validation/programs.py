"""Compute a quantity with an external program in any language; requests and answers are lines of JSON.

Each request is one line on the program's standard input:

    {"robot": "/tmp/.../robot.urdf", "quantity": "jacobian", "frame": "tool0",
     "reference": "local_world_aligned", "coordinates": ["shoulder", ...],
     "q": [...], "v": [...], "a": [...]}

`coordinates` contains the names of the numbers in q. The entries `v` and `a` are present if the quantity
needs them. The entry `reference` is present if the quantity has a reference frame. The entries `lock` (values
of locked joints), `root_joint` and `convention` are present if the user gave them. The entry `mimic` is
present, with the value false, if each mimic joint has its own coordinate, as with --no-mimic. The URDF file
contains neither the values of locked joints nor the root joint. The answer is one line:

    {"result": [[...], ...]}    or    {"error": "a text"}

The program runs with the rights of the user who starts it. If the program hangs, ends or gives an invalid
answer, the call raises `ProgramError` and stops the program. The next call starts the program again. After
three consecutive failures, the program is not started again. An answer with the entry `error` raises
`ProgramError`, but does not stop the program.
"""

from __future__ import annotations

import json
import os
import selectors
import subprocess
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, TYPE_CHECKING

from urdfkin.errors import InputError, SourceError
from urdfkin.errors.escape import json_text
from urdfkin.model.tree import FloatArray

if TYPE_CHECKING:
    from urdfkin.robot import Robot

_MAX_ANSWER_BYTES = 64 * 2**20
#: Maximum length of a program's error text in a message. The length is in characters for an entry `error`,
#: and in bytes for the program's standard error.
_MAX_ERROR_LENGTH = 300
#: Number of consecutive failures after which the program is not started again.
_MAX_FAILURES = 3
#: Maximum time limit for an answer: one day, in seconds.
_MAX_TIMEOUT = 86400.0


class ProgramError(Exception):
    """The program gave no result for a request."""


class Program:
    """A program that computes one quantity of one frame.

    Call the object with q, with q and v, or with q, v and a, as the quantity requires.

    Args:
        command: The program and its arguments. No shell is involved.
        robot: The robot; the program receives the path of a file with the robot's URDF, and the joint names.
        quantity: Name of the quantity.
        frame: Name of the frame.
        reference: Name of the reference frame; None if the quantity has no reference frame.
        convention: Name of the convention of q, v, a and the result; None for urdfkin's convention.
        timeout: Longest time for an answer, in seconds: above 0, and at most 86,400 (one day).

    Raises:
        InputError: the command is empty, or `timeout` is outside its range.
        SourceError: the program cannot be started.

    >>> import urdfkin
    >>> arm = urdfkin.load("planar_two_link")
    >>> command = ["sed", "-u", 's/.*/{"result": [1]}/']  # the same answer to every request
    >>> with Program(command, arm, "jacobian", "tip", "local_world_aligned") as program:
    ...     program(arm.neutral())
    [1]
    """

    def __init__(
        self,
        command: Sequence[str],
        robot: Robot,
        quantity: str,
        frame: str,
        reference: str | None,
        convention: str | None = None,
        timeout: float = 10.0,
    ) -> None:
        if not command:
            raise InputError("a program needs a command")
        if not 0.0 < timeout <= _MAX_TIMEOUT:
            raise InputError(
                f"the timeout must be above 0 and at most {_MAX_TIMEOUT:g} seconds", found=repr(timeout)
            )
        self.command, self.timeout = list(command), timeout
        self.__name__ = Path(command[0]).name
        names = robot if convention is None else robot.convention(convention)
        self._request_entries: dict[str, object] = {
            "quantity": quantity,
            "frame": frame,
            "coordinates": list(names.coordinate_names),
        }
        if robot.origin.lock:
            self._request_entries["lock"] = dict(robot.origin.lock)
        if not robot.verifier.mimic:
            self._request_entries["mimic"] = False
        if robot.root_joint is not None:
            self._request_entries["root_joint"] = robot.root_joint
        if convention is not None:
            self._request_entries["convention"] = convention
        if reference is not None:
            self._request_entries["reference"] = reference
        self._urdf, self._failures = robot.urdf, 0
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Program:
        self._folder = tempfile.TemporaryDirectory(prefix="urdfkin-program-")
        path = Path(self._folder.name, "robot.urdf")
        path.write_text(self._urdf, encoding="utf-8")
        self._request_entries["robot"] = str(path)
        try:
            self._start()
        except BaseException:
            self._folder.cleanup()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stop()
        self._folder.cleanup()

    def __call__(self, *inputs: FloatArray) -> object:
        """Return the program's result for one configuration.

        Raises:
            ProgramError: the program ended, took too long, gave an invalid answer, or answered with an
                error. After three consecutive failures, the program is not called again. An answer with
                an error is not a failure.
            SourceError: the program cannot be started again.
        """
        if self._failures >= _MAX_FAILURES:
            raise ProgramError(f"not called: the program failed {_MAX_FAILURES} times in a row")
        if self._process is None:
            self._start()
        values = {letter: x.tolist() for letter, x in zip("qva", inputs, strict=False)}
        request = json_text({**self._request_entries, **values}).replace("\n", " ") + "\n"
        try:
            answer = self._parse_answer(self._request_answer(request.encode()))
        except ProgramError:
            self._failures += 1
            self._stop()  # A delayed answer would be read as the next request's answer.
            raise
        self._failures = 0
        if isinstance(message := answer.get("error"), str):
            raise ProgramError(message[:_MAX_ERROR_LENGTH])
        return answer["result"]

    def _start(self) -> None:
        self._error_output: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115  The process writes to the file.
        try:
            self._process = subprocess.Popen(
                self.command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._error_output,
                bufsize=0,
            )
        except OSError as error:
            raise SourceError(
                "the program cannot be started", where=self.command[0], found=error.strerror or str(error)
            ) from None

    def _stop(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout, self._error_output):
            assert stream is not None
            with suppress(OSError):
                stream.close()

    def _request_answer(self, request: bytes) -> bytes:
        """Write and read at the same time, because a program may answer before it has read the request."""
        process = self._process
        assert process is not None
        assert process.stdin is not None
        assert process.stdout is not None
        deadline, sent, line = time.monotonic() + self.timeout, 0, bytearray()
        os.set_blocking(process.stdin.fileno(), False)
        with selectors.DefaultSelector() as selector:
            selector.register(process.stdin, selectors.EVENT_WRITE)
            selector.register(process.stdout, selectors.EVENT_READ)
            while not line.endswith(b"\n"):
                events = selector.select(max(0.0, deadline - time.monotonic()))
                if not events:
                    self._stop()
                    raise ProgramError(f"no answer within {self.timeout:g} s; the program was stopped")
                for key, _ in events:
                    if key.fileobj is process.stdin:
                        with suppress(BrokenPipeError):
                            sent += os.write(process.stdin.fileno(), request[sent : sent + 65536])
                            if sent < len(request):
                                continue
                        selector.unregister(process.stdin)
                    elif part := os.read(process.stdout.fileno(), 65536):
                        line += part
                    else:
                        raise ProgramError(self._describe_exit())
                if len(line) > _MAX_ANSWER_BYTES:
                    self._stop()
                    raise ProgramError(f"the answer is longer than {_MAX_ANSWER_BYTES} bytes")
        return bytes(line)

    def _describe_exit(self) -> str:
        assert self._process is not None
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0)
        status = self._process.poll()
        self._error_output.seek(0, os.SEEK_END)
        self._error_output.seek(max(0, self._error_output.tell() - _MAX_ERROR_LENGTH))
        message = " ".join(self._error_output.read(_MAX_ERROR_LENGTH).decode(errors="replace").split())
        self._stop()
        how = "closed its output" if status is None else f"ended with exit code {status}"
        return f"the program {how}" + (f": {message}" if message else "")

    @staticmethod
    def _parse_answer(line: bytes) -> dict[str, object]:
        try:
            answer = json.loads(line)
        except (ValueError, RecursionError):
            shown = line[:80].decode(errors="replace").strip()
            raise ProgramError(f"the answer is not JSON: {shown!r}") from None
        if isinstance(answer, dict) and ("result" in answer or isinstance(answer.get("error"), str)):
            return answer
        raise ProgramError('the answer has no member "result"')
