"""Everything that asks Pinocchio: the only module that imports it.

The oracle reads the URDF text itself, with its own parser, so that nothing of urdfkin's reading is shared.
Its model is built without mimic joints (with them, Pinocchio 4.1 refuses four of the robots it ships with);
followers are coupled here, by the rules as `urdfkin.followers` reads them from the text once more:
q_full = G q + g_0, v_full = G v, J = J_full G.
"""

from __future__ import annotations

import importlib.metadata
import threading
from collections.abc import Callable, Iterator, Sequence
from itertools import product
from typing import Any

import numpy as np

from urdfkin.configuration import pinocchio_blocks
from urdfkin.deep_stack import with_stack
from urdfkin.errors import InputError, UrdfkinError
from urdfkin.followers import with_rules_of_text
from urdfkin.recursion.base import BaseMotion
from urdfkin.recursion.plan import IntArray
from urdfkin.reference import Reference
from urdfkin.tree import FloatArray, JointKind, KinematicTree

#: Pinocchio recurses over links: less than 4 kB of stack for each was measured (4.1.0), room for more.
_STACK_FOR_A_LINK = 16_384
#: A chain shorter than this fits any stack.
_SHALLOW = 100
#: Pinocchio's workspace takes about 64 bytes times the cube of the rates (4.1.0 measured): at most 2 GB.
MOST_RATES = 315

#: What carries a robot whose base moves; no URDF joint is called so by accident.
_BASE = "moving base (urdfkin)"


class OracleError(UrdfkinError):
    """Pinocchio refuses a robot, or reads another robot from the same text."""


def version() -> str:
    """The version of Pinocchio that checks, found without importing it."""
    return importlib.metadata.version("pin")


class Oracle:
    """Pinocchio's answers for one robot, in urdfkin's layout of q, v and Jacobian columns.

    Every method takes flat batches (n, nq), (n, nv) and frames by name, as `KinematicTree.frame_link` does.

    Args:
        text: The URDF, as Pinocchio is to read it.
        tree: urdfkin's reading of the same text: names and layout only are taken from it.
        moving_base: Build the model on a free-flyer, so that a base's motion can be given.
        root_joint: `"floating"` or `"planar"` when the tree was hung from such a joint, which the text does
            not know. The names alone do not tell: a file may use them itself.

    Raises:
        OracleError: Pinocchio does not accept the text, or finds other joints in it.
    """

    def __init__(
        self, text: str, tree: KinematicTree, *, moving_base: bool = False, root_joint: str | None = None
    ) -> None:
        import pinocchio as pin  # noqa: PLC0415  heavy: only when something is checked

        self._pin = pin
        self._tree = tree
        self._moving_base = moving_base
        self._root_joint = root_joint
        self._root = 0  # Pinocchio's index of the frame that the robot stands on
        self._model = self._build(text)
        self._layout = _Layout(
            self._model, self._coupled(text), 7 if moving_base else 0, 6 if moving_base else 0
        )
        self._local = threading.local()
        self._references = {
            Reference.LOCAL: pin.LOCAL,
            Reference.WORLD: pin.WORLD,
            Reference.LOCAL_WORLD_ALIGNED: pin.LOCAL_WORLD_ALIGNED,
        }

    def _build(self, text: str) -> Any:
        """The model; what would end the process, for want of memory or stack, is refused or avoided."""
        rates = sum(joint.kind.nv for joint in self._tree.joints)
        if rates > MOST_RATES:
            raise OracleError(
                f"Pinocchio's memory grows with the cube of the rates; urdfkin asks it up to {MOST_RATES}",
                where=self._tree.name,
                found=f"{rates}, which would take {64e-9 * rates**3:.0f} GB",
            )
        depth = _depth(self._tree)
        if depth < _SHALLOW:
            return self._parse(text)
        return with_stack(depth * _STACK_FOR_A_LINK, lambda: self._parse(text))

    def _coupled(self, text: str) -> KinematicTree:
        """The tree with the text's own mimic rules; urdfkin's reading of them is under test too."""
        try:
            return with_rules_of_text(self._tree, text)
        except (InputError, ValueError) as error:
            raise OracleError(
                "the mimic rules read differently", where=self._tree.name, found=str(error)
            ) from error

    def _parse(self, text: str) -> Any:
        pin, tree = self._pin, self._tree
        roots = {"floating": pin.JointModelFreeFlyer, "planar": pin.JointModelPlanar}
        try:
            if self._root_joint is not None:
                model = pin.buildModelFromXML(text, roots[self._root_joint](), mimic=False)
            else:
                model = pin.buildModelFromXML(text, mimic=False)
        except (ValueError, RuntimeError) as error:
            raise OracleError(
                "Pinocchio does not accept this robot", where=tree.name, found=str(error).strip()
            ) from error
        return self._on_free_flyer(model) if self._moving_base else model

    def _on_free_flyer(self, model: Any) -> Any:
        """The model carried by a joint that can be given the base's motion; a root joint moves on top."""
        pin, nowhere = self._pin, self._pin.SE3.Identity()
        carrier = pin.Model()
        joint = carrier.addJoint(0, pin.JointModelFreeFlyer(), nowhere, _BASE)
        self._root = carrier.addFrame(pin.Frame(_BASE, joint, 0, nowhere, pin.FrameType.BODY))
        return pin.appendModel(carrier, model, self._root, nowhere)

    @property
    def _data(self) -> Any:
        """Pinocchio's workspace; each thread has its own."""
        if not hasattr(self._local, "data"):
            self._local.data = self._model.createData()
        return self._local.data

    def _moving(self, q: FloatArray, base: BaseMotion | None) -> Iterator[tuple[int, FloatArray]]:
        """Numbered configurations; none for a robot without rates.

        Its Jacobians have no columns, and Pinocchio 4.1 kills the process when asked for one.
        """
        return enumerate(self.configurations(q, base) if self._model.nv else ())

    def _frame(self, name: str) -> int:
        """Pinocchio's index of a frame; it answers `nframes` for a name it does not know."""
        types, tree = self._pin.FrameType, self._tree
        link = tree.frame_link(name)
        own, kind = tree.links[link], types.BODY
        if link == 0 and own == "universe":  # Pinocchio's own root, which is no body
            return self._root
        if link > 0 and name not in (own, f"link:{own}"):
            joint = tree.joints[link - 1]
            own, kind = joint.name, types.JOINT if joint.kind.nv else types.FIXED_JOINT
        index = int(self._model.getFrameId(own, kind))
        if index == self._model.nframes:
            raise OracleError("Pinocchio has no such frame", where=tree.name, found=repr(name))
        return index

    # -- quantities ----------------------------------------------------------------------------------

    def placements(self, q: FloatArray, frames: Sequence[str], base: BaseMotion | None = None) -> FloatArray:
        """(n, frames, 4, 4) T_world_frame: `updateFramePlacements`."""
        pin, model, data = self._pin, self._model, self._data
        ids = [self._frame(frame) for frame in frames]
        out = np.empty((len(q), len(ids), 4, 4))
        for k, q_k in enumerate(self.configurations(q, base)):
            pin.forwardKinematics(model, data, q_k)
            for f, frame in enumerate(ids):
                out[k, f] = pin.updateFramePlacement(model, data, frame).homogeneous
        return out

    def quaternions(self, q: FloatArray, frames: Sequence[str], base: BaseMotion | None = None) -> FloatArray:
        """(n, frames, 4) orientations as Pinocchio's quaternions, scalar last, with qw >= 0."""
        R = self.placements(q, frames, base)[..., :3, :3]
        quats = [self._pin.Quaternion(np.array(one)).coeffs() for one in R.reshape(-1, 3, 3)]
        out: FloatArray = np.array(quats).reshape(*R.shape[:-2], 4)
        return np.where(out[..., 3:] < 0.0, -out, out)

    def velocities(
        self,
        q: FloatArray,
        v: FloatArray,
        frames: Sequence[str],
        references: Sequence[Reference],
        base: BaseMotion | None = None,
    ) -> FloatArray:
        """(n, frames, references, 6): `getFrameVelocity`."""
        pin = self._pin
        return self._collected(
            (self.configurations(q, base), self.rates(v, base)),
            pin.forwardKinematics,
            lambda *which: pin.getFrameVelocity(*which).vector,
            frames,
            references,
        )

    def accelerations(
        self,
        q: FloatArray,
        v: FloatArray,
        a: FloatArray,
        frames: Sequence[str],
        references: Sequence[Reference],
        base: BaseMotion | None = None,
    ) -> FloatArray:
        """(n, frames, references, 6): `getFrameClassicalAcceleration`."""
        pin = self._pin
        return self._collected(
            (self.configurations(q, base), self.rates(v, base), self.second_rates(a, base)),
            pin.forwardKinematics,
            lambda *which: pin.getFrameClassicalAcceleration(*which).vector,
            frames,
            references,
        )

    def jacobians(
        self,
        q: FloatArray,
        frames: Sequence[str],
        references: Sequence[Reference],
        base: BaseMotion | None = None,
    ) -> FloatArray:
        """(n, frames, references, 6, nv): `computeJointJacobians`, then `getFrameJacobian`."""
        pin, inputs = self._pin, (self.configurations(q, base),)
        return self._layout.couple(
            self._collected(inputs, pin.computeJointJacobians, pin.getFrameJacobian, frames, references)
        )

    def jacobian_rates(
        self,
        q: FloatArray,
        v: FloatArray,
        frames: Sequence[str],
        references: Sequence[Reference],
        base: BaseMotion | None = None,
    ) -> FloatArray:
        """(n, frames, references, 6, nv): `getFrameJacobianTimeVariation`."""
        pin, inputs = self._pin, (self.configurations(q, base), self.rates(v, base))
        compute, get = pin.computeJointJacobiansTimeVariation, pin.getFrameJacobianTimeVariation
        return self._layout.couple(self._collected(inputs, compute, get, frames, references))

    def jacobian_rates_of_all(
        self, q: FloatArray, v: FloatArray, frames: Sequence[str], reference: Reference
    ) -> tuple[FloatArray, FloatArray]:
        """(n, frames, 6, nv) of frames, (n, joints, 6, nv) by `getJointJacobianTimeVariation`.

        Both come from one `computeJointJacobiansTimeVariation`; joints are the moving ones, in order.
        """
        pin, model, data = self._pin, self._model, self._data
        ids, joints, wanted = (
            [self._frame(f) for f in frames],
            self._layout.joint_ids,
            self._references[reference],
        )
        of_frames = np.empty((len(q), len(ids), 6, model.nv))
        of_joints = np.empty((len(q), len(joints), 6, model.nv))
        v_full = self.rates(v)
        for k, q_k in self._moving(q, None):
            pin.computeJointJacobiansTimeVariation(model, data, q_k, v_full[k])
            for f, frame in enumerate(ids):
                of_frames[k, f] = _columns(pin.getFrameJacobianTimeVariation(model, data, frame, wanted))
            for j, joint in enumerate(joints):
                of_joints[k, j] = _columns(pin.getJointJacobianTimeVariation(model, data, joint, wanted))
        return self._layout.couple(of_frames), self._layout.couple(of_joints)

    def joint_jacobians(self, q: FloatArray, references: Sequence[Reference]) -> FloatArray:
        """(n, joints, references, 6, nv): `getJointJacobian` of every moving joint, in the tree's order."""
        pin, model, data = self._pin, self._model, self._data
        wanted = [self._references[reference] for reference in references]
        joints = self._layout.joint_ids
        full = np.empty((len(q), len(joints), len(wanted), 6, model.nv))
        for k, q_k in self._moving(q, None):
            pin.computeJointJacobians(model, data, q_k)
            for j, joint in enumerate(joints):
                for r, reference in enumerate(wanted):
                    full[k, j, r] = _columns(pin.getJointJacobian(model, data, joint, reference))
        return self._layout.couple(full)

    def screws(self, q: FloatArray) -> FloatArray:
        """(n, 6, rates): the whole `data.J` of `computeJointJacobians`, one column a rate, followers too."""
        out = np.empty((len(q), 6, len(self._layout.rate_columns)))
        for k, q_k in self._moving(q, None):
            J = _columns(self._pin.computeJointJacobians(self._model, self._data, q_k))
            out[k] = J[:, self._layout.rate_columns]
        return out

    def _collected(
        self,
        inputs: tuple[FloatArray, ...],
        compute: Callable[..., object],
        get: Callable[..., FloatArray],
        frames: Sequence[str],
        references: Sequence[Reference],
    ) -> FloatArray:
        """(n, frames, references, ...): `compute` for each of the inputs, then `get` for each of the wanted.

        A tight loop for one frame in one reference: what it takes beyond Pinocchio's own time is the price of
        a check.
        """
        model, data, n = self._model, self._data, len(inputs[0])
        ids = [self._frame(frame) for frame in frames]
        wanted = list(product(ids, (self._references[reference] for reference in references)))
        own = (6, model.nv) if compute is not self._pin.forwardKinematics else (6,)
        out = np.empty((n, len(ids), len(references), *own))
        if not all(own):  # Pinocchio 4.1 kills the process when asked for a Jacobian without columns
            return out
        flat = out.reshape(n, len(wanted), *((6,) if model.nv == 1 else own))
        if len(wanted) == 1:
            ((frame, reference),), alone = wanted, flat[:, 0]
            for k, x in enumerate(zip(*inputs, strict=True)):
                compute(model, data, *x)
                alone[k] = get(model, data, frame, reference)
            return out
        for to, x in zip(flat, zip(*inputs, strict=True), strict=True):
            compute(model, data, *x)
            for place, (frame, reference) in enumerate(wanted):
                to[place] = get(model, data, frame, reference)
        return out

    # -- layout --------------------------------------------------------------------------------------

    def configurations(self, q: FloatArray, base: BaseMotion | None = None) -> FloatArray:
        """Pinocchio's configurations for urdfkin's, with the base as a free-flyer where there is one."""
        full = self._layout.configurations(q)
        if self._moving_base:
            motion = base or BaseMotion()
            T = np.broadcast_to(motion.placement, (len(q), 4, 4))
            full[:, :3] = T[:, :3, 3]
            for k, R in enumerate(T[:, :3, :3]):
                full[k, 3:7] = self._pin.Quaternion(np.array(R)).coeffs()
        return full

    def rates(self, v: FloatArray, base: BaseMotion | None = None) -> FloatArray:
        """Pinocchio's rates; a free-flyer's are those of the base in its own axes."""
        full = self._layout.rates(v)
        if self._moving_base and base is not None:
            full[:, :6] = _in_own_axes(base, base.velocity, len(v))
        return full

    def second_rates(self, a: FloatArray, base: BaseMotion | None = None) -> FloatArray:
        """Rates of the rates; a free-flyer's are spatial: acc - w x vel, in its own axes."""
        full = self._layout.rates(a)
        if self._moving_base and base is not None:
            spatial = np.array(
                np.broadcast_to(
                    base.acceleration, np.broadcast_shapes(base.acceleration.shape, base.velocity.shape)
                )
            )
            spatial[..., :3] -= np.cross(base.velocity[..., 3:], base.velocity[..., :3])
            full[:, :6] = _in_own_axes(base, spatial, len(a))
        return full


def _depth(tree: KinematicTree) -> int:
    """How many joints lie one behind the other, at most."""
    depths = [0]
    for joint in tree.joints:
        depths.append(depths[joint.parent] + 1)
    return max(depths)


def _in_own_axes(base: BaseMotion, six: FloatArray, n: int) -> FloatArray:
    R = np.broadcast_to(base.placement[..., :3, :3], (n, 3, 3))
    pairs = np.broadcast_to(six, (n, 6)).reshape(n, 2, 3)
    turned: FloatArray = np.einsum("nji,npj->npi", R, pairs).reshape(n, 6)
    return turned


def _columns(J: FloatArray) -> FloatArray:
    """(6, nv), also for a robot of one rate, whose single column Pinocchio hands out as a plain vector."""
    return J if J.ndim > 1 else J.reshape(6, 1)


class _Layout:
    """Where each joint's coordinates and rates stand in Pinocchio's model: by name, here and nowhere else."""

    def __init__(self, model: Any, tree: KinematicTree, q_base: int, v_base: int) -> None:
        self._tree, self._model, self._q_base, self._v_base = tree, model, q_base, v_base
        moving = [i for i, joint in enumerate(tree.joints) if joint.kind.nv]
        theirs = {name: j for j, name in enumerate(model.names) if j > (1 if q_base else 0)}
        ours = {tree.joints[i].name for i in moving}
        if set(theirs) != ours:
            raise OracleError(
                "Pinocchio finds other joints in this robot",
                where=tree.name,
                found=", ".join(sorted(set(theirs) ^ ours)[:5]),
            )
        self._moving = [(i, theirs[tree.joints[i].name]) for i in moving]
        self.joint_ids = [joint for _, joint in self._moving]
        #: Pinocchio's column of each rate, in the order of the tree's moving joints.
        self.rate_columns = [
            model.joints[j].idx_v + c for i, j in self._moving for c in range(tree.joints[i].kind.nv)
        ]
        self._rate_index, self._rate_factor = self._rate_rules()
        #: Whether Pinocchio's rates are the robot's: the same ones, in the same order.
        self._alike = np.array_equal(self._rate_index, np.arange(tree.nv)) and not v_base
        self._alike &= bool((self._rate_factor == 1.0).all())
        #: Whether Pinocchio has other coordinates for a joint, or in another order.
        self._otherwise = model.nq != tree.nq or any(
            tree.joints[i].mimic
            or tree.joints[i].kind in (JointKind.CONTINUOUS, JointKind.PLANAR)
            or tree.q_index[i] != model.joints[j].idx_q
            for i, j in self._moving
        )

    def _rate_rules(self) -> tuple[IntArray, FloatArray]:
        """For each of Pinocchio's rates: whose it is in urdfkin's `v`, and the factor (G)."""
        index, factor = np.zeros(self._model.nv, dtype=np.int64), np.zeros(self._model.nv)
        for i, j in self._moving:
            joint = self._tree.joints[i]
            at = self._model.joints[j].idx_v
            for c in range(joint.kind.nv):
                index[at + c] = self._tree.v_index[i] + c
                factor[at + c] = joint.mimic.multiplier if joint.mimic else 1.0
        return index, factor

    def configurations(self, q: FloatArray) -> FloatArray:
        if not self._otherwise:
            return np.array(q)
        full = np.zeros((len(q), self._model.nq))
        q_at = {i: self._model.joints[j].idx_q for i, j in self._moving}
        for i, block in pinocchio_blocks(self._tree, q, mimic=False):
            full[:, q_at[i] : q_at[i] + block.shape[-1]] = block
        return full

    def rates(self, v: FloatArray) -> FloatArray:
        if not self._tree.nv:
            return np.zeros((len(v), self._model.nv))
        full: FloatArray = v[:, self._rate_index] * self._rate_factor
        return full

    def couple(self, full: FloatArray) -> FloatArray:
        """J_full G: columns of followers are added to their leaders'."""
        if self._alike:
            return full
        own = full[..., self._v_base :] * self._rate_factor[self._v_base :]
        index = self._rate_index[self._v_base :]
        if len(index) == self._tree.nv and np.array_equal(index, np.arange(len(index))):
            return np.ascontiguousarray(own)
        coupled = np.zeros((*full.shape[:-1], self._tree.nv))
        for column, at in enumerate(index):
            coupled[..., at] += own[..., column]
        return coupled
