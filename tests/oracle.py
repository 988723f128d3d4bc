"""Pinocchio's results for a `KinematicTree`, for tests of chains and tables.

The model is built joint by joint from the tree, without a URDF, so the tests do not depend on a reader or a
writer. Mimic joints are independent joints in the model, and coupled by G.
"""

import numpy as np
import pinocchio as pin

from urdfkin.model.tree import FloatArray, JointKind, KinematicTree


class TreeOracle:
    """Placement, Jacobian and acceleration of one frame in another, by Pinocchio."""

    def __init__(self, tree: KinematicTree) -> None:
        self.tree = tree
        self.model = pin.Model()
        poses = [(0, pin.SE3.Identity())]  # Pinocchio's joint of each link, and the link's pose in it
        self.slots = list[int]()  # Pinocchio's index of each moving joint, in the order of the tree
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
            mimicked_joint = tree.joint_index(joint.mimic.mimicked_joint if joint.mimic else joint.name)
            self.G[row, tree.q_index[mimicked_joint]] = joint.mimic.multiplier if joint.mimic else 1.0

    def frame(self, link: str) -> int:
        return int(self.model.getFrameId(link, pin.FrameType.BODY))

    def placement(self, q: FloatArray, tip: str, base: str) -> FloatArray:
        """Return T_base_tip (..., 4, 4)."""
        poses = []
        for one in np.atleast_2d(q):
            pin.framesForwardKinematics(self.model, self.data, self.G @ one + self.offset)
            oMf = self.data.oMf
            poses.append((oMf[self.frame(base)].inverse() * oMf[self.frame(tip)]).homogeneous)
        return np.array(poses).reshape(*np.shape(q)[:-1], 4, 4)

    def jacobian(self, q: FloatArray, tip: str) -> FloatArray:
        """Return the Jacobian (6, nv) of `tip` in the root, [linear; angular], LOCAL_WORLD_ALIGNED."""
        pin.computeJointJacobians(self.model, self.data, self.G @ q + self.offset)
        pin.updateFramePlacements(self.model, self.data)
        reference = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        # For one joint, Pinocchio returns a vector.
        J = np.reshape(pin.getFrameJacobian(self.model, self.data, self.frame(tip), reference), (6, -1))
        return np.asarray(J @ self.G)

    def acceleration(self, q: FloatArray, v: FloatArray, a: FloatArray, tip: str) -> FloatArray:
        """Return the classical acceleration (6,) of `tip`, [linear; angular], LOCAL_WORLD_ALIGNED."""
        G = self.G
        pin.forwardKinematics(self.model, self.data, G @ q + self.offset, G @ v, G @ a)
        reference = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        return np.asarray(
            pin.getFrameClassicalAcceleration(self.model, self.data, self.frame(tip), reference).vector
        )
