"""Everything that asks Pinocchio.

The oracle reads the URDF text itself, with its own parser, so that nothing of urdfkin's reading is shared.
Nor is anything between a user's arguments and the result: which frame a name means
(`urdfkin.verify.pinocchio_inputs`), which number of q is whose (`urdfkin.verify.pinocchio_inputs`), how the
base moves (`urdfkin.verify.pinocchio_inputs`) are all found here anew, from Pinocchio's model and the numbers
as they were given.

Its model is built without mimic joints (with them, Pinocchio 4.1 refuses four of the robots it ships with);
followers are coupled by the rules as `urdfkin.verify.pinocchio_inputs` reads them from the text once more:
q_full = G q + g_0, v_full = G v, J = J_full G.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
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
    rules_of_text,
)
from urdfkin.verify.pinocchio_module import pinocchio, version

__all__ = ["MOST_RATES", "Oracle", "OracleError", "depth_of", "version"]

#: Pinocchio recurses over links: less than 4 kB of stack for each was measured (4.1.0), room for more.
_STACK_FOR_A_LINK = 16_384
#: A chain shorter than this fits any stack.
_SHALLOW = 100
#: Pinocchio's workspace takes about 64 bytes times the cube of the rates (4.1.0 measured): at most 2 GB.
MOST_RATES = 315

#: Names that an error lists at most.
_NAMED = 5
#: What carries a robot whose base moves.
_BASE = "base"


def build_model(text: str, tree: KinematicTree, root_joint: str | None = None, *, mimic: bool = False) -> Any:
    """Pinocchio's model of a text; what would end the process, for want of memory or stack, never happens.

    Args:
        text: The URDF.
        tree: urdfkin's reading of it, for its size.
        root_joint: `"floating"` or `"planar"` to stand it on such a joint.
        mimic: Whether followers follow in the model.

    Raises:
        OracleError: Pinocchio does not accept the text.
        InstallationError: Pinocchio is missing, or another project goes by its name.
    """
    rates = sum(joint.kind.nv for joint in tree.joints)
    if rates > MOST_RATES:
        raise OracleError(
            f"Pinocchio's memory grows with the cube of the rates; urdfkin asks it up to {MOST_RATES}",
            where=tree.name,
            found=f"{rates}, which would take {64e-9 * rates**3:.0f} GB",
        )
    depth = depth_of(tree)
    if depth < _SHALLOW:
        return _parse(text, tree, root_joint, mimic)
    return with_stack(depth * _STACK_FOR_A_LINK, lambda: _parse(text, tree, root_joint, mimic))


def _parse(text: str, tree: KinematicTree, root_joint: str | None, mimic: bool) -> Any:
    pin = pinocchio()
    roots = {"floating": pin.JointModelFreeFlyer, "planar": pin.JointModelPlanar}
    try:
        if root_joint is not None:
            return pin.buildModelFromXML(text, roots[root_joint](), mimic=mimic)
        return pin.buildModelFromXML(text, mimic=mimic)
    except (ValueError, RuntimeError) as error:
        # What `check` knows to be refused is not asked about: this, it has overlooked.
        raise OracleError(
            "Pinocchio does not accept this robot",
            where=tree.name,
            found=str(error).strip(),
            remedy="with mimic=False it may"
            if mimic
            else "`urdfkin check` knows no reason: please report this as its error, with the URDF",
        ) from error


class Oracle:
    """Pinocchio's answers for one robot, in urdfkin's layout of q, v and Jacobian columns.

    Every method takes flat batches (n, nq), (n, nv) and frames by name, as the user gave them.

    Args:
        text: The URDF, as Pinocchio is to read it.
        tree: urdfkin's reading of the same text: it must have the same joints in the same order, the same
            ones following; nothing is taken from it.
        mimic: Whether followers follow; False: the user wants them free.
        moving_base: Build the model on a free-flyer, so that a base's motion can be given.
        root_joint: `"floating"` or `"planar"` when the tree was hung from such a joint, which the text does
            not know. The names alone do not tell: a file may use them itself.

    Raises:
        OracleError: Pinocchio does not accept the text, or finds other joints in it.
        InstallationError: Pinocchio is missing, or another project goes by its name.
    """

    def __init__(
        self,
        text: str,
        tree: KinematicTree,
        *,
        mimic: bool = True,
        moving_base: bool = False,
        root_joint: str | None = None,
    ) -> None:
        self._pin = pin = pinocchio()
        self._tree = tree
        self._moving_base = moving_base
        self._model = build_model(text, tree, root_joint)
        names = list(self._model.names)[1:]
        self._frames = Frames(self._model, pin, stands_on_world=root_joint is not None)
        joints, self._index = list(range(1, len(names) + 1)), list(range(self._model.nframes))
        if moving_base:
            joints, self._index = self._put_on_free_flyer(joints)
        rules = self._rules(text, names) if mimic else {}
        self._layout = Layout(self._model, joints, names, rules)
        demand_the_same("Pinocchio", tree, names, self._layout.coordinates)
        self._local = threading.local()

    def _rules(self, text: str, joints: Sequence[str]) -> dict[str, Mimic]:
        """The text's own mimic rules; urdfkin's reading of them is under test too."""
        try:
            return rules_of_text(text, set(joints))
        except (ValueError, ExpatError) as error:
            raise OracleError(
                "the mimic rules read differently", where=self._tree.name, found=str(error)
            ) from error

    def _put_on_free_flyer(self, joints: Sequence[int]) -> tuple[list[int], list[int]]:
        """Have the model carried by a joint that can be given the base's motion; a root joint moves on top.

        Returns:
            Where its joints and its frames have gone to; the world has gone to the base.
        """
        pin, model, nowhere = self._pin, self._model, self._pin.SE3.Identity()
        # Numbers for names: a link may be called as a joint, or as the carrier, and appendModel refuses both.
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
        """Pinocchio's workspace; each thread has its own."""
        if not hasattr(self._local, "data"):
            self._local.data = self._model.createData()
        return self._local.data

    def _ids(self, frames: Sequence[str]) -> list[int]:
        """Pinocchio's indices of frames."""
        return [self._index[self._frames.index(name)] for name in frames]

    def _reference(self, reference: Reference | str) -> Any:
        """Pinocchio's own member of that name."""
        name = reference.name if isinstance(reference, Reference) else str(reference).upper()
        return self._pin.ReferenceFrame.names[name]

    # -- quantities ----------------------------------------------------------------------------------

    def placements(self, q: FloatArray, frames: Sequence[str], base: BaseNumbers | None = None) -> FloatArray:
        """(n, frames, 4, 4) T_world_frame: `updateFramePlacements`."""
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
        reference: Reference | str,
        base: BaseNumbers | None = None,
    ) -> FloatArray:
        """(n, frames, 6): `getFrameVelocity`."""
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
        """(n, frames, 6): `getFrameClassicalAcceleration`."""
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
        """(n, frames, 6, nv): `computeJointJacobians`, then `getFrameJacobian`."""
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
        """(n, frames, 6, nv): `getFrameJacobianTimeVariation`."""
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
        """(n, frames, 6, nv, nv): `computeJointKinematicHessians`, then `getFrameKinematicHessian`.

        Two things in Pinocchio 4.1 are put right. Python is handed the numbers in Eigen's order, first index
        fastest, in an array that calls them NumPy's. And in LOCAL, columns of one joint are said to change
        each other where another joint comes before it; they do not: what a joint moves moves the frame too.
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
        """(n, joints, 6, nv): `getJointJacobian` of a run of the moving joints, in the tree's order."""
        pin, inputs, joints = self._pin, (self.configurations(q),), self._layout.joint_ids[among]
        compute, get = pin.computeJointJacobians, pin.getJointJacobian
        return self._layout.couple(self._collected(inputs, compute, get, joints, reference))

    def joint_jacobian_rates(
        self, q: FloatArray, v: FloatArray, among: slice, reference: Reference | str
    ) -> FloatArray:
        """(n, joints, 6, nv): `getJointJacobianTimeVariation`, likewise."""
        pin, joints = self._pin, self._layout.joint_ids[among]
        inputs = self.configurations(q), self.rates(v)
        compute, get = pin.computeJointJacobiansTimeVariation, pin.getJointJacobianTimeVariation
        return self._layout.couple(self._collected(inputs, compute, get, joints, reference))

    def screws(self, q: FloatArray) -> FloatArray:
        """(n, 6, rates): the whole `data.J` of `computeJointJacobians`, one column a rate, followers too."""
        columns, model = self._layout.rate_columns, self._model
        out = np.empty((len(q), 6, len(columns)))
        # Without rates Pinocchio 4.1 kills the process; of one rate it hands out a plain vector.
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
        """(n, ids, ...): `compute` for each of the inputs, then `get` for each frame or joint.

        A tight loop for one frame: what it takes beyond Pinocchio's own time is the price of a check.
        """
        model, data, n, wanted = self._model, self._data, len(inputs[0]), self._reference(reference)
        own = (6, model.nv) if compute is not self._pin.forwardKinematics else (6,)
        out = np.empty((n, len(ids), *own))
        if not all(own):  # Pinocchio 4.1 kills the process when asked for a Jacobian without columns
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
        """Pinocchio's configurations for urdfkin's, with the base as a free-flyer where there is one."""
        full = self._layout.configurations(q)
        if self._moving_base:
            full[:, :7] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0) if base is None else free_flyer(base)
        return full

    def rates(self, v: FloatArray, base: BaseNumbers | None = None) -> FloatArray:
        """Pinocchio's rates; a free-flyer's are those of the base in its own axes."""
        full = self._layout.rates(v)
        if self._moving_base and base is not None:
            full[:, :6] = free_flyer_rates(base)
        return full

    def second_rates(self, a: FloatArray, base: BaseNumbers | None = None) -> FloatArray:
        """Rates of the rates; a free-flyer's are spatial, in its own axes."""
        full = self._layout.rates(a)
        if self._moving_base and base is not None:
            full[:, :6] = free_flyer_second_rates(base)
        return full


def demand_the_same(
    oracle: str, tree: KinematicTree, joints: Sequence[str], coordinates: Sequence[str]
) -> None:
    """Names, order and who has coordinates: where these differ, a q does not mean the same to the two.

    Raises:
        OracleError: they do.
    """
    for what, theirs, own in (
        ("joints", joints, [joint.name for joint in tree.joints if joint.kind.nv]),
        ("coordinates", coordinates, [joint.name for joint in tree.joints if joint.nv]),
    ):
        if list(theirs) != own:
            found = ", ".join(sorted(set(theirs) ^ set(own))[:_NAMED]) or "the same in another order"
            raise OracleError(f"{oracle} finds other {what} in this robot", where=tree.name, found=found)


def depth_of(tree: KinematicTree) -> int:
    """How many joints lie one behind the other, at most."""
    depths = [0]
    for joint in tree.joints:
        depths.append(depths[joint.parent] + 1)
    return max(depths)
