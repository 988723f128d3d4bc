"""A wheel that is installed outside the checkout computes with the robots in the wheel."""

import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parent.parent


def run(*command: str | Path, cwd: Path) -> str:
    """Return the output of a command that has no access to the checkout or the paths of the tests."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    how: dict[str, Any] = {"cwd": cwd, "env": environment, "capture_output": True, "text": True}
    done = subprocess.run([*map(str, command)], check=False, **how)
    assert done.returncode == 0, done.stdout + done.stderr
    return str(done.stdout)


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a virtual environment with the wheel and the libraries of this environment."""
    folder = tmp_path_factory.mktemp("elsewhere")
    pip = [sys.executable, "-m", "pip"]
    run(*pip, "wheel", "--no-deps", "--no-build-isolation", "-w", folder, ROOT, cwd=folder)
    venv.create(folder / "env", with_pip=False)
    (wheel,) = folder.glob("urdfkin-*.whl")
    run(*pip, "--python", folder / "env/bin/python", "install", "--no-deps", wheel, cwd=folder)
    libraries = Path(sysconfig.get_path("purelib"))
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    lent = f"{libraries}\n{libraries}/cmeel.prefix/lib/{version}/site-packages\n"
    (folder / "env/lib" / version / "site-packages/lent.pth").write_text(lent)
    return folder


@pytest.mark.long
def test_the_installed_wheel_is_imported(elsewhere: Path) -> None:
    code = "import urdfkin; print(urdfkin.__file__)"
    printed = run(elsewhere / "env/bin/python", "-c", code, cwd=elsewhere)
    assert Path(printed.strip()).is_relative_to(elsewhere / "env")


@pytest.mark.long
def test_an_installed_wheel_loads_and_verifies_a_robot(elsewhere: Path) -> None:
    printed = run(elsewhere / "env/bin/urdfkin", "validate", "panda", "--samples", "5", cwd=elsewhere)
    assert "0 outside their bound" in printed


@pytest.mark.long
def test_the_wheel_contains_the_robots_and_tables(elsewhere: Path) -> None:
    assert "polar" in run(elsewhere / "env/bin/urdfkin", "robots", cwd=elsewhere)
    assert "polar" in run(elsewhere / "env/bin/urdfkin", "info", "polar", cwd=elsewhere)
    assert "7.130" in run(elsewhere / "env/bin/urdfkin", "explain", "7.130", cwd=elsewhere)


@pytest.mark.long
def test_the_wheel_contains_type_hints(elsewhere: Path) -> None:
    assert list((elsewhere / "env").glob("lib/*/site-packages/urdfkin/py.typed"))
