"""The face of the library: a robot that computes with the text's recursion and has each result checked.

`verify=True`, the default, holds every result against Pinocchio's before it is handed out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from urdfkin import configuration
from urdfkin.call import Call
from urdfkin.demands import switch, whole_number
from urdfkin.errors import InputError, NotFiniteError
from urdfkin.lint import Finding
from urdfkin.manipulator import Manipulator
from urdfkin.oracle import Oracle, OracleError, version
from urdfkin.origin import Origin
from urdfkin.prepared import PreparedFrame
from urdfkin.recursion import evaluate
from urdfkin.recursion.base import BaseMotion
from urdfkin.recursion.plan import Plan, make_plan
from urdfkin.reference import Reference
from urdfkin.rotation.arrays import floats, scalars
from urdfkin.tables import Tables
from urdfkin.tree import FloatArray, KinematicTree
from urdfkin.verification.bounds import Quantity
from urdfkin.verification.certificate import Certificate, Ledger
from urdfkin.verification.choosing import Verify, checked_choice
from urdfkin.verification.sampling import sample

if TYPE_CHECKING:
    from urdfkin.enclosure import Enclosures

_ALIGNED = Reference.LOCAL_WORLD_ALIGNED
#: More than these no array can hold, on any machine.
_MOST_NUMBERS = (2**63 - 1) // 8


class Robot(Manipulator, Tables):
    """A robot that was loaded; make one with `urdfkin.load`.

    Configurations `q` are (..., nq), rates `v` and `a` (..., nv), with any leading batch shape; the three
    broadcast against each other. Joint order and rates are Pinocchio's.

    Attributes:
        tree: Links and joints.
        urdf: The URDF text that Pinocchio checks against.
        origin: What was given to `load`.
        verify: Whether results are checked unless a call says otherwise.
        mimic: As it was given to `load`; False too where the catalogue turns it off.
        findings: What there was to say about the URDF; no errors.
        unverifiable: Why Pinocchio cannot check this robot; None if it can, as far as is known.
        base_frame: The catalogue's base for chains; for other robots the root link.
    """

    def __init__(
        self,
        tree: KinematicTree,
        urdf: str,
        *,
        origin: Origin,
        verify: Verify = True,
        mimic: bool | None = None,
        findings: tuple[Finding, ...] = (),
        unverifiable: str | None = None,
        base_frame: str | None = None,
        tip_frame: str | None = None,
    ) -> None:
        self.tree = tree
        self.urdf = urdf
        self.origin = origin
        self.verify = checked_choice(verify)
        self.mimic = mimic
        self.findings = findings
        self.base_frame = base_frame or tree.frame_name(0)
        self._tip_frame = tip_frame
        self.unverifiable = unverifiable
        self.ledger = Ledger()
        self._plans: dict[tuple[int, ...], Plan] = {}
        self._oracles: dict[bool, Oracle] = {}
        self._prepared: dict[object, PreparedFrame] = {}

    def __getstate__(self) -> dict[str, Any]:
        # Pinocchio's models are rebuilt where they are needed; compiled plans are cheap to rebuild too.
        # A copy, in this process or another, has handed out nothing yet: its ledger is empty.
        return {**self.__dict__, "ledger": Ledger(), "_plans": {}, "_oracles": {}, "_prepared": {}}

    def __repr__(self) -> str:
        return f"<Robot {self.name}: nq {self.nq}, nv {self.nv}, {len(self.tree.links)} links>"

    # -- what it is ----------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """The robot's name in the URDF."""
        return self.tree.name

    @property
    def source(self) -> str:
        """Where it comes from: a path, a catalogue name, `-`, `<text>`."""
        return self.origin.source

    @property
    def root_joint(self) -> str | None:
        """What the root link hangs from, as it was given to `load`."""
        return self.origin.root_joint

    @property
    def nq(self) -> int:
        """Length of a configuration."""
        return self.tree.nq

    @property
    def nv(self) -> int:
        """Length of the rates."""
        return self.tree.nv

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Moving joints in Pinocchio's order, followers too."""
        return tuple(joint.name for joint in self.tree.joints if joint.kind.nv)

    @property
    def link_names(self) -> tuple[str, ...]:
        """Every link, root first, in the order in which all frames are handed out."""
        return self.tree.links

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """A name for each number of `q`."""
        return configuration.coordinate_names(self.tree)

    @property
    def rate_names(self) -> tuple[str, ...]:
        """A name for each number of `v` and `a`, and for each column of a Jacobian."""
        return configuration.rate_names(self.tree)

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Every link and joint, each once, under Pinocchio's names."""
        return self.tree.frame_names

    @property
    def all_frames(self) -> tuple[str, ...]:
        """Every link and every joint once, as `link:NAME` and `joint:NAME`.

        No name stands for two: each is a `FrameName`, which means the link or joint NAME even where another
        is itself called `link:NAME`.
        """
        return (*self.tree.link_frames, *self.tree.joint_frames)

    @property
    def tip_frame(self) -> str:
        """The catalogue's tip; for other robots the leaf that most joints lie before."""
        if self._tip_frame is None:
            leaf = max(
                self.tree.leaves(), key=lambda link: sum(self.tree.joints[i].nv for i in self.tree.path(link))
            )
            self._tip_frame = self.tree.frame_name(leaf)
        return self._tip_frame

    def neutral(self) -> FloatArray:
        """(nq,) zeros, and the identity quaternion for floating joints."""
        return configuration.neutral(self.tree)

    def sample(self, n: int, seed: int = 0) -> FloatArray:
        """(n, nq) configurations within limits, followers' too; the same seed gives the same ones.

        Where a follower's limits leave its leader no room, the leader keeps to its own, and
        `limit_violations` names the follower.

        Raises:
            InputError: `n` or `seed` is no whole number from 0 on.
        """
        n = whole_number(n, "n", 0, _MOST_NUMBERS // max(1, self.nq))
        seed = whole_number(seed, "seed", 0)
        return sample(self.tree, n, np.random.default_rng(seed))

    def limit_violations(self, q: ArrayLike) -> list[str]:
        """One line for each joint that leaves its bounds somewhere in `q` (..., nq)."""
        return configuration.limit_violations(self.tree, self.checked(q, "q"))

    def to_pinocchio(self, q: ArrayLike, *, mimic: bool = False) -> FloatArray:
        """(..., nq) to the configuration of `pinocchio.buildModelFromUrdf(path, mimic=mimic)`."""
        return configuration.to_pinocchio(self.tree, self.checked(q, "q"), mimic=switch(mimic, "mimic"))

    def from_pinocchio(self, q: ArrayLike, *, mimic: bool = False) -> FloatArray:
        """The inverse of `to_pinocchio`; angles of continuous joints come back in (-pi, pi]."""
        return configuration.from_pinocchio(self.tree, scalars(q, "q"), mimic=switch(mimic, "mimic"))

    # -- what it computes ----------------------------------------------------------------------------

    def placement(
        self,
        q: ArrayLike,
        frame: str,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., 4, 4) T_world_frame, eq. 7.77 with the rotations alongside.

        Args:
            q: (..., nq) rad, m.
            frame: A link's or joint's name.
            base: How the root link moves; None if it stands at the world's origin.
            out: C-contiguous float64 array of the result's shape to write into; after an error it may hold
                anything.
            verify: Whether Pinocchio checks this call; "sample" has 100 of its configurations checked; None
                leaves it to the robot.
            threads: How many compute a batch; None: every processor from 4,096 configurations on. The
                results do not depend on it.

        Raises:
            InputError: wrong length, a number that is not finite, a batch that does not broadcast.
            UnknownNameError: no such frame.
            VerificationError: Pinocchio computes something else.
        """
        if (
            (base is None and threads is None)
            and (fast := self._fast(frame, _ALIGNED, verify))
            and (one := fast._placement(q, out)) is not None
        ):
            return one
        call = Call(self, (frame,), _ALIGNED, base, q)
        to = call.flat(out, 4, 4)
        poses = call.compute(evaluate.placements, call.plan, call.q, base=call.state, out=to, threads=threads)
        result = call.one(poses, out)
        call.verify(Quantity.PLACEMENT, result, verify)
        return result

    def velocity(
        self,
        q: ArrayLike,
        v: ArrayLike,
        frame: str,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., 6) [linear; angular] m/s, rad/s: eq. 7.127, 7.128. Arguments and errors as `placement`."""
        if (
            (base is None and threads is None)
            and (fast := self._fast(frame, reference, verify))
            and (one := fast._velocity(q, v, out)) is not None
        ):
            return one
        call = Call(self, (frame,), reference, base, q, v)
        walk, to = (call.plan, call.q, *call.rates, call.reference), call.flat(out, 6)
        sixes = call.compute(evaluate.velocities, *walk, base=call.state, out=to, threads=threads)
        result = call.one(sixes, out)
        call.verify(Quantity.VELOCITY, result, verify)
        return result

    def jacobian(
        self,
        q: ArrayLike,
        frame: str,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., 6, nv) velocity Jacobian, eq. 7.85. Arguments and errors as `placement`.

        Column i is the frame's velocity [linear; angular] for a unit rate of `rate_names[i]` alone.
        """
        if (
            (base is None and threads is None)
            and (fast := self._fast(frame, reference, verify))
            and (one := fast._jacobian(q, out)) is not None
        ):
            return one
        call = Call(self, (frame,), reference, base, q)
        walk, to = (call.plan, call.q, call.reference), call.flat(out, 6, self.nv)
        Js = call.compute(evaluate.jacobians, *walk, base=call.state, out=to, threads=threads)
        result = call.one(Js, out)
        call.verify(Quantity.JACOBIAN, result, verify)
        return result

    def acceleration(
        self,
        q: ArrayLike,
        v: ArrayLike,
        a: ArrayLike,
        frame: str,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., 6) classical acceleration [linear; angular] m/s^2, rad/s^2: eq. 7.129, 7.130.

        Gravity is not in it. Arguments and errors as `placement`.
        """
        if (
            (base is None and threads is None)
            and (fast := self._fast(frame, reference, verify))
            and (one := fast._acceleration(q, v, a, out)) is not None
        ):
            return one
        call = Call(self, (frame,), reference, base, q, v, a)
        walk, to = (call.plan, call.q, *call.rates, call.reference), call.flat(out, 6)
        sixes = call.compute(evaluate.accelerations, *walk, base=call.state, out=to, threads=threads)
        result = call.one(sixes, out)
        call.verify(Quantity.ACCELERATION, result, verify)
        return result

    def enclose(
        self,
        q: ArrayLike,
        v: ArrayLike,
        a: ArrayLike,
        frame: str,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        digits: int | None = None,
    ) -> Enclosures:
        """Intervals proven to contain the true placement, velocity, acceleration, J and J-dot of one sample.

        "True" are the equations' values (7.77, 7.85, 7.126 to 7.130) for the URDF's decimals as they are
        written and the doubles of q, v, a and `base` as they are. For each number there are the two doubles
        between which its value lies, nearly always neighbours, and whether urdfkin's own and Pinocchio's are
        among them. That takes some five milliseconds for each joint before the frame.

        Args:
            q: (nq,) rad, m.
            v: (nv,) rad/s, m/s.
            a: (nv,) rad/s^2, m/s^2.
            frame: A link's or joint's name.
            reference: For which point and in which axes.
            base: How the root link moves; None if it stands at the world's origin.
            digits: Of the intervals' ends on the way; None: 30, and one for each joint before the frame: the
                results' ends are then neighbouring doubles. 15, a double's, show what rounding can cost.

        Raises:
            InputError: a batch, wrong length, or fewer digits than 15.
            UnknownNameError: no such frame or reference.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> q, v, a = [0.3, -0.4], [1.0, 0.5], [0.0, 0.2]
        >>> proof = arm.enclose(q, v, a, arm.tip_frame)
        >>> J = arm.jacobian(q, arm.tip_frame)
        >>> bool((proof.jacobian.error(J) < 4e-16).all())
        True
        """
        from urdfkin.enclosure import enclose  # noqa: PLC0415  loads mpmath

        return enclose(self, (q, v, a), frame, reference, base, digits)

    def prepare(self, frame: str, reference: Reference | str = _ALIGNED) -> PreparedFrame:
        """One frame in one reference, for one configuration after the other, without a check: see there.

        Raises:
            UnknownNameError: no such frame or reference.
        """
        # The hash of an enumeration's member takes longer than the rest of this. With its type in the key,
        # 1, which is equal to a member, is not taken for it.
        # Nor is `LinkFrame("link:a")` the frame of a link that is called so.
        plain = reference is _ALIGNED and type(frame) is str
        key = frame if plain else (type(frame), frame, type(reference), reference)
        try:
            prepared = self._prepared.get(key)
        except TypeError:  # no hash, and so hardly a name
            self.tree.frame_link(frame)
            return self.prepare(frame, Reference.of(reference))
        if prepared is None:
            plan = self.plan([self.tree.frame_link(frame)])
            prepared = self._prepared[key] = PreparedFrame(self, frame, Reference.of(reference), plan)
        return prepared

    # -- what it is worth ----------------------------------------------------------------------------

    def certificate(self) -> Certificate:
        """What was checked so far, how closely it agreed, by which Pinocchio, and what was not checked."""
        return self.ledger.certificate(self.name, version())

    # -- inside --------------------------------------------------------------------------------------

    def plan(self, links: Sequence[int]) -> Plan:
        """The walk that meets the given links, made once."""
        key = tuple(links)
        if (plan := self._plans.get(key)) is None:
            plan = self._plans[key] = make_plan(self.tree, key)
        return plan

    def oracle(self, base: BaseMotion | None) -> Oracle:
        """Pinocchio's model of the robot, made once; on a free-flyer if the base moves."""
        moving = base is not None
        if moving not in self._oracles:
            self._oracles[moving] = Oracle(
                self.urdf,
                self.tree,
                mimic=self.mimic is not False,
                moving_base=moving,
                root_joint=self.root_joint,
            )
        return self._oracles[moving]

    def _fast(self, frame: str, reference: Reference | str, verify: Verify | None) -> PreparedFrame | None:
        """The short way for a single configuration that nobody checks; None where it is not for this call."""
        if verify is not False and (verify is not None or self.verify is not False):
            return None
        if reference is _ALIGNED and type(frame) is str and (fast := self._prepared.get(frame)) is not None:
            return fast
        return self.prepare(frame, reference)

    def cannot_verify(self, base: BaseMotion | None = None) -> str | None:
        """Why Pinocchio cannot check this robot; None if it can."""
        if self.unverifiable is None:
            try:
                self.oracle(base)
            except OracleError as error:
                self.unverifiable = str(error)
        return self.unverifiable

    def shaped(self, value: ArrayLike, what: str) -> FloatArray:
        """`value` as float64 with the right last axis."""
        array = floats(value, what)
        width = self.nq if what == "q" else self.nv
        if array.shape[-1:] != (width,):
            names = self.coordinate_names if what == "q" else self.rate_names
            raise InputError(
                f"{what} needs {width} numbers for {self.name}: {', '.join(names) or 'none, nothing moves'}",
                found=f"shape {array.shape}",
            )
        return configuration.with_unit_quaternions(self.tree, array) if what == "q" else array

    def checked(self, value: ArrayLike, what: str) -> FloatArray:
        """The same, and every number finite."""
        array = self.shaped(value, what)
        if not np.isfinite(array).all():
            names = self.coordinate_names if what == "q" else self.rate_names
            where = np.argwhere(~np.isfinite(array))[0]
            raise NotFiniteError(
                f"{what} must be finite", where=names[where[-1]], found=str(array[tuple(where)])
            )
        return array
