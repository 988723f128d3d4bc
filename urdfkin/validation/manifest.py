"""Manifest of a stored validation: robots, samples and versions.

The manifest defines the chunks and the key of each chunk. The key is the sha256 of all data on which the
chunk's numbers depend. Therefore, results of older code, texts or options are never reused.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from urdfkin.system.documents import DocumentKind, as_data, parse_json
from urdfkin.urdf.sources import Origin
from urdfkin.validation.chunk import Cut
from urdfkin.validation.results import provenance
from urdfkin.validation.robot_input import RobotInput
from urdfkin.verify.oracles import versions

#: Name and version of the layout of a store.
LAYOUT = "urdfkin-campaign/1"
_SHOWN = 4


@dataclass(frozen=True)
class Manifest:
    """Definition of a campaign; `started` is the start time, ISO 8601, UTC.

    For each robot, `robots` contains the origin and the sha256 of the text. If the text is unreadable, the
    sha256 is empty.
    """

    robots: tuple[tuple[Origin, str], ...]
    samples: int
    seed: int
    provenance: dict[str, str]
    versions: dict[str, str]
    started: str

    @classmethod
    def of(cls, subjects: Sequence[RobotInput], samples: int, seed: int, started: str) -> Manifest:
        robots = tuple((subject.origin, subject.stamp) for subject in subjects)
        oracles = (subject.origin.oracle for subject in subjects)
        return cls(robots, samples, seed, provenance(), versions(oracles), started)

    @cached_property
    def cut(self) -> Cut:
        return Cut(self.samples)

    def subjects(self) -> list[RobotInput]:
        """Return the robots without their texts, which a report does not need."""
        return [RobotInput(origin.source, origin, stamp) for origin, stamp in self.robots]

    def key(self, robot: int, index: int) -> str:
        return hashlib.sha256(f"{self._keys[robot]} {index} of {len(self.cut)}".encode()).hexdigest()

    @cached_property
    def _keys(self) -> list[str]:
        settings = json.dumps([LAYOUT, self.samples, self.seed, self.provenance], sort_keys=True)
        return [
            hashlib.sha256(f"{settings}\n{json.dumps(as_data(robot))}".encode()).hexdigest()
            for robot in self.robots
        ]

    def as_json(self) -> bytes:
        return (json.dumps({"schema": LAYOUT} | as_data(self), indent=1) + "\n").encode()

    @classmethod
    def from_json(cls, content: bytes, where: str) -> Manifest:
        layout = DocumentKind(LAYOUT, cls, (), "urdfkin validate ROBOT --store DIR", is_open=True)
        return layout.validate(parse_json(content, where), where)

    def differences(self, other: Manifest) -> list[str]:
        own, theirs = (
            {"samples": m.samples, "seed": m.seed, "number of robots": len(m.robots)} | m.provenance
            for m in (self, other)
        )
        lines = [
            f"{name} {_short(own.get(name))} and {_short(theirs.get(name))}"
            for name in own | theirs
            if own.get(name) != theirs.get(name)
        ]
        lines += [
            f"robot {i + 1} {_called(robot)} and {_called(other_robot)}"
            for i, (robot, other_robot) in enumerate(zip(self.robots, other.robots, strict=False))
            if robot != other_robot
        ]
        return [*lines[:_SHOWN], f"{len(lines) - _SHOWN} more"] if len(lines) > _SHOWN + 1 else lines


def _short(value: object) -> str:
    text = str(value)
    return text[:12] if len(text) == 64 else text


def _called(robot: tuple[Origin, str]) -> str:
    origin, stamp = robot
    return f"{origin.words} (sha256 {stamp[:12] or 'unknown'})"
