"""What a campaign is, written before anything is computed: the robots, the samples, and what computes.

The manifest alone says which chunks there are and the key of each: the sha256 of all that its numbers depend
on. What was computed by other code, of another text or with other options is never met.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from urdfkin.errors import InputError
from urdfkin.urdf.sources import Origin
from urdfkin.validation.chunk import Cut
from urdfkin.validation.results import provenance, versions
from urdfkin.validation.robot_input import RobotInput

#: Name and version of the layout of a store.
LAYOUT = "urdfkin-campaign/1"
#: How many differences between two manifests are told.
_SHOWN = 4


@dataclass(frozen=True)
class Manifest:
    """A campaign.

    Attributes:
        robots: Where each comes from, and the sha256 of its text; empty where that could not be had.
        samples: Random configurations for each.
        seed: What they are drawn from.
        provenance: What computes; `urdfkin.validation.results`.
        versions: What the report says of that.
        started: When, ISO 8601, UTC.
    """

    robots: tuple[tuple[Origin, str], ...]
    samples: int
    seed: int
    provenance: dict[str, str]
    versions: dict[str, str]
    started: str

    @classmethod
    def of(cls, subjects: Sequence[RobotInput], samples: int, seed: int, started: str) -> Manifest:
        """The manifest of a campaign that begins here."""
        robots = tuple((subject.origin, subject.stamp) for subject in subjects)
        return cls(robots, samples, seed, provenance(), _versions(subjects), started)

    @cached_property
    def cut(self) -> Cut:
        """The chunks of each robot."""
        return Cut(self.samples)

    def subjects(self) -> list[RobotInput]:
        """The robots, as far as a report needs them."""
        return [RobotInput(origin.source, origin, stamp) for origin, stamp in self.robots]

    def key(self, robot: int, index: int) -> str:
        """The key of a chunk."""
        return hashlib.sha256(f"{self._keys[robot]} {index} of {len(self.cut)}".encode()).hexdigest()

    @cached_property
    def _keys(self) -> list[str]:
        """Of each robot, with all settings."""
        settings = json.dumps([LAYOUT, self.samples, self.seed, self.provenance], sort_keys=True)
        return [
            hashlib.sha256(f"{settings}\n{json.dumps(_robot(*robot))}".encode()).hexdigest()
            for robot in self.robots
        ]

    def as_json(self) -> bytes:
        """The file."""
        data = {
            "layout": LAYOUT,
            "started": self.started,
            "samples": self.samples,
            "seed": self.seed,
            "provenance": self.provenance,
            "versions": self.versions,
            "robots": [_robot(*robot) for robot in self.robots],
        }
        return (json.dumps(data, indent=1) + "\n").encode()

    @classmethod
    def from_json(cls, content: bytes, where: str) -> Manifest:
        """The manifest in a file.

        Raises:
            InputError: it is none, or of another layout.
        """
        try:
            data = json.loads(content)
            if data["layout"] != LAYOUT:
                raise ValueError(f"the layout {data['layout']!r}")
            return cls(
                tuple(_read_robot(robot) for robot in data["robots"]),
                int(data["samples"]),
                int(data["seed"]),
                {str(name): str(value) for name, value in data["provenance"].items()},
                {str(name): str(value) for name, value in data["versions"].items()},
                str(data["started"]),
            )
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            raise InputError(
                f"not the manifest of a campaign ({LAYOUT})",
                where=where,
                found=f"{type(error).__name__}: {error}",
                remedy="name a folder that `urdfkin validate ... --store DIR` made",
            ) from error

    def differences(self, other: Manifest) -> list[str]:
        """What differs from another, both values each; nothing where their chunks are the same."""
        mine, theirs = (
            {"samples": m.samples, "seed": m.seed, "number of robots": len(m.robots)} | m.provenance
            for m in (self, other)
        )
        said = [
            f"{name} {_short(mine.get(name))} and {_short(theirs.get(name))}"
            for name in mine | theirs
            if mine.get(name) != theirs.get(name)
        ]
        said += [
            f"robot {i + 1} {_called(mine_)} and {_called(theirs_)}"
            for i, (mine_, theirs_) in enumerate(zip(self.robots, other.robots, strict=False))
            if mine_ != theirs_
        ]
        return [*said[:_SHOWN], f"{len(said) - _SHOWN} more"] if len(said) > _SHOWN + 1 else said


def _versions(subjects: Sequence[RobotInput]) -> dict[str, str]:
    return versions(subject.origin.oracle for subject in subjects)


def _robot(origin: Origin, stamp: str) -> dict[str, Any]:
    return {
        "source": origin.source,
        "mimic": origin.mimic,
        "root_joint": origin.root_joint,
        "xacro_args": [list(pair) for pair in origin.xacro_args],
        "oracle": origin.oracle,
        "sha256": stamp,
    }


def _read_robot(data: dict[str, Any]) -> tuple[Origin, str]:
    arguments = tuple((str(name), str(value)) for name, value in data["xacro_args"])
    return Origin(str(data["source"]), data["mimic"], data["root_joint"], arguments, data["oracle"]), str(
        data["sha256"]
    )


def _short(value: object) -> str:
    """A digest by its first letters."""
    text = str(value)
    return text[:12] if len(text) == 64 else text


def _called(robot: tuple[Origin, str]) -> str:
    origin, stamp = robot
    return f"{origin.words} (sha256 {stamp[:12] or 'unknown'})"
