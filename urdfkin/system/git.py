"""What git is asked: the files of an older version, read as they were kept.

Only commands that read objects are used. Those that look at the working tree (`diff`, `status`) would run
programs that a stranger's repository names in its settings.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

from urdfkin.errors import SourceError
from urdfkin.system.files import MOST, read_bytes


@dataclass(frozen=True, slots=True)
class Version:
    """A version of a repository.

    Attributes:
        root: The folder that its files are named from.
        files: Name -> the digest of what it held.
        digests: All of these.
        gone: The last parts of the names of files that are there no more.
    """

    root: Path
    files: dict[str, str]
    digests: frozenset[str]
    gone: frozenset[str]

    def name(self, path: Path) -> str:
        """What a file is called in it."""
        return Path(os.path.relpath(path.resolve(), self.root)).as_posix()

    def holds(self, data: bytes) -> bool:
        """Whether one of its files, of whatever name, held just that."""
        blob = b"blob %d\0" % len(data) + data
        return any(
            hashlib.new(kind, blob, usedforsecurity=False).hexdigest() in self.digests
            for kind in ("sha1", "sha256")
        )

    def changed(self, endings: tuple[str, ...]) -> bool:
        """Whether a file of one of these endings is not what it was, or is gone."""
        names = (name for name in self.files if name.endswith(endings))
        return not all(
            (self.root / name).is_file() and self.holds(read_bytes(self.root / name)) for name in names
        )

    def read(self, path: Path) -> bytes | None:
        """What a file held; None where it was not there.

        Raises:
            SourceError: git cannot tell, or it was larger than a file may be.
        """
        if (digest := self.files.get(self.name(path))) is None:
            return None
        if int(size := _text("cat-file", "-s", digest, cwd=self.root)) > MOST:
            raise SourceError(
                "too large in the older version",
                where=str(path),
                found=f"{size} bytes, more than {MOST}",
                remedy="leave out --changed-since",
            )
        return _git("cat-file", "blob", digest, cwd=self.root)


def version_before(reference: str, folder: Path) -> Version:
    """The version from which a repository's present one parted from another.

    Args:
        reference: The other: a branch, a tag, a commit.
        folder: A folder of the repository.

    Raises:
        SourceError: git is not there, the folder lies in no repository, or there is no such version.
    """
    root = Path(os.fsdecode(_git("rev-parse", "--show-toplevel", cwd=folder).rstrip(b"\n")))
    try:
        commit = _text(
            "rev-parse", "--verify", "--quiet", "--end-of-options", f"{reference}^{{commit}}", cwd=root
        )
        parted = _text("merge-base", commit, "HEAD", cwd=root)
    except SourceError as error:
        raise SourceError(
            "git knows no version from which this one parted",
            where=reference,
            found=error.found,
            remedy="fetch it first, with the commits between: in GitHub's actions/checkout, fetch-depth: 0",
        ) from None
    rows = _git("ls-tree", "-r", "-z", "--full-tree", parted, cwd=root).split(b"\0")
    parts = (row.partition(b"\t") for row in rows if row)
    files = {os.fsdecode(name): head.split()[2].decode() for head, _, name in parts}
    gone = frozenset(Path(name).name for name in files if not (root / name).exists())
    return Version(root, files, frozenset(files.values()), gone)


def _text(*words: str, cwd: Path) -> str:
    return _git(*words, cwd=cwd).decode().strip()


def _git(*words: str, cwd: Path) -> bytes:
    # Nothing is fetched, asked for or paged.
    environ = os.environ | {
        "GIT_NO_LAZY_FETCH": "1",
        "GIT_TERMINAL_PROMPT": "0",
        "GIT_PAGER": "",
        "LC_ALL": "C",
    }
    try:
        done = subprocess.run(
            ["git", "-c", "core.fsmonitor=false", *words],
            cwd=cwd, env=environ, stdin=subprocess.DEVNULL, capture_output=True, check=False,
        )  # fmt: skip
    except FileNotFoundError:
        raise SourceError("git is not installed", remedy="install it, or leave out --changed-since") from None
    if done.returncode:
        found = done.stderr.decode("utf-8", "replace").strip().removeprefix("fatal: ")
        raise SourceError("git cannot tell", where=str(cwd), found=found or None)
    return done.stdout
