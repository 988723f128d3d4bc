"""Findings that were there before: they block nobody, and new ones stand out.

A finding is known again by its file, code, severity, element, name and what was found, not by its line: an
edit elsewhere does not make it new, and touching the value that it is about does.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from urdfkin.errors import InputError
from urdfkin.lint.finding import Finding
from urdfkin.system.files import read_text

#: Version of the file; it changes when a field changes its meaning or goes away.
VERSION = 1

Key = tuple[str, ...]
_FIELDS = ("file", "code", "severity", "element", "name", "found")


def key_of(finding: Finding, file: str) -> Key:
    """What a finding is known by."""
    words = (finding.severity.value, finding.element or "", finding.name or "", finding.found or "")
    return (file, finding.code, *words)


@dataclass(slots=True)
class Baseline:
    """How many findings of each kind are known.

    Attributes:
        counts: How many there may be.
        root: The folder that files are named from.
        met: How many known ones were met.
    """

    counts: Counter[Key]
    root: Path = field(default_factory=Path)
    met: int = 0

    def knows(self, finding: Finding) -> bool:
        """Whether a finding is one of them; each is used up by one."""
        key = key_of(finding, relative(finding.file, self.root))
        if self.counts[key] <= 0:
            return False
        self.counts[key] -= 1
        self.met += 1
        return True

    def gone(self, files: Iterable[str]) -> int:
        """How many known findings of the files that were checked were not met again."""
        checked = {relative(file, self.root) for file in files}
        return sum(count for (file, *_), count in self.counts.items() if count > 0 and file in checked)


def relative(file: str, root: Path) -> str:
    """A file's name as a baseline in some folder writes it."""
    if file.startswith("<"):
        return file
    path = os.path.relpath(Path(file.removesuffix(" (expanded)")).resolve(), root.resolve())
    return Path(path).as_posix()


def read_baseline(path: Path) -> Baseline:
    """The known findings that a file holds.

    Raises:
        SourceError: it cannot be read.
        InputError: it is no baseline.
    """
    try:
        document = json.loads(read_text(path))
        if document["schema"] != "urdfkin-baseline" or document["version"] != VERSION:
            raise ValueError
        counts = Counter(
            {
                tuple(str(entry[name]) for name in _FIELDS): int(entry["count"])
                for entry in document["findings"]
            }
        )
    except (ValueError, TypeError, LookupError, RecursionError):
        raise InputError(
            "not a baseline of urdfkin",
            where=str(path),
            remedy="write one with: urdfkin check --write-baseline FILE ...",
        ) from None
    return Baseline(counts, path.parent)


def baseline_text(findings: Iterable[Finding], files: Iterable[str], path: Path) -> str:
    """The file that makes all of these findings known.

    What an older baseline there knows of files that were not checked now, and still exist, stays known.

    Args:
        findings: Of the files that were checked.
        files: These files.
        path: Where it will be written.

    Raises:
        InputError: something else is there.
    """
    counts = Counter(key_of(finding, relative(finding.file, path.parent)) for finding in findings)
    if path.exists():
        checked = {relative(file, path.parent) for file in files}
        older = read_baseline(path).counts
        counts |= Counter(
            {key: n for key, n in older.items() if key[0] not in checked and (path.parent / key[0]).exists()}
        )
    entries = [dict(zip(_FIELDS, key, strict=True)) | {"count": n} for key, n in sorted(counts.items())]
    document = {"schema": "urdfkin-baseline", "version": VERSION, "findings": entries}
    return json.dumps(document, indent=1) + "\n"
