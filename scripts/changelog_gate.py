"""Fail when a branch changes the package and CHANGELOG.md says nothing of it.

    python scripts/changelog_gate.py [--base REVISION]

The base is where the branch left `main` (or `origin/main`); files that only moved do not count. What no user
notices is argued in a commit of the branch: `No-changelog: REASON`. Where there is nothing to compare with
(main itself, a shallow clone, an unpacked archive, no git) the gate says so and passes: it guards branches.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from collections.abc import Collection
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = "CHANGELOG.md"
_ARGUED = re.compile(r"^No-changelog: +\S", re.MULTILINE | re.IGNORECASE)


class CannotTellError(Exception):
    """Why nothing can be compared."""


def complaint(changed: Collection[str], messages: str) -> str | None:
    """What is wrong with a branch that changes these files, its commits' messages at hand."""
    package = sorted(path for path in changed if path.startswith("urdfkin/"))
    if not package or PAGE in changed or _ARGUED.search(messages):
        return None
    more = f" and {len(package) - 1} more" if len(package) > 1 else ""
    return f"{package[0]}{more} changed, and {PAGE} says nothing of it"


def git(root: Path, *words: str) -> str:
    """What git answers; raises CannotTellError if it does not."""
    try:
        done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=True)
    except FileNotFoundError:
        raise CannotTellError("git is not installed") from None
    except subprocess.CalledProcessError as error:
        raise CannotTellError((error.stderr.strip().splitlines() or ["git does not answer"])[-1]) from None
    return done.stdout


def left_main(root: Path) -> str:
    """The commit at which HEAD left main.

    Raises:
        CannotTellError: HEAD is on main, or there is no main, or the clone does not reach that far back.
    """
    head = git(root, "rev-parse", "HEAD").strip()
    for main in ("origin/main", "main"):
        try:
            base = git(root, "merge-base", "HEAD", main).strip()
        except CannotTellError:
            continue
        if base != head:
            return base
    raise CannotTellError("HEAD is on main, or main is not in this clone")


def changed_files(root: Path, base: str) -> set[str]:
    """Files that are not as they were at `base`, wherever they stood."""
    entries = git(root, "diff", "--numstat", "-z", "-M", base, "HEAD")
    # added TAB deleted TAB path NUL; where the file moved, added TAB deleted TAB NUL old NUL new NUL.
    found = re.findall(r"(\S+)\t(\S+)\t(?:\0[^\0]*\0)?([^\0]+)\0", entries)
    return {path for added, deleted, path in found if (added, deleted) != ("0", "0")}


def main(root: Path = ROOT, base: str | None = None) -> int:
    """0: nothing is missing, or nothing can be told; 1: a line is missing."""
    try:
        base = base or left_main(root)
        said = complaint(changed_files(root, base), git(root, "log", "--format=%B", f"{base}..HEAD"))
    except CannotTellError as error:
        print(f"changelog not checked: {error}")
        return 0
    if said:
        print(f"{said}: add a line under the unreleased version, or to a commit `No-changelog: REASON`")
    return 1 if said else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--base", help="the revision to compare with")
    sys.exit(main(base=parser.parse_args().base))
