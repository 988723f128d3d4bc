"""What Pinocchio says about a `KinematicTree`: the one place where tests of chains and tables ask it.

The model is built joint by joint from the tree, without any URDF, so that a test of geometry does not lean
on a reader or a writer. Followers are free joints in the model and coupled outside.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from urdfkin.model.tree import FloatArray, JointKind, KinematicTree


class TreeOracle:
    """Placement, Jacobian and acceleration of one frame in another, by Pinocchio."""

    def __init__(self, tree: KinematicTree) -> None:
        self.tree = tree
        self.model = pin.Model()
        poses = [(0, pin.SE3.Identity())]  # of each link: the pinocchio joint it moves with, and where
        self.slots = list[int]()  # pinocchio's index of each moving joint, in the tree's order
        for joint in tree.joints:
            carrier, placement = poses[joint.parent]
            here = placement * pin.SE3(joint.T_parent_joint)
            if joint.kind is not JointKind.FIXED:
                turns = joint.kind.turns
                kind = pin.JointModelRevoluteUnaligned if turns else pin.JointModelPrismaticUnaligned
                carrier = self.model.addJoint(carrier, kind(joint.axis), here, joint.name)
                here = pin.SE3.Identity()
                self.slots.append(carrier)
            poses.append((carrier, here))
        for name, (carrier, here) in zip(tree.links, poses, strict=True):
            self.model.addFrame(pin.Frame(name, carrier, 0, here, pin.FrameType.BODY))
        self.data = self.model.createData()
        moving = [j for j in tree.joints if j.kind is not JointKind.FIXED]
        self.offset = np.array([j.mimic.offset if j.mimic else 0.0 for j in moving])
        self.G = np.zeros((len(moving), tree.nq))
        for row, joint in enumerate(moving):
            leader = tree.joint_index(joint.mimic.leader if joint.mimic else joint.name)
            self.G[row, tree.q_index[leader]] = joint.mimic.multiplier if joint.mimic else 1.0

    def frame(self, link: str) -> int:
        """Pinocchio's index of a link's frame."""
        return int(self.model.getFrameId(link, pin.FrameType.BODY))

    def placement(self, q: FloatArray, tip: str, base: str) -> FloatArray:
        """(..., 4, 4) T_base_tip."""
        poses = []
        for one in np.atleast_2d(q):
            pin.framesForwardKinematics(self.model, self.data, self.G @ one + self.offset)
            oMf = self.data.oMf
            poses.append((oMf[self.frame(base)].inverse() * oMf[self.frame(tip)]).homogeneous)
        return np.array(poses).reshape(*np.shape(q)[:-1], 4, 4)

    def jacobian(self, q: FloatArray, tip: str) -> FloatArray:
        """(6, nv) Jacobian of `tip` in the root's frame, [linear; angular], LOCAL_WORLD_ALIGNED."""
        pin.computeJointJacobians(self.model, self.data, self.G @ q + self.offset)
        pin.updateFramePlacements(self.model, self.data)
        reference = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        # A robot of one joint gets a vector from Pinocchio's binding.
        J = np.reshape(pin.getFrameJacobian(self.model, self.data, self.frame(tip), reference), (6, -1))
        return np.asarray(J @ self.G)

    def acceleration(self, q: FloatArray, v: FloatArray, a: FloatArray, tip: str) -> FloatArray:
        """(6,) classical acceleration of `tip`, [linear; angular], LOCAL_WORLD_ALIGNED."""
        G = self.G
        pin.forwardKinematics(self.model, self.data, G @ q + self.offset, G @ v, G @ a)
        reference = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        return np.asarray(
            pin.getFrameClassicalAcceleration(self.model, self.data, self.frame(tip), reference).vector
        )


def worst(a: FloatArray, b: FloatArray, axes: Sequence[int] | None = None) -> float:
    """The largest difference of two arrays."""
    return float(np.abs(a - b).max(initial=0.0))
