"""JAX in float64: the path written out for one configuration, `vmap` over the batch, compiled by XLA.

The same recursion as urdfkin's, with the robot's constants folded in: what somebody would write who wants
this robot fast in JAX. Inputs are JAX arrays beforehand and results stay JAX's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from scripts.benchmarking.subject import Subject
from scripts.benchmarking.work import Work

LIBRARY = "jax"
_REMARK = "all processors; arrays are JAX's own"


def batches(subject: Subject, quantity: str) -> Iterator[Work]:
    """The whole batch in one call."""
    jax.config.update("jax_enable_x64", True)  # numbers of 64 bits, as everyone's
    one = jacobian_of(subject) if quantity == "jacobian" else acceleration_of(subject)
    compiled = jax.jit(jax.vmap(one))
    inputs = [jnp.asarray(x) for x in subject.inputs(quantity, subject.n)]
    yield Work(
        "JAX, vmap and jit",
        subject.n,
        lambda: compiled(*inputs).block_until_ready(),
        lambda: np.asarray(compiled(*inputs)),
        remark=_REMARK,
    )


def jacobian_of(subject: Subject) -> Callable[[Any], Any]:
    """(nq,) to (6, nv): 7.85."""

    def jacobian(q: Any) -> Any:
        R, p, passed = np.eye(3), np.zeros(3), []
        for joint, x, _ in _path(subject, q):
            p = p + R @ joint.T_parent_joint[:3, 3]
            R = R @ joint.T_parent_joint[:3, :3]
            if joint.nv:
                z = R @ joint.axis
                passed.append((joint.kind.turns, z, p))
                R, p = (R @ _turn(joint.axis, x), p) if joint.kind.turns else (R, p + x * z)
        columns = [jnp.zeros(6)] * subject.nv
        moving = [index for joint, _, index in _path(subject, q) if joint.nv]
        for index, (turns, z, origin) in zip(moving, passed, strict=True):
            rows = (jnp.cross(z, p - origin), z) if turns else (z, jnp.zeros(3))
            columns[index] = jnp.concatenate(rows)
        return jnp.stack(columns, axis=1)

    return jacobian


def acceleration_of(subject: Subject) -> Callable[[Any, Any, Any], Any]:
    """(nq,), (nv,), (nv,) to (6,): 7.127 to 7.130."""

    def acceleration(q: Any, v: Any, a: Any) -> Any:
        R = np.eye(3)
        w = alpha = acc = np.zeros(3)
        for joint, x, i in _path(subject, q):
            acc = acc + _moved(w, alpha, R @ joint.T_parent_joint[:3, 3])
            R = R @ joint.T_parent_joint[:3, :3]
            z = R @ joint.axis
            if joint.nv and joint.kind.turns:
                alpha = alpha + a[i] * z + v[i] * jnp.cross(w, z)
                w = w + v[i] * z
                R = R @ _turn(joint.axis, x)
            elif joint.nv:
                acc = acc + _moved(w, alpha, x * z) + a[i] * z + 2.0 * v[i] * jnp.cross(w, z)
        return jnp.concatenate([acc, alpha])

    return acceleration


def _path(subject: Subject, q: Any) -> Iterator[tuple[Any, Any, int]]:
    """Each joint from the root to the frame, its coordinate and its number among the rates."""
    tree = subject.robot.tree
    for i in tree.path(tree.frame_link(subject.frame)):
        yield tree.joints[i], q[tree.q_index[i]] if tree.joints[i].nv else 0.0, tree.v_index[i]


def _turn(axis: Any, x: Any) -> Any:
    """Rodrigues' rotation."""
    K = np.cross(np.eye(3), axis)
    return np.eye(3) + jnp.sin(x) * K + (1.0 - jnp.cos(x)) * (K @ K)


def _moved(w: Any, alpha: Any, d: Any) -> Any:
    """What the far end of `d` adds to the acceleration."""
    return jnp.cross(alpha, d) + jnp.cross(w, jnp.cross(w, d))
