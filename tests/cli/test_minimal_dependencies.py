"""`urdfkin check` needs no package but click, and a command starts no threads."""

import os
import re
import subprocess
from pathlib import Path

import pytest

from tests.cli.running import python

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
ROBOT = str(ROOT / "robots" / "elbow.urdf")

#: Program that can import only Python's library, urdfkin and the packages that the hook installs
BARE = """
import sys
from importlib.abc import MetaPathFinder

class Bare(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] not in {{*sys.stdlib_module_names, "urdfkin", *{installed!r}}}:
            raise ModuleNotFoundError(f"No module named {{name!r}} in a bare Python", name=name)

sys.meta_path.insert(0, Bare())
from urdfkin.cli import main
sys.argv = ["urdfkin", *{words!r}]
main()
"""


def hook() -> str:
    return (ROOT / ".pre-commit-hooks.yaml").read_text("utf-8")


def installed() -> list[str]:
    """Return the packages that the hook installs with urdfkin."""
    found = re.search(r"additional_dependencies: \[(.*)\]", hook())
    assert found is not None
    option, *packages = re.findall(r'"([^"]*)"', found[1])
    assert option == "--no-deps"
    return [package.partition(">")[0] for package in packages]


def bare(*words: str) -> subprocess.CompletedProcess[str]:
    return python(BARE.format(words=words, installed=installed()), check=False)


@pytest.mark.parametrize("style", ["terminal", "json", "sarif", "github"])
def test_the_command_of_the_hook_needs_only_the_packages_that_the_hook_installs(style: str) -> None:
    assert "entry: urdfkin check\n" in hook()
    assert installed() == ["click"]
    done = bare("check", "--format", style, ROBOT)
    assert (done.returncode, done.stderr) == (0, "")


def test_explain_needs_only_click_and_another_command_names_the_missing_package(tmp_path: Path) -> None:
    bad = tmp_path / "bad.urdf"
    bad.write_text('<robot name="r"><link name="a"/><link name="b"/></robot>')
    done = bare("check", str(bad))
    assert done.returncode == 1, done.stderr
    assert "run 'urdfkin explain URDF411' for details" in done.stdout
    assert bare("explain", "URDF411").returncode == 0
    done = bare("placement", ROBOT)
    assert done.returncode == 2
    found = re.fullmatch(
        r"urdfkin: error: (\w+) is not installed; "
        r"install urdfkin with its dependencies: pip install PATH_OF_THE_CLONE\n",
        done.stderr,
    )
    assert found is not None
    assert found[1] not in installed()


#: Program that runs a command and prints the number of threads
COUNTED = """
import os, sys
from urdfkin.cli import main
sys.argv = ["urdfkin", "structure", "planar_two_link"]
try:
    main()
finally:
    print(len(os.listdir("/proc/self/task")))
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="no /proc")
@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one processor")
def test_numpys_linear_algebra_starts_no_threads_in_a_command() -> None:
    plain = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    assert python(COUNTED, env=plain).stdout.splitlines()[-1] == "1"
