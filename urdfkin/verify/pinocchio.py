"""The oracle Pinocchio.

Only this module and `urdfkin.verify.adapters` import Pinocchio. On PyPI, Pinocchio has the name `pin`. The
PyPI project `pinocchio` contains plugins for the test runner nose, in a module that is also called
`pinocchio`. If both projects are installed, Python imports the plugins.

The oracle shares no code with urdfkin's computation. Pinocchio reads the URDF text with its own parser.

Pinocchio's model is built without mimic joints, because Pinocchio 4.1 rejects four of its own example robots
with mimic joints. Pinocchio's vectors and Jacobians therefore contain numbers for the mimic joints. Their
names have the suffix "full". The mimic rules define a matrix G and a vector g_0 for the conversion:

    q_full = G q + g_0
    v_full = G v
    J = J_full G
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
from urdfkin.system.processes import call_with_stack
from urdfkin.verify.oracle import (
    Oracle,
    PinocchioLayout,
    QueryBatch,
    find_locked_values,
    free_flyer_acceleration,
    free_flyer_q,
    free_flyer_velocity,
    make_pinocchio_frames,
    read_mimic_rules,
)

#: urdfkin's tests confirm Pinocchio's definitions of accelerations and J-dot only for this major version.
_MAJOR = "4"
_REQUIREMENT = "'pin>=4,<5'"


def pinocchio() -> Any:
    """Import a supported version of Pinocchio."""
    try:
        import pinocchio as module
    except ImportError as error:
        if error.name == "pinocchio":
            raise InstallationError(
                "Pinocchio is not installed", remedy=f"pip install {_REQUIREMENT}"
            ) from None
        raise InstallationError(
            "Pinocchio cannot be imported",
            found=str(error),
            remedy=f"pip install --force-reinstall {_REQUIREMENT}",
        ) from error
    if not hasattr(module, "buildModelFromXML"):
        raise _make_wrong_module_error(module)
    if not str(module.__version__).startswith(f"{_MAJOR}."):
        raise InstallationError(
            f"urdfkin needs Pinocchio {_MAJOR} for its checks",
            where=str(module.__file__),
            found=str(module.__version__),
            remedy=f"pip install {_REQUIREMENT}",
        )
    return module


def version() -> str:
    try:
        return str(pinocchio().__version__)
    except InstallationError:
        return "not installed"


def _make_wrong_module_error(module: Any) -> InstallationError:
    file = module.__file__ or next(iter(module.__path__), "a folder without modules")
    project = _find_project(Path(file))
    repair = f"pip uninstall {project[0]}" if project else f"rename or remove {file}"
    found = (
        f"{project[0]} {project[1]}, another project"
        if project
        else "a file that belongs to no installed package"
    )
    return InstallationError(
        "the installed module `pinocchio` is not the robotics library Pinocchio",
        where=str(file),
        found=found,
        remedy=f"Pinocchio's package is called pin: {repair}; pip install {_REQUIREMENT}",
        question=QuestionsSection.WRONG_PINOCCHIO,
    )


def _find_project(file: Path) -> tuple[str, str] | None:
    from importlib import metadata

    for project in metadata.distributions():
        for member in project.files or ():
            if member.name == file.name and Path(str(project.locate_file(member))) == file:
                return project.metadata["Name"], project.version
    return None


#: Bytes of stack for each link. The parser of Pinocchio 4.1.0 needs less than 4 kB per link.
_STACK_BYTES_PER_LINK = 16_384
#: Pinocchio reads chains with fewer joints without a stack overflow, in any thread.
_SAFE_DEPTH = 100
#: Maximum nv of a robot, including mimic joints. Pinocchio 4.1.0 needs about 64 nv^3 bytes (measured), which
#: is 2 GB at this limit.
MAX_NV = 315

#: Number of doubles in a block of results. A block of this size (128 kB) fits into the processor's cache.
_FLOATS_PER_BLOCK = 16384
#: A function of n that returns the results for the next n configurations.
_NextResults = Callable[[int], list[FloatArray]]
_BASE_NAME = "base"

#: Prefix of link names during `buildReducedModel`. XML forbids U+0001, so no URDF name has this prefix.
_LINK_PREFIX = "\x01"


def build_model(
    text: str,
    tree: KinematicTree,
    root_joint: str | None = None,
    *,
    mimic: bool = False,
    lock: Mapping[str, float] = MappingProxyType({}),
    lock_mimic_joints: bool = True,
) -> Any:
    """Build Pinocchio's model of a URDF text.

    A limit on nv and a large stack prevent a crash of the process. `lock` contains the values of locked
    joints, rad or m. With `lock_mimic_joints`, the mimic joints of locked joints are locked too.

    Raises:
        OracleError: nv is above `MAX_NV`, Pinocchio rejects the text, or a joint to lock does not exist.
    """
    rates = sum(joint.kind.nv for joint in tree.joints)
    if rates > MAX_NV:
        raise OracleError(
            f"too many joint velocities for Pinocchio: its memory grows with nv^3; the limit is {MAX_NV}",
            where=tree.name,
            found=f"nv = {rates}, which needs {64e-9 * rates**3:.0f} GB",
        )
    depth = tree_depth(tree)
    if depth < _SAFE_DEPTH:
        model = _parse_model(text, tree, root_joint, mimic)
    else:
        model = call_with_stack(
            depth * _STACK_BYTES_PER_LINK, lambda: _parse_model(text, tree, root_joint, mimic)
        )
    return _reduce_model(model, text, lock, lock_mimic_joints=lock_mimic_joints) if lock else model


def _reduce_model(model: Any, text: str, lock: Mapping[str, float], *, lock_mimic_joints: bool) -> Any:
    pin, q = pinocchio(), pinocchio().neutral(model)
    rules = read_mimic_rules(text, list(model.names)[1:], str(model.name)) if lock_mimic_joints else {}
    locked = find_locked_values(lock, rules)
    ids = [int(model.getJointId(name)) for name in locked]
    for i, (name, value) in zip(ids, locked.items(), strict=True):
        if i >= model.njoints:
            raise OracleError(
                "Pinocchio's model does not contain the joint to lock",
                where=str(model.name),
                found=repr(name),
            )
        # With mimic=True, a mimic joint has nq = 0.
        at, numbers = model.joints[i].idx_q, model.joints[i].nq
        q[at : at + numbers] = (value,) if numbers == 1 else (np.cos(value), np.sin(value))[:numbers]
    # `buildReducedModel` confuses a link with a joint of the same name, so link names get a prefix.
    bodies = [frame for frame in model.frames if frame.type == pin.FrameType.BODY]
    for frame in bodies:
        frame.name = _LINK_PREFIX + frame.name
    try:
        reduced = pin.buildReducedModel(model, ids, q)
    except (ValueError, RuntimeError) as error:
        raise OracleError(
            "Pinocchio cannot lock joints of this robot",
            where=str(model.name),
            found=str(error).strip(),
            remedy="try mimic=False",
        ) from error
    for frame in reduced.frames:
        frame.name = frame.name.removeprefix(_LINK_PREFIX)
    return reduced


def _parse_model(text: str, tree: KinematicTree, root_joint: str | None, mimic: bool) -> Any:
    pin = pinocchio()
    roots = {"floating": pin.JointModelFreeFlyer, "planar": pin.JointModelPlanar}
    try:
        if root_joint is not None:
            return pin.buildModelFromXML(text, roots[root_joint](), mimic=mimic)
        return pin.buildModelFromXML(text, mimic=mimic)
    except (ValueError, RuntimeError) as error:
        # urdfkin has already checked the text for all known causes, so the cause of this error is unknown.
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
        self._model = build_model(text, tree, self.root_joint, lock=self.lock, lock_mimic_joints=self.mimic)
        names = list(self._model.names)[1:]
        self._frames = make_pinocchio_frames(self._model, pin, includes_world=self.root_joint is not None)
        joints, self._index = list(range(1, len(names) + 1)), list(range(self._model.nframes))
        if self.moving_base:
            joints, self._index = self._add_free_flyer(joints)
        self._layout = PinocchioLayout(self._model, joints, names, self.read_and_check_rules(names))
        self._joint_ids = dict(zip(names, joints, strict=True))
        self.new_data = self._model.createData

    def _add_free_flyer(self, joints: Sequence[int]) -> tuple[list[int], list[int]]:
        """Add a free-flyer as the base. Return the new indices of joints and frames."""
        pin, model, identity = self._pin, self._model, self._pin.SE3.Identity()
        # `appendModel` rejects links with the name of a joint, so all joints and frames get unique names.
        for j in joints:
            model.names[j] = f"joint {j}"
        for i in range(1, model.nframes):
            model.frames[i].name = str(i)
        free_flyer_model = pin.Model()
        joint = free_flyer_model.addJoint(0, pin.JointModelFreeFlyer(), identity, _BASE_NAME)
        base = free_flyer_model.addFrame(pin.Frame(_BASE_NAME, joint, 0, identity, pin.FrameType.BODY))
        self._model = pin.appendModel(free_flyer_model, model, base, identity)
        frames = {frame.name: i for i, frame in enumerate(self._model.frames)}
        return (
            [int(self._model.getJointId(f"joint {j}")) for j in joints],
            [base, *(frames[str(i)] for i in range(1, model.nframes))],
        )

    def _find_ids(self, x: QueryBatch) -> list[int]:
        if x.frames_are_joints:
            return [self._joint_ids[name.partition(":")[2]] for name in x.frames]
        return [self._index[self._frames.find_index(name)] for name in x.frames]

    def _convert_reference(self, reference: Reference | str) -> Any:
        name = reference.name if isinstance(reference, Reference) else str(reference).upper()
        return self._pin.ReferenceFrame.names[name]

    def _convert_inputs(self, x: QueryBatch, input_count: int) -> tuple[FloatArray, ...]:
        q, *v_and_a = x.inputs[:input_count]
        full = [self._layout.convert_q(q), *map(self._layout.convert_rates, v_and_a)]
        if self.moving_base:
            full[0][:, :7] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0) if x.base is None else free_flyer_q(x.base)
        if self.moving_base and x.base is not None:
            for rates, convert_base in zip(
                full[1:], (free_flyer_velocity, free_flyer_acceleration), strict=False
            ):
                rates[:, :6] = convert_base(x.base)
        return tuple(full)

    # -- quantities ----------------------------------------------------------------------------------

    def placements(self, x: QueryBatch) -> FloatArray:
        pin = self._pin
        return self._collect_results(
            (4, 4),
            self._convert_inputs(x, 1),
            pin.forwardKinematics,
            lambda *which: pin.updateFramePlacement(*which).homogeneous,
            self._find_ids(x),
        )

    def velocities(self, x: QueryBatch) -> FloatArray:
        return self._six_vectors(x, 2, self._pin.getFrameVelocity)

    def accelerations(self, x: QueryBatch) -> FloatArray:
        return self._six_vectors(x, 3, self._pin.getFrameClassicalAcceleration)

    def _six_vectors(self, x: QueryBatch, input_count: int, get: Callable[..., Any]) -> FloatArray:
        return self._collect_results(
            (6,),
            self._convert_inputs(x, input_count),
            self._pin.forwardKinematics,
            lambda *arguments: get(*arguments).vector,
            self._find_ids(x),
            self._convert_reference(x.reference),
        )

    def jacobians(self, x: QueryBatch) -> FloatArray:
        pin = self._pin
        if len(x.frames) == 1 and not (x.frames_are_joints or x.uses_multi_frame_functions):
            shape = len(x.inputs[0]), 1, 6, self._model.nv
            return self._layout.couple(_stack_results(self._frame_jacobians(x), *shape))
        get = pin.getJointJacobian if x.frames_are_joints else pin.getFrameJacobian
        return self._compute_columns(x, 1, pin.computeJointJacobians, get)

    def jacobian_blocks(self, x: QueryBatch) -> Iterator[FloatArray]:
        if len(x.frames) != 1 or x.frames_are_joints or x.uses_multi_frame_functions or not self._model.nv:
            yield self.jacobians(x)
            return
        memory = np.empty((min(len(x.q), _block_length(6, self._model.nv)), 1, 6, self._model.nv))
        for block in _blocks(self._frame_jacobians(x), len(x.q), memory):
            yield self._layout.couple(block)

    def _frame_jacobians(self, x: QueryBatch) -> _NextResults:
        (frame,), reference = self._find_ids(x), self._convert_reference(x.reference)
        jacobians = self._map_configurations(
            self._pin.computeFrameJacobian, self._convert_inputs(x, 1), frame, reference
        )
        return lambda n: list(islice(jacobians, n))

    def jacobian_rates(self, x: QueryBatch) -> FloatArray:
        pin = self._pin
        get = pin.getJointJacobianTimeVariation if x.frames_are_joints else pin.getFrameJacobianTimeVariation
        return self._compute_columns(x, 2, pin.computeJointJacobiansTimeVariation, get)

    def _compute_columns(
        self, x: QueryBatch, input_count: int, compute: Callable[..., object], get: Callable[..., FloatArray]
    ) -> FloatArray:
        inputs, ids, reference = (
            self._convert_inputs(x, input_count),
            self._find_ids(x),
            self._convert_reference(x.reference),
        )
        return self._layout.couple(
            self._collect_results((6, self._model.nv), inputs, compute, get, ids, reference)
        )

    def hessians(self, x: QueryBatch) -> FloatArray:
        """Return Pinocchio's Hessians, with two errors of Pinocchio 4.1 corrected.

        - Pinocchio's array has C order, but the numbers have Eigen's order, in which the first index varies
          fastest.
        - In LOCAL, Pinocchio's derivative of a joint's column by the same joint's coordinates can be nonzero.
          The true derivative is 0, because a joint's motion does not change the joint's own columns in the
          frame's axes.
        """
        pin, model, data = self._pin, self._model, self.data
        ids, reference, nv = self._find_ids(x), self._convert_reference(x.reference), model.nv
        out = np.zeros((len(x.q), len(ids), 6, nv, nv))
        moving = [(f, i) for f, i in enumerate(ids) if nv and model.frames[i].parentJoint]
        for to, q_k in zip(out, *self._convert_inputs(x, 1), strict=True):
            pin.computeJointJacobians(model, data, q_k)
            pin.computeJointKinematicHessians(model, data)
            for f, frame in moving:
                numbers = pin.getFrameKinematicHessian(model, data, frame, reference).ravel("K")
                to[f] = numbers.reshape(nv, nv, 6).T
        if reference == pin.LOCAL:
            for joint in model.joints[1:]:
                columns = slice(joint.idx_v, joint.idx_v + joint.nv)
                out[..., columns, columns] = 0.0
        coupled_j = self._layout.couple(out)
        return self._layout.couple(coupled_j.swapaxes(-1, -2)).swapaxes(-1, -2)

    def screws(self, x: QueryBatch) -> FloatArray:
        """Return the joint Jacobian (n, 6, columns) in WORLD, with mimic joints and without the base."""
        columns, model = self._layout.rate_columns, self._model
        out = np.empty((len(x.q), 6, len(columns)))
        # Pinocchio 4.1 crashes for a Jacobian without columns, and returns a vector for one column.
        for k, q_k in enumerate(self._convert_inputs(x, 1)[0] if columns else ()):
            J = self._pin.computeJointJacobians(model, self.data, q_k)
            out[k] = J.reshape(6, model.nv)[:, columns]
        return out

    def _map_configurations(
        self, function: Callable[..., Any], inputs: Sequence[FloatArray], *others: object
    ) -> Iterator[Any]:
        return map(function, repeat(self._model), repeat(self.data), *inputs, *map(repeat, others))

    def _collect_results(
        self,
        shape: tuple[int, ...],
        inputs: tuple[FloatArray, ...],
        compute: Callable[..., object],
        get: Callable[..., FloatArray],
        ids: Sequence[int],
        *reference: Any,
    ) -> FloatArray:
        """Return results (n, ids, *shape)."""
        model, data, steps = self._model, self.data, self._map_configurations(compute, inputs)
        return _stack_results(
            lambda n: [get(model, data, one, *reference) for _ in islice(steps, n) for one in ids],
            *(len(inputs[0]), len(ids), *shape),
        )


def _stack_results(compute: _NextResults, *shape: int) -> FloatArray:
    out = np.empty(shape)
    for _ in _blocks(compute, shape[0], out):
        pass
    return out


def _blocks(compute: _NextResults, n: int, memory: FloatArray) -> Iterator[FloatArray]:
    """Yield results in blocks of `memory`. Later blocks may overwrite earlier blocks."""
    # Pinocchio 4.1 crashes the process for a Jacobian without columns.
    if 0 in memory.shape:
        yield memory
        return
    step, rows_of_one = _block_length(*memory.shape[1:]), memory.shape[1] * memory.shape[2]
    # For one column, Pinocchio 4.1 returns a vector.
    rows = memory.reshape(-1, *(size for size in memory.shape[3:] if size > 1))
    for first in range(0, n, step):
        start = first % memory.shape[0]
        end = start + min(step, n - first)
        np.concatenate(compute(end - start), out=rows[start * rows_of_one : end * rows_of_one])
        yield memory[start:end]


def _block_length(*shape: int) -> int:
    return _FLOATS_PER_BLOCK // (math.prod(shape) or 1) or 1


def tree_depth(tree: KinematicTree) -> int:
    """Return the number of joints on the longest path."""
    depths = [0]
    for joint in tree.joints:
        depths.append(depths[joint.parent] + 1)
    return max(depths)
