"""Baseline: a file of known findings, so that `check` reports only new ones.

A finding is known if its file, code, severity, element, name and found text are in the baseline. The line
does not count: an edit elsewhere does not make a finding new, but a change of its value does.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from urdfkin.errors import InputError
from urdfkin.system.files import read_text
from urdfkin.urdf.findings import Finding

#: Version of the file format; it changes when a field changes its meaning or is removed.
VERSION = 1

Key = tuple[str, ...]
_FIELDS = ("file", "code", "severity", "element", "name", "found")


def key_of(finding: Finding, file: str) -> Key:
    """Return the key that identifies a finding in a baseline."""
    words = (finding.severity.value, finding.element or "", finding.name or "", finding.found or "")
    return (file, finding.code, *words)


@dataclass(slots=True)
class Baseline:
    """The number of known findings of each key.

    Attributes:
        counts: The known findings that have no match yet, by key.
        root: The folder that file names are relative to.
        met: The number of matches.
    """

    counts: Counter[Key]
    root: Path = field(default_factory=Path)
    met: int = 0

    def knows(self, finding: Finding) -> bool:
        """Return whether a finding is known. A known finding matches only once."""
        key = key_of(finding, relative(finding.file, self.root))
        if self.counts[key] <= 0:
            return False
        self.counts[key] -= 1
        self.met += 1
        return True

    def gone(self, files: Iterable[str]) -> int:
        """Return the number of known findings without a match, in the files that were checked."""
        checked = {relative(file, self.root) for file in files}
        return sum(count for (file, *_), count in self.counts.items() if count > 0 and file in checked)


def relative(file: str, root: Path) -> str:
    """Return the name of a file relative to a folder, with forward slashes."""
    if file.startswith("<"):
        return file
    path = os.path.relpath(Path(file.removesuffix(" (expanded)")).resolve(), root.resolve())
    return Path(path).as_posix()


def read_baseline(path: Path) -> Baseline:
    """Read a baseline.

    Raises:
        SourceError: the file cannot be read.
        InputError: the file is not a baseline.
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
            "this file is not a baseline of urdfkin",
            where=str(path),
            remedy="write one with: urdfkin check --write-baseline FILE ...",
        ) from None
    return Baseline(counts, path.parent)


def baseline_text(findings: Iterable[Finding], files: Iterable[str], path: Path) -> str:
    """Return the text of a baseline that contains some findings.

    If the path has an older baseline, its entries for other existing files are copied.

    Args:
        findings: The findings of the checked files.
        files: The checked files.
        path: The path of the new baseline.

    Raises:
        InputError: the path has a file that is not a baseline.
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
