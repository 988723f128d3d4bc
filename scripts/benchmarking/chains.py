"""Chains of any number of joints, as URDF text: how cost grows with joints."""

from __future__ import annotations

import numpy as np

TIP = "tip"


def chain_urdf(joints: int, seed: int = 0) -> str:
    """A serial robot of revolute joints, each axis in another direction, links of 0.1 m.

    Joint names sort in the chain's order; the frame `tip` is fixed to the last link.
    """
    generator = np.random.default_rng(seed)
    axes = generator.standard_normal((joints, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    turns = generator.uniform(-3.0, 3.0, (joints, 3))
    links = [f'<link name="link{i:03}"/>' for i in range(joints + 1)]
    moving = [
        f'<joint name="joint{i:03}" type="revolute">{_origin(0.1, turns[i])}'
        f'<parent link="link{i:03}"/><child link="link{i + 1:03}"/><axis xyz="{_text(axes[i])}"/>'
        '<limit lower="-3" upper="3" velocity="1" effort="1"/></joint>'
        for i in range(joints)
    ]
    tip = (
        f'<link name="{TIP}"/><joint name="end" type="fixed">{_origin(0.1, np.zeros(3))}'
        f'<parent link="link{joints:03}"/><child link="{TIP}"/></joint>'
    )
    return f'<robot name="chain{joints}">{"".join(links)}{"".join(moving)}{tip}</robot>'


def _origin(length: float, rpy: np.ndarray) -> str:
    return f'<origin xyz="{length} 0 0" rpy="{_text(rpy)}"/>'


def _text(numbers: np.ndarray) -> str:
    return " ".join(repr(float(x)) for x in numbers)
