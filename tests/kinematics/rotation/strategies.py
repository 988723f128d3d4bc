"""Hypothesis strategies for unit vectors, special angles and rotations."""

from typing import Any

import numpy as np
from hypothesis import strategies as st

from urdfkin.kinematics.inputs import FloatArray

#: Tolerance for rounding errors of numbers of size one.
ROUNDING = 16 * np.finfo(np.float64).eps


def close(found: Any, expected: Any, room: float = 4.0) -> bool:
    return bool(np.abs(np.asarray(found) - expected).max() <= room * ROUNDING)


_components = st.one_of(st.sampled_from([0.0, 1.0, -1.0, 1e-9, -1e-17]), st.floats(-1.0, 1.0))

#: Vectors with components in [-1, 1], including zero and tiny components.
vectors3 = st.tuples(_components, _components, _components).map(np.array)


def _normalised(vector: FloatArray) -> FloatArray:
    unit: FloatArray = vector / np.linalg.norm(vector)
    return unit


#: Unit vectors, including the coordinate axes and vectors close to these axes.
axes = vectors3.filter(lambda v: bool(np.linalg.norm(v) > 1e-3)).map(_normalised)

#: Angles, including multiples of a right angle and angles close to these multiples.
angles = st.one_of(
    st.floats(-10.0, 10.0),
    st.builds(
        lambda n, off: n * np.pi / 2 + off,
        st.integers(-4, 4),
        st.sampled_from([0.0, 1e-16, 1e-12, 1e-9, -1e-9, 1e-7, -1e-5, 1e-3]),
    ),
)
