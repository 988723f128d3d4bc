"""Base class of the oracles Pinocchio and MuJoCo.

An oracle is a library whose results urdfkin compares with its own results. This module also converts the
user's arguments into the form that an oracle receives. This conversion and the conversion for urdfkin's own
computation share only the code for units and named poses. A wrong broadcast, order or name in one conversion
therefore causes a disagreement.

| Subject | In this module | In urdfkin's own computation |
|---|---|---|
| mimic rules | `parse_mimic_rules` | `urdfkin.urdf.lint`, `urdfkin.urdf.reader` |
| names, batch shapes | `OracleQuery` | `urdfkin.verify.call` |
| order of q, v and a | `PinocchioLayout` | `KinematicTree` |
| frame of a name | `Frames` | `KinematicTree.frame_link` |
| moving base | `free_flyer_q` and others | `BaseMotion` |

Mimic rules: Pinocchio's model is built without mimic joints (`urdfkin.verify.pinocchio`). This module
therefore reads the mimic rules from the URDF text.

Layout of urdfkin's q: the joints are in Pinocchio's order. A revolute, continuous or prismatic joint has one
number, a planar joint has three, a floating joint has seven, and a mimic joint has none.

Moving base: the user gives the base's orientation as a matrix M. The base's rotation R is the rotation that
is nearest to M. urdfkin computes R with one Newton step (`urdfkin.kinematics.rotation`), but this module uses
Davenport's q-method. The quaternion q of R maximizes q^T K q = trace(R(q)^T M), so q is the eigenvector of K
for the largest eigenvalue.
"""

from __future__ import annotations

import math
import re
import threading
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple, Protocol
from xml.parsers.expat import ExpatError

import numpy as np
from numpy.typing import ArrayLike, NDArray

from urdfkin.compiled import preload
from urdfkin.compiled.plan import IntArray
from urdfkin.errors import OracleError
from urdfkin.errors.numbers import parse_float, parse_quantity
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, JointFrame, KinematicTree, LinkFrame, Mimic
from urdfkin.system.plain_xml import parse_xml
from urdfkin.verify.bounds import VERIFY_KERNELS_MODULE


def parse_mimic_rules(text: str, joints: Collection[str]) -> dict[str, Mimic]:
    """Read the mimic rules of `joints`. The returned rules refer to independent joints.

    Raises:
        ValueError: a multiplier or an offset is not a number.
        ExpatError: the text is not valid XML.
    """
    if "mimic" not in text:
        return {}
    rules = {
        name: Mimic(rule.get("joint", ""), float(rule.get("multiplier", "1")), float(rule.get("offset", "0")))
        for joint in parse_xml(text).iterfind("joint")
        if (rule := joint.find("mimic")) is not None and (name := joint.get("name", "")) in joints
    }
    return resolve_rules(rules)


def resolve_rules(rules: dict[str, Mimic]) -> dict[str, Mimic]:
    """Resolve chains of mimic rules.

    Each chain becomes one rule that refers to the independent joint:

        q_mimic = m_1 (m_2 (... q_independent ...) + o_2) + o_1
    """
    known: dict[str, Mimic] = {}
    for joint in rules:
        chain = [joint]
        while (mimicked_joint := rules[chain[-1]].mimicked_joint) in rules and mimicked_joint not in known:
            # A longer chain contains a cycle.
            if len(chain) > len(rules):
                break
            chain.append(mimicked_joint)
        for name in reversed(chain):
            rule = rules[name]
            end = known.get(rule.mimicked_joint, Mimic(rule.mimicked_joint, 1.0, 0.0))
            offset = rule.multiplier * end.offset + rule.offset
            known[name] = Mimic(end.mimicked_joint, rule.multiplier * end.multiplier, offset)
    return {joint: known[joint] for joint in rules}


def find_locked_values(lock: Mapping[str, float], rules: Mapping[str, Mimic]) -> dict[str, float]:
    """Return the values of locked joints and of their mimic joints.

    >>> find_locked_values({"a": 2.0}, {"b": Mimic("a", 0.5, 0.25), "c": Mimic("d", 1.0, 0.0)})
    {'a': 2.0, 'b': 1.25}
    """
    mimic_values = {
        name: rule.multiplier * lock[rule.mimicked_joint] + rule.offset
        for name, rule in rules.items()
        if rule.mimicked_joint in lock
    }
    return {**lock, **mimic_values}


#: Pairs (nq, nv) of three kinds of joints in Pinocchio.
_CONTINUOUS, _PLANAR, _FLOATING = (2, 1), (4, 3), (7, 6)
#: Number nq of a joint in urdfkin. The key is the pair (nq, nv) of the joint in Pinocchio.
_URDFKIN_NQ = {(1, 1): 1, _CONTINUOUS: 1, _PLANAR: 3, _FLOATING: 7}


class _JointIndices(NamedTuple):
    """First indices of a joint. A mimic joint has the `q` and `v` of the mimicked joint."""

    sizes: tuple[int, int]  # (nq, nv) in Pinocchio.
    full_q: int  # Index in Pinocchio's q.
    full_v: int
    q: int
    v: int
    multiplier: float
    offset: float


class PinocchioLayout:
    """Converts between Pinocchio's and urdfkin's layouts.

    Args:
        joints: Pinocchio's indices of the moving joints, without the base.
        names: Names of the moving joints in the URDF.

    Attributes:
        rate_columns: Column indices of moving joints in Pinocchio's Jacobian, mimic joints included.
    """

    def __init__(
        self, model: Any, joints: Sequence[int], names: Sequence[str], rules: Mapping[str, Mimic]
    ) -> None:
        self._model = model
        sizes = [(int(model.joints[j].nq), int(model.joints[j].nv)) for j in joints]
        at, self.nq, self.nv = dict[str, tuple[int, int]](), 0, 0
        for name, size in zip(names, sizes, strict=True):
            if name not in rules:
                at[name] = self.nq, self.nv
                self.nq, self.nv = self.nq + _URDFKIN_NQ[size], self.nv + size[1]
        self._joints = list[_JointIndices]()
        for j, name, size in zip(joints, names, sizes, strict=True):
            rule = rules.get(name, Mimic(name, 1.0, 0.0))
            if rule.mimicked_joint not in at:
                raise OracleError(
                    "Pinocchio has no such mimicked joint",
                    where=f"joint {name}",
                    found=repr(rule.mimicked_joint),
                )
            full = int(model.joints[j].idx_q), int(model.joints[j].idx_v)
            self._joints.append(
                _JointIndices(size, *full, *at[rule.mimicked_joint], rule.multiplier, rule.offset)
            )
        self.rate_columns = [joint.full_v + c for joint in self._joints for c in range(joint.sizes[1])]
        #: Pinocchio's joint velocity i is `_factor[i] * v[_index[i]]`. For the base, the factor is 0.
        self._index, self._factor = np.zeros(model.nv, dtype=np.int64), np.zeros(model.nv)
        for joint in self._joints:
            for c in range(joint.sizes[1]):
                self._index[joint.full_v + c] = joint.v + c
                self._factor[joint.full_v + c] = joint.multiplier
        self._columns = np.array(self.rate_columns, dtype=np.int64)
        self._free = [joint for joint in self._joints if joint.sizes in (_PLANAR, _FLOATING)]
        self._single, self._angles = (self._collect_arrays(sizes) for sizes in ((1, 1), _CONTINUOUS))
        #: True if Pinocchio can use q (`_same_q`) or v (`_same_v`) without conversion.
        self._same_q = model.nq == self.nq and all(
            (joint.q, (1, 1), 1.0, 0.0) == (joint.full_q, joint.sizes, joint.multiplier, joint.offset)
            for joint in self._joints
        )
        self._same_v = model.nv == self.nv and bool((self._factor == 1.0).all())
        self._same_v &= bool((self._index == np.arange(model.nv)).all())

    def _collect_arrays(self, sizes: tuple[int, int]) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
        joints = [joint for joint in self._joints if joint.sizes == sizes]
        return (
            np.array([joint.full_q for joint in joints], dtype=np.int64),
            np.array([joint.q for joint in joints], dtype=np.int64),
            np.array([joint.multiplier for joint in joints]),
            np.array([joint.offset for joint in joints]),
        )

    def convert_q(self, q: FloatArray) -> FloatArray:
        """Convert q to Pinocchio's layout, with normalized quaternions."""
        if self._same_q:
            return np.ascontiguousarray(q)
        full = np.zeros((len(q), self._model.nq))
        to, at, multiplier, offset = self._single
        full[:, to] = multiplier * q[:, at] + offset
        to, at, multiplier, offset = self._angles
        if len(to):
            angles = multiplier * q[:, at] + offset
            full[:, to], full[:, to + 1] = np.cos(angles), np.sin(angles)
        for joint in self._free:
            i, k = joint.full_q, joint.q
            if joint.sizes == _FLOATING:
                full[:, i : i + 7] = q[:, k : k + 7]
                full[:, i + 3 : i + 7] /= np.linalg.norm(full[:, i + 3 : i + 7], axis=1, keepdims=True)
            else:
                full[:, i : i + 2] = q[:, k : k + 2]
                full[:, i + 2], full[:, i + 3] = np.cos(q[:, k + 2]), np.sin(q[:, k + 2])
        return full

    def convert_rates(self, v: FloatArray) -> FloatArray:
        """Return v_full = G v."""
        if self._same_v:
            return np.ascontiguousarray(v)
        if not self.nv:
            return np.zeros((len(v), self._model.nv))
        full: FloatArray = v[:, self._index] * self._factor
        return full

    def couple(self, full: FloatArray) -> FloatArray:
        """Return J_full G, without the base's columns."""
        if self._same_v:
            return full
        return couple_columns(full, self._columns, self._index, self._factor, self.nv)


#: Pinocchio's name for the world, the parent of root joints.
WORLD = "universe"
_PREFIX_PATTERN = re.compile(r"(link|joint):(.*)", re.DOTALL)


class Frames:
    """An oracle's frames by name.

    Args:
        bodies: Frame index of each link.
        joints: Frame index of each joint.
        parents: Frame index of a link's parent joint. The key is the link's frame index. Without an entry,
            both indices are equal.
    """

    def __init__(
        self,
        oracle: str,
        robot: str,
        bodies: Mapping[str, int],
        joints: Mapping[str, int],
        parents: Mapping[int, int],
    ) -> None:
        self._oracle, self._robot = oracle, robot
        self._bodies, self._joints, self._parents = bodies, joints, parents

    def find_index(self, name: str) -> int:
        if isinstance(name, LinkFrame):
            return self._find_index(self._bodies, name, str(name)[5:])
        if isinstance(name, JointFrame):
            return self._find_index(self._joints, name, str(name)[6:])
        body, joint = self._bodies.get(name), self._joints.get(name)
        if body is not None and joint is not None and self._parents.get(body, body) != joint:
            raise self._make_error(f"two of {self._oracle}'s frames have this name", name)
        if body is not None:
            return body
        if joint is not None:
            return joint
        if (parts := _PREFIX_PATTERN.fullmatch(name)) is None:
            raise self._make_error(f"{self._oracle} has no such frame", name)
        return self._find_index(self._bodies if parts[1] == "link" else self._joints, name, parts[2])

    def _find_index(self, frames: Mapping[str, int], name: str, plain_name: str) -> int:
        if (index := frames.get(plain_name)) is None:
            raise self._make_error(f"{self._oracle} has no such frame", name)
        return index

    def _make_error(self, message: str, name: str) -> OracleError:
        return OracleError(message, where=self._robot, found=repr(str(name)))


def make_pinocchio_frames(model: Any, pin: Any, *, includes_world: bool) -> Frames:
    """List a model's frames. With `includes_world`, Pinocchio's world is the link `WORLD`."""
    bodies, joints = dict[str, int](), dict[str, int]()
    for index, frame in enumerate(model.frames):
        if index:  # Frame 0 is the world.
            (bodies if frame.type == pin.FrameType.BODY else joints)[frame.name] = index
    if includes_world:
        bodies[WORLD] = 0
    parents = {index: int(frame.parentFrame) for index, frame in enumerate(model.frames)}
    return Frames("Pinocchio", str(model.name), bodies, joints, parents)


class BaseMotionLike(Protocol):
    """The user's motion of the base.

    Leading axes are batch axes.
    """

    @property
    def placement(self) -> FloatArray:
        """(..., 4, 4) T_world_base."""

    @property
    def velocity(self) -> FloatArray:
        """(..., 6) velocity, [linear; angular] in world axes."""

    @property
    def acceleration(self) -> FloatArray:
        """(..., 6) classical acceleration, [linear; angular] in world axes."""


def free_flyer_q(base: BaseMotionLike) -> FloatArray:
    """Return x, y, z, qx, qy, qz, qw of the base."""
    T = np.asarray(base.placement)
    return np.concatenate((T[..., :3, 3], nearest_quaternion(T[..., :3, :3])), axis=-1)


def free_flyer_velocity(base: BaseMotionLike) -> FloatArray:
    """Return the base's velocity in the base's axes."""
    return _rotate_to_base_axes(free_flyer_q(base)[..., 3:], np.asarray(base.velocity))


def free_flyer_acceleration(base: BaseMotionLike) -> FloatArray:
    """Return the base's spatial acceleration in the base's axes.

    The linear part is the base's linear acceleration minus w x vel.
    """
    vel, acc = np.broadcast_arrays(base.velocity, base.acceleration)
    linear = acc[..., :3] - np.cross(vel[..., 3:], vel[..., :3])
    return _rotate_to_base_axes(free_flyer_q(base)[..., 3:], np.concatenate((linear, acc[..., 3:]), axis=-1))


def nearest_quaternion(M: FloatArray) -> FloatArray:
    """Return the unit quaternion (scalar last) of the rotation nearest to M."""
    K = davenport_matrix(M)
    q = np.linalg.eigh(K).eigenvectors[..., -1:]
    # Because of rounding, the computed q has small components along the other eigenvectors of K. If M is a
    # rotation, multiplication by K + I = 4 q q^T removes these components.
    q = (K @ q + q)[..., 0]
    unit: FloatArray = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return unit


def davenport_matrix(M: NDArray[Any]) -> NDArray[Any]:
    """Return Davenport's matrix K of M.

    If M is the rotation of the quaternion q, K is 4 q q^T - I.
    """
    K = np.empty((*M.shape[:-2], 4, 4), dtype=M.dtype)
    K[..., :3, :3] = M + np.swapaxes(M, -1, -2)
    trace = np.trace(M, axis1=-2, axis2=-1)
    for i in range(3):
        K[..., i, i] -= trace
        K[..., 3, i] = K[..., i, 3] = M[..., i - 1, i - 2] - M[..., i - 2, i - 1]
    K[..., 3, 3] = trace
    return K


def _rotate_to_base_axes(quaternion: FloatArray, six: FloatArray) -> FloatArray:
    """Rotate both parts y of each six-vector by R^T.

    With the quaternion's vector part u and scalar part w:

        R^T y = y + 2 w (y x u) + 2 (y x u) x u
    """
    u, w = quaternion[..., np.newaxis, :3], quaternion[..., np.newaxis, 3:]
    y = six.reshape(*six.shape[:-1], 2, 3)
    twice_c = 2.0 * np.cross(y, u)
    rotated: FloatArray = y + w * twice_c + np.cross(twice_c, u)
    return rotated.reshape(*rotated.shape[:-2], 6)


_MAX_NAMES = 5

#: Suffixes of coordinate names, by the number of joint velocities: planar joint 3, floating joint 6.
_Q_SUFFIXES = {3: ("x", "y", "angle"), 6: ("x", "y", "z", "qx", "qy", "qz", "qw")}
#: Suffixes of velocity names, by the number of joint velocities.
_VELOCITY_SUFFIXES = {3: ("vx", "vy", "wz"), 6: ("vx", "vy", "vz", "wx", "wy", "wz")}


class _CoordinateNames:
    """Maps names of joints and coordinates to indices.

    >>> names = _CoordinateNames([("base", 3), ("elbow", 1)], _Q_SUFFIXES)
    >>> names.find_index("base.y"), names.find_index("base"), names.find_index("elbow")
    (1, slice(0, 3, None), 3)
    >>> names.split_pairs("ready, base.x = 5mm, elbow=pi / 2")
    [('base.x', '5mm'), ('elbow', 'pi / 2')]
    """

    def __init__(self, joints: Sequence[tuple[str, int]], suffixes: Mapping[int, tuple[str, ...]]) -> None:
        self._joints, at = dict[str, tuple[int, tuple[str, ...]]](), 0
        for joint, rates in joints:
            self._joints[joint] = at, suffixes.get(rates, ())
            at += len(suffixes.get(rates, "1"))

    def find_index(self, name: str) -> int | slice:
        if name in self._joints:
            at, suffixes = self._joints[name]
            return slice(at, at + len(suffixes)) if suffixes else at
        for joint, (at, suffixes) in self._joints.items():
            suffix = name.removeprefix(joint).lstrip(".:")
            if name.startswith(joint) and suffix in suffixes:
                return at + suffixes.index(suffix)
        raise OracleError("the robot has no coordinate with this name", found=repr(name[:60]))

    def split_pairs(self, text: str) -> list[tuple[str, str]]:
        plain = " ".join(text.split())
        plain = plain[1:-1].strip() if plain[:1] + plain[-1:] in ("[]", "()", "{}") else plain
        names = [
            f"{re.escape(joint)}(?:[.:]+(?:{'|'.join(suffixes)}))?" if suffixes else re.escape(joint)
            for joint, (_, suffixes) in self._joints.items()
        ]
        known = "|".join(sorted(names, key=len, reverse=True))
        starts = list(re.finditer(rf"(?:^|(?<=[ ,]))({known}) ?= ?", plain))
        ends = [*(match.start() for match in starts[1:]), len(plain)]
        return [(m[1], plain[m.end() : end].strip(" ,")) for m, end in zip(starts, ends, strict=False)]


def _parse_number(text: str) -> float:
    found = parse_quantity(text)
    value = parse_float(text) if found is None else found.value
    if value is None:
        raise OracleError(
            "urdfkin and the oracle's reader read this number differently", found=repr(text[:60])
        )
    return value


class BaseRows(NamedTuple):
    """The base's motion in n configurations."""

    placement: FloatArray  # (n, 4, 4)
    velocity: FloatArray  # (n, 6)
    acceleration: FloatArray  # (n, 6)


class QueryBatch(NamedTuple):
    """The arguments of an oracle for n configurations.

    Attributes:
        frames_are_joints: If True, `frames` contains `JointFrame` objects, and the oracle calls Pinocchio's
            functions for joints, such as `getJointJacobian`.
        uses_multi_frame_functions: If True, Pinocchio computes the Jacobian of one frame with the functions
            for several frames. These functions may round differently.
    """

    frames: Sequence[str]
    inputs: tuple[FloatArray, ...]
    reference: Reference | str = Reference.LOCAL_WORLD_ALIGNED
    base: BaseMotionLike | None = None
    frames_are_joints: bool = False
    uses_multi_frame_functions: bool = False

    @property
    def q(self) -> FloatArray:
        return self.inputs[0]

    @property
    def v(self) -> FloatArray:
        return self.inputs[1]

    @property
    def a(self) -> FloatArray:
        return self.inputs[2]


class OracleQuery:
    """The user's arguments of one call.

    Args:
        named_inputs: The user's text or mapping for each of q, v and a, or None for an array.
        joints: Pairs (name, nv).
    """

    def __init__(
        self,
        frame: str | Sequence[str],
        reference: Reference | str,
        base: BaseMotionLike | None,
        inputs: Sequence[ArrayLike],
        named_inputs: Sequence[str | Mapping[str, ArrayLike] | None] = (),
        joints: Sequence[tuple[str, int]] = (),
    ) -> None:
        self._is_one = isinstance(frame, str)
        self.frames = (frame,) if isinstance(frame, str) else tuple(frame)
        self.reference, self.base = reference, base
        self._arrays, self._named, self._joints = inputs, named_inputs or [None] * len(inputs), joints

    def cache_inputs(self) -> None:
        """Convert the inputs before `out` changes. An array in a mapping may share memory with `out`."""
        _ = self._inputs

    @cached_property
    def _inputs(self) -> tuple[FloatArray, ...]:
        return tuple(
            np.asarray(x, dtype=np.float64)
            if named_inputs is None
            else self._set_named_values(np.array(x, float), named_inputs, of)
            for x, named_inputs, of in zip(
                self._arrays, self._named, (_Q_SUFFIXES, _VELOCITY_SUFFIXES, _VELOCITY_SUFFIXES), strict=False
            )
        )

    def _set_named_values(
        self,
        x: FloatArray,
        named_values: str | Mapping[str, ArrayLike],
        suffixes: Mapping[int, tuple[str, ...]],
    ) -> FloatArray:
        names = _CoordinateNames(self._joints, suffixes)
        for name, value in (
            named_values.items() if isinstance(named_values, Mapping) else names.split_pairs(named_values)
        ):
            x[..., names.find_index(name)] = (
                _parse_number(value) if isinstance(value, str) else np.asarray(value, float)
            )
        return x

    @cached_property
    def shape(self) -> tuple[int, ...]:
        axes = [x.shape[:-1] for x in self._inputs]
        if self.base is not None:
            axes += [self.base.placement.shape[:-2], self.base.velocity.shape[:-1]]
            axes.append(self.base.acceleration.shape[:-1])
        return axes[0] if len(set(axes)) == 1 else np.broadcast_shapes(*axes)

    @cached_property
    def n(self) -> int:
        return math.prod(self.shape)

    def select(self, part: slice | IntArray) -> QueryBatch:
        """Select configurations by flat indices."""

        def pick(x: FloatArray, own_axes: int = 1) -> FloatArray:
            batch_shape, own_shape = x.shape[: x.ndim - own_axes], x.shape[x.ndim - own_axes :]
            if batch_shape == self.shape:
                return x.reshape(self.n, *own_shape)[part]
            indices = np.arange(part.start, part.stop) if isinstance(part, slice) else part
            broadcast_x: FloatArray = np.broadcast_to(x, (*self.shape, *own_shape))
            return broadcast_x[np.unravel_index(indices, self.shape)]

        base = self.base
        if base is not None:
            base = BaseRows(pick(base.placement, 2), pick(base.velocity), pick(base.acceleration))
        return QueryBatch(self.frames, tuple(map(pick, self._inputs)), self.reference, base)

    def flatten_result(self, result: FloatArray, own_axes: int) -> FloatArray:
        """Reshape a result to (n, frames, ...), without a change of the last `own_axes` axes.

        Raises:
            OracleError: the batch shapes of the result and of the arguments differ.
        """
        own_shape, frame_axis = (
            result.shape[result.ndim - own_axes :],
            () if self._is_one else (len(self.frames),),
        )
        if result.shape != (*self.shape, *frame_axis, *own_shape):
            raise OracleError(
                "the batch shape of a result does not match that of the arguments", found=str(result.shape)
            )
        return result.reshape(self.n, len(self.frames), *own_shape)


def read_mimic_rules(text: str, joints: Sequence[str], robot: str) -> dict[str, Mimic]:
    try:
        return parse_mimic_rules(text, set(joints))
    except (ValueError, ExpatError) as error:
        raise OracleError(
            "the oracle's reader cannot read the mimic rules", where=robot, found=str(error)
        ) from error


class Oracle:
    """A library's results in urdfkin's layout.

    An oracle takes only names and sizes from `tree`. Results have the shape (n, frames, ...).

    Args:
        mimic: If False, mimic joints are independent joints.
        moving_base: Whether a free-flyer moves the root.
        root_joint: Kind of the root joint that is added to the joints of the text.
        lock: Values of locked joints, rad or m.

    Attributes:
        new_data: Function that makes the data for one thread.
    """

    title: ClassVar[str]
    new_data: Callable[[], Any]

    def __init__(
        self,
        text: str,
        tree: KinematicTree,
        *,
        mimic: bool = True,
        moving_base: bool = False,
        root_joint: str | None = None,
        lock: Mapping[str, float] = MappingProxyType({}),
    ) -> None:
        self.lock = lock
        self.text, self.tree, self.mimic = text, tree, mimic
        self.moving_base, self.root_joint, self._local = moving_base, root_joint, threading.local()

    def read_and_check_rules(self, joints: Sequence[str]) -> dict[str, Mimic]:
        """Return the joints' mimic rules.

        Raises:
            OracleError: a mimic rule is invalid, or the oracle's joints or coordinates have other names or
                another order than the tree's.
        """
        tree = self.tree
        rules = read_mimic_rules(self.text, joints, tree.name) if self.mimic else {}
        coordinates = [name for name in joints if name not in rules]
        for what, theirs, own in (
            ("joints", list(joints), [joint.name for joint in tree.joints if joint.kind.nv]),
            ("coordinates", coordinates, [joint.name for joint in tree.joints if joint.nv]),
        ):
            if theirs != own:
                found = (
                    ", ".join(sorted(set(theirs) ^ set(own))[:_MAX_NAMES])
                    or "the same names in a different order"
                )
                raise OracleError(
                    f"{self.title} finds different {what} in this robot", where=tree.name, found=found
                )
        return rules

    @property
    def data(self) -> Any:
        if not hasattr(self._local, "data"):
            self._local.data = self.new_data()
        return self._local.data

    def placements(self, x: QueryBatch) -> FloatArray:
        """Return T_world_frame (n, frames, 4, 4)."""
        raise NotImplementedError

    def velocities(self, x: QueryBatch) -> FloatArray:
        raise NotImplementedError

    def accelerations(self, x: QueryBatch) -> FloatArray:
        """Return classical accelerations (n, frames, 6)."""
        raise NotImplementedError

    def jacobians(self, x: QueryBatch) -> FloatArray:
        raise NotImplementedError

    def jacobian_blocks(self, x: QueryBatch) -> Iterator[FloatArray]:
        """Yield the Jacobians in blocks. Each block may overwrite the previous block."""
        yield self.jacobians(x)

    def jacobian_rates(self, x: QueryBatch) -> FloatArray:
        raise NotImplementedError

    def hessians(self, x: QueryBatch) -> FloatArray:
        raise OracleError(
            f"{self.title} computes no Hessian", where=self.tree.name, remedy="use oracle='pinocchio'"
        )

    def quaternions(self, x: QueryBatch) -> FloatArray:
        """Return quaternions with qw >= 0, scalar last."""
        out = nearest_quaternion(self.placements(x)[..., :3, :3])
        return np.where(out[..., 3:] < 0.0, -out, out)


def couple_columns(
    full: FloatArray, columns: IntArray, index: IntArray, factor: FloatArray, nv: int
) -> FloatArray:
    """Return the product J_full G; the kernel and NumPy return identical results.

    For each i in `columns`, column i of J_full is multiplied by `factor[i]` and added to column `index[i]` of
    the product. The order of `columns` is the order of the additions.
    """
    rows = np.ascontiguousarray(full).reshape(math.prod(full.shape[:-1]), full.shape[-1])
    if (kernel := preload.get_kernel("coupling", module=VERIFY_KERNELS_MODULE)) is None:
        begin = time.thread_time()
        sums = _couple_rows(rows, columns, index, factor, nv)
        preload.add_time("coupling", time.thread_time() - begin)
        return sums.reshape(*full.shape[:-1], nv)
    out = np.zeros(len(rows) * nv)
    kernel(rows, columns, index, factor, out)
    return out.reshape(*full.shape[:-1], nv)


@np.errstate(all="ignore")
def _couple_rows(
    rows: FloatArray, columns: IntArray, index: IntArray, factor: FloatArray, nv: int
) -> FloatArray:
    sums = np.zeros((len(rows), nv))
    for column in columns:
        sums[:, index[column]] += rows[:, column] * factor[column]
    return sums
