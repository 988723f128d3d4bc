"""Compare how other libraries read a robot file: the joints, the order of the joints, and the link poses.

Each library runs in a process of its own, with its adapter in `urdfkin/verify/adapters.py`. The differences
of poses are attributed to joints: a joint differs if the pose of its child link in its parent link differs.
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
from urdfkin.errors.escape import printable
from urdfkin.model.tree import FloatArray, Joint, JointKind
from urdfkin.system.plain_xml import plain_xml
from urdfkin.system.processes import ask_python, own_python
from urdfkin.urdf.mjcf import is_mjcf, is_text
from urdfkin.urdf.sources import is_usd
from urdfkin.verify.adapters import LIBRARIES, version

if TYPE_CHECKING:
    from urdfkin.robot import Robot

#: Poses count as equal if their entries differ by at most `_EQUAL` * max(1, largest entry).
#: Libraries that compute in double precision differ by less than 1e-13.
#: A misread element causes a larger difference.
_EQUAL = 1e-9
#: The same number for libraries that compute in single precision.
_EQUAL_SINGLE = 1e-5
#: Time limit of a library, in seconds.
_PATIENCE = 60.0
#: Maximum number of bytes that a library's process may return.
_MOST = 400_000_000
#: Longest quotation of a library's message, in characters.
_QUOTED = 200


@dataclass(frozen=True, slots=True)
class ReaderDifference:
    """A joint that a library reads differently, and the element of the file that explains the difference.

    `size` is the largest difference of an entry of the child link's pose in the parent link (m, or rotation
    entry).
    """

    joint: str
    element: str
    words: str
    size: float


@dataclass(frozen=True, slots=True)
class LibraryReading:
    """The differences between a library and urdfkin in reading a robot file.

    Attributes:
        refused: Reason why the library does not read the file; None if it reads the file.
        joints: The joints with a coordinate in the library, in the library's order.
        same_order: Whether the library has the same joints as urdfkin, in the same order.
        missing: Links that the library's model does not contain; in USD, only links with a prim of their own.
        worst: Largest difference between the link poses of the two libraries, relative to the root link; 0 if
            all poses are equal up to rounding.
        differences: The joints that the library reads differently from urdfkin.
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


def installed(form: str = "urdf") -> tuple[str, ...]:
    """Return the names of the installed libraries that have an adapter for a format."""
    return tuple(name for name, one in LIBRARIES.items() if form in one.forms and version(name) is not None)


def compare_readers(
    robot: Robot, libraries: Iterable[str] | None = None, *, samples: int = 5, seed: int = 0
) -> tuple[LibraryReading, ...]:
    """Compare how libraries read a robot's file with how urdfkin reads it, by default all `installed` ones.

    The poses of all links are compared at q = 0 and at random configurations.

    Raises:
        UnknownNameError: a library has no adapter.
        InputError: a library is not installed, none reads the format, a joint is locked, the robot is MJCF
            text without a file, or a variant or an articulation of a USD stage was selected.

    >>> import urdfkin
    >>> from urdfkin.comparison.readers import compare_readers
    >>> reading, = compare_readers(urdfkin.load("planar_two_link"), ["pinocchio"])
    >>> reading.agrees, reading.joints
    (True, ('joint_1', 'joint_2'))
    """
    source, form = _source(robot)
    names = installed(form) if libraries is None else tuple(libraries)
    if not names:
        could = [one.package for one in LIBRARIES.values() if form in one.forms]
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
            "other libraries read the file, which has no locked joints",
            where=robot.name,
            remedy="load the robot without locks",
        )
    q = np.concatenate((np.asarray(robot.neutral())[None], robot.sample(samples, seed=seed)))
    ours = np.asarray(robot.placement(q, list(robot.link_names)))
    return tuple(_reading(robot, name, source, form, q, ours) for name in names)


def values_of(robot: Robot, q: FloatArray) -> dict[str, Any]:
    """Return the values of one configuration by joint: a number, or a list for planar and floating joints."""
    left, values = q.tolist(), dict[str, Any]()
    for joint in robot.tree.joints:
        if not joint.nq:
            continue
        own, left = left[: joint.nq], left[joint.nq :]
        values[joint.name] = own[0] if joint.nq == 1 else own
    return values


def _reading(
    robot: Robot, name: str, source: str, form: str, q: FloatArray, ours: FloatArray
) -> LibraryReading:
    """Run one library in a separate process, and compare its poses with `ours` at `q`."""
    title, number = LIBRARIES[name].title, version(name) or ""
    if form not in LIBRARIES[name].forms:
        return LibraryReading(title, number, f"the adapter of the library does not read {form.upper()}")
    values = [values_of(robot, one) for one in q]
    command = own_python("from urdfkin.verify.adapters import main; main()")
    case = {"name": robot.name, "text": source, "configurations": values}
    output, status = ask_python([*command, name], json.dumps([case]).encode(), _PATIENCE, _MOST)
    if status != 0 or not output:
        how = f"no answer in {_PATIENCE:g} s" if status is None else f"its process ended with {status}"
        return LibraryReading(title, number, how)
    answer = json.loads(output)
    if "error" in answer:
        return LibraryReading(title, number, printable(answer["error"])[:_QUOTED])
    theirs = [{link: np.array(T) for link, T in one.items()} for one in answer["poses"]]
    links = robot.link_names
    equal = (_EQUAL_SINGLE if LIBRARIES[name].single else _EQUAL) * max(1.0, float(np.abs(ours).max()))
    shared = [i for i, link in enumerate(links) if all(link in one for one in theirs)]
    if not shared:
        return LibraryReading(title, number, "its model has none of the links", tuple(answer["joints"]))
    both = np.array([[one[links[i]] for i in shared] for one in theirs])
    # The text lacks a root joint that `load` added, so poses are relative to the first common link.
    both = np.linalg.inv(both[:, :1]) @ both
    ours = np.linalg.inv(ours[:, shared[:1]]) @ ours
    worst = float(np.abs(both - ours[:, shared]).max())
    poses = dict(zip(shared, both.swapaxes(0, 1), strict=True))
    elements = _elements(source) if form == "urdf" else {}
    own = [joint for joint in answer["joints"] if joint in values[0]]
    new = (joint.name for joint in robot.tree.joints if form == "urdf" and joint.name not in elements)
    added = next(new, None)
    return LibraryReading(
        title,
        number,
        joints=tuple(answer["joints"]),
        same_order=answer["joints"] == [name for name in values[0] if name != added],
        missing=tuple(
            link
            for i, link in enumerate(links)
            if i not in shared and (i or not added) and (form != "usd" or link in robot.prims)
        ),
        worst=0.0 if worst <= equal else worst,
        differences=tuple(_differences(robot, title, ours, poses, elements, own, equal)),
    )


def _source(robot: Robot) -> tuple[str, str]:
    """Return a library's input and its format: a URDF text without shapes, or the path of another file."""
    source = robot.origin.source
    if is_usd(source):
        if robot.origin.variants or robot.origin.articulation is not None:
            raise InputError(
                "other libraries read the whole USD stage",
                remedy="load the stage without variants and articulation",
            )
        return str(source), "usd"
    if is_mjcf(source):
        if is_text(source):
            raise InputError("other libraries read MJCF only from a file", remedy="write the text to a file")
        return str(source), "mjcf"
    return _without_shapes(robot.urdf), "urdf"


def _without_shapes(text: str) -> str:
    """Return a URDF text without shapes, because some libraries search the disk for the files of meshes."""
    from xml.etree.ElementTree import tostring

    robot = plain_xml(text)
    for link in robot.iterfind("link"):
        for shape in [*link.iterfind("visual"), *link.iterfind("collision")]:
            link.remove(shape)
    return tostring(robot, "unicode")


def _elements(text: str) -> dict[str, Any]:
    try:
        return {joint.get("name", ""): joint for joint in plain_xml(text).iterfind("joint")}
    except ExpatError:
        return {}


def _differences(
    robot: Robot,
    title: str,
    ours: FloatArray,
    theirs: Mapping[int, FloatArray],
    elements: Mapping[str, Any],
    own: Sequence[str],
    equal: float,
) -> Iterator[ReaderDifference]:
    """Yield the joints with another pose of the child link in the parent link."""
    for i, joint in enumerate(robot.tree.joints, 1):
        if i not in theirs or joint.parent not in theirs:
            continue
        T = np.linalg.inv(ours[:, joint.parent]) @ ours[:, i]
        found = np.linalg.inv(theirs[joint.parent]) @ theirs[i]
        size = float(np.abs(T - found).max())
        if not size <= equal:
            element, words = _explained(joint, title, T, found, elements.get(joint.name), own, equal)
            yield ReaderDifference(joint.name, element, words, size)


def _explained(
    joint: Joint, title: str, T: FloatArray, found: FloatArray, element: Any, own: Sequence[str], equal: float
) -> tuple[str, str]:
    """Return the element that explains a difference, and the difference in words.

    `T` (urdfkin) and `found` (library) are poses of the child link in the parent link, first at q = 0.
    """
    off = np.abs(T - found)
    name, words = f"type {joint.kind.value}", "has no coordinate for it"
    if joint.mimic is not None:
        free = np.abs(found - joint.T_parent_joint).max() <= equal
        name, words = "mimic", "leaves it free" if free else "applies another rule"
    elif off[0, :3, :3].max() > equal:
        origin = None if element is None else element.find("origin")
        quaternion = origin is not None and origin.get("quat_xyzw") is not None
        name, words = f"origin {'quat_xyzw' if quaternion else 'rpy'}", "has another rotation at q = 0"
    elif off[0].max() > equal:
        name, words = "origin xyz", "has another position at q = 0"
    elif joint.name in own and joint.kind.has_axis:
        name, words = "axis", _motion(joint, T, found, equal)
    elif joint.name in own:
        words = "moves it differently"
    return name, f"{title} {words}"


def _motion(joint: Joint, T: FloatArray, found: FloatArray, equal: float) -> str:
    """Return words for the difference between urdfkin's and the library's motion from q = 0."""
    start = np.linalg.inv(T[0])
    mine, theirs = start @ T[1:], start @ found[1:]
    if joint.kind is JointKind.PRISMATIC:
        d = theirs[:, :3, 3] @ joint.axis
        k = float(d @ (mine[:, :3, 3] @ joint.axis) / np.sum((mine[:, :3, 3] @ joint.axis) ** 2))
        if np.abs(theirs[:, :3, 3] - k * mine[:, :3, 3]).max() <= equal:
            return f"moves it {k:.6g} times as far"
    elif np.abs(theirs - np.linalg.inv(mine)).max() <= equal:
        return "turns it the other way"
    elif np.abs(theirs[:, :3, :3] @ theirs[:, :3, :3].swapaxes(-1, -2) - np.eye(3)).max() > equal:
        return "returns a matrix that is no rotation"
    direction, own = (_direction(joint, T[0]) for T in (theirs, mine))
    if (length := math.hypot(*direction)) <= equal:
        return "does not move it"
    sense = 1.0 if own @ joint.axis >= 0.0 else -1.0
    x, y, z = (f"{number:.4g}" for number in np.round(direction / length * sense, 6) + 0.0)
    return f"moves it along another axis: {x} {y} {z}"


def _direction(joint: Joint, T: FloatArray) -> FloatArray:
    """Return a vector along the displacement of a prismatic joint, or along the axis of a rotation."""
    if joint.kind is JointKind.PRISMATIC:
        return T[:3, 3]
    return np.array([T[2, 1] - T[1, 2], T[0, 2] - T[2, 0], T[1, 0] - T[0, 1]])
