"""Each library's own forward kinematics, velocity and Jacobian, in its own convention."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import SubElement, tostring

import numpy as np
import pytest

from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.urdf.plain_xml import plain_xml

#: Returns T (4, 4), the velocity (6,) and the Jacobian (6, nv) of a link, rows and columns as in the library.
Evaluate = Callable[[FloatArray, FloatArray, str], tuple[FloatArray, FloatArray, FloatArray]]


@dataclass(frozen=True)
class Library:
    """A robot in a library: the names of its moving joints in the library's order, and its functions."""

    names: list[str]
    evaluate: Evaluate
    #: Largest difference to urdfkin: of double precision, and of single precision for Newton.
    tolerance: float = 2e-12


def bare(text: str) -> str:
    """Return a URDF without meshes, in which every link has a mass and every joint has limits."""
    root = plain_xml(text)
    for child in list(root):
        if child.tag not in ("link", "joint"):
            root.remove(child)
    known = ("parent", "child", "origin", "axis", "limit", "mimic")
    for joint in root.iterfind("joint"):
        for part in list(joint):
            if part.tag not in known or (part.tag == "mimic" and joint.get("type") == "fixed"):
                joint.remove(part)
    for element in root.iter():  # MuJoCo and Drake take a link "world" for the world
        for attribute in ("link", "name") if element.tag in ("link", "parent") else ():
            if element.get(attribute) == "world":
                element.set(attribute, "root")
    for link in root.iterfind("link"):
        for part in list(link):
            if part.tag != "inertial" or float(part.find("mass").get("value", "0")) <= 0:  # type: ignore[union-attr]
                link.remove(part)
        old = link.find("inertial")
        origin = None if old is None else old.find("origin")
        if old is not None:
            link.remove(old)
        inertial = SubElement(link, "inertial")
        SubElement(inertial, "origin", {"xyz": "0 0 0" if origin is None else origin.get("xyz", "0 0 0")})
        SubElement(inertial, "mass", value="1")
        names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        SubElement(inertial, "inertia", {k: "1" if k[1] == k[2] else "0" for k in names})
    return tostring(root, encoding="unicode")


def _root(robot: Robot) -> str:
    """Return the name of the root link in the bare text."""
    name = robot.link_names[int(robot.root_joint is not None)]
    return "root" if name == "world" else name


def mujoco(robot: Robot, folder: Path) -> Library:
    mj = pytest.importorskip("mujoco")
    root = plain_xml(bare(robot.urdf))
    options = {"fusestatic": "false", "boundmass": "1e-6", "boundinertia": "1e-9"}
    SubElement(SubElement(root, "mujoco"), "compiler", options)
    spec = mj.MjSpec.from_string(tostring(root, encoding="unicode"))
    free = robot.root_joint == "floating"
    if free:
        spec.body(_root(robot)).add_freejoint(name="root_joint")
    model = spec.compile()
    data = mj.MjData(model)

    def evaluate(q: FloatArray, v: FloatArray, link: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        data.qpos[:], data.qvel[:] = q, v
        mj.mj_fwdPosition(model, data)
        body, T = model.body(link).id, np.eye(4)
        T[:3, :3], T[:3, 3] = data.xmat[body].reshape(3, 3), data.xpos[body]
        linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mj.mj_jac(model, data, linear, angular, data.xpos[body], body)
        J = np.vstack((linear, angular))
        return T, J @ v, J

    return Library([model.joint(i).name for i in range(model.njnt)], evaluate)


def drake(robot: Robot, folder: Path) -> Library:
    pytest.importorskip("pydrake")
    from pydrake.multibody.parsing import Parser  # noqa: PLC0415
    from pydrake.multibody.plant import MultibodyPlant  # noqa: PLC0415
    from pydrake.multibody.tree import JacobianWrtVariable  # noqa: PLC0415

    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(bare(robot.urdf), "urdf")
    world = plant.world_frame()
    if robot.root_joint is None:
        plant.WeldFrames(world, plant.GetFrameByName(_root(robot)))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
    joints = sorted((j for j in joints if j.num_velocities()), key=lambda j: j.velocity_start())
    names = [j.name() for j in joints]
    if robot.root_joint:
        names[0] = "root_joint"

    def evaluate(q: FloatArray, v: FloatArray, link: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        frame = plant.GetFrameByName(link)
        T = frame.CalcPoseInWorld(context).GetAsMatrix4()
        twist = frame.CalcSpatialVelocityInWorld(context).get_coeffs()
        by = JacobianWrtVariable.kV
        J = plant.CalcJacobianSpatialVelocity(context, by, frame, np.zeros(3), world, world)
        return T, twist, J

    return Library(names, evaluate)


def idyntree(robot: Robot, folder: Path) -> Library:
    tree = pytest.importorskip("idyntree.bindings")
    loader = tree.ModelLoader()
    assert loader.loadModelFromString(bare(robot.urdf))
    model = loader.model()
    kin = tree.KinDynComputations()
    assert kin.loadRobotModel(model)
    kin.setFloatingBase(_root(robot))
    dofs = model.getNrOfDOFs()
    names = [model.getJointName(i) for i in range(dofs)]
    free = robot.root_joint is not None

    def evaluate(q: FloatArray, v: FloatArray, link: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        base, twist = np.eye(4), np.zeros(6)
        if free:
            rotation = tree.Rotation.RotationFromQuaternion(tree.Vector4.FromPython(list(q[3:7])))
            base[:3, :3], base[:3, 3], twist = rotation.toNumPy(), q[:3], v[:6]
        kin.setRobotState(base, q[len(q) - dofs :], twist, v[len(v) - dofs :], np.array([0, 0, -9.81]))
        T = kin.getWorldTransform(link).asHomogeneousTransform().toNumPy()
        matrix = tree.MatrixDynSize(6, 6 + dofs)
        assert kin.getFrameFreeFloatingJacobian(link, matrix)
        J = np.array(matrix.toNumPy())
        return T, kin.getFrameVel(link).toNumPy(), J if free else J[:, 6:]

    return Library(["root_joint"] * free + names, evaluate)


def rtb(robot: Robot, folder: Path) -> Library:
    pytest.importorskip("roboticstoolbox")
    from roboticstoolbox import Robot as Toolbox  # noqa: PLC0415

    file = folder / "robot.urdf"
    file.write_text(bare(robot.urdf))
    model = Toolbox.URDF(str(file.resolve()))
    links = sorted((link for link in model.links if link.isjoint), key=lambda link: link.jindex)

    def evaluate(q: FloatArray, v: FloatArray, link: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        own = np.zeros((6, model.n))
        J = model.jacob0(q, end=link)
        path, at = [], next(x for x in model.links if x.name == link)
        while at is not None:
            path += [at.jindex] if at.isjoint else []
            at = at.parent
        own[:, path[::-1]] = J
        return np.array(model.fkine(q, end=link).A), own @ v, own

    return Library([link._joint_name for link in links], evaluate)


def newton(robot: Robot, folder: Path) -> Library:
    sim = pytest.importorskip("newton")
    file = folder / "robot.urdf"
    file.write_text(bare(robot.urdf))
    builder = sim.ModelBuilder()
    free = robot.root_joint is not None
    builder.add_urdf(str(file), floating=free)
    model = builder.finalize(device="cpu")
    labels = [label.split("/")[-1] for label in builder.body_label]
    kinds = zip(builder.joint_label, builder.joint_type, strict=True)
    names = [name.split("/")[-1] for name, kind in kinds if int(kind) != int(sim.JointType.FIXED)]
    names = ["root_joint", *names[1:]] if free else names
    com = model.body_com.numpy().astype(float)

    def evaluate(q: FloatArray, v: FloatArray, link: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        state = model.state()
        state.joint_q.assign(q.astype(np.float32))
        body = labels.index(link)

        def twist(v: FloatArray) -> FloatArray:
            state.joint_qd.assign(v.astype(np.float32))
            sim.eval_fk(model, state.joint_q, state.joint_qd, state)
            six: FloatArray = state.body_qd.numpy()[body].astype(float)  # of the centre of mass
            R = _rotation(state.body_q.numpy()[body][3:].astype(float))
            six[:3] -= np.cross(six[3:], R @ com[body])
            return six

        found, T = twist(v), np.eye(4)
        pose = state.body_q.numpy()[body].astype(float)
        T[:3, :3], T[:3, 3] = _rotation(pose[3:]), pose[:3]
        return T, found, np.stack([twist(e) for e in np.eye(len(v))], axis=-1)

    return Library(names, evaluate, 2e-5)


def _rotation(xyzw: FloatArray) -> FloatArray:
    x, y, z, w = xyzw / np.linalg.norm(xyzw)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows)


def pinocchio(robot: Robot, folder: Path) -> Library:
    import pinocchio as pin  # noqa: PLC0415

    model: Any = robot.pinocchio_model()
    data = model.createData()

    def evaluate(q: FloatArray, v: FloatArray, link: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        frame, aligned = model.getFrameId(link, pin.FrameType.BODY), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        pin.forwardKinematics(model, data, q, v)
        pin.updateFramePlacements(model, data)
        J = pin.computeFrameJacobian(model, data, q, frame, aligned)
        return data.oMf[frame].homogeneous, pin.getFrameVelocity(model, data, frame, aligned).vector, J

    return Library(list(model.names)[1:], evaluate)


LIBRARIES = {
    "pinocchio": pinocchio,
    "mujoco": mujoco,
    "drake": drake,
    "idyntree": idyntree,
    "rtb": rtb,
    "newton": newton,
}
