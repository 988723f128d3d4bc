"""Each library's own forward kinematics, velocity and Jacobian, in its own convention.

The difference to urdfkin is bounded as between urdfkin and Pinocchio (`urdfkin.verify.bounds`), with the
library's own roundings for each joint and factor. Counted as in `urdfkin.kinematics.roundings`, in units of
eps = 2^-52 or, for single precision, 2^-23:

| Library | How it computes a joint | Roundings of both together |
|---|---|---|
| Pinocchio | a rotation matrix; constants by a quaternion | PINOCCHIO_ROUNDINGS |
| Drake, iDynTree | a rotation matrix; constants from roll, pitch, yaw, 3.1; rotation about any axis by
  Rodrigues' formula, 4.0; two products, 3.6 | 5.7 + 10.7, at most PINOCCHIO_ROUNDINGS |
| Robotics Toolbox | a product of 4 x 4 matrices: three elementary rotations for roll, pitch, yaw, and that of
  the joint: 1.8 each, with the sine and cosine 0.5 each | 5.7 + 9.2, at most PINOCCHIO_ROUNDINGS |
| MuJoCo | a unit quaternion | MUJOCO_ROUNDINGS |
| Newton | a unit quaternion of single precision, 21.5; rounding q up to 2 pi, 3.2, the origin, 0.5, and roll,
  pitch and yaw up to pi, 4.8, to single precision | SINGLE |

The bounds of a velocity and a Jacobian have additional factors:

| Library | Factors | Reason |
|---|---|---|
| all | 1 | the conversion rotates the velocity of the base |
| MuJoCo | 1 | moves velocities from the robot's centre of mass to the link |
| Newton | 1 | moves velocities from the link's centre of mass to the link |
| iDynTree | 1 | rotates velocities from the link's axes |

Lever arms in MuJoCo are longer by the distance of the robot's centre of mass. The lever arm of Newton's base
is longer by the distance of the base's centre of mass. Both distances are at most the distance of the
farthest centre of mass of a link.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import SubElement, tostring

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from urdfkin.kinematics.roundings import EPS, MUJOCO_ROUNDINGS, PINOCCHIO_ROUNDINGS
from urdfkin.model.conventions.convention import encode_usd_name
from urdfkin.model.tree import FloatArray, pose
from urdfkin.robot import Robot
from urdfkin.system.plain_xml import parse_xml

#: Roundings of Newton's single precision, derived above.
SINGLE = 30.0
SINGLE_EPS = 2.0**-23
#: Returns T (4, 4), the velocity (6,) and the Jacobian (6, nv) of a link, rows and columns as in the library.
Evaluate = Callable[[FloatArray, FloatArray, str], tuple[FloatArray, FloatArray, FloatArray]]


@dataclass(frozen=True)
class Library:
    """A robot in a library: the names of its moving joints in the library's order, and its functions."""

    names: list[str]
    evaluate: Evaluate
    #: Roundings for each joint and factor, of urdfkin and the library together, and their unit.
    roundings: float = PINOCCHIO_ROUNDINGS
    eps: float = EPS
    #: Factors of a velocity and a Jacobian beyond those of the comparison with Pinocchio.
    more: int = 1
    #: Whether lever arms begin at a centre of mass.
    at_mass: bool = False


def bare(text: str) -> str:
    """Return a URDF without meshes, in which every link has a mass of 1 kg.

    A link `world` is renamed to `root`. Joints contain only kinematic elements and limits.
    """
    root = parse_xml(text)
    for child in list(root):
        if child.tag not in ("link", "joint"):
            root.remove(child)
    known = ("parent", "child", "origin", "axis", "limit", "mimic")
    for joint in root.iterfind("joint"):
        for part in list(joint):
            if part.tag not in known or (part.tag == "mimic" and joint.get("type") == "fixed"):
                joint.remove(part)
    for element in root.iter():  # MuJoCo and Drake treat a link "world" as the world
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


def _bare_file(robot: Robot, folder: Path) -> Path:
    file = folder / "robot.urdf"
    file.write_text(bare(robot.urdf))
    return file


def _root(robot: Robot) -> str:
    name = robot.link_names[int(robot.root_joint is not None)]
    return "root" if name == "world" else name


def mujoco(robot: Robot, folder: Path) -> Library:
    mj = pytest.importorskip("mujoco")
    root = parse_xml(bare(robot.urdf))
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
        body = model.body(link).id
        T = pose(data.xmat[body].reshape(3, 3), data.xpos[body])
        linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mj.mj_jac(model, data, linear, angular, data.xpos[body], body)
        J = np.vstack((linear, angular))
        return T, J @ v, J

    names = [model.joint(i).name for i in range(model.njnt)]
    return Library(names, evaluate, roundings=MUJOCO_ROUNDINGS, more=2, at_mass=True)


def drake(robot: Robot, folder: Path) -> Library:
    pytest.importorskip("pydrake")
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import JacobianWrtVariable

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

    return Library(["root_joint"] * free + names, evaluate, more=2)


def rtb(robot: Robot, folder: Path) -> Library:
    pytest.importorskip("roboticstoolbox")
    from roboticstoolbox import Robot as Toolbox

    model = Toolbox.URDF(str(_bare_file(robot, folder).resolve()))
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
    builder = sim.ModelBuilder()
    builder.add_urdf(str(_bare_file(robot, folder)), floating=robot.root_joint is not None)
    return _of_newton(robot, builder)


def newton_usd(robot: Robot, folder: Path) -> Library:
    sim = pytest.importorskip("newton")
    builder = sim.ModelBuilder()
    builder.add_usd(_stage(robot, folder))
    return _of_newton(robot, builder, encode_usd_name)


def _of_newton(robot: Robot, builder: Any, spell_name: Callable[[str], str] = str) -> Library:
    import newton as sim

    model = builder.finalize(device="cpu")
    free = robot.root_joint is not None
    labels = [f"/{label}" for label in builder.body_label]
    kinds = zip(builder.joint_label, builder.joint_type, strict=True)
    names = [name.split("/")[-1] for name, kind in kinds if int(kind) != int(sim.JointType.FIXED)]
    names = ["root_joint", *names[1:]] if free else names
    com = model.body_com.numpy().astype(float)

    def evaluate(q: FloatArray, v: FloatArray, link: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        state = model.state()
        state.joint_q.assign(q.astype(np.float32))
        body = next(k for k, label in enumerate(labels) if label.endswith(f"/{spell_name(link)}"))

        def twist(v: FloatArray) -> FloatArray:
            state.joint_qd.assign(v.astype(np.float32))
            sim.eval_fk(model, state.joint_q, state.joint_qd, state)
            six: FloatArray = state.body_qd.numpy()[body].astype(float)  # of the centre of mass
            R = Rotation.from_quat(state.body_q.numpy()[body][3:].astype(float)).as_matrix()
            six[:3] -= np.cross(six[3:], R @ com[body])
            return six

        found, placed = twist(v), state.body_q.numpy()[body].astype(float)
        T = pose(Rotation.from_quat(placed[3:]).as_matrix(), placed[:3])
        return T, found, np.stack([twist(e) for e in np.eye(len(v))], axis=-1)

    return Library(names, evaluate, SINGLE, SINGLE_EPS, more=2, at_mass=True)


def _stage(robot: Robot, folder: Path) -> Any:
    """Return the stage of urdf-usd-converter; if the base is free, without its joint to the world."""
    converter = pytest.importorskip("urdf_usd_converter")
    from pxr import Usd

    converter = converter.Converter(layer_structure=False, scene=False)
    stage = Usd.Stage.Open(converter.convert(str(_bare_file(robot, folder)), str(folder / "usd")).path)
    if robot.root_joint is not None:
        stage.RemovePrim(stage.GetDefaultPrim().GetPath().AppendPath("Physics/root_joint"))
    return stage


@dataclass(frozen=True)
class _Prim:
    """A joint prim: paths of its bodies, its pose in the parent, the child's pose in the joint, its axis.

    The axis of a fixed joint is None.
    """

    parent: str
    child: str
    before: FloatArray
    behind: FloatArray
    axis: FloatArray | None
    turns: bool


def usd(robot: Robot, folder: Path) -> Library:
    """Compute the forward kinematics of a stage from the frames and axes of its joint prims.

    OpenUSD has no forward kinematics. The joints have the stage's order. UsdPhysics uses degrees for q, and
    degrees per second for angular velocities.
    """
    stage = _stage(robot, folder)
    from pxr import Gf, UsdPhysics

    def matrix(rotation: Any, place: Any = (0, 0, 0)) -> FloatArray:
        T = Gf.Matrix4d(Gf.Rotation(Gf.Quatd(rotation)), Gf.Vec3d(*map(float, place)))
        return np.array(T).T  # Gf multiplies a row vector by a matrix

    def read(joint: Any) -> _Prim:
        parent, child = (str((*x.GetTargets(), "")[0]) for x in (joint.GetBody0Rel(), joint.GetBody1Rel()))
        before = matrix(joint.GetLocalRot0Attr().Get(), joint.GetLocalPos0Attr().Get())
        end = matrix(joint.GetLocalRot1Attr().Get(), joint.GetLocalPos1Attr().Get())
        prim, axis = joint.GetPrim(), None
        turns = prim.IsA(UsdPhysics.RevoluteJoint)
        if not prim.IsA(UsdPhysics.FixedJoint):
            kind = UsdPhysics.RevoluteJoint if turns else UsdPhysics.PrismaticJoint
            axis = np.eye(3)["XYZ".index(kind(prim).GetAxisAttr().Get())]
        behind = np.asarray(np.linalg.inv(end), dtype=np.float64)
        return _Prim(parent, child, before, behind, axis, turns)

    joints = [UsdPhysics.Joint(prim) for prim in stage.Traverse() if prim.IsA(UsdPhysics.Joint)]
    prims = {joint.GetPrim().GetName(): read(joint) for joint in joints}
    moving = [name for name, prim in prims.items() if prim.axis is not None]
    of_child = {prim.child: name for name, prim in prims.items()}
    bodies = {path.split("/")[-1]: path for prim in prims.values() for path in (prim.parent, prim.child)}
    free = robot.root_joint is not None

    def walk(q: FloatArray, body: str) -> tuple[FloatArray, list[tuple[int, FloatArray, FloatArray | None]]]:
        """Return a body's pose; for each joint on the path, the column, axis, and origin (revolute only)."""
        prim = prims.get(of_child.get(body, ""))
        if prim is None or not prim.parent:
            return matrix(Gf.Quatd(*q[3:7]), q[:3]) if free else np.eye(4), []
        T, path = walk(q, prim.parent)
        T = T @ prim.before
        if prim.axis is not None:
            column = moving.index(of_child[body])
            value, z = float(q[column + 7 * free]), T[:3, :3] @ prim.axis
            path = [*path, (column + 6 * free, z, T[:3, 3] if prim.turns else None)]
            turn = Gf.Rotation(Gf.Vec3d(*prim.axis), value).GetQuat()  # degrees
            T = T @ (matrix(turn) if prim.turns else matrix(Gf.Quatd(1.0), value * prim.axis))
        return T @ prim.behind, path

    def evaluate(q: FloatArray, v: FloatArray, link: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        T, path = walk(q, bodies.get(encode_usd_name(link), ""))  # a root without joints has none
        if free:
            path += [(3 + k, z, q[:3]) for k, z in enumerate(np.eye(3))]
        J = np.zeros((6, len(v)))
        J[:3, : 3 * free] = np.eye(3)[:, : 3 * free]
        for column, z, origin in path:
            J[:3, column] = z if origin is None else np.radians(np.cross(z, T[:3, 3] - origin))
            J[3:, column] = 0.0 if origin is None else np.radians(z)
        return T, J @ v, J

    return Library(["root_joint"] * free + moving, evaluate, SINGLE, SINGLE_EPS)


def pinocchio(robot: Robot, folder: Path) -> Library:
    import pinocchio as pin

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
    "pinocchio": pinocchio, "mujoco": mujoco, "drake": drake, "idyntree": idyntree, "rtb": rtb,
    "newton": newton, "newton-usd": newton_usd, "usd": usd,
}  # fmt: skip
