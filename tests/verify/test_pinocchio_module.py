"""The library that checks is the one in use, and another one under its name is told from it."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

import pytest

import urdfkin
from tests.cli.running import Done, process
from urdfkin.errors import InstallationError
from urdfkin.verify.pinocchio import pinocchio, version

#: As PyPI's project `pinocchio` has it: plugins for nose.
IMPOSTOR = '__version__ = "0.1"\n'


@pytest.fixture
def impostor(tmp_path: Path) -> str:
    """A folder that Python searches first, with the other project installed in it."""
    (tmp_path / "pinocchio").mkdir()
    (tmp_path / "pinocchio" / "__init__.py").write_text(IMPOSTOR)
    about = tmp_path / "pinocchio-0.5.1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: pinocchio\nVersion: 0.5.1\n")
    (about / "RECORD").write_text("pinocchio/__init__.py,,\npinocchio-0.5.1.dist-info/METADATA,,\n")
    return str(tmp_path)


def misled(where: str, *words: str) -> Done:
    return process(*words, PYTHONPATH=where)


@pytest.mark.slow
@pytest.mark.parametrize(
    "words", ["jacobian elbow --q random", "validate elbow --samples 1", "dh elbow", "--version"]
)
def test_another_project_of_that_name_is_named_with_what_cures_it(impostor: str, words: str) -> None:
    done = misled(impostor, *words.split())
    assert done.code == 2, "1 would mean a disagreement"
    assert "pinocchio 0.5.1, another project" in done.err
    assert "pip uninstall pinocchio; pip install 'pin>=4,<5'" in done.err
    assert len(done.err.splitlines()) == 1
    assert "Traceback" not in done.err
    assert "4.1.0" not in done.text + done.err


@pytest.mark.slow
def test_without_a_check_nobody_asks_which_it_is(impostor: str) -> None:
    done = misled(impostor, "placement", "elbow", "--no-verify")
    assert done.code == 3
    assert "NOT VERIFIED" in done.text


@pytest.mark.slow
def test_a_file_of_that_name_beside_ones_program_is_named(tmp_path: Path) -> None:
    (tmp_path / "pinocchio.py").write_text("")
    done = misled(str(tmp_path), "--version")
    assert f"rename or remove {tmp_path / 'pinocchio.py'}" in done.err


def module(**words: object) -> ModuleType:
    made = ModuleType("pinocchio")
    made.__dict__.update({"__file__": "/there/pinocchio/__init__.py"} | words)
    return made


def test_the_version_is_that_of_the_module_in_use(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pinocchio", module(buildModelFromXML=None, __version__="4.98.7"))
    assert version() == "4.98.7"


def test_an_older_pinocchio_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pinocchio", module(buildModelFromXML=None, __version__="3.9.0"))
    with pytest.raises(InstallationError, match=r"needs Pinocchio 4 .*: found 3\.9\.0; pip install 'pin"):
        pinocchio()
    assert version() == "not installed"


def test_without_any_the_package_to_install_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    robot = urdfkin.load("elbow")
    with pytest.raises(InstallationError, match="pip install 'pin>=4,<5'"):
        robot.placement(robot.neutral(), "tool")
