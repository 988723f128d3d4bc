"""The oracle Pinocchio.

No other module but `urdfkin.verify.adapters` imports Pinocchio. On PyPI, Pinocchio has the name `pin`. The
PyPI project `pinocchio` is a different one: plugins for the test runner nose, in a module that is also called
`pinocchio`. If both projects are installed, Python finds the module of the plugins first.

The oracle shares no code with urdfkin's computation. The oracle reads the URDF text with Pinocchio's own
parser. `urdfkin.verify.oracle` converts the user's original arguments a second time. That module finds frames
and joints by their names in Pinocchio's model, and it converts the base's motion.

Pinocchio's model is built without mimic joints, because Pinocchio 4.1 with mimic joints refuses four of the
robots in its own examples. `urdfkin.verify.oracle` reads the mimic rules from the text a second time. The
rules define a matrix G and a vector g_0, with q_full = G q + g_0, v_full = G v and J = J_full G. The name
"full" marks Pinocchio's vectors, which contain numbers for the mimic joints too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice, repeat
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from urdfkin.errors import InstallationError, OracleError, QuestionsSection
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, KinematicTree
from urdfkin.system.processes import with_stack
from urdfkin.verify.oracle import (
    Oracle,
    PinocchioLayout,
    QueryBatch,
    frames_of,
    free_flyer,
    free_flyer_rates,
    free_flyer_second_rates,
    locked_by_rules,
    mimic_rules,
)

#: The definitions of accelerations and J-dot were tested with these versions.
_MAJOR = "4"
_WANTED = "'pin>=4,<5'"


def pinocchio() -> Any:
    """Return the module of Pinocchio.

    Raises:
        InstallationError: Pinocchio is not installed, has an unsupported version, or is a different project
            of the same name.
    """
    try:
        import pinocchio as found
    except ImportError as error:
        if error.name == "pinocchio":
            raise InstallationError("Pinocchio is not installed", remedy=f"pip install {_WANTED}") from None
        raise InstallationError(
            "Pinocchio cannot be imported",
            found=str(error),
            remedy=f"pip install --force-reinstall {_WANTED}",
        ) from error
    if not hasattr(found, "buildModelFromXML"):
        raise _impostor(found)
    if not str(found.__version__).startswith(f"{_MAJOR}."):
        raise InstallationError(
            f"urdfkin needs Pinocchio {_MAJOR} for its checks",
            where=str(found.__file__),
            found=str(found.__version__),
            remedy=f"pip install {_WANTED}",
        )
    return found


def version() -> str:
    """Return the version of Pinocchio; "not installed" if no supported version is installed."""
    try:
        return str(pinocchio().__version__)
    except InstallationError:
        return "not installed"


def _impostor(found: Any) -> InstallationError:
    file = found.__file__ or next(iter(found.__path__), "a folder without modules")
    owner = _owner(Path(file))
    cure = f"pip uninstall {owner[0]}" if owner else f"rename or remove {file}"
    what = f"{owner[0]} {owner[1]}, another project" if owner else "a file of no installed package"
    return InstallationError(
        "the module `pinocchio` is not Pinocchio, the library that checks results",
        where=str(file),
        found=what,
        remedy=f"Pinocchio's package is called pin: {cure}; pip install {_WANTED}",
        question=QuestionsSection.WRONG_PINOCCHIO,
    )


def _owner(file: Path) -> tuple[str, str] | None:
    """Return the name and the version of the installed project that contains a file."""
    from importlib import metadata

    for project in metadata.distributions():
        for one in project.files or ():
            if one.name == file.name and Path(str(project.locate_file(one))) == file:
                return project.metadata["Name"], project.version
    return None


#: Bytes of stack for each link.
#: Pinocchio processes links recursively; version 4.1.0 needs less than 4 kB for each link.
_STACK_FOR_A_LINK = 16_384
#: A chain of fewer links fits into any stack.
_SHALLOW = 100
#: Largest nv that is accepted.
#: Pinocchio 4.1.0 needs about 64 bytes * nv^3 (measured), so the memory stays below 2 GB.
MOST_RATES = 315

#: Number of floating-point values that are collected and then copied to one array.
#: This number of values fits into the processor's cache.
_AT_A_TIME = 16384
#: Function that returns the results for the given number of next configurations.
_Next = Callable[[int], list[FloatArray]]
#: Name of the free-flyer of a moving base.
_BASE = "base"

#: Prefix of link names while Pinocchio reduces a model.
_LINK_MARK = "\x01"


def build_model(
    text: str,
    tree: KinematicTree,
    root_joint: str | None = None,
    *,
    mimic: bool = False,
    lock: Mapping[str, float] = MappingProxyType({}),
    coupled: bool = True,
) -> Any:
    """Return Pinocchio's model of a URDF text, whose size urdfkin's tree gives.

    A robot that needs too much memory is rejected. A robot with a long chain of links is parsed with a larger
    stack. Otherwise such robots would crash the process.

    Args:
        text: The URDF text.
        tree: urdfkin's tree of the text.
        root_joint: "floating" or "planar" to connect the root to the world by such a joint.
        mimic: True: the mimic joints move by their mimic rules. False: they are independent joints.
        lock: Value (rad or m) of each locked joint, which `buildReducedModel` removes from the model.
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
        # With mimic=True, a mimic joint has nq = 0.
        at, numbers = model.joints[i].idx_q, model.joints[i].nq
        q[at : at + numbers] = (value,) if numbers == 1 else (np.cos(value), np.sin(value))[:numbers]
    # `buildReducedModel` finds frames by their names only, but a link may have the same name as a joint.
    # The prefix of the link names, which no XML text can contain, avoids this error.
    bodies = [frame for frame in model.frames if frame.type == pin.FrameType.BODY]
    for frame in bodies:
        frame.name = _LINK_MARK + frame.name
    reduced = pin.buildReducedModel(model, ids, q)
    for frame in reduced.frames:
        frame.name = frame.name.removeprefix(_LINK_MARK)
    return reduced


def _parse(text: str, tree: KinematicTree, root_joint: str | None, mimic: bool) -> Any:
    pin = pinocchio()
    roots = {"floating": pin.JointModelFreeFlyer, "planar": pin.JointModelPlanar}
    try:
        if root_joint is not None:
            return pin.buildModelFromXML(text, roots[root_joint](), mimic=mimic)
        return pin.buildModelFromXML(text, mimic=mimic)
    except (ValueError, RuntimeError) as error:
        # The reason is unknown: `check` raises an error for each known one.
        raise OracleError(
            "Pinocchio does not accept this robot",
            where=tree.name,
            found=str(error).strip(),
            remedy="try mimic=False"
            if mimic
            else "`urdfkin check` found no reason: please report this as an error of urdfkin, with the URDF",
        ) from error


class PinocchioOracle(Oracle):
    title = "Pinocchio"

    def __init__(self, text: str, tree: KinematicTree, **how: Any) -> None:
        super().__init__(text, tree, **how)
        self._pin = pin = pinocchio()
        self._model = build_model(text, tree, self.root_joint, lock=self.lock, coupled=self.mimic)
        names = list(self._model.names)[1:]
        self._frames = frames_of(self._model, pin, stands_on_world=self.root_joint is not None)
        joints, self._index = list(range(1, len(names) + 1)), list(range(self._model.nframes))
        if self.moving_base:
            joints, self._index = self._put_on_free_flyer(joints)
        self._layout = PinocchioLayout(self._model, joints, names, self.rules(names))
        self._joint_ids = dict(zip(names, joints, strict=True))
        self.new_data = self._model.createData

    def _put_on_free_flyer(self, joints: Sequence[int]) -> tuple[list[int], list[int]]:
        """Add a free-flyer for the base's motion; return the new indices of the joints and of the frames.

        An existing root joint is kept. The frame of the world becomes the frame of the base.
        """
        pin, model, nowhere = self._pin, self._model, self._pin.SE3.Identity()
        # appendModel rejects a link with the name of a joint or of the free-flyer.
        # Numbers as names avoid this error.
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

    def _ids(self, x: QueryBatch) -> list[int]:
        if x.joints:
            return [self._joint_ids[name.partition(":")[2]] for name in x.frames]
        return [self._index[self._frames.index(name)] for name in x.frames]

    def _reference(self, reference: Reference | str) -> Any:
        name = reference.name if isinstance(reference, Reference) else str(reference).upper()
        return self._pin.ReferenceFrame.names[name]

    def _inputs(self, x: QueryBatch, count: int) -> tuple[FloatArray, ...]:
        """Convert the first `count` of urdfkin's inputs q, v and a to Pinocchio's vectors.

        Velocities and spatial accelerations of the free-flyer of a moving base are in the base's own axes.
        """
        q, *rates = x.inputs[:count]
        full = [self._layout.configurations(q), *map(self._layout.rates, rates)]
        if self.moving_base:
            full[0][:, :7] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0) if x.base is None else free_flyer(x.base)
        if self.moving_base and x.base is not None:
            for own, of in zip(full[1:], (free_flyer_rates, free_flyer_second_rates), strict=False):
                own[:, :6] = of(x.base)
        return tuple(full)

    # -- quantities ----------------------------------------------------------------------------------

    def placements(self, x: QueryBatch) -> FloatArray:
        """Return T_world_frame (n, frames, 4, 4) by `updateFramePlacement`."""
        pin = self._pin
        return self._collected(
            (4, 4),
            self._inputs(x, 1),
            pin.forwardKinematics,
            lambda *which: pin.updateFramePlacement(*which).homogeneous,
            self._ids(x),
        )

    def velocities(self, x: QueryBatch) -> FloatArray:
        """Return velocities (n, frames, 6) by `getFrameVelocity`."""
        return self._six(x, 2, self._pin.getFrameVelocity)

    def accelerations(self, x: QueryBatch) -> FloatArray:
        """Return classical accelerations (n, frames, 6) by `getFrameClassicalAcceleration`."""
        return self._six(x, 3, self._pin.getFrameClassicalAcceleration)

    def _six(self, x: QueryBatch, count: int, get: Callable[..., Any]) -> FloatArray:
        model, data, ids, wanted = self._model, self.data, self._ids(x), self._reference(x.reference)
        steps = self._each(self._pin.forwardKinematics, self._inputs(x, count))
        return _stacked(
            lambda n: [get(model, data, one, wanted).vector for _ in islice(steps, n) for one in ids],
            *(len(x.q), len(ids), 6),
        )

    def jacobians(self, x: QueryBatch) -> FloatArray:
        """Return Jacobians (n, frames, 6, nv).

        `computeFrameJacobian` computes the Jacobian of a single frame, from the joints on its path only.
        `getFrameJacobian` computes the Jacobians of several frames. `getJointJacobian` computes the Jacobians
        of joints.
        """
        pin = self._pin
        if len(x.frames) == 1 and not (x.joints or x.divided):
            shape = len(x.inputs[0]), 1, 6, self._model.nv
            return self._layout.couple(_stacked(self._frame_jacobians(x), *shape))
        get = pin.getJointJacobian if x.joints else pin.getFrameJacobian
        return self._columns(x, 1, pin.computeJointJacobians, get)

    def jacobian_blocks(self, x: QueryBatch) -> Iterator[FloatArray]:
        """Yield the Jacobians; for one frame, in blocks of configurations that fit into the cache."""
        if len(x.frames) != 1 or x.joints or x.divided or not self._model.nv:
            yield self.jacobians(x)
            return
        memory = np.empty((min(len(x.q), _block(6, self._model.nv)), 1, 6, self._model.nv))
        for block in _blocks(self._frame_jacobians(x), len(x.q), memory):
            yield self._layout.couple(block)

    def _frame_jacobians(self, x: QueryBatch) -> _Next:
        (one,), wanted = self._ids(x), self._reference(x.reference)
        found = self._each(self._pin.computeFrameJacobian, self._inputs(x, 1), one, wanted)
        return lambda n: list(islice(found, n))

    def jacobian_rates(self, x: QueryBatch) -> FloatArray:
        """Return J-dot (n, frames, 6, nv) by Pinocchio's functions for frames or for joints."""
        pin = self._pin
        get = pin.getJointJacobianTimeVariation if x.joints else pin.getFrameJacobianTimeVariation
        return self._columns(x, 2, pin.computeJointJacobiansTimeVariation, get)

    def _columns(
        self, x: QueryBatch, count: int, compute: Callable[..., object], get: Callable[..., FloatArray]
    ) -> FloatArray:
        inputs, ids, wanted = self._inputs(x, count), self._ids(x), self._reference(x.reference)
        return self._layout.couple(self._collected((6, self._model.nv), inputs, compute, get, ids, wanted))

    def hessians(self, x: QueryBatch) -> FloatArray:
        """Return Hessians (n, frames, 6, nv, nv) by `getFrameKinematicHessian`.

        Two errors of Pinocchio 4.1 are corrected:

        - Pinocchio returns the numbers in Eigen's order (the first index varies fastest), but in a NumPy
          array with C order (the last index varies fastest).
        - In LOCAL, entries [i, j] with i and j of the same joint are not 0 if another joint precedes this
          joint. The true value of these entries is 0, because the joint does not move its own axes relative
          to the frame.
        """
        pin, model, data = self._pin, self._model, self.data
        ids, wanted, nv = self._ids(x), self._reference(x.reference), model.nv
        out = np.zeros((len(x.q), len(ids), 6, nv, nv))
        carried = [(f, i) for f, i in enumerate(ids) if nv and model.frames[i].parentJoint]
        for to, q_k in zip(out, *self._inputs(x, 1), strict=True):
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

    def screws(self, x: QueryBatch) -> FloatArray:
        """Return `data.J` of `computeJointJacobians` (n, 6, columns), mimic joints included."""
        columns, model = self._layout.rate_columns, self._model
        out = np.empty((len(x.q), 6, len(columns)))
        # Pinocchio 4.1 crashes the process if nv is 0, and returns a vector if nv is 1.
        for k, q_k in enumerate(self._inputs(x, 1)[0] if columns else ()):
            J = self._pin.computeJointJacobians(model, self.data, q_k)
            out[k] = J.reshape(6, model.nv)[:, columns]
        return out

    def _each(
        self, function: Callable[..., Any], inputs: Sequence[FloatArray], *others: object
    ) -> Iterator[Any]:
        return map(function, repeat(self._model), repeat(self.data), *inputs, *map(repeat, others))

    def _collected(
        self,
        own: tuple[int, ...],
        inputs: tuple[FloatArray, ...],
        compute: Callable[..., object],
        get: Callable[..., FloatArray],
        ids: Sequence[int],
        *reference: Any,
    ) -> FloatArray:
        """Return results (n, ids, *own): call `compute` for each configuration, then `get` for each id."""
        model, data, steps = self._model, self.data, self._each(compute, inputs)
        return _stacked(
            lambda n: [get(model, data, one, *reference) for _ in islice(steps, n) for one in ids],
            *(len(inputs[0]), len(ids), *own),
        )


def _stacked(compute: _Next, *shape: int) -> FloatArray:
    """Return all results of `compute` in one array of the given shape (n, frames, ...)."""
    out = np.empty(shape)
    for _ in _blocks(compute, shape[0], out):
        pass
    return out


def _blocks(compute: _Next, n: int, memory: FloatArray) -> Iterator[FloatArray]:
    """Write the results of n configurations to `memory` in blocks. Yield the array of each block.

    If the results contain no numbers, nothing is computed. Pinocchio 4.1 crashes the process for a Jacobian
    without columns, and returns a vector for one column. The array `memory` has the shape (rows, frames,
    ...). An array of n rows finally contains all results. In a smaller array, each block overwrites the block
    before it.
    """
    if 0 in memory.shape:
        yield memory
        return
    step, of_one = _block(*memory.shape[1:]), memory.shape[1] * memory.shape[2]
    rows = memory.reshape(-1, *(size for size in memory.shape[3:] if size > 1))
    for first in range(0, n, step):
        at = first % memory.shape[0]
        end = at + (step if first + step < n else n - first)
        np.concatenate(compute(end - at), out=rows[at * of_one : end * of_one])
        yield memory[at:end]


def _block(*shape: int) -> int:
    """Return the number of configurations whose results are collected and then copied together."""
    return _AT_A_TIME // (math.prod(shape) or 1) or 1


def depth_of(tree: KinematicTree) -> int:
    """Return the largest number of joints on a path from the root."""
    depths = [0]
    for joint in tree.joints:
        depths.append(depths[joint.parent] + 1)
    return max(depths)
