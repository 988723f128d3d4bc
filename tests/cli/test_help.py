"""Help is quick and complete, and its examples run."""

import glob
import os
import re
import shlex
from importlib import metadata
from pathlib import Path

import click
import numpy as np
import pytest

import urdfkin as library
from tests.cli.running import good, imported, process, python, refused, urdfkin
from tests.robots.odd_urdfs import urdf_of
from urdfkin.cli import _ADVICE_BY_WORD, _SYNONYMS, cli, commands, commands_by_heading
from urdfkin.robot import Robot
from urdfkin.robot.loading import load
from urdfkin.system.resources import robots_dir
from urdfkin.urdf.catalogue import catalogue

#: Packages that --help must not import
HEAVY = {"numpy", "numba", "llvmlite", "pinocchio", "yourdfpy", "trimesh", "lxml", "scipy", "rich"}


def examples(command: str) -> list[str]:
    text = urdfkin(*command.split(), "--help").text.partition("Example:")[2].partition("Options:")[0]
    lines = " ".join(text.split()).split("urdfkin ")[1:]
    return [line.strip() for line in lines if f"{line} ".startswith(f"{command} ")]


def run_examples(command: str) -> None:
    assert examples(command)
    for example in examples(command):
        words = [sorted(glob.glob(word)) or [word] for word in shlex.split(example)]  # noqa: PTH207  relative
        done = good(*(word for expanded in words for word in expanded))
        assert done.out or done.err


def test_the_help_lists_every_command_both_versions_and_the_existing_families() -> None:
    text = urdfkin("--help").text
    for name, (_, summary) in commands().items():
        assert f"  {name} " in text
        assert summary.split()[0] in text
    group = click.Context(cli)
    for name in commands():
        assert isinstance(cli.get_command(group, name), click.Command)
    assert good("--version").text.strip().endswith(f"Pinocchio {metadata.version('pin')}")
    page = " ".join(urdfkin("robots --help").text.split())
    named = page.partition("Show only the robots of one family: ")[2].partition(".")[0].split(", ")
    assert named == sorted({entry.family for entry in catalogue().values()})


@pytest.mark.slow
@pytest.mark.parametrize("command", commands())
def test_the_help_of_every_command_has_an_example(command: str) -> None:
    done = good(command, "--help")
    assert done.text.startswith(f"Usage: urdfkin {command} ")
    assert examples(command)
    assert urdfkin(command, "-h").out == done.out


AFTER_WORK = ("validate", "report", "report compare", "report status")
#: Commands that run until they are stopped
ENDLESS = ("view",)


@pytest.mark.slow
@pytest.mark.parametrize("command", [name for name in commands() if name not in AFTER_WORK + ENDLESS])
def test_the_examples_of_the_help_run(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robots").mkdir()
    for name in ("my", "robot", "arm", "robots/one"):
        (tmp_path / f"{name}.urdf").write_text((robots_dir() / "elbow.urdf").read_text())
    panda = load("panda", verify=False)
    (tmp_path / "my_robot.py").write_text(
        "import urdfkin\nrobot = urdfkin.load('panda', verify=False)\n"
        "def jacobian(q):\n    return robot.jacobian(q, 'panda_hand')\n"
    )
    q = panda.sample(5, seed=0)
    np.savetxt(tmp_path / "log.csv", q, delimiter=",", header=",".join(panda.coordinate_names), comments="")
    run_examples(command)


@pytest.mark.slow
def test_the_examples_of_validation_run_in_sequence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my.urdf").write_text(urdf_of("tree_1"))
    for name in ("results", "main", "branch"):
        assert urdfkin("validate ur5 --samples 10 --json", f"{name}.json").code == 0
    assert urdfkin("validate ur5 --samples 10 --store nightly").code == 0
    for command in AFTER_WORK:
        run_examples(command)


def test_the_help_of_every_command_imports_no_heavy_module() -> None:
    for words in ("import urdfkin", "import urdfkin.cli", "from urdfkin.cli import cli; cli.get_help"):
        code = f"import sys; {words}; print(sorted({HEAVY!r} & set(sys.modules)))"
        assert python(code).stdout == "[]\n"
    assert imported(["--help", *(f"{command} --help" for command in commands())], HEAVY) == {}


@pytest.mark.slow
def test_help_needs_less_than_600_milliseconds() -> None:
    def processor_seconds() -> float:
        begin = os.times()
        assert process("--help").code == 0
        end = os.times()
        return end.children_user + end.children_system - begin.children_user - begin.children_system

    assert min(processor_seconds() for _ in range(3)) < 0.6  # measured: 0.06 s


def test_the_command_without_arguments_prints_the_help() -> None:
    done = urdfkin()
    assert (done.code, done.out) == (2, b"")
    assert done.err == urdfkin("--help").text


def test_synonyms_lead_to_commands_and_commands_have_the_names_of_the_library() -> None:
    assert set(_SYNONYMS) & set(commands()) == set()
    assert set(_ADVICE_BY_WORD) & (set(commands()) | set(_SYNONYMS)) == set()
    for meant in _SYNONYMS.values():
        named = re.findall(r"`([a-z-]+)[^`]*`", meant) or [meant.split()[0]]
        assert set(named) <= {*commands(), "--help", "--version"}
    own = set(commands_by_heading()["Compute"]) | {"dh", "screws", "chain", "export", "view"}
    assert [name for name in own if not hasattr(Robot, name.replace("-", "_"))] == []
    functions = "same", "diff", "calibrate", "validate", "check"
    assert [name for name in functions if not hasattr(library, name)] == []


def test_explain_prints_the_page_of_an_equation_and_refuses_other_numbers() -> None:
    page = good("explain 7.130").text
    for part in ("Equation 7.130", "w-dot_0i x d_{i-1,i}", "Robot.acceleration", "Pinocchio", "tests/text/"):
        assert part in page
    assert "page 2" in urdfkin("explain 7.8").text
    for number in ("7.131", "7", "8.1"):
        assert refused("explain", number).endswith("give a number from 7.1 to 7.130\n")


def test_explain_lists_the_codes_and_equations_whose_description_has_a_word() -> None:
    found = [line.split()[0] for line in good("explain Jacobian").text.splitlines()]
    assert {"7.85", "7.126"} < set(found)
    assert {"URDF506", "URDF527"} < {line.split()[0] for line in good("explain limit").text.splitlines()}
    assert good("explain 'transverse coriolis'").text.startswith("7.130 ")
    assert "did you mean" in refused("explain roundedpi")
    assert "`urdfkin explain` lists all names" in refused("explain xyzzy")


def test_explain_without_an_argument_lists_all_sections_with_equations() -> None:
    lines = good("explain").text.splitlines()
    assert "equations 7.1 to 7.7: Planar motion of objects" in lines
    assert any(line.startswith("equations ") and "to 7.130:" in line for line in lines)
