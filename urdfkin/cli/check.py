"""`urdfkin check`: check URDF files, print the findings in several formats, and apply automatic fixes."""

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

from urdfkin.cli.completion import complete_code, complete_file
from urdfkin.cli.options import (
    Whole,
    how_to_load,
    mimic_option,
    reject_unused_options,
    root_joint_option,
    source_options,
    together,
)
from urdfkin.cli.output import hand_out
from urdfkin.cli.streams import command_lines, harmless, say, say_styled
from urdfkin.errors import SourceError, UnknownNameError, UrdfkinError
from urdfkin.system.files import demand_regular, read_bytes, read_start, write_file
from urdfkin.system.git import Version, version_before
from urdfkin.system.lazy_import import installed_version
from urdfkin.urdf.findings import Excerpts, UrdfError, UrdfWarning
from urdfkin.urdf.lint import Finding, Limits, Severity
from urdfkin.urdf.lint.autofix import mend, patch
from urdfkin.urdf.lint.formats import as_github, as_json, as_sarif, statistics, summary
from urdfkin.urdf.lint.pages import OF_OTHERS, RULES, page
from urdfkin.urdf.lint.runner import Examined, examine, file_of
from urdfkin.urdf.lint.settings import (
    INCLUDE,
    Choice,
    Settings,
    baseline_text,
    codes,
    collected,
    find_settings,
    known_before,
    read_baseline,
    read_settings,
)
from urdfkin.urdf.sources import USD, Text, is_usd, is_xacro, read_source

STYLES = ("terminal", "concise", "json", "sarif", "github")
_COLOURS = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.NOTE: "blue"}


@dataclass(slots=True)
class CheckOutcome:
    """The results of all files.

    Attributes:
        findings: Findings to print.
        silenced: Pairs of a finding that a comment in the file suppresses, and the reason in this comment.
        excerpts: For each finding, the line of the file, and a second line with a caret under the fault.
        unreadable: The errors of the files that could not be read.
        unchanged: Number of files that --changed-since skips because they have not changed.
        known: Number of findings that the baseline file lists and the check suppresses. Second, the number of
            entries in the baseline file that the check no longer finds.
        to_fix: Number of findings that --fix would fix.
        patches: The patches of --diff.
        unsafe: Number of further findings that --unsafe-fixes would fix.
    """

    files: list[str] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    silenced: list[tuple[Finding, str]] = field(default_factory=list)
    excerpts: list[str | None] = field(default_factory=list)
    unreadable: list[UrdfkinError] = field(default_factory=list)
    unchanged: int = 0
    known: tuple[int, int] = (0, 0)
    to_fix: int = 0
    patches: list[str] = field(default_factory=list)
    unsafe: int = 0

    def add(self, file: str, found: Examined) -> None:
        excerpts = Excerpts(found.data)
        self.files.append(file)
        self.findings += found.findings
        self.silenced += found.silenced
        self.excerpts += [excerpts.of(finding) for finding in found.findings]


def print_outcome(outcome: CheckOutcome, style: str, *, statistics: bool) -> None:
    findings, version = outcome.findings, installed_version("urdfkin") or "0+unknown"
    if style == "json":
        click.echo(as_json(findings, outcome.files, version, outcome.silenced))
    elif style == "sarif":
        click.echo(as_sarif(findings, version, outcome.silenced))
    elif style == "github":
        if findings:
            command_lines(as_github(findings))
    elif statistics:
        _print_statistics(outcome)
    elif outcome.files or outcome.unchanged:
        _print_terminal(outcome, excerpts=style == "terminal")


def _print_terminal(outcome: CheckOutcome, *, excerpts: bool) -> None:
    for finding, excerpt in zip(outcome.findings, outcome.excerpts, strict=True):
        place, rest = str(finding).split(f": {finding.code} ", 1)
        colour = {"fg": _COLOURS[finding.severity], "bold": True}
        mark = " [*] " if finding.fix and finding.fix.is_safe else " "
        say_styled((place, {"bold": True}), (": ", {}), (finding.code, colour), (f"{mark}{rest}", {}))
        if excerpts and excerpt is not None:
            line, _, caret = excerpt.partition("\n")
            say_styled((line, {}))
            say_styled((caret, colour))
    _print_summary(outcome)
    if any(finding.fix and finding.fix.is_safe for finding in outcome.findings):
        say("[*] --fix fixes these findings; --diff prints the changes")
    if unsafe := sum(bool(finding.fix and not finding.fix.is_safe) for finding in outcome.findings):
        many = "s" * (unsafe != 1)
        also = f"--unsafe-fixes also fixes {unsafe} finding{many}"
        say(f"{also}, but rotates joints by more than a rounding error")
    worst = next((f.code for f in outcome.findings if f.severity is Severity.ERROR), None)
    if worst is not None:
        say(f"run 'urdfkin explain {worst}' for details: {page(worst).title}")


def _print_summary(outcome: CheckOutcome) -> None:
    asides = [
        f"silenced by comments: {len(outcome.silenced)}" if outcome.silenced else "",
        f"unchanged files: {outcome.unchanged}" if outcome.unchanged else "",
        f"already known: {outcome.known[0]}" if outcome.known[0] else "",
        f"in the baseline but already fixed: {outcome.known[1]}; write the baseline again"
        if outcome.known[1]
        else "",
    ]
    aside = ", ".join(filter(None, asides))
    say(summary(outcome.findings, len(outcome.files)) + (f" ({aside})" if aside else ""))


def _print_statistics(outcome: CheckOutcome) -> None:
    for line in statistics(outcome.findings):
        say(line)
    _print_summary(outcome)


def say_fixed(file: str, fixed: Sequence[Finding]) -> None:
    for code in sorted({finding.code for finding in fixed}):
        these = [finding for finding in fixed if finding.code == code]
        turns = max(finding.fix.turns for finding in these if finding.fix)
        lines = sorted({finding.line for finding in these})
        more = f" and {len(lines) - 4} more" if len(lines) > 4 else ""
        where = f"line{'s' if len(lines) > 1 else ''} {', '.join(map(str, lines[:4]))}{more}"
        moved = f"; each joint rotated by at most {turns:.1e} rad" if turns else "; the robot is unchanged"
        say(f"{file}: fixed {code} {RULES[code].slug}, {where}{moved}", err=True)


_SETTINGS = "urdfkin.settings"
#: These settings in pyproject.toml are the defaults of the options with the same names.
_OPTIONS = ("select", "ignore", "exclude", "strict", "notes")
_FILE = click.Path(path_type=Path, dir_okay=False)


def _take_settings(context: click.Context, _: click.Parameter, file: Path | None) -> None:
    """Read the settings of the repository or of `file`; they are the defaults of the options."""
    isolated = "--isolated" in context.meta
    settings = Settings() if isolated else find_settings(Path()) if file is None else read_settings(file)
    values = dict(settings.values)
    given: dict[str, Any] = {name: values[name] for name in _OPTIONS if name in values}
    if "baseline" in values:
        given["baseline"] = str(settings.root / values["baseline"])
    context.default_map = given
    context.meta[_SETTINGS] = settings


def _isolate(context: click.Context, _: click.Parameter, isolated: bool) -> None:
    if isolated:
        context.meta["--isolated"] = True


choice_options = together(
    click.option(
        "--select",
        multiple=True,
        metavar="CODE",
        shell_complete=complete_code,
        help="Report only findings with this code (URDF502), name or family (URDF5); repeatable.",
    ),
    click.option(
        "--ignore",
        multiple=True,
        metavar="CODE",
        shell_complete=complete_code,
        help="Leave out findings with this code; repeatable, or several codes separated by commas.",
    ),
    click.option("--strict/--no-strict", default=False, help="Report warnings as errors."),
    click.option(
        "--notes/--no-notes", default=True, help="Report findings of severity note.  [default: notes]"
    ),
    click.option(
        "--exclude",
        multiple=True,
        metavar="GLOB",
        help="Leave out files and folders that match this pattern.",
    ),
    click.option("--baseline", type=_FILE, help="Leave out the findings listed in this baseline file."),
    click.option(
        "--write-baseline", type=_FILE, help="Write all findings to this file as a baseline and exit with 0."
    ),
    click.option(
        "--changed-since",
        metavar="VERSION",
        help="Report only findings that are new since a branch, tag or commit.",
    ),
)
settings_options = together(
    click.option(
        "--isolated", is_flag=True, is_eager=True, expose_value=False, callback=_isolate,
        help="Ignore the settings in pyproject.toml.",
    ),
    click.option(
        "--config", type=_FILE, is_eager=True, expose_value=False, callback=_take_settings,
        help="File with a table [tool.urdfkin] of settings.  [default: nearest pyproject.toml]",
    ),
)  # fmt: skip
#: Help texts of --max-bytes, --max-depth, ...
_MOST = {
    "bytes": "Largest size of a file in bytes.",
    "depth": "Largest nesting depth of elements.",
    "elements": "Largest number of elements in a file.",
    "attributes": "Largest number of attributes of an element.",
    "name": "Largest number of characters in a name.",
    "number": "Largest number of characters in a number.",
    "markup": "Largest size of a tag, comment or processing instruction in bytes.",
}
limit_options = together(
    *(
        click.option(
            f"--max-{limit.name}",
            type=Whole(1),
            default=limit.default,
            show_default=True,
            help=_MOST[limit.name],
        )
        for limit in fields(Limits)
    )
)


@click.command("check")
@click.argument("files", nargs=-1, metavar="[FILE|FOLDER|GLOB]...", shell_complete=complete_file)
@click.option(
    "--format", "--output-format", "style", type=click.Choice(STYLES), default="terminal", show_default=True,
    help="Output format.",
)  # fmt: skip
@click.option("--output", "-o", type=_FILE, help="Write the findings, or the patch of --diff, to this file.")
@click.option("--fix", is_flag=True, help="Apply the automatic fixes to the files.")
@click.option(
    "--unsafe-fixes", is_flag=True, help="Also apply fixes that rotate a joint by more than a rounding error."
)
@click.option("--diff", is_flag=True, help="Print the changes of --fix as a patch, without applying them.")
@click.option("--statistics", is_flag=True, help="Print the number of findings of each code.")
@choice_options
@click.option(
    "--each",
    is_flag=True,
    help="Print each finding on its own line. Default: one line for many findings of one kind.",
)
@mimic_option("Check with mimic joints coupled (--mimic) or as free joints (--no-mimic).  [default: mimic]")
@root_joint_option("Also check that no name of the robot collides with this root joint.")
@source_options
@settings_options
@limit_options
@click.pass_context
def command(context: click.Context, /, files: Sequence[str], **options: Any) -> None:
    """Check URDF files and print the findings, each with its code, line, cause and remedy.

    A FILE is the path of a URDF, USD or MJCF file, a name from `urdfkin robots`, or - for standard input. A
    FOLDER means all *.urdf files in it. Without FILE and FOLDER, the current folder is checked. A .xacro file
    is expanded in a restricted process that can only compute and read the files of its package
    (docs/xacro.md). --changed-since origin/main reports the new findings of a pull request. Settings are in
    [tool.urdfkin] of pyproject.toml (docs/check.md).

    Exit 0: no error. 1: an error, or changes with --diff. 2: an unreadable file or a wrong option.

    \b
    Example:
      urdfkin check robots/
      urdfkin check --strict --ignore URDF601 arm.urdf 'robots/**/*.urdf'
      urdfkin check --statistics
      urdfkin check --select URDF503 --fix arm.urdf
      urdfkin explain URDF502
    """  # noqa: D301 - a backspace tells click not to wrap the paragraph
    if options["fix"] and options["diff"]:
        reject_unused_options(context, ("fix",), "with --diff")
    if not (options["fix"] or options["diff"]):
        reject_unused_options(context, ("unsafe_fixes",), "without --fix and --diff")
    if options["write_baseline"] is not None:
        reject_unused_options(context, ("output", "style", "statistics"), "with --write-baseline")
    if options["statistics"] and options["style"] not in ("terminal", "concise"):
        reject_unused_options(context, ("statistics",), f"with --format {options['style']}")
    run = _run(context.meta[_SETTINGS], options)
    for word in files or ["."]:
        run.take(word, options["exclude"])
    if (known := run.choice.baseline) is not None:
        run.outcome.known = known.met, known.gone(run.outcome.files)
    if options["write_baseline"] is not None:
        _write_baseline(run, options["write_baseline"])
    if options["diff"]:
        found, among = run.outcome.to_fix, len(run.outcome.files)
        many = "s" * (found != 1), "s" * (among != 1)
        hand_out("".join(run.outcome.patches), options["output"])
        more = f" ({run.outcome.unsafe} more with --unsafe-fixes)" if run.outcome.unsafe else ""
        say(f"{found} finding{many[0]} to fix in {among} file{many[1]}{more}", err=True)
    elif options["write_baseline"] is None:
        _put_outcome(run.outcome, options["style"], options["output"], statistics=options["statistics"])
    for failure in run.outcome.unreadable:
        say(f"urdfkin: error: {failure}", err=True)
    sys.exit(run.exit_code())


def _put_outcome(outcome: CheckOutcome, style: str, path: Path | None, *, statistics: bool) -> None:
    if path is None:
        print_outcome(outcome, style, statistics=statistics)
        return
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        print_outcome(outcome, style, statistics=statistics)
    write_file(path, text.getvalue().encode())


def _run(settings: Settings, options: dict[str, Any]) -> CheckRun:
    writing = options["write_baseline"] is not None
    known = None if writing or options["baseline"] is None else read_baseline(options["baseline"])
    since = options["changed_since"]
    how = how_to_load()
    look = partial(
        examine,
        limits=Limits(**{limit.name: options[f"max_{limit.name}"] for limit in fields(Limits)}),
        mimic=how["mimic"],
        root_joint=how["root_joint"],
    )
    return CheckRun(
        look=look,
        choice=Choice(_chosen(options), options["notes"], settings, known),
        strict=options["strict"],
        fold=options["style"] in ("terminal", "concise", "github") and not (options["each"] or writing),
        fix=options["fix"],
        diff=options["diff"],
        unsafe=options["unsafe_fixes"],
        version=None if since is None else version_before(since, Path()),
        accepting=writing,
    )


def _chosen(options: dict[str, Any]) -> frozenset[str]:
    words = {
        name: [part for word in options[name] for part in word.replace(",", " ").split()]
        for name in ("select", "ignore")
    }
    found = {}
    for name, parts in words.items():
        try:
            found[name] = codes(parts)
        except UnknownNameError as error:
            raise click.UsageError(f"--{name}: {error}") from error
    return (found["select"] if words["select"] else frozenset(RULES | OF_OTHERS)) - found["ignore"]


@dataclass(slots=True)
class CheckRun:
    """One check of many files.

    Attributes:
        look: Function that checks the text of one file.
        choice: Selects the findings to report.
        strict: Whether warnings become errors.
        fold: Whether to merge findings with the same code into one line of output.
        diff: Whether to collect the changes that the fixes would make, as patches.
        unsafe: Whether the user gave --unsafe-fixes.
        version: The version that --changed-since names, or None.
        accepting: Whether the user gave --write-baseline, so that all findings are accepted.
    """

    look: partial[Examined]
    choice: Choice
    strict: bool
    fold: bool
    fix: bool
    diff: bool
    unsafe: bool
    version: Version | None
    accepting: bool
    outcome: CheckOutcome = field(default_factory=CheckOutcome)
    _taken: set[str] = field(default_factory=set)
    _changed: dict[tuple[str, ...], bool] = field(default_factory=dict)

    def take(self, word: str, exclude: Sequence[str]) -> None:
        """Check each file that an argument matches, but no file twice."""
        settings = self.choice.settings
        try:
            files = collected(word, settings, settings.values.get("include", INCLUDE), exclude)
        except SourceError as error:
            self.outcome.unreadable.append(error)
            return
        for file in files:
            if file not in self._taken:
                self._taken.add(file)
                try:
                    if file not in (word, f"./{word}"):  # The file was found in a folder.
                        demand_regular(Path(file))
                    self._check(file)
                except UrdfkinError as error:
                    self.outcome.unreadable.append(error)

    def _check(self, file: str) -> None:
        if _is_other(file):
            self._check_other(file)
            return
        text = read_source(file, self.look.keywords["limits"].bytes, how_to_load()["xacro_args"])
        before = None
        if self.version is not None:
            before = known_before(text, self.version, self.look)
            if before is None:
                self.outcome.unchanged += 1
                return
        if self.fix or self.diff:
            text = self._fix(file, text, lambda: self.choice.again(text, before))
        found = self.look(text, fold=self.fold, wanted=self.choice.of(text, before))
        findings = [self._with_severity(finding) for finding in found.findings]
        self.outcome.add(file, replace(found, findings=tuple(findings)))

    def _check_other(self, file: str) -> None:
        """Check a USD or MJCF file; if `load` rejects the robot, add the findings of its error.

        With --changed-since, an unchanged file is skipped, and all findings of a changed file are reported.
        """
        if self.version is not None and self._is_unchanged(
            file, USD if is_usd(file) else _MJCF, self.version
        ):
            self.outcome.unchanged += 1
            return
        from urdfkin.robot.loading import load

        how = how_to_load()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UrdfWarning)
            try:
                usd = {
                    name: how[name] for name in ("variant", "articulation") if name in how and is_usd(file)
                }
                robot = load(file, verify=False, **usd)
                found = tuple(one for one in robot.findings if one.code in OF_OTHERS)
            except UrdfError as error:
                found = error.findings
        text = Text(b"", file, file)
        wanted = self.choice.of(text)
        findings = tuple(self._with_severity(finding) for finding in found if wanted(finding))
        has_lines = any(one.width and one.file == file for one in findings)
        data = read_bytes(Path(file)).removeprefix(codecs.BOM_UTF8) if has_lines else b""
        self.outcome.add(file, Examined(text, data, None, findings, ()))

    def _is_unchanged(self, file: str, parts: tuple[str, ...], version: Version) -> bool:
        """Return whether a file, and every file that it may refer to, is the same as in an older version.

        The files to which the file refers are not known here. If any file with a suffix in `parts` has
        changed in the repository, the method therefore returns False. It also returns False if the file
        mentions a deleted file.
        """
        if parts not in self._changed:
            self._changed[parts] = version.changed(parts)
        if self._changed[parts]:
            return False
        data = read_bytes(Path(file))
        return version.holds(data) and not any(os.fsencode(name) in data for name in version.gone)

    def _fix(self, file: str, text: Text, choose: Any) -> Text:
        path = None if text.entry is not None or is_xacro(text.source) else file_of(text)
        if path is None:
            return text
        mended = mend(text, self.look, lambda: self._safe(choose()))
        for code, objection in mended.kept.items():
            say(f"{file}: {code} is not fixed: {objection}", err=True)
        if self.diff:
            self.outcome.to_fix += len(mended.fixed)
            self.outcome.patches.append(patch(file, text.data, mended.text.data, harmless))
            chosen = choose()
            self.outcome.unsafe += sum(
                chosen(f) and bool(f.fix and not f.fix.is_safe) and not self.unsafe
                for f in self.look(mended.text).findings
            )
            return text
        if mended.fixed:
            write_file(path, mended.text.data)
            say_fixed(file, mended.fixed)
        return mended.text

    def _safe(self, chosen: Callable[[Finding], bool]) -> Callable[[Finding], bool]:
        """Return a filter that also rejects findings with an unsafe fix, unless --unsafe-fixes is given."""
        return lambda finding: chosen(finding) and (self.unsafe or finding.fix is None or finding.fix.is_safe)

    def _with_severity(self, finding: Finding) -> Finding:
        # A baseline file stores each finding's original severity.
        raised = self.strict and not self.accepting and finding.severity is Severity.WARNING
        return replace(finding, severity=Severity.ERROR) if raised else finding

    def exit_code(self) -> int:
        """Return 2 if a file could not be read, 1 for an error or a change of --diff, 0 otherwise."""
        failed = any(finding.severity is Severity.ERROR for finding in self.outcome.findings)
        bad = self.outcome.to_fix > 0 if self.diff else failed and not self.accepting
        return 2 if self.outcome.unreadable else int(bad)


#: Suffixes of MJCF files and includes
_MJCF = (".xml", ".mjcf")


def _is_other(file: str) -> bool:
    if is_usd(file):
        return True
    if Path(file).suffix.lower() not in _MJCF:
        return False
    with contextlib.suppress(OSError):
        if b"<mujoco" not in read_start(Path(file), 1 << 16):
            return False  # The next import loads NumPy.
    from urdfkin.urdf.mjcf import is_mjcf

    return is_mjcf(file)


def _write_baseline(run: CheckRun, path: Path) -> None:
    outcome = run.outcome
    if outcome.unreadable:
        return
    write_file(path, baseline_text(outcome.findings, outcome.files, path).encode())
    many = sum(finding.count for finding in outcome.findings)
    say(f"wrote {path}: {many} finding{'s' * (many != 1)} in the baseline", err=True)
