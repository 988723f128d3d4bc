"""What a repository wants of `check`: the table [tool.urdfkin] of its pyproject.toml.

    [tool.urdfkin]
    ignore = ["URDF601"]
    exclude = ["third_party"]
    baseline = "urdfkin-baseline.json"
    per-file-ignores = { "legacy/*" = ["URDF5"] }

Files and patterns are taken from the folder of that file.


Which findings of a file are told: those of the codes that were asked for, and that nobody knew before.
"""

from __future__ import annotations

import os
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath
from typing import Any

from urdfkin.errors import InputError, SourceError, UnknownNameError
from urdfkin.lint.baseline import Baseline, key_of, relative
from urdfkin.lint.finding import Finding, Severity
from urdfkin.lint.pages import find_rules
from urdfkin.lint.rules.meshes import MESH_MISSING
from urdfkin.lint.runner import Examined, file_of
from urdfkin.system.files import exists, read_text
from urdfkin.system.git import Version
from urdfkin.urdf.sources import Text, is_xacro

#: Setting -> what it is.
_KINDS = {
    "select": list, "ignore": list, "per-file-ignores": dict, "strict": bool, "notes": bool,
    "include": list, "exclude": list, "baseline": str,
}  # fmt: skip
_WORDS = {
    list: "a list of strings",
    dict: "a table of lists of strings",
    bool: "true or false",
    str: "a string",
}

#: Names of files in a folder that are robots: a .xacro file is mostly a part of one.
INCLUDE = ("*.urdf",)


@dataclass(frozen=True, slots=True)
class Settings:
    """A table of settings.

    Attributes:
        file: Where it stands; None where there is none.
        values: Setting -> value, of the right kinds.
    """

    file: Path | None = None
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def root(self) -> Path:
        """The folder that patterns are taken from."""
        return Path() if self.file is None else self.file.parent

    def ignored_in(self, file: str) -> frozenset[str]:
        """The codes that are ignored in a file."""
        table = self.values.get("per-file-ignores", {}).items()
        return codes(
            word for pattern, words in table if matches(file, [pattern], self.root) for word in words
        )


def find_settings(start: Path) -> Settings:
    """The settings of the repository that a folder lies in; none without a table [tool.urdfkin].

    Looked for in the folder and those above it, up to the first that holds .git.

    Raises:
        SourceError: a pyproject.toml cannot be read.
        InputError: it is no TOML, or a setting in it is wrong.
    """
    for folder in (start, *start.absolute().parents):
        file = folder / "pyproject.toml"
        if exists(file) and (found := _table(file)) is not None:
            return _checked(file, found)
        if exists(folder / ".git"):
            break
    return Settings()


def read_settings(file: Path) -> Settings:
    """The settings of a file that was named: those of its table [tool.urdfkin].

    Raises:
        SourceError: it cannot be read.
        InputError: it has no such table, or a setting in it is wrong.
    """
    if (found := _table(file, pipes=True)) is None:
        raise InputError(
            "no table [tool.urdfkin]", where=str(file), remedy="write one, or leave out --config"
        )
    return _checked(file, found)


def _table(file: Path, *, pipes: bool = False) -> Any:
    try:
        return tomllib.loads(read_text(file, pipes=pipes)).get("tool", {}).get("urdfkin")
    except (tomllib.TOMLDecodeError, AttributeError, RecursionError) as error:
        raise InputError("not TOML", where=str(file), found=str(error)) from None


def _checked(file: Path, table: Any) -> Settings:
    where = f"{file} [tool.urdfkin]"
    if not isinstance(table, dict):
        raise InputError("not a table", where=where, found=repr(table))
    for name, value in table.items():
        if name not in _KINDS:
            raise UnknownNameError("setting", name, _KINDS, where=where)
        kind = _KINDS[name]
        lists = (
            [value] if kind is list else [*value.values()] if kind is dict and isinstance(value, dict) else []
        )
        if not isinstance(value, kind) or not all(_is_words(each) for each in lists):
            raise InputError(f"{name} is {_WORDS[kind]}", where=where, found=repr(value))
        if name in ("select", "ignore", "per-file-ignores"):
            try:
                codes(word for each in lists for word in each)
            except UnknownNameError as error:
                raise InputError(f"{name}: {error.what}", where=where, remedy=error.remedy) from None
    if "baseline" in table and not exists(baseline := file.parent / table["baseline"]):
        raise SourceError("no such baseline", where=str(baseline), remedy=f"{where} names it")
    return Settings(file, table)


def _is_words(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(word, str) for word in value)


def codes(words: Iterable[str]) -> frozenset[str]:
    """The codes that words stand for.

    Raises:
        UnknownNameError: a word stands for none.

    >>> sorted(codes(["rounded-pi", "URDF52"]))[:3]
    ['URDF520', 'URDF521', 'URDF522']
    """
    return frozenset(rule.id for word in words for rule in find_rules(word))


def matches(file: str, patterns: Iterable[str], root: Path) -> bool:
    """Whether one of some patterns means a file, or a folder that it lies in.

    A pattern without a slash is held against each name on the way from the root, one with a slash against the
    way itself; `*` stands for any letters, slashes among them.

    >>> matches("robots/old/arm.urdf", ["old"], Path()), matches("robots/arm.urdf", ["robots/o*"], Path())
    (True, False)
    """
    path = PurePosixPath(relative(file, root))
    ways = [str(path), *(str(above) for above in path.parents)]
    return any(
        any(fnmatchcase(part, pattern) for part in (path.parts if "/" not in pattern else ways))
        for pattern in (pattern.removeprefix("**/").rstrip("/") for pattern in patterns)
    )


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
