"""`load`: from any source to a robot, through the checks."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

from urdfkin.lint.finding import Finding, PinocchioReading, Severity, UrdfError, UrdfWarning
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rules.axes import tilts
from urdfkin.lint.runner import read_urdf
from urdfkin.origin import Origin
from urdfkin.robot import Robot
from urdfkin.sources import Source, read_source
from urdfkin.tree import with_tilts
from urdfkin.urdf.reader import read_tree
from urdfkin.urdf.remembering import remembered_tree
from urdfkin.verification.choosing import Verify


def load(
    source: Source,
    *,
    verify: Verify = True,
    mimic: bool | None = None,
    root_joint: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
) -> Robot:
    """A robot from a URDF, checked before it is read.

    Args:
        source: A path (.urdf or .xacro), a name of the catalogue (`urdfkin robots` lists them), URDF text,
            bytes, an open file, or `-` for standard input.
        verify: Whether every result is held against Pinocchio's; "sample" has 100 configurations of each
            call checked.
        mimic: Whether mimic joints follow their leaders, as the URDF says; False lets each move freely.
            None: True, except for the robots whose catalogue entry says that theirs cannot work.
        root_joint: `"floating"` or `"planar"` hangs the root link from a moving joint.
        xacro_args: Arguments for a .xacro file, which is expanded first (needs the extra `xacro`).

    Returns:
        The robot. Its findings are warned of (`UrdfWarning`), except for robots of the catalogue.

    Raises:
        UrdfError: the file has errors; `findings` tells which and where.
        SourceError: it cannot be read.
        UnknownNameError: no file and no robot of that name; the nearest names are offered.

    >>> robot = load("panda")
    >>> height = robot.placement(robot.neutral(), "panda_hand")[2, 3]
    >>> robot.nq, round(float(height), 4)
    (8, 0.926)
    """
    text = read_source(source, xacro_args=xacro_args)
    origin = Origin(text.source, mimic, root_joint, text.xacro_args)
    if mimic is None:
        mimic = text.entry is None or text.entry.mimic
    report = Reporter(text.label, text.data)
    urdf = read_urdf(report, mimic=mimic, root_joint=root_joint)
    findings = report.findings()
    if urdf is None or report.failed:
        raise UrdfError(findings)
    if text.entry is None:
        for finding in findings:
            if finding.severity is Severity.WARNING:
                warnings.warn(str(finding), UrdfWarning, stacklevel=2)
    read = read_tree if text.entry is None else remembered_tree
    tree = read(urdf, mimic=mimic, root_joint=root_joint)
    if tilted := tilts(urdf):
        tree = with_tilts(tree, tilted)
    return Robot(
        tree,
        text.data.decode("utf-8-sig"),
        origin=origin,
        verify=verify,
        mimic=origin.mimic if mimic else False,
        findings=findings,
        unverifiable=_unverifiable(findings),
        base_frame=text.entry.base if text.entry else None,
        tip_frame=text.entry.tip if text.entry else None,
    )


def _unverifiable(findings: tuple[Finding, ...]) -> str | None:
    """Why Pinocchio cannot check the robot, if a finding says that it cannot."""
    for finding in findings:
        if finding.oracle is PinocchioReading.REFUSES:
            return f"Pinocchio refuses the file ({finding.code}, line {finding.line}: {finding.message})"
        if finding.oracle is PinocchioReading.DIFFERS:
            return f"Pinocchio reads another robot ({finding.code}, line {finding.line}: {finding.message})"
    return None
