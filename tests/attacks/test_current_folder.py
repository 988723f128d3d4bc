"""In an untrusted current folder, urdfkin runs no file and reads no settings."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.running import python

pytestmark = pytest.mark.long
ROBOTS = Path(__file__).parents[2] / "robots"
PLANTED = [
    "urdfkin", "multiprocessing", "concurrent", "subprocess", "signal", "threading", "json", "pickle",
    "ast", "sitecustomize", "usercustomize", "resource", "tempfile", "xacrodoc", "xacro", "yaml",
    "numpy", "numba", "pinocchio", "click", "matplotlib", "platformdirs",
]  # fmt: skip
#: Modules that Python imports from the folder before urdfkin runs.
BEFORE_MAIN = {"urdfkin", "threading", "ast"}
XACRO = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="l${1 + 1}"/></robot>'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a robot, and with modules that write to a file when they are imported."""
    folder = tmp_path / "robot"
    folder.mkdir()
    (folder / "r.xacro").write_text(XACRO)
    for name in PLANTED:
        (folder / f"{name}.py").write_text(f"open({str(folder / 'RUN')!r}, 'a').write({name!r} + '\\n')\n")
    return folder


def demand_nothing_ran(folder: Path) -> None:
    assert not (folder / "RUN").exists(), (folder / "RUN").read_text()


def run(folder: Path, start: list[str], *words: str) -> str:
    done = subprocess.run([*start, *words], cwd=folder, capture_output=True, text=True, check=False)
    demand_nothing_ran(folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def command(tmp_path: Path) -> list[str]:
    """Return a script in another folder, like the script that pip installs."""
    script = tmp_path / "bin" / "urdfkin"
    script.parent.mkdir()
    script.write_text("from urdfkin.cli import main\nif __name__ == '__main__':\n    main()\n")
    return [sys.executable, str(script)]


@pytest.mark.parametrize("file", ["r.xacro", str(ROBOTS / "elbow.urdf")])
def test_check_runs_no_file_of_the_current_folder(folder: Path, command: list[str], file: str) -> None:
    run(folder, command, "check", "--format", "json", file)


def test_processes_of_validate_run_no_file_of_the_current_folder(folder: Path, command: list[str]) -> None:
    robots = [str(ROBOTS / "one_link.urdf"), "r.xacro"]
    for how in (["--jobs", "2"], ["--isolate"]):
        assert "2 robots" in run(folder, command, "validate", *robots, "--samples", "0", *how)


def test_compiling_runs_no_file_of_the_current_folder(
    folder: Path, command: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder.parent / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    script = Path(command[-1])
    script.write_text(
        "from urdfkin.compiled.machine.single import one_configuration\none_configuration.compiled_function\n"
    )
    run(folder, command)
    assert list((folder.parent / "cache").rglob("*.kernel"))


def test_the_compiling_process_succeeds_and_runs_no_file_of_the_current_folder(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from urdfkin.compiled import preload

    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend("")  # as in `python -c`
    with preload._start_compiler(("placements",)) as process:
        assert process.wait() == 0
    demand_nothing_ran(folder)


def test_python_m_urdfkin_imports_nothing_from_the_current_folder_once_started(folder: Path) -> None:
    for name in BEFORE_MAIN:
        (folder / f"{name}.py").unlink()
    run(folder, [sys.executable, "-m", "urdfkin"], "check", "r.xacro")
    run(folder, [sys.executable, "-m", "urdfkin"], "robots")


def test_numba_reads_no_settings_from_the_current_folder(tmp_path: Path) -> None:
    (tmp_path / ".numba_config.yaml").write_text(
        f"cache_dir: {tmp_path}\ndisable_jit: 1\ncache_locator_classes: evil.Locator\n"
    )
    code = (
        "import os; from urdfkin.compiled.machine.compiling import _config as c; c.reload_config(); print("
        "repr(c.CACHE_DIR), c.DISABLE_JIT, repr(getattr(c, 'CACHE_LOCATOR_CLASSES', '')), os.getcwd())"
    )
    environ = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    assert python(code, cwd=tmp_path, env=environ).stdout == f"'' 0 '' {tmp_path}\n"


def test_a_drawing_reads_no_settings_from_the_current_folder(tmp_path: Path, command: list[str]) -> None:
    pytest.importorskip("matplotlib")
    robot = str(ROBOTS / "elbow.urdf")
    drawings = []
    for settings in (None, "figure.facecolor: red\nsavefig.facecolor: red\n"):
        if settings:
            (tmp_path / "matplotlibrc").write_text(settings)
        run(tmp_path, command, "dh", robot, "--format", "svg", "--output", "a.svg")
        drawings.append((tmp_path / "a.svg").read_bytes())
    assert drawings[0] == drawings[1]
