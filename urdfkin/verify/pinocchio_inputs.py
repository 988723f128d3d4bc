"""Mimic rules as the URDF's text states them, for the oracle: read apart from urdfkin's own reader.

Pinocchio couples nothing here (see `urdfkin.verify.pinocchio`), so that a rule which the reader got wrong
would be wrong on both sides, and agree. So nothing is taken from the document that `urdfkin.lint` read,
neither its elements nor its records: who guards a reading must not read through it. Like Pinocchio, this
takes the text, and only when a result is first checked; `load` reads it once.


Where each number of a user's q, v and a stands in Pinocchio's model, from that model and the text alone.

The layout is the one that the README promises: joints in Pinocchio's order; one number for a revolute,
continuous or prismatic joint, three for a planar and seven for a floating one; none for a follower. Nothing
of `KinematicTree` enters, so that a coordinate that urdfkin gives to another joint is found.


Which of Pinocchio's frames a name means, from the names and kinds in Pinocchio's own model.

`KinematicTree.frame_link` answers the same question from urdfkin's reading. The two share no code: a name
that the one takes for another frame's is found by the comparison of the numbers.


A moving base for Pinocchio, from the user's numbers: nothing of `BaseMotion`'s arithmetic is shared.

What a base's rotation means is said in `urdfkin.kinematics.rotation.matrix`: the rotation nearest to the
matrix that was given. urdfkin goes there by a step of Newton's; here it is Davenport's q-method: among unit
quaternions q^T K q = trace(R(q)^T M) is largest for the nearest rotation, so that its quaternion, which a
free-flyer takes, is the eigenvector of the largest eigenvalue of K.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from urdfkin.errors import OracleError
from urdfkin.model.frame_names import JointFrame, LinkFrame
from urdfkin.model.tree import FloatArray, Mimic
from urdfkin.urdf.plain_xml import plain_xml
from urdfkin.verify.mimic_columns import Places, coupled


def rules_of_text(text: str, joints: Collection[str]) -> dict[str, Mimic]:
    """Whom each follower follows as the text says, chains followed to the joint that moves by itself.

    Args:
        text: The URDF.
        joints: The joints that move; others follow nobody, whatever the text says.

    Raises:
        ValueError: a rule's numbers are no numbers.
        expat.ExpatError: the text is not well-formed.
    """
    if "mimic" not in text:
        return {}
    rules = {
        name: Mimic(rule.get("joint", ""), float(rule.get("multiplier", "1")), float(rule.get("offset", "0")))
        for joint in plain_xml(text).iterfind("joint")
        if (rule := joint.find("mimic")) is not None and (name := joint.get("name", "")) in joints
    }
    known: dict[str, Mimic] = {}
    return {follower: _to_the_end(follower, rules, known) for follower in rules}


def _to_the_end(follower: str, rules: dict[str, Mimic], known: dict[str, Mimic]) -> Mimic:
    """q_follower = m_1 (m_2 (... q_leader ... + o_2) + o_1, multiplied out from the leader's end.

    What is found is kept in `known`: in a chain of followers, each is asked for once.
    """
    chain = [follower]
    while (leader := rules[chain[-1]].leader) in rules and leader not in known and len(chain) <= len(rules):
        chain.append(leader)
    for name in reversed(chain):
        rule = rules[name]
        end = known.get(rule.leader, Mimic(rule.leader, 1.0, 0.0))
        offset = rule.multiplier * end.offset + rule.offset
        known[name] = Mimic(end.leader, rule.multiplier * end.multiplier, offset)
    return known[follower]


#: urdfkin's coordinates for a joint to which Pinocchio gives so many (nq, nv).
_CONTINUOUS, _PLANAR, _FLOATING = (2, 1), (4, 3), (7, 6)
_COORDINATES = {(1, 1): 1, _CONTINUOUS: 1, _PLANAR: 3, _FLOATING: 7}


class _Place(NamedTuple):
    """A joint: its sizes and first places in Pinocchio's model, its first places in q and v, and its rule."""

    sizes: tuple[int, int]
    full_q: int
    full_v: int
    q: int
    v: int
    multiplier: float
    offset: float


class Layout:
    """The way from q, v and a to Pinocchio's, and from its columns back.

    Args:
        model: Pinocchio's model.
        joints: The robot's own joints, by Pinocchio's numbers, in order.
        names: Their names.
        rules: Whom each follower follows.

    Attributes:
        nq: Length of q.
        nv: Length of v.
        joint_ids: The robot's moving joints, followers too, by Pinocchio's numbers.
        coordinates: Names of the joints that have coordinates of their own.
        rate_columns: Pinocchio's columns of their rates, in that order.
    """

    def __init__(
        self, model: Any, joints: Sequence[int], names: Sequence[str], rules: Mapping[str, Mimic]
    ) -> None:
        self._model, self.joint_ids = model, list(joints)
        sizes = [(int(model.joints[j].nq), int(model.joints[j].nv)) for j in joints]
        at, self.nq, self.nv = dict[str, tuple[int, int]](), 0, 0
        for name, own in zip(names, sizes, strict=True):
            if name not in rules:
                at[name] = self.nq, self.nv
                self.nq, self.nv = self.nq + _COORDINATES[own], self.nv + own[1]
        self.coordinates = tuple(at)
        self._places = list[_Place]()
        for j, name, own in zip(joints, names, sizes, strict=True):
            rule = rules.get(name, Mimic(name, 1.0, 0.0))
            if rule.leader not in at:
                raise OracleError(
                    "Pinocchio knows no joint to follow", where=f"joint {name}", found=repr(rule.leader)
                )
            full = int(model.joints[j].idx_q), int(model.joints[j].idx_v)
            self._places.append(_Place(own, *full, *at[rule.leader], rule.multiplier, rule.offset))
        self.rate_columns = [place.full_v + c for place in self._places for c in range(place.sizes[1])]
        self._index, self._factor = self._rates()
        #: Whether Pinocchio's coordinates, and its rates, are the robot's as they stand.
        plain = [(p.q, (1, 1), 1.0, 0.0) == (p.full_q, p.sizes, p.multiplier, p.offset) for p in self._places]
        self._same_q = all(plain) and model.nq == self.nq
        self._same_v = model.nv == self.nv and bool((self._factor == 1.0).all())
        self._same_v &= bool((self._index == np.arange(model.nv)).all())

    def _rates(self) -> tuple[Places, FloatArray]:
        """For each of Pinocchio's rates: which of v it is, and the factor (G); 0 where it is the base's."""
        index, factor = np.zeros(self._model.nv, dtype=np.int64), np.zeros(self._model.nv)
        for place in self._places:
            for c in range(place.sizes[1]):
                index[place.full_v + c] = place.v + c
                factor[place.full_v + c] = place.multiplier
        return index, factor

    def configurations(self, q: FloatArray) -> FloatArray:
        """(n, Pinocchio's nq) for (n, nq); quaternions are brought to norm 1 here, as they are given."""
        if self._same_q:
            return np.array(q)
        full = np.zeros((len(q), self._model.nq))
        for sizes, at, _, own, _, multiplier, offset in self._places:
            if sizes == _FLOATING:
                full[:, at : at + 7] = q[:, own : own + 7]
                full[:, at + 3 : at + 7] /= np.linalg.norm(full[:, at + 3 : at + 7], axis=1, keepdims=True)
            elif sizes == _PLANAR:
                full[:, at : at + 2] = q[:, own : own + 2]
                full[:, at + 2], full[:, at + 3] = np.cos(q[:, own + 2]), np.sin(q[:, own + 2])
            else:
                value = multiplier * q[:, own] + offset
                if sizes == _CONTINUOUS:
                    full[:, at], full[:, at + 1] = np.cos(value), np.sin(value)
                else:
                    full[:, at] = value
        return full

    def rates(self, v: FloatArray) -> FloatArray:
        """(n, Pinocchio's nv) for (n, nv): v_full = G v."""
        if not self.nv:
            return np.zeros((len(v), self._model.nv))
        full: FloatArray = v[:, self._index] * self._factor
        return full

    def couple(self, full: FloatArray) -> FloatArray:
        """J_full G: columns of followers are added to their leaders'; a base's are left out."""
        if self._same_v:
            return full
        return coupled(full, np.array(self.rate_columns, dtype=np.int64), self._index, self._factor, self.nv)


#: Pinocchio's name of the world, which is what a root joint hangs from.
WORLD = "universe"
_PREFIXED = re.compile(r"(link|joint):(.*)", re.DOTALL)


class Frames:
    """Pinocchio's frames by name.

    Args:
        model: Pinocchio's model, as its parser made it.
        pin: The module.
        stands_on_world: Whether the robot hangs from a root joint: then the world is a link of it.
    """

    def __init__(self, model: Any, pin: Any, *, stands_on_world: bool) -> None:
        self._robot = str(model.name)
        self._bodies, self._joints = dict[str, int](), dict[str, int]()
        self._parents = [int(frame.parentFrame) for frame in model.frames]
        for index, frame in enumerate(model.frames):
            if index:  # the first is the world
                names = self._bodies if frame.type == pin.FrameType.BODY else self._joints
                names[frame.name] = index
        if stands_on_world:
            self._bodies[WORLD] = 0

    def index(self, name: str) -> int:
        """The frame that a name stands for, in the model as it was given.

        Raises:
            OracleError: nothing is called so, or a body and a joint in another place both are.
        """
        if isinstance(name, LinkFrame):
            return self._known(self._bodies, name, str(name)[5:])
        if isinstance(name, JointFrame):
            return self._known(self._joints, name, str(name)[6:])
        body, joint = self._bodies.get(name), self._joints.get(name)
        if body is not None and joint is not None and self._parents[body] != joint:
            raise self._error("two of Pinocchio's frames have this name", name)
        if body is not None:
            return body
        if joint is not None:
            return joint
        if (parts := _PREFIXED.fullmatch(name)) is None:
            raise self._error("Pinocchio has no such frame", name)
        return self._known(self._bodies if parts[1] == "link" else self._joints, name, parts[2])

    def _known(self, names: dict[str, int], asked: str, own: str) -> int:
        if (index := names.get(own)) is None:
            raise self._error("Pinocchio has no such frame", asked)
        return index

    def _error(self, what: str, name: str) -> OracleError:
        return OracleError(what, where=self._robot, found=repr(str(name)))


class BaseNumbers(Protocol):
    """A base's motion as the user gave it, each with one leading batch axis or none."""

    @property
    def placement(self) -> FloatArray:
        """(..., 4, 4) T_world_base."""

    @property
    def velocity(self) -> FloatArray:
        """(..., 6) [linear; angular] in world axes."""

    @property
    def acceleration(self) -> FloatArray:
        """(..., 6) likewise, classical."""


def free_flyer(base: BaseNumbers) -> FloatArray:
    """(..., 7) x, y, z, qx, qy, qz, qw of the base."""
    T = np.asarray(base.placement)
    return np.concatenate((T[..., :3, 3], nearest_quaternion(T[..., :3, :3])), axis=-1)


def free_flyer_rates(base: BaseNumbers) -> FloatArray:
    """(..., 6) its rates: the base's velocity in its own axes."""
    return _in_own_axes(free_flyer(base)[..., 3:], np.asarray(base.velocity))


def free_flyer_second_rates(base: BaseNumbers) -> FloatArray:
    """(..., 6) their rates: the spatial acceleration, acc - w x vel, in the base's own axes."""
    vel, acc = np.broadcast_arrays(base.velocity, base.acceleration)
    linear = acc[..., :3] - np.cross(vel[..., 3:], vel[..., :3])
    return _in_own_axes(free_flyer(base)[..., 3:], np.concatenate((linear, acc[..., 3:]), axis=-1))


def nearest_quaternion(M: FloatArray) -> FloatArray:
    """(..., 4) unit quaternion, scalar last, of the rotation nearest to (..., 3, 3)."""
    K = davenport(M)
    q = np.linalg.eigh(K).eigenvectors[..., -1:]
    # Of a rotation K + I is 4 q q^T: multiplied once more, what LAPACK left of other eigenvectors is gone.
    q = (K @ q + q)[..., 0]
    unit: FloatArray = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return unit


def davenport(M: NDArray[Any]) -> NDArray[Any]:
    """(..., 4, 4) K of (..., 3, 3), floats or other numbers; of a rotation it is 4 q q^T - I."""
    K = np.empty((*M.shape[:-2], 4, 4), dtype=M.dtype)
    K[..., :3, :3] = M + np.swapaxes(M, -1, -2)
    trace = np.trace(M, axis1=-2, axis2=-1)
    for i in range(3):
        K[..., i, i] -= trace
        K[..., 3, i] = K[..., i, 3] = M[..., i - 1, i - 2] - M[..., i - 2, i - 1]
    K[..., 3, 3] = trace
    return K


def _in_own_axes(quaternion: FloatArray, six: FloatArray) -> FloatArray:
    """R^T of both halves, by the quaternion itself: x + 2 w (x x u) + 2 (x x u) x u."""
    u, w = quaternion[..., np.newaxis, :3], quaternion[..., np.newaxis, 3:]
    x = six.reshape(*six.shape[:-1], 2, 3)
    aside = 2.0 * np.cross(x, u)
    turned: FloatArray = x + w * aside + np.cross(aside, u)
    return turned.reshape(*turned.shape[:-2], 6)
