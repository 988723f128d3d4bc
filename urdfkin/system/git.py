"""Read files of an older version of a git repository.

The module uses only git commands that read git objects. Commands that read the working tree, such as `diff`
and `status`, can run external programs. The settings of an untrusted repository could name any program.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

from urdfkin.errors import SourceError
from urdfkin.system.files import MAX_BYTES, read_bytes


@dataclass(frozen=True, slots=True)
class CommitFiles:
    """The files of one commit of a git repository.

    Attributes:
        files: Git's digest of the content of each file. The key is the path of the file relative to `root`.
        missing_names: File names that the commit contains and the working tree lacks. The names do not
            include folders.
    """

    root: Path
    files: dict[str, str]
    digests: frozenset[str]
    missing_names: frozenset[str]

    def relative_name(self, path: Path) -> str:
        return Path(os.path.relpath(path.resolve(), self.root)).as_posix()

    def contains(self, data: bytes) -> bool:
        blob = b"blob %d\0" % len(data) + data
        return any(
            hashlib.new(kind, blob, usedforsecurity=False).hexdigest() in self.digests
            for kind in ("sha1", "sha256")
        )

    def has_changes(self, suffixes: tuple[str, ...]) -> bool:
        names = (name for name in self.files if name.endswith(suffixes))
        return not all(
            (self.root / name).is_file() and self.contains(read_bytes(self.root / name)) for name in names
        )

    def read_file(self, path: Path) -> bytes | None:
        if (digest := self.files.get(self.relative_name(path))) is None:
            return None
        if int(size := _text("cat-file", "-s", digest, cwd=self.root)) > MAX_BYTES:
            raise SourceError(
                "too large in the older version",
                where=str(path),
                found=f"{size} bytes, more than {MAX_BYTES}",
                remedy="leave out --changed-since",
            )
        return _git("cat-file", "blob", digest, cwd=self.root)


def merge_base_files(reference: str, folder: Path) -> CommitFiles:
    """Return the files of the merge base of HEAD and `reference`, which is a branch, tag or commit.

    Raise SourceError if git fails.
    """
    root = Path(os.fsdecode(_git("rev-parse", "--show-toplevel", cwd=folder).rstrip(b"\n")))
    fetch = "in GitHub's actions/checkout set fetch-depth: 0"
    try:
        commit = _text(
            "rev-parse", "--verify", "--quiet", "--end-of-options", f"{reference}^{{commit}}", cwd=root
        )
    except SourceError:
        raise SourceError(
            "git finds no branch, tag or commit with this name",
            where=reference or repr(reference),
            remedy=f"correct the name, or fetch the commit first; {fetch}",
        ) from None
    try:
        merge_base = _text("merge-base", commit, "HEAD", cwd=root)
    except SourceError as error:
        raise SourceError(
            "git finds no common ancestor of this commit and HEAD",
            where=reference,
            found=error.found,
            remedy=f"fetch the history of both commits first; {fetch}",
        ) from None
    rows = _git("ls-tree", "-r", "-z", "--full-tree", merge_base, cwd=root).split(b"\0")
    parts = (row.partition(b"\t") for row in rows if row)
    files = {os.fsdecode(name): head.split()[2].decode() for head, _, name in parts}
    missing_names = frozenset(Path(name).name for name in files if not (root / name).exists())
    return CommitFiles(root, files, frozenset(files.values()), missing_names)


def _text(*words: str, cwd: Path) -> str:
    return _git(*words, cwd=cwd).decode().strip()


def _git(*words: str, cwd: Path) -> bytes:
    # These variables prevent git from fetching, prompting, starting a pager or translating messages.
    environ = os.environ | {
        "GIT_NO_LAZY_FETCH": "1",
        "GIT_TERMINAL_PROMPT": "0",
        "GIT_PAGER": "",
        "LC_ALL": "C",
    }
    try:
        result = subprocess.run(
            ["git", "-c", "core.fsmonitor=false", *words],
            cwd=cwd, env=environ, stdin=subprocess.DEVNULL, capture_output=True, check=False,
        )  # fmt: skip
    except FileNotFoundError:
        raise SourceError(
            "git is not installed", remedy="install git, or leave out --changed-since"
        ) from None
    if result.returncode:
        found = result.stderr.decode("utf-8", "replace").strip().removeprefix("fatal: ")
        raise SourceError("git failed", where=str(cwd), found=found or None)
    return result.stdout
