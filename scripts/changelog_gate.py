"""Fail if a branch changes the package without a new line in CHANGELOG.md.

    python scripts/changelog_gate.py [--base REVISION]

The base is the commit at which the branch left `main` (or `origin/main`). Files that were only moved do not
count as changed. If no user notices the change, add the line `No-changelog: <reason>` to a commit message of
the branch. Without `--base`, the script finds no base in some cases, for example on main or in a shallow
clone. The script then prints "changelog not checked" with the reason, and exits with code 0.
"""

import argparse
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = "CHANGELOG.md"
_NO_CHANGELOG = re.compile(r"^No-changelog: +\S", re.MULTILINE | re.IGNORECASE)


class NoBaseError(Exception):
    """HEAD has no base to compare with."""


def run_git(root: Path, *words: str) -> str:
    try:
        done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=True)
    except FileNotFoundError:
        raise NoBaseError("git is not installed") from None
    except subprocess.CalledProcessError as error:
        raise NoBaseError((error.stderr.strip().splitlines() or ["git has no message"])[-1]) from None
    return done.stdout


def find_branch_point(root: Path) -> str:
    head = run_git(root, "rev-parse", "HEAD").strip()
    for main in ("origin/main", "main"):
        try:
            base = run_git(root, "merge-base", "HEAD", main).strip()
        except NoBaseError:
            continue
        if base != head:
            return base
    raise NoBaseError("HEAD is on main, or main is not in this clone")


def main(root: Path = ROOT, base: str | None = None) -> int:
    try:
        base = base or find_branch_point(root)
        entries = run_git(root, "diff", "--numstat", "-z", "-M", base, "HEAD")
        messages = run_git(root, "log", "--format=%B", f"{base}..HEAD")
    except NoBaseError as error:
        print(f"changelog not checked: {error}")
        return 0
    # ADDED and DELETED are numbers of lines. git prints one entry for each changed file:
    #     ADDED TAB DELETED TAB PATH NUL
    # The entry of a moved file has two paths:
    #     ADDED TAB DELETED TAB NUL OLD_PATH NUL NEW_PATH NUL
    changes = re.findall(r"(\S+)\t(\S+)\t(?:\0[^\0]*\0)?([^\0]+)\0", entries)
    changed = {path for added, deleted, path in changes if (added, deleted) != ("0", "0")}
    package = sorted(path for path in changed if path.startswith("urdfkin/"))
    if not package or PAGE in changed or _NO_CHANGELOG.search(messages):
        return 0
    more = f" and {len(package) - 1} more" if len(package) > 1 else ""
    print(
        f"{package[0]}{more} changed without a line in {PAGE}: add a line under the unreleased version, or"
        " write `No-changelog: REASON` into a commit message"
    )
    return 1


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--base", help="revision to compare with HEAD")
    sys.exit(main(base=parser.parse_args().base))
