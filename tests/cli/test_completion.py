"""Shell completion, called as the completion script calls it, and in real shells."""

import json
import os
import pty
import re
import select
import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import urdfkin as library
from tests.attacks.hostile import IN_XML, chain_of_all
from tests.cli.running import python, urdfkin
from urdfkin.cli import commands
from urdfkin.dh.parse_table import published_tables
from urdfkin.kinematics.registry import equations
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.lint.pages import URDF_RULES

Offered = Callable[[str], list[str]]


@pytest.fixture
def offered(monkeypatch: pytest.MonkeyPatch) -> Offered:
    """Return a function that completes the end of a line as bash does; `file` means files."""

    def ask(line: str) -> list[str]:
        words = f"urdfkin {line}"
        monkeypatch.setenv("_URDFKIN_COMPLETE", "bash_complete")
        monkeypatch.setenv("COMP_WORDS", words)
        monkeypatch.setenv("COMP_CWORD", str(len(words.split(" ")) - 1))
        done = urdfkin()
        assert (done.code, done.err) == (0, "")
        items = [item.split(",", 1) for item in done.text.splitlines() if item]
        return [value if kind == "plain" else kind for kind, value in items]

    return ask


def test_commands_options_choices_codes_equations_and_tables_are_completed(offered: Offered) -> None:
    assert offered("") == list(commands())
    assert offered("jaco") == ["jacobian", "jacobian-rate"]
    assert offered("jacobian panda --refe") == ["--reference"]
    assert offered("jacobian panda --reference lo") == ["local", "local_world_aligned"]
    slugs = {rule.slug for rule in URDF_RULES.values()}
    assert set(offered("explain ")) == {*URDF_RULES, *slugs, *equations()}
    assert offered("explain 7.13") == ["7.13", "7.130"]
    assert set(offered("check --ignore ")) == {*URDF_RULES, *slugs}
    assert set(offered("dh ur5 --compare ")) == {"file", *published_tables()}
    assert offered("check ") == ["file"]
    assert offered("nonsense x") == []


@pytest.mark.parametrize("line", ["info ", "validate ur5 ", "diff ur5 ", "same ur5 ", "export ", "dh "])
def test_a_robot_is_completed_by_files_and_names_of_the_catalogue(offered: Offered, line: str) -> None:
    assert offered(line) == ["file", *catalogue()]
    assert offered(f"{line}pand") == ["file", "panda", "panda_collision"]


@pytest.mark.parametrize(
    "words", ["jacobian {} --frame", "placement {} --relative-to", "dh {} --tip", "chain {} --base"]
)
def test_frames_are_completed_from_the_robot_on_the_command_line(
    offered: Offered, words: str, tmp_path: Path
) -> None:
    own = tmp_path / "own.urdf"
    own.write_text(library.load("planar_two_link", verify=False).urdf)
    for source in ("panda", str(own)):
        names = set(library.load(source, verify=False).frame_names)
        assert set(offered(f"{words.format(source)} ")) == names
    assert offered(f"{words.format('panda')} panda_lef") == ["panda_leftfinger"]


def test_frames_of_an_mjcf_file_are_completed_by_bodies_sites_and_joints(
    offered: Offered, tmp_path: Path
) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(
        '<mujoco><worldbody><body name="upper"><joint name="hinge"/><geom name="skin" size="1"/>'
        '<body name="lower"><site name="grip"/></body></body></worldbody></mujoco>'
    )
    assert offered(f"jacobian {path} --frame ") == ["upper", "hinge", "lower", "grip"]


def test_no_name_is_completed_that_a_shell_would_execute(offered: Offered, tmp_path: Path) -> None:
    path = tmp_path / "hostile.urdf"
    harmful = [
        *IN_XML.values(), "$(reboot)", "`reboot`", "a;reboot", "a b", "-o", "a'b", "*", "~x", "a\\b", "!x",
    ]  # fmt: skip
    path.write_text(chain_of_all([*dict.fromkeys(harmful), "fine.name-1"]), encoding="utf-8")
    assert set(offered(f"jacobian {path} --frame ")) == {"base", "fine.name-1", "__proto__"}


UNREADABLE = [
    "nowhere.urdf", "BROKEN", "PIPE", "FOLDER", "-", "arm.xacro", "'", "<robot/>", "/dev/zero",
    "no such name",
]  # fmt: skip


@pytest.mark.parametrize("robot", UNREADABLE)
def test_an_unreadable_robot_gives_no_frame_completions_and_no_delay(
    offered: Offered, robot: str, tmp_path: Path
) -> None:
    made = {name: tmp_path / name.lower() for name in ("BROKEN", "PIPE", "FOLDER")}
    made["BROKEN"].write_text("<robot><link name='a'/>")
    os.mkfifo(made["PIPE"])
    made["FOLDER"].mkdir()
    begin = time.monotonic()
    assert offered(f"jacobian {made.get(robot, robot)} --frame ") in ([], ["file", *catalogue()])
    assert time.monotonic() - begin < 5.0  # the command does not wait for a pipe


def test_completion_imports_no_heavy_module() -> None:
    env = {"_URDFKIN_COMPLETE": "bash_complete", "COMP_CWORD": "4"}
    env["COMP_WORDS"] = "urdfkin jacobian talos --frame arm_left_1"
    done = python(
        "import sys\nfrom urdfkin.cli import main\nsys.argv = ['urdfkin']\n"
        "try: main()\nfinally: print({'numpy', 'numba', 'pinocchio', 'yourdfpy', 'rich'} & set(sys.modules))",
        env=os.environ | env, check=False,
    )  # fmt: skip
    assert done.stdout.splitlines()[:2] == ["plain,arm_left_1_link", "plain,arm_left_1_joint"]
    assert done.stdout.endswith("set()\n")


# -- in the shells -------------------------------------------------------------------------------------

_PATH = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
#: Command that starts a shell without the user's settings, and line that activates completion
SHELLS = {
    "bash": (["bash", "--norc", "--noprofile", "-i"], 'eval "$(urdfkin completion bash)"'),
    "zsh": (["zsh", "-f", "-i"], 'autoload -Uz compinit; compinit -u -D; eval "$(urdfkin completion zsh)"'),
    "fish": (["fish", "--no-config", "-i"], "urdfkin completion fish | source"),
}


@pytest.mark.slow
@pytest.mark.parametrize("shell", SHELLS)
def test_a_real_shell_completes_a_frame_and_runs_the_command(shell: str, tmp_path: Path) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    words, setup = SHELLS[shell]
    pid, screen = pty.fork()
    if pid == 0:
        os.environ.update(PATH=_PATH, TERM="xterm", HOME=str(tmp_path), XDG_CONFIG_HOME=str(tmp_path))
        os.chdir(tmp_path)
        os.execvp(words[0], words)
    try:
        type_in(screen, f"{setup}; echo re''ady\n", r"ready")
        type_in(screen, "urdfkin screws panda --tip panda_leftf\t", r"panda_leftfinger")
        type_in(screen, "--no-verify --format json > out.json; echo d''one\n", r"done")
    finally:
        os.close(screen)
        os.waitpid(pid, 0)
    assert json.loads((tmp_path / "out.json").read_text())["tip_frame"] == "panda_leftfinger"


def type_in(screen: int, keys: str, wanted: str) -> None:
    """Type keys, and wait until the pattern `wanted` is on the screen."""
    os.write(screen, keys.encode())
    shown, end = "", time.monotonic() + 60.0
    while time.monotonic() < end:
        if select.select([screen], [], [], 0.2)[0]:
            shown += os.read(screen, 65536).decode(errors="replace")
            if re.search(wanted, re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown)):
                return
    raise AssertionError(f"no {wanted!r} after {keys!r}: {shown!r}")
