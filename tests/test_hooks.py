"""Repositories of robots use urdfkin through pre-commit and through the GitHub Action, without a network."""

import importlib.metadata
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement

yaml = pytest.importorskip("yaml", reason="pip install pre-commit, which brings it")

ROOT = Path(__file__).parents[1]
#: Packages, in pure Python, that build urdfkin or that the hook installs
PACKAGES = ("hatchling", "click")
#: Files and folders of the repository that a build needs
SOURCES = (
    "pyproject.toml", "README.md", "LICENSE", ".pre-commit-hooks.yaml", "urdfkin", "robots",
    "docs/questions.md",
)  # fmt: skip

LONG = """<robot name="r"><link name="a"/><link name="b"/>
  <joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 2"/></joint>
</robot>
"""


def with_what_it_needs(name: str, found: set[str]) -> set[str]:
    """Add a package and all packages that it needs to `found`."""
    if name not in found:
        found.add(name)
        for line in importlib.metadata.requires(name) or ():
            needed = Requirement(line)
            if needed.marker is None or needed.marker.evaluate({"extra": ""}):
                with_what_it_needs(needed.name, found)
    return found


def wheel(name: str, folder: Path) -> None:
    """Write an installed package as a wheel into a folder."""
    found = importlib.metadata.distribution(name)
    tag = next(line[5:] for line in (found.read_text("WHEEL") or "").splitlines() if line.startswith("Tag: "))
    assert tag.endswith("-none-any"), name
    stem = f"{name.replace('-', '_')}-{found.version}"
    skipped = ("INSTALLER", "REQUESTED", "RECORD", "direct_url.json")
    owned = (file for file in found.files or () if not {"..", "__pycache__"} & {*file.parts})
    files = [file for file in owned if file.name not in skipped]
    info = next(file.parts[0] for file in files if file.parts[0].endswith(".dist-info"))
    with zipfile.ZipFile(folder / f"{stem}-{tag}.whl", "w") as archive:
        for file in files:
            archive.write(Path(str(found.locate_file(file))), str(file))
        archive.writestr(f"{info}/RECORD", "".join(f"{file},,\n" for file in [*files, f"{info}/RECORD"]))


class Repository:
    """A git repository, with commands that install packages only from the wheels."""

    def __init__(self, folder: Path, environ: dict[str, str]) -> None:
        self.folder, self.environ = folder, environ
        folder.mkdir()
        self.run("git", "init", "-q")

    def run(self, *words: str, fails: bool = False) -> str:
        how: dict[str, Any] = {"cwd": self.folder, "env": self.environ, "capture_output": True, "text": True}
        done = subprocess.run(words, check=False, **how)
        assert (done.returncode != 0) == fails, done.stdout + done.stderr
        return str(done.stdout + done.stderr)

    def commit(self, *, fails: bool = False) -> str:
        self.run("git", "add", "--all")
        return self.run("git", "commit", "-m", "robots", fails=fails)


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Repository:
    """Make a repository with urdfkin's files, and the wheels that a build and an installation need."""
    folder = tmp_path_factory.mktemp("hooks")
    wheels = folder / "wheels"
    wheels.mkdir()
    needed: set[str] = set()
    for name in PACKAGES:
        with_what_it_needs(name, needed)
    for name in needed:
        wheel(name, wheels)
    who = {f"GIT_{role}_{what}": "x@y.z" for role in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}
    kept = {name: os.environ[name] for name in ("PATH", "LD_LIBRARY_PATH") if name in os.environ}
    environ = kept | who | {
        "HOME": str(folder), "PRE_COMMIT_HOME": str(folder / "pre-commit"),
        "PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(wheels), "PIP_CONFIG_FILE": os.devnull,
        "GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_SYSTEM": os.devnull,
    }  # fmt: skip
    made = Repository(folder / "urdfkin", environ)
    for name in SOURCES:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, made.folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            (made.folder / name).parent.mkdir(exist_ok=True)
            shutil.copy(ROOT / name, made.folder / name)
    made.commit()
    return made


# -- pre-commit ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def robots(source: Repository) -> Repository:
    """Make a repository of robots with the hooks installed."""
    pytest.importorskip("pre_commit", reason="pip install pre-commit, which the extra [test] holds")
    made = Repository(source.folder.parent / "robots", source.environ)
    revision = source.run("git", "rev-parse", "HEAD").strip()
    (made.folder / ".pre-commit-config.yaml").write_text(
        f"repos:\n  - repo: {source.folder}\n    rev: {revision}\n    hooks:\n"
        "      - id: urdfkin-check\n        args: [--strict]\n"
        "      - id: urdfkin-fix\n        stages: [manual]\n"
    )
    made.run(sys.executable, "-m", "pre_commit", "install", "--install-hooks")
    return made


@pytest.mark.long
def test_a_commit_with_a_finding_is_refused_until_the_file_is_corrected(robots: Repository) -> None:
    arm = robots.folder / "arm.urdf"
    arm.write_text(LONG)
    told = robots.commit(fails=True)
    assert re.search(r"arm\.urdf:2:\d+: URDF503 \[\*\] error", told)
    assert "^^^^^^^^^^^" in told
    hook = [sys.executable, "-m", "pre_commit", "run", "--hook-stage", "manual", "urdfkin-fix", "--all-files"]
    assert "files were modified by this hook" in robots.run(*hook, fails=True)
    assert arm.read_text() == LONG.replace("0 0 2", "0 0 1")
    robots.run("git", "add", "--all")
    robots.run(*hook)
    assert "check URDFs" in robots.commit()


@pytest.mark.long
def test_the_hook_uses_the_settings_of_the_repository(robots: Repository) -> None:
    (robots.folder / "old.urdf").write_text(LONG.replace('"r"', '"old"'))
    assert "URDF503" in robots.commit(fails=True)
    (robots.folder / "pyproject.toml").write_text('[tool.urdfkin]\nignore = ["axis-not-unit"]\n')
    robots.commit()


@pytest.mark.long
def test_the_hooks_environment_contains_only_urdfkin_and_click(robots: Repository) -> None:
    home = Path(robots.environ["PRE_COMMIT_HOME"])
    (packages,) = {path.parent for path in home.glob("*/*/lib/python*/site-packages/click")}
    names = {path.name.partition("-")[0] for path in packages.glob("*.dist-info")}
    assert names - {"pip", "setuptools", "wheel"} == {"urdfkin", "click"}


# -- the GitHub Action ---------------------------------------------------------------------------------


def steps() -> list[dict[str, Any]]:
    """Return the action's steps that run a script."""
    action = yaml.safe_load((ROOT / "action.yml").read_text("utf-8"))
    return [step for step in action["runs"]["steps"] if "run" in step]


@pytest.fixture(scope="module")
def runner(source: Repository) -> Repository:
    """Make a repository of robots, where the action's first step has installed urdfkin."""
    made, home = Repository(source.folder.parent / "runner", {**source.environ}), str(source.folder.parent)
    made.environ |= {"RUNNER_TEMP": home, "PYTHON": sys.executable, "ACTION": str(source.folder)}
    (made.folder / "arm.urdf").write_text(LONG)
    made.commit()
    # A module of the repository must not run.
    (made.folder / "click.py").write_text("raise SystemExit('run')\n")
    made.run("bash", "-eo", "pipefail", "-c", steps()[0]["run"])
    return made


def act(runner: Repository, *, fails: bool, **inputs: str) -> tuple[str, str]:
    """Run the action's second step; return its output and its summary."""
    summary = runner.folder.parent / "summary.md"
    summary.write_text("")
    given = {"FILES": ".", "SINCE": "", "OPTIONS": "", "SARIF": "", "GITHUB_STEP_SUMMARY": str(summary)}
    step = Repository.__new__(Repository)
    step.folder, step.environ = runner.folder, runner.environ | given | inputs
    return step.run("bash", "-eo", "pipefail", "-c", steps()[1]["run"], fails=fails), summary.read_text()


@pytest.mark.long
def test_the_action_annotates_the_line_and_writes_a_summary(runner: Repository) -> None:
    told, summary = act(runner, fails=False)
    assert re.match(r"::warning file=arm\.urdf,line=2,col=\d+,endColumn=\d+,title=URDF503::", told)
    assert re.search(r"^ +1  URDF503  warning", summary, re.M)
    sarif = runner.folder.parent / "a b.sarif"
    told, _ = act(runner, fails=True, OPTIONS="--strict\n\n--select\nURDF5", SARIF=str(sarif))
    assert told.startswith("::error file=arm.urdf")
    (result,) = json.loads(sarif.read_text())["runs"][0]["results"]
    assert (result["ruleId"], result["level"]) == ("URDF503", "error")


@pytest.mark.long
def test_the_action_reports_new_findings_and_executes_no_input(runner: Repository) -> None:
    assert act(runner, fails=False, SINCE="HEAD", OPTIONS="--strict")[0] == ""
    mark = runner.folder / "RUN"
    for name in ("FILES", "SINCE", "OPTIONS"):
        act(runner, fails=True, **{name: f"$(touch {mark})\n`touch {mark}`; touch {mark}"})
    assert not mark.exists()


@pytest.mark.slow
def test_the_action_fails_if_two_files_of_a_robot_differ(tmp_path: Path) -> None:
    (tmp_path / "urdfkin-same").mkdir()
    (tmp_path / "urdfkin-same" / "bin").symlink_to(Path(sys.executable).parent)
    text = (ROOT / "robots/planar_two_link.urdf").read_text()
    (tmp_path / "a.urdf").write_text(text)
    (tmp_path / "b c.urdf").write_text(text.replace('"0.5 0 0"', '"0.501 0 0"'))
    (tmp_path / "click.py").write_text("raise SystemExit('run')\n")
    summary = tmp_path / "summary.md"

    def compare(files: str, within: str = "") -> int:
        given = {"SAME": files, "WITHIN": within, "RUNNER_TEMP": ".", "GITHUB_STEP_SUMMARY": str(summary)}
        command = ["bash", "-eo", "pipefail", "-c", steps()[3]["run"]]
        return subprocess.run(command, cwd=tmp_path, env=os.environ | given, check=False).returncode

    assert compare("a.urdf\n\na.urdf\n") == 0
    assert compare("a.urdf\nb c.urdf\n$(touch RUN)") == 2
    assert compare("a.urdf\nb c.urdf") == 1
    assert "SAME" in summary.read_text()
    assert "DIFFERS" in summary.read_text()
    assert summary.read_text().count("origin x") == 1  # only the list of differences has this text
    assert compare("a.urdf\nb c.urdf", "0.01") == 0
    assert compare("a.urdf\nb c.urdf", "1; touch RUN") == 2
    assert not (tmp_path / "RUN").exists()


def test_every_input_of_the_action_reaches_a_script_as_a_variable() -> None:
    action = yaml.safe_load((ROOT / "action.yml").read_text("utf-8"))
    used = " ".join(str(step["env"]) for step in steps())
    assert set(re.findall(r"inputs\.([\w-]+)", used)) == set(action["inputs"])
    assert not any("${{" in step["run"] for step in steps())
