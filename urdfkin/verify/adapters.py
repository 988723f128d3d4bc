"""Read a robot file with other libraries, with one adapter for each library.

Besides the standard library, this module imports only NumPy and the chosen library. The command
`urdfkin readers` runs `main` in a new process. `scripts/make_libraries.py` runs this module as a program,
with the Python interpreter of a virtual environment in which one library is installed:

    python -I urdfkin/verify/adapters.py kinpy < cases.json

The program reads a list of cases `{"name", "text", "configurations"}` and prints one line of JSON for each
case. `text` is a URDF text, or the path of an MJCF or USD file. A configuration maps the name of each
independent joint to the joint's value:

| Joint | Value |
|---|---|
| revolute or prismatic | one number (rad or m) |
| planar | three numbers (x, y, angle) |
| floating | seven numbers (x, y, z, qx, qy, qz, qw) |

An adapter passes all inputs that the library's documentation requires. It passes only values of independent
joints, because the library can read the mimic rules in the file. An adapter does not correct wrong poses.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import io
import json
import logging
import math
import os
import sys
import tempfile
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

#: Value of a joint: one number, three numbers for a planar joint, or seven for a floating joint.
JointValue = Any
Poses = dict[str, Any]
_PLANAR, _FLOATING = 3, 7
#: Suffixes of the joints that replace a planar joint in MuJoCo.
_MUJOCO_PLANAR_SUFFIXES = ("_TX", "_TY", "_RZ")


@dataclass(frozen=True)
class LibraryModel:
    """A robot that a library has read.

    Attributes:
        joints: Names of the joints with a coordinate.
        compute_poses: Returns the pose (4, 4) of each link that the library has not merged with another link.
            The poses of a URDF are relative to the root link. The poses of MJCF and USD files are relative to
            the world.
    """

    joints: list[str]
    compute_poses: Callable[[Mapping[str, JointValue]], Poses]

    def find_joints_without_coordinate(self, values: Mapping[str, JointValue]) -> list[str]:
        return [name for name in values if name not in self.joints]


def _is_path(source: str) -> bool:
    return not source.lstrip().startswith("<")


def _find_root(text: str) -> str:
    robot = ET.fromstring(text)
    children = {child.get("link") for child in robot.iterfind("joint/child")}
    return next(name for link in robot.iterfind("link") if (name := link.get("name", "")) not in children)


def _find_child_links(text: str) -> dict[str, str]:
    return {
        joint.get("name", ""): child.get("link", "")
        for joint in ET.fromstring(text).iterfind("joint")
        if (child := joint.find("child")) is not None
    }


@contextlib.contextmanager
def _write_temporary_file(text: str) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "robot.urdf")
        path.write_text(text, "utf-8")
        yield str(path)


def _as_scalar(value: JointValue) -> float:
    if np.ndim(value):
        raise TypeError("the library does not support joints with several coordinates")
    return float(value)


def _make_pose(R: Any, p: Any) -> Any:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.reshape(R, (3, 3)), p
    return T


def _make_relative(poses: Poses, root: str) -> Poses:
    inverse = np.linalg.inv(poses.get(root, np.eye(4)))
    return {root: np.eye(4)} | {link: inverse @ T for link, T in poses.items()}


def read_pinocchio(source: str) -> LibraryModel:
    import pinocchio as pin

    if _is_path(source):
        model, root, groups = pin.buildModelFromMJCF(source), "world", _find_joints_of_bodies(source)
    else:
        model, root, groups = pin.buildModelFromXML(source, mimic=True), _find_root(source), {}
    data = model.createData()
    slots: dict[str, tuple[int, int]] = {}
    # In Pinocchio, joint 0 is the world.
    for joint, name in zip(list(model.joints)[1:], list(model.names)[1:], strict=True):
        # Pinocchio combines a body's MJCF joints into a composite joint.
        # The composite joint has the first joint's name.
        group = groups.get(name.removeprefix("Composite_"), []) if name.startswith("Composite_") else []
        if len(group) == joint.nq > 1:
            slots |= {part: (joint.idx_q + i, 1) for i, part in enumerate(group)}
        else:
            slots[name] = joint.idx_q, joint.nq

    def compute_poses(values: Mapping[str, JointValue]) -> Poses:
        q = pin.neutral(model)
        for name, value in values.items():
            at, count = slots.get(name, (0, 0))
            # In Pinocchio, a continuous joint has two coordinates.
            if count == 2:
                q[at : at + 2] = math.cos(value), math.sin(value)
            elif count == 4 and len(value) == _PLANAR:
                q[at : at + 4] = value[0], value[1], math.cos(value[2]), math.sin(value[2])
            elif count:
                q[at : at + count] = value
        pin.framesForwardKinematics(model, data, q)
        return _make_relative(
            {f.name: data.oMf[i].homogeneous for i, f in enumerate(model.frames) if f.type == pin.BODY}, root
        )

    return LibraryModel([name for name, (_, count) in slots.items() if count], compute_poses)


def _find_joints_of_bodies(path: str) -> dict[str, list[str]]:
    """Return the joints of each body in an MJCF file, by the name of the body's first joint."""
    bodies: list[list[str]] = []
    with contextlib.suppress(ET.ParseError):
        for body in ET.parse(path).iter("body"):
            bodies.append([joint.get("name", "") for joint in body.iterfind("joint")])
    return {joints[0]: joints for joints in bodies if joints}


def read_mujoco(source: str) -> LibraryModel:
    import mujoco

    root = "world"
    if not _is_path(source):
        root, robot = _find_root(source), ET.fromstring(source)
        options = {
            "fusestatic": "false",
            "boundmass": "0.001",
            "boundinertia": "0.001",
            "balanceinertia": "true",
        }
        robot.insert(0, extension := ET.Element("mujoco"))
        ET.SubElement(extension, "compiler", options)
        source = ET.tostring(robot, "unicode")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = (mujoco.MjModel.from_xml_path if _is_path(source) else mujoco.MjModel.from_xml_string)(source)
    data = mujoco.MjData(model)
    # If an MJCF body or joint has no name, the adapter uses urdfkin's name for it, which contains its number,
    # such as `joint3`.
    names = [model.joint(i).name or f"joint{i}" for i in range(model.njnt)]

    def compute_poses(values: Mapping[str, JointValue]) -> Poses:
        data.qpos[:] = model.qpos0
        own_values = {
            own: x for name, value in values.items() for own, x in _split_mujoco_value(name, value, names)
        }
        for name, value in own_values.items():
            at = model.jnt_qposadr[names.index(name)]
            if model.jnt_type[names.index(name)] == mujoco.mjtJoint.mjJNT_FREE:
                data.qpos[at : at + 7] = np.r_[value[:3], value[6], value[3:6]]
            else:
                data.qpos[at] = _as_scalar(value)
        mujoco.mj_kinematics(model, data)
        return _make_relative(
            {
                model.body(i).name or f"body{i}": _make_pose(data.xmat[i], data.xpos[i])
                for i in range(model.nbody)
            },
            root,
        )

    planar = {
        name.removesuffix(_MUJOCO_PLANAR_SUFFIXES[0])
        for name in names
        if name.endswith(_MUJOCO_PLANAR_SUFFIXES[0])
    }
    found = [name for name in names if name[: -len(_MUJOCO_PLANAR_SUFFIXES[0])] not in planar]
    return LibraryModel([*found, *sorted(planar)], compute_poses)


def _split_mujoco_value(name: str, value: JointValue, names: list[str]) -> Iterator[tuple[str, JointValue]]:
    """Yield the values of MuJoCo's joints, because a planar joint is three joints in MuJoCo."""
    if name in names:
        yield name, value
    elif name + _MUJOCO_PLANAR_SUFFIXES[0] in names:
        yield from zip((name + suffix for suffix in _MUJOCO_PLANAR_SUFFIXES), value, strict=True)


def read_drake(text: str) -> LibraryModel:
    """Read a URDF with Drake.

    Mimic joints require a discrete plant with the solver SAP.
    """
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant

    root, plant = _find_root(text), MultibodyPlant(0.001)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
    Parser(plant).AddModelsFromString(text, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(root))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    # In Drake, a floating joint has its child link's name.
    joint_of_child = {child: joint for joint, child in _find_child_links(text).items()}
    moving = [j for i in plant.GetJointIndices() if (j := plant.get_joint(i)).num_positions()]
    joints = {joint_of_child.get(j.name(), j.name()): j for j in moving}
    bodies = [
        plant.get_body(i) for i in plant.GetBodyIndices(plant.GetModelInstanceByName(_find_robot_name(text)))
    ]

    def compute_poses(values: Mapping[str, JointValue]) -> Poses:
        q = plant.GetPositions(context).copy()
        for name, value in values.items():
            if name in joints:
                start, count = joints[name].position_start(), joints[name].num_positions()
                numbers = np.r_[value[6], value[3:6], value[:3]] if count == _FLOATING else value
                q[start : start + count] = numbers
        plant.SetPositions(context, q)
        return {b.name(): plant.EvalBodyPoseInWorld(context, b).GetAsMatrix4() for b in bodies}

    return LibraryModel(list(joints), compute_poses)


def _find_robot_name(text: str) -> str:
    return ET.fromstring(text).get("name", "")


def read_idyntree(text: str) -> LibraryModel:
    import idyntree.bindings as idt

    root, loader, kin_dyn = _find_root(text), idt.ModelLoader(), idt.KinDynComputations()
    if not loader.loadModelFromString(text) or not kin_dyn.loadRobotModel(loader.model()):
        raise ValueError("the model loader returns False")
    model = loader.model()
    q_slots = {
        model.getJointName(i): model.getJoint(i).getPosCoordsOffset()
        for i in range(model.getNrOfJoints())
        if model.getJoint(i).getNrOfPosCoords()
    }
    kin_dyn.setFloatingBase(root)

    # The argument `_loader` keeps the loader and the model alive.
    def compute_poses(values: Mapping[str, JointValue], _loader: Any = loader) -> Poses:
        q = np.zeros(model.getNrOfPosCoords())
        for name in q_slots.keys() & values.keys():
            q[q_slots[name]] = _as_scalar(values[name])
        if not kin_dyn.setJointPos(idt.VectorDynSize(q)):
            raise ValueError("the joint positions are refused")
        links = [model.getLinkName(i) for i in range(model.getNrOfLinks())]
        relative = kin_dyn.getRelativeTransform
        return {link: relative(root, link).asHomogeneousTransform().toNumPy() for link in links}

    return LibraryModel(sorted(q_slots, key=q_slots.__getitem__), compute_poses)


def read_yourdfpy(text: str) -> LibraryModel:
    import yourdfpy

    logging.getLogger("yourdfpy.urdf").disabled = True
    model = yourdfpy.URDF.load(io.BytesIO(text.encode()), load_meshes=False, build_scene_graph=True)
    root = model.base_link

    def compute_poses(values: Mapping[str, JointValue]) -> Poses:
        model.update_cfg({name: values[name] for name in model.actuated_joint_names if name in values})
        return {link: model.get_transform(link, root) for link in model.link_map}

    return LibraryModel(list(model.actuated_joint_names), compute_poses)


def read_urchin(text: str) -> LibraryModel:
    import urchin

    with _write_temporary_file(text) as path:
        model = urchin.URDF.load(path, lazy_load_meshes=True)
    names = [joint.name for joint in model.actuated_joints]

    def compute_poses(values: Mapping[str, JointValue]) -> Poses:
        own = {
            name: _convert_urchin_value(model.joint_map[name], values[name])
            for name in names
            if name in values
        }
        return dict(model.link_fk(cfg=own, use_names=True))

    return LibraryModel(names, compute_poses)


def _convert_urchin_value(joint: Any, value: JointValue) -> JointValue:
    if joint.joint_type != "floating":
        return value
    return _make_pose(_rotation_from_quaternion(value[3:]), value[:3])


def _rotation_from_quaternion(quaternion: JointValue) -> JointValue:
    x, y, z, w = quaternion
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def read_kinpy(text: str) -> LibraryModel:
    import kinpy

    chain = kinpy.build_chain_from_urdf(text.encode())
    names = list(chain.get_joint_parameter_names())

    def compute_poses(values: Mapping[str, JointValue]) -> Poses:
        found = chain.forward_kinematics({name: _as_scalar(values.get(name, 0.0)) for name in names})
        return _make_relative({link: pose.matrix() for link, pose in found.items()}, _find_root(text))

    return LibraryModel(names, compute_poses)


def read_ikpy(text: str) -> LibraryModel:
    """Read only one path from the root to a tip, because ikpy does not support branches."""
    from ikpy.chain import Chain

    root, children = _find_root(text), _find_child_links(text)
    with _write_temporary_file(text) as path, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        chain = Chain.from_urdf_file(path, base_elements=[root])

    def compute_poses(values: Mapping[str, JointValue]) -> Poses:
        q = [_as_scalar(values.get(link.name, 0.0)) for link in chain.links]
        found = chain.forward_kinematics(q, full_kinematics=True)
        names = [children.get(link.name, root) for link in chain.links]
        return dict(zip(names, found, strict=True))

    moving = [link.name for link in chain.links if link.name in children and link.joint_type != "fixed"]
    return LibraryModel(moving, compute_poses)


def read_roboticstoolbox(text: str) -> LibraryModel:
    import roboticstoolbox as rtb

    joints = {child: joint for joint, child in _find_child_links(text).items()}
    with _write_temporary_file(text) as path:
        robot = rtb.Robot.URDF(path, gripper=None)
    moving = {joints[link.name]: link.jindex for link in robot.links if link.isjoint}

    def compute_poses(values: Mapping[str, JointValue]) -> Poses:
        q = np.zeros(robot.n)
        for name in moving.keys() & values.keys():
            q[moving[name]] = _as_scalar(values[name])
        return {link.name: robot.fkine(q, end=link.name).A for link in robot.links}

    return LibraryModel(sorted(moving, key=moving.__getitem__), compute_poses)


def read_skrobot(text: str) -> LibraryModel:
    from skrobot.models.urdf import RobotModelFromURDF

    with _write_temporary_file(text) as path:
        robot = RobotModelFromURDF(urdf_file=path)
    joints = {joint.name: joint for joint in robot.joint_list}

    def compute_poses(values: Mapping[str, JointValue]) -> Poses:
        for name in joints.keys() & values.keys():
            joints[name].joint_angle(_as_scalar(values[name]))
        return _make_relative(
            {link.name: link.worldcoords().T() for link in robot.link_list}, _find_root(text)
        )

    return LibraryModel(list(joints), compute_poses)


def read_newton(path: str) -> LibraryModel:
    import newton

    builder = newton.ModelBuilder()
    builder.add_usd(path)
    model = builder.finalize(device="cpu")
    state, starts = model.state(), model.joint_q_start.numpy()
    counts = np.diff(np.append(starts[: len(builder.joint_label)], model.joint_coord_count))
    # Newton adds a free joint to a body without a joint.
    q_slots = {
        str(label).rpartition("/")[2]: (int(start), int(count))
        for label, kind, mimicked_joint, start, count in zip(
            builder.joint_label, builder.joint_type, builder.joint_mimic_joint, starts, counts, strict=False
        )
        if count and mimicked_joint < 0 and int(kind) != int(newton.JointType.FREE)
    }
    bodies = [str(label).rpartition("/")[2] for label in builder.body_label]

    def compute_poses(values: Mapping[str, JointValue]) -> Poses:
        q = model.joint_q.numpy()
        for name in q_slots.keys() & values.keys():
            start, count = q_slots[name]
            q[start : start + count] = values[name]
        state.joint_q.assign(q)
        newton.eval_mimic(model, state)
        newton.eval_fk(model, state.joint_q, state.joint_qd, state)
        rotations = (quaternion / np.linalg.norm(quaternion) for quaternion in state.body_q.numpy()[:, 3:])
        return {
            name: _make_pose(_rotation_from_quaternion(rotation), p)
            for name, rotation, p in zip(bodies, rotations, state.body_q.numpy()[:, :3], strict=True)
        }

    return LibraryModel(list(q_slots), compute_poses)


@dataclass(frozen=True)
class Library:
    """A library that reads robot files."""

    title: str
    package: str
    module: str
    read: Callable[[str], LibraryModel]
    formats: tuple[str, ...] = ("urdf",)
    is_single_precision: bool = False


LIBRARIES: dict[str, Library] = {
    "pinocchio": Library("Pinocchio", "pin", "pinocchio", read_pinocchio, ("urdf", "mjcf")),
    "mujoco": Library("MuJoCo", "mujoco", "mujoco", read_mujoco, ("urdf", "mjcf")),
    "drake": Library("Drake", "drake", "pydrake", read_drake),
    "idyntree": Library("iDynTree", "idyntree", "idyntree", read_idyntree),
    "yourdfpy": Library("yourdfpy", "yourdfpy", "yourdfpy", read_yourdfpy),
    "urchin": Library("urchin", "urchin", "urchin", read_urchin),
    "kinpy": Library("kinpy", "kinpy", "kinpy", read_kinpy),
    "ikpy": Library("ikpy", "ikpy", "ikpy", read_ikpy),
    "roboticstoolbox": Library(
        "Robotics Toolbox", "roboticstoolbox-python", "roboticstoolbox", read_roboticstoolbox
    ),
    "skrobot": Library("scikit-robot", "scikit-robot", "skrobot", read_skrobot),
    "newton": Library("Newton", "newton", "newton", read_newton, ("usd",), is_single_precision=True),
}


def version(name: str) -> str | None:
    with contextlib.suppress(importlib.metadata.PackageNotFoundError):
        return importlib.metadata.version(LIBRARIES[name].package)
    return None


def evaluate_case(name: str, case: Mapping[str, Any]) -> dict[str, Any]:
    """Compute the poses of one case; an exception of the library becomes the entry `error`."""
    try:
        model = LIBRARIES[name].read(case["text"])
        found = [model.compute_poses(values) for values in case["configurations"]]
    except Exception as error:  # The libraries raise many types of exceptions.
        words = " ".join(str(error).split())
        return {"error": f"{type(error).__name__}: {words}" if words else type(error).__name__}
    poses = [{link: np.asarray(T, float).tolist() for link, T in one.items()} for one in found]
    return {
        "joints": model.joints,
        "unset": model.find_joints_without_coordinate(
            case["configurations"][0] if case["configurations"] else {}
        ),
        "poses": poses,
    }


def _evaluate_cases(name: str, cases: Iterable[Mapping[str, Any]]) -> Iterable[str]:
    for case in cases:
        yield json.dumps({"name": case["name"], "version": version(name), **evaluate_case(name, case)})


def main() -> None:
    logging.disable(logging.CRITICAL)
    warnings.simplefilter("ignore")
    # Standard output receives only the results; text that a library prints goes to standard error.
    output = os.dup(1)
    os.dup2(2, 1)
    for line in _evaluate_cases(sys.argv[1], json.load(sys.stdin)):
        os.write(output, f"{line}\n".encode())


if __name__ == "__main__":
    main()
