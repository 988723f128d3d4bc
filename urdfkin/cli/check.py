"""`urdfkin check`: check robot files, print the findings, and apply automatic fixes."""

from __future__ import annotations

import codecs
import contextlib
import io
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import click

from urdfkin.cli.options import (
    FILE,
    WholeNumber,
    combine,
    load_options,
    mimic_option,
    reject_unused_options,
    root_joint_option,
    source_options,
)
from urdfkin.cli.output import check_writable, output_option, write_output
from urdfkin.cli.shell import complete_code, complete_file
from urdfkin.cli.streams import escape_for_terminal, print_github_commands, say, say_styled
from urdfkin.errors import SourceError, UnknownNameError, UrdfkinError
from urdfkin.errors.display import format_count
from urdfkin.system.files import read_bytes, read_start, require_regular_file, write_file
from urdfkin.system.git import CommitFiles, merge_base_files
from urdfkin.system.lazy_import import installed_version
from urdfkin.urdf.findings import ExcerptFormatter, UrdfError, UrdfWarning
from urdfkin.urdf.lint import Finding, Severity, SizeLimits
from urdfkin.urdf.lint.autofix import fix_text, make_patch
from urdfkin.urdf.lint.formats import as_github, as_json, as_sarif, format_statistics, format_summary
from urdfkin.urdf.lint.pages import MJCF_AND_USD_RULES, URDF_RULES, page
from urdfkin.urdf.lint.runner import Examination, examine, find_local_path
from urdfkin.urdf.lint.settings import (
    DEFAULT_INCLUDE,
    FindingFilter,
    Settings,
    baseline_text,
    find_codes,
    find_files,
    find_known_findings,
    find_settings,
    read_baseline,
    read_settings,
)
from urdfkin.urdf.sources import USD_SUFFIXES, UrdfText, is_usd, is_xacro, read_source, resolve_package_uri

STYLES = ("terminal", "concise", "json", "sarif", "github")
_COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "blue"}


@dataclass(slots=True)
class CheckOutcome:
    """The results of all files.

    Attributes:
        silenced_findings: Findings that a comment in the file suppresses, each with the reason in the
            comment.
        excerpts: For each finding, the faulty line and a line with carets; None if the finding marks no text.
        known_count: Number of findings that the baseline file suppresses.
        obsolete_count: Number of findings in the baseline file that the checked files no longer have.
        unsafe_count: Number of findings that only --unsafe-fixes would fix.
        files_with_errors: Files with a reported finding of severity error. The option --fix does not change
            these files. A warning that --strict reports as an error does not count.
        files_with_mark: Files that begin with a byte order mark.
        unwritable: Names of inputs that --fix cannot change: standard input, a pipe, an expanded .xacro file,
            or a robot of the catalogue.
    """

    files: list[str] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    silenced_findings: list[tuple[Finding, str]] = field(default_factory=list)
    excerpts: list[str | None] = field(default_factory=list)
    errors: list[UrdfkinError] = field(default_factory=list)
    unchanged_count: int = 0
    known_count: int = 0
    obsolete_count: int = 0
    fixable_count: int = 0
    patches: list[str] = field(default_factory=list)
    unsafe_count: int = 0
    files_with_errors: set[str] = field(default_factory=set)
    files_with_mark: set[str] = field(default_factory=set)
    unwritable: set[str] = field(default_factory=set)

    def add(self, file: str, found: Examination) -> None:
        formatter = ExcerptFormatter(found.data)
        self.files.append(file)
        if found.text.data.startswith(codecs.BOM_UTF8):
            self.files_with_mark.add(found.text.label)
        self.findings += found.findings
        self.silenced_findings += found.silenced_findings
        self.excerpts += [formatter.format(finding) for finding in found.findings]

    def findings_with_usable_fixes(self) -> list[Finding]:
        return [replace(one, fix=None) if one.file in self.unwritable else one for one in self.findings]


def print_outcome(outcome: CheckOutcome, style: str, *, statistics: bool) -> None:
    findings, version = outcome.findings, installed_version("urdfkin") or "0+unknown"
    if style == "json":
        click.echo(as_json(findings, outcome.files, version, outcome.silenced_findings))
    elif style == "sarif":
        click.echo(as_sarif(findings, version, outcome.silenced_findings, outcome.files_with_mark))
    elif style == "github":
        if findings:
            print_github_commands(as_github(findings))
    elif statistics:
        for line in format_statistics(outcome.findings_with_usable_fixes()):
            say(line)
        _print_summary(outcome)
    elif outcome.files or outcome.unchanged_count:
        _print_findings(outcome, excerpts=style == "terminal")


def _print_findings(outcome: CheckOutcome, *, excerpts: bool) -> None:
    findings = outcome.findings_with_usable_fixes()
    for finding, excerpt in zip(findings, outcome.excerpts, strict=True):
        place, rest = str(finding).split(f": {finding.code} ", 1)
        colour = {"fg": _COLOURS[finding.severity], "bold": True}
        mark = " [*] " if finding.fix and finding.fix.is_safe else " "
        say_styled((place, {"bold": True}), (": ", {}), (finding.code, colour), (f"{mark}{rest}", {}))
        if excerpts and excerpt is not None:
            line, _, caret = excerpt.partition("\n")
            say_styled((line, {}))
            say_styled((caret, colour))
    _print_summary(outcome)
    fixes = [finding.fix for finding in findings if finding.fix]
    unsafe = sum(not fix.is_safe for fix in fixes)
    if len(fixes) > unsafe:
        refused = any(finding.fix and finding.file in outcome.files_with_errors for finding in findings)
        note = "correct the errors of a file first" if refused else "--diff prints the changes"
        say(f"[*] --fix fixes these findings; {note}")
    if unsafe:
        also = f"--unsafe-fixes also fixes {format_count(unsafe, 'finding')}"
        say(f"{also}, but rotates joints by more than a rounding error")
    worst = next((f.code for f in outcome.findings if f.severity is Severity.ERROR), None)
    if worst is not None:
        say(f"run 'urdfkin explain {worst}' for details: {page(worst).title}")


def _print_summary(outcome: CheckOutcome) -> None:
    counts = [
        (len(outcome.silenced_findings), "silenced by comments: {}"),
        (outcome.unchanged_count, "unchanged files: {}"),
        (outcome.known_count, "already known: {}"),
        (outcome.obsolete_count, "listed in the baseline but no longer found: {}; write the baseline again"),
    ]
    details = ", ".join(text.format(count) for count, text in counts if count)
    say(format_summary(outcome.findings, len(outcome.files)) + (f" ({details})" if details else ""))


def _report_fixes(file: str, fixed: Sequence[Finding]) -> None:
    for code in sorted({finding.code for finding in fixed}):
        same_code = [finding for finding in fixed if finding.code == code]
        turns = max(finding.fix.max_rotation for finding in same_code if finding.fix)
        lines = sorted({finding.line for finding in same_code})
        more = f" and {len(lines) - 4} more" if len(lines) > 4 else ""
        where = f"line{'s' if len(lines) > 1 else ''} {', '.join(map(str, lines[:4]))}{more}"
        effect = f"; each joint rotated by at most {turns:.1e} rad" if turns else "; the robot is unchanged"
        say(f"{file}: fixed {code} {URDF_RULES[code].slug}, {where}{effect}", err=True)


_SETTINGS_KEY = "urdfkin.settings"
#: Settings in pyproject.toml that replace the defaults of the options with the same names.
_OPTION_SETTINGS = ("select", "ignore", "exclude", "strict", "notes")


def _read_settings(context: click.Context, _: click.Parameter, file: Path | None) -> None:
    isolated = "--isolated" in context.meta
    settings = Settings() if isolated else find_settings(Path()) if file is None else read_settings(file)
    values = dict(settings.values)
    defaults: dict[str, Any] = {name: values[name] for name in _OPTION_SETTINGS if name in values}
    if "baseline" in values:
        defaults["baseline"] = str(settings.root / values["baseline"])
    context.default_map = defaults
    context.meta[_SETTINGS_KEY] = settings


def _isolate(context: click.Context, _: click.Parameter, isolated: bool) -> None:
    if isolated:
        context.meta["--isolated"] = True


finding_options = combine(
    click.option(
        "--select",
        multiple=True,
        metavar="CODE",
        shell_complete=complete_code,
        help="Report only this code (URDF502), name (axis-not-unit) or family (URDF5). Repeatable, or"
        " separated by commas.",
    ),
    click.option(
        "--ignore",
        multiple=True,
        metavar="CODE",
        shell_complete=complete_code,
        help="Leave out this code, name or family. Repeatable, or separated by commas.",
    ),
    click.option("--strict/--no-strict", default=False, help="Report warnings as errors."),
    click.option("--notes/--no-notes", default=True, help='Also report findings of severity "note".'),
    click.option(
        "--exclude",
        multiple=True,
        metavar="GLOB",
        help="Leave out files and folders that match this pattern; repeatable.",
    ),
    click.option("--baseline", type=FILE, help="Leave out the findings listed in this baseline file."),
    click.option(
        "--write-baseline", type=FILE, help="Write all findings to this file as a baseline and exit with 0."
    ),
    click.option(
        "--changed-since",
        metavar="VERSION",
        help="Report only findings that are new since a branch, tag or commit of git.",
    ),
)
settings_file_options = combine(
    click.option(
        "--isolated", is_flag=True, is_eager=True, expose_value=False, callback=_isolate,
        help="Ignore the settings in pyproject.toml.",
    ),
    click.option(
        "--config", type=FILE, is_eager=True, expose_value=False, callback=_read_settings,
        help="File with a table [tool.urdfkin] of settings.", show_default="the nearest pyproject.toml",
    ),
)  # fmt: skip
_SIZE_LIMIT_HELP = {
    "bytes": "Largest size of a file in bytes.",
    "depth": "Largest nesting depth of XML elements.",
    "elements": "Largest number of XML elements in a file.",
    "attributes": "Largest number of attributes of an XML element.",
    "name": "Largest length of a name in characters.",
    "number": "Largest length of a number's text in characters.",
    "markup": "Largest size of a tag, comment or processing instruction in bytes.",
}
size_limit_options = combine(
    *(
        click.option(
            f"--max-{limit.name}",
            type=WholeNumber(1),
            default=limit.default,
            help=_SIZE_LIMIT_HELP[limit.name],
        )
        for limit in fields(SizeLimits)
    )
)


@click.command("check")
@click.argument("files", nargs=-1, metavar="[FILE|FOLDER|GLOB]...", shell_complete=complete_file)
@click.option(
    "--format", "--output-format", "style", type=click.Choice(STYLES), default="terminal",
    help="Output format.",
)  # fmt: skip
@output_option("Write the findings, or the patch of --diff, to this file.")
@click.option("--fix", is_flag=True, help="Make the automatic fixes in the files.")
@click.option(
    "--unsafe-fixes",
    is_flag=True,
    help="With --fix or --diff: include fixes that rotate a joint beyond rounding errors.",
)
@click.option("--diff", is_flag=True, help="Print a patch of the changes that --fix would make.")
@click.option("--statistics", is_flag=True, help="Print only the number of findings of each code.")
@finding_options
@click.option(
    "--each",
    is_flag=True,
    help="Print each finding on its own line. By default, findings of one kind share a line.",
)
@mimic_option("Check mimic joints as coupled joints, or as free joints.", "mimic")
@root_joint_option(
    "Check for this root joint: the names root_joint (joint) and universe (link) are then errors."
)
@source_options
@settings_file_options
@size_limit_options
@click.pass_context
def check_command(context: click.Context, /, files: Sequence[str], **options: Any) -> None:
    """Check URDF files and print the findings, each with its code, line, cause and remedy.

    A FILE is the path of a URDF, USD or MJCF file, a name that `urdfkin robots` lists, or - for standard
    input. For a FOLDER, the command checks the *.urdf files in the folder and its subfolders, except hidden
    subfolders. Without FILE and FOLDER, the current folder is checked.

    A .xacro file is expanded in a restricted process. The process can only compute, and read files in certain
    folders such as the .xacro file's package (docs/xacro.md).

    With --changed-since origin/main, the command reports only the new findings of a pull request. Settings
    are in the table [tool.urdfkin] of pyproject.toml (docs/check.md).

    Exit 0: no error. 1: an error. 2: an unreadable file or a wrong option. With --diff, exit 0: no changes.
    1: changes.

    \b
    Example:
      urdfkin check robots/
      urdfkin check --strict --ignore URDF601 arm.urdf 'robots/**/*.urdf'
      urdfkin check --statistics
      urdfkin check --select URDF503 --fix arm.urdf
      urdfkin explain URDF502
    """  # noqa: D301  click needs the character "\b"
    if options["diff"]:
        reject_unused_options(context, ("fix", "style", "statistics", "each"), "with --diff")
    if not (options["fix"] or options["diff"]):
        reject_unused_options(context, ("unsafe_fixes",), "without --fix and --diff")
    if options["write_baseline"] is not None:
        reject_unused_options(
            context, ("output", "style", "statistics", "changed_since"), "with --write-baseline"
        )
    if options["statistics"] and options["style"] not in ("terminal", "concise"):
        reject_unused_options(context, ("statistics",), f"with --format {options['style']}")
    run = _make_run(context.meta[_SETTINGS_KEY], options)
    for word in files or ["."]:
        run.find_files(word, options["exclude"])
    if not any(map(is_xacro, run.words)):
        reject_unused_options(context, ("xacro_arg",), "without a .xacro file")
    if not any(map(is_usd, run.words)):
        reject_unused_options(context, ("variant", "articulation"), "without a USD file")
    check_writable(options["output"], options["write_baseline"], more_inputs=run.words)
    run.check_files()
    outcome = run.outcome
    if (baseline := run.finding_filter.baseline) is not None:
        outcome.known_count, outcome.obsolete_count = (
            baseline.match_count,
            baseline.count_unmatched(outcome.files),
        )
    if options["write_baseline"] is not None:
        _write_baseline(outcome, options["write_baseline"])
    if options["diff"]:
        write_output("".join(outcome.patches), options["output"])
        more = f" ({outcome.unsafe_count} more with --unsafe-fixes)" if outcome.unsafe_count else ""
        files_ = format_count(len(outcome.files), "file")
        say(f"{format_count(outcome.fixable_count, 'finding')} to fix in {files_}{more}", err=True)
    elif options["write_baseline"] is None:
        _write_outcome(outcome, options["style"], options["output"], statistics=options["statistics"])
    for error in outcome.errors:
        say(f"urdfkin: error: {error}", err=True)
    sys.exit(run.exit_code())


def _write_outcome(outcome: CheckOutcome, style: str, path: Path | None, *, statistics: bool) -> None:
    if path is None:
        print_outcome(outcome, style, statistics=statistics)
        return
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        print_outcome(outcome, style, statistics=statistics)
    write_file(path, text.getvalue().encode())


def _make_run(settings: Settings, options: dict[str, Any]) -> CheckRun:
    writing = options["write_baseline"] is not None
    baseline = None if writing or options["baseline"] is None else read_baseline(options["baseline"])
    since = options["changed_since"]
    how = load_options()
    examine_text = partial(
        examine,
        limits=SizeLimits(**{limit.name: options[f"max_{limit.name}"] for limit in fields(SizeLimits)}),
        mimic=how["mimic"],
        root_joint=how["root_joint"],
    )
    codes_ = (_read_codes(options, "select") or frozenset(URDF_RULES | MJCF_AND_USD_RULES)) - _read_codes(
        options, "ignore"
    )
    return CheckRun(
        examine_text=examine_text,
        finding_filter=FindingFilter(codes_, options["notes"], settings, baseline),
        # A baseline stores the original severities.
        strict=options["strict"] and not writing,
        fold=options["style"] in ("terminal", "concise", "github") and not (options["each"] or writing),
        fix=options["fix"],
        diff=options["diff"],
        allows_unsafe_fixes=options["unsafe_fixes"],
        commit_files=None if since is None else merge_base_files(since, Path()),
        writes_baseline=writing,
    )


def _read_codes(options: dict[str, Any], name: str) -> frozenset[str]:
    try:
        return find_codes([part for word in options[name] for part in word.replace(",", " ").split()])
    except UnknownNameError as error:
        raise click.UsageError(f"--{name}: {error}") from error


@dataclass(slots=True)
class CheckRun:
    """One check of many files.

    Attributes:
        fold: Whether findings with the same code share a line of output; see `urdfkin.check`.
        words: The files to check, each with the argument of the command that names it, such as a folder.
        _paths: The absolute path of each file. Each file is checked once.
        writes_baseline: True with --write-baseline. A finding of severity error then does not change the
            exit code.
    """

    examine_text: partial[Examination]
    finding_filter: FindingFilter
    strict: bool
    fold: bool
    fix: bool
    diff: bool
    allows_unsafe_fixes: bool
    commit_files: CommitFiles | None
    writes_baseline: bool
    outcome: CheckOutcome = field(default_factory=CheckOutcome)
    words: dict[str, str] = field(default_factory=dict)
    _paths: set[str] = field(default_factory=set)
    _has_changes: dict[tuple[str, ...], bool] = field(default_factory=dict)

    def find_files(self, word: str, exclude: Sequence[str]) -> None:
        settings = self.finding_filter.settings
        try:
            files = find_files(word, settings, settings.values.get("include", DEFAULT_INCLUDE), exclude)
        except SourceError as error:
            self.outcome.errors.append(error)
            return
        for file in files:
            # A name such as `panda` is a robot of the catalogue, and `./panda` is a file.
            path = file if file == Path(file).stem else str(Path(file).parent.resolve() / Path(file).name)
            if path not in self._paths:
                self._paths.add(path)
                self.words[file] = word

    def check_files(self) -> None:
        for file, word in self.words.items():
            try:
                # A file may be a pipe only if the command line names it.
                if file not in (word, f"./{word}"):
                    require_regular_file(Path(file))
                self._check(str(resolve_package_uri(file)))
            except UrdfkinError as error:
                self.outcome.errors.append(error)

    def _check(self, file: str) -> None:
        if _is_usd_or_mjcf(file):
            self._check_usd_or_mjcf(file)
            return
        arguments = load_options()["xacro_args"] if is_xacro(file) else None
        text = read_source(file, self.examine_text.keywords["limits"].bytes, arguments)
        if file == "-" and _is_mjcf_text(text.data):
            self._check_usd_or_mjcf(file, text)
            return
        before = None
        if self.commit_files is not None:
            before = find_known_findings(text, self.commit_files, self.examine_text)
            if before is None:
                self.outcome.unchanged_count += 1
                return
        if self.fix or self.diff:
            text = self._fix(file, text, lambda: self.finding_filter.make_independent_predicate(text, before))
        found = self.examine_text(
            text, fold=self.fold, is_reported=self.finding_filter.make_predicate(text, before)
        )
        if any(finding.severity is Severity.ERROR for finding in found.findings):
            self.outcome.files_with_errors.add(file)
        if _find_writable_path(text) is None:
            self.outcome.unwritable.add(text.label)
        findings = [self._apply_strict(finding) for finding in found.findings]
        self.outcome.add(file, replace(found, findings=tuple(findings)))

    def _check_usd_or_mjcf(self, file: str, streamed: UrdfText | None = None) -> None:
        suffixes = USD_SUFFIXES if is_usd(file) else _MJCF
        if self.commit_files is not None:
            data = read_bytes(Path(file)) if streamed is None else streamed.data
            if self._is_unchanged(data, suffixes, self.commit_files):
                self.outcome.unchanged_count += 1
                return
        from urdfkin.robot.loading import load

        how = {**load_options(), "xacro_args": None}
        if not is_usd(file):
            how = {name: value for name, value in how.items() if name not in ("variant", "articulation")}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UrdfWarning)
            try:
                robot = load(file if streamed is None else _make_stream(streamed), verify=False, **how)
                found = tuple(finding for finding in robot.findings if finding.code in MJCF_AND_USD_RULES)
            except UrdfError as error:
                found = error.findings
        label = file if streamed is None else streamed.label
        text = UrdfText(b"", label, file)
        is_chosen = self.finding_filter.make_predicate(text)
        findings = tuple(self._apply_strict(finding) for finding in found if is_chosen(finding))
        data = b""
        if any(one.width and one.file == label for one in findings):
            data = read_bytes(Path(file)) if streamed is None else streamed.data
        self.outcome.add(file, Examination(text, data.removeprefix(codecs.BOM_UTF8), None, findings, ()))

    def _is_unchanged(self, data: bytes, suffixes: tuple[str, ...], commit_files: CommitFiles) -> bool:
        """Return whether a file and its included files are unchanged since a commit.

        `data` is the content of the file, and `commit_files` describes the files of the commit.

        Every file of the commit with a suffix in `suffixes` counts as included. A file that contains the name
        of a deleted file counts as changed.
        """
        if suffixes not in self._has_changes:
            self._has_changes[suffixes] = commit_files.has_changes(suffixes)
        if self._has_changes[suffixes]:
            return False
        return commit_files.contains(data) and not any(
            os.fsencode(name) in data for name in commit_files.missing_names
        )

    def _fix(self, file: str, text: UrdfText, make_predicate: Any) -> UrdfText:
        path = _find_writable_path(text)
        if path is None:
            return text
        result = fix_text(text, self.examine_text, lambda: self._make_safe_predicate(make_predicate()))
        for code, objection in result.unfixed_reasons.items():
            say(f"{file}: {code} is not fixed: {objection}", err=True)
        if self.diff:
            self.outcome.fixable_count += len(result.fixed_findings)
            self.outcome.patches.append(make_patch(file, text.data, result.text.data, escape_for_terminal))
            chosen, findings = make_predicate(), self.examine_text(result.text).findings
            # `--fix` does not change a file with an error, so its unsafe fixes are not counted.
            if not any(finding.severity is Severity.ERROR for finding in findings):
                self.outcome.unsafe_count += sum(
                    chosen(f) and bool(f.fix and not f.fix.is_safe) and not self.allows_unsafe_fixes
                    for f in findings
                )
            return text
        if result.fixed_findings:
            write_file(path, result.text.data)
            _report_fixes(file, result.fixed_findings)
        return result.text

    def _make_safe_predicate(self, is_chosen: Callable[[Finding], bool]) -> Callable[[Finding], bool]:
        return lambda finding: (
            is_chosen(finding) and (self.allows_unsafe_fixes or finding.fix is None or finding.fix.is_safe)
        )

    def _apply_strict(self, finding: Finding) -> Finding:
        is_raised = self.strict and finding.severity is Severity.WARNING
        return replace(finding, severity=Severity.ERROR) if is_raised else finding

    def exit_code(self) -> int:
        if self.outcome.errors:
            return 2
        if self.diff:
            return int(self.outcome.fixable_count > 0)
        has_error = any(finding.severity is Severity.ERROR for finding in self.outcome.findings)
        return int(has_error and not self.writes_baseline)


def _find_writable_path(text: UrdfText) -> Path | None:
    return None if text.entry is not None or is_xacro(text.source) else find_local_path(text)


#: Suffixes of MJCF files, and of files that an MJCF file includes.
_MJCF = (".xml", ".mjcf")


def _is_usd_or_mjcf(file: str) -> bool:
    if is_usd(file):
        return True
    if Path(file).suffix.lower() not in _MJCF:
        return False
    with contextlib.suppress(OSError):
        if b"<mujoco" not in read_start(Path(file), 1 << 16):
            # This return avoids the import below, which loads NumPy.
            return False
    from urdfkin.urdf.mjcf import is_mjcf

    return is_mjcf(file)


def _is_mjcf_text(data: bytes) -> bool:
    if b"<mujoco" not in data:
        return False
    from urdfkin.urdf.mjcf import is_mjcf

    return is_mjcf(data)


def _make_stream(text: UrdfText) -> io.BytesIO:
    stream = io.BytesIO(text.data)
    stream.name = text.label
    return stream


def _write_baseline(outcome: CheckOutcome, path: Path) -> None:
    if outcome.errors:
        return
    write_file(path, baseline_text(outcome.findings, outcome.files, path).encode())
    count = sum(finding.count for finding in outcome.findings)
    say(f"wrote {path}: {format_count(count, 'finding')} in the baseline", err=True)
