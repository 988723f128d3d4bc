"""Catalogue of robots by short name: those of example-robot-data, and urdfkin's own."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from urdfkin.errors import UnknownNameError
from urdfkin.errors.validators import as_str
from urdfkin.system.resources import example_robots_dir, robots_dir


@dataclass(frozen=True, slots=True)
class Entry:
    """A robot of the catalogue.

    Attributes:
        name: The short name.
        family: arm, hand, humanoid, quadruped, ...
        relative_path: The path of the URDF below the folder of its collection.
        limbs: (base frame, tip frame) of each arm, leg or finger; the first pair is the default.
        mimic: Whether the mimic rules are valid and can be used.
        reason: The reason, if `mimic` is False.
        poses: Named poses: joint values (rad, m) by joint name; the other joints are at 0.
        own: Whether it is one of urdfkin's own robots instead of example-robot-data's.
    """

    name: str
    family: str
    relative_path: Path
    limbs: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    mimic: bool = True
    reason: str | None = None
    poses: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    own: bool = False

    @property
    def path(self) -> Path:
        """The path of the URDF file."""
        return (robots_dir() if self.own else example_robots_dir()) / self.relative_path

    @property
    def base(self) -> str | None:
        """The default base frame."""
        return next((base for base, _ in self.limbs.values()), None)

    @property
    def tip(self) -> str | None:
        """The default tip frame."""
        return next((tip for _, tip in self.limbs.values()), None)


@cache
def catalogue() -> Mapping[str, Entry]:
    """Return all entries by name: those of example-robot-data, then urdfkin's own."""
    return {**_read("catalogue.toml", own=False), **_read("own.toml", own=True)}


def robots(family: str | None = None) -> tuple[str, ...]:
    """Return the robot names that `load` accepts.

    Args:
        family: Return one family only: arm, biped, gripper, hand, humanoid, quadruped, text, ...

    Raises:
        UnknownNameError: there is no such family.

    >>> "panda" in robots("arm"), robots("text")
    (True, ('one_link', 'planar_two_link', 'polar', 'elbow'))
    """
    families = {entry.family for entry in catalogue().values()}
    if family is not None and family not in families:
        raise UnknownNameError("family", as_str(family, "family"), families)
    return tuple(name for name, entry in catalogue().items() if family in (None, entry.family))


def examples() -> tuple[str, ...]:
    """Return the names of the robots of example-robot-data."""
    return tuple(name for name, entry in catalogue().items() if not entry.own)


def _read(file: str, *, own: bool) -> dict[str, Entry]:
    path = robots_dir() / file
    if not path.is_file():
        return {}
    with path.open("rb") as stream:
        table = tomllib.load(stream)
    return {
        name: Entry(
            name=name,
            family=row["family"],
            relative_path=Path(row["path"]),
            limbs={limb: (base, tip) for limb, (base, tip) in row.get("limbs", {}).items()},
            mimic=row.get("mimic", True),
            reason=row.get("reason"),
            poses=row.get("poses", {}),
            own=own,
        )
        for name, row in table.items()
    }
