"""The face of the library: a robot that computes with the text's recursion and has each result checked.

`verify=True`, the default, holds every result against Pinocchio's before it is handed out.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from copy import copy
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.compiled.batch import in_parts
from urdfkin.compiled.breakdown import KINDS, AccelerationBreakdown, moving_joints
from urdfkin.compiled.plan import CompiledTree, compile_tree
from urdfkin.compiled.prepared import PreparedFrame
from urdfkin.dh.make import dh_table
from urdfkin.dh.screws import ProductOfExponentials, screws_of
from urdfkin.dh.table import DHTable
from urdfkin.dh.tree_parameters import TreeParameters, tree_parameters
from urdfkin.errors import InputError, RangeError, RepresentationSingularityError
from urdfkin.errors.display import Displayable, TextDocument
from urdfkin.errors.escape import log_line
from urdfkin.errors.validators import (
    as_bool,
    as_choice,
    as_names,
    as_str,
    real_number,
    safe_repr,
    whole_number,
)
from urdfkin.export import QUANTITIES as EXPORTED
from urdfkin.kinematics.bodies import QUATERNION, seen_from
from urdfkin.kinematics.inputs import scalars, vectors
from urdfkin.kinematics.rotation.euler import NEAREST
from urdfkin.kinematics.roundings import EPS
from urdfkin.lint.finding import Finding, Findings
from urdfkin.model import configuration, integration
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.chain import FrameChain, chain
from urdfkin.model.configuration_like import Given, listed
from urdfkin.model.frame_names import FrameName, LinkFrame
from urdfkin.model.reference import Reference
from urdfkin.model.summary import described
from urdfkin.model.tree import FloatArray, Joint, KinematicTree
from urdfkin.system.lazy_import import hook
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.joint_order import order_words
from urdfkin.urdf.sources import Origin
from urdfkin.verify.bounds import magnitudes, movable, nearest_singularity
from urdfkin.verify.call import Call
from urdfkin.verify.certificate import Certificate
from urdfkin.verify.chain_checks import check_screws
from urdfkin.verify.oracles import WitnessName
from urdfkin.verify.quantities import (
    ACCELERATION_BREAKDOWN,
    ANALYTICAL_JACOBIAN,
    JACOBIAN,
    PLACEMENT,
    QUANTITIES,
    RELATIVE_PLACEMENT,
    quantity,
    walked,
)
from urdfkin.verify.sampling import Verify, sample
from urdfkin.verify.singular_values import SingularValues, singular_values
from urdfkin.verify.verifier import Verifier

if TYPE_CHECKING:
    from urdfkin.export.compiled_frame import CompiledFrame
    from urdfkin.verify.exact.enclosure import Enclosures

_ALIGNED = Reference.LOCAL_WORLD_ALIGNED
#: m/s^2, as Pinocchio and MuJoCo have it.
GRAVITY = (0.0, 0.0, -9.81)
_ROWS = {"all": slice(0, 6), "linear": slice(0, 3), "angular": slice(3, 6)}
#: Methods and attributes of a robot that are for the package's own parts.
_INSIDE = {"plan", "verifier"}
#: More than these no array can hold, on any machine.
_MOST_NUMBERS = (2**63 - 1) // 8


class Robot(Displayable):
    """A robot that was loaded; make one with `urdfkin.load`.

    Configurations `q` are (..., nq), rates `v` and `a` (..., nv), with any leading batch shape; the three
    broadcast against each other. Joint order and rates are Pinocchio's. Each may also be given by name, as a
    mapping `{"elbow": 0.5, "wrist": "30deg"}` whose values may be batches, or as text `"elbow=0.5, wrist=2"`,
    `"ready"`, `"ready, elbow=0.5"` with a pose out of `poses`; a name that is missing is an error.

    Attributes:
        tree: Links and joints.
        verifier: What checks its results: the text that Pinocchio reads, and what was found so far.
        findings: What there was to say about the URDF; no errors.
        base_frame: The catalogue's base for chains; for other robots the root link.
    """

    def __init__(
        self,
        tree: KinematicTree,
        urdf: str,
        *,
        origin: Origin,
        verify: Verify = True,
        mimic: bool = True,
        findings: Sequence[Finding] = (),
        unverifiable: str | None = None,
        oracle: WitnessName = "pinocchio",
        base_frame: str | None = None,
        tip_frame: str | None = None,
    ) -> None:
        self.tree = tree
        self.verifier = Verifier(
            urdf, tree, origin, policy=verify, mimic=mimic, unverifiable=unverifiable, oracle=oracle
        )
        self.findings = Findings(findings)
        self.base_frame = base_frame or tree.frame_name(0)
        self._tip_frame = tip_frame
        self._has_one_tip = tip_frame is not None or len(list(tree.leaves())) == 1
        self._plans: dict[tuple[int, ...], CompiledTree] = {}
        self._prepared: dict[object, PreparedFrame] = {}
        self._compiled: dict[object, CompiledFrame] = {}

    def __getstate__(self) -> dict[str, Any]:
        # Compiled plans are cheap to rebuild where they are needed; a copy has an account of its own.
        made: dict[str, Any] = {"_plans": {}, "_prepared": {}, "_compiled": {}}
        return {**self.__dict__, "verifier": copy(self.verifier), **made}

    def __repr__(self) -> str:
        return log_line(f"<Robot {self.name}: nq {self.nq}, nv {self.nv}, {len(self.tree.links)} links>")

    def __dir__(self) -> list[str]:
        # What the package's own parts ask of a robot is not what people complete names for.
        return [name for name in super().__dir__() if name not in _INSIDE]

    def _sheet(self) -> TextDocument:
        order = order_words(self.urdf, self.joint_names)
        return described(self.tree, self.base_frame, self.tip_frame, order)

    def view(self, q: Given = "ready", *, height: int = 480) -> Any:
        """The robot in three dimensions, with a slider for each joint, in a notebook's cell.

        It needs no network and no server, is kept with the notebook, and moves in the browser by itself: what
        it draws is for the eye, and not checked. `urdfkin view` checks as it moves.

        Args:
            q: (nq,) where it begins.
            height: Of the cell, pixels.

        Raises:
            InputError: wrong length, a number that is not finite, a batch.
        """
        q_0 = configuration.checked(self.tree, q, "q")
        if q_0.ndim != 1:
            raise InputError("a view begins at one configuration", found=f"shape {q_0.shape}")
        return hook("a robot in a cell")(self, q_0, whole_number(height, "height", 1, 10_000))

    # -- what it is ----------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """The robot's name in the URDF."""
        return self.tree.name

    @property
    def urdf(self) -> str:
        """The URDF text that Pinocchio checks against."""
        return self.verifier.text

    @property
    def origin(self) -> Origin:
        """What was given to `load`."""
        return self.verifier.origin

    @property
    def source(self) -> str:
        """Where it comes from: a path, a catalogue name, `-`, `<text>`."""
        return self.origin.source

    @property
    def sha256(self) -> str:
        """The digest of the URDF's text as UTF-8, or of the MJCF file without what it includes."""
        return self.verifier.sha256

    @property
    def path(self) -> str | None:
        """Where the file stands; None for what was given as text."""
        entry = catalogue().get(self.source)
        path = entry.path if entry is not None else Path(self.source)
        return str(path.resolve()) if not self.source.startswith(("<", "-")) and path.is_file() else None

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
        """Every link, root first."""
        return self.tree.links

    @property
    def link_frames(self) -> tuple[LinkFrame, ...]:
        """Every link as a frame, `link:NAME`, to be asked for all at once; no name stands for two."""
        return self.tree.link_frames

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

    def _default_frame(self) -> str:
        """The tip, where there is no choice: the catalogue's, or the one leaf."""
        if not self._has_one_tip:
            leaves = [self.tree.frame_name(leaf) for leaf in self.tree.leaves()]
            raise InputError(
                "which frame? The robot ends in several",
                where=self.name,
                found=listed(leaves),
                remedy=f"name one, such as robot.tip_frame, {self.tip_frame!r}",
            )
        return self.tip_frame

    @property
    def joints(self) -> dict[str, Joint]:
        """Every joint by its name, fixed ones too, in Pinocchio's order: kind, axis, limit, mimic rule."""
        return {joint.name: joint for joint in self.tree.joints}

    @property
    def frames(self) -> dict[str, str]:
        """Every frame's name and the link that carries it: a joint's frame is its child link's."""
        of = zip(self.tree.joints, self.tree.links[1:], strict=True)
        return {joint.name: link for joint, link in of} | {link: link for link in self.tree.links}

    @property
    def limits(self) -> FloatArray:
        """(2, nq) lower and upper bounds of `q`, rad and m; infinite where a joint has none.

        They are the joints' own; `limit_violations` checks those of mimic joints too.
        """
        return configuration.limits(self.tree)

    @property
    def velocity_limits(self) -> FloatArray:
        """(nv,) the largest rates, rad/s and m/s; infinite where a joint has none."""
        return configuration.velocity_limits(self.tree)

    def neutral(self) -> FloatArray:
        """(nq,) zeros, and the identity quaternion for floating joints."""
        return configuration.neutral(self.tree)

    @property
    def poses(self) -> dict[str, FloatArray]:
        """Named configurations (nq,): `neutral`; `ready`, within all limits; the catalogue's.

        >>> import urdfkin
        >>> robot = urdfkin.load("panda")
        >>> robot.limit_violations("ready"), robot.limit_violations("neutral")
        ([], ['joint panda_joint4: 0 is outside [-3.0718, -0.0698]'])
        """
        return configuration.poses(self.tree)

    def sample(self, n: int, seed: int = 0) -> FloatArray:
        """(n, nq) configurations within limits, followers' too; the same seed gives the same ones.

        Where a follower's limits leave its leader no room, the leader keeps to its own, and
        `limit_violations` names the follower.

        Raises:
            InputError: `n` or `seed` is no whole number from 0 on; `n` configurations do not fit into memory.
        """
        n = whole_number(n, "n", 0, _MOST_NUMBERS // max(1, self.nq))
        seed = whole_number(seed, "seed", 0)
        try:
            return sample(self.tree, n, np.random.default_rng(seed))
        except MemoryError:
            raise InputError(
                "so many configurations do not fit into memory",
                where=self.name,
                found=f"n = {n}, which are {8 * n * self.nq // 10**9} GB",
                remedy="draw them in parts, each with a seed of its own",
            ) from None

    def limit_violations(self, q: Given) -> list[str]:
        """One line for each joint that leaves its bounds somewhere in `q` (..., nq)."""
        return configuration.limit_violations(self.tree, configuration.checked(self.tree, q, "q"))

    def integrate(self, q: Given, v: Given) -> FloatArray:
        """(..., nq) where `q` gets to in a second at the rates `v`, as Pinocchio's `integrate`.

        For a step of another duration give `v * seconds`. Quaternions stay of norm 1; angles of continuous
        joints count turns.

        Args:
            q: (..., nq) rad, m.
            v: (..., nv) rad/s, m/s; those of planar and floating joints in the moving frame.

        Raises:
            InputError: wrong length, a number that is not finite.

        >>> import urdfkin
        >>> a1 = urdfkin.load("a1", root_joint="floating", verify=False)
        >>> q = a1.integrate("neutral", "neutral, root_joint.vx=1, root_joint.wz=180deg/s")
        >>> q[:7].round(4).tolist()
        [0.0, 0.6366, 0.0, 0.0, 0.0, 1.0, 0.0]
        """
        return integration.integrate(
            self.tree, configuration.checked(self.tree, q, "q"), configuration.checked(self.tree, v, "v")
        )

    def difference(self, start: Given, end: Given) -> FloatArray:
        """(..., nv) the rates that lead from one configuration to another in a second, the shortest way.

        As Pinocchio's `difference`: `integrate(start, difference(start, end))` is where `end` is.

        Args:
            start: (..., nq) rad, m.
            end: (..., nq).

        Raises:
            InputError: wrong length, a number that is not finite.
        """
        ends = (configuration.checked(self.tree, q, "q") for q in (start, end))
        return integration.difference(self.tree, *ends)

    def to_pinocchio(self, q: Given, *, mimic: bool = False) -> FloatArray:
        """(..., nq) to the configuration of `pinocchio.buildModelFromUrdf(path, mimic=mimic)`."""
        return configuration.to_pinocchio(
            self.tree, configuration.checked(self.tree, q, "q"), mimic=as_bool(mimic, "mimic")
        )

    def pinocchio_model(self, *, mimic: bool = False) -> Any:
        """A new `pinocchio.Model` of this robot, as Pinocchio reads its URDF; `to_pinocchio(q)` are its q.

        With a root joint it stands on Pinocchio's, a free-flyer or a planar joint.

        Args:
            mimic: Whether followers follow in the model; Pinocchio 4.1 refuses some robots so.

        Raises:
            OracleError: Pinocchio does not accept this robot.

        >>> import urdfkin
        >>> import pinocchio
        >>> robot = urdfkin.load("ur5")
        >>> model = robot.pinocchio_model()
        >>> q = robot.sample(1)[0]
        >>> data = model.createData()
        >>> pinocchio.framesForwardKinematics(model, data, robot.to_pinocchio(q))
        >>> T = data.oMf[model.getFrameId("tool0")].homogeneous
        >>> bool(abs(T - robot.placement(q, "tool0")).max() < 1e-14)
        True
        """
        return self.verifier.model(mimic=as_bool(mimic, "mimic"))

    def from_pinocchio(self, q: ArrayLike, *, mimic: bool = False) -> FloatArray:
        """The inverse of `to_pinocchio`; angles of continuous joints come back in [-pi, pi].

        Of both ends the double nearest to them comes back as it is.
        """
        return configuration.from_pinocchio(self.tree, scalars(q, "q"), mimic=as_bool(mimic, "mimic"))

    # -- what it computes ----------------------------------------------------------------------------

    def compute(
        self,
        name: str,
        inputs: Sequence[Given],
        frame: str | Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """Any quantity of the walk by its name, as the method of that name computes it.

        Args:
            name: "placement", "velocity", "jacobian", "jacobian rate", "hessian" or "acceleration".
            inputs: q, v and a, as far as it takes them.
            frame: A link's or joint's name, or a list of names; the tip where there is one.
            reference: For which point and in which axes; a placement has none.
            base: How the root link moves; None if it stands at the world's origin.
            out: C-contiguous float64 array of the result's shape to write into.
            verify: Whether Pinocchio checks this call; "sample" has 100 configurations checked; None leaves
                it to the robot.
            threads: How many compute a batch; None: every processor from 4,096 configurations on.

        Raises:
            UnknownNameError: no such quantity or frame.
            InputError: wrong length, a number that is not finite, a batch that does not broadcast; other
                inputs than the quantity takes; one that has a way of its own.
            VerificationError: Pinocchio computes something else.
        """
        row = quantity(as_str(name, "name"))
        if row not in walked():
            raise InputError(f"the {name} has a method of its own", remedy=f"call {row.method}")
        if not isinstance(inputs, tuple | list) or len(inputs) != len(row.inputs):
            raise InputError(f"the {name} takes ({', '.join(row.inputs)})", found=safe_repr(inputs))
        return self._computed(name, inputs, frame, reference, base, out, verify, threads)

    def placement(
        self,
        q: Given,
        frame: str | Sequence[str] | None = None,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., 4, 4) T_world_frame, eq. 7.77 with the rotations alongside; (..., frames, 4, 4) of several.

        Args:
            q: (..., nq) rad, m.
            frame: A link's or joint's name; or a list of names, all of which one pass computes
                (`link_frames` are every link); the tip where there is one.
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
        return self._computed("placement", (q,), frame, _ALIGNED, base, out, verify, threads)

    def relative_placement(
        self,
        q: ArrayLike,
        frame: str | Sequence[str],
        relative_to: str,
        *,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., 4, 4) T_other_frame, the pose of a frame as it is seen from another, wherever the base is.

        T_other_frame = T_world_other^-1 T_world_frame, eq. 7.77 twice; Pinocchio is asked for both.

        Args:
            q: (..., nq) rad, m.
            frame: As in `placement`.
            relative_to: The name of the link or joint that it is seen from.
            out: As in `placement`.
            verify: As in `placement`.
            threads: As in `placement`.

        Raises:
            InputError: as `placement`.
            UnknownNameError: no such frame.
            VerificationError: Pinocchio computes something else.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> q = [0.3, 0.4]
        >>> T = arm.relative_placement(q, arm.tip_frame, arm.tip_frame)
        >>> bool(abs(T - np.eye(4)).max() < 1e-15)
        True
        """
        name = as_str(relative_to, "relative_to")
        name = name if isinstance(name, FrameName) else str(name)  # a replay line has no words for NumPy's
        call = Call(self.tree, self.plan, frame, _ALIGNED, None, (q,), also=(name,), relative_to=name)
        to = call.flat(out, (4, 4))
        self.verifier.ready(verify)
        T_world = call.compute(PLACEMENT.ours, call.plan, (call.q,), None, threads=threads)
        T = seen_from(T_world[:, -1:], T_world[:, :-1], to)
        result = call.in_shape(T) if out is None else out
        self.verifier.check(RELATIVE_PLACEMENT, call, result, verify)
        return result

    def velocity(
        self,
        q: Given,
        v: Given,
        frame: str | Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., 6) velocity of a frame, [linear; angular] m/s, rad/s: eq. 7.127, 7.128.

        Args:
            q: (..., nq) rad, m.
            v: (..., nv) rad/s, m/s; those of planar and floating joints in the moving frame.
            frame: A link's or joint's name, or a list of names, which adds an axis behind the batch; the tip
                where there is one.
            reference: LOCAL_WORLD_ALIGNED: of the frame's origin, in world axes. LOCAL: of the origin, in the
                frame's axes. WORLD: of the point of its body that is at the world's origin, in world axes.
            base: How the root link moves; None if it stands at the world's origin.
            out: C-contiguous float64 array of the result's shape to write into.
            verify: Whether Pinocchio checks this call; "sample" has 100 configurations checked; None leaves
                it to the robot.
            threads: How many compute a batch; None: every processor from 4,096 configurations on.

        Raises:
            InputError: wrong length, a number that is not finite, a batch that does not broadcast.
            UnknownNameError: no such frame, reference or joint.
            VerificationError: Pinocchio computes something else.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> arm.velocity([0.0, 0.0], {"joint_1": 1.0, "joint_2": 0.0}).round(6).tolist()
        [0.0, 0.9, 0.0, 0.0, 0.0, 1.0]
        """
        if (
            (base is None and threads is None)
            and (fast := self._fast(frame, reference, verify))
            and (one := fast._velocity(q, v, out)) is not None
        ):
            return one
        return self._computed("velocity", (q, v), frame, reference, base, out, verify, threads)

    def jacobian(
        self,
        q: Given,
        frame: str | Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., 6, nv) velocity Jacobian, eq. 7.85: `velocity` is J v.

        Column i is the frame's velocity [linear; angular] for a unit rate of `rate_names[i]` alone, m/s and
        rad/s per rad/s or m/s.

        Args:
            q: (..., nq) rad, m.
            frame: A link's or joint's name, or a list of names, which adds an axis behind the batch; the tip
                where there is one.
            reference: LOCAL_WORLD_ALIGNED: of the frame's origin, in world axes. LOCAL: of the origin, in the
                frame's axes. WORLD: of the point of its body that is at the world's origin, in world axes.
            base: How the root link moves; None if it stands at the world's origin.
            out: C-contiguous float64 array of the result's shape to write into.
            verify: Whether Pinocchio checks this call; "sample" has 100 configurations checked; None leaves
                it to the robot.
            threads: How many compute a batch; None: every processor from 4,096 configurations on.

        Raises:
            InputError: wrong length, a number that is not finite, a batch that does not broadcast.
            UnknownNameError: no such frame, reference or joint.
            VerificationError: Pinocchio computes something else.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> J = arm.jacobian("joint_1=0, joint_2=90deg")
        >>> J[:2].round(6).tolist()
        [[-0.4, -0.4], [0.5, 0.0]]
        """
        if (
            (base is None and threads is None)
            and (fast := self._fast(frame, reference, verify))
            and (one := fast._jacobian(q, out)) is not None
        ):
            return one
        return self._computed("jacobian", (q,), frame, reference, base, out, verify, threads)

    def jacobian_rate(
        self,
        q: Given,
        v: Given,
        frame: str | Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., 6, nv) J-dot, the time derivative of `jacobian` along the motion (7.126).

        In LOCAL_WORLD_ALIGNED, J a + J-dot v is the acceleration of the text and of `acceleration`. In LOCAL
        and WORLD it is the *spatial* acceleration, which differs by w x vel: there the point, or the axes,
        that the rows speak of move themselves. On a moving base, what the base does comes on top.

        Args:
            q: (..., nq) rad, m.
            v: (..., nv) rad/s, m/s; those of planar and floating joints in the moving frame.
            frame: A link's or joint's name, or a list of names, which adds an axis behind the batch; the tip
                where there is one.
            reference: LOCAL_WORLD_ALIGNED: of the frame's origin, in world axes. LOCAL: of the origin, in the
                frame's axes. WORLD: of the point of its body that is at the world's origin, in world axes.
            base: How the root link moves; None if it stands at the world's origin.
            out: C-contiguous float64 array of the result's shape to write into.
            verify: Whether Pinocchio checks this call; "sample" has 100 configurations checked; None leaves
                it to the robot.
            threads: How many compute a batch; None: every processor from 4,096 configurations on.

        Raises:
            InputError: wrong length, a number that is not finite, a batch that does not broadcast.
            UnknownNameError: no such frame, reference or joint.
            VerificationError: Pinocchio computes something else.
        """
        return self._computed("jacobian rate", (q, v), frame, reference, base, out, verify, threads)

    def hessian(
        self,
        q: Given,
        frame: str | Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., 6, nv, nv) derivatives of `jacobian` by each rate: [..., i, j] is that of column i by rate j.

        J-dot of 7.126 is the sum over j of H[..., j] v[j], and v^T H v what the acceleration has of the rates
        alone. Where rate j comes before column i, its z_j turns the column, z_j x (z_i x d_i); where it comes
        behind, it moves the end of its arm, z_i x (z_j x d_j). WORLD has the first kind alone, LOCAL the
        second.

        In LOCAL_WORLD_ALIGNED, but for the rates of one floating joint, the angular rows at [i, j] and [j, i]
        differ by w_j x w_i, the angular rows of the Jacobian: not at all where these are parallel, and on a
        planar arm the angular rows are 0. The linear rows are symmetric in i and j, but for the rates of one
        planar or floating joint.

        Args:
            q: (..., nq) rad, m.
            frame: A link's or joint's name, or a list of names, which adds an axis behind the batch; the tip
                where there is one.
            reference: LOCAL_WORLD_ALIGNED: of the frame's origin, in world axes. LOCAL: of the origin, in the
                frame's axes. WORLD: of the point of its body that is at the world's origin, in world axes.
            base: How the root link moves; None if it stands at the world's origin.
            out: C-contiguous float64 array of the result's shape to write into.
            verify: Whether Pinocchio checks this call; "sample" has 100 configurations checked; None leaves
                it to the robot.
            threads: How many compute a batch; None: every processor from 4,096 configurations on.

        Raises:
            InputError: wrong length, a number that is not finite, a batch that does not broadcast.
            UnknownNameError: no such frame, reference or joint.
            VerificationError: Pinocchio computes something else.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link", verify=False)
        >>> H = arm.hessian([0.0, 0.0], arm.tip_frame)
        >>> bool((H[:3] == H[:3].swapaxes(-1, -2)).all())
        True
        """
        if (
            (base is None and threads is None)
            and (fast := self._fast(frame, reference, verify))
            and (one := fast._hessian(q, out)) is not None
        ):
            return one
        return self._computed("hessian", (q,), frame, reference, base, out, verify, threads)

    def acceleration(
        self,
        q: Given,
        v: Given,
        a: Given,
        frame: str | Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., 6) classical acceleration of a frame, [linear; angular] m/s^2, rad/s^2: eq. 7.129, 7.130.

        The linear part is the second derivative of the position of the frame's origin, p'', not the spatial
        acceleration p'' - w x p' (Pinocchio has both: `getFrameClassicalAcceleration` is this one). Gravity
        is not in it; `imu` has what a sensor reads. With `jacobian` and `jacobian_rate` in
        LOCAL_WORLD_ALIGNED it is J a + J-dot v; `acceleration_breakdown` says which joint contributes what.

        Args:
            q: (..., nq) rad, m.
            v: (..., nv) rad/s, m/s; those of planar and floating joints in the moving frame.
            a: (..., nv) rad/s^2, m/s^2, likewise.
            frame: A link's or joint's name, or a list of names, which adds an axis behind the batch; the tip
                where there is one.
            reference: LOCAL_WORLD_ALIGNED: of the frame's origin, in world axes. LOCAL: of the origin, in the
                frame's axes. WORLD: of the point of its body that is at the world's origin, in world axes.
            base: How the root link moves; None if it stands at the world's origin.
            out: C-contiguous float64 array of the result's shape to write into.
            verify: Whether Pinocchio checks this call; "sample" has 100 configurations checked; None leaves
                it to the robot.
            threads: How many compute a batch; None: every processor from 4,096 configurations on.

        Raises:
            InputError: wrong length, a number that is not finite, a batch that does not broadcast.
            UnknownNameError: no such frame, reference or joint.
            VerificationError: Pinocchio computes something else.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> arm.acceleration([0.0, 0.0], [1.0, 0.0], [0.0, 0.0]).round(6).tolist()  # -w^2 r, r = 0.9 m
        [-0.9, 0.0, 0.0, 0.0, 0.0, 0.0]
        """
        if (
            (base is None and threads is None)
            and (fast := self._fast(frame, reference, verify))
            and (one := fast._acceleration(q, v, a, out)) is not None
        ):
            return one
        return self._computed("acceleration", (q, v, a), frame, reference, base, out, verify, threads)

    def imu(
        self,
        q: Given,
        v: Given,
        a: Given,
        frame: str | Sequence[str] | None = None,
        *,
        gravity: ArrayLike = GRAVITY,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """(..., 6) what an accelerometer and a gyroscope in a frame read, in the frame's own axes.

        The first three numbers are the *proper* acceleration R^T (p'' - g), m/s^2: what the frame is
        accelerated by relative to free fall, upwards 9.81 where it stands still. p'' is the classical
        acceleration of `acceleration` (7.130), not the spatial one. The other three are R^T w (7.127), rad/s.

        Args:
            q: (..., nq) rad, m.
            v: (..., nv) rad/s, m/s.
            a: (..., nv) rad/s^2, m/s^2.
            frame: A link's or joint's name, or a list of names; the tip where there is one.
            gravity: (3,) m/s^2 in the world's axes.
            base: How the root link moves; None if it stands at the world's origin.
            out: C-contiguous float64 array of the result's shape to write into.
            verify: Whether Pinocchio checks this call; "sample" has 100 configurations checked; None leaves
                it to the robot.
            threads: How many compute a batch; None: every processor from 4,096 configurations on.

        Raises:
            InputError: wrong length, a number that is not finite, a batch that does not broadcast; gravity
                that is not three finite numbers.
            UnknownNameError: no such frame.
            VerificationError: Pinocchio computes something else.

        >>> import urdfkin
        >>> robot = urdfkin.load("ur5")
        >>> rest = robot.neutral(), [0.0] * 6, [0.0] * 6
        >>> robot.imu(*rest, "base_link").tolist()
        [0.0, 0.0, 9.81, 0.0, 0.0, 0.0]
        """
        g = vectors(gravity, "gravity")
        if g.shape != (3,):
            raise InputError("gravity is one vector (3,)", found=f"shape {g.shape}")
        return self._computed(
            "imu", (q, v, a), frame, Reference.LOCAL, base, out, verify, threads, gravity=g.tolist()
        )

    def singular_values(
        self,
        q: Given,
        frame: str | None = None,
        rows: str = "all",
        *,
        base: BaseMotion | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> SingularValues:
        """The singular values of `jacobian` with guaranteed bounds, their condition and manipulability.

        They are the same in LOCAL and LOCAL_WORLD_ALIGNED. Columns that are 0 for every q are left out. Of
        "all" rows, metres and radians are mixed as SI units mix them. How far J can be off, and what the
        decomposition rounds, is in the bounds. Their product's gradient is
        `found.manipulability_gradient(robot.hessian(q, frame))`.

        Args:
            q: (..., nq) rad, m.
            frame: A link's or joint's name.
            rows: "all", "linear" or "angular".
            base: How the root link moves; None if it stands at the world's origin.
            verify: Whether Pinocchio checks this call; "sample" has 100 configurations checked; None leaves
                it to the robot.
            threads: How many compute a batch; None: every processor from 4,096 configurations on.

        Raises:
            InputError: wrong length, a number that is not finite, a batch that does not broadcast; other
                rows.
            UnknownNameError: no such frame.
            VerificationError: Pinocchio computes another Jacobian.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> found = arm.singular_values([0.3, 0.0], arm.tip_frame, "linear")
        >>> found.values.lower[-1] == 0.0, found.condition.upper  # stretched out: one is, or may be, 0
        (np.True_, np.float64(inf))
        """
        which = _ROWS.get(as_str(rows, "rows"))
        if which is None:
            raise InputError("rows are all, linear or angular", found=safe_repr(rows))
        frame = self._default_frame() if frame is None else frame
        J = self.jacobian(q, as_str(frame, "frame"), base=base, verify=verify, threads=threads)
        call = Call(self.tree, self.plan, frame, _ALIGNED, base, (q,))
        size = magnitudes(call.plan, call.q, None, None, call.state)
        bound = JACOBIAN.bound(call.plan, size, _ALIGNED)
        error = (EPS * bound.k * bound.scale)[:, 0].reshape(*call.shape, 6, self.nv)
        moving = np.asarray(movable(call.plan)[0, which].any(axis=0))
        return singular_values(J, error, moving, which)

    def analytical_jacobian(
        self,
        q: Given,
        frame: str | Sequence[str] | None = None,
        representation: str = "ZYZ",
        *,
        nearest: float = NEAREST,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """The manipulator Jacobian J = C^-1 J_v (7.122): derivatives of position and orientation by q.

        It is checked against Pinocchio's rotation and Jacobian, with the rates of the orientation's numbers
        by a way of their own (`urdfkin.verify.analytical_reference`). The bound grows as 1 / s^2, s being the
        sine or cosine of the middle angle: near the singularity that many digits are lost.

        Args:
            q: (..., nq) rad, m.
            frame: A link's or joint's name, or a list of names; the tip where there is one.
            representation: Euler sequence by SciPy's name ("ZYZ" is the text's, "xyz" is rpy), or
                "quaternion".
            nearest: How near the representational singularity may be, radians.
            base: How the root link stands; None if at the world's origin.
            out: C-contiguous float64 array of the result's shape to write into.
            verify: Whether Pinocchio checks this call; "sample" has 100 configurations checked; None leaves
                it to the robot.
            threads: How many compute a batch; None: every processor from 4,096 configurations on.

        Returns:
            (..., 6, nv), or (..., 7, nv) for a quaternion.

        Raises:
            RepresentationSingularityError: a sample is nearer to the singularity than `nearest`, or, when it
                is to be checked, than rounding can tell (some 1e-13 rad); the error says how near. A
                quaternion has none.
            UnknownNameError: no such frame or representation.
            InputError: wrong length, a number that is not finite, a batch that does not broadcast.
            VerificationError: Pinocchio computes something else.
        """
        representation, nearest = as_str(representation, "representation"), real_number(nearest, "nearest")
        options: dict[str, Any] = {"representation": representation, "nearest": nearest}
        frame = self._default_frame() if frame is None else frame
        call = Call(self.tree, self.plan, frame, _ALIGNED, base, (q,), **options)
        self.verifier.ready(verify)
        if self.verifier.wanted(verify):
            nearest = max(nearest, nearest_singularity(call.plan))
        rows = 7 if representation == QUATERNION else 6
        to = call.flat(out, (rows, self.nv))
        J = np.empty((call.n, len(call.links), rows, self.nv)) if to is None else to
        walk, state = (call.plan, (call.q,), _ALIGNED), {"base": call.state, "threads": threads}
        Rs = call.compute(PLACEMENT.ours, *walk, **state)[..., :3, :3]
        Js_v = call.compute(JACOBIAN.ours, *walk, out=J if rows == 6 else None, **state)
        near: list[tuple[float, int]] = []

        def compute(part: slice) -> None:
            try:
                with np.errstate(over="ignore", invalid="ignore"):
                    J[part] = ANALYTICAL_JACOBIAN.compute(representation, Rs[part], Js_v[part], nearest)
            except RepresentationSingularityError as error:
                near.append((error.distance, part.start + error.sample[0]))

        in_parts(compute, call.n, threads)
        if near:
            distance, k = min(near)
            raise RepresentationSingularityError(representation, distance, call.index(k))
        if not np.isfinite(J).all():
            raise RangeError("a result leaves the range of double precision", remedy="give smaller numbers")
        handed_out = call.in_shape(J) if out is None else out
        self.verifier.check(ANALYTICAL_JACOBIAN, call, handed_out, verify)
        return handed_out

    def acceleration_breakdown(
        self,
        q: Given,
        v: Given,
        a: Given,
        frame: str | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> AccelerationBreakdown:
        """A frame's classical acceleration as a sum over joints and kinds: whose doing it is (7.125, 7.130).

        The kinds are transverse, centripetal, Coriolis and sliding. The sum is `acceleration`, and is checked
        against Pinocchio's.

        Args:
            q: (..., nq) rad, m.
            v: (..., nv) rad/s, m/s; those of planar and floating joints in the moving frame.
            a: (..., nv) rad/s^2, m/s^2, likewise.
            frame: A link's or joint's name; the tip where there is one.
            reference: LOCAL_WORLD_ALIGNED: of the frame's origin, in world axes. LOCAL: of the origin, in the
                frame's axes. WORLD: of the point of its body that is at the world's origin, in world axes.
            base: How the root link moves; None if it stands at the world's origin.
            out: C-contiguous float64 array (..., joints, 4, 6) to write the terms into.
            verify: Whether Pinocchio checks this call; "sample" has 100 configurations checked; None leaves
                it to the robot.
            threads: How many compute a batch; None: every processor from 4,096 configurations on.

        Returns:
            The parts, with the caller's batch shape in front; `print` and notebooks show them as a table.

        Raises:
            InputError: wrong length, a number that is not finite, a batch that does not broadcast.
            UnknownNameError: no such frame, reference or joint.
            VerificationError: Pinocchio computes something else.
        """
        frame = self._default_frame() if frame is None else frame
        call = Call(self.tree, self.plan, as_str(frame, "frame"), reference, base, (q, v, a))
        self.verifier.ready(verify)
        to = call.flat(out, (len(moving_joints(self.tree, call.links[0])), len(KINDS), 6))
        flat = (self.tree, call.links[0], call.q, *call.rates, call.reference, call.state)
        parts: AccelerationBreakdown = call.compute(
            ACCELERATION_BREAKDOWN.compute, *flat, out=None if to is None else to[:, 0], threads=threads
        )
        base_part, terms = (x.reshape(*call.shape, *x.shape[1:]) for x in (parts.base, parts.terms))
        breakdown = AccelerationBreakdown(parts.joints, base_part, terms if out is None else out)
        self.verifier.check(ACCELERATION_BREAKDOWN, call, breakdown.total, verify)
        return breakdown

    def enclose(
        self,
        q: Given,
        v: Given,
        a: Given,
        frame: str | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        digits: int | None = None,
        hessian: bool = False,
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
            hessian: Whether the Hessian's are wanted too: a millisecond or so for each two joints.

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
        from urdfkin.verify.exact.enclosure import enclose  # noqa: PLC0415  loads mpmath

        frame = self._default_frame() if frame is None else frame
        inputs, hessian = (q, v, a), as_bool(hessian, "hessian")
        return enclose(self.verifier, self.plan, inputs, frame, reference, base, digits, hessian=hessian)

    def prepare(self, frame: str | None = None, reference: Reference | str = _ALIGNED) -> PreparedFrame:
        """One frame in one reference, for one configuration after the other, without a check: see there.

        Raises:
            UnknownNameError: no such frame or reference.
        """
        frame = self._default_frame() if frame is None else frame
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

    def compiled(self, frame: str | None = None, reference: Reference | str = _ALIGNED) -> CompiledFrame:
        """One frame compiled for this robot alone by the system's compiler, the fastest form: see there.

        Each quantity is compiled when it is first asked for, some seconds once on a machine, and held against
        Pinocchio. Without a compiler Numba's walk computes.

        Raises:
            UnknownNameError: no such frame or reference.
            VerificationError: when it is first called: Pinocchio computes something else.
        """
        from urdfkin.export.compiled_frame import CompiledFrame  # noqa: PLC0415  seldom wanted

        frame = self._default_frame() if frame is None else frame
        self.tree.frame_link(frame)
        key = type(frame), frame, Reference.of(reference)
        if (found := self._compiled.get(key)) is None:
            found = self._compiled[key] = CompiledFrame(self, frame, key[2])
        return found

    def export(
        self,
        to: str,
        frame: str | None = None,
        quantities: Sequence[str] = EXPORTED,
        reference: Reference | str = _ALIGNED,
        *,
        name: str | None = None,
        verify: bool | None = None,
    ) -> str:
        """A frame's kinematics as straight-line code, with its proof in the same text.

        What is printed was held against Pinocchio; the text says how closely it agreed, and brings test
        vectors with true values at fifty digits, which it can run by itself.

        Args:
            to: A language of `urdfkin.export.LANGUAGES`: "c", "numpy" and others.
            frame: A link's or joint's name; the robot's tip when None.
            quantities: "placement", "velocity", "jacobian", "jacobian_rate", "acceleration".
            reference: For which point and in which axes.
            name: What functions' names begin with; None: the robot's and the frame's.
            verify: Whether Pinocchio checks it; None leaves it to the robot. Where it does not, the text's
                first line says UNVERIFIED.

        Raises:
            UnknownNameError: no such language, frame, quantity or reference.
            InputError: no quantity, or one with a way of its own.
            VerificationError: Pinocchio computes something else.

        >>> import urdfkin
        >>> code = urdfkin.load("ur5").export("numpy", "tool0", ["jacobian"])
        >>> scope = {}
        >>> exec(code, scope)
        >>> scope["jacobian"]([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]).shape
        (6, 6)
        """
        from urdfkin.export import write  # noqa: PLC0415
        from urdfkin.export.code import code_of  # noqa: PLC0415  loads mpmath

        frame = as_choice(frame, self.tip_frame, "frame")
        name = None if name is None else as_str(name, "name")
        code = code_of(self.verifier, self.plan, frame, quantities, reference, name=name, verify=verify)
        return write(code, as_str(to, "to"))

    # -- chains and Denavit-Hartenberg tables ---------------------------------------------------------

    def chain(self, tip: str | None = None, base: str | None = None) -> FrameChain:
        """The joints between two frames, down the tree, up, or through the common ancestor.

        Args:
            tip: A link's or joint's name; the robot's tip when None.
            base: Likewise; the robot's base frame when None.

        Raises:
            UnknownNameError: no such frame.
            InputError: a planar or floating joint lies on the way.
        """
        return chain(
            self.tree, as_choice(tip, self.tip_frame, "tip"), as_choice(base, self.base_frame, "base")
        )

    def select(self, path: FrameChain | DHTable, q: Given) -> FloatArray:
        """(..., coordinates) of a path or table out of the robot's `q` (..., nq).

        Raises:
            InputError: `q` has another length than the robot's.
        """
        return path.coupling.select(self.tree, q)

    def dh(
        self,
        tip: str | None = None,
        base: str | None = None,
        convention: str = "standard",
        *,
        near_parallel: str = "hayati",
        snap: float = 0.0,
        last: str = "tip",
        parallel_offset: str = "last",
        flip: Collection[str] = (),
        first: str = "base",
        sign: str = "theta",
        slide: str = "drawn",
        like: DHTable | None = None,
        verify: bool | None = None,
    ) -> DHTable:
        """The Denavit-Hartenberg table of the path between two frames, checked against Pinocchio.

        Its methods take the path's own coordinates, `table.joint_names`; `robot.select(table, q)` picks them
        out of the robot's. The other arguments are those of `urdfkin.dh.dh_table`.

        Args:
            tip: A link's or joint's name; the robot's tip when None.
            base: Likewise; the robot's base frame when None.
            convention: "standard" (distal, the text's) or "modified" (proximal, Craig's).
            near_parallel: "hayati" or "strict": what nearly parallel axes get.
            snap: Radians within which angles are made multiples of 15 degrees; 0 for an exact table.
            last: "tip" or "flange": whether the last row takes the tip.
            parallel_offset: "last", "first" or "each".
            flip: Joints to count the other way.
            first: "base" or "joint": whether the first row takes the way from the base (Craig's d_1 is zero).
            sign: How to choose the direction of x: "theta" (smallest), "a" or "alpha" (not negative).
            slide: "drawn" or "minimal": where the lines of sliding joints are.
            like: A published table, whose frames, senses and zeros are to be taken.
            verify: Whether Pinocchio checks the table; None leaves it to the robot.

        Raises:
            UnknownNameError: a frame or a joint that does not exist.
            InputError: an option's value, or a planar or floating joint on the way.
            TableError: Pinocchio computes something else.

        Example:
            >>> import urdfkin
            >>> urdfkin.load("ur5").dh("tool0", "base", snap=1e-6).rows[3].d
            0.10915
        """
        if not isinstance(like, DHTable | None):
            raise InputError(
                "like is a table", found=safe_repr(like), remedy="read_table(FILE) of urdfkin.dh makes one"
            )
        table = dh_table(
            self.tree,
            as_choice(tip, self.tip_frame, "tip"),
            as_choice(base, self.base_frame, "base"),
            as_str(convention, "convention"),
            near_parallel=as_str(near_parallel, "near_parallel"),
            snap=snap,
            last=as_str(last, "last"),
            parallel_offset=as_str(parallel_offset, "parallel_offset"),
            flip=[as_str(joint, "each of flip") for joint in as_names(flip, "flip")],
            first=as_str(first, "first"),
            sign=as_str(sign, "sign"),
            slide=as_str(slide, "slide"),
            like=like,
        )
        if self.verifier.wanted(verify):
            self.verifier.table(table)
        return table

    def screws(
        self, tip: str | None = None, base: str | None = None, *, verify: bool | None = None
    ) -> ProductOfExponentials:
        """The product of exponentials of the path between two frames, checked against Pinocchio.

        Args:
            tip: A link's or joint's name; the robot's tip when None.
            base: Likewise; the robot's base frame when None.
            verify: Whether Pinocchio checks it; None leaves it to the robot.

        Raises:
            UnknownNameError: a frame that does not exist.
            InputError: a planar or floating joint on the way.
            TableError: Pinocchio computes something else.

        Example:
            >>> import urdfkin
            >>> urdfkin.load("ur5").screws("tool0", "base").space[0].tolist()
            [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
        """
        found = screws_of(self.chain(tip, base))
        if self.verifier.wanted(verify):
            check_screws(self.verifier, found)
        return found

    def tree_parameters(self, *, verify: bool | None = None) -> TreeParameters:
        """Khalil and Kleinfinger's parameters of the whole robot as one table, checked against Pinocchio.

        Args:
            verify: Whether Pinocchio checks it; None leaves it to the robot.

        Raises:
            InputError: a planar or floating joint, which has no single axis.
            TableError: Pinocchio computes something else.
        """
        parameters = tree_parameters(self.tree)
        if self.verifier.wanted(verify):
            self.verifier.tree_parameters(parameters)
        return parameters

    # -- what it is worth ----------------------------------------------------------------------------

    def certificate(self) -> Certificate:
        """What was checked so far, how closely it agreed, by whom, and what was not checked."""
        return self.verifier.certificate()

    # -- inside --------------------------------------------------------------------------------------

    def plan(self, links: Sequence[int]) -> CompiledTree:
        """The walk that meets the given links, made once."""
        key = tuple(links)
        if (plan := self._plans.get(key)) is None:
            plan = self._plans[key] = compile_tree(self.tree, key)
        return plan

    def _computed(
        self,
        name: str,
        inputs: Sequence[Given],
        frame: str | Sequence[str] | None,
        reference: Reference | str,
        base: BaseMotion | None,
        out: FloatArray | None,
        verify: Verify | None,
        threads: int | None,
        **options: Any,
    ) -> FloatArray:
        row = QUANTITIES[name]
        frame = self._default_frame() if frame is None else frame
        call = Call(self.tree, self.plan, frame, reference, base, inputs, **options)
        to = call.flat(out, row.own_shape(self.nv))
        self.verifier.ready(verify)
        flat = (call.plan, (call.q, *call.rates), call.reference)
        found = call.compute(row.ours, *flat, base=call.state, out=to, threads=threads, **options)
        result = call.in_shape(found) if out is None else out
        self.verifier.check(row, call, result, verify)
        return result

    def _fast(
        self, frame: str | Sequence[str] | None, reference: Reference | str, verify: Verify | None
    ) -> PreparedFrame | None:
        """The short way for a single configuration that nobody checks; None where it is not for this call."""
        if verify is not False and (verify is not None or self.verifier.policy is not False):
            return None
        if frame is None:
            frame = self._default_frame()
        if not isinstance(frame, str):
            return None
        if reference is _ALIGNED and type(frame) is str and (fast := self._prepared.get(frame)) is not None:
            return fast
        return self.prepare(frame, reference)
