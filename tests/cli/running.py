"""Run the `urdfkin` command: in this process where its entry point will do, in one of its own where not."""

import io
import json
import os
import shlex
import subprocess
import sys
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from urdfkin.cli import main
from urdfkin.system.processes import own_python


@dataclass(frozen=True)
class Done:
    """What a command left behind."""

    code: int
    out: bytes
    err: str

    @property
    def text(self) -> str:
        """Standard output as text."""
        return self.out.decode()

    @property
    def data(self) -> Any:
        """Standard output as JSON; NaN and Infinity are none."""
        return json.loads(self.text, parse_constant=_refused)


def _refused(word: str) -> None:
    raise ValueError(f"{word} is no JSON")


def urdfkin(*words: str, stdin: str | bytes = b"") -> Done:
    """The entry point of the installed command, called here: no new process, the same code.

    The first of the words may be a line as one types it: `urdfkin("info ur5 --format", form)`.
    """
    words = (*shlex.split(words[0]), *words[1:]) if words and " " in words[0] else words
    data = stdin.encode() if isinstance(stdin, str) else stdin
    out, err = io.BytesIO(), io.StringIO()
    code = 0
    with _streams(words, io.TextIOWrapper(io.BytesIO(data)), io.TextIOWrapper(out, write_through=True), err):
        try:
            main()
        except SystemExit as leave:
            code = leave.code if isinstance(leave.code, int) else int(leave.code is not None)
    return Done(code, out.getvalue(), err.getvalue())


def good(*words: str, stdin: str | bytes = b"") -> Done:
    """The same, of a command that ends with exit code 0."""
    done = urdfkin(*words, stdin=stdin)
    assert done.code == 0, done.err or done.text
    return done


def refused(*words: str, stdin: str | bytes = b"") -> str:
    """The message of a command that is a mistake: exit code 2, nothing on standard output, no traceback."""
    done = urdfkin(*words, stdin=stdin)
    assert (done.code, done.out) == (2, b""), done.err or done.text
    assert "Traceback" not in done.err
    return done.err


def python(code: str, *words: str, check: bool = True, **how: Any) -> subprocess.CompletedProcess[str]:
    """A program in a process of its own, which succeeds unless `check` is false."""
    command = [sys.executable, "-c", code, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, **how)
    assert done.returncode == 0 or not check, done.stderr
    return done


@contextmanager
def _streams(
    words: tuple[str, ...], stdin: io.TextIOWrapper, stdout: io.TextIOWrapper, stderr: io.StringIO
) -> Iterator[None]:
    before = sys.argv, sys.stdin, sys.stdout, sys.stderr
    sys.argv, sys.stdin, sys.stdout, sys.stderr = ["urdfkin", *words], stdin, stdout, stderr
    try:
        yield
    finally:
        stdout.flush()
        stdout.detach()
        sys.argv, sys.stdin, sys.stdout, sys.stderr = before


def imported(lines: Sequence[str], modules: Collection[str]) -> dict[str, list[str]]:
    """Run commands one after the other in one new process; return those after which modules are imported.

    A module that a command imports stays imported, so the commands after it are returned too.
    """
    code = (
        "import json, shlex\nfrom urdfkin.cli import main\nfound = {}\n"
        f"for line in {[*lines]!r}:\n sys.argv = ['urdfkin', *shlex.split(line)]\n"
        " try: main()\n except SystemExit as end:\n"
        f"  seen = sorted({set(modules)!r} & set(sys.modules)) + [f'exit {{end.code}}'] * bool(end.code)\n"
        "  if seen: found[line] = seen\n else: found[line] = ['no exit']\nprint('\\n' + json.dumps(found))"
    )
    done = subprocess.run(own_python(f"exec({code!r})"), check=True, capture_output=True, text=True)
    found: dict[str, list[str]] = json.loads(done.stdout.splitlines()[-1])
    return found


def process(*words: str, stdin: bytes = b"", cwd: Path | None = None, **env: str) -> Done:
    """`python -m urdfkin` in a process of its own."""
    command, env = [sys.executable, "-m", "urdfkin", *words], os.environ | env
    done = subprocess.run(command, input=stdin, cwd=cwd, env=env, capture_output=True, check=False)
    return Done(done.returncode, done.stdout, done.stderr.decode())
