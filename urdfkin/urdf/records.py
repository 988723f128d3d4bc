"""Links and joints of a URDF as plain data. `lint.rules.joints` fills these records, once and strictly.

None marks a value that could not be read; a finding reports it. A value that the file does not write has the
default of the specification.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from urdfkin.urdf.element import Element

Vector = tuple[float, ...]

#: Limits that URDF defines from version 1.2 on.
FURTHER_LIMITS = ("acceleration", "deceleration", "jerk")

#: Joint types with an axis.
AXIAL = ("revolute", "continuous", "prismatic")


@dataclass(slots=True)
class LimitRecord:
    """A `<limit>`; None marks an attribute that is not written."""

    element: Element
    lower: float | None
    upper: float | None
    effort: float | None
    velocity: float | None
    acceleration: float | None = None
    deceleration: float | None = None
    jerk: float | None = None


@dataclass(slots=True)
class MimicRecord:
    """A `<mimic>`."""

    element: Element
    leader: str
    multiplier: float
    offset: float


@dataclass(slots=True)
class JointRecord:
    """A `<joint>`."""

    element: Element
    name: str
    kind: str | None = None
    parent: str | None = None
    child: str | None = None
    xyz: Vector = (0.0, 0.0, 0.0)
    rpy: Vector = (0.0, 0.0, 0.0)
    quaternion: Vector | None = None
    axis: Vector | None = (1.0, 0.0, 0.0)
    axis_element: Element | None = None
    origin_element: Element | None = None
    limit: LimitRecord | None = None
    mimic: MimicRecord | None = None


@dataclass(slots=True)
class RobotRecord:
    """A `<robot>`: its links and joints, in file order."""

    element: Element
    version: tuple[int, int]
    links: dict[str, Element] = field(default_factory=dict)
    joints: list[JointRecord] = field(default_factory=list)

    @property
    def by_name(self) -> dict[str, JointRecord]:
        """The joints by name; of two joints with the same name, the first."""
        found: dict[str, JointRecord] = {}
        for joint in self.joints:
            found.setdefault(joint.name, joint)
        return found
