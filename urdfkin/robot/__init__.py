"""The class `Robot`: kinematics of a loaded robot, with every result checked against Pinocchio.

Equation numbers refer to chapter 7 of the textbook that `docs/equations.md` cites. With `verify=True`, the
default, a method compares each result with Pinocchio's before returning the result.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from copy import copy
from functools import partial
from inspect import cleandoc
from pathlib import Path
from textwrap import fill
from types import FunctionType, MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.compiled.plan import CompiledTree, compile_tree
from urdfkin.compiled.prepared import PreparedFrame
from urdfkin.errors import InputError, RangeError, RepresentationSingularityError
from urdfkin.errors.display import Displayable, TextDocument
from urdfkin.errors.escape import log_line
from urdfkin.errors.validators import (
    as_bool,
    as_choice,
    as_finite_float,
    as_int,
    as_names,
    as_str,
    reject_set,
    safe_repr,
)
from urdfkin.export import DEFAULT_QUANTITIES as EXPORTED
from urdfkin.kinematics.inputs import as_finite, as_vectors, check_range
from urdfkin.kinematics.rotation import MIN_SINGULARITY_DISTANCE
from urdfkin.kinematics.roundings import EPS
from urdfkin.model import configuration, integration
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.chain import FrameChain, make_chain
from urdfkin.model.configuration import sample
from urdfkin.model.configuration_like import ConfigurationLike, join_names
from urdfkin.model.reference import Reference
from urdfkin.model.summary import JointTable, summarize_robot
from urdfkin.model.tree import FloatArray, FrameName, KinematicTree, LinkFrame, with_locks
from urdfkin.system.lazy_import import get_hook
from urdfkin.system.locks import import_lock
from urdfkin.urdf.findings import Finding, Findings
from urdfkin.urdf.sources import Origin, find_entry
from urdfkin.verify.bounds import find_active_entries, singularity_margin, true_value_magnitudes
from urdfkin.verify.call import Call
from urdfkin.verify.certificate import Certificate
from urdfkin.verify.oracles import OracleName
from urdfkin.verify.quantities import (
    ACCELERATION_BREAKDOWN,
    ANALYTICAL_JACOBIAN,
    JACOBIAN,
    PLACEMENT,
    QUANTITIES,
    RELATIVE_PLACEMENT,
    find_quantity,
    recursive_quantities,
)
from urdfkin.verify.singular_values import SingularValues, singular_values
from urdfkin.verify.singularity import FrameJacobian, find_revolute_columns
from urdfkin.verify.verifier import Verifier, Verify

if TYPE_CHECKING:
    from urdfkin.compiled.breakdown import AccelerationBreakdown
    from urdfkin.dh.screws import ProductOfExponentials
    from urdfkin.dh.table import DHTable
    from urdfkin.dh.tree_parameters import TreeParameters
    from urdfkin.export.compiled_frame import CompiledFrame
    from urdfkin.model.conventions import Convention, Conversion
    from urdfkin.robot.convention_robot import ConventionRobot
    from urdfkin.verify.exact.enclosure import Enclosures
    from urdfkin.verify.usd_check import SinglePrecisionErrors, SingleRoundingTerms

_ALIGNED = Reference.LOCAL_WORLD_ALIGNED
#: Gravity in m/s^2, in world axes.
#: Pinocchio and MuJoCo have the same default value.
GRAVITY = (0.0, 0.0, -9.81)
_ROWS = {"all": slice(0, 6), "linear": slice(0, 3), "angular": slice(3, 6)}
#: Number of random configurations that determine the generic rank of a Jacobian.
_RANK_SAMPLES = 3
#: `dir(robot)` omits these internal members.
_INTERNAL_NAMES = {"plan", "single", "single_terms", "verifier"}
#: Maximum number of float64 values in an array, because the number of bytes must fit in 63 bits.
_MAX_NUMBERS = (2**63 - 1) // 8


class Robot(Displayable):
    """A robot and its kinematics; `urdfkin.load` returns a robot.

    A configuration `q` has the shape (..., nq). Joint velocities `v` and joint accelerations `a` have the
    shape (..., nv). The leading axes are batch axes, which broadcast as in NumPy. The order of joints and the
    definition of `v` are the same as in Pinocchio.

    Each of `q`, `v` and `a` may have one of four forms:

    - numbers in order: `[0.5, 2.0]`
    - a mapping: `{"elbow": 0.5, "wrist": "30deg"}`; its values may be batches
    - a text with names: `"elbow=0.5, wrist=2"`
    - the name of a pose in `poses`, with or without changed values: `"ready"`, `"ready, elbow=0.5"`. For `v`
      and `a`, the only pose is `"neutral"`: all zeros.

    A text that begins with the name of a pose needs only the values that differ from the pose. All other
    texts and all mappings must contain every coordinate.

    Methods that compute a quantity share these arguments:

    - `q`: (..., nq) rad, m.
    - `v`: (..., nv) rad/s, m/s. The velocity of a planar or floating joint is expressed in the axes of the
      moving frame.
    - `a`: (..., nv) rad/s^2, m/s^2; expressed in the same axes as `v`.
    - `frame`: Name of a link or joint; None: the robot's only tip. For a list of names, such as
      `link_frames`, the result has one more array axis after the batch axes. The index along this axis
      selects the frame.
    - `reference`: Reference frame of the result. LOCAL_WORLD_ALIGNED: linear motion of the frame's origin,
      expressed in world axes. LOCAL: linear motion of the frame's origin, expressed in the frame's axes.
      WORLD: linear motion of the body point that coincides with the world origin, expressed in world axes.
    - `base`: Motion of the root link; None: fixed at the world origin.
    - `out`: Output array, C-contiguous float64 of the result's shape; the contents are undefined after an
      error.
    - `verify`: True: check the call with Pinocchio. "sample": check 100 configurations of the call. False: no
      check. None: as chosen in `load`.
    - `threads`: Number of threads for a batch. None: one thread for fewer than 4,096 configurations,
      otherwise one thread for each processor. The result does not depend on the number of threads.

    These methods share these errors:

    - `InputError`: a wrong length, a number that is not finite, or batch shapes that do not broadcast.
    - `UnknownNameError`: the frame, reference or joint does not exist.
    - `VerificationError`: Pinocchio's result differs by more than the bound.

    Attributes:
        tree: Links and joints.
        verifier: Verifier of the robot's results. The verifier contains the URDF text that Pinocchio reads,
            and the record of all checks so far.
        findings: Warnings and notes about the URDF; `load` rejects a URDF with errors.
        base_frame: Default base of chains: the base named in the catalogue of robots; for other robots, the
            root link.

    >>> import urdfkin
    >>> arm = urdfkin.load("planar_two_link")
    >>> arm
    <Robot planar_two_link: nq 2, nv 2, 4 links>
    >>> arm.placement("joint_1=0, joint_2=90deg", "tip")[:3, 3].round(6).tolist()  # lengths 0.5 m, 0.4 m
    [0.5, 0.4, 0.0]
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
        oracle: OracleName = "pinocchio",
        base_frame: str | None = None,
        tip_frame: str | None = None,
    ) -> None:
        self.tree = tree
        self.verifier = Verifier(
            urdf, tree, origin, policy=verify, mimic=mimic, unverifiable=unverifiable, oracle=oracle
        )
        self.findings = Findings(findings)
        #: Terms of `single` for each joint. None if the source is not a USD stage in single precision.
        self.single_terms: SingleRoundingTerms | None = None
        #: USD path of each link's prim (USD object). The mapping is empty if the source is not a USD stage.
        self.prims: Mapping[str, str] = {}
        self.base_frame = base_frame or tree.frame_name(0)
        self._tip_frame = tip_frame
        self._has_one_tip = tip_frame is not None or len(list(tree.leaves())) == 1
        self._plans: dict[tuple[int, ...], CompiledTree] = {}
        # Evaluators in `_checked` check every result with Pinocchio.
        # Evaluators in `_prepared` check no result.
        self._prepared: dict[object, PreparedFrame] = {}
        self._checked: dict[object, PreparedFrame] = {}
        self._compiled: dict[object, CompiledFrame] = {}

    def __getstate__(self) -> dict[str, Any]:
        # A copy has empty caches and its own verifier.
        empty: dict[str, Any] = {"_plans": {}, "_prepared": {}, "_checked": {}, "_compiled": {}}
        return {**self.__dict__, "verifier": copy(self.verifier), **empty}

    def __repr__(self) -> str:
        return log_line(f"<Robot {self.name}: nq {self.nq}, nv {self.nv}, {len(self.tree.links)} links>")

    def __dir__(self) -> list[str]:
        return [name for name in super().__dir__() if name not in _INTERNAL_NAMES]

    def _text_document(self) -> TextDocument:
        with import_lock:
            from urdfkin.system.plain_xml import joint_order_sentence

        order = joint_order_sentence(self.urdf, self.joint_names)
        return summarize_robot(self.tree, self.base_frame, self.tip_frame, order)

    def view(self, q: ConfigurationLike = "ready", *, height: int = 480) -> Any:
        """Return a three-dimensional view of the robot for a notebook cell, with a slider for each joint.

        The view needs no network and no server, and is saved with the notebook. The browser computes the
        motion, so the poses in the view are not checked. The command `urdfkin view` checks every pose.

        Args:
            q: (nq,) initial configuration, rad, m.
            height: Height of the cell, pixels.

        Raises:
            InputError: a wrong length, a number that is not finite, a batch, or a height that is not a whole
                number from 1 to 10,000.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> cell = arm.view("joint_1=30deg, joint_2=0", height=300)  # shown by a notebook
        """
        q_0 = configuration.parse_finite(self.tree, q, "q")
        if q_0.ndim != 1:
            raise InputError("q of a view must be one configuration", found=f"shape {q_0.shape}")
        return get_hook("a robot in a cell")(self, q_0, as_int(height, "height", 1, 10_000))

    @property
    def single(self) -> SinglePrecisionErrors | None:
        """Bounds on the errors of poses from a USD stage in single precision; None without a USD stage.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").single is None
        True
        """
        if self.single_terms is None:
            return None
        with import_lock:
            from urdfkin.verify.usd_check import bound_single_precision_errors

        return bound_single_precision_errors(self.tree, self.single_terms)

    # -- description ---------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """The robot's name in the URDF.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").name
        'planar_two_link'
        """
        return self.tree.name

    @property
    def urdf(self) -> str:
        """The URDF text that Pinocchio reads for its checks.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").urdf.count("<joint ")
        3
        """
        return self.verifier.text

    @property
    def origin(self) -> Origin:
        """The source and the arguments that `load` received.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").origin.source
        'planar_two_link'
        """
        return self.verifier.origin

    @property
    def source(self) -> str:
        """Source of the robot: a path, a catalogue name, `-` (standard input), `<text>`, `<table>`, ...

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").source
        'planar_two_link'
        """
        return self.origin.source

    @property
    def sha256(self) -> str:
        """SHA-256 of the URDF text in UTF-8, or of the MJCF or USD file; included files have no effect.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").sha256[:8]
        '5354bbcf'
        """
        return self.verifier.sha256

    @property
    def path(self) -> str | None:
        """Absolute path of the file; None for a robot from a text, standard input or an object.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").path.endswith("planar_two_link.urdf")
        True
        """
        entry = find_entry(self.source)
        path = entry.path if entry is not None else Path(self.source)
        return str(path.resolve()) if not self.source.startswith(("<", "-")) and path.is_file() else None

    @property
    def root_joint(self) -> str | None:
        """The argument `root_joint` of `load`: "floating", "planar", or None for a fixed root link.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link", root_joint="floating").root_joint
        'floating'
        """
        return self.origin.root_joint

    @property
    def nq(self) -> int:
        """Length of a configuration `q`.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link", root_joint="floating").nq  # position 3, quaternion 4, joints 2
        9
        """
        return self.tree.nq

    @property
    def nv(self) -> int:
        """Length of the joint velocities `v` and of the joint accelerations `a`.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link", root_joint="floating").nv  # linear 3, angular 3, joints 2
        8
        """
        return self.tree.nv

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the moving joints in Pinocchio's order, mimic joints included.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").joint_names
        ('joint_1', 'joint_2')
        """
        return tuple(joint.name for joint in self.tree.joints if joint.kind.nv)

    @property
    def link_names(self) -> tuple[str, ...]:
        """Names of all links; the root link is the first.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").link_names
        ('base', 'link_1', 'link_2', 'tip')
        """
        return self.tree.links

    @property
    def link_frames(self) -> tuple[LinkFrame, ...]:
        """Unique names `link:NAME` of all links' frames; methods such as `placement` accept this list.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> arm.link_frames
        ('link:base', 'link:link_1', 'link:link_2', 'link:tip')
        >>> arm.placement([0.0, 0.0], arm.link_frames)[:, 0, 3].tolist()  # x of each link, m
        [0.0, 0.0, 0.5, 0.9]
        """
        return self.tree.link_frames

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """A name for each number of `q`.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").coordinate_names
        ('joint_1', 'joint_2')
        """
        return configuration.coordinate_names(self.tree)

    @property
    def velocity_names(self) -> tuple[str, ...]:
        """A name for each number of `v` and `a`, and for each column of a Jacobian.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").velocity_names
        ('joint_1', 'joint_2')
        """
        return configuration.velocity_names(self.tree)

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Names of all frames (links and joints), as in Pinocchio, each name once.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").frame_names
        ('base', 'joint_1', 'link_1', 'joint_2', 'link_2', 'end', 'tip')
        """
        return self.tree.frame_names

    @property
    def all_frames(self) -> tuple[str, ...]:
        """Frame names: `link:NAME` for each link, and `joint:NAME` for each joint.

        Each name is a `FrameName`. The `FrameName` `link:hand` always means the link `hand`, even if another
        link or joint is named `link:hand`.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").all_frames[-3:]
        ('joint:joint_1', 'joint:joint_2', 'joint:end')
        """
        return (*self.tree.link_frames, *self.tree.joint_frames)

    @property
    def tip_frame(self) -> str:
        """Name of the default tip frame, which `chain`, `dh` and `export` use.

        The robot catalogue defines the tip frame of some robots. For all other robots, the tip frame is a
        leaf link. The path from the root link to this leaf link has the most degrees of freedom.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").tip_frame
        'tip'
        """
        if self._tip_frame is None:
            leaf = max(
                self.tree.leaves(), key=lambda link: sum(self.tree.joints[i].nv for i in self.tree.path(link))
            )
            self._tip_frame = self.tree.frame_name(leaf)
        return self._tip_frame

    def _default_frame(self) -> str:
        if not self._has_one_tip:
            leaves = [self.tree.frame_name(leaf) for leaf in self.tree.leaves()]
            raise InputError(
                "no frame is given, and the robot has several tips",
                where=self.name,
                found=join_names(leaves),
                remedy=f"name one, such as robot.tip_frame, {self.tip_frame!r}",
            )
        return self.tip_frame

    @property
    def joints(self) -> JointTable:
        """A dict of all joints by name, in Pinocchio's order; the dict contains fixed joints too.

        Each value is a `Joint` with the joint's kind, axis, limits and mimic rule. `print` and notebooks show
        the dict as a table.

        >>> import urdfkin
        >>> joint = urdfkin.load("planar_two_link").joints["joint_2"]
        >>> joint.axis.tolist(), joint.limit.lower, joint.limit.upper
        ([0.0, 0.0, 1.0], -3.0, 3.0)
        """
        return JointTable(self.tree)

    @property
    def frames(self) -> dict[str, str]:
        """A dict that maps each frame's name to the name of a link; the frame is fixed to this link.

        The frame of a joint is fixed to the child link of the joint.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").frames["joint_2"]
        'link_2'
        """
        pairs = zip(self.tree.joints, self.tree.links[1:], strict=True)
        return {joint.name: child for joint, child in pairs} | {link: link for link in self.tree.links}

    @property
    def limits(self) -> FloatArray:
        """(2, nq) lower and upper limits of `q`, rad, m; infinite for a joint without limits.

        The array does not contain the limits of mimic joints. `limit_violations` also checks the limits of
        mimic joints.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").limits.tolist()
        [[-3.0, -3.0], [3.0, 3.0]]
        """
        return configuration.limits(self.tree)

    @property
    def velocity_limits(self) -> FloatArray:
        """(nv,) largest joint velocities, rad/s, m/s; infinite for a joint without a velocity limit.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").velocity_limits.tolist()
        [4.0, 4.0]
        """
        return configuration.velocity_limits(self.tree)

    def neutral(self) -> FloatArray:
        """Return the zero configuration (nq,): zeros, and the identity quaternion for floating joints.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").neutral().tolist()
        [0.0, 0.0]
        """
        return configuration.neutral(self.tree)

    @property
    def poses(self) -> dict[str, FloatArray]:
        """Named configurations (nq,): `neutral`, `ready`, and the configurations in the robot catalogue.

        `neutral` is the zero configuration. In `ready` all joints are within their limits.

        >>> import urdfkin
        >>> robot = urdfkin.load("panda")
        >>> robot.limit_violations("ready"), robot.limit_violations("neutral")
        ([], ['joint panda_joint4: 0 is outside [-3.0718, -0.0698]'])
        """
        return configuration.named_poses(self.tree)

    def sample(self, n: int, seed: int = 0) -> FloatArray:
        """Draw random configurations (n, nq) within the limits of all joints, mimic joints included.

        The same seed gives the same configurations. In some robots, the limits of a mimic joint allow at most
        one value of the mimicked joint. The configurations of such a robot respect the limits of the mimicked
        joint, but may exceed the limits of the mimic joint. `limit_violations` then reports the mimic joint.

        Args:
            n: Number of configurations.
            seed: Seed of the random generator.

        Raises:
            InputError: `n` or `seed` is not a whole number >= 0, or `n` configurations do not fit into
                memory.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> q = arm.sample(5, seed=1)
        >>> q.shape, arm.limit_violations(q)
        ((5, 2), [])
        """
        n = as_int(n, "n", 0, _MAX_NUMBERS // max(1, self.nq))
        seed = as_int(seed, "seed", 0)
        try:
            return sample(self.tree, n, np.random.default_rng(seed))
        except MemoryError:
            raise InputError(
                "this number of configurations does not fit into memory",
                where=self.name,
                found=f"n = {n}, which are {8 * n * self.nq // 10**9} GB",
                remedy="draw several smaller samples, each with another seed",
            ) from None

    def limit_violations(self, q: ConfigurationLike) -> list[str]:
        """Return a line for each joint that exceeds a limit in some configuration of `q` (..., nq).

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").limit_violations([[4.0, 0.0], [0.0, 0.0]])
        ['joint joint_1: 4 is outside [-3, 3]']
        """
        # The returned lines mention values that are probably in degrees, so a warning is not needed.
        q = configuration.parse_finite(self.tree, q, "q", warn=False)
        return configuration.limit_violations(self.tree, q)

    def integrate(self, q: ConfigurationLike, v: ConfigurationLike) -> FloatArray:
        """Return the configuration (..., nq) one second after `q` at constant joint velocities `v`.

        The definition is the same as in Pinocchio's `integrate`. For another duration, pass `v * seconds`.
        The norm of quaternions stays 1. Angles of continuous joints are not wrapped.

        Args:
            q: (..., nq) rad, m.
            v: (..., nv) rad/s, m/s. The velocity of a planar or floating joint is expressed in the axes of
                the moving frame.

        Raises:
            InputError: a wrong length, or a number that is not finite.
            RangeError: a result leaves the range of double precision.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").integrate([0.5, 0.0], [1.0, -1.0]).tolist()
        [1.5, -1.0]
        >>> a1 = urdfkin.load("a1", root_joint="floating", verify=False)
        >>> q = a1.integrate("neutral", "neutral, root_joint.vx=1, root_joint.wz=180deg/s")
        >>> q[:7].round(4).tolist()
        [0.0, 0.6366, 0.0, 0.0, 0.0, 1.0, 0.0]
        """
        return integration.integrate(
            self.tree,
            configuration.parse_finite(self.tree, q, "q"),
            configuration.parse_finite(self.tree, v, "v"),
        )

    def difference(self, start: ConfigurationLike, end: ConfigurationLike) -> FloatArray:
        """Return the joint velocities (..., nv) that lead from `start` to `end` in one second.

        The result is the shortest motion, as in Pinocchio's `difference`. `integrate(start, difference(start,
        end))` gives the same pose of the robot as `end`. Therefore, a continuous joint makes the full
        rotation if a full turn of this joint moves a mimic joint to another pose.

        Args:
            start: (..., nq) rad, m.
            end: (..., nq) rad, m.

        Returns:
            (..., nv) rad/s, m/s. The velocity of a planar or floating joint is expressed in the axes of the
            moving frame.

        Raises:
            InputError: a wrong length, or a number that is not finite.
            RangeError: a result leaves the range of double precision.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").difference([0.5, 0.0], [1.5, -1.0]).tolist()
        [1.0, -1.0]
        """
        ends = (configuration.parse_finite(self.tree, q, "q") for q in (start, end))
        return integration.difference(self.tree, *ends)

    def to_pinocchio(self, q: ConfigurationLike, *, mimic: bool = False) -> FloatArray:
        """Convert `q` (..., nq) to a configuration of the Pinocchio model that `pinocchio_model` returns.

        Pinocchio stores a continuous joint as (cos q, sin q). If `mimic` is False, Pinocchio stores a
        separate coordinate for each mimic joint.

        Args:
            q: (..., nq) rad, m.
            mimic: The value of `mimic` that was passed to `pinocchio_model`.

        Returns:
            (..., model.nq).

        Raises:
            InputError: a wrong length, or a number that is not finite. With `mimic=True`, also if a
                continuous joint is beyond pi, and its full turns move a mimic joint to another pose.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").to_pinocchio("joint_1=0.5, joint_2=-1").tolist()
        [0.5, -1.0]
        """
        return configuration.to_pinocchio(
            self.tree, configuration.parse_finite(self.tree, q, "q"), mimic=as_bool(mimic, "mimic")
        )

    def pinocchio_model(self, *, mimic: bool = False) -> Any:
        """Return a new `pinocchio.Model` that Pinocchio builds from this robot's URDF text.

        `to_pinocchio(q)` returns a configuration of this model. If the robot has a root joint, this joint is
        a free-flyer or a planar joint in the model.

        Args:
            mimic: True: the mimic joints follow their mimic rules; Pinocchio 4.1 then rejects some robots.
                False: each mimic joint is an independent joint, as for a robot loaded with `mimic=False`.

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
        return self.verifier.make_pinocchio_model(mimic=as_bool(mimic, "mimic"))

    def from_pinocchio(self, q: ArrayLike, *, mimic: bool = False) -> FloatArray:
        """Convert a configuration of the Pinocchio model to `q` (..., nq).

        This method is the inverse of `to_pinocchio`. In the result, angles of continuous joints are in [-pi,
        pi], unless a mimic joint shows more turns. `from_pinocchio(to_pinocchio(q))` returns the angles
        `-math.pi` and `math.pi` unchanged.

        Args:
            q: (..., model.nq), a configuration of `pinocchio_model(mimic=mimic)`.
            mimic: The value of `mimic` that was passed to `pinocchio_model`.

        Raises:
            InputError: a wrong length, or a number that is not finite.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").from_pinocchio([0.5, -1.0]).tolist()
        [0.5, -1.0]
        """
        return configuration.from_pinocchio(self.tree, as_finite(q, "q"), mimic=as_bool(mimic, "mimic"))

    def convention(self, name: str | Path | Convention, joints: Sequence[str] | None = None) -> Conversion:
        """Return the conversion between urdfkin's convention and another program's convention.

        The conversion applies to q, v, a, Jacobians and six-vectors, in both directions.

        Args:
            name: A built-in convention, such as "mujoco", "drake" or "isaaclab" (docs/conventions.md), the
                path of a TOML file, or a `Convention`.
            joints: Names of the joints in the order of your program or policy; None: the order of the
                convention.

        Raises:
            UnknownNameError: there is no such convention or joint.
            SourceError: the file cannot be read.
            InputError: an invalid file, a joint without a column, or two columns with the same name.

        >>> import urdfkin
        >>> a1 = urdfkin.load("a1")
        >>> isaaclab = a1.convention("isaaclab")
        >>> isaaclab.joint_names[:4]
        ('FL_hip_joint', 'FR_hip_joint', 'RL_hip_joint', 'RR_hip_joint')
        >>> isaaclab.to(a1.neutral()).shape
        (12,)
        """
        with import_lock:
            from urdfkin.model.conventions import Conversion, find_convention

        if joints is not None:
            reject_set(joints, "joints")
            joints = [as_str(joint, "each of joints") for joint in as_names(joints, "joints")]
        # Only MJCF and USD files have a digest, and urdfkin writes no masses into the URDF of these files.
        has_masses = not self.origin.sha256 and self.source not in ("<pinocchio.Model>", "<yourdfpy>")
        return Conversion(self.tree, self.urdf, find_convention(name), joints, has_masses=has_masses)

    def with_convention(
        self, name: str | Path | Convention, joints: Sequence[str] | None = None
    ) -> ConventionRobot:
        """Return this robot with methods that take and return numbers in another program's convention.

        The arguments are those of `convention`.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link").with_convention("drake")
        >>> arm.velocity([0.0, 0.0], [1.0, 0.0], "tip").tolist()  # angular first
        [0.0, 0.0, 1.0, 0.0, 0.9, 0.0]
        """
        with import_lock:
            from urdfkin.robot.convention_robot import ConventionRobot

        return ConventionRobot(self, self.convention(name, joints))

    def with_locked_joints(
        self, lock: str | Mapping[str, ArrayLike] = MappingProxyType({}), joints: Sequence[str] | None = None
    ) -> Robot:
        """Return this robot with some joints fixed at a value; q, v and a do not contain these joints.

        Locking a joint also locks every joint that mimics it. Pinocchio checks the returned robot with a
        reduced model of the whole URDF (`pinocchio.buildReducedModel`).

        Args:
            lock: Value (rad or m) of each joint to lock: `{"finger": 0.04}` or `"finger=0.04, wrist=30deg"`.
            joints: The joints that remain movable; all other joints are locked. If `lock` begins with the
                name of a pose, such as "ready", the pose contains the missing values. Otherwise, the missing
                values are 0.

        Raises:
            UnknownNameError: there is no such joint or pose.
            InputError: a value is outside the limits, or a joint is a mimic joint or has no single value
                (planar, floating, fixed).

        >>> import urdfkin
        >>> panda = urdfkin.load("panda").with_locked_joints({"panda_finger_joint1": 0.04})
        >>> panda.nq, panda.jacobian("ready", "panda_hand_tcp").shape
        (7, (6, 7))
        >>> elbow = urdfkin.load("planar_two_link").with_locked_joints(joints=["joint_2"])
        >>> elbow.velocity_names, elbow.joints["joint_1"].lock.value
        (('joint_2',), 0.0)
        """
        if not isinstance(lock, str | Mapping):
            raise InputError("lock must be a mapping from joints to values, or text", found=safe_repr(lock))
        chosen = None if joints is None else as_names(joints, "joints")
        locked = configuration.parse_locks(self.tree, lock, chosen)
        robot = copy(self)
        robot.tree = with_locks(self.tree, locked)
        robot.verifier = self.verifier.with_lock(robot.tree, tuple(locked.items()))
        robot._tip_frame = self._tip_frame if self._has_one_tip else None
        return robot

    # -- computation --------------------------------------------------------------------------------

    def compute(
        self,
        name: str,
        inputs: Sequence[ConfigurationLike],
        frame: str | Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """Compute the quantity with the given name, for example "velocity".

        The method of the quantity, for example `velocity`, returns the same result.

        Args:
            name: "placement", "velocity", "jacobian", "jacobian rate", "hessian" or "acceleration".
            inputs: A tuple: (q,), (q, v) or (q, v, a), depending on the quantity.

        Raises:
            UnknownNameError: the quantity or the frame does not exist.
            InputError: a wrong length, a number that is not finite, batch shapes that do not broadcast, the
                wrong number of inputs, or a quantity that only its own method computes.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> arm.compute("velocity", ([0.0, 0.0], [1.0, 0.0]), "tip").tolist()
        [0.0, 0.9, 0.0, 0.0, 0.0, 1.0]
        """
        row = find_quantity(as_str(name, "name"))
        if row not in recursive_quantities():
            raise InputError(f"the {name} has a method of its own", remedy=f"call {row.method}")
        if not isinstance(inputs, tuple | list) or len(inputs) != len(row.inputs):
            raise InputError(f"the {name} takes ({', '.join(row.inputs)})", found=safe_repr(inputs))
        return self._compute_array(name, inputs, frame, reference, base, out, verify, threads)

    def placement(
        self,
        q: ConfigurationLike,
        frame: str | Sequence[str] | None = None,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """Return the placement of a frame, the homogeneous matrix T_world_frame; positions in m.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> T = arm.placement([0.0, 0.0], "tip")
        >>> T[:3, 3].tolist()
        [0.9, 0.0, 0.0]
        >>> arm.placement([[0.0, 0.0], [0.1, 0.2]], ["link_2", "tip"]).shape
        (2, 2, 4, 4)
        """
        fast = self._find_evaluator(frame, _ALIGNED, base, verify, threads)
        if fast and (result := fast._placement(q, out)) is not None:
            return result
        return self._compute_array("placement", (q,), frame, _ALIGNED, base, out, verify, threads)

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
        """Return the pose of a frame relative to another frame, T_other_frame (..., 4, 4).

        T_other_frame = T_world_other^-1 T_world_frame, with both placements from eq. 7.77. The motion of the
        root link does not change T_other_frame.

        Args:
            frame: Name of a link or joint, or a list of names.
            relative_to: Name of the other link or joint.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> arm.relative_placement([0.0, 0.0], "tip", "link_2")[:3, 3].tolist()
        [0.4, 0.0, 0.0]
        """
        with import_lock:
            from urdfkin.kinematics.bodies import relative_pose

        name = as_str(relative_to, "relative_to")
        # A subclass of str can print itself differently in messages, so the name becomes a plain str.
        name = name if isinstance(name, FrameName) else str(name)
        call = Call(
            self.tree, self.plan, frame, _ALIGNED, None, (q,), additional_frames=(name,), relative_to=name
        )
        to = call.flatten_out(out, (4, 4))
        self.verifier.require_pinocchio(verify)
        T_world = call.run_and_locate_error(
            PLACEMENT.compute_results, call.plan, (call.q,), None, threads=threads
        )
        with np.errstate(over="ignore", invalid="ignore"):  # RangeError replaces these warnings.
            T = check_range(relative_pose(T_world[:, -1:], T_world[:, :-1], to))
        result = call.restore_shape(T) if out is None else out
        self.verifier.check(RELATIVE_PLACEMENT, call, result, verify)
        return result

    def velocity(
        self,
        q: ConfigurationLike,
        v: ConfigurationLike,
        frame: str | Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """Return the velocity of a frame (..., 6), [linear; angular].

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> arm.velocity([0.0, 0.0], {"joint_1": 1.0, "joint_2": 0.0}).round(6).tolist()
        [0.0, 0.9, 0.0, 0.0, 0.0, 1.0]
        """
        fast = self._find_evaluator(frame, reference, base, verify, threads)
        if fast and (result := fast._velocity(q, v, out)) is not None:
            return result
        return self._compute_array("velocity", (q, v), frame, reference, base, out, verify, threads)

    def jacobian(
        self,
        q: ConfigurationLike,
        frame: str | Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """Return the velocity Jacobian J of a frame (..., 6, nv), with velocity = J v.

        Column i is the frame's velocity [linear; angular] when the joint velocity `velocity_names[i]` is 1
        and all others are 0. Units: m/s and rad/s per rad/s or m/s.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> J = arm.jacobian("joint_1=0, joint_2=90deg")
        >>> J[:2].round(6).tolist()
        [[-0.4, -0.4], [0.5, 0.0]]
        """
        fast = self._find_evaluator(frame, reference, base, verify, threads)
        if fast and (result := fast._jacobian(q, out)) is not None:
            return result
        return self._compute_array("jacobian", (q,), frame, reference, base, out, verify, threads)

    def jacobian_rate(
        self,
        q: ConfigurationLike,
        v: ConfigurationLike,
        frame: str | Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """Return J-dot (..., 6, nv), the time derivative of `jacobian` along the motion.

        In LOCAL_WORLD_ALIGNED, J a + J-dot v is the classical acceleration, which `acceleration` returns. In
        LOCAL, the axes rotate with the frame; in WORLD, the body point changes with time. Therefore, in LOCAL
        and WORLD, J a + J-dot v is the *spatial* acceleration. Let p'' be the linear part of `acceleration`.
        Let p' and w be the linear and the angular part of `velocity`. If all three methods use the same
        `reference`, the *spatial* acceleration has the linear part p'' - w x p'. J a + J-dot v does not
        contain the acceleration that a moving base causes.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> arm.jacobian_rate([0.0, 0.0], [1.0, 0.0], "tip")[0].tolist()  # of the x row, 1/s
        [-0.9, -0.4]
        """
        return self._compute_array("jacobian rate", (q, v), frame, reference, base, out, verify, threads)

    def hessian(
        self,
        q: ConfigurationLike,
        frame: str | Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """Return the kinematic Hessian H (..., 6, nv, nv), which contains the derivatives of `jacobian`.

        H[..., i, j] is the derivative of column i of J in the direction of the joint velocity j. The sum of
        H[..., j] v[j] over all j is J-dot of eq. 7.126. The product v^T H v is the part of the acceleration
        that depends only on v and q.

        Linear part of H[..., i, j] for revolute joints in LOCAL_WORLD_ALIGNED, where z_i is the axis of joint
        i, and d_i is the vector from joint i to the frame:

        - Joint j before joint i: z_j x (z_i x d_i), because joint j rotates column i.
        - Joint j after joint i: z_i x (z_j x d_j), because joint j moves the frame.

        In WORLD, H[..., i, j] is 0 if joint j comes after joint i. In LOCAL, H[..., i, j] is 0 if joint j
        comes before joint i.

        Symmetry in LOCAL_WORLD_ALIGNED, except for two columns of one planar or floating joint:

        - The linear rows are symmetric in i and j.
        - The angular part of H[..., i, j] minus that of H[..., j, i] is w_j x w_i, where w_i is the angular
          part of column i of J. For parallel axes, w_j x w_i is 0. On a planar arm, all angular rows are 0.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link", verify=False)
        >>> H = arm.hessian([0.0, 0.0], "tip")
        >>> H[0].tolist()  # x row, m/rad: the second derivatives of x = 0.5 cos q1 + 0.4 cos(q1 + q2)
        [[-0.9, -0.4], [-0.4, -0.4]]
        """
        fast = self._find_evaluator(frame, reference, base, verify, threads)
        if fast and (result := fast._hessian(q, out)) is not None:
            return result
        return self._compute_array("hessian", (q,), frame, reference, base, out, verify, threads)

    def acceleration(
        self,
        q: ConfigurationLike,
        v: ConfigurationLike,
        a: ConfigurationLike,
        frame: str | Sequence[str] | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """Return the classical acceleration of a frame (..., 6), [linear; angular].

        The linear part is p'', the second derivative of the position of the frame's origin. In WORLD, p'' is
        the acceleration of the body point at the world origin. The linear part of the spatial acceleration is
        p'' - w x p'. Pinocchio's function for the classical acceleration is `getFrameClassicalAcceleration`.
        Gravity has no effect on the result; the result of `imu` includes gravity.

        In LOCAL_WORLD_ALIGNED and without `base`, the result is J a + J-dot v. Here `jacobian` returns J, and
        `jacobian_rate` returns J-dot. `acceleration_breakdown` lists the contribution of each joint.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> arm.acceleration([0.0, 0.0], [1.0, 0.0], [0.0, 0.0]).round(6).tolist()  # -w^2 r, r = 0.9 m
        [-0.9, 0.0, 0.0, 0.0, 0.0, 0.0]
        """
        fast = self._find_evaluator(frame, reference, base, verify, threads)
        if fast and (result := fast._acceleration(q, v, a, out)) is not None:
            return result
        return self._compute_array("acceleration", (q, v, a), frame, reference, base, out, verify, threads)

    def imu(
        self,
        q: ConfigurationLike,
        v: ConfigurationLike,
        a: ConfigurationLike,
        frame: str | Sequence[str] | None = None,
        *,
        gravity: ArrayLike = GRAVITY,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """Return the readings of an IMU in a frame (..., 6), in the frame's own axes.

        The first three numbers are the accelerometer's reading, the *proper* acceleration R^T (p'' - g) in
        m/s^2. Here p'' is the classical acceleration (eq. 7.130), and g is gravity. At rest, the proper
        acceleration is 9.81 m/s^2 upwards. The last three numbers are the gyroscope's reading, R^T w in rad/s
        (eq. 7.127).

        Args:
            gravity: (3,) m/s^2 in world axes.

        Raises:
            InputError: a wrong length, a number that is not finite, batch shapes that do not broadcast, or a
                gravity that is not three finite numbers.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> arm.imu([0.0, 0.0], [0.0, 0.0], [0.0, 0.0], "tip").tolist()  # at rest
        [0.0, 0.0, 9.81, 0.0, 0.0, 0.0]
        """
        g = as_vectors(gravity, "gravity")
        if g.shape != (3,):
            raise InputError("gravity must be one vector (3,)", found=f"shape {g.shape}")
        return self._compute_array(
            "imu", (q, v, a), frame, Reference.LOCAL, base, out, verify, threads, gravity=g.tolist()
        )

    def singular_values(
        self,
        q: ConfigurationLike,
        frame: str | None = None,
        rows: str = "all",
        *,
        base: BaseMotion | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> SingularValues:
        """Return singular values, condition number and manipulability of `jacobian`, with guaranteed bounds.

        The bounds include the rounding errors of J and of the decomposition. Columns of J that are 0 for
        every q are left out; docs/hessian.md lists two exceptions. LOCAL and LOCAL_WORLD_ALIGNED have the
        same singular values. `rows="all"` mixes linear rows (metres) and angular rows (radians), so the
        values depend on the unit of length. `print` shows the result as a table. Methods of the result:

        - `singularity()`: the lost directions, and the joints that cause the singularity
        - `manipulability_gradient(robot.hessian(q, frame))`: the gradient of the manipulability

        Args:
            frame: Name of a link or joint; None: the robot's only tip.
            rows: Rows of J: "all", "linear" or "angular".

        Raises:
            InputError: a wrong length, a number that is not finite, batch shapes that do not broadcast, or an
                invalid value of `rows`.
            VerificationError: Pinocchio's Jacobian differs by more than the bound.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> found = arm.singular_values([0.3, 0.0], arm.tip_frame, "linear")
        >>> found.values.lower[-1] == 0.0, found.condition.upper  # singular when stretched out
        (np.True_, np.float64(inf))
        """
        which = _ROWS.get(as_str(rows, "rows"))
        if which is None:
            raise InputError("rows must be 'all', 'linear' or 'angular'", found=safe_repr(rows))
        frame = self._default_frame() if frame is None else frame
        J = self.jacobian(q, as_str(frame, "frame"), base=base, verify=verify, threads=threads)
        call = Call(self.tree, self.plan, frame, _ALIGNED, base, (q,))
        with import_lock:
            from urdfkin.verify.exact.numbers import conversion_errors

        decimals = conversion_errors(self.urdf, self.tree, self.tree.path(call.links[0]), call.q)
        size = true_value_magnitudes(call.plan, call.q, None, None, decimals, call.state)
        bound = JACOBIAN.bound(call.plan, size, _ALIGNED)
        error = (EPS * bound.k * bound.scale)[:, 0].reshape(*call.shape, 6, self.nv)
        active = find_active_entries(call.plan)[0]
        columns = FrameJacobian(
            J,
            error,
            str(frame),
            self.velocity_names,
            find_revolute_columns(self.tree),
            active,
            partial(self._sample_jacobians, frame),
            moving_base=base is not None,
        )
        return singular_values(J, error, active[which].any(axis=0), which, columns)

    def analytical_jacobian(
        self,
        q: ConfigurationLike,
        frame: str | Sequence[str] | None = None,
        representation: str = "ZYZ",
        *,
        nearest: float = MIN_SINGULARITY_DISTANCE,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """Return the analytical Jacobian J = C^-1 J_v (eq. 7.122): derivatives of position and orientation.

        The orientation is three Euler angles or a quaternion. The check uses Pinocchio's rotation and
        Jacobian, and an independent formula for the derivatives of the angles
        (`urdfkin.verify.analytical_reference`). Near the representational singularity of Euler angles, the
        result has fewer correct digits. Let s be the sine or cosine of the middle angle. Near the
        singularity, the error bound grows as 1 / s^2.

        Args:
            representation: Euler sequence by SciPy's name, "rpy" (the same as "xyz": roll, pitch, yaw), or
                "quaternion". "ZYZ" is the textbook's.
            nearest: Smallest accepted distance from the representational singularity, rad.
            base: Placement of the root link; None: at the world origin.

        Returns:
            (..., 6, nv), or (..., 7, nv) for a quaternion.

        Raises:
            RepresentationSingularityError: a configuration is nearer to the singularity than `nearest`. If
                Pinocchio checks the call, the smallest accepted distance is at least the rounding error of
                the rotation (about 1e-13 rad). A quaternion has no singularity.
            UnknownNameError: the frame or representation does not exist.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> J = arm.analytical_jacobian([0.3, 0.4], representation="rpy")
        >>> J.shape, J[5].tolist()  # yaw = q1 + q2
        ((6, 2), [1.0, 1.0])
        """
        representation, nearest = (
            as_str(representation, "representation"),
            as_finite_float(nearest, "nearest"),
        )
        representation = "xyz" if representation == "rpy" else representation
        options: dict[str, Any] = {"representation": representation, "nearest": nearest}
        frame = self._default_frame() if frame is None else frame
        call = Call(self.tree, self.plan, frame, _ALIGNED, base, (q,), **options)
        self.verifier.require_pinocchio(verify)
        if self.verifier.resolve_policy(verify):
            nearest = max(nearest, singularity_margin(call.plan))
        rows = 7 if representation == "quaternion" else 6
        to = call.flatten_out(out, (rows, self.nv))
        J = np.empty((call.n, len(call.links), rows, self.nv)) if to is None else to
        walk, state = (call.plan, (call.q,), _ALIGNED), {"base": call.state, "threads": threads}
        Rs = call.run_and_locate_error(PLACEMENT.compute_results, *walk, **state)[..., :3, :3]
        Js_v = call.run_and_locate_error(
            JACOBIAN.compute_results, *walk, out=J if rows == 6 else None, **state
        )
        too_near: list[tuple[float, int]] = []

        def compute(part: slice) -> None:
            try:
                with np.errstate(over="ignore", invalid="ignore"):
                    J[part] = ANALYTICAL_JACOBIAN.compute(representation, Rs[part], Js_v[part], nearest)
            except RepresentationSingularityError as error:
                too_near.append((error.distance, part.start + error.sample[0]))

        with import_lock:
            from urdfkin.compiled.evaluate import compute_in_parts

        compute_in_parts(compute, call.n, threads)
        if too_near:
            distance, k = min(too_near)
            raise RepresentationSingularityError(representation, distance, call.batch_index(k))
        if not np.isfinite(J).all():
            raise RangeError("a result leaves the range of double precision", remedy="give smaller numbers")
        result = call.restore_shape(J) if out is None else out
        self.verifier.check(ANALYTICAL_JACOBIAN, call, result, verify)
        return result

    def acceleration_breakdown(
        self,
        q: ConfigurationLike,
        v: ConfigurationLike,
        a: ConfigurationLike,
        frame: str | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        out: FloatArray | None = None,
        verify: Verify | None = None,
        threads: int | None = None,
    ) -> AccelerationBreakdown:
        """Return the contributions of each joint to a frame's classical acceleration (eq. 7.125, 7.130).

        A joint has four kinds of contribution: transverse, centripetal, Coriolis and sliding. A moving `base`
        has one contribution. The sum of all contributions is the result of `acceleration`, which the check
        compares with Pinocchio's acceleration.

        Args:
            frame: Name of a link or joint; None: the robot's only tip.
            out: Output array for the terms, C-contiguous float64 (..., joints, 4, 6).

        Returns:
            The contributions, with leading batch axes; `print` and notebooks show them as a table.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> print(arm.acceleration_breakdown([0.0, 0.0], [1.0, 0.0], [0.0, 0.0], "tip"))
        Acceleration by joint and kind
        m/s^2 and rad/s^2; the parts sum to the acceleration (7.125, 7.130).
        joint    kind         lin x  lin y  lin z  ang x  ang y  ang z
        --------------------------------------------------------------
        joint_1  centripetal   -0.9      0      0      0      0      0
        sum                    -0.9      0      0      0      0      0
        """
        with import_lock:
            from urdfkin.compiled.breakdown import ACCELERATION_KINDS, AccelerationBreakdown, moving_joints

        frame = self._default_frame() if frame is None else frame
        call = Call(self.tree, self.plan, as_str(frame, "frame"), reference, base, (q, v, a))
        self.verifier.require_pinocchio(verify)
        to = call.flatten_out(out, (len(moving_joints(self.tree, call.links[0])), len(ACCELERATION_KINDS), 6))
        flat = (self.tree, call.links[0], call.q, *call.rates, call.reference, call.state)
        parts: AccelerationBreakdown = call.run_and_locate_error(
            ACCELERATION_BREAKDOWN.compute, *flat, out=None if to is None else to[:, 0], threads=threads
        )
        base_part, terms = (x.reshape(*call.shape, *x.shape[1:]) for x in (parts.base, parts.terms))
        breakdown = AccelerationBreakdown(parts.joints, base_part, terms if out is None else out)
        self.verifier.check(ACCELERATION_BREAKDOWN, call, breakdown.total, verify)
        return breakdown

    def enclose(
        self,
        q: ConfigurationLike,
        v: ConfigurationLike,
        a: ConfigurationLike,
        frame: str | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        base: BaseMotion | None = None,
        digits: int | None = None,
        hessian: bool = False,
    ) -> Enclosures:
        """Return intervals that provably contain the true placement, velocity, acceleration, J and J-dot.

        The true values are those of eq. 7.77, 7.85 and 7.126 to 7.130 without rounding. The inputs of these
        equations are the URDF's decimals, and the doubles `q`, `v`, `a` and `base`. Both ends of an interval
        are doubles. With the default `digits`, the two ends are nearly always neighbouring or equal. An
        interval around 0 is about 1e-38 wide. The result also states whether urdfkin's and Pinocchio's values
        lie in the intervals. The computation takes less than 1 ms for each joint between the root link and
        the frame.

        Args:
            q: (nq,) rad, m.
            v: (nv,) rad/s, m/s.
            a: (nv,) rad/s^2, m/s^2.
            frame: Name of a link or joint; None: the robot's only tip.
            reference: Reference frame of velocities, accelerations and Jacobians.
            base: Motion of the root link; None: fixed at the world origin.
            digits: Decimal digits of the interval arithmetic, at least 15. None: 30 plus the number of joints
                between the root link and the frame. With 15 digits, many other doubles can lie between the
                two ends of an interval.
            hessian: Whether to compute intervals for the Hessian too; this takes less than 0.1 ms for each
                pair of joints.

        Raises:
            InputError: an argument is a batch, has a wrong length or is not finite, or `digits` is not in 15
                to 10,000.
            UnknownNameError: the frame or reference does not exist.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> q, v, a = [0.3, -0.4], [1.0, 0.5], [0.0, 0.2]
        >>> proof = arm.enclose(q, v, a, arm.tip_frame)
        >>> J = arm.jacobian(q, arm.tip_frame)
        >>> bool((proof.jacobian.error_bound(J) < 4e-16).all())
        True
        """
        with import_lock:
            from urdfkin.verify.exact.enclosure import enclose

        frame = self._default_frame() if frame is None else frame
        inputs, hessian = (q, v, a), as_bool(hessian, "hessian")
        return enclose(self.verifier, self.plan, inputs, frame, reference, base, digits, hessian=hessian)

    def prepare(
        self,
        frame: str | None = None,
        reference: Reference | str = _ALIGNED,
        *,
        verify: bool = False,
    ) -> PreparedFrame:
        """Return a fast evaluator of one frame, for one configuration per call.

        The class `PreparedFrame` documents the evaluator's methods.

        Args:
            frame: Name of a link or joint; None: the robot's only tip.
            reference: Reference frame of the results.
            verify: True: check each result with Pinocchio. False: check no result.

        Raises:
            UnknownNameError: the frame or reference does not exist.
            InputError: `verify` is neither True nor False.

        >>> import urdfkin
        >>> tip = urdfkin.load("planar_two_link").prepare("tip")
        >>> tip.velocity([0.0, 0.0], [1.0, 0.0]).tolist()
        [0.0, 0.9, 0.0, 0.0, 0.0, 1.0]
        """
        frame = self._default_frame() if frame is None else frame
        prepared = self._prepare(frame, reference, verify=as_bool(verify, "verify"))
        prepared.always_load = True
        return prepared

    def compile(self, frame: str | None = None, reference: Reference | str = _ALIGNED) -> CompiledFrame:
        """Return the fastest evaluator of one frame: machine code for this robot.

        At the first call of a quantity, the system's C compiler compiles the code in a few seconds. A cache
        stores the compiled code for later programs on the same machine. The first call of each quantity also
        compares the compiled code with Pinocchio, unless the robot was loaded with `verify=False`. Without a
        C compiler, the evaluator uses Numba. The class `CompiledFrame` documents the evaluator's methods.

        Args:
            frame: Name of a link or joint; None: the robot's only tip.
            reference: Reference frame of the results.

        Raises:
            UnknownNameError: the frame or reference does not exist.
            VerificationError: at the first call, if Pinocchio's result differs by more than the bound.

        >>> import urdfkin
        >>> tip = urdfkin.load("planar_two_link").compile("tip")
        >>> tip.placement([0.0, 0.0])[:3, 3].tolist()
        [0.9, 0.0, 0.0]
        """
        with import_lock:
            from urdfkin.export.compiled_frame import CompiledFrame

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
        form: str = "tree",
        name: str | None = None,
        verify: bool | None = None,
    ) -> str:
        """Return the kinematics of a frame as straight-line source code.

        urdfkin compares the code with Pinocchio, and writes the agreement in a comment of the code. The code
        also contains a self-test, with expected values that were computed with fifty digits.

        Args:
            to: Language, one of `urdfkin.export.LANGUAGES`, such as "c" or "numpy".
            frame: Name of a link or joint; None: `tip_frame`.
            quantities: Any of "placement", "velocity", "jacobian", "jacobian_rate", "hessian",
                "acceleration".
            reference: Reference frame of velocities, accelerations and Jacobians.
            form: Source of the pose: "tree": the joints of the URDF. "dh": the Denavit-Hartenberg table from
                `base_frame` to the frame. "screws": the product of exponentials from `base_frame` to the
                frame. With "dh" and "screws", `base_frame` takes the place of the world frame.
            name: Name for the file of the code; in C, also the prefix of function names. None: a name
                made of the robot's name and the frame's name.
            verify: True: check the code with Pinocchio. None: as chosen in `load`. The first line of
                unchecked code contains the word UNVERIFIED.

        Raises:
            UnknownNameError: the language, frame, quantity, reference or form does not exist.
            InputError: `quantities` is empty, or contains a quantity that cannot be exported.
            VerificationError: Pinocchio's result differs by more than the bound.

        >>> import urdfkin
        >>> code = urdfkin.load("planar_two_link").export("numpy", "tip", ["jacobian"])
        >>> scope = {}
        >>> exec(code, scope)
        >>> scope["jacobian"]([0.0, 0.0])[:2].tolist()
        [[-0.0, -0.0], [0.9, 0.4]]
        """
        frame, form = as_choice(frame, self.tip_frame, "frame"), as_str(form, "form")
        name = None if name is None else as_str(name, "name")
        code = get_hook("code of a robot")(self, frame, quantities, reference, form, name=name, verify=verify)
        return str(get_hook("code in a language")(code, as_str(to, "to")))

    def torch(
        self,
        frame: str | None = None,
        quantities: Sequence[str] = ("placement", "jacobian", "velocity", "acceleration"),
        reference: Reference | str = _ALIGNED,
        *,
        verify: bool | None = None,
    ) -> Any:
        """Return a `torch.nn.Module` with the kinematics of a frame, for PyTorch.

        The module is an object of the class `Kinematics` in `export("torch", ...)`. By default, `module(q)`
        returns the placement (..., 4, 4). Each quantity is also a method: `module.jacobian(q)`. Tensors may
        have any batch axes, any floating type and any device. PyTorch, which must be installed, can compute
        derivatives of the results.

        Args:
            frame: As in `export`.
            quantities: As in `export`. A call of the module returns the quantity with the fewest of the
                inputs q, v and a. If several quantities have equally few inputs, the call returns the first
                of these quantities.
            reference: As in `export`.
            verify: As in `export`.

        Raises:
            InputError: PyTorch is not installed. Other reasons are as in `export`.
            UnknownNameError: as in `export`.
            VerificationError: Pinocchio's result differs by more than the bound.

        >>> import urdfkin
        >>> robot = urdfkin.load("planar_two_link")
        >>> "class Kinematics(torch.nn.Module):" in robot.export("torch", "tip")
        True
        """
        with import_lock:
            from urdfkin.export.python import load_torch_module, require_torch

        require_torch()
        return load_torch_module(self.export("torch", frame, quantities, reference, verify=verify))

    # -- chains and Denavit-Hartenberg tables ---------------------------------------------------------

    def chain(self, tip: str | None = None, base: str | None = None) -> FrameChain:
        """Return the chain of joints between two frames.

        The path may lead towards the tips, towards the root, or through the common ancestor of the two
        frames.

        Args:
            tip: Name of a link or joint; None: `tip_frame`.
            base: Name of a link or joint; None: `base_frame`.

        Raises:
            UnknownNameError: the frame does not exist.
            InputError: the path contains a planar or floating joint.

        >>> import urdfkin
        >>> urdfkin.load("planar_two_link").chain("tip", "base")
        <FrameChain planar_two_link: base to tip, 2 joints>
        """
        return make_chain(
            self.tree, as_choice(tip, self.tip_frame, "tip"), as_choice(base, self.base_frame, "base")
        )

    def select(self, path: FrameChain | DHTable, q: ConfigurationLike) -> FloatArray:
        """Return the n coordinates (..., n) of a chain or table, selected from the robot's `q` (..., nq).

        Args:
            path: A result of `chain` or `dh`.
            q: (..., nq) rad, m.

        Raises:
            InputError: the length of `q` is not `nq`, or `path` is not a chain or table.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> arm.select(arm.chain("link_1", "base"), [0.1, 0.2]).tolist()
        [0.1]
        """
        if not hasattr(path, "coupling"):
            raise InputError("path must be a result of `chain` or `dh`", found=safe_repr(path))
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
        """Return the Denavit-Hartenberg table of the path between two frames, checked with Pinocchio.

        The table's methods take only the coordinates of the joints in the table, in the order of
        `table.joint_names`. With `table = robot.dh(...)`, `robot.select(table, q)` selects these coordinates
        from q. `urdfkin.dh.make_dh_table` explains the arguments in full.

        Args:
            tip: Name of a link or joint; None: `tip_frame`.
            base: Name of a link or joint; None: `base_frame`.
            convention: "standard" (distal, the textbook's) or "modified" (proximal, Craig's).
            near_parallel: "hayati": rows of nearly parallel axes have a fifth parameter, beta. "strict": all
                rows have only the four parameters.
            snap: Tolerance in rad for rounding angles to multiples of 15 degrees; 0 for an exact table.
            last: "tip": the last row ends at the tip if its four parameters suffice. "flange": the last row
                ends on the last joint axis, and the tool transform leads from this axis to the tip.
            parallel_offset: Row for the sum of the offsets d along consecutive parallel axes. "last": the row
                of the last axis. "first": the row of the first axis. "each": no sum, each row contains the
                offset of its own link.
            flip: Names of joints whose positive direction is reversed in the table.
            first: "base": d_1 and theta_1 contain the offset along the first axis and the rotation about this
                axis. "joint": d_1 and theta_1 are 0, and the table's base transform contains the offset and
                the rotation (Craig's choice).
            sign: Rule for the direction of the x axes. "theta": |theta| is at most a right angle. "a": the
                length a is not negative. "alpha": the angle alpha is not negative. The tip determines the x
                axis of the last row.
            slide: Rule for the position of a prismatic joint's axis. "drawn": the axis passes through the
                joint's origin in the URDF. `make_dh_table` lists exceptions, such as the first joint.
                "minimal": the prismatic axis passes through the origin of a neighbouring revolute joint, so
                the length a between these two axes is 0. The previous joint is used only if the next joint is
                not revolute.
            like: A published table. The result copies the positive joint directions, the directions of the x
                axes, and the offsets d along parallel axes from this table. The result also copies theta of
                the first and last row. From a standard table, the result also copies a and alpha of the last
                row. All other numbers come from the URDF. If `like` is used, the arguments `flip`, `first`,
                `last`, `sign` and `parallel_offset` must have their default values.
            verify: True: check the table with Pinocchio. None: as chosen in `load`.

        Raises:
            UnknownNameError: a frame or a joint does not exist.
            InputError: an option has an invalid value; `like` excludes an option; `like` describes a
                different robot; the path contains a planar or floating joint.
            RangeError: a coordinate of a joint's origin in the URDF, or a length in `like`, is above 1e150 m.
                Also if the bound on the table's errors leaves the range of double precision.
            TableError: Pinocchio's placements differ by more than the bound.

        Example:
            >>> import urdfkin
            >>> table = urdfkin.load("planar_two_link").dh("tip", "base")
            >>> [row.a for row in table.rows]
            [0.5, 0.4]
            >>> urdfkin.load("ur5").dh("tool0", "base", snap=1e-6).rows[3].d
            0.10915
        """
        with import_lock:
            from urdfkin.dh.make import make_dh_table

        table = make_dh_table(
            self.tree,
            as_choice(tip, self.tip_frame, "tip"),
            as_choice(base, self.base_frame, "base"),
            convention,
            near_parallel=near_parallel,
            snap=snap,
            last=last,
            parallel_offset=parallel_offset,
            flip=flip,
            first=first,
            sign=sign,
            slide=slide,
            like=like,
        )
        if self.verifier.resolve_policy(verify):
            self.verifier.check_table(table)
        return table

    def screws(
        self, tip: str | None = None, base: str | None = None, *, verify: bool | None = None
    ) -> ProductOfExponentials:
        """Return the product of exponentials of the path between two frames, checked with Pinocchio.

        Args:
            tip: Name of a link or joint; None: `tip_frame`.
            base: Name of a link or joint; None: `base_frame`.
            verify: True: check the product with Pinocchio. None: as chosen in `load`.

        Raises:
            UnknownNameError: a frame does not exist.
            InputError: the path contains a planar or floating joint.
            TableError: Pinocchio's placements differ by more than the bound.

        Example:
            >>> import urdfkin
            >>> urdfkin.load("planar_two_link").screws("tip", "base").space[1].tolist()  # [w; v]
            [0.0, 0.0, 1.0, 0.0, -0.5, 0.0]
        """
        with import_lock:
            from urdfkin.dh.screws import make_screws
            from urdfkin.verify.conversions import check_screws

        found = make_screws(self.chain(tip, base))
        if self.verifier.resolve_policy(verify):
            check_screws(self.verifier, found)
        return found

    def tree_parameters(self, *, verify: bool | None = None) -> TreeParameters:
        """Return the Khalil-Kleinfinger parameters of the whole robot as one table, checked with Pinocchio.

        Args:
            verify: True: check the table with Pinocchio. None: as chosen in `load`.

        Raises:
            InputError: the robot has a planar or floating joint, which has no single axis.
            TableError: Pinocchio's placements differ by more than the bound.

        >>> import urdfkin
        >>> [(row.joint, row.d) for row in urdfkin.load("planar_two_link").tree_parameters().rows]
        [('joint_1', 0.0), ('joint_2', 0.5), ('end', 0.4)]
        """
        with import_lock:
            from urdfkin.dh.tree_parameters import make_tree_parameters

        parameters = make_tree_parameters(self.tree)
        if self.verifier.resolve_policy(verify):
            self.verifier.check_tree_parameters(parameters)
        return parameters

    # -- verification --------------------------------------------------------------------------------

    def certificate(self) -> Certificate:
        """Summarize all checks so far: the oracle, the largest disagreements, and the unchecked results.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> J = arm.jacobian([0.0, 0.0], "tip")
        >>> arm.certificate().verified
        True
        """
        return self.verifier.certificate()

    # -- internal ------------------------------------------------------------------------------------

    def plan(self, links: Sequence[int]) -> CompiledTree:
        """Return the compiled tree for the link indices `links`, from a cache."""
        key = tuple(links)
        if (plan := self._plans.get(key)) is None:
            plan = self._plans[key] = compile_tree(self.tree, key)
        return plan

    def _compute_array(
        self,
        name: str,
        inputs: Sequence[ConfigurationLike],
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
        to = call.flatten_out(out, row.result_shape(self.nv))
        self.verifier.require_pinocchio(verify)
        results = call.run_and_locate_error(
            row.compute_results,
            call.plan,
            (call.q, *call.rates),
            call.reference,
            base=call.state,
            out=to,
            threads=threads,
            keep_in_cache=self.verifier.resolve_policy(verify) is True,
            **options,
        )
        result = call.restore_shape(results) if out is None else out
        self.verifier.check(row, call, result, verify)
        return result

    def _sample_jacobians(self, frame: str) -> FloatArray:
        """Return unchecked Jacobians (n, 6, nv) of a frame at random configurations."""
        call = Call(self.tree, self.plan, frame, _ALIGNED, None, (self.sample(_RANK_SAMPLES),))
        J: FloatArray = call.run_and_locate_error(JACOBIAN.compute_results, call.plan, (call.q,), _ALIGNED)
        return J[:, 0]

    def _find_evaluator(
        self,
        frame: str | Sequence[str] | None,
        reference: Reference | str,
        base: BaseMotion | None,
        verify: Verify | None,
        threads: int | None,
    ) -> PreparedFrame | None:
        policy = self.verifier.policy if verify is None else verify
        if base is not None or threads is not None or (policy is not True and policy is not False):
            return None
        if frame is None:
            frame = self._default_frame()
        if not isinstance(frame, str):
            return None
        known = self._checked if policy else self._prepared
        if reference is _ALIGNED and type(frame) is str and (fast := known.get(frame)) is not None:
            return fast
        return self._prepare(frame, reference, verify=policy)

    def _prepare(self, frame: str, reference: Reference | str, *, verify: bool = False) -> PreparedFrame:
        # The hash of a `Reference` is slow. Therefore, a plain str with the default reference is its own key.
        # All other keys are tuples that contain the class of `frame`: a `LinkFrame` and a plain str can be
        # equal, although they name different frames.
        plain = reference is _ALIGNED and type(frame) is str
        key = frame if plain else (type(frame), frame, type(reference), reference)
        known = self._checked if verify else self._prepared
        try:
            prepared = known.get(key)
        except TypeError:  # A valid argument is hashable.
            self.tree.frame_link(frame)
            return self._prepare(frame, Reference.of(reference), verify=verify)
        if prepared is None:
            plan, of = self.plan([self.tree.frame_link(frame)]), Reference.of(reference)
            prepared = known[key] = PreparedFrame(self, frame, of, plan, verify=verify)
        return prepared


# -- docstrings --------------------------------------------------------------------------------------

_SHARED_ITEM = re.compile(r"^- `(\w+)`: (.*(?:\n  .*)*)", re.MULTILINE)
_ITEM = re.compile(r"^    (\w+): (.*(?:\n {8}.*)*)", re.MULTILINE)


def _merge_shared_items(method: FunctionType, shared: dict[str, str], errors: dict[str, str]) -> str:
    """Return a method's docstring with complete sections Args, Returns and Raises.

    `shared` describes arguments, `errors` describes errors, and `QUANTITIES` describes the result.
    """
    text, start, example = cleandoc(method.__doc__ or "").partition("\n\n>>> ")
    text, *parts = re.split(r"\n\n(Args|Returns|Raises):\n", text)
    own = {"Args": "", "Returns": "", "Raises": ""} | dict(zip(parts[::2], parts[1::2], strict=True))
    code, described = method.__code__, shared | dict(_ITEM.findall(own["Args"]))
    names = code.co_varnames[1 : code.co_argcount + code.co_kwonlyargcount]
    own["Args"] = _indent_items([f"{name}: {described[name]}" for name in names])
    row = next((row for row in QUANTITIES.values() if row.method == method.__name__), None)
    if row is not None:
        shape, units = ", ".join(map(str, row.shape)), [f"{x} in {unit}" for x, unit in row.units.items()]
        result = "; ".join((f"(..., {shape}), or (..., frames, {shape}) for a list of frames", *units))
        source = f"Equation{'s' * (len(row.equations) > 1)} {', '.join(row.equations)}."
        own["Returns"] = _indent_items([f"{own['Returns'] or f'{result}.'} {source}"])
    raised = dict(_ITEM.findall(own["Raises"]))
    own["Raises"] = _indent_items([f"{name}: {words}" for name, words in (raised | errors | raised).items()])
    sections = (f"\n\n{title}:\n{section}" for title, section in own.items() if section)
    return "".join((text, *sections, start, example))


def _indent_items(items: Sequence[str]) -> str:
    lines = (" ".join(item.split()) for item in items)
    return "\n".join(fill(x, 98, initial_indent=4 * " ", subsequent_indent=8 * " ") for x in lines)


def _complete_docstrings() -> None:
    arguments, _, errors = cleandoc(Robot.__doc__ or "").partition("These methods share these errors:")
    shared = dict(_SHARED_ITEM.findall(arguments)), dict(_SHARED_ITEM.findall(errors))
    for method in vars(Robot).values():
        if isinstance(method, FunctionType) and "threads" in method.__code__.co_varnames and method.__doc__:
            method.__doc__ = _merge_shared_items(method, *shared)


_complete_docstrings()
