"""Find the files and the settings for `urdfkin check`, and select the findings to report.

The settings are in pyproject.toml:

    [tool.urdfkin]
    ignore = ["URDF601"]
    exclude = ["third_party"]
    baseline = "urdfkin-baseline.json"
    per-file-ignores = { "legacy/*" = ["URDF5"] }

Files and patterns in the settings are relative to the folder of pyproject.toml. The patterns of `include`
are an exception: urdfkin compares them with file names.

The settings select the codes of findings, and can hide notes. A selected finding is reported if it is neither
in the baseline nor in an older version of the file. A baseline is a JSON file with known findings. A finding
is known if the baseline has an entry with the same file, code, severity, element, name and wrong text. Line
numbers are not compared, so a finding is still known after you edit other lines.
"""

from __future__ import annotations

import glob
import json
import os
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath
from typing import Any

from urdfkin.errors import InputError, SourceError, UnknownNameError
from urdfkin.system.files import is_folder, may_exist, read_bytes, read_text
from urdfkin.system.git import CommitFiles
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.findings import Finding, Severity
from urdfkin.urdf.lint.pages import find_rules
from urdfkin.urdf.lint.rules.bodies import MESH_MISSING
from urdfkin.urdf.lint.runner import Examination, find_local_path
from urdfkin.urdf.sources import UrdfText, is_xacro, unambiguous_path

#: Version of the baseline format. The number changes if a field is removed or changes its meaning.
BASELINE_VERSION = 1

BaselineKey = tuple[str, ...]
_BASELINE_FIELDS = ("file", "code", "severity", "element", "name", "found")


def baseline_key(finding: Finding, file: str) -> BaselineKey:
    words = (finding.severity.value, finding.element or "", finding.name or "", finding.found or "")
    return (file, finding.code, *words)


@dataclass(slots=True)
class Baseline:
    """Known findings, counted by key.

    File names in the keys are relative to the folder `root`. `counts` contains only findings that the current
    run has not found yet.
    """

    counts: Counter[BaselineKey]
    root: Path = field(default_factory=Path)
    match_count: int = 0

    def consume(self, finding: Finding) -> bool:
        key = baseline_key(finding, relative_path(finding.file, self.root))
        if self.counts[key] <= 0:
            return False
        self.counts[key] -= 1
        self.match_count += 1
        return True

    def count_unmatched(self, files: Iterable[str]) -> int:
        """Return the number of known findings in `files` that the run has not found."""
        checked = {relative_path(file, self.root) for file in files}
        return sum(count for (file, *_), count in self.counts.items() if count > 0 and file in checked)


def relative_path(file: str, root: Path) -> str:
    if file.startswith("<"):
        return file
    path = os.path.relpath(Path(file.removesuffix(" (expanded)")).resolve(), root.resolve())
    return Path(path).as_posix()


def read_baseline(path: Path) -> Baseline:
    """Read a baseline.

    Raise InputError if the file is not a baseline. Raise SourceError if the file cannot be read.
    """
    counts = Counter[BaselineKey]()
    try:
        document = json.loads(read_text(path))
        if document["schema"] != "urdfkin-baseline" or document["version"] != BASELINE_VERSION:
            raise ValueError
        for entry in document["findings"]:
            counts[tuple(str(entry[name]) for name in _BASELINE_FIELDS)] = int(entry["count"])
    except (ValueError, TypeError, LookupError, OverflowError, RecursionError):
        remedy = "write a baseline with: urdfkin check --write-baseline FILE ..."
        raise InputError("this file is not a baseline of urdfkin", where=str(path), remedy=remedy) from None
    return Baseline(counts, path.parent)


def baseline_text(findings: Iterable[Finding], files: Iterable[str], path: Path) -> str:
    """Return a baseline as text.

    If the file `path` contains an older baseline, the older entries are copied, except entries about a file
    in `files` and entries about a deleted file.
    """
    counts = Counter(baseline_key(finding, relative_path(finding.file, path.parent)) for finding in findings)
    if path.exists():
        checked = {relative_path(file, path.parent) for file in files}
        older = read_baseline(path).counts
        others = [key for key in older if key[0] not in checked and (path.parent / key[0]).exists()]
        counts |= Counter({key: older[key] for key in others})
    entries = [
        dict(zip(_BASELINE_FIELDS, key, strict=True)) | {"count": n} for key, n in sorted(counts.items())
    ]
    document = {"schema": "urdfkin-baseline", "version": BASELINE_VERSION, "findings": entries}
    return json.dumps(document, indent=1) + "\n"


_SETTING_TYPES = {
    "select": list, "ignore": list, "per-file-ignores": dict, "strict": bool, "notes": bool,
    "include": list, "exclude": list, "baseline": str,
}  # fmt: skip
_TYPE_NAMES = {
    list: "a list of strings",
    dict: "a table of lists of strings",
    bool: "true or false",
    str: "a string",
}

#: Default patterns of robot files. There is no pattern for .xacro, because most .xacro files describe only a
#: part of a robot.
DEFAULT_INCLUDE = ("*.urdf",)


@dataclass(frozen=True, slots=True)
class Settings:
    """The checked settings of a file; `file` is None if no file contains settings."""

    file: Path | None = None
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def root(self) -> Path:
        return Path() if self.file is None else self.file.parent

    def ignored_codes(self, file: str) -> frozenset[str]:
        table = self.values.get("per-file-ignores", {})
        patterns = [pattern for pattern in table if matches(file, [pattern], self.root)]
        return find_codes(word for pattern in patterns for word in table[pattern])


def find_settings(start: Path) -> Settings:
    """Return the settings of the nearest pyproject.toml with a table [tool.urdfkin], or empty settings.

    The search goes upwards from `start`, up to the first folder that contains .git. Raise InputError for an
    invalid setting, UnknownNameError for an unknown setting, and SourceError if the baseline does not exist.
    """
    for folder in (start, *start.absolute().parents):
        file = folder / "pyproject.toml"
        if may_exist(file) and (found := _read_table(file)) is not None:
            return _check_settings(file, found)
        if may_exist(folder / ".git"):
            break
    return Settings()


def read_settings(file: Path) -> Settings:
    if (found := _read_table(file, pipes=True)) is None:
        remedy = "add this table, or omit --config"
        raise InputError("no table [tool.urdfkin]", where=str(file), remedy=remedy)
    return _check_settings(file, found)


def _read_table(file: Path, *, pipes: bool = False) -> Any:
    try:
        return tomllib.loads(read_text(file, pipes=pipes)).get("tool", {}).get("urdfkin")
    except (tomllib.TOMLDecodeError, AttributeError, RecursionError) as error:
        raise InputError("this file is not TOML", where=str(file), found=str(error)) from None


def _check_settings(file: Path, table: Any) -> Settings:
    where = f"{file} [tool.urdfkin]"
    if not isinstance(table, dict):
        raise InputError("this setting is not a table", where=where, found=repr(table))
    for name, value in table.items():
        if name not in _SETTING_TYPES:
            raise UnknownNameError("setting", name, _SETTING_TYPES, where=where)
        kind = _SETTING_TYPES[name]
        lists = [value] if kind is list else []
        if kind is dict and isinstance(value, dict):
            lists = [*value.values()]
        if not isinstance(value, kind) or not all(_is_list_of_strings(each) for each in lists):
            raise InputError(f"{name} must be {_TYPE_NAMES[kind]}", where=where, found=repr(value))
        if name in ("select", "ignore", "per-file-ignores"):
            try:
                find_codes(word for each in lists for word in each)
            except UnknownNameError as error:
                raise InputError(f"{name}: {error.what}", where=where, remedy=error.remedy) from None
    if "baseline" in table and not may_exist(baseline := file.parent / table["baseline"]):
        remedy = f"change the setting in {where}"
        raise SourceError("the baseline file does not exist", where=str(baseline), remedy=remedy)
    return Settings(file, table)


def _is_list_of_strings(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(word, str) for word in value)


def find_codes(words: Iterable[str]) -> frozenset[str]:
    return frozenset(rule.id for word in words for rule in find_rules(word))


def matches(file: str, patterns: Iterable[str], root: Path) -> bool:
    """Return whether a pattern matches a file or a folder above it.

    The path is relative to `root`. A pattern without a slash is compared with the name of the file and of
    each folder in the path. A pattern with a slash is compared with the relative path of the file and of each
    folder above the file. `*` matches any characters, including slashes.

    >>> matches("robots/old/arm.urdf", ["old"], Path()), matches("robots/arm.urdf", ["robots/o*"], Path())
    (True, False)
    """
    path = PurePosixPath(relative_path(file, root))
    paths = [str(path), *(str(above) for above in path.parents)]
    return any(
        any(fnmatchcase(part, pattern) for part in (path.parts if "/" not in pattern else paths))
        for pattern in (pattern.removeprefix("**/").rstrip("/") for pattern in patterns)
    )


#: Suffixes of files that a xacro file can include.
_XACRO_INCLUDE_SUFFIXES = (".xacro", ".yaml", ".yml", ".xml", ".urdf")


@dataclass(frozen=True, slots=True)
class FindingFilter:
    codes: frozenset[str]
    notes: bool = True
    settings: Settings = field(default_factory=Settings)
    baseline: Baseline | None = None

    def make_predicate(
        self, text: UrdfText, older_findings: Baseline | None = None
    ) -> Callable[[Finding], bool]:
        """Return a function that decides whether a finding is reported.

        The function counts known findings. Therefore, call the function exactly once for each finding, in
        file order.
        """
        codes = self.codes - self.settings.ignored_codes(text.label)
        known = [baseline for baseline in (self.baseline, older_findings) if baseline is not None]

        def is_reported(finding: Finding) -> bool:
            selected = finding.code in codes and (self.notes or finding.severity is not Severity.NOTE)
            # With `sum`, each baseline counts the finding. `any` would stop early.
            return selected and not sum(baseline.consume(finding) for baseline in known)

        return is_reported

    def make_independent_predicate(
        self, text: UrdfText, older_findings: Baseline | None = None
    ) -> Callable[[Finding], bool]:
        """Call `make_predicate` with copies of the baselines, so that the originals do not change."""
        copies = [
            known and replace(known, counts=Counter(known.counts))
            for known in (self.baseline, older_findings)
        ]
        return replace(self, baseline=copies[0]).make_predicate(text, copies[1])


def find_known_findings(
    text: UrdfText, version: CommitFiles, examine: Callable[[UrdfText], Examination]
) -> Baseline | None:
    """Return the findings of the older version of a file.

    Return None if the older version certainly has all current findings. All findings of an unchanged file are
    known, with two exceptions:

    - All findings of a xacro file are new if a file with a suffix of `_XACRO_INCLUDE_SUFFIXES` has changed.
      The reason is that the xacro file may include the changed file.
    - All findings about missing meshes are new if the URDF contains the name of a file that was deleted.
    """
    path = Path(text.source) if is_xacro(text.source) else find_local_path(text)
    if path is None:
        return Baseline(Counter())
    if is_xacro(text.source):
        # urdfkin cannot expand the older version of a xacro file.
        is_new = not version.contains(read_bytes(path))
        return Baseline(Counter()) if is_new or version.has_changes(_XACRO_INCLUDE_SUFFIXES) else None
    is_unchanged = version.contains(text.data)
    old_data = text.data if is_unchanged else version.read_file(path)
    findings = () if old_data is None else examine(replace(text, data=old_data)).findings
    if any(os.fsencode(name) in text.data for name in version.missing_names):
        findings = tuple(finding for finding in findings if finding.code != MESH_MISSING.id)
    elif is_unchanged:
        return None
    return Baseline(
        Counter(baseline_key(finding, relative_path(finding.file, Path())) for finding in findings)
    )


#: urdfkin and ROS's build tools skip a folder that contains one of these files.
FOLDER_IGNORE_FILES = ("COLCON_IGNORE", "AMENT_IGNORE", "CATKIN_IGNORE")


def find_files(
    argument: str, settings: Settings, include: Sequence[str], exclude: Sequence[str]
) -> list[str]:
    """Return the files that `argument` names, in sorted order.

    Raise SourceError if `argument` is empty, or if a folder or pattern contains no file.
    """
    if not argument:
        raise SourceError("the path is empty", remedy="give a file, or `.` for the current folder")
    path = Path(argument)
    if argument == "-" or argument in catalogue():
        return [argument]
    if is_folder(path):
        files = sorted(_walk_folder(path, settings.root, include, exclude))
        remedy = f"searched for {', '.join(include)}, except in hidden and excluded folders"
    elif glob.has_magic(argument) and not may_exist(path):
        files = [file for file in _find_matching_files(argument) if not matches(file, exclude, settings.root)]
        remedy = None
    else:
        return [f"./{argument}" if argument.lstrip().startswith("<") else argument]
    if not files:
        raise SourceError("no URDF found", where=argument, remedy=remedy)
    return files


def _walk_folder(folder: Path, root: Path, include: Sequence[str], exclude: Sequence[str]) -> Iterator[str]:
    for here, folders, files in os.walk(folder):
        if any(name in FOLDER_IGNORE_FILES for name in files):
            folders.clear()
            continue
        place = Path(here)
        folders[:] = [
            name
            for name in folders
            if not name.startswith(".") and not matches(str(place / name), exclude, root)
        ]
        named = (place / name for name in files if any(fnmatchcase(name, pattern) for pattern in include))
        yield from (unambiguous_path(file) for file in named if not matches(str(file), exclude, root))


def _find_matching_files(pattern: str) -> list[str]:
    names = map(Path, glob.glob(pattern, recursive=True))  # noqa: PTH207  Path.glob() refuses some patterns
    return sorted(unambiguous_path(name) for name in names if not is_folder(name))
