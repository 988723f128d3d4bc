"""Call other libraries as their users call them; a library is imported only when it is needed.

If a library has another order of rows or coordinates, inputs and results are reordered outside the measured
time.
"""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from scripts.benchmarking import generated
from scripts.benchmarking.calls import Calls
from scripts.benchmarking.subject import Subject, bare_urdf
from scripts.benchmarking.timing import Work
from urdfkin.compiled.plan import Step
from urdfkin.kinematics.arithmetic import bound
from urdfkin.model.tree import FloatArray

#: Row order that converts [angular; linear] to [linear; angular].
LINEAR_FIRST = [3, 4, 5, 0, 1, 2]


def positions(ours: Sequence[str], theirs: Sequence[str]) -> list[int]:
    """Return, for each coordinate of a library, the index of the coordinate with the same name in urdfkin."""
    index = {name: i for i, name in enumerate(ours)}
    return [index[name] for name in theirs]


def spread(J: FloatArray, columns: Sequence[int], nv: int) -> FloatArray:
    """Return `J` (n, 6, m) as an array (n, 6, nv).

    The columns of `J` get the indices `columns`; all other columns are zero.
    """
    full = np.zeros((*J.shape[:-1], nv))
    full[..., list(columns)] = J
    return full


# -- called in a loop ------------------------------------------------------------------------------------


def dynibo(subject: Subject, quantity: str) -> Iterator[Calls]:
    """Yield the calls of dynibo, a library in Rust.

    In dynibo, rows are [angular; linear], joints are sorted breadth first, and matrices are stored column by
    column.
    """
    import dynibo  # noqa: PLC0415

    robot = dynibo.Robot.from_urdf(str(subject.file))
    nv, order = subject.nv, positions(subject.robot.joint_names, breadth_first(subject.urdf))
    back = np.argsort(order)

    def read(flat: FloatArray) -> FloatArray:
        return flat.reshape(-1, nv, 6).transpose(0, 2, 1)[:, LINEAR_FIRST][..., back]

    names = {"robot": robot, "frame": robot.link_id(subject.frame), "buffer": np.empty(6 * nv)}
    if quantity == "jacobian":
        lines = ("robot.jacobian(q, frame, out=buffer)",)
        into = ("robot.jacobian(q, frame, out=out[k])",)
        yield Calls("dynibo, loop", names, lines, into, order, (6 * nv,), read)
        return
    line = "robot.forward_acceleration_kinematics(q, v, a, frame)"
    yield Calls(
        "dynibo, loop",
        names,
        (line,),
        (f"x = {line}", "out[k, :3] = x.linear", "out[k, 3:] = x.angular"),
        order,
        read_one=lambda x: np.array([*x.linear, *x.angular]),
    )


def breadth_first(urdf: str) -> list[str]:
    """Return the moving joints in dynibo's order: breadth first, in the file's order."""
    joints = ET.fromstring(urdf).findall("joint")
    ends = [(_link(joint, "parent"), _link(joint, "child")) for joint in joints]
    links = sorted({parent for parent, _ in ends} - {child for _, child in ends})
    names = []
    for link in links:  # the loop appends to this list
        for joint, (parent, child) in zip(joints, ends, strict=True):
            if parent == link:
                links.append(child)
                names += [joint.attrib["name"]] * (joint.get("type") != "fixed")
    return names


def _link(joint: ET.Element, tag: str) -> str:
    return next(joint.iter(tag)).attrib["link"]


def mujoco(subject: Subject, quantity: str) -> Iterator[Calls]:
    """Yield the calls of MuJoCo.

    MuJoCo's accelerations are classical, with rows [angular; linear]. An option prevents MuJoCo from merging
    links that are fixed to each other.
    """
    import mujoco  # noqa: PLC0415

    flags = {"fusestatic": "false", "discardvisual": "true"}
    model = mujoco.MjModel.from_xml_string(bare_urdf(subject.urdf, flags=flags))
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    theirs = [model.joint(i).name for i in range(model.njnt)]
    order = positions(subject.robot.joint_names, theirs)
    x = np.empty(subject.width(quantity))
    names = {
        **{name: getattr(mujoco, f"mj_{name}") for name in ("kinematics", "comPos", "comVel", "jacBody")},
        **{"rne": mujoco.mj_rnePostConstraint, "get": mujoco.mj_objectAcceleration},
        **{"m": model, "d": data, "qpos": data.qpos, "qvel": data.qvel, "qacc": data.qacc},
        **{"body": model.body(subject.frame).id, "kind": mujoco.mjtObj.mjOBJ_XBODY},
        **{"x": x, "linear": x[:3], "angular": x[3:]},
    }
    back = np.argsort(order)
    yield Calls(
        "MuJoCo, loop",
        names,
        _mujoco_lines(quantity, "linear, angular", "x"),
        _mujoco_lines(quantity, "out[k, :3], out[k, 3:]", "out[k]")[:-1],
        order,
        read=lambda x: x[..., back] if quantity == "jacobian" else x[..., LINEAR_FIRST],
    )


def _mujoco_lines(quantity: str, rows: str, result: str) -> tuple[str, ...]:
    """Return the calls for one configuration, which write into arrays; the last line is the result."""
    place = ("qpos[:] = q", "kinematics(m, d)", "comPos(m, d)")
    if quantity == "jacobian":
        return (*place, f"jacBody(m, d, {rows}, body)", result)
    return (
        *place,
        "qvel[:] = v",
        "qacc[:] = a",
        "comVel(m, d)",
        "rne(m, d)",
        f"get(m, d, kind, body, {result}, 0)",
        result,
    )


def drake(subject: Subject, quantity: str) -> Iterator[Calls]:
    """Yield the calls of Drake.

    Drake's rows are [angular; linear]. An acceleration is J a plus the terms that depend only on velocities.
    """
    from pydrake.multibody.parsing import Parser  # noqa: PLC0415
    from pydrake.multibody.plant import MultibodyPlant  # noqa: PLC0415
    from pydrake.multibody.tree import JacobianWrtVariable  # noqa: PLC0415

    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(subject.urdf, "urdf")
    joints = ET.fromstring(subject.urdf).findall("joint")
    (root,) = {_link(x, "parent") for x in joints} - {_link(x, "child") for x in joints}
    world = plant.world_frame()
    plant.WeldFrames(world, plant.GetFrameByName(root))
    plant.Finalize()
    starts = [plant.GetJointByName(name).velocity_start() for name in subject.robot.joint_names]
    frame = plant.GetFrameByName(subject.frame)
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


def toolbox(subject: Subject, quantity: str) -> Iterator[Calls]:
    """Yield the calls of the Robotics Toolbox.

    The calls compute a Jacobian with `jacob0`, and an acceleration as J a + Jdot v.
    """
    import roboticstoolbox as rtb  # noqa: PLC0415

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the library warns that its URDF reader is deprecated
        robot: Any = rtb.Robot.URDF(str(subject.file))
    path = robot.ets(end=subject.frame)
    moving = sorted((link for link in robot.links if link.jindex is not None), key=lambda x: x.jindex)
    order = positions(subject.robot.joint_names, [link._joint_name for link in moving])
    columns = [int(i) for i in path.jindices]
    names = {"path": path, "tensordot": np.tensordot, "columns": np.array(columns)}
    who, remark = "Robotics Toolbox, loop", "computes the path's columns alone"
    if quantity == "jacobian":
        ours = [order[i] for i in columns]
        yield Calls(
            who,
            names,
            ("path.jacob0(q)",),
            order=order,
            shape=(6, len(columns)),
            read=lambda J: spread(J, ours, subject.nv),
            remark=remark,
        )
        return
    lines = (
        "J = path.jacob0(q)",
        "v = v[columns]",
        "J @ a[columns] + tensordot(path.hessian0(q, J0=J), v, (0, 0)) @ v",
    )
    yield Calls(who, names, lines, order=order, remark=remark)


# -- batches at once -------------------------------------------------------------------------------------

#: Number of configurations in one call of PyTorch Kinematics. Larger calls take more time per configuration.
_MOST = 20_000
#: Tolerance for PyTorch Kinematics, which reads the angles of a URDF in single precision.
_SINGLE = 1e-6


def torch(subject: Subject, quantity: str) -> Iterator[Work]:
    """Yield the computation by PyTorch Kinematics, once without and once with `torch.compile`.

    The library computes no accelerations.
    """
    import pytorch_kinematics as pk  # noqa: PLC0415
    import torch  # noqa: PLC0415

    if quantity != "jacobian":
        return
    chain = pk.build_serial_chain_from_urdf(subject.urdf, subject.frame).to(dtype=torch.float64)
    columns = positions(subject.robot.joint_names, chain.get_joint_parameter_names())
    n = min(subject.n, _MOST)
    q = torch.from_numpy(np.ascontiguousarray(subject.q[:n, columns]))
    remark = "the path's columns alone; its reader keeps seven digits of angles; all processors"

    def work(who: str, jacobian: Callable[[Any], Any]) -> Work:
        def result() -> FloatArray:
            return spread(jacobian(q).numpy(), columns, subject.nv)

        return Work(who, n, lambda: jacobian(q), result, _SINGLE, remark)

    yield work("PyTorch Kinematics", chain.jacobian)
    if shutil.which("g++"):  # torch.compile needs a C++ compiler
        yield work("PyTorch Kinematics, compiled", torch.compile(chain.jacobian_tensor))


def jax(subject: Subject, quantity: str) -> Iterator[Work]:
    """Yield the computation by JAX in float64.

    `vmap` and XLA turn code for one configuration into a compiled batch.

    This is typical fast code for one robot in JAX: the textbook's equations on JAX arrays, with the robot's
    constants folded in. Inputs and results are JAX arrays.
    """
    import jax  # noqa: PLC0415
    import jax.numpy as jnp  # noqa: PLC0415

    jax.config.update("jax_enable_x64", True)  # float64, as in all contenders
    array, plan = jnp.asarray, subject.plan
    eq = bound(
        plus=lambda x, y: array(x) + array(y),
        minus=lambda x, y: array(x) - array(y),
        times=lambda c, x: c * array(x),
        cross=lambda x, y: jnp.cross(array(x), array(y)),
        rotate=lambda R, x: array(R) @ array(x),
        transposed=lambda R: array(R).T,
        product=lambda R, S: array(R) @ array(S),
    )
    places_q, places_v = plan.steps[:, Step.Q], plan.steps[:, Step.V]

    def compute(q: Any, *rates: Any) -> Any:
        x = q[places_q]
        v, a = (u[places_v] for u in rates or (jnp.zeros(plan.nv),) * 2)
        numbers = generated.results(plan, quantity, x, jnp.sin(x), jnp.cos(x), v, a, eq)
        return jnp.stack([array(number, float) for number in numbers]).reshape(subject.width(quantity))

    compiled = jax.jit(jax.vmap(compute))
    inputs = [array(x) for x in subject.inputs(quantity, subject.n)]
    yield Work(
        "JAX, vmap and jit",
        subject.n,
        lambda: compiled(*inputs).block_until_ready(),
        lambda: np.asarray(compiled(*inputs)),
        remark="all processors; arrays are JAX's own",
    )
