"""Which findings of a file are told: those of the codes that were asked for, and that nobody knew before."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from urdfkin.lint.baseline import Baseline, key_of, relative
from urdfkin.lint.finding import Finding, Severity
from urdfkin.lint.rules.meshes import MESH_MISSING
from urdfkin.lint.runner import Examined, file_of
from urdfkin.lint.settings import Settings
from urdfkin.system.git import Version
from urdfkin.urdf.sources import Text, is_xacro

#: What xacro files are made of.
_PARTS = (".xacro", ".yaml", ".yml", ".xml", ".urdf")


@dataclass(frozen=True, slots=True)
class Choice:
    """What was asked for.

    Attributes:
        codes: The codes.
        notes: Whether notes are told.
        settings: What the repository wants of some files.
        baseline: What is known from a file; it counts what it was asked.
    """

    codes: frozenset[str]
    notes: bool = True
    settings: Settings = field(default_factory=Settings)
    baseline: Baseline | None = None

    def of(self, text: Text, before: Baseline | None = None) -> Callable[[Finding], bool]:
        """What says of each finding of a file, in their order, whether it is told.

        Args:
            text: The file.
            before: What an older version of it had.
        """
        codes = self.codes - self.settings.ignored_in(text.label)
        known = [baseline for baseline in (self.baseline, before) if baseline is not None]

        def wanted(finding: Finding) -> bool:
            asked = finding.code in codes and (self.notes or finding.severity is not Severity.NOTE)
            return asked and not sum(baseline.knows(finding) for baseline in known)  # each uses one up

        return wanted

    def again(self, text: Text, before: Baseline | None = None) -> Callable[[Finding], bool]:
        """The same, of copies of what is known, so that a file can be asked about more than once."""
        copies = [
            None if known is None else replace(known, counts=Counter(known.counts))
            for known in (self.baseline, before)
        ]
        return replace(self, baseline=copies[0]).of(text, copies[1])


def known_before(text: Text, version: Version, look: Callable[[Text], Examined]) -> Baseline | None:
    """What there was to find in a file before; None where it says what it said.

    Args:
        text: The file as it is.
        version: The version before.
        look: What examines a text, and finds all there is.

    A mesh that is missing was there before, where a file that is gone is called as one of the text's.
    """
    path = Path(text.source) if is_xacro(text.source) else file_of(text)
    if path is None:
        return Baseline(Counter())
    if is_xacro(text.source):
        # What it expanded to before, nobody has: all that is found counts if any part of it may have changed.
        return Baseline(Counter()) if version.changed(_PARTS) else None
    same = version.holds(text.data)
    old = text.data if same else version.read(path)
    found = () if old is None else look(replace(text, data=old)).findings
    if any(os.fsencode(name) in text.data for name in version.gone):
        found = tuple(finding for finding in found if finding.code != MESH_MISSING.id)
    elif same:
        return None
    return Baseline(Counter(key_of(finding, relative(finding.file, Path())) for finding in found))
