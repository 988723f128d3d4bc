"""Compare how other libraries read a robot file: the joints, their order, and the link poses.

Each library runs in a separate process, with its adapter in `urdfkin/verify/adapters.py`. A joint counts as
different if its child link has a different pose in the parent link's frame.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any
from xml.parsers.expat import ExpatError

import numpy as np

from urdfkin.errors import InputError, UnknownNameError
from urdfkin.errors.escape import escape_unprintable
from urdfkin.model.tree import FloatArray, Joint, JointKind
from urdfkin.system.plain_xml import parse_xml
from urdfkin.system.processes import python_command, run_python
from urdfkin.urdf.mjcf import is_mjcf
from urdfkin.urdf.sources import is_usd
from urdfkin.verify.adapters import LIBRARIES, version

if TYPE_CHECKING:
    from urdfkin.robot import Robot

#: Tolerance for the entries of poses, relative to max(1, largest entry). Libraries that compute in double
#: precision differ by less than 1e-13.
_TOLERANCE = 1e-9
#: Tolerance for libraries that compute in single precision.
_TOLERANCE_SINGLE = 1e-5
#: Time limit for the process of one library, in seconds.
_TIMEOUT = 60.0
#: Maximum number of bytes that a library's process may return.
_MAX_BYTES = 400_000_000
#: Maximum length of a library's error message, in characters.
_MAX_CHARACTERS = 200


@dataclass(frozen=True, slots=True)
class ReaderDifference:
    """A joint with another pose or motion in a library's model.

    Attributes:
        size: Largest difference between matching entries of two matrices: urdfkin's pose and the library's
            pose of the child link in the parent link's frame.
    """

    joint: str
    element: str
    words: str
    size: float


@dataclass(frozen=True, slots=True)
class LibraryReading:
    """How a library reads a file.

    Attributes:
        refused: Reason why the library does not read the file. None if the library reads the file.
        missing: Links that the library's model lacks. For a USD file, only links with a prim (an object of
            the USD file) are listed. A root link that `load` added is not listed.
        worst: Largest difference between matching entries of the link poses in the frame of the first common
            link. 0 if rounding can explain the difference.
    """

    library: str
    version: str
    refused: str | None = None
    joints: tuple[str, ...] = ()
    same_order: bool = False
    missing: tuple[str, ...] = ()
    worst: float = 0.0
    differences: tuple[ReaderDifference, ...] = ()

    @property
    def agrees(self) -> bool:
        return self.refused is None and not self.differences and self.worst == 0.0

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def installed_libraries(form: str = "urdf") -> tuple[str, ...]:
    return tuple(name for name, one in LIBRARIES.items() if form in one.formats and version(name) is not None)


def compare_readers(
    robot: Robot, libraries: Iterable[str] | None = None, *, samples: int = 5, seed: int = 0
) -> tuple[LibraryReading, ...]:
    """Compare how urdfkin and other libraries read a robot's file.

    By default, all installed libraries that read the file's format are used. The poses of all common links
    are compared, in the neutral configuration and in `samples` random configurations.

    Raises:
        UnknownNameError: a library has no adapter.
        InputError: a library is not installed, or no installed library reads the file's format. Also if the
            robot has a locked joint, or was loaded from MJCF text instead of a file. Also if a variant or an
            articulation of a USD file was selected.
    """
    source, form = _library_input(robot)
    names = installed_libraries(form) if libraries is None else tuple(libraries)
    if not names:
        could = [one.package for one in LIBRARIES.values() if form in one.formats]
        raise InputError(
            f"no installed library reads {form.upper()}", remedy=f"pip install {' '.join(could)}"
        )
    for name in names:
        if name not in LIBRARIES:
            raise UnknownNameError("library", name, LIBRARIES)
        if version(name) is None:
            package = LIBRARIES[name].package
            raise InputError(f"{LIBRARIES[name].title} is not installed", remedy=f"pip install {package}")
    if any(joint.lock is not None for joint in robot.tree.joints):
        raise InputError(
            "other libraries cannot lock joints",
            where=robot.name,
            remedy="load the robot without locks",
        )
    q = np.concatenate((np.asarray(robot.neutral())[None], robot.sample(samples, seed=seed)))
    ours = np.asarray(robot.placement(q, list(robot.link_names)))
    return tuple(_compare_reader(robot, name, source, form, q, ours) for name in names)


def joint_values(robot: Robot, q: FloatArray) -> dict[str, Any]:
    return {
        joint.name: q[i : i + joint.nq].tolist() if joint.nq > 1 else float(q[i])
        for joint, i in zip(robot.tree.joints, robot.tree.q_index, strict=True)
        if joint.nq
    }


def _compare_reader(
    robot: Robot, name: str, source: str, form: str, q: FloatArray, ours: FloatArray
) -> LibraryReading:
    """Compare a library's link poses with urdfkin's link poses `ours` (configurations, links, 4, 4)."""
    title, number = LIBRARIES[name].title, version(name) or ""
    if form not in LIBRARIES[name].formats:
        return LibraryReading(title, number, f"the adapter of the library does not read {form.upper()}")
    values = [joint_values(robot, one) for one in q]
    command = python_command("from urdfkin.verify.adapters import main; main()")
    case = {"name": robot.name, "text": source, "configurations": values}
    output, status = run_python([*command, name], json.dumps([case]).encode(), _TIMEOUT, _MAX_BYTES)
    if status != 0 or not output:
        reason = f"no answer in {_TIMEOUT:g} s" if status is None else f"its process ended with {status}"
        return LibraryReading(title, number, reason)
    answer = json.loads(output)
    if "error" in answer:
        return LibraryReading(title, number, escape_unprintable(answer["error"])[:_MAX_CHARACTERS])
    links = robot.link_names
    tolerance = _TOLERANCE_SINGLE if LIBRARIES[name].is_single_precision else _TOLERANCE
    tolerance *= max(1.0, float(np.abs(ours).max()))
    shared = [i for i, link in enumerate(links) if all(link in poses for poses in answer["poses"])]
    if not shared:
        return LibraryReading(
            title, number, "its model contains none of the robot's links", tuple(answer["joints"])
        )
    theirs = np.array([[poses[links[i]] for i in shared] for poses in answer["poses"]])
    # `load` may add a root joint that the text does not contain. Therefore, the compared poses are relative
    # to the first common link.
    theirs = np.linalg.inv(theirs[:, :1]) @ theirs
    ours = np.linalg.inv(ours[:, shared[:1]]) @ ours
    worst = float(np.abs(theirs - ours[:, shared]).max())
    poses_of = dict(zip(shared, theirs.swapaxes(0, 1), strict=True))
    elements = _joint_elements(source) if form == "urdf" else {}
    shared_joints = [joint for joint in answer["joints"] if joint in values[0]]
    added_joint = None if robot.origin.root_joint is None else robot.tree.joints[0].name
    return LibraryReading(
        title,
        number,
        joints=tuple(answer["joints"]),
        same_order=answer["joints"] == [name for name in values[0] if name != added_joint],
        missing=tuple(
            link
            for i, link in enumerate(links)
            if i not in shared and (i or not added_joint) and (form != "usd" or link in robot.prims)
        ),
        worst=0.0 if worst <= tolerance else worst,
        differences=tuple(_differences(robot, title, ours, poses_of, elements, shared_joints, tolerance)),
    )


def _library_input(robot: Robot) -> tuple[str, str]:
    """Return the URDF text, or the path of the MJCF or USD file, and the format, for example "urdf"."""
    source = robot.origin.source
    if is_usd(source):
        if robot.origin.variants or robot.origin.articulation is not None:
            raise InputError(
                "other libraries cannot select a variant or an articulation of a USD stage",
                remedy="load the USD file without the arguments `variant` and `articulation`",
            )
        return str(source), "usd"
    if is_mjcf(source):
        return str(source), "mjcf"
    if robot.origin.sha256:  # `robot.urdf` is the URDF that urdfkin made from MJCF text.
        raise InputError("other libraries read MJCF only from a file", remedy="write the text to a file")
    return _remove_shapes(robot.urdf), "urdf"


def _remove_shapes(text: str) -> str:
    """Remove shapes, because some libraries search the disk for meshes."""
    from xml.etree.ElementTree import tostring

    robot = parse_xml(text)
    for link in robot.iterfind("link"):
        for shape in [*link.iterfind("visual"), *link.iterfind("collision")]:
            link.remove(shape)
    return tostring(robot, "unicode")


def _joint_elements(text: str) -> dict[str, Any]:
    try:
        return {joint.get("name", ""): joint for joint in parse_xml(text).iterfind("joint")}
    except ExpatError:
        return {}


def _differences(
    robot: Robot,
    title: str,
    ours: FloatArray,
    theirs: Mapping[int, FloatArray],
    elements: Mapping[str, Any],
    shared_joints: Sequence[str],
    tolerance: float,
) -> Iterator[ReaderDifference]:
    for i, joint in enumerate(robot.tree.joints, 1):
        if i not in theirs or joint.parent not in theirs:
            continue
        T = np.linalg.inv(ours[:, joint.parent]) @ ours[:, i]
        T_theirs = np.linalg.inv(theirs[joint.parent]) @ theirs[i]
        size = float(np.abs(T - T_theirs).max())
        if not size <= tolerance:
            element, words = _find_cause(
                joint, T, T_theirs, elements.get(joint.name), shared_joints, tolerance
            )
            yield ReaderDifference(joint.name, element, f"{title} {words}", size)


def _find_cause(
    joint: Joint,
    T: FloatArray,
    T_theirs: FloatArray,
    element: Any,
    shared_joints: Sequence[str],
    tolerance: float,
) -> tuple[str, str]:
    """Return the cause of a difference, for example "origin rpy" or "axis", and a description.

    `T` and `T_theirs` are urdfkin's and the library's poses (n, 4, 4) of the child link in the parent link's
    frame. The first pose belongs to the neutral configuration.
    """
    difference = np.abs(T - T_theirs)
    if joint.mimic is not None:
        is_free = np.abs(T_theirs - joint.T_parent_joint).max() <= tolerance
        return "mimic", "leaves the joint free" if is_free else "applies a different mimic rule"
    if difference[0, :3, :3].max() > tolerance:
        origin = None if element is None else element.find("origin")
        quaternion = origin is not None and origin.get("quat_xyzw") is not None
        return f"origin {'quat_xyzw' if quaternion else 'rpy'}", "has a different rotation at q = 0"
    if difference[0].max() > tolerance:
        return "origin xyz", "has a different position at q = 0"
    if joint.name in shared_joints and joint.kind.has_axis:
        return "axis", _describe_motion(joint, T, T_theirs, tolerance)
    words = (
        "moves the joint differently" if joint.name in shared_joints else "has no coordinate for the joint"
    )
    return f"type {joint.kind.value}", words


def _describe_motion(joint: Joint, T: FloatArray, T_theirs: FloatArray, tolerance: float) -> str:
    start = np.linalg.inv(T[0])
    ours, theirs = start @ T[1:], start @ T_theirs[1:]
    if joint.kind is JointKind.PRISMATIC:
        d = ours[:, :3, 3] @ joint.axis
        k = float(theirs[:, :3, 3] @ joint.axis @ d / np.sum(d**2))
        if np.abs(theirs[:, :3, 3] - k * ours[:, :3, 3]).max() <= tolerance:
            return f"moves the joint {k:.6g} times as far"
    elif np.abs(theirs - np.linalg.inv(ours)).max() <= tolerance:
        return "turns the joint in the opposite direction"
    elif np.abs(theirs[:, :3, :3] @ theirs[:, :3, :3].swapaxes(-1, -2) - np.eye(3)).max() > tolerance:
        return "returns a matrix that is not a rotation"
    direction, own = (_motion_direction(joint, T[0]) for T in (theirs, ours))
    if (length := math.hypot(*direction)) <= tolerance:
        return "does not move the joint"
    sense = 1.0 if own @ joint.axis >= 0.0 else -1.0
    x, y, z = (f"{number:.4g}" for number in np.round(direction / length * sense, 6) + 0.0)
    return f"uses a different joint axis: {x} {y} {z}"


def _motion_direction(joint: Joint, T: FloatArray) -> FloatArray:
    if joint.kind is JointKind.PRISMATIC:
        return T[:3, 3]
    return np.array([T[2, 1] - T[1, 2], T[0, 2] - T[2, 0], T[1, 0] - T[0, 1]])
