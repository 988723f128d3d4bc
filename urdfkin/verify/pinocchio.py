"""The oracle Pinocchio.

The oracle shares no code with urdfkin's computation. It reads the URDF text with its own parser.
`urdfkin.verify.pinocchio_inputs` determines the frame of a name, the joint of each number of q, and the
motion of the base a second time, from Pinocchio's model and the user's original numbers.

Pinocchio's model is built without mimic joints, because Pinocchio 4.1 with mimic joints refuses four of the
robots it ships with. `urdfkin.verify.pinocchio_inputs` reads the mimic rules from the text a second time.
The rules define a matrix G and a vector g_0, with q_full = G q + g_0, v_full = G v and J = J_full G. The
index "full" marks Pinocchio's vectors, in which mimic joints have numbers of their own.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any
from xml.parsers.expat import ExpatError

import numpy as np

from urdfkin.errors import OracleError
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, KinematicTree, Mimic
from urdfkin.system.processes import with_stack
from urdfkin.verify.pinocchio_inputs import (
    BaseNumbers,
    Frames,
    Layout,
    free_flyer,
    free_flyer_rates,
    free_flyer_second_rates,
    locked_by_rules,
    rules_of_text,
)
from urdfkin.verify.pinocchio_module import pinocchio, version

__all__ = ["MOST_RATES", "Oracle", "OracleError", "depth_of", "version"]

#: Bytes of stack for each link. Pinocchio processes links recursively; version 4.1.0 needs less than 4 kB for
#: each.
_STACK_FOR_A_LINK = 16_384
#: A chain of fewer links fits into any stack.
_SHALLOW = 100
#: Largest nv that is accepted. Pinocchio 4.1.0 needs about 64 bytes * nv^3 (measured), so the memory stays
#: below 2 GB.
MOST_RATES = 315

#: Largest number of names that an error lists.
_NAMED = 5
#: Name of the free-flyer of a moving base.
_BASE = "base"


def build_model(
    text: str,
    tree: KinematicTree,
    root_joint: str | None = None,
    *,
    mimic: bool = False,
    lock: Mapping[str, float] = MappingProxyType({}),
    coupled: bool = True,
) -> Any:
    """Return Pinocchio's model of a URDF text.

    Robots that would exhaust memory or stack, and so crash the process, are rejected or get a larger stack.

    Args:
        text: The URDF text.
        tree: urdfkin's tree of the text, which gives the size of the robot.
        root_joint: "floating" or "planar" to connect the root to the world by such a joint.
        mimic: True: the model couples its mimic joints.
        lock: Value (rad or m) of each locked joint. `buildReducedModel` removes these joints from the model
            of the whole text.
        coupled: Whether a locked joint locks its mimic joints too.

    Raises:
        OracleError: Pinocchio does not accept the text, or the robot is too large.
        InstallationError: Pinocchio is missing, or a different project has its name.
    """
    rates = sum(joint.kind.nv for joint in tree.joints)
    if rates > MOST_RATES:
        raise OracleError(
            f"too many joint velocities for Pinocchio: its memory grows with nv^3; the limit is {MOST_RATES}",
            where=tree.name,
            found=f"nv = {rates}, which needs {64e-9 * rates**3:.0f} GB",
        )
    depth = depth_of(tree)
    if depth < _SHALLOW:
        model = _parse(text, tree, root_joint, mimic)
    else:
        model = with_stack(depth * _STACK_FOR_A_LINK, lambda: _parse(text, tree, root_joint, mimic))
    return _reduced(model, text, lock, coupled=coupled) if lock else model


def _reduced(model: Any, text: str, lock: Mapping[str, float], *, coupled: bool) -> Any:
    """Return a model without the locked joints, by `buildReducedModel`."""
    pin, q = pinocchio(), pinocchio().neutral(model)
    rules = mimic_rules(text, list(model.names)[1:], str(model.name)) if coupled else {}
    held = locked_by_rules(lock, rules)
    ids = [int(model.getJointId(name)) for name in held]
    for i, (name, value) in zip(ids, held.items(), strict=True):
        if i >= model.njoints:
            raise OracleError("Pinocchio has no such joint to lock", where=str(model.name), found=repr(name))
        at, numbers = model.joints[i].idx_q, model.joints[i].nq  # 0 for a mimic joint of a coupled model
        q[at : at + numbers] = (value,) if numbers == 1 else (np.cos(value), np.sin(value))[:numbers]
    return pin.buildReducedModel(model, ids, q)


def mimic_rules(text: str, joints: Sequence[str], name: str) -> dict[str, Mimic]:
    """Return the mimic rules of the text, read independently of urdfkin's reader.

    Raises:
        OracleError: a rule cannot be read.
    """
    try:
        return rules_of_text(text, set(joints))
    except (ValueError, ExpatError) as error:
        raise OracleError(
            "the oracle's reader cannot read the mimic rules", where=name, found=str(error)
        ) from error


def _parse(text: str, tree: KinematicTree, root_joint: str | None, mimic: bool) -> Any:
    pin = pinocchio()
    roots = {"floating": pin.JointModelFreeFlyer, "planar": pin.JointModelPlanar}
    try:
        if root_joint is not None:
            return pin.buildModelFromXML(text, roots[root_joint](), mimic=mimic)
        return pin.buildModelFromXML(text, mimic=mimic)
    except (ValueError, RuntimeError) as error:
        # `check` reports all known reasons for a refusal before this point. So this reason is a new one.
        raise OracleError(
            "Pinocchio does not accept this robot",
            where=tree.name,
            found=str(error).strip(),
            remedy="try mimic=False"
            if mimic
            else "`urdfkin check` found no reason: please report this as an error of urdfkin, with the URDF",
        ) from error


class Oracle:
    """Pinocchio's results for one robot, in urdfkin's layout of q, v and Jacobian columns.

    Each method takes flat batches (n, nq), (n, nv) and the names of frames, as the user gave them.

    Args:
        text: The URDF text.
        tree: urdfkin's tree of the same text, only for a comparison of the joints, their order and the mimic
            joints.
        mimic: True: couple mimic joints. False: each moves freely.
        moving_base: Build the model on a free-flyer, which receives the base's motion.
        root_joint: "floating" or "planar" if the tree has such a root joint, which the text does not contain.
        lock: Value (rad or m) of each locked joint; the tree has it as a fixed joint.

    Raises:
        OracleError: Pinocchio does not accept the text, or reads other joints from it.
        InstallationError: Pinocchio is missing, or a different project has its name.
    """

    def __init__(
        self,
        text: str,
        tree: KinematicTree,
        *,
        mimic: bool = True,
        moving_base: bool = False,
        root_joint: str | None = None,
        lock: Mapping[str, float] = MappingProxyType({}),
    ) -> None:
        self._pin = pin = pinocchio()
        self._tree = tree
        self._moving_base = moving_base
        self._model = build_model(text, tree, root_joint, lock=lock, coupled=mimic)
        names = list(self._model.names)[1:]
        self._frames = Frames(self._model, pin, stands_on_world=root_joint is not None)
        joints, self._index = list(range(1, len(names) + 1)), list(range(self._model.nframes))
        if moving_base:
            joints, self._index = self._put_on_free_flyer(joints)
        rules = mimic_rules(text, names, tree.name) if mimic else {}
        self._layout = Layout(self._model, joints, names, rules)
        demand_the_same("Pinocchio", tree, names, self._layout.coordinates)
        self._local = threading.local()

    def _put_on_free_flyer(self, joints: Sequence[int]) -> tuple[list[int], list[int]]:
        """Put the model on a free-flyer for the base's motion; a root joint of the robot remains.

        Returns:
            The new indices of the joints and of the frames. The frame of the world becomes the frame of the
            base.
        """
        pin, model, nowhere = self._pin, self._model, self._pin.SE3.Identity()
        # appendModel rejects a link with the name of a joint or of the free-flyer. Numbers as names avoid
        # that.
        for j in joints:
            model.names[j] = f"joint {j}"
        for i in range(1, model.nframes):
            model.frames[i].name = str(i)
        carrier = pin.Model()
        joint = carrier.addJoint(0, pin.JointModelFreeFlyer(), nowhere, _BASE)
        base = carrier.addFrame(pin.Frame(_BASE, joint, 0, nowhere, pin.FrameType.BODY))
        self._model = pin.appendModel(carrier, model, base, nowhere)
        to = {frame.name: i for i, frame in enumerate(self._model.frames)}
        return (
            [int(self._model.getJointId(f"joint {j}")) for j in joints],
            [base, *(to[str(i)] for i in range(1, model.nframes))],
        )

    @property
    def _data(self) -> Any:
        """Pinocchio's data structure; each thread has its own."""
        if not hasattr(self._local, "data"):
            self._local.data = self._model.createData()
        return self._local.data

    def _ids(self, frames: Sequence[str]) -> list[int]:
        """Return Pinocchio's indices of frames."""
        return [self._index[self._frames.index(name)] for name in frames]

    def _reference(self, reference: Reference | str) -> Any:
        """Return Pinocchio's ReferenceFrame of a reference or its name."""
        name = reference.name if isinstance(reference, Reference) else str(reference).upper()
        return self._pin.ReferenceFrame.names[name]

    # -- quantities ----------------------------------------------------------------------------------

    def placements(self, q: FloatArray, frames: Sequence[str], base: BaseNumbers | None = None) -> FloatArray:
        """Return T_world_frame (n, frames, 4, 4) by `updateFramePlacement`."""
        pin, model, data, ids = self._pin, self._model, self._data, self._ids(frames)
        out = np.empty((len(q), len(ids), 4, 4))
        for k, q_k in enumerate(self.configurations(q, base)):
            pin.forwardKinematics(model, data, q_k)
            for f, frame in enumerate(ids):
                out[k, f] = pin.updateFramePlacement(model, data, frame).homogeneous
        return out

    def quaternions(
        self, q: FloatArray, frames: Sequence[str], base: BaseNumbers | None = None
    ) -> FloatArray:
        """Return Pinocchio's quaternions (n, frames, 4), scalar last, with qw >= 0."""
        R = self.placements(q, frames, base)[..., :3, :3]
        quats = [self._pin.Quaternion(np.array(one)).coeffs() for one in R.reshape(-1, 3, 3)]
        out: FloatArray = np.array(quats).reshape(*R.shape[:-2], 4)
        return np.where(out[..., 3:] < 0.0, -out, out)

    def velocities(
        self,
        q: FloatArray,
        v: FloatArray,
        frames: Sequence[str],
        reference: Reference | str,
        base: BaseNumbers | None = None,
    ) -> FloatArray:
        """Return velocities (n, frames, 6) by `getFrameVelocity`."""
        pin = self._pin
        return self._collected(
            (self.configurations(q, base), self.rates(v, base)),
            pin.forwardKinematics,
            lambda *which: pin.getFrameVelocity(*which).vector,
            self._ids(frames),
            reference,
        )

    def accelerations(
        self,
        q: FloatArray,
        v: FloatArray,
        a: FloatArray,
        frames: Sequence[str],
        reference: Reference | str,
        base: BaseNumbers | None = None,
    ) -> FloatArray:
        """Return classical accelerations (n, frames, 6) by `getFrameClassicalAcceleration`."""
        pin = self._pin
        return self._collected(
            (self.configurations(q, base), self.rates(v, base), self.second_rates(a, base)),
            pin.forwardKinematics,
            lambda *which: pin.getFrameClassicalAcceleration(*which).vector,
            self._ids(frames),
            reference,
        )

    def jacobians(
        self,
        q: FloatArray,
        frames: Sequence[str],
        reference: Reference | str,
        base: BaseNumbers | None = None,
    ) -> FloatArray:
        """Return Jacobians (n, frames, 6, nv) by `computeJointJacobians` and `getFrameJacobian`."""
        pin, inputs = self._pin, (self.configurations(q, base),)
        compute, get = pin.computeJointJacobians, pin.getFrameJacobian
        return self._layout.couple(self._collected(inputs, compute, get, self._ids(frames), reference))

    def jacobian_rates(
        self,
        q: FloatArray,
        v: FloatArray,
        frames: Sequence[str],
        reference: Reference | str,
        base: BaseNumbers | None = None,
    ) -> FloatArray:
        """Return J-dot (n, frames, 6, nv) by `getFrameJacobianTimeVariation`."""
        pin, inputs = self._pin, (self.configurations(q, base), self.rates(v, base))
        compute, get = pin.computeJointJacobiansTimeVariation, pin.getFrameJacobianTimeVariation
        return self._layout.couple(self._collected(inputs, compute, get, self._ids(frames), reference))

    def hessians(
        self,
        q: FloatArray,
        frames: Sequence[str],
        reference: Reference | str,
        base: BaseNumbers | None = None,
    ) -> FloatArray:
        """Return Hessians (n, frames, 6, nv, nv) by `getFrameKinematicHessian`.

        Two errors of Pinocchio 4.1 are corrected:

        - Pinocchio returns the numbers in Eigen's order (the first index varies fastest), but in a NumPy
          array with C order (the last index varies fastest).
        - In LOCAL, entries [i, j] with i and j of the same joint are not 0 if another joint precedes this
          joint. They must be 0, because the joint moves its own axes together with the frame.
        """
        pin, model, data = self._pin, self._model, self._data
        ids, wanted, nv = self._ids(frames), self._reference(reference), model.nv
        out = np.zeros((len(q), len(ids), 6, nv, nv))
        carried = [(f, i) for f, i in enumerate(ids) if nv and model.frames[i].parentJoint]
        for to, q_k in zip(out, self.configurations(q, base), strict=True):
            pin.computeJointJacobians(model, data, q_k)
            pin.computeJointKinematicHessians(model, data)
            for f, frame in carried:
                numbers = pin.getFrameKinematicHessian(model, data, frame, wanted).ravel("K")
                to[f] = numbers.reshape(nv, nv, 6).T
        if wanted == pin.LOCAL:
            for joint in model.joints[1:]:
                own = slice(joint.idx_v, joint.idx_v + joint.nv)
                out[..., own, own] = 0.0
        by_leaders = self._layout.couple(out)
        return self._layout.couple(by_leaders.swapaxes(-1, -2)).swapaxes(-1, -2)

    def joint_jacobians(self, q: FloatArray, among: slice, reference: Reference | str) -> FloatArray:
        """Return `getJointJacobian` (n, joints, 6, nv) of a slice of the moving joints, in tree order."""
        pin, inputs, joints = self._pin, (self.configurations(q),), self._layout.joint_ids[among]
        compute, get = pin.computeJointJacobians, pin.getJointJacobian
        return self._layout.couple(self._collected(inputs, compute, get, joints, reference))

    def joint_jacobian_rates(
        self, q: FloatArray, v: FloatArray, among: slice, reference: Reference | str
    ) -> FloatArray:
        """Return `getJointJacobianTimeVariation` (n, joints, 6, nv) of a slice of the moving joints."""
        pin, joints = self._pin, self._layout.joint_ids[among]
        inputs = self.configurations(q), self.rates(v)
        compute, get = pin.computeJointJacobiansTimeVariation, pin.getJointJacobianTimeVariation
        return self._layout.couple(self._collected(inputs, compute, get, joints, reference))

    def screws(self, q: FloatArray) -> FloatArray:
        """Return `data.J` of `computeJointJacobians` (n, 6, columns), mimic joints included."""
        columns, model = self._layout.rate_columns, self._model
        out = np.empty((len(q), 6, len(columns)))
        # Pinocchio 4.1 crashes the process if nv is 0, and returns a vector if nv is 1.
        for k, q_k in enumerate(self.configurations(q) if columns else ()):
            J = self._pin.computeJointJacobians(model, self._data, q_k)
            out[k] = J.reshape(6, model.nv)[:, columns]
        return out

    def _collected(
        self,
        inputs: tuple[FloatArray, ...],
        compute: Callable[..., object],
        get: Callable[..., FloatArray],
        ids: Sequence[int],
        reference: Reference | str,
    ) -> FloatArray:
        """Return (n, ids, ...): call `compute` for each configuration, then `get` for each frame or joint.

        The loop for one frame is separate from the loop for several, to make the check of one frame fast.
        """
        model, data, n, wanted = self._model, self._data, len(inputs[0]), self._reference(reference)
        own = (6, model.nv) if compute is not self._pin.forwardKinematics else (6,)
        out = np.empty((n, len(ids), *own))
        if not all(own):  # Pinocchio 4.1 crashes the process for a Jacobian without columns
            return out
        flat = out.reshape(n, len(ids), *((6,) if model.nv == 1 else own))
        if len(ids) == 1:
            (one,), alone = ids, flat[:, 0]
            for k, x in enumerate(zip(*inputs, strict=True)):
                compute(model, data, *x)
                alone[k] = get(model, data, one, wanted)
            return out
        for to, x in zip(flat, zip(*inputs, strict=True), strict=True):
            compute(model, data, *x)
            for place, one in enumerate(ids):
                to[place] = get(model, data, one, wanted)
        return out

    # -- layout --------------------------------------------------------------------------------------

    def configurations(self, q: FloatArray, base: BaseNumbers | None = None) -> FloatArray:
        """Return Pinocchio's configurations for `q`; the free-flyer receives the moving base."""
        full = self._layout.configurations(q)
        if self._moving_base:
            full[:, :7] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0) if base is None else free_flyer(base)
        return full

    def rates(self, v: FloatArray, base: BaseNumbers | None = None) -> FloatArray:
        """Return Pinocchio's joint velocities. The velocity of a free-flyer is in the base's own axes."""
        full = self._layout.rates(v)
        if self._moving_base and base is not None:
            full[:, :6] = free_flyer_rates(base)
        return full

    def second_rates(self, a: FloatArray, base: BaseNumbers | None = None) -> FloatArray:
        """Return Pinocchio's joint accelerations. A free-flyer's is spatial and in the base's own axes."""
        full = self._layout.rates(a)
        if self._moving_base and base is not None:
            full[:, :6] = free_flyer_second_rates(base)
        return full


def demand_the_same(
    oracle: str, tree: KinematicTree, joints: Sequence[str], coordinates: Sequence[str]
) -> None:
    """Check that oracle and tree have the same joints and coordinates in the same order.

    Otherwise the numbers of q would belong to different joints.

    Raises:
        OracleError: the names or their order differ.
    """
    for what, theirs, own in (
        ("joints", joints, [joint.name for joint in tree.joints if joint.kind.nv]),
        ("coordinates", coordinates, [joint.name for joint in tree.joints if joint.nv]),
    ):
        if list(theirs) != own:
            found = ", ".join(sorted(set(theirs) ^ set(own))[:_NAMED]) or "the same in another order"
            raise OracleError(f"{oracle} finds other {what} in this robot", where=tree.name, found=found)


def depth_of(tree: KinematicTree) -> int:
    """Return the largest number of joints on a path from the root."""
    depths = [0]
    for joint in tree.joints:
        depths.append(depths[joint.parent] + 1)
    return max(depths)
