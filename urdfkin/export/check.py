"""Run the test vectors of an exported file, and check that the file is unchanged.

The line "Seal" in the header contains a checksum of the file's text. The checksum does not prove who wrote
the file.

The check runs the file as code, so check only files from people that you trust. The check runs a copy of the
file in a separate folder. In the original folder, the file could by accident import another file, for example
a `math.py`.
"""

from __future__ import annotations

import hashlib
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from urdfkin.errors import InputError
from urdfkin.system.files import read_text
from urdfkin.system.processes import python_command

#: Text in the first lines of every exported file.
EXPORT_MARK = "straight-line code for this robot and frame"
_DIGEST_PLACEHOLDER = "0" * 64
#: Line of the header. `insert_seal` replaces the zeros by the digest.
SEAL = f"Seal sha256 {_DIGEST_PLACEHOLDER}"
_SEAL_LINE = re.compile(r"^([ %*]*Seal sha256 )([0-9a-f]{64})$", re.MULTILINE)
_MAIN_MACRO = re.compile(r"^#ifdef (\w+)_MAIN$", re.MULTILINE)
_OCTAVE_FUNCTION = re.compile(r"^function f = ([A-Za-z]\w*)\(\)", re.MULTILINE | re.ASCII)
_STRICT_FLAGS = ("-Wall", "-Wextra", "-pedantic", "-Werror")
_CUDA_SUFFIXES = (".cuh", ".cu")
#: Compiler and options for each suffix.
_COMPILE_COMMANDS = {
    **dict.fromkeys((".c", ".h"), ("cc", "-std=c99", "-x", "c", *_STRICT_FLAGS)),
    **dict.fromkeys(
        (".hpp", ".hh", ".hxx", ".cpp", ".cc", ".cxx", *_CUDA_SUFFIXES),
        ("c++", "-std=c++11", "-x", "c++", *_STRICT_FLAGS),
    ),
}
#: Compiler and options for CUDA if the computer has nvcc and a GPU.
_GPU_COMPILE_COMMAND = ("nvcc", "-Xcompiler", "-Wall,-Wextra,-Werror", "-x", "cu")
#: Number of characters at the start of a file that are searched for `EXPORT_MARK` and for the word
#: UNVERIFIED.
_HEADER_LENGTH = 2000
#: Time limit (s) of a compiler or a test program. The code of a robot with a thousand joints compiles in one
#: minute.
_TIME_LIMIT = 600.0


def insert_seal(text: str) -> str:
    """Insert the digest into the header."""
    return _SEAL_LINE.sub(lambda found: found[1] + _digest(text), text, count=1)


def _has_valid_seal(text: str) -> bool | None:
    """Return whether the digest is correct, or None if the text has no digest."""
    if (found := _SEAL_LINE.search(text)) is None:
        return None
    return _digest(_SEAL_LINE.sub(lambda line: line[1] + _DIGEST_PLACEHOLDER, text, count=1)) == found[2]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class FileCheck:
    """Result of a check.

    Attributes:
        lines: One line for each function and precision. Each line begins with "good" or "WRONG".
        passed: True if each line begins with "good".
        warnings: Reasons why the file is not verified.
    """

    lines: tuple[str, ...]
    passed: bool
    warnings: tuple[str, ...]

    @property
    def verified(self) -> bool:
        return not self.warnings


def check(file: Path) -> FileCheck:
    """Run an exported file's test vectors.

    Raises:
        InputError: `urdfkin export` did not write the file, or the file cannot be run.
    """
    text = read_text(file).replace("\r\n", "\n")
    if EXPORT_MARK not in text[:_HEADER_LENGTH]:
        raise InputError("this file was not written by `urdfkin export`", where=str(file))
    runs = {**dict.fromkeys(_COMPILE_COMMANDS, _run_compiled), ".py": _run_imported, ".m": _run_octave}
    if (run := runs.get(file.suffix.lower())) is None:
        raise InputError(
            "urdfkin cannot run an exported file of this kind",
            where=str(file),
            found=file.suffix or "no suffix",
            remedy=f"check a file with the suffix {', '.join(runs)}",
        )
    with tempfile.TemporaryDirectory() as folder:
        lines = tuple(run(file, text, Path(folder)))
    if not lines:
        raise InputError("the file has no test vectors", where=str(file))
    return FileCheck(lines, all(line.startswith("good ") for line in lines), tuple(_find_warnings(text)))


def _find_warnings(text: str) -> Iterator[str]:
    if "UNVERIFIED" in text[:_HEADER_LENGTH]:
        yield "these expressions were not compared with Pinocchio when they were written"
    sealed = _has_valid_seal(text)
    if sealed is None:
        yield "the file has no seal (checksum), so urdfkin cannot detect changes; export the file again"
    elif not sealed:
        yield "the file was changed after it was written; export the file again"


def _has_gpu() -> bool:
    return shutil.which("nvcc") is not None and Path("/dev/nvidia0").exists()


def _run_compiled(file: Path, text: str, folder: Path) -> Iterator[str]:
    """Run the test vectors in double and single precision.

    The check of a CUDA file includes the GPU functions only if nvcc and a GPU are available.
    """
    name, suffix = _find_program_name(_MAIN_MACRO, text, file), file.suffix.lower()
    copy = _copy(text, folder / f"checked{suffix}")
    command = _GPU_COMPILE_COMMAND if suffix in _CUDA_SUFFIXES and _has_gpu() else _COMPILE_COMMANDS[suffix]
    compiler = _find_program(command[0], file)
    for real in ("double", "float"):
        macros = [f"-D{name}_MAIN", f"-D{name}_REAL={real}"]
        program = folder / real
        _run([compiler, *command[1:], "-O1", *macros, str(copy), "-o", str(program), "-lm"], file)
        yield from (f"{line} ({real})" for line in _run([str(program)], file))


def _run_imported(file: Path, text: str, folder: Path) -> Iterator[str]:
    copy = _copy(text, folder / "checked.py")
    code = f"import runpy; runpy.run_path({str(copy)!r}, run_name='__main__')"
    yield from _run(python_command(code), file, cwd=folder)


def _run_octave(file: Path, text: str, folder: Path) -> Iterator[str]:
    name = _find_program_name(_OCTAVE_FUNCTION, text, file)
    _copy(text, folder / f"{name}.m")
    octave = [_find_program("octave-cli", file), "--no-init-file", "--no-site-file"]
    yield from _run([*octave, "--eval", f"{name}().check();"], file, cwd=folder)


def _find_program_name(pattern: re.Pattern[str], text: str, file: Path) -> str:
    if (found := pattern.search(text)) is None:
        raise InputError("the file has no test vectors", where=str(file))
    return found[1]


def _copy(text: str, path: Path) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def _find_program(name: str, file: Path) -> str:
    if (found := shutil.which(name)) is None:
        raise InputError(f"{name} is needed to check this file and is not installed", where=str(file))
    return found


def _run(command: Sequence[str], file: Path, cwd: Path | None = None) -> list[str]:
    """Run a command, and return lines that begin with "good" or "WRONG"."""
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_TIME_LIMIT,
            check=False,
            cwd=cwd,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise InputError("the file does not run", where=str(file), found=str(error)) from None
    lines = [line for line in done.stdout.splitlines() if line.startswith(("good ", "WRONG "))]
    if done.returncode != 0 and not any(line.startswith("WRONG ") for line in lines):
        output = (done.stderr.strip() or done.stdout.strip() or "no output").splitlines()
        found = next((line for line in output if "error" in line.lower()), output[-1])
        raise InputError("the file does not run", where=str(file), found=found)
    return lines
