"""Run all rules on a URDF.

`urdfkin.load` builds the robot from the records that the rules have checked.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from urdfkin.errors import InputError
from urdfkin.errors.validators import as_bool, safe_repr
from urdfkin.urdf.findings import Finding, Findings, Reporter
from urdfkin.urdf.lint.pages import CODE_BY_NAME
from urdfkin.urdf.lint.rules.bodies import check_inertials, check_materials, check_meshes, check_shapes
from urdfkin.urdf.lint.rules.dialect import (
    apply_comments,
    check_dialect,
    check_names,
    check_prefixes,
    check_unused_comments,
    check_vocabulary,
)
from urdfkin.urdf.lint.rules.joints import (
    check_axes,
    check_mimic,
    check_ranges,
    check_structure,
    check_suspicious,
)
from urdfkin.urdf.parser import read_document, read_robot
from urdfkin.urdf.records import DEFAULT_SIZE_LIMITS, RobotRecord, SizeLimits
from urdfkin.urdf.sources import Source, UrdfText, check_root_joint, read_source


def check(
    source: Source,
    *,
    limits: SizeLimits = DEFAULT_SIZE_LIMITS,
    mimic: bool | None = None,
    root_joint: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
    fold: bool = False,
) -> Findings:
    """Check a URDF and return the findings, sorted by line.

    The function also checks that the packages and mesh files in the URDF exist. No mesh is opened. Mesh files
    without a package are checked only if the source is a file.

    Args:
        source: A path, a `package://` address, a catalogue name, URDF text, bytes, an open file, or `-` for
            standard input.
        limits: Limits on the size of the file, its elements, names and numbers.
        mimic: Whether mimic joints follow their mimicked joints. If False, the codes
            URDF520 to URDF527 are notes. The default is True, except for robots of the catalogue with invalid
            mimic rules.
        root_joint: `"floating"` or `"planar"` if you will load the robot with this argument.
        xacro_args: Arguments for a .xacro file, which is expanded first. Line numbers of findings are those
            of the expanded text.
        fold: Whether to combine four or more warnings or notes with one code into a single finding that lists
            the lines. For the codes URDF7xx, two are enough. If `fold` is True, at most 100 errors with one
            code are returned. The last of these errors lists the lines of all further errors.

    Returns:
        The findings that no comment silences, as a list. Notebooks show this list as a table. The list is
        empty if the file has no problem. If a file has more than 10,000 findings with one code, the list
        contains the first 10,000. The attribute `other_lines` of the 10,000th finding lists the line numbers
        of all further findings.

    Raises:
        SourceError: the file cannot be read, or the package of a `package://` address is not found.
        UnknownNameError: the source is neither a file nor a catalogue name, or the .xacro file does not
            declare an argument in `xacro_args`. The message lists the nearest names.
        InputError: an argument has a wrong type or value.
        UrdfkinError: xacro cannot expand the file.

    >>> for finding in check('<robot name="r"><link name="base"/><link name="stray"/></robot>'):
    ...     print(finding)  # doctest: +ELLIPSIS
    <text>:1:42: URDF411 error: link 'stray': the link has no parent, and neither has "base"; ...
    """
    if mimic is not None:
        as_bool(mimic, "mimic")
    if root_joint is not None:
        check_root_joint(root_joint)
    as_bool(fold, "fold")
    if not isinstance(limits, SizeLimits):
        raise InputError("limits must be SizeLimits(...)", found=safe_repr(limits))
    text = read_source(source, limits.bytes, xacro_args)
    return Findings(examine(text, limits=limits, mimic=mimic, root_joint=root_joint, fold=fold).findings)


@dataclass(frozen=True, slots=True)
class Examination:
    """The result of a check.

    `robot` is None if the text is not a URDF. `data` has no byte order mark. Findings state positions in
    `data`.
    """

    text: UrdfText
    data: bytes
    robot: RobotRecord | None
    findings: tuple[Finding, ...]
    silenced_findings: tuple[tuple[Finding, str], ...]  # Each with the reason in the comment.


def examine(
    text: UrdfText,
    *,
    limits: SizeLimits = DEFAULT_SIZE_LIMITS,
    mimic: bool | None = None,
    root_joint: str | None = None,
    fold: bool = False,
    is_reported: Callable[[Finding], bool] | None = None,
) -> Examination:
    """Check a text; `check` documents the arguments.

    A finding is removed if `is_reported` returns False. Then findings with the same code are combined.
    """
    if mimic is None:
        mimic = text.entry is None or text.entry.mimic
    report = Reporter(text.label, text.data, limits)
    robot = read_urdf(report, mimic=mimic, root_joint=root_joint)
    if robot is not None:
        check_meshes(report, robot.element, find_local_path(text))
        check_unused_comments(report)
    return Examination(
        text,
        report.data,
        robot,
        report.findings(fold=fold, is_reported=is_reported),
        tuple(report.silenced_findings),
    )


def find_local_path(text: UrdfText) -> Path | None:
    path = Path(text.source if text.entry is None else text.label)
    return None if text.source in ("-", "<text>", "<bytes>") or not path.is_file() else path


def check_text(
    data: bytes, *, limits: SizeLimits = DEFAULT_SIZE_LIMITS, fold: bool = True
) -> tuple[Finding, ...]:
    """Check the bytes of a URDF; open no file and no network connection."""
    report = Reporter("<text>", data, limits)
    read_urdf(report)
    return report.findings(fold=fold)


def read_urdf(report: Reporter, *, mimic: bool = True, root_joint: str | None = None) -> RobotRecord | None:
    """Parse and check the file of `report`; return None if the file is not a URDF."""
    root = read_document(report)
    apply_comments(report, CODE_BY_NAME)
    robot = None if root is None else read_robot(report, root)
    if root is None or robot is None:
        return None
    check_dialect(report, root)
    check_prefixes(report, root)
    check_vocabulary(report, root)
    check_names(report, robot, root_joint)
    is_tree = check_structure(report, robot)
    check_axes(report, robot)
    check_ranges(report, robot)
    check_mimic(report, robot, enabled=mimic)
    check_suspicious(report, robot, is_tree=is_tree, mimic=mimic)
    check_inertials(report, robot)
    check_shapes(report, robot)
    check_materials(report, robot)
    return robot
