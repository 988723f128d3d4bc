"""The rules in their order, for a text or whatever holds one: bytes, XML, dialect, numbers, names, and so on.

The text is read once: who loads a robot makes it of the same records that the rules were applied to.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from urdfkin.errors.validators import as_bool, as_str
from urdfkin.lint.finding import Finding, Findings
from urdfkin.lint.limits import DEFAULT_LIMITS, Limits
from urdfkin.lint.pages import CODES
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rules.axes import check_axes
from urdfkin.lint.rules.comments import check_unused, read_comments
from urdfkin.lint.rules.dialect import check_dialect
from urdfkin.lint.rules.document import read_document
from urdfkin.lint.rules.inertials import check_inertials
from urdfkin.lint.rules.joints import read_robot
from urdfkin.lint.rules.materials import check_materials
from urdfkin.lint.rules.meshes import check_meshes
from urdfkin.lint.rules.mimic import check_mimic
from urdfkin.lint.rules.names import check_names
from urdfkin.lint.rules.prefixes import check_prefixes
from urdfkin.lint.rules.ranges import check_ranges
from urdfkin.lint.rules.shapes import check_shapes
from urdfkin.lint.rules.structure import check_structure
from urdfkin.lint.rules.suspicious import check_suspicious
from urdfkin.lint.rules.vocabulary import check_vocabulary
from urdfkin.urdf.records import RobotRecord
from urdfkin.urdf.sources import Source, Text, read_source


def check(
    source: Source,
    *,
    limits: Limits = DEFAULT_LIMITS,
    mimic: bool | None = None,
    root_joint: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
    fold: bool = False,
) -> Findings:
    """Findings about a URDF, by line, without computing anything.

    Besides what the text itself tells, packages and files that meshes are said to lie in are looked for; no
    mesh is opened.

    Args:
        source: A path, a name of the catalogue, URDF text, bytes, an open file, or `-` for standard input.
        limits: How large the file may be.
        mimic: Whether mimic joints are to follow; without, what is wrong with them is a note. None: True,
            except for the robots whose catalogue entry says that theirs cannot work.
        root_joint: `"floating"` or `"planar"` when the robot will hang from such a joint.
        xacro_args: Arguments for a .xacro file, which is expanded first; lines are those of the result.
        fold: Whether many warnings of one kind are folded into one that lists the lines, and errors from the
            hundredth of a kind on into that one.

    Returns:
        The findings that no comment of the file silences, a list that a notebook shows as a table; an empty
        one for a file nothing can be said against. Of each kind 10,000 are written out; `also` of the last
        holds the lines of the others.

    Raises:
        SourceError: the file cannot be read.
        UnknownNameError: neither a file nor a name of the catalogue; the nearest names are offered.
        InputError: something else than a source.

    >>> for finding in check('<robot name="r"><link name="base"/><link name="stray"/></robot>'):
    ...     print(finding)  # doctest: +ELLIPSIS
    <text>:1:42: URDF411 error: link 'stray': the link has no parent, and neither has "base"; ...
    """
    if mimic is not None:
        as_bool(mimic, "mimic")
    if root_joint is not None:
        as_str(root_joint, "root_joint")
    as_bool(fold, "fold")
    text = read_source(source, limits.bytes, xacro_args)
    return Findings(examine(text, limits=limits, mimic=mimic, root_joint=root_joint, fold=fold).findings)


@dataclass(frozen=True, slots=True)
class Examined:
    """A text and what was found in it.

    Attributes:
        text: What was read.
        data: Its bytes behind a byte order mark: lines, columns and fixes count in them.
        robot: What it says; None where it is no URDF.
        findings: By line.
        silenced: Findings that a comment silences, each with its reason.
    """

    text: Text
    data: bytes
    robot: RobotRecord | None
    findings: tuple[Finding, ...]
    silenced: tuple[tuple[Finding, str], ...]


def examine(
    text: Text,
    *,
    limits: Limits = DEFAULT_LIMITS,
    mimic: bool | None = None,
    root_joint: str | None = None,
    fold: bool = False,
    wanted: Callable[[Finding], bool] | None = None,
) -> Examined:
    """As `check`, of a text that was read already.

    Args:
        text: The text.
        limits: As for `check`, and so the next three.
        mimic: See there.
        root_joint: See there.
        fold: See there.
        wanted: Which findings, asked before any are folded; None: all.
    """
    if mimic is None:
        mimic = text.entry is None or text.entry.mimic
    report = Reporter(text.label, text.data, limits)
    robot = read_urdf(report, mimic=mimic, root_joint=root_joint)
    if robot is not None:
        check_meshes(report, robot.element, file_of(text))
        check_unused(report)
    return Examined(
        text, report.data, robot, report.findings(fold=fold, wanted=wanted), tuple(report.silenced)
    )


def file_of(text: Text) -> Path | None:
    """The file a text was read from, which tells where its packages may lie; None where there is none."""
    path = Path(text.source if text.entry is None else text.label)
    return None if text.source in ("-", "<text>", "<bytes>") or not path.is_file() else path


def check_text(data: bytes, *, limits: Limits = DEFAULT_LIMITS, fold: bool = True) -> tuple[Finding, ...]:
    """Everything there is to say about a URDF, by line: a pure function of the bytes.

    It opens no file and no connection, and asks neither yourdfpy nor Pinocchio.

    Args:
        data: The file's bytes.
        limits: How large the file may be.
        fold: As for `check`.

    >>> [finding.code for finding in check_text(b"<robot name='r'><link name='base'/></robot>")]
    []
    """
    report = Reporter("<text>", data, limits)
    read_urdf(report)
    return report.findings(fold=fold)


def read_urdf(report: Reporter, *, mimic: bool = True, root_joint: str | None = None) -> RobotRecord | None:
    """What the reporter's file says, with findings about it; None when it is no URDF.

    Args:
        report: The file's name, bytes and limits, and where findings go.
        mimic: Whether mimic joints are to follow their leaders; without, what is wrong with them is a note.
        root_joint: `"floating"` or `"planar"` when the robot will hang from such a joint: then the names that
            joint takes are errors.
    """
    root = read_document(report)
    read_comments(report, CODES)
    version = None if root is None else check_dialect(report, root)
    if root is None or version is None:
        return None
    check_prefixes(report, root)
    check_vocabulary(report, root)
    robot = read_robot(report, root, version)
    check_names(report, robot, root_joint)
    sound = check_structure(report, robot)
    check_axes(report, robot)
    check_ranges(report, robot)
    check_mimic(report, robot, obeyed=mimic)
    check_suspicious(report, robot, sound=sound)
    check_inertials(report, robot)
    check_shapes(report, robot)
    check_materials(report, robot)
    return robot
