"""A branch that changes the package must change the changelog; a checkout without history passes."""

import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from scripts.changelog_gate import main

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="an archive is tested where git is not")


def git(folder: Path, *words: str) -> None:
    who = ("-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgSign=false")
    subprocess.run(["git", *who, *words], cwd=folder, check=True, capture_output=True)


def commit(folder: Path, message: str, **files: str) -> None:
    for name, text in files.items():
        path = folder / {"module": "urdfkin/module.py", "page": "CHANGELOG.md", "docs": "docs/dh.md"}[name]
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    git(folder, "add", "-A")
    git(folder, "commit", "-m", message)


@pytest.fixture
def branch(tmp_path: Path) -> Path:
    """Make a repository with a new branch."""
    folder = tmp_path / "here"
    folder.mkdir()
    git(folder, "init", "-b", "main")
    commit(folder, "Begin", module="one = 1\n" * 9, page="- one\n", docs="# Tables\n")
    git(folder, "switch", "-c", "branch")
    return folder


def test_a_change_of_the_package_alone_fails_with_its_name(branch: Path, capsys: Any) -> None:
    commit(branch, "Change", module="two = 2\n")
    assert main(branch) == 1
    assert "urdfkin/module.py changed" in capsys.readouterr().out


def test_a_line_in_the_changelog_in_any_commit_of_the_branch_is_enough(branch: Path) -> None:
    commit(branch, "Change", module="two = 2\n")
    commit(branch, "Say so", page="- two\n- one\n")
    assert main(branch) == 0


@pytest.mark.parametrize(("reason", "status"), [(" the same results", 0), ("", 1)])
def test_a_commit_message_can_state_that_users_notice_nothing(reason: str, status: int, branch: Path) -> None:
    commit(branch, f"Say it shorter\n\nNo-changelog:{reason}", module="two = 2\n")
    assert main(branch) == status


def test_pages_and_moves_need_no_line(branch: Path) -> None:
    git(branch, "mv", "urdfkin/module.py", "urdfkin/other name.py")
    commit(branch, "Move", docs="# Denavit-Hartenberg tables\n")
    assert main(branch) == 0


def test_a_deletion_is_a_change(branch: Path) -> None:
    git(branch, "rm", "urdfkin/module.py")
    git(branch, "commit", "-m", "Delete")
    assert main(branch) == 1


def test_later_changes_on_main_do_not_count_for_the_branch(branch: Path) -> None:
    commit(branch, "Write", docs="# Denavit-Hartenberg tables\n")
    git(branch, "switch", "main")
    commit(branch, "Change", module="two = 2\n")
    git(branch, "switch", "branch")
    assert main(branch) == 0


@pytest.mark.parametrize("kind", ["main", "shallow", "archive"])
def test_without_a_commit_to_compare_with_the_gate_reports_this_and_passes(
    branch: Path, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    commit(branch, "Change", module="two = 2\n")
    place = branch
    if kind == "main":
        git(branch, "switch", "main")
    elif kind == "shallow":
        place = tmp_path / "shallow"
        git(tmp_path, "clone", "--depth", "1", "--branch", "branch", branch.as_uri(), str(place))
    else:
        shutil.rmtree(branch / ".git")
    assert main(place) == 0
    assert capsys.readouterr().out.startswith("changelog not checked: ")
