"""The contenders: urdfkin, Pinocchio, code generated for one robot, and other installed libraries."""

import multiprocessing
import os
import shutil
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from importlib import metadata, util
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pinocchio as pin

from scripts.benchmarking import generated
from scripts.benchmarking.timing import Calls, TimedTask
from scripts.benchmarking.workload import Workload, bare_urdf
from urdfkin.compiled.plan import StepField
from urdfkin.kinematics.arithmetic import bind_equations
from urdfkin.model.tree import FloatArray

ONE = "urdfkin, 1 thread"
FRESH = "urdfkin, 1 thread, no out="
FLOOR = "output written once (fill)"
PROCESSORS = len(os.sched_getaffinity(0))
COMPILED = "urdfkin, compiled for this robot, 1 thread"
SEVERAL = f"urdfkin, {PROCESSORS} threads"
LOOP = "Pinocchio, Python loop"
PROCESSES = f"Pinocchio, {PROCESSORS} processes"


@dataclass(frozen=True)
class Contender:
    library: str
    module: str
    calls: Callable[[Workload, str], Iterator[Calls]] | None = None
    #: Function that yields the timed tasks for batches. Without this function, the benchmark calls the
    #: library once for each configuration.
    batches: Callable[[Workload, str], Iterator[TimedTask]] | None = None
    program: str | None = None  # The library needs this program.

    @property
    def reason_missing(self) -> str | None:
        if util.find_spec(self.module) is None:
            return "not installed"
        if self.program and shutil.which(self.program) is None:
            return f"left out, no {self.program}"
        return None

    @property
    def version(self) -> str:
        try:
            return self.reason_missing or metadata.version(self.library)
        except metadata.PackageNotFoundError:
            return "a checkout"

    def make_tasks(self, workload: Workload, quantity: str) -> list[TimedTask]:
        if self.reason_missing:
            return []
        if self.batches is not None:
            return list(self.batches(workload, quantity))
        return [one.make_batch_task(workload, quantity) for one in self.make_single_calls(workload, quantity)]

    def make_single_calls(self, workload: Workload, quantity: str) -> list[Calls]:
        return [] if self.reason_missing or self.calls is None else list(self.calls(workload, quantity))


def urdfkin_tasks(workload: Workload, quantity: str) -> Iterator[TimedTask]:
    method, n = getattr(workload.robot, quantity), workload.n
    inputs = workload.inputs(quantity, n)
    out, own, floor = np.empty((3, n, *workload.result_shape(quantity)))
    last: list[FloatArray] = []

    def fresh() -> None:
        last[:] = [method(*inputs, workload.frame, threads=1, verify=False)]

    for threads in sorted({1, PROCESSORS}):
        into = partial(method, *inputs, workload.frame, out=out, threads=threads, verify=False)
        yield TimedTask(ONE if threads == 1 else SEVERAL, n, into, lambda: out)
    yield TimedTask(FRESH, n, fresh, lambda: last[0])
    fast = getattr(workload.robot.compile(workload.frame), quantity)
    yield TimedTask(COMPILED, n, partial(fast, *inputs, out=own, threads=1), lambda: own)
    yield TimedTask(FLOOR, n, partial(floor.fill, 1.0))


def urdfkin_calls(workload: Workload, quantity: str, *, verify: bool = False) -> Iterator[Calls]:
    robot, frame = workload.robot, workload.frame
    names = {"robot": robot, "frame": frame, "out": np.empty(workload.result_shape(quantity))}
    names["prepared"] = robot.prepare(frame, verify=verify)
    call = f"{quantity}({'q' if quantity == 'jacobian' else 'q, v, a'}"
    lines = {
        f"robot.{quantity}(verify={verify})": f"robot.{call}, frame, verify={verify})",
        f"prepared.{quantity}()": f"prepared.{call})",
    }
    if not verify:
        names["compiled"] = robot.compile(frame)
        lines |= {
            f"{label}.{quantity}(out=)": f"{label}.{call}, out=out)" for label in ("prepared", "compiled")
        }
    for shown, line in lines.items():
        yield Calls(f"urdfkin, {shown}", names, (line,))


def pinocchio_calls(urdf: str, frame: str, quantity: str) -> Calls:
    model = pin.buildModelFromXML(urdf)
    names = {
        "model": model,
        "data": model.createData(),
        "frame": model.getFrameId(frame),
        "aligned": pin.LOCAL_WORLD_ALIGNED,
        "jacobian": pin.computeFrameJacobian,
        "forward": pin.forwardKinematics,
        "acceleration": pin.getFrameClassicalAcceleration,
    }
    if quantity == "jacobian":
        return Calls(LOOP, names, ("jacobian(model, data, q, frame, aligned)",))
    forward, get = "forward(model, data, q, v, a)", "acceleration(model, data, frame, aligned)"
    store = (forward, f"out[k] = {get}.vector")
    return Calls(LOOP, names, (forward, get), store, read_one=lambda motion: np.array(motion.vector))


def all_joints_calls(workload: Workload) -> Calls:
    usual = pinocchio_calls(workload.urdf, workload.frame, "jacobian")
    names = {**usual.names, "compute": pin.computeJointJacobians, "get": pin.getFrameJacobian}
    return Calls(LOOP, names, ("compute(model, data, q)", "get(model, data, frame, aligned)"))


_worker_state: dict[str, Any] = {}


def pinocchio_tasks(workload: Workload, quantity: str) -> Iterator[TimedTask]:
    yield pinocchio_calls(workload.urdf, workload.frame, quantity).make_batch_task(workload, quantity)
    spawn: Any = multiprocessing.get_context("spawn")
    buffers, arrays = [], []
    for x in (
        *workload.inputs(quantity, workload.n),
        np.zeros((workload.n, *workload.result_shape(quantity))),
    ):
        buffers.append((spawn.RawArray("d", x.size), x.shape))
        arrays.append(_view_array(*buffers[-1]))
        arrays[-1][...] = x
    pool = workload.stack.enter_context(
        ProcessPoolExecutor(
            PROCESSORS, spawn, _start_worker, (workload.urdf, workload.frame, quantity, buffers)
        )
    )
    edges = [workload.n * i // PROCESSORS for i in range(PROCESSORS + 1)]
    yield TimedTask(
        PROCESSES, workload.n, lambda: list(pool.map(_compute_part, edges, edges[1:])), lambda: arrays[-1]
    )


def _view_array(buffer: Any, shape: Sequence[int]) -> FloatArray:
    return np.frombuffer(buffer).reshape(shape)


def _start_worker(
    urdf: str, frame: str, quantity: str, buffers: Sequence[tuple[Any, tuple[int, ...]]]
) -> None:
    _worker_state["loop"] = pinocchio_calls(urdf, frame, quantity).make_loop()
    _worker_state["arrays"] = [_view_array(*buffer) for buffer in buffers]


def _compute_part(start: int, stop: int) -> None:
    *inputs, out = (x[start:stop] for x in _worker_state["arrays"])
    _worker_state["loop"](out, *inputs)


# Some libraries order rows or coordinates differently. Times exclude the reordering of inputs and results.

#: Row order that converts [angular; linear] to [linear; angular].
LINEAR_FIRST = [3, 4, 5, 0, 1, 2]


def find_indices(ours: Sequence[str], theirs: Sequence[str]) -> list[int]:
    """Return the index in `ours` of each name in `theirs`."""
    index = {name: i for i, name in enumerate(ours)}
    return [index[name] for name in theirs]


def fill_columns(J: FloatArray, columns: Sequence[int], nv: int) -> FloatArray:
    """Move column k of `J` to column `columns[k]`; the other columns are 0."""
    full = np.zeros((*J.shape[:-1], nv))
    full[..., list(columns)] = J
    return full


def dynibo(workload: Workload, quantity: str) -> Iterator[Calls]:
    """Yield the calls of dynibo.

    dynibo stores a Jacobian column by column, with rows [angular; linear] and joints in breadth-first order.
    """
    import dynibo

    robot = dynibo.Robot.from_urdf(str(workload.file))
    nv, order = workload.nv, find_indices(workload.robot.joint_names, breadth_first_joints(workload.urdf))
    back = np.argsort(order)

    def read(flat: FloatArray) -> FloatArray:
        return flat.reshape(-1, nv, 6).transpose(0, 2, 1)[:, LINEAR_FIRST][..., back]

    names = {"robot": robot, "frame": robot.link_id(workload.frame), "buffer": np.empty(6 * nv)}
    if quantity == "jacobian":
        lines, into = (f"robot.jacobian(q, frame, out={out})" for out in ("buffer", "out[k]"))
        yield Calls("dynibo, loop", names, (lines,), (into,), order, (6 * nv,), read)
        return
    line = "robot.forward_acceleration_kinematics(q, v, a, frame)"
    store = (f"x = {line}", "out[k, :3] = x.linear", "out[k, 3:] = x.angular")
    yield Calls(
        "dynibo, loop", names, (line,), store, order, read_one=lambda x: np.array([*x.linear, *x.angular])
    )


def breadth_first_joints(urdf: str) -> list[str]:
    joints = ET.fromstring(urdf).findall("joint")
    ends = [(_link(joint, "parent"), _link(joint, "child")) for joint in joints]
    links = sorted({parent for parent, _ in ends} - {child for _, child in ends})
    names = []
    for link in links:  # The loop appends the child links to `links`.
        for joint, (parent, child) in zip(joints, ends, strict=True):
            if parent == link:
                links.append(child)
                names += [joint.attrib["name"]] * (joint.get("type") != "fixed")
    return names


def _link(joint: ET.Element, tag: str) -> str:
    return next(joint.iter(tag)).attrib["link"]


def mujoco(workload: Workload, quantity: str) -> Iterator[Calls]:
    import mujoco

    flags = {"fusestatic": "false", "discardvisual": "true"}
    model = mujoco.MjModel.from_xml_string(bare_urdf(workload.urdf, flags=flags))
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    theirs = [model.joint(i).name for i in range(model.njnt)]
    order = find_indices(workload.robot.joint_names, theirs)
    x, back = np.empty(workload.result_shape(quantity)), np.argsort(order)
    names = {
        **{name: getattr(mujoco, f"mj_{name}") for name in ("kinematics", "comPos", "comVel", "jacBody")},
        **{"rne": mujoco.mj_rnePostConstraint, "get": mujoco.mj_objectAcceleration},
        **{"m": model, "d": data, "qpos": data.qpos, "qvel": data.qvel, "qacc": data.qacc},
        **{"body": model.body(workload.frame).id, "kind": mujoco.mjtObj.mjOBJ_XBODY},
        **{"x": x, "linear": x[:3], "angular": x[3:]},
    }
    position_lines = ("qpos[:] = q", "kinematics(m, d)", "comPos(m, d)")
    motion_lines = (*position_lines, "qvel[:] = v", "qacc[:] = a", "comVel(m, d)", "rne(m, d)")
    lines, store, read = {
        "jacobian": (
            (*position_lines, "jacBody(m, d, linear, angular, body)", "x"),
            (*position_lines, "jacBody(m, d, out[k, :3], out[k, 3:], body)"),
            lambda x: x[..., back],
        ),
        "acceleration": (
            (*motion_lines, "get(m, d, kind, body, x, 0)", "x"),
            (*motion_lines, "get(m, d, kind, body, out[k], 0)"),
            lambda x: x[..., LINEAR_FIRST],
        ),
    }[quantity]
    yield Calls("MuJoCo, loop", names, lines, store, order, read=read)


def drake(workload: Workload, quantity: str) -> Iterator[Calls]:
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import JacobianWrtVariable

    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(workload.urdf, "urdf")
    joints = ET.fromstring(workload.urdf).findall("joint")
    (root,) = {_link(x, "parent") for x in joints} - {_link(x, "child") for x in joints}
    world = plant.world_frame()
    plant.WeldFrames(world, plant.GetFrameByName(root))
    plant.Finalize()
    starts = [plant.GetJointByName(name).velocity_start() for name in workload.robot.joint_names]
    frame = plant.GetFrameByName(workload.frame)
    names = {
        "plant": plant,
        "context": plant.CreateDefaultContext(),
        "tip": (JacobianWrtVariable.kV, frame, np.zeros(3), world, world),
        "place": plant.SetPositions,
        "move": plant.SetVelocities,
        "jacobian": plant.CalcJacobianSpatialVelocity,
        "bias": plant.CalcBiasSpatialAcceleration,
    }
    lines: tuple[str, ...] = ("place(context, q)", "jacobian(context, *tip)")
    if quantity == "acceleration":
        total = f"{lines[1]} @ a + bias(context, *tip).get_coeffs()"
        lines = (lines[0], "move(context, v)", total)
    yield Calls(
        "Drake, loop",
        names,
        lines,
        order=[int(i) for i in np.argsort(starts)],
        read=lambda x: x[:, LINEAR_FIRST] if x.ndim == 2 else x[:, LINEAR_FIRST][..., starts],
    )


def toolbox(workload: Workload, quantity: str) -> Iterator[Calls]:
    import roboticstoolbox as rtb

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Hide a warning: the toolbox's URDF reader is deprecated.
        robot: Any = rtb.Robot.URDF(str(workload.file))
    path = robot.ets(end=workload.frame)
    moving = sorted((link for link in robot.links if link.jindex is not None), key=lambda x: x.jindex)
    order = find_indices(workload.robot.joint_names, [link._joint_name for link in moving])
    columns = [int(i) for i in path.jindices]
    names = {"path": path, "tensordot": np.tensordot, "columns": np.array(columns)}
    label, remark = "Robotics Toolbox, loop", "computes only the columns of the path's joints"
    if quantity == "jacobian":
        ours, shape = [order[i] for i in columns], (6, len(columns))

        def read(J: FloatArray) -> FloatArray:
            return fill_columns(J, ours, workload.nv)

        yield Calls(label, names, ("path.jacob0(q)",), None, order, shape, read, remark=remark)
        return
    lines = (
        "J = path.jacob0(q)",
        "v = v[columns]",
        "J @ a[columns] + tensordot(path.hessian0(q, J0=J), v, (0, 0)) @ v",
    )
    yield Calls(label, names, lines, order=order, remark=remark)


#: Maximum batch size for PyTorch Kinematics, because the time per configuration grows for larger batches.
_MAX_BATCH = 20_000
#: Tolerance for PyTorch Kinematics, which reads the angles of a URDF in single precision.
_SINGLE_TOLERANCE = 1e-6


def torch(workload: Workload, quantity: str) -> Iterator[TimedTask]:
    """Yield Jacobians with and without `torch.compile`.

    PyTorch Kinematics has no function for accelerations.
    """
    import pytorch_kinematics as pk
    import torch

    if quantity != "jacobian":
        return
    chain = pk.build_serial_chain_from_urdf(workload.urdf, workload.frame).to(dtype=torch.float64)
    columns = find_indices(workload.robot.joint_names, chain.get_joint_parameter_names())
    n = min(workload.n, _MAX_BATCH)
    q = torch.from_numpy(np.ascontiguousarray(workload.q[:n, columns]))
    remark = (
        "computes only the columns of the path's joints; reads angles with seven digits; uses all processors"
    )

    def make_task(label: str, jacobian: Callable[[Any], Any]) -> TimedTask:
        def result() -> FloatArray:
            return fill_columns(jacobian(q).numpy(), columns, workload.nv)

        return TimedTask(label, n, lambda: jacobian(q), result, _SINGLE_TOLERANCE, remark)

    yield make_task("PyTorch Kinematics", chain.jacobian)
    if shutil.which("g++"):  # `torch.compile` needs a C++ compiler.
        yield make_task("PyTorch Kinematics, compiled", torch.compile(chain.jacobian_tensor))


def jax(workload: Workload, quantity: str) -> Iterator[TimedTask]:
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)  # All contenders compute in float64.
    array, plan = jnp.asarray, workload.plan
    eq = bind_equations(
        plus=lambda x, y: array(x) + array(y),
        minus=lambda x, y: array(x) - array(y),
        times=lambda c, x: c * array(x),
        cross=lambda x, y: jnp.cross(array(x), array(y)),
        rotate=lambda R, x: array(R) @ array(x),
        transposed=lambda R: array(R).T,
        product=lambda R, S: array(R) @ array(S),
    )
    places_q, places_v = plan.steps[:, StepField.Q], plan.steps[:, StepField.V]

    def compute(q: Any, *rates: Any) -> Any:
        x = q[places_q]
        v, a = (u[places_v] for u in rates or (jnp.zeros(plan.nv),) * 2)
        numbers = generated.frame_results(plan, quantity, x, jnp.sin(x), jnp.cos(x), v, a, eq)
        return jnp.stack([array(number, float) for number in numbers]).reshape(
            workload.result_shape(quantity)
        )

    compiled = jax.jit(jax.vmap(compute))
    inputs = [array(x) for x in workload.inputs(quantity, workload.n)]
    yield TimedTask(
        "JAX, vmap and jit",
        workload.n,
        lambda: compiled(*inputs).block_until_ready(),
        lambda: np.asarray(compiled(*inputs)),
        remark="uses all processors and JAX's own arrays",
    )


ALWAYS = (
    Contender("urdfkin", "urdfkin", urdfkin_calls, urdfkin_tasks),
    Contender(
        "pin",
        "pinocchio",
        lambda workload, quantity: iter([pinocchio_calls(workload.urdf, workload.frame, quantity)]),
        pinocchio_tasks,
    ),
)
PEERS = (
    Contender("casadi", "casadi", batches=generated.generated_tasks, program=generated.COMPILER),
    Contender("dynibo", "dynibo", dynibo),
    Contender("mujoco", "mujoco", mujoco),
    Contender("drake", "pydrake", drake),
    Contender("roboticstoolbox-python", "roboticstoolbox", toolbox),
    Contender("pytorch-kinematics", "pytorch_kinematics", batches=torch),
    Contender("jax", "jax", batches=jax),
)
