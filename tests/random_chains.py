"""Hypothesis strategies for trees in which consecutive joint axes have special relations."""

import math
from typing import Any

import numpy as np
from hypothesis import strategies as st

from urdfkin.model.tree import FloatArray, Joint, JointKind, KinematicTree, Limit, Mimic, build_tree

TURNS = np.array([0.0, math.pi / 2, math.pi, -math.pi / 2])

#: Relations of an axis to the previous axis.
RELATIONS = (
    "skew", "square", "meeting", "parallel", "antiparallel", "collinear", "near", "near-anti", "coaxial-ish",
)  # fmt: skip

#: Number of relations, from the first one, without tiny tilts or offsets.
TAME = 6

tiny = st.integers(1, 12).map(lambda k: 10.0**-k)
angle = st.one_of(st.sampled_from(list(TURNS)), st.floats(-3.1, 3.1))
tame_length = st.one_of(st.just(0.0), st.floats(0.05, 0.5), st.floats(-0.5, -0.05))
any_length = st.one_of(tame_length, st.floats(-0.5, 0.5), tiny)


def rotation(axis: str, angle: float) -> FloatArray:
    """Return a rotation (4, 4) about a coordinate axis."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    T = np.eye(4)
    T[j, j] = T[k, k] = math.cos(angle)
    T[k, j] = math.sin(angle)
    T[j, k] = -T[k, j]
    return T


def z_joint(
    name: str, T: FloatArray | None = None, kind: JointKind = JointKind.REVOLUTE, **more: Any
) -> Joint:
    """Return a joint with the axis z and the pose T in its parent; `more` are its limit and mimic rule."""
    return Joint(name, kind, 0, np.eye(4) if T is None else T, np.array([0.0, 0.0, 1.0]), **more)


def shift(x: float, y: float, z: float) -> FloatArray:
    """Return a translation (4, 4)."""
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


@st.composite
def step(draw: st.DrawFn, tame: bool = False) -> FloatArray:
    """Return the pose of a joint's frame in the previous joint's frame; both frames have z as joint axis.

    With `tame`, lengths and tilts are not tiny.
    """
    length = tame_length if tame else any_length
    relation = draw(st.sampled_from(RELATIONS[:TAME] if tame else RELATIONS))
    a, tilt = draw(length), 0.0
    if relation in ("meeting", "collinear"):
        a = 0.0
    if relation in ("skew", "meeting"):
        tilt = draw(st.floats(0.1, 3.0))
    elif relation == "square":
        tilt = draw(st.sampled_from([math.pi / 2, -math.pi / 2]))
    elif relation == "antiparallel":
        tilt = math.pi
    elif relation == "near":
        tilt = draw(tiny)
    elif relation == "near-anti":
        tilt = math.pi - draw(tiny)
    elif relation == "coaxial-ish":
        a, tilt = draw(tiny), draw(tiny)
    twist = rotation("z", draw(angle)) @ shift(0, 0, draw(length))
    aside = shift(a, draw(length) if relation in ("near", "near-anti") else 0.0, 0.0)
    return twist @ aside @ rotation("x", tilt) @ rotation("z", draw(angle)) @ shift(0, 0, draw(length))


@st.composite
def local_frame(draw: st.DrawFn) -> FloatArray:
    """Return the rotation (4, 4) of a URDF joint frame in a frame with z as joint axis."""
    if draw(st.booleans()):
        return np.eye(4)
    return rotation("x", draw(angle)) @ rotation("y", draw(angle)) @ rotation("z", draw(angle))


@st.composite
def trees(
    draw: st.DrawFn,
    *,
    min_joints: int = 0,
    max_joints: int = 7,
    mimics: bool = True,
    slides: bool = True,
    tame: bool = False,
) -> KinematicTree:
    """Return a serial robot `l0 ... tip` of moving joints, with fixed joints between some of them."""
    joints, link, carried = list[tuple[Joint, str, str]](), "l0", np.eye(4)
    kinds = (JointKind.REVOLUTE, JointKind.CONTINUOUS, *[JointKind.PRISMATIC] * slides)
    for i in range(draw(st.integers(min_joints, max_joints))):
        kind = draw(st.sampled_from(kinds))
        local = draw(local_frame())
        pose = carried @ draw(step(tame)) @ local
        if draw(st.integers(0, 4)) == 0:
            joints.append((Joint(f"f{i}", JointKind.FIXED, 0, pose, np.eye(3)[0]), link, f"m{i}"))
            link, pose = f"m{i}", np.eye(4)
        axis = local[2, :3]
        mimicked_joint = Mimic("j0", draw(st.floats(-2, 2)), draw(st.floats(-1, 1)))
        mimic = mimicked_joint if mimics and i and draw(st.integers(0, 5)) == 0 else None
        limit = None if kind is JointKind.CONTINUOUS else Limit(-1.0, 1.0, 1.0, 1.0)
        joints.append(
            (Joint(f"j{i}", kind, 0, pose, axis / np.linalg.norm(axis), limit, mimic), link, f"l{i + 1}")
        )
        link, carried = f"l{i + 1}", local.T
    tip = carried @ (draw(step(tame)) if draw(st.booleans()) else np.eye(4))
    joints.append((Joint("end", JointKind.FIXED, 0, tip, np.eye(3)[0]), link, "tip"))
    return build_tree("random", "l0", joints)


def configurations(n: int, count: int = 8, seed: int = 0) -> FloatArray:
    """Return configurations (count, n); the first one is zero."""
    q = np.random.default_rng(seed).uniform(-3.0, 3.0, (count, n))
    q[0] = 0.0
    return q
