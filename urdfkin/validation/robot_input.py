"""The robots of a validation as plain data, each known by the digest of its text.

A path stays a path, so that thousands of robots take no memory; its text is read where it is needed, and
refused there if it is no longer the text that the validation began with.
"""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from urdfkin.dh.parse_table import is_table_file
from urdfkin.dh.table import DHTable
from urdfkin.errors import InputError, UrdfkinError
from urdfkin.lint import Finding, UrdfWarning
from urdfkin.loading import load, robot_of
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.mjcf import is_mjcf
from urdfkin.urdf.sources import Origin, Source, Text, as_word, is_xacro, read_source
from urdfkin.verify.oracles import PINOCCHIO
from urdfkin.verify.pinocchio import OracleError

#: What is validated: anything that `load` takes, and robots that were loaded.
Given = Source | DHTable | Robot


@dataclass(frozen=True, slots=True)
class RobotInput:
    """A robot to validate, as plain data.

    Attributes:
        source: What `load` takes: a path, a catalogue name or the URDF itself.
        origin: Where it comes from, also where `source` is the URDF itself, and how it was asked for.
        stamp: The sha256 of its text; empty where that cannot be had.
        file: What findings call a text that is here itself.
        listed: What was said of the MJCF that the text was made of.
        made: Whether it was made of something else than a URDF.
    """

    source: str | bytes
    origin: Origin
    stamp: str = ""
    file: str = "<bytes>"
    listed: tuple[Finding, ...] = ()
    made: bool = False

    @classmethod
    def of(cls, robot: Robot) -> RobotInput:
        """A robot that was loaded already."""
        if robot.source in catalogue():
            return _word(robot.source, robot.origin.mimic, robot.origin.root_joint)
        listed = tuple(finding for finding in robot.findings if finding.code.startswith("MJCF"))
        return replace(_text(robot.urdf.encode(), robot.origin, robot.source), listed=listed)

    @property
    def label(self) -> str:
        """How to call it while it is not loaded."""
        return self.origin.source

    def text(self) -> Text:
        """Its text.

        Raises:
            InputError: a file that is another one than when the validation began.
            UrdfkinError: it cannot be had.
        """
        if isinstance(self.source, bytes):
            return Text(self.source, self.file, self.label, catalogue().get(self.label))
        text = read_source(self.source)
        if self.stamp and _digest(text.data) != self.stamp:
            raise InputError(
                "the file has changed since the validation began",
                where=text.label,
                remedy="begin again when it stays as it is",
            )
        return text

    def carried(self) -> RobotInput:
        """The same with its text, for a machine that has not the file."""
        text = self.text()
        return replace(self, source=text.data, file=text.label)

    def read(self) -> Robot:
        """The robot; its warnings are in its portrait."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UrdfWarning)
            robot = robot_of(
                self.text(),
                mimic=self.origin.mimic,
                root_joint=self.origin.root_joint,
                oracle=self.origin.oracle or PINOCCHIO.name,
                listed=self.listed,
                made=self.made,
            )
        robot.verifier.origin = self.origin  # what was read here may be the text of a file
        return robot

    def load(self) -> Robot:
        """The robot, to be checked.

        Raises:
            OracleError: a finding says that Pinocchio refuses it or reads another robot.
        """
        robot = self.read()
        if robot.verifier.unverifiable is not None:
            raise OracleError(robot.verifier.unverifiable, where=self.label)
        return robot


def subjects(
    robots: Sequence[Given],
    mimic: bool | None = None,
    root_joint: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
) -> tuple[list[RobotInput], dict[int, Exception]]:
    """The robots as plain data, and those whose text cannot be had: by their place, and why."""
    found, errors = list[RobotInput](), dict[int, Exception]()
    for i, robot in enumerate(robots):
        try:
            found.append(subject(robot, mimic, root_joint, xacro_args))
        except Exception as error:
            found.append(RobotInput(b"", Origin(_called(robot), mimic, root_joint)))
            errors[i] = error
    return found, errors


def subject(
    robot: Given,
    mimic: bool | None = None,
    root_joint: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
) -> RobotInput:
    """One robot as plain data; raises what reading it raises."""
    if isinstance(robot, DHTable) or is_table_file(robot) or is_mjcf(robot):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UrdfWarning)  # they are in its portrait
            return replace(RobotInput.of(load(robot, mimic=mimic, root_joint=root_joint)), made=True)
    if isinstance(robot, Robot):
        return RobotInput.of(robot)
    if is_xacro(robot):
        text = read_source(robot, xacro_args=xacro_args)  # expanded once, here
        return _text(text.data, Origin(text.source, mimic, root_joint, text.xacro_args), text.label)
    source = as_word(Path(robot)) if isinstance(robot, os.PathLike) else robot
    if isinstance(source, str) and source != "-":
        return _word(source, mimic, root_joint)
    text = read_source(source)  # an open file, or standard input, is read once, here
    if is_mjcf(text.data):
        return subject(text.data, mimic, root_joint)
    return _text(text.data, Origin(text.source, mimic, root_joint), text.label)


def _called(robot: Given) -> str:
    """What to call a robot whose text cannot be had."""
    if isinstance(robot, str | os.PathLike):
        return str(robot) if isinstance(robot, str) else as_word(Path(robot))
    return f"<{type(robot).__name__}>"


def _word(source: str, mimic: bool | None, root_joint: str | None) -> RobotInput:
    """A path, a name or text."""
    try:
        text = read_source(source)
    except UrdfkinError:
        return RobotInput(source, Origin(source, mimic, root_joint))  # the chunk reports what is wrong
    return RobotInput(source, Origin(text.source, mimic, root_joint), _digest(text.data))


def _text(data: bytes, origin: Origin, file: str) -> RobotInput:
    return RobotInput(data, origin, _digest(data), file)


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
