"""Hypothesis strategies for rotations, and for trees with every joint kind of URDF."""

import math

import numpy as np
from hypothesis import strategies as st

from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, Mimic, build_tree

ALL_KINDS = tuple(JointKind)
AXIAL = (JointKind.REVOLUTE, JointKind.CONTINUOUS, JointKind.PRISMATIC)

lengths = st.floats(-2.0, 2.0).map(lambda x: 0.0 if abs(x) < 1e-300 else x)
angles = st.one_of(
    st.floats(-math.pi, math.pi),
    st.sampled_from([0.0, math.pi / 2, -math.pi / 2, math.pi, 1.5708, 1e-9, math.pi / 2 - 1e-9]),
)

#: Names in any alphabet, including characters that XML must escape.
#: `${` is excluded, because urdfkin refuses xacro.
names = st.text(
    st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Cn", "Co")), min_size=1, max_size=8
).filter(lambda name: "${" not in name)


def rotation(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return Rz(yaw) Ry(pitch) Rx(roll) without the tested code."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    x = [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr]
    y = [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr]
    return np.array([x, y, [-sp, cp * sr, cp * cr]])


rotations = st.builds(rotation, angles, angles, angles)


@st.composite
def poses(draw: st.DrawFn) -> FloatArray:
    """Return a pose (4, 4)."""
    T = np.eye(4)
    T[:3, :3] = draw(rotations)
    T[:3, 3] = [draw(lengths) for _ in range(3)]
    return T


@st.composite
def axes(draw: st.DrawFn) -> FloatArray:
    """Return a unit vector (3,), in some cases a coordinate axis."""
    coordinate_axis = draw(st.sampled_from([(0, 0, 1), (1, 0, 0), (0, -1, 0), None]))
    vector = np.array(coordinate_axis or draw(st.tuples(*[lengths] * 3)))
    length = float(np.linalg.norm(vector))
    return np.array([0.0, 0.0, 1.0]) if length < 1e-6 else vector / length


@st.composite
def limits(draw: st.DrawFn, kind: JointKind) -> Limit | None:
    """Return limits that URDF allows for a joint kind; infinite effort and velocity require URDF 1.2."""
    if kind not in AXIAL or (kind is JointKind.CONTINUOUS and draw(st.booleans())):
        return None
    magnitudes = st.one_of(st.floats(0.1, 100.0), st.just(math.inf))
    velocity, effort = draw(magnitudes), draw(magnitudes)
    if kind is JointKind.CONTINUOUS:
        if math.isinf(velocity) and math.isinf(effort):
            return None
        return Limit(-math.inf, math.inf, velocity, effort)
    lower = draw(st.floats(-3.0, 3.0))
    return Limit(lower, lower + draw(st.floats(0.1, 3.0)), velocity, effort)


@st.composite
def trees(draw: st.DrawFn, *, max_joints: int = 8, kinds: tuple[JointKind, ...] = ALL_KINDS) -> KinematicTree:
    """Return a tree in which the parent of each link was drawn before the link."""
    count = draw(st.integers(0, max_joints))
    links = draw(st.lists(names, min_size=count + 1, max_size=count + 1, unique=True))
    joint_names = draw(st.lists(names, min_size=count, max_size=count, unique=True))
    rows: list[tuple[Joint, str, str]] = []
    for number, name in enumerate(joint_names):
        kind = draw(st.sampled_from(kinds))
        independent_joints = [
            joint.name for joint, _, _ in rows if joint.kind in AXIAL and joint.mimic is None
        ]
        mimic = None
        if kind in AXIAL and independent_joints and draw(st.integers(0, 3)) == 0:
            mimicked_joint = draw(st.sampled_from(independent_joints))
            mimic = Mimic(mimicked_joint, draw(st.floats(-2.0, 2.0)), draw(st.floats(-1.0, 1.0)))
        axis = draw(axes()) if kind.has_axis else np.array([1.0, 0.0, 0.0])
        joint = Joint(name, kind, 0, draw(poses()), axis, limit=draw(limits(kind)), mimic=mimic)
        rows.append((joint, links[draw(st.integers(0, number))], links[number + 1]))
    return build_tree(draw(names), links[0], rows)
