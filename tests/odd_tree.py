"""A tree with oblique joints of every kind, a branch, an inner fixed joint and a mimic joint."""

import numpy as np

from urdfkin.kinematics.inputs import FloatArray
from urdfkin.kinematics.rotation import exp_rotation, quaternion_of
from urdfkin.model.tree import Joint, JointKind, KinematicTree, Mimic, build_tree


def pose(generator: np.random.Generator) -> FloatArray:
    """Return a random pose (4, 4)."""
    T = np.eye(4)
    T[:3, :3] = exp_rotation(generator.normal(size=3))
    T[:3, 3] = generator.uniform(-0.5, 0.5, 3)
    return T


def odd_tree() -> KinematicTree:
    generator = np.random.default_rng(7)

    def joint(name: str, kind: JointKind, mimic: Mimic | None = None) -> Joint:
        axis = generator.normal(size=3)
        return Joint(name, kind, 0, pose(generator), axis / np.linalg.norm(axis), mimic=mimic)

    rows = [
        (joint("free", JointKind.FLOATING), "base", "body"),
        (joint("arm", JointKind.REVOLUTE), "body", "upper"),
        (joint("slide", JointKind.PRISMATIC), "upper", "lower"),
        (joint("bolt", JointKind.FIXED), "lower", "plate"),
        (joint("follower", JointKind.REVOLUTE, Mimic("arm", -0.7, 0.2)), "plate", "wrist"),
        (joint("table", JointKind.PLANAR), "body", "cart"),
        (joint("wheel", JointKind.CONTINUOUS), "cart", "tyre"),
    ]
    return build_tree("odd", "base", rows)


def state(tree: KinematicTree, n: int, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return configurations, joint velocities and joint accelerations (n, ...)."""
    generator = np.random.default_rng(seed)
    q = generator.uniform(-2.0, 2.0, (n, tree.nq))
    at = tree.q_index[tree.joint_index("free")] + 3
    q[:, at : at + 4] = quaternion_of(exp_rotation(generator.normal(size=(n, 3))))
    return q, generator.normal(size=(n, tree.nv)), generator.normal(size=(n, tree.nv))
