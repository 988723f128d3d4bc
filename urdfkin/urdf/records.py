"""What a URDF says of its links and joints, as plain data: `lint.rules.joints` reads it, once and strictly.

A value that is None could not be read, and that has been reported; a value that was not written has the
specification's default.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from urdfkin.urdf.element import Element

Vector = tuple[float, ...]

#: Limits that count from version 1.2 on.
FURTHER_LIMITS = ("acceleration", "deceleration", "jerk")

#: Types whose motion has an axis.
AXIAL = ("revolute", "continuous", "prismatic")


@dataclass(slots=True)
class LimitRecord:
    """A `<limit>`: what is written, None for what is not."""

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
    """A `<robot>`: its links and joints in the order of the file."""

    element: Element
    version: tuple[int, int]
    links: dict[str, Element] = field(default_factory=dict)
    joints: list[JointRecord] = field(default_factory=list)

    @property
    def by_name(self) -> dict[str, JointRecord]:
        """Joints by name; the first of two that share one."""
        found: dict[str, JointRecord] = {}
        for joint in self.joints:
            found.setdefault(joint.name, joint)
        return found
