"""Run the command `urdfkin` in this process, or in a new process."""

import csv
import io
import json
import os
import shlex
import subprocess
import sys
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from urdfkin.cli import main
from urdfkin.model.tree import FloatArray
from urdfkin.system.processes import python_command


@dataclass(frozen=True)
class Done:
    """The exit code and the output of a command."""

    code: int
    out: bytes
    err: str

    @property
    def text(self) -> str:
        return self.out.decode()

    @property
    def data(self) -> Any:
        """Standard output as JSON; ValueError for NaN and Infinity."""
        return json.loads(self.text, parse_constant=_reject)

    @property
    def rows(self) -> list[list[str]]:
        """Standard output as the rows of a CSV file."""
        return [*csv.reader(io.StringIO(self.text))]

    @property
    def array(self) -> FloatArray:
        """Standard output as the array of an .npy file."""
        array: FloatArray = np.load(io.BytesIO(self.out))
        return array


def numbers(values: Iterable[float]) -> str:
    """Write numbers to the last digit, as one word of a command line."""
    return ",".join(repr(float(value)) for value in values)


def _reject(word: str) -> None:
    raise ValueError(f"{word} is not JSON")


def urdfkin(*words: str, stdin: str | bytes = b"") -> Done:
    """Run the command in this process. The first word may be a line: `urdfkin("info ur5 --format", form)`."""
    words = (*shlex.split(words[0]), *words[1:]) if words and " " in words[0] else words
    data = stdin.encode() if isinstance(stdin, str) else stdin
    out, err, code = io.BytesIO(), io.StringIO(), 0
    stdout = io.TextIOWrapper(out, write_through=True)
    before = sys.argv, sys.stdin, sys.stdout, sys.stderr
    sys.argv, sys.stdin = ["urdfkin", *words], io.TextIOWrapper(io.BytesIO(data))
    sys.stdout, sys.stderr = stdout, err
    try:
        main()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    finally:
        stdout.flush()
        stdout.detach()
        sys.argv, sys.stdin, sys.stdout, sys.stderr = before
    return Done(code, out.getvalue(), err.getvalue())


def good(*words: str, stdin: str | bytes = b"") -> Done:
    """Run the command in this process; it must end with exit code 0."""
    done = urdfkin(*words, stdin=stdin)
    assert done.code == 0, done.err or done.text
    return done


def refused(*words: str, stdin: str | bytes = b"") -> str:
    """Return the message of a wrong command: exit code 2, no standard output, no traceback."""
    done = urdfkin(*words, stdin=stdin)
    assert (done.code, done.out) == (2, b""), done.err or done.text
    assert "Traceback" not in done.err
    return done.err


def python(code: str, *words: str, check: bool = True, **how: Any) -> subprocess.CompletedProcess[str]:
    """Run Python code in a new process, which must succeed if `check` is true."""
    command = [sys.executable, "-c", code, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, **how)
    assert done.returncode == 0 or not check, done.stderr
    return done


def imported(lines: Sequence[str], modules: Collection[str]) -> dict[str, list[str]]:
    """Run commands one after the other in one new process.

    Return each command after which some of `modules` are imported, with their names. The modules stay
    imported, so the later commands are returned too. A command that fails is returned with its exit code.
    """
    code = (
        "import json, shlex\nfrom urdfkin.cli import main\nfound = {}\n"
        f"for line in {[*lines]!r}:\n sys.argv = ['urdfkin', *shlex.split(line)]\n"
        " try: main()\n except SystemExit as end:\n"
        f"  seen = sorted({set(modules)!r} & set(sys.modules)) + [f'exit {{end.code}}'] * bool(end.code)\n"
        "  if seen: found[line] = seen\n else: found[line] = ['no exit']\nprint('\\n' + json.dumps(found))"
    )
    done = subprocess.run(python_command(f"exec({code!r})"), check=True, capture_output=True, text=True)
    found: dict[str, list[str]] = json.loads(done.stdout.splitlines()[-1])
    return found


def process(*words: str, stdin: bytes = b"", cwd: Path | None = None, **env: str) -> Done:
    """Run `python -m urdfkin` in a new process."""
    command, env = [sys.executable, "-m", "urdfkin", *words], os.environ | env
    done = subprocess.run(command, input=stdin, cwd=cwd, env=env, capture_output=True, check=False)
    return Done(done.returncode, done.stdout, done.stderr.decode())
