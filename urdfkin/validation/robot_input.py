"""The robots to validate, as plain data.

`origin` and the digest of the text identify a robot. A robot's file is represented by its path, so that
thousands of robots take little memory. `RobotInput.load_text` raises InputError if the file has changed since
the start of the validation.
"""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, cast

from numpy.typing import ArrayLike

from urdfkin.dh.parse_table import is_table_file
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError, OracleError, UrdfkinError
from urdfkin.errors.numbers import parse_float, parse_quantity
from urdfkin.errors.validators import float_or_infinity
from urdfkin.robot import Robot
from urdfkin.robot.loading import load, make_robot
from urdfkin.urdf.catalogue import catalogue, find_description
from urdfkin.urdf.lint import Finding, UrdfWarning
from urdfkin.urdf.mjcf import is_mjcf
from urdfkin.urdf.sources import Origin, Source, UrdfText, is_usd, is_xacro, read_source, unambiguous_path
from urdfkin.verify.oracles import ORACLES, PINOCCHIO

if TYPE_CHECKING:
    from types import ModuleType

    from urdfkin.dh.screws import ProductOfExponentials
    from urdfkin.urdf.foreign import XmlElement, XmlTree

    RobotSource = Source | DHTable | ProductOfExponentials | ModuleType | XmlElement | XmlTree | Robot


@dataclass(frozen=True, slots=True)
class RobotInput:
    """A robot to validate, as plain data.

    Attributes:
        source: A path, a catalogue name or the text of the URDF, as for `load`.
        sha256: The sha256 of the robot's text; empty if the text cannot be read.
        file: The file name in errors and warnings, if `source` is the text of the robot.
        source_findings: Errors and warnings about the original MJCF or USD file.
    """

    source: str | bytes
    origin: Origin
    sha256: str = ""
    file: str = "<bytes>"
    source_findings: tuple[Finding, ...] = ()

    @classmethod
    def of(cls, robot: Robot) -> RobotInput:
        if robot.source in catalogue():
            robot_input = _from_path_or_name(robot.source, robot.origin.mimic, robot.origin.root_joint)
            own = replace(robot_input.origin, lock=robot.origin.lock, oracle=robot.origin.oracle)
            return replace(robot_input, origin=own)
        source_findings = tuple(
            finding for finding in robot.findings if finding.code.startswith(("MJCF", "USD"))
        )
        return replace(
            _from_text(robot.urdf.encode(), robot.origin, robot.source), source_findings=source_findings
        )

    @property
    def label(self) -> str:
        return self.origin.source

    def load_text(self) -> UrdfText:
        """Return the robot's text; raise InputError if the file's digest is not `sha256`."""
        if isinstance(self.source, bytes):
            return UrdfText(self.source, self.file, self.label, catalogue().get(self.label))
        text = read_source(self.source)
        if self.sha256 and _digest(text.data) != self.sha256:
            raise InputError(
                "the file has changed since the validation began",
                where=text.label,
                remedy="start the validation again when the file no longer changes",
            )
        return text

    def with_text(self) -> RobotInput:
        """Return a copy that contains the text, for other machines."""
        text = self.load_text()
        return replace(self, source=text.data, file=text.label)

    def make_robot(self) -> Robot:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UrdfWarning)  # The robot's summary contains the findings.
            robot = make_robot(
                self.load_text(),
                mimic=self.origin.mimic,
                root_joint=self.origin.root_joint,
                oracle=ORACLES[self.origin.oracle or PINOCCHIO.name].name,
                lock=dict(self.origin.lock),
                source_findings=self.source_findings,
            )
        robot.verifier.origin = self.origin  # The origin names the file from which the text was read.
        return robot

    def load(self) -> Robot:
        """Load the robot; raise OracleError if Pinocchio refuses or misreads the file."""
        robot = self.make_robot()
        if robot.verifier.known_refusal is not None:
            raise OracleError(robot.verifier.known_refusal, where=self.label)
        return robot


def make_robot_inputs(
    robots: Sequence[RobotSource],
    mimic: bool | None = None,
    root_joint: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
    lock: str | Mapping[str, ArrayLike] = MappingProxyType({}),
    joints: Sequence[str] | None = None,
) -> tuple[list[RobotInput], dict[int, Exception]]:
    robot_inputs, errors = list[RobotInput](), dict[int, Exception]()
    for i, robot in enumerate(robots):
        try:
            robot_inputs.append(make_robot_input(robot, mimic, root_joint, xacro_args, lock, joints))
        except Exception as error:
            if isinstance(robot, os.PathLike):
                name = unambiguous_path(Path(robot))
            else:
                name = robot if isinstance(robot, str) else f"<{type(robot).__name__}>"
            origin = Origin(name, mimic, root_joint, _as_texts(xacro_args), lock=_as_numbers(lock))
            origin = robot.origin if isinstance(robot, Robot) else origin
            robot_inputs.append(RobotInput(b"", origin))
            errors[i] = error
    return robot_inputs, errors


def _as_texts(xacro_args: Mapping[str, object] | None) -> tuple[tuple[str, str], ...]:
    return tuple((name, str(value)) for name, value in (xacro_args or {}).items())


def _as_numbers(lock: str | Mapping[str, ArrayLike]) -> tuple[tuple[str, float], ...]:
    """Return the locks with one number, for the command of a robot that cannot be loaded."""
    values = lock.items() if isinstance(lock, Mapping) else ()
    numbers = ((name, _as_number(value)) for name, value in values)
    return tuple((name, number) for name, number in numbers if number is not None)


def _as_number(value: object) -> float | None:
    if isinstance(value, str):
        quantity = parse_quantity(value)
        return parse_float(value) if quantity is None else quantity.value
    return float_or_infinity(value) if isinstance(value, int | float) else None


def make_robot_input(
    robot: RobotSource,
    mimic: bool | None = None,
    root_joint: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
    lock: str | Mapping[str, ArrayLike] = MappingProxyType({}),
    joints: Sequence[str] | None = None,
) -> RobotInput:
    robot_input = _make_robot_input(robot, mimic, root_joint, xacro_args)
    if isinstance(lock, str | Mapping) and not lock and joints is None:
        return robot_input
    return replace(robot_input, origin=robot_input.make_robot().with_locked_joints(lock, joints).origin)


def _make_robot_input(
    robot: RobotSource, mimic: bool | None, root_joint: str | None, xacro_args: Mapping[str, object] | None
) -> RobotInput:
    if isinstance(robot, Robot):
        _reject_other_options(robot, mimic, root_joint)
        return RobotInput.of(robot)
    if is_table_file(robot) or is_mjcf(robot) or is_usd(robot) or _is_object(robot):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UrdfWarning)  # The robot's summary contains the findings.
            return RobotInput.of(load(robot, mimic=mimic, root_joint=root_joint))
    if is_xacro(robot):
        text = read_source(robot, xacro_args=xacro_args)  # The .xacro file is expanded only once.
        return _from_text(text.data, Origin(text.source, mimic, root_joint, text.xacro_args), text.label)
    source = unambiguous_path(Path(robot)) if isinstance(robot, os.PathLike) else robot
    if isinstance(source, str) and source != "-":
        return _from_path_or_name(source, mimic, root_joint)
    text = read_source(cast("Source", source))  # An open file, or standard input, can be read only once.
    if is_mjcf(text.data):
        return _make_robot_input(text.data, mimic, root_joint, None)
    return _from_text(text.data, Origin(text.source, mimic, root_joint), text.label)


def _is_object(robot: RobotSource) -> bool:
    """Return whether `robot` is an object of another library, a table, or a name of robot_descriptions."""
    if isinstance(robot, str | bytes | os.PathLike) or hasattr(robot, "read"):
        return find_description(robot) is not None
    return True


def _reject_other_options(robot: Robot, mimic: bool | None, root_joint: str | None) -> None:
    """Raise InputError if an argument of `validate` contradicts a loaded robot."""
    for name, value, own in (
        ("mimic", mimic, robot.verifier.mimic),
        ("root_joint", root_joint, robot.origin.root_joint),
    ):
        if value is not None and value != own:
            raise InputError(
                f"`{name}` has no effect on a loaded robot",
                where=robot.source,
                found=f"{name}={value!r}",
                remedy=f"pass `{name}` to `load`",
            )


def _from_path_or_name(source: str, mimic: bool | None, root_joint: str | None) -> RobotInput:
    try:
        text = read_source(source)
    except UrdfkinError:
        return RobotInput(source, Origin(source, mimic, root_joint))  # The robot's chunk reports the error.
    return RobotInput(source, Origin(text.source, mimic, root_joint), _digest(text.data))


def _from_text(data: bytes, origin: Origin, file: str) -> RobotInput:
    return RobotInput(data, origin, _digest(data), file)


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
