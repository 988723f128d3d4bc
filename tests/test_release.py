"""A release can be built from the checkout, and the pages state truly how to install urdfkin."""

import json
import os
import re
import shlex
import subprocess
import sys
import sysconfig
import tomllib
import venv
from pathlib import Path
from typing import Any

import pytest

from scripts import build_release, measure_size
from tests.pages import pages
from urdfkin.system.lazy_import import EXTRA_REQUIREMENTS, install_command

ROOT = Path(__file__).parents[1]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
WORKFLOWS = [ROOT / ".github/workflows", ROOT / "action.yml", ROOT / "docs/examples/robots.yml"]


def recipe() -> tuple[str, list[str]]:
    """Return the version and the requirements of the conda recipe, as rattler-build renders it."""
    rattler = pytest.importorskip("rattler_build")
    (rendered,) = rattler.Stage0Recipe.from_file(str(ROOT / "conda/recipe.yaml")).render()
    found = rendered.recipe
    return found.package.version, [str(need) for need in found.requirements.run]


def test_the_conda_recipe_has_the_version_and_the_requirements_of_the_project() -> None:
    version, needs = recipe()
    assert version == PROJECT["version"]
    wanted = {need.replace(">=", " >=") for need in PROJECT["dependencies"]}
    wanted |= {"pinocchio >=4,<5", f"python {PROJECT['requires-python']}"}
    assert set(needs) == wanted - {"pin >=4,<5"}


def test_the_changelog_begins_with_the_version_of_the_project() -> None:
    (first, *_) = re.findall(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    assert first == PROJECT["version"]


def zizmor(*paths: Path) -> subprocess.CompletedProcess[str]:
    command = [str(Path(sys.executable).with_name("zizmor")), "--offline", "--no-progress", *map(str, paths)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_the_linter_of_workflows_finds_nothing() -> None:
    done = zizmor(*WORKFLOWS)
    assert done.returncode == 0, done.stdout


def test_the_linter_of_workflows_finds_a_planted_vulnerability(tmp_path: Path) -> None:
    text = (ROOT / ".github/workflows/release.yml").read_text("utf-8")
    broken = tmp_path / ".github/workflows/release.yml"
    broken.parent.mkdir(parents=True)
    broken.write_text(text.replace('--tag "$TAG"', "--tag ${{ github.ref_name }}"), "utf-8")
    assert "template-injection" in zizmor(broken).stdout


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("release") / "dist"
    command = [sys.executable, "scripts/build_release.py", "--tag", f"v{PROJECT['version']}"]
    command += ["--sbom-of", sys.executable, str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.mark.long
def test_a_release_is_built_twice_checked_and_listed(dist: Path) -> None:
    name = f"urdfkin-{PROJECT['version']}"
    sums = (dist / "SHA256SUMS").read_text("utf-8").splitlines()
    endings = (".tar.gz", "-py3-none-any.whl", ".cdx.json")
    assert [line.split("  ")[1] for line in sums] == [f"{name}{ending}" for ending in endings]
    assert subprocess.run(["sha256sum", "-c", "SHA256SUMS"], cwd=dist, check=False).returncode == 0
    parts = json.loads((dist / f"{name}.cdx.json").read_text("utf-8"))["components"]
    assert {"numpy", "pin", "numba", "click"} <= {part["name"] for part in parts}


@pytest.mark.long
def test_a_build_that_differs_is_refused(dist: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = f"urdfkin-{PROJECT['version']}"
    files = (dist / f"{name}.tar.gz", dist / f"{name}-py3-none-any.whl")
    other = tmp_path / files[1].name
    other.write_bytes(files[1].read_bytes() + b" ")
    monkeypatch.setattr(build_release, "build", lambda folder: (files[0], other))
    with pytest.raises(SystemExit, match="two builds of one commit differ"):
        build_release.check_reproducible(files)


def test_a_tag_that_is_not_the_version_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(sys, "argv", ["build_release.py", "--tag", "v9.9.9", str(tmp_path)])
    with pytest.raises(SystemExit, match=r"the tag is v9\.9\.9"):
        build_release.main()


def installing() -> list[str]:
    """Return each `pip install` and `pip wheel` of the pages that names urdfkin or its clone."""
    texts = [(ROOT / "README.md").read_text("utf-8")]
    texts += [(ROOT / "docs" / page).read_text("utf-8") for page in pages() if page != "releasing.md"]
    lines = (line for text in texts for line in text.splitlines() if "After the first release" not in line)
    shown = r"(?<=- run: )pip .*$|^pip (?:install|wheel) .*$|(?<=`)pip install [^`]+"
    found = re.findall(shown, "\n".join(lines), re.MULTILINE)
    return sorted({line for line in found if re.search("urdfkin|PATH_OF_TH", line)})


def test_a_remedy_names_the_packages_of_the_extra() -> None:
    extras = PROJECT["optional-dependencies"]
    ours = {name: packages for name, packages in extras.items() if name not in ("docs", "release", "test")}
    assert {name: [package] for name, package in EXTRA_REQUIREMENTS.items()} == ours
    assert install_command("mujoco") == "pip install 'mujoco>=4,<5'"


def test_no_message_installs_urdfkin_from_an_index() -> None:
    files = [file for file in (ROOT / "urdfkin").rglob("*") if file.suffix in (".py", ".toml", ".j2")]
    assert len(files) > 100
    line = re.compile(r"""pip install ['"]?urdfkin\W.*|install \W?urdfkin\[.*""")
    assert {file.name: found for file in files if (found := line.findall(file.read_text("utf-8")))} == {}


@pytest.fixture(scope="module")
def lent(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A new environment that sees every package of this one except urdfkin; pip reaches no network."""
    folder = tmp_path_factory.mktemp("lent")
    venv.create(folder / "env", with_pip=True)
    here = Path(sysconfig.get_path("purelib"))
    there = next((folder / "env/lib").glob("python*/site-packages"))
    for entry in here.iterdir():
        if "urdfkin" not in entry.name and not (there / entry.name).exists():
            (there / entry.name).symlink_to(entry)
    return folder


@pytest.mark.long
def test_every_line_that_installs_urdfkin_works_today(lent: Path) -> None:
    lines = installing()
    assert len(lines) >= 5
    bin_ = lent / "env/bin"
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    environment |= {"PIP_NO_INDEX": "1", "PIP_NO_BUILD_ISOLATION": "0"}
    environment["PATH"] = f"{bin_}:{os.environ['PATH']}"
    how: dict[str, Any] = {"cwd": lent, "env": environment, "capture_output": True, "text": True}
    for line in sorted(lines, key=lambda line: "dist/" in line):
        command = shlex.split(re.sub("PATH_OF_TH(E|IS)_CLONE", str(ROOT), line))
        for words in (command, ["urdfkin", "--version"], ["pip", "uninstall", "--yes", "urdfkin"]):
            if command[1] == "install" or words is command:
                done = subprocess.run(words, check=False, **how)
                assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"


def test_without_yourdfpy_urdfkin_reads_its_files() -> None:
    code = (
        "import sys; sys.modules['yourdfpy'] = sys.modules['trimesh'] = None; import urdfkin;"
        " print(urdfkin.load('panda').jacobian('ready').shape)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout == "(6, 8)\n", done.stderr


@pytest.mark.slow
def test_the_packages_that_only_yourdfpy_needs_are_not_in_the_line_that_avoids_them() -> None:
    (line,) = re.findall(r'^.*"pin>=.*$', (ROOT / "docs/install.md").read_text("utf-8"), re.MULTILINE)
    named = {re.split("[<>=]", word)[0] for word in shlex.split(line)[2:]}
    needed = {re.split("[<>=]", need)[0] for need in PROJECT["dependencies"]}
    assert named == needed - {"yourdfpy"}
    only = (
        measure_size.measure_packages("urdfkin").keys()
        - measure_size.measure_packages("urdfkin", without="yourdfpy").keys()
    )
    assert {"yourdfpy", "trimesh"} <= only
    assert not only & named
