"""The function `load`, which makes a robot from a file, a text, a table or another library's object."""

from __future__ import annotations

import codecs
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import TYPE_CHECKING, Any, TypedDict, Unpack, cast

from numpy.typing import ArrayLike

from urdfkin.errors import InputError
from urdfkin.errors.validators import as_str, safe_repr
from urdfkin.model.tree import LinkFrame, with_named_poses, with_pinocchio_tilts
from urdfkin.robot import Robot
from urdfkin.system.files import expand_home, read_bytes
from urdfkin.urdf.findings import Finding, PinocchioReading, Reporter, Severity, UrdfError, UrdfWarning
from urdfkin.urdf.lint.rules.joints import MIMIC_CONTINUOUS, find_axis_tilts
from urdfkin.urdf.lint.rules.left_out import make_mjcf_findings
from urdfkin.urdf.lint.runner import read_urdf
from urdfkin.urdf.parser import NEWER_VERSION
from urdfkin.urdf.reader import read_tree
from urdfkin.urdf.sources import (
    Origin,
    Source,
    UrdfText,
    find_entry,
    is_urdf_path,
    is_usd,
    read_source,
    resolve_package_uri,
    unambiguous_path,
)
from urdfkin.urdf.writer import to_urdf as write_urdf
from urdfkin.verify.oracles import OracleName, oracle_library
from urdfkin.verify.verifier import Verify, as_verify

if TYPE_CHECKING:
    from urdfkin.dh.screws import ProductOfExponentials
    from urdfkin.dh.table import DHTable
    from urdfkin.urdf.foreign import XmlElement, XmlTree

#: Warnings that help only the author of a URDF file.
#: For a generated URDF, urdfkin hides these warnings.
_FINDINGS_FOR_AUTHORS = {NEWER_VERSION.id, MIMIC_CONTINUOUS.id}


class LoadOptions(TypedDict):
    """The arguments of `load` that apply to every kind of source."""

    verify: Verify
    mimic: bool | None
    root_joint: str | None
    oracle: OracleName
    lock: str | Mapping[str, ArrayLike]
    joints: Sequence[str] | None


def load(  # noqa: PLR0911  (many returns): one branch for each kind of source
    source: Source | DHTable | ProductOfExponentials | ModuleType | XmlElement | XmlTree,
    *,
    verify: Verify = True,
    mimic: bool | None = None,
    root_joint: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
    oracle: OracleName = "pinocchio",
    lock: str | Mapping[str, ArrayLike] = MappingProxyType({}),
    joints: Sequence[str] | None = None,
    variant: Mapping[str, str] = MappingProxyType({}),
    articulation: str | None = None,
) -> Robot:
    """Return a robot from a URDF, an MJCF or USD file, a table or an object of another library.

    urdfkin checks the source first. Accepted sources:

    - a path: .urdf, .xacro, .xml for MJCF (`docs/mjcf.md`), .usd, .usda, .usdc or .usdz (`docs/usd.md`)
    - a name of the catalogue; `urdfkin robots` lists them
    - URDF or MJCF as text, bytes or an open file; `-` is standard input
    - a `DHTable`, or a file with one (.toml, .json, .csv, .tsv, .md, .tex, .txt). The table's base frame
      becomes the root link, and the table's tip becomes the leaf link.
    - a product of exponentials (`urdfkin.dh.screws`), or a file with M and screws
    - a `pinocchio.Model` or RobotWrapper, a `yourdfpy.URDF`, an ElementTree of Python or lxml
    - a module of the package robot_descriptions, or the name of such a module, such as "panda_description"

    Args:
        source: One of the sources above.
        verify: True: compare every result with Pinocchio. "sample": compare 100 configurations of each call.
            False: no comparison.
        mimic: True: mimic joints follow the mimicked joints, as the URDF states. False: each mimic joint
            moves freely. None: False for robots of the catalogue with unusable mimic rules, and True for all
            other robots.
        root_joint: Kind of the joint between the world and the root link: "floating" or "planar". None: the
            root link is fixed.
        xacro_args: Arguments for a .xacro file, which needs the extra `xacro`.
        oracle: Oracle that checks quantities: "pinocchio", or "mujoco", which needs the extra `mujoco`.
        lock: Value (rad or m) of each joint to lock, such as `{"finger": 0.04}`. See
            `Robot.with_locked_joints`.
        joints: The joints that remain movable; see `Robot.with_locked_joints`.
        variant: Variant to select in each variant set of a USD stage, such as `{"Gripper": "Robotiq"}`.
        articulation: Path or name of the articulation, for a USD stage with several articulations.

    Returns:
        The robot. Warnings about the file are issued as `UrdfWarning`, except for robots of the catalogue.

    Raises:
        UrdfError: the file has errors; `findings` lists them with their positions.
        SourceError: the source cannot be read.
        UnknownNameError: no file and no robot has the name `source`; the message lists similar names.
        TableError: the robot made from a table does not reproduce the tip placements of the table.
        OracleError: the robot made from an MJCF or USD file or a `pinocchio.Model` differs from its source.
        InputError: an argument has an invalid value.

    >>> arm = load("planar_two_link")
    >>> arm.placement([0.0, 0.0], "tip")[:3, 3].tolist()
    [0.9, 0.0, 0.0]
    >>> robot = load("panda")
    >>> height = robot.placement(robot.neutral(), "panda_hand")[2, 3]
    >>> robot.nq, round(float(height), 4)
    (8, 0.926)
    >>> from urdfkin.dh import table_from_rows
    >>> robot = load(table_from_rows([[0.4, 0, 0, 0], [0.3, 0, 0, 0]], "standard"))
    >>> float(robot.placement([0.0, 0.0], "tip")[0, 3])
    0.7
    """
    options: LoadOptions = {
        "verify": verify,
        "mimic": mimic,
        "root_joint": root_joint,
        "oracle": oracle,
        "lock": lock,
        "joints": joints,
    }
    if not isinstance(variant, Mapping):
        raise InputError(
            "`variant` must be a mapping from variant sets to variants", found=safe_repr(variant)
        )
    source = resolve_package_uri(source)
    if is_usd(source):
        return _load_usd(source, xacro_args, variant, articulation, **options)
    if variant or articulation is not None:
        raise InputError("`variant` and `articulation` need the path of a USD file", found=safe_repr(source))
    if is_urdf_path(source) or (isinstance(source, str) and find_entry(source)):
        return make_robot(read_source(source, xacro_args=xacro_args), **options)
    from urdfkin.dh.parse_table import is_table_file
    from urdfkin.dh.screws import ProductOfExponentials
    from urdfkin.dh.table import DHTable
    from urdfkin.urdf.catalogue import find_description
    from urdfkin.urdf.foreign import convert_to_urdf, find_lost_quaternions, is_pinocchio_model
    from urdfkin.urdf.mjcf import is_mjcf

    if (description := find_description(source)) is not None:
        source = description.path
        xacro_args = {**description.xacro_args, **(xacro_args or {})}
    if isinstance(source, DHTable | ProductOfExponentials) or is_table_file(source):
        return _load_table(source, xacro_args, **options)
    if is_mjcf(source):
        return _load_mjcf(source, xacro_args, None, **options)
    if is_pinocchio_model(source):
        return _load_model(source, xacro_args, **options)
    if (foreign := convert_to_urdf(source)) is not None:
        _reject_xacro_args(xacro_args, foreign[1])
        lost = find_lost_quaternions(source, foreign[1])
        robot = make_robot(
            UrdfText(foreign[0].encode(), foreign[1], foreign[1]), **options, source_findings=lost
        )
        if lost:
            robot.verifier.source_notes = (
                "from a yourdfpy object instead of the file; yourdfpy ignores the attribute quat_xyzw"
            )
        return robot
    text = read_source(cast("Source", source), xacro_args=xacro_args)
    streamed = source == "-" or hasattr(source, "read")
    return (
        _load_mjcf(text.data, None, text, **options)
        if streamed and is_mjcf(text.data)
        else make_robot(text, **options)
    )


def as_robot(source: Robot | Source | DHTable) -> Robot:
    """Return a robot unchanged; load any other source."""
    return source if isinstance(source, Robot) else load(source)


def _load_table(
    source: DHTable | ProductOfExponentials | str | os.PathLike[str],
    xacro_args: Mapping[str, object] | None,
    **options: Unpack[LoadOptions],
) -> Robot:
    from urdfkin.dh.compare.hypotheses import find_table_warnings
    from urdfkin.dh.convert import to_urdf
    from urdfkin.dh.parse_table import read_table_or_screws
    from urdfkin.dh.screws import ProductOfExponentials
    from urdfkin.dh.table import DHTable
    from urdfkin.verify.conversions import check_screws, check_table_source

    _reject_xacro_args(xacro_args, "a table")
    table: DHTable | ProductOfExponentials
    if isinstance(source, DHTable | ProductOfExponentials):
        table, name = source, "<table>"
    else:
        path = expand_home(source)
        table, name = read_table_or_screws(path), unambiguous_path(path)
    if isinstance(table, ProductOfExponentials):
        urdf = write_urdf(table.to_tree())
    else:
        urdf = to_urdf(table)
        for warning in find_table_warnings(table):
            warnings.warn(f"{name}: {warning}", UrdfWarning, stacklevel=3)
    text = UrdfText(urdf.encode(), name, name)
    robot = make_robot(text, **options, is_generated=True, table=True)
    if as_verify(options["verify"]):
        verifier = _load_without_options(robot, text).verifier
        if isinstance(table, ProductOfExponentials):
            links = verifier.tree.links
            base, tip = LinkFrame.of(links[0]), LinkFrame.of(links[-1])
            check_screws(verifier, replace(table, base_frame=base, tip_frame=tip))
        else:
            check_table_source(verifier, table)
    return robot


def _load_mjcf(
    source: str | bytes | os.PathLike[str],
    xacro_args: Mapping[str, object] | None,
    streamed: UrdfText | None,
    **options: Unpack[LoadOptions],
) -> Robot:
    import hashlib

    from urdfkin.urdf.mjcf import source_name
    from urdfkin.verify.mjcf_check import check_mjcf_source, read_mjcf

    _reject_xacro_args(xacro_args, "MJCF")
    checks = bool(as_verify(options["verify"]))
    data = _read_mjcf_bytes(source)
    digest = hashlib.sha256(data).hexdigest()
    read = read_mjcf(source, with_check_data=checks, name=streamed.label if streamed else None)
    name = (
        unambiguous_path(Path(read.path))
        if read.path
        else streamed.source
        if streamed
        else source_name(source)
    )
    text = UrdfText(read.urdf.encode(), f"{name} (as a URDF)", name, sha256=digest)
    source_findings = make_mjcf_findings(read.remarks, name, data.removeprefix(codecs.BOM_UTF8))
    robot = make_robot(text, **options, source_findings=source_findings, is_generated=True)
    if checks:
        verifier = _load_without_options(
            robot, text, source_findings=source_findings, is_generated=True
        ).verifier
        robot.verifier.source_notes = check_mjcf_source(verifier, read)
    return robot


def _load_usd(
    source: str | os.PathLike[str],
    xacro_args: Mapping[str, object] | None,
    variant: Mapping[str, str],
    articulation: str | None,
    **options: Unpack[LoadOptions],
) -> Robot:
    import hashlib

    from urdfkin.urdf.lint.rules.left_out import make_usd_findings
    from urdfkin.verify.usd_check import check_usd_source, read_usd

    _reject_xacro_args(xacro_args, "USD")
    variants = tuple((as_str(name, "variant"), as_str(one, "variant")) for name, one in variant.items())
    if articulation is not None:
        as_str(articulation, "articulation")
    checks = bool(as_verify(options["verify"]))
    read = read_usd(source, variants=variants, articulation=articulation)
    data = read_bytes(Path(read.path))
    digest = hashlib.sha256(data).hexdigest()
    name = unambiguous_path(Path(read.path))
    text = UrdfText(
        read.urdf.encode(),
        f"{name} (as a URDF)",
        name,
        sha256=digest,
        variants=variants,
        articulation=articulation,
    )
    verifier = make_robot(text, verify=False, is_generated=True, quiet=True).verifier
    line, remarks = check_usd_source(verifier, read)
    source_findings = make_usd_findings((*read.remarks, *remarks), name, data)
    robot = make_robot(text, **options, source_findings=source_findings, is_generated=True)
    robot.single_terms = read.answer["single"]
    robot.prims = read.answer["prims"]
    if checks:
        robot.verifier.source_notes = line
    return robot


def _load_without_options(robot: Robot, text: UrdfText, **options: Any) -> Robot:
    """Load a text as a robot with a fixed root, without locked joints and with all mimic rules."""
    origin = robot.origin
    plain = origin.mimic is not False and origin.root_joint is None and not origin.lock
    return robot if plain else make_robot(text, **options)


def _read_mjcf_bytes(source: str | bytes | os.PathLike[str]) -> bytes:
    from urdfkin.urdf.mjcf import is_text

    if isinstance(source, bytes):
        return source
    if is_text(source):
        return str(source).encode("utf-8", "surrogatepass")
    return read_bytes(expand_home(source))


def _load_model(
    source: Any, xacro_args: Mapping[str, object] | None, **options: Unpack[LoadOptions]
) -> Robot:
    from urdfkin.urdf.foreign import convert_pinocchio_model
    from urdfkin.verify.conversions import check_model_source

    _reject_xacro_args(xacro_args, "a pinocchio.Model")
    read = convert_pinocchio_model(source)
    text = UrdfText(write_urdf(read.tree).encode(), "<pinocchio.Model>", "<pinocchio.Model>")
    robot = make_robot(text, **options, is_generated=True)
    if as_verify(options["verify"]):
        verifier = _load_without_options(robot, text, is_generated=True).verifier
        robot.verifier.source_notes = check_model_source(verifier, read, source)
    return robot


def _reject_xacro_args(xacro_args: Mapping[str, object] | None, source_kind: str) -> None:
    if xacro_args:
        raise InputError(
            "`xacro_args` (--xacro-arg) is only for robots from a .xacro file", found=source_kind
        )


def make_robot(
    text: UrdfText,
    *,
    verify: Verify = True,
    mimic: bool | None = None,
    root_joint: str | None = None,
    oracle: OracleName = "pinocchio",
    lock: str | Mapping[str, ArrayLike] = MappingProxyType({}),
    joints: Sequence[str] | None = None,
    source_findings: tuple[Finding, ...] = (),
    is_generated: bool = False,
    table: bool = False,
    quiet: bool = False,
) -> Robot:
    """Make a robot from URDF text. The arguments from `verify` to `joints` mean the same as in `load`.

    If urdfkin generated the text from another source, `source_findings` contains the findings about this
    source. `table` is True for a source that is a Denavit-Hartenberg table or a product of exponentials.
    """
    oracle_library(oracle)
    other = None if oracle == "pinocchio" else oracle
    origin = Origin(
        text.source,
        mimic,
        root_joint,
        text.xacro_args,
        other,
        table,
        text.sha256,
        variants=text.variants,
        articulation=text.articulation,
    )
    if mimic is None:
        mimic = text.entry is None or text.entry.mimic
    report = Reporter(text.label, text.data)
    urdf = read_urdf(report, mimic=mimic, root_joint=root_joint)
    findings = (*source_findings, *report.findings())
    if urdf is None or report.has_errors:
        raise UrdfError(findings)
    if text.entry is None and not quiet:
        for finding in findings:
            if finding.severity is Severity.WARNING and not (
                is_generated and finding.code in _FINDINGS_FOR_AUTHORS
            ):
                warnings.warn(str(finding), UrdfWarning, stacklevel=4 if is_generated else 3)
    tree = read_tree(urdf, mimic=mimic, root_joint=root_joint)
    if tilted := find_axis_tilts(urdf):
        tree = with_pinocchio_tilts(tree, tilted)
    if text.entry is not None and text.entry.poses:
        tree = with_named_poses(tree, text.entry.poses)
    robot = Robot(
        tree,
        text.data.decode("utf-8-sig"),
        origin=origin,
        verify=verify,
        mimic=mimic,
        findings=findings,
        unverifiable=_find_unverified_reason(
            (*findings, *(finding for finding, _ in report.silenced_findings))
        ),
        oracle=oracle,
        base_frame=text.entry.base_frame if text.entry else None,
        tip_frame=text.entry.tip_frame if text.entry else None,
    )
    is_plain = isinstance(lock, str | Mapping) and not lock and joints is None
    return robot if is_plain else robot.with_locked_joints(lock, joints)


def _find_unverified_reason(findings: tuple[Finding, ...]) -> str | None:
    problems = {
        PinocchioReading.REFUSES: "Pinocchio refuses the file",
        PinocchioReading.DIFFERS: "Pinocchio reads another robot",
    }
    for finding in findings:
        if finding.pinocchio_reading in problems:
            place = f"{finding.code}, line {finding.line}"
            return f"{problems[finding.pinocchio_reading]} ({place}: {finding.message})"
    return None
