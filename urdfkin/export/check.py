"""Run what a file brings with it: compile or import it, and have it compute its test vectors.

The file is run as code, as its user would run it: from someone else's hands it deserves the same care.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from urdfkin.errors import InputError
from urdfkin.system.files import read_text

#: What every file says in its first lines.
_MARK = "straight-line code for this robot and frame"
_MAIN = re.compile(r"^#ifdef (\w+)_MAIN$", re.MULTILINE)
_STRICT = ("-Wall", "-Wextra", "-pedantic", "-Werror")
#: Of a file's first lines.
_HEAD = 2000
#: Seconds that nothing takes; a robot of a thousand joints compiles in one of these minutes.
_PATIENCE = 600.0


@dataclass(frozen=True, slots=True)
class Checked:
    """What a file says of itself.

    Attributes:
        lines: One for each function and precision.
        good: Whether all of them compute what they should.
        verified: Whether Pinocchio confirmed what was printed.
    """

    lines: tuple[str, ...]
    good: bool
    verified: bool


def check(file: Path) -> Checked:
    """Compile or import a file that `export` wrote, and run its test vectors.

    Raises:
        InputError: another file, or one that does not run here; the message says what is missing.
        SourceError: it cannot be read.
    """
    text = read_text(file)
    head = text[:_HEAD]
    if _MARK not in head:
        raise InputError("not a file that urdfkin export has written", where=str(file))
    with tempfile.TemporaryDirectory() as folder:
        runs = {".c": _compiled, ".hpp": _compiled, ".py": _imported, ".m": _octave}
        if (run := runs.get(file.suffix)) is None:
            raise InputError(
                "nothing that runs",
                where=str(file),
                found=file.suffix or "no ending",
                remedy=f"check a file that ends in {', '.join(runs)}",
            )
        lines = tuple(line for words in run(file, text, Path(folder)) for line in words)
    if not lines:
        raise InputError("a file without test vectors", where=str(file))
    return Checked(lines, all(line.startswith("good ") for line in lines), "UNVERIFIED" not in head)


def _compiled(file: Path, text: str, folder: Path) -> Iterator[list[str]]:
    """In both precisions, by the system's compiler with all its warnings as errors."""
    found = _MAIN.search(text)
    if found is None:
        raise InputError("a file without test vectors", where=str(file))
    plain = file.suffix == ".c"
    compiler = _program("cc" if plain else "c++", file)
    language = ["-std=c99", "-x", "c"] if plain else ["-std=c++11", "-x", "c++"]
    for real in ("double", "float"):
        macros = [f"-D{found[1]}_MAIN", f"-D{found[1]}_REAL={real}"]
        built = folder / real
        _run(
            [compiler, *language, "-O1", *_STRICT, *macros, str(file.resolve()), "-o", str(built), "-lm"],
            file,
        )
        yield [f"{line} ({real})" for line in _run([str(built)], file)]


def _imported(file: Path, text: str, folder: Path) -> Iterator[list[str]]:
    yield _run([sys.executable, str(file.resolve())], file, cwd=folder)


def _octave(file: Path, text: str, folder: Path) -> Iterator[list[str]]:
    shutil.copy(file, folder / file.name)
    yield _run(
        [_program("octave-cli", file), "--no-init-file", "--eval", f"{file.stem}().check();"],
        file,
        cwd=folder,
    )


def _program(name: str, file: Path) -> str:
    if (found := shutil.which(name)) is None:
        raise InputError(f"{name} is not installed, which checks this file", where=str(file))
    return found


def _run(command: Sequence[str], file: Path, cwd: Path | None = None) -> list[str]:
    """The verdicts that a command prints."""
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, errors="replace", timeout=_PATIENCE, check=False, cwd=cwd
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise InputError("the file does not run", where=str(file), found=str(error)) from None
    lines = [line for line in done.stdout.splitlines() if line.startswith(("good ", "WRONG "))]
    if done.returncode != 0 and not any(line.startswith("WRONG ") for line in lines):
        words = (done.stderr.strip() or done.stdout.strip()).splitlines()
        first = next((line for line in words if "error" in line.lower()), "")
        raise InputError("the file does not run", where=str(file), found=first or (words or ["no word"])[-1])
    return lines
