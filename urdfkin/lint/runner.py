"""The checks in their order: bytes, XML, dialect, numbers, names, structure, joints, and what looks odd."""

from __future__ import annotations

from urdfkin.lint.codes import text as codes
from urdfkin.lint.finding import Finding
from urdfkin.lint.limits import DEFAULT_LIMITS, Limits
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rules.axes import check_joints
from urdfkin.lint.rules.dialect import check_dialect
from urdfkin.lint.rules.document import Element, parse
from urdfkin.lint.rules.encoding import utf8_bytes
from urdfkin.lint.rules.joints import RobotRecord, read_robot
from urdfkin.lint.rules.mimic import check_mimic
from urdfkin.lint.rules.names import check_names
from urdfkin.lint.rules.prefixes import check_prefixes
from urdfkin.lint.rules.shapes import check_extras
from urdfkin.lint.rules.structure import check_structure
from urdfkin.lint.rules.suspicious import check_suspicious
from urdfkin.lint.rules.vocabulary import check_vocabulary


def check_text(
    data: bytes,
    *,
    file: str = "<text>",
    limits: Limits = DEFAULT_LIMITS,
    mimic: bool = True,
    root_joint: str | None = None,
    fold: bool = True,
) -> tuple[Finding, ...]:
    """Everything there is to say about a URDF, by line.

    A pure function of the bytes: it opens no file and no connection, and asks neither yourdfpy nor Pinocchio.

    Args:
        data: The file's bytes.
        file: What to call it in the findings.
        limits: How large the file may be.
        mimic: Whether mimic joints are to follow their leaders; without, what is wrong with them is a note.
        root_joint: `"floating"` or `"planar"` when the robot will hang from such a joint: then the names that
            joint takes are errors.
        fold: Whether many warnings of one kind are folded into one that lists the lines, and errors from the
            hundredth of a kind on into that one.

    Returns:
        Findings, sorted by line; empty for a file nothing can be said against. Of each kind 10,000 are
        written out; `also` of the last holds the lines of the others.

    >>> [finding.code for finding in check_text(b"<robot name='r'><link name='base'/></robot>")]
    []
    """
    report = Reporter(file, data, limits)
    root = read_document(report, data)
    if root is not None:
        check_robot(report, root, mimic=mimic, root_joint=root_joint)
    return report.findings(fold=fold)


def read_document(report: Reporter, data: bytes) -> Element | None:
    """The root element of a file, or None after the finding that says why there is none."""
    most = report.limits.bytes
    if len(data) > most:
        report.add(
            codes.TOO_LARGE,
            "the file is too large",
            found=f"{len(data)} bytes, more than {most}",
            remedy="raise the limit with --max-bytes if the file is right",
        )
        return None
    text = utf8_bytes(report, data)
    if text is None:
        return None
    report.data = text
    return parse(report, text)


def check_robot(
    report: Reporter, root: Element, *, mimic: bool = True, root_joint: str | None = None
) -> RobotRecord | None:
    """What the document says, with findings about it; None when it is no URDF."""
    version = check_dialect(report, root)
    if version is None:
        return None
    check_prefixes(report, root)
    check_vocabulary(report, root)
    robot = read_robot(report, root, version)
    check_names(report, robot, root_joint)
    sound = check_structure(report, robot)
    check_joints(report, robot)
    check_mimic(report, robot, obeyed=mimic)
    check_suspicious(report, robot, sound=sound)
    check_extras(report, robot)
    return robot
