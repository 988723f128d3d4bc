"""Convert the UsdPhysics joints of a USD stage (a scene of objects, called prims) to a kinematic tree.

- A prim with `PhysicsRigidBodyAPI` becomes a link; the scale of the prim's frame is removed. A plain `Xform`
  prim below a body also becomes a link; a fixed joint connects this link with the body.
- A joint prim contains two poses of the joint frame: pose A in the first body, and pose B in the second body.
  With the joint motion J(q), the pose of the second body in the first body is A J(q) B^-1.
  If the second body is the parent in the tree, urdfkin exchanges A and B and reverses the joint axis. The
  pose of the first body in the second body is B J(q)^-1 A^-1.
- Lengths are multiplied by `metersPerUnit`, and angles are converted from degrees. If the up axis is Y, the
  robot is rotated, so that z is up.
- Joints that close a loop, name a missing prim, or are excluded from the articulation are reported.

A stage consists of files, called layers. Before OpenUSD combines the layers, `find_layer_files` reads each
layer separately. `find_layer_files` refuses references to network addresses, and to files outside the robot's
folder, package and repository.
"""

from __future__ import annotations

import math
import os
import re
from collections import Counter, deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np

from urdfkin.errors import InputError, SourceError, UnknownNameError
from urdfkin.kinematics.rotation import quaternion_of, rotation_from_quaternion
from urdfkin.kinematics.roundings import SINGLE_ROUNDOFF
from urdfkin.model.tree import (
    MAX_PLAUSIBLE_ANGLE,
    FloatArray,
    Joint,
    JointKind,
    KinematicTree,
    Limit,
    Mimic,
    build_tree,
    inverse,
    pose,
)
from urdfkin.system.files import MAX_BYTES, read_start
from urdfkin.system.lazy_import import install_command, installed_version
from urdfkin.urdf.confinement import AllowedPaths
from urdfkin.urdf.mjcf import (
    FALLBACK_PRISMATIC_LIMIT,
    depends_on,
    make_fixed_joint,
    make_unique,
    replace_missing_limits,
    resolve_rule,
)
from urdfkin.urdf.sources import USD_SUFFIXES

_MAX_LAYERS = 1_000
#: A USD limit of at least this size means no limit. The limit is infinite, or is the largest single-precision
#: number.
_LARGEST_SINGLE = float(np.finfo(np.float32).max)
#: A frame has shear if the cosine between two axes of the frame exceeds `_MAX_SHEAR` * u * n. The path of the
#: frame's prim contains n prims. The largest relative error of rounding to single precision is u. Each entry
#: of a stored rotation matrix has a rounding error of at most u. The product of two rotation matrices in
#: single precision adds an error of 3 u to each entry. Therefore, the scalar product of two columns has an
#: error below 14 u (4 * 2 sqrt(3) u). Rounding changes the length of a stored quaternion by at most u.
#: Therefore, the cosine between two axes changes by at most 4 u.
_MAX_SHEAR = 14.0
#: Largest metersPerUnit and scale. The smallest is the inverse of this number. Products and squares of these
#: numbers are then finite.
_MAX_SCALE = 1e30
#: OpenUSD's class `GfTransform` replaces a smaller scale by 1e-10.
_MIN_JOINT_SCALE = 1e-5
#: Largest distance (m) of a prim from the origin, along an axis.
_MAX_POSITION = 1e60
#: Rule USD303 checks only limits above this angle (degrees), because a revolute joint with smaller limits
#: hardly moves.
_NEGLIGIBLE_LIMIT_DEGREES = 0.01
_NO_LIMITS = (-math.inf, math.inf)
#: First bytes of a Git LFS pointer file, which replaces a file that was not downloaded.
_LFS_POINTER = b"version https://git-lfs.github.com/spec/"
_MIMIC_SCHEMAS = ("NewtonMimicAPI", "PhysxMimicJointAPI")
#: Names of USD relationships to a mimicked joint. The regex group is a direction, such as rotX.
_MIMIC_RELATIONSHIP = re.compile(r"newton:mimicJoint|physxMimicJoint:(\w+):referenceJoint")
#: A USD type or schema with one of these words in its name couples joints or bodies.
_COUPLING_WORDS = ("Mimic", "Equality", "Tendon")
#: Suffixes of joint types that a kinematic tree cannot represent. OpenUSD recognizes gear joints and
#: rack-and-pinion joints only with a plugin.
_UNSUPPORTED_JOINTS = ("DistanceJoint", "GearJoint", "RackAndPinionJoint")
#: Nonlinear coefficients of MuJoCo's joint equality; mimic rules are linear.
_NONLINEAR_COEFFICIENTS = ("mjc:coef2", "mjc:coef3", "mjc:coef4")
_AXIS_INDEX = {"X": 0, "Y": 1, "Z": 2}
_MOTION_DIRECTIONS = ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")
#: Names of Xform prims that contain the shapes of a body.
_SHAPE_XFORM_NAMES = ("visual", "visuals", "collision", "collisions")
#: Rotation of the y axis onto the z axis.
_ROTATION_OF_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])

#: Kinds of remarks. Each kind has a rule in the module `lint.rules.left_out`.
RemarkKind = Literal[
    "left-out-of-usd", "unit-scale", "up-axis", "lost-mimic", "limit-unit", "loose-body", "outside-joint",
    "rest-pose", "mirrored-body", "missing-layer", "unused-in-usd", "time-samples",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class UsdRemark:
    """A part of the stage that the tree omits, or a probable mistake."""

    kind: RemarkKind
    where: str
    what: str
    remedy: str | None = None


@dataclass(frozen=True, slots=True)
class UsdJoint:
    """The values of a joint prim, before the conversion to z up.

    The fields `body1`, `p1` and `quat1` describe the second body.

    Attributes:
        directions: The directions in which the joint moves, such as `rotZ`.
        body0: Path of the first body; empty for the world.
        p0: (3,) origin of the joint frame in the first body, m.
        quat0: (4,) unit quaternion of the joint frame in the first body, scalar last.
        limits: Lower and upper limit, rad or m.
        length_sum: Sum of the lengths (m) of all vectors that are added to compute `p0` and `p1`.
    """

    directions: str
    body0: str
    body1: str
    p0: FloatArray
    quat0: FloatArray
    p1: FloatArray
    quat1: FloatArray
    limits: tuple[float, float]
    length_sum: float

    def as_list(self) -> list[Any]:
        return [one.tolist() if isinstance(one, np.ndarray) else one for one in astuple(self)]


@dataclass(frozen=True, slots=True)
class Usd:
    """A robot from a USD stage.

    Attributes:
        prims: Path of the prim, by link name. A link without a prim has no entry.
        rest_poses: (n, 4, 4) poses of the prims in the world, in the order of `prims`, in m with z up.
            UsdGeom computes the poses.
        rest_q: (nq,) configuration in which the links have the poses `rest_poses`. For planar and floating
            joints, `rest_q` contains the neutral configuration.
        single_rounding_terms: Five numbers for each joint, by joint name. The numbers bound the effect of
            rounding to single precision:

            1. a bound on the error (m) of the joint origins,
            2. a bound on the error (rad) of the joint orientations,
            3. the sum of the lengths (m) of the vectors that the orientation errors rotate,
            4. a bound on the relative error of a mimic joint's value, or 0 for other joints,
            5. the distance (m) between the joint frame and the child frame.
        joints: The joint prims in the tree. The keys are the paths of the prims.
        meters_per_unit: The stage's metersPerUnit.
        joint_names: Names of all joints, in the order of the joint prims in the stage.
    """

    tree: KinematicTree
    prims: dict[str, str]
    rest_poses: FloatArray
    rest_q: FloatArray
    single_rounding_terms: dict[str, tuple[float, float, float, float, float]]
    joints: dict[str, UsdJoint]
    stage: Any
    meters_per_unit: float
    remarks: tuple[UsdRemark, ...]
    files: tuple[str, ...]
    joint_names: tuple[str, ...]


def version() -> str:
    found = installed_version("usd-core") or installed_version("usd-exchange")
    if found is None:
        raise InputError("OpenUSD is not installed", remedy=install_command("usd"))
    return found


def import_openusd() -> Any:
    try:
        from pxr import Ar, Gf, Sdf, Tf, Usd, UsdGeom, UsdPhysics
    except ImportError:
        raise InputError("OpenUSD is not installed", remedy=install_command("usd")) from None
    return SimpleNamespace(Ar=Ar, Gf=Gf, Sdf=Sdf, Tf=Tf, Usd=Usd, UsdGeom=UsdGeom, UsdPhysics=UsdPhysics)


def find_layer_files(pxr: Any, path: str) -> tuple[str, ...]:
    """Return the files of a stage.

    | Error | Cause |
    |---|---|
    | InputError | a forbidden reference, value clips or a Git LFS pointer |
    | InputError | a layer that OpenUSD does not accept, or more than 1,000 layers |
    | SourceError | an unreadable file, or more than `MAX_BYTES` bytes in total |
    """
    allowed_paths = AllowedPaths.of_file(Path(path), [], [])
    open_, known, total = deque([(path, path)]), {path}, 0
    files: dict[str, None] = {}
    while open_:
        identifier, where = open_.popleft()
        outer = pxr.Ar.SplitPackageRelativePathOuter(identifier)[0]
        if outer not in files:
            if read_start(Path(outer), len(_LFS_POINTER)) == _LFS_POINTER:
                what = "this file is a pointer of Git LFS, not USD"
                raise InputError(what, where=outer, remedy="run git lfs pull")
            size = Path(outer).stat().st_size
            if size > MAX_BYTES:
                found = f"{size} bytes, over {MAX_BYTES}"
                raise SourceError("the file is too large", where=outer, found=found)
            total += size
            if total > MAX_BYTES:
                what = "the files of this stage are too large"
                raise SourceError(what, where=where, found=f"over {MAX_BYTES} bytes")
            files[outer] = None
        layer = pxr.Sdf.Layer.FindOrOpen(identifier)
        if layer is None:
            raise InputError("OpenUSD does not accept this file", where=identifier)
        _refuse_clips(pxr, layer, identifier)
        for asset in layer.GetCompositionAssetDependencies():
            address = _resolve_asset(pxr, layer, asset, allowed_paths, identifier)
            if address is None or address in known:
                continue
            known.add(address)
            if len(known) > _MAX_LAYERS:
                raise InputError("this stage has too many layers", where=path, found=f"over {_MAX_LAYERS}")
            open_.append((address, identifier))
    return tuple(files)


def _refuse_clips(pxr: Any, layer: Any, where: str) -> None:
    """Refuse value clips, because OpenUSD does not list their files among the layer's dependencies."""
    found: list[str] = []

    def find_clips(path: Any) -> None:
        if path.IsPrimPath() or path.IsPrimVariantSelectionPath():
            spec = layer.GetObjectAtPath(path)
            if spec is not None and any(spec.HasInfo(key) for key in ("clips", "clipSets")):
                found.append(str(path))

    layer.Traverse(pxr.Sdf.Path.absoluteRootPath, find_clips)
    if found:
        raise _make_refusal("a prim has value clips, which urdfkin does not read", where, found[0])


def _resolve_asset(pxr: Any, layer: Any, asset: str, allowed_paths: AllowedPaths, where: str) -> str | None:
    """Return the path of an asset, or None for a missing file; refuse a forbidden reference."""
    written = asset.partition(":SDF_FORMAT_ARGS:")[0]
    if not written:
        return None
    if written.startswith("`"):
        raise _make_refusal("a reference is an expression", where, written)
    if "://" in written:
        what = "a reference is a network address, and urdfkin downloads nothing"
        raise _make_refusal(what, where, written, can_copy=True)
    address = str(pxr.Sdf.ComputeAssetPathRelativeToLayer(layer, written))
    outer, inner = pxr.Ar.SplitPackageRelativePathOuter(address)
    if not os.path.isabs(outer):  # noqa: PTH117  the comparison needs a string
        # If there is no file beside the layer, OpenUSD searches in the current folder.
        here = os.path.abspath(outer)  # noqa: PTH100  resolve() follows links
        beside = Path(pxr.Ar.SplitPackageRelativePathOuter(layer.realPath)[0]).parent / outer
        outer = here if os.path.exists(here) else str(beside)  # noqa: PTH110  Path.exists() can fail
    if not allowed_paths.allows(outer):
        what = "a reference leads outside the folder, package and repository of the stage"
        raise _make_refusal(what, where, written, can_copy=True)
    if Path(inner or outer).suffix.lower() not in USD_SUFFIXES:
        raise _make_refusal("a reference names a file that is not USD", where, written)
    return address if os.path.exists(outer) else None  # noqa: PTH110  Path.exists() can fail


def _make_refusal(what: str, where: str, found: str, *, can_copy: bool = False) -> InputError:
    remedy = "flatten the stage: usdcat --flatten"
    if can_copy:
        remedy = f"copy the file into the folder of the stage, and refer to the copy; or {remedy}"
    return InputError(what, where=where, found=found[:200], remedy=remedy)


def read_usd(
    path: str, name: str, *, variants: Sequence[tuple[str, str]] = (), articulation: str | None = None
) -> Usd:
    """Read a USD file in this process (`urdfkin.verify.usd_check` confines the process).

    `variants` are pairs of a variant set and a variant. The variants are selected in order, on every prim
    that has the variant set. `articulation` is the path or name of an articulation. The path of an ancestor
    selects all articulations below the ancestor. `name` is the name of the stage in messages.

    | Error | Cause |
    |---|---|
    | UnknownNameError | an unknown variant set, variant or articulation |
    | InputError | OpenUSD is not installed, or does not accept the file |
    | InputError | the stage has no robot, an unsupported joint, or a forbidden reference |
    | InputError | the stage has several articulations, and `articulation` is None |
    """
    pxr = import_openusd()
    try:
        files = find_layer_files(pxr, path)
        stage = pxr.Usd.Stage.Open(path)
        expanded_instances = _select_variants(pxr, stage, variants, name)
        layers = [layer.realPath.partition("[")[0] for layer in stage.GetUsedLayers() if layer.realPath]
        if more := sorted(set(map(os.path.realpath, layers)) - set(map(os.path.realpath, files))):
            raise _make_refusal("the stage uses a file that no layer of the stage refers to", name, more[0])
        return _StageReader(pxr, stage, name, expanded_instances).read(articulation, files)
    except pxr.Tf.ErrorException as error:
        words = "; ".join(str(getattr(one, "commentary", one)) for one in error.args)
        found = " ".join(words.split())[:300]
        raise InputError("OpenUSD does not accept this file", where=name, found=found) from None


def _select_variants(pxr: Any, stage: Any, variants: Sequence[tuple[str, str]], name: str) -> frozenset[str]:
    """Select variants of a stage, and return the paths of the instances that were expanded.

    OpenUSD cannot select a variant inside an instance, so the instance is expanded to an ordinary prim. All
    changes are in the session layer, which OpenUSD does not save.
    """
    stage.SetEditTarget(stage.GetSessionLayer())
    expanded_instances = set[str]()
    for word, variant in variants:
        sets = _prims_by_variant_set(pxr, stage)
        while inside := [prim for prim in sets.get(word, []) if prim.IsInstanceProxy()]:
            for prim in inside:
                outer = prim.GetParent()
                while outer.IsInstanceProxy():
                    outer = outer.GetParent()
                outer.SetInstanceable(False)
                expanded_instances.add(str(outer.GetPath()))
            sets = _prims_by_variant_set(pxr, stage)
        if word not in sets:
            raise UnknownNameError("variant set", word, list(sets), where=name)
        own = [prim.GetVariantSet(word) for prim in sets[word]]
        known = [one for one in own if variant in one.GetVariantNames()]
        if not known:
            raise UnknownNameError("variant", variant, own[0].GetVariantNames(), where=f"{name}: {word}")
        for one in known:
            one.SetVariantSelection(variant)
    return frozenset(expanded_instances)


def _prims_by_variant_set(pxr: Any, stage: Any) -> dict[str, list[Any]]:
    sets: dict[str, list[Any]] = {}
    every = pxr.Usd.TraverseInstanceProxies(pxr.Usd.PrimAllPrimsPredicate)
    for prim in pxr.Usd.PrimRange.Stage(stage, every):
        for one in prim.GetVariantSets().GetNames():
            sets.setdefault(one, []).append(prim)
    return sets


@dataclass(slots=True)
class _Body:
    T: FloatArray
    articulation_root: str | None


@dataclass(slots=True)
class _JointPrim:
    """A joint prim.

    Attributes:
        name: At first the name of the prim; later the unique name of the joint in the tree.
        ends: The paths of the two bodies that the joint connects; None is the world.
        frames: The poses of the joint frame in the two bodies.
        rounding: Bounds on the joint frame's single-precision errors in position (m) and orientation (rad).
    """

    prim: Any
    name: str
    path: str
    kind: JointKind
    axis: FloatArray
    ends: tuple[str | None, str | None]
    frames: tuple[FloatArray, FloatArray]
    limits: tuple[float, float]
    length_sum: float
    rounding: tuple[float, float]


@dataclass(slots=True)
class _Articulation:
    path: str
    bodies: list[str]
    edges: list[_JointPrim]


@dataclass(slots=True)
class _StageReader:
    pxr: Any
    stage: Any
    source: str  # Name of the stage in messages.
    expanded_instances: frozenset[str]
    remarks: list[UsdRemark] = field(default_factory=list)
    _bodies: dict[str, _Body] = field(default_factory=dict)
    _edges: list[_JointPrim] = field(default_factory=list)
    _joints_read: dict[str, UsdJoint] = field(default_factory=dict)
    _joint_names: tuple[str, ...] = ()
    _single_rounding_terms: dict[str, tuple[float, float, float, float, float]] = field(default_factory=dict)
    # Pinocchio itself uses the names `universe` and `root_joint`.
    _used_link_names: set[str] = field(default_factory=lambda: {"universe"})
    _used_joint_names: set[str] = field(default_factory=lambda: {"root_joint"})
    _meters_per_unit: float = 1.0
    _up: FloatArray = field(default_factory=lambda: np.eye(3))
    _cache: Any = None
    _point_instancers: list[str] = field(default_factory=list)
    _checked_paths: set[str] = field(default_factory=set)

    def read(self, articulation: str | None, files: tuple[str, ...]) -> Usd:
        pxr, stage = self.pxr, self.stage
        self._meters_per_unit = float(pxr.UsdGeom.GetStageMetersPerUnit(stage))
        if not 1.0 / _MAX_SCALE <= self._meters_per_unit <= _MAX_SCALE:
            what = f"metersPerUnit must be a positive number from {1.0 / _MAX_SCALE:g} to {_MAX_SCALE:g}"
            raise InputError(what, where=self.source, found=f"{self._meters_per_unit:g}")
        if (up_axis := str(pxr.UsdGeom.GetStageUpAxis(stage))) not in ("Y", "Z"):
            raise InputError("upAxis must be Y or Z", where=self.source, found=up_axis)
        if up_axis == "Y":
            self._up = _ROTATION_OF_Y_UP
        self._cache = pxr.UsdGeom.XformCache(pxr.Usd.TimeCode.Default())
        for error in stage.GetCompositionErrors():
            words = " ".join(str(error).split())[:300]
            self._report("missing-layer", "", f"OpenUSD cannot compose a part of this stage: {words}")
        prims = self._find_prims()
        self._read_bodies_and_joints(prims)
        articulations = self._find_articulations()
        chosen = self._choose_articulation(articulations, articulation)
        tree, links = self._make_tree(chosen)
        self._report_loose_bodies(chosen, articulations)
        rest_poses = np.array([self._world_pose(stage.GetPrimAtPath(path))[0] for path in links.values()])
        rest_q = self._find_rest_configuration(tree, chosen, links, rest_poses)
        self._report_unit_and_up_axis(rest_poses)
        self._report_layer_differences([*links.values(), *self._joints_read])
        if count := sum(prim.IsA(pxr.UsdGeom.Gprim) for prim in prims):
            self._report("unused-in-usd", "", f"kinematics does not use the {count} shapes")
        return Usd(
            tree,
            links,
            rest_poses,
            rest_q,
            self._single_rounding_terms,
            self._joints_read,
            stage,
            self._meters_per_unit,
            tuple(self.remarks),
            files,
            self._joint_names,
        )

    # -- the stage -----------------------------------------------------------------------------------

    def _report(self, kind: RemarkKind, where: str, what: str, remedy: str | None = None) -> None:
        self.remarks.append(UsdRemark(kind, where, what, remedy))

    def _find_prims(self) -> list[Any]:
        """Return the prims of the stage, without the prototypes of point instancers."""
        physics, prims = self.pxr.UsdPhysics, list[Any]()
        inside = self.pxr.Usd.TraverseInstanceProxies()
        every = iter(self.stage.Traverse(inside))
        for prim in every:
            prims.append(prim)
            if not prim.IsA(self.pxr.UsdGeom.PointInstancer):
                continue
            every.PruneChildren()
            path = str(prim.GetPath())
            self._point_instancers.append(path + "/")
            below = list(self.pxr.Usd.PrimRange(prim, inside))
            bodies = sum(one.HasAPI(physics.RigidBodyAPI) for one in below)
            joints = sum(one.IsA(physics.Joint) for one in below)
            if bodies or joints:
                what = f"the prototypes of this PointInstancer have {bodies} bodies and {joints} joints"
                remedy = "write each copy as a separate prim, with a reference"
                self._report("left-out-of-usd", path, f"{what}, which are not read", remedy)
            else:
                self._report("unused-in-usd", path, "kinematics does not use this PointInstancer")
        return prims

    def _read_value(self, prim: Any, name: str) -> Any:
        """Return the value of an attribute; for a missing or blocked value, return the default or None."""
        attribute = prim.GetAttribute(name)
        if not attribute:
            return None
        self._refuse_wrong_type(attribute)
        value = attribute.Get()
        if value is None and attribute.HasFallbackValue():
            value = prim.GetPrimDefinition().GetAttributeFallbackValue(name)
        self._report_timed(attribute, f"urdfkin takes {value}")
        return value

    def _refuse_wrong_type(self, attribute: Any) -> None:
        """Refuse a value if its type differs from the schema; OpenUSD's parser ignores such a value."""
        spec = next((one for one in attribute.GetPropertyStack() if one.HasDefaultValue()), None)
        if spec is not None and spec.typeName.type != attribute.GetTypeName().type:
            where, remedy = f"{self.source}: {attribute.GetPath()}", f"write {attribute.GetTypeName()}"
            message = "the type of an attribute differs from its schema"
            raise InputError(message, where=where, found=str(spec.typeName), remedy=remedy)

    def _report_timed(self, attribute: Any, consequence: str) -> None:
        path = str(attribute.GetPath())
        if path in self._checked_paths:
            return
        self._checked_paths.add(path)
        kind = "a spline" if getattr(attribute, "HasSpline", lambda: False)() else "time samples"
        if kind == "time samples" and not attribute.GetNumTimeSamples():
            return
        if not attribute.GetResolveInfo(self.pxr.Usd.TimeCode.Default()).HasAuthoredValue():
            where = str(attribute.GetPrim().GetPath())
            what = f"{attribute.GetName()} has {kind}, but no default value, so {consequence}"
            self._report("time-samples", where, what, "write a default value")

    def _report_timed_transforms(self, prim: Any) -> None:
        while prim and (path := str(prim.GetPath())) not in self._checked_paths:
            self._checked_paths.add(path)
            if prim.IsA(self.pxr.UsdGeom.Xformable):
                placed = self.pxr.UsdGeom.Xformable(prim)
                for one in placed.GetOrderedXformOps():
                    self._report_timed(one.GetAttr(), "urdfkin leaves it out")
                if placed.GetResetXformStack():
                    return
            prim = prim.GetParent()

    def _describe_uneven_scale(self, prim: Any) -> str | None:
        while (prim := prim.GetParent()) and not prim.IsPseudoRoot():
            local = np.array(self._cache.GetLocalTransformation(prim)[0])[:3, :3]
            scale = np.linalg.norm(local, axis=1)
            if np.ptp(scale) > _MAX_SHEAR * SINGLE_ROUNDOFF * scale.max():
                return f"the scale {', '.join(f'{x:g}' for x in scale)} of {prim.GetPath()}"
        return None

    def _world_pose(self, prim: Any) -> tuple[FloatArray, FloatArray]:
        """Return the pose (4, 4) of a prim in the world, in m with z up, and the prim's scale (3,).

        A reflection gives three negative scales.
        """
        self._report_timed_transforms(prim)
        where = f"{self.source}: {prim.GetPath()}"
        M = np.array(self._cache.GetLocalToWorldTransform(prim)).T
        if not np.isfinite(M).all():
            raise InputError("the transform of a prim is not finite", where=where)
        scale = np.hypot.reduce(M[:3, :3], axis=0)
        if not (scale > 0.0).all():
            raise InputError("the scale of a prim is zero", where=where)
        if scale.min() < 1.0 / _MAX_SCALE or scale.max() > _MAX_SCALE:
            found = ", ".join(f"{x:g}" for x in scale)
            raise InputError("the scale of a prim is too small or too large", where=where, found=found)
        if (distance := np.abs(M[:3, 3]).max()) > _MAX_POSITION / self._meters_per_unit:
            message = "the position of a prim is too large"
            raise InputError(message, where=where, found=f"{distance:g} units")
        if np.linalg.det(M[:3, :3]) < 0.0:
            scale = -scale
        R = M[:3, :3] / scale
        if np.abs(R.T @ R - np.eye(3)).max() > _MAX_SHEAR * SINGLE_ROUNDOFF * prim.GetPath().pathElementCount:
            message = "the frame of a prim has shear, so it cannot be the frame of a rigid body"
            remedy = "apply the scale to the shapes, not to a parent of a rotated body"
            raise InputError(message, where=where, found=self._describe_uneven_scale(prim), remedy=remedy)
        U, _, V = np.linalg.svd(R)
        return pose(self._up @ (U @ V), self._up @ M[:3, 3] * self._meters_per_unit), scale

    def _read_bodies_and_joints(self, prims: list[Any]) -> None:
        physics = self.pxr.UsdPhysics
        for prim in prims:
            if not prim.HasAPI(physics.RigidBodyAPI):
                continue
            if self._read_value(prim, "physics:rigidBodyEnabled") is False:
                continue
            path = str(prim.GetPath())
            T, scale = self._world_pose(prim)
            if scale[0] < 0.0:
                what = "the transform of this body contains a reflection"
                self._report("mirrored-body", path, what, "mirror the shapes instead")
            self._bodies[path] = _Body(T, self._find_articulation_root(prim))
        for prim in prims:
            if prim.IsA(physics.Joint) and (edge := self._read_joint(prim)) is not None:
                self._edges.append(edge)
            self._report_couplings(prim)

    def _report_couplings(self, prim: Any) -> None:
        path, schemas = str(prim.GetPath()), _schemas(prim)
        joint = prim.IsA(self.pxr.UsdPhysics.Joint)
        kind = str(prim.GetTypeName())
        ends = any(prim.HasRelationship(f"physics:body{i}") for i in (0, 1))
        if not joint and (ends or any(word in kind for word in _COUPLING_WORDS)):
            what = f"a tree cannot represent this {kind or 'prim with physics:body0 or physics:body1'}"
            self._report("left-out-of-usd", path, what)
        for rule in prim.GetRelationships() if joint else ():
            # The direction in the name of a relationship, such as rotX, can differ from the direction of the
            # mimic joint.
            own = _MIMIC_RELATIONSHIP.fullmatch(rule.GetName())
            if own is not None and rule.HasAuthoredTargets():
                schema = f"PhysxMimicJointAPI:{own[1]}" if own[1] else "NewtonMimicAPI"
                if schema not in schemas:
                    what = f"{rule.GetName()} has no effect, because {schema} is not applied"
                    self._report("lost-mimic", path, what, "apply the schema, or remove the attributes")
        unread = []
        for schema in schemas:
            if not any(word in schema for word in _COUPLING_WORDS) or (joint and _is_mimic(schema)):
                continue
            if schema == "MjcEqualityJointAPI" and "NewtonMimicAPI" in schemas:
                # MjcEqualityJointAPI repeats the rule of NewtonMimicAPI, and may add nonlinear terms.
                if more := [name for name in _NONLINEAR_COEFFICIENTS if self._read_value(prim, name)]:
                    what = f"the terms {', '.join(more)} of this joint's mimic rule are not read"
                    self._report("left-out-of-usd", path, what)
                continue
            unread.append(schema)
        # `_read_joint` already reported each joint that it skipped.
        if unread and not any(one.where == path and one.kind == "left-out-of-usd" for one in self.remarks):
            self._report("left-out-of-usd", path, f"urdfkin does not read {', '.join(unread)}")

    def _find_articulation_root(self, prim: Any) -> str | None:
        """Return the path of the articulation root at or above a prim, or None."""
        while prim and str(prim.GetPath()) != "/":
            if prim.HasAPI(self.pxr.UsdPhysics.ArticulationRootAPI):
                return str(prim.GetPath())
            prim = prim.GetParent()
        return None

    # -- joints --------------------------------------------------------------------------------------

    def _read_joint(self, prim: Any) -> _JointPrim | None:
        path = str(prim.GetPath())
        if self._read_value(prim, "physics:jointEnabled") is False:
            self._report("left-out-of-usd", path, "this joint is disabled")
            return None
        sides = []
        for i in (0, 1):
            targets = list(prim.GetRelationship(f"physics:body{i}").GetTargets())
            if len(targets) > 1:
                self._report("left-out-of-usd", path, f"body{i} of this joint has {len(targets)} targets")
                return None
            side = self._read_joint_frame(prim, i, str(targets[0]) if targets else None)
            if side is None:
                instanced = self._is_in_point_instancer(targets[0])
                reason = "is a prototype of a PointInstancer" if instanced else "does not exist"
                what = f"body{i} of this joint names a prim that {reason}: {targets[0]}"
                self._report("outside-joint", path, what, "correct the relationship")
                return None
            sides.append(side)
        (first, A, length_A, error_bounds_A), (second, B, length_B, error_bounds_B) = sides
        if first == second:
            where = "the world" if first is None else "one body"
            self._report("left-out-of-usd", path, f"both ends of this joint are in {where}")
            return None
        kind_name = str(prim.GetTypeName()).removeprefix("Physics")
        excluded = self._read_value(prim, "physics:excludeFromArticulation")
        if excluded or kind_name.endswith(_UNSUPPORTED_JOINTS):
            what = f"a tree cannot represent this {kind_name}"
            if excluded:
                what = f"this {kind_name} is excluded from the articulation"
            self._report("left-out-of-usd", path, what)
            return None
        kind, axis, limits, directions = self._read_motion(prim)
        length_sum, error_bounds = (
            length_A + length_B,
            (error_bounds_A[0] + error_bounds_B[0], error_bounds_A[1] + error_bounds_B[1]),
        )
        # If an end of the joint is the world, A or B is a pose in a world with z up. `UsdJoint` has the pose
        # in the stage's world, where y may be up.
        C, D = (T if body is not None else pose(self._up.T) @ T for body, T in ((first, A), (second, B)))
        self._joints_read[path] = UsdJoint(
            directions, first or "", second or "", C[:3, 3], quaternion_of(C[:3, :3]),
            D[:3, 3], quaternion_of(D[:3, :3]), limits, length_sum,
        )  # fmt: skip
        return _JointPrim(
            prim, prim.GetName(), path, kind, axis, (first, second), (A, B), limits, length_sum, error_bounds
        )

    def _read_joint_frame(
        self, prim: Any, i: int, target: str | None
    ) -> tuple[str | None, FloatArray, float, tuple[float, float]] | None:
        """Return body i of a joint, the pose of the joint frame in the body, a length sum and error bounds.

        The body None is the world. `UsdJoint` defines the length sum (m). The error bounds are for the
        position (m) and the orientation (rad). Return None for a body that does not exist or is in a point
        instancer.
        """
        p = np.array(self._read_value(prim, f"physics:localPos{i}"), float)
        quaternion = self._read_value(prim, f"physics:localRot{i}")
        xyzw = np.array([*quaternion.GetImaginary(), quaternion.GetReal()], float)
        size = float(np.linalg.norm(xyzw))
        if not (np.isfinite(p).all() and math.isfinite(size) and size > 0.0):
            message = f"localPos{i} or localRot{i} of a joint is not finite, or the quaternion is zero"
            found = f"{p.tolist()}, {quaternion}"
            raise InputError(message, where=f"{self.source}: joint {prim.GetPath()}", found=found)
        error_bounds = float(np.linalg.norm(_rounding(p))) * self._meters_per_unit, _quaternion_rounding(xyzw)
        R, p = rotation_from_quaternion(xyzw / size), p * self._meters_per_unit
        if target is None:
            return None, pose(self._up @ R, self._up @ p), float(np.linalg.norm(p)), error_bounds
        other = self.stage.GetPrimAtPath(target)
        if not other or not other.IsDefined() or self._is_in_point_instancer(target):
            return None
        T, scale = self._world_pose(other)
        if p.any() and (smallest := np.abs(scale).min()) < _MIN_JOINT_SCALE:
            message = f"OpenUSD's physics does not read a scale below {_MIN_JOINT_SCALE:g}"
            where, remedy = f"{self.source}: {target}", "apply the scale to the shapes and positions"
            raise InputError(message, where=where, found=f"{smallest:g}", remedy=remedy)
        A, length = pose(R, scale * p), float(np.linalg.norm(scale * p))
        error_bounds = error_bounds[0] * float(np.abs(scale).max()), error_bounds[1]
        while other and str(other.GetPath()) not in self._bodies:
            other = other.GetParent()
        body = str(other.GetPath()) if other else None
        if body != target:
            T = T if body is None else inverse(self._bodies[body].T) @ T
            A, length = T @ A, length + float(np.linalg.norm(T[:3, 3]))
            moved, turned = self._rounding_of_transforms(target, body, length)
            error_bounds = error_bounds[0] + moved, error_bounds[1] + turned
        return body, A, length, error_bounds

    def _rounding_of_transforms(
        self, path: str, body: str | None, translation_length_sum: float
    ) -> tuple[float, float]:
        """Return bounds on a prim's single-precision errors in position (m) and orientation (rad).

        The pose is relative to `body`. `translation_length_sum` is the sum of the lengths (m) of the
        translations from the body to the prim. An error in the rotation of a prim also displaces all prims
        below the prim. Transforms in half precision are ignored.
        """
        moved = turned = False
        operation, prim = self.pxr.UsdGeom.XformOp, self.stage.GetPrimAtPath(path)
        while prim and not prim.IsPseudoRoot() and str(prim.GetPath()) != body:
            for one in self.pxr.UsdGeom.Xformable(prim).GetOrderedXformOps():
                if one.GetPrecision() == operation.PrecisionFloat:
                    rotates = one.GetOpType() not in (operation.TypeTranslate, operation.TypeScale)
                    turned |= rotates
                    moved |= not rotates or str(prim.GetPath()) != path
            prim = prim.GetParent()
        return (
            SINGLE_ROUNDOFF * translation_length_sum if moved else 0.0,
            2.0 * SINGLE_ROUNDOFF if turned else 0.0,
        )

    def _is_in_point_instancer(self, path: object) -> bool:
        return any(str(path).startswith(one) for one in self._point_instancers)

    def _read_motion(self, prim: Any) -> tuple[JointKind, FloatArray, tuple[float, float], str]:
        """Return kind, axis, limits (rad or m) and free directions; refuse an unsupported joint."""
        physics, path = self.pxr.UsdPhysics, f"{self.source}: joint {prim.GetPath()}"
        if prim.IsA(physics.FixedJoint):
            return JointKind.FIXED, _unit(0), _NO_LIMITS, ""
        for schema, turns in ((physics.RevoluteJoint, True), (physics.PrismaticJoint, False)):
            if prim.IsA(schema):
                letter = str(self._read_value(prim, "physics:axis"))
                if letter not in _AXIS_INDEX:
                    raise InputError("the axis of a joint must be X, Y or Z", where=path, found=letter)
                ends = (float(self._read_value(prim, f"physics:{end}Limit")) for end in ("lower", "upper"))
                return self._make_motion(path, f"{'rot' if turns else 'trans'}{letter}", ends)
        if prim.IsA(physics.SphericalJoint):
            remedy = "use three revolute joints (singular if the middle joint is at a right angle)"
            raise InputError("urdfkin does not support spherical joints", where=path, remedy=remedy)
        if prim.GetTypeName() != "PhysicsJoint":
            message = "urdfkin does not support this kind of joint"
            remedy = "exclude it from the articulation, or use another joint"
            raise InputError(message, where=path, found=str(prim.GetTypeName()), remedy=remedy)
        return self._read_general_motion(prim, path)

    def _read_general_motion(
        self, prim: Any, path: str
    ) -> tuple[JointKind, FloatArray, tuple[float, float], str]:
        """Return the motion of a `PhysicsJoint`, which can have limits for six directions."""
        limits: dict[str, tuple[float, float]] = {}
        for direction in _MOTION_DIRECTIONS:
            low, high = _NO_LIMITS
            if f"PhysicsLimitAPI:{direction}" in _schemas(prim):
                low, high = (
                    self._read_limit(prim, f"limit:{direction}:physics:{end}") for end in ("low", "high")
                )
            if low <= high:  # A lower limit above the upper limit locks the direction.
                limits[direction] = low, high
        free_directions = tuple(limits)
        if not free_directions:
            return JointKind.FIXED, _unit(0), _NO_LIMITS, ""
        if len(free_directions) == 1:
            return self._make_motion(path, free_directions[0], iter(limits[free_directions[0]]))
        kind = {("transX", "transY", "rotZ"): JointKind.PLANAR, _MOTION_DIRECTIONS: JointKind.FLOATING}.get(
            free_directions
        )
        if kind is None:
            message = "urdfkin does not support a joint with these degrees of freedom"
            remedy = "leave one degree of freedom free, or write several joints with a body between them"
            raise InputError(message, where=path, found=", ".join(free_directions), remedy=remedy)
        if any(math.isfinite(end) for ends in limits.values() for end in ends):
            self._report("unused-in-usd", path, "the limits of this planar or floating joint are not read")
        return kind, _unit(0), _NO_LIMITS, " ".join(free_directions)

    def _read_limit(self, prim: Any, name: str) -> float:
        """Return a limit of a `PhysicsJoint`; refuse None, which USD readers interpret differently."""
        attribute = prim.GetAttribute(name)
        if attribute.HasFallbackValue() and attribute.Get() is None:
            message = "the value of a joint limit is None, which USD readers interpret differently"
            where, found = f"{self.source}: joint {prim.GetPath()}", f"{name} = None"
            remedy = "write a number; -inf and inf mean no limit"
            raise InputError(message, where=where, found=found, remedy=remedy)
        value = float(self._read_value(prim, name))
        if math.isnan(value):
            where = f"{self.source}: joint {prim.GetPath()}"
            raise InputError("a joint limit is not a number", where=where, found=f"{name} = nan")
        return value

    def _make_motion(
        self, path: str, direction: str, limits: Iterator[float]
    ) -> tuple[JointKind, FloatArray, tuple[float, float], str]:
        lower, upper = (
            math.copysign(math.inf, end) if abs(end) >= _LARGEST_SINGLE else end for end in limits
        )
        if not lower <= upper:
            message = "the lower limit of a joint is above its upper limit"
            raise InputError(message, where=path, found=f"{lower:g} and {upper:g}")
        kind, factor = JointKind.PRISMATIC, self._meters_per_unit
        if direction.startswith("rot"):
            bounded = math.isfinite(lower) and math.isfinite(upper)
            kind, factor = JointKind.REVOLUTE if bounded else JointKind.CONTINUOUS, math.pi / 180.0
        return kind, _unit(_AXIS_INDEX[direction[-1]]), (lower * factor, upper * factor), direction

    # -- articulations -------------------------------------------------------------------------------

    def _find_articulations(self) -> list[_Articulation]:
        # The groups of connected bodies are found by union-find.
        representative: dict[str, str] = {path: path for path in self._bodies}

        def find_representative(path: str) -> str:
            while representative[path] != path:
                representative[path] = representative[representative[path]]
                path = representative[path]
            return path

        root_by_body = {path: body.articulation_root for path, body in self._bodies.items()}
        tree_edges = []
        for edge in self._edges:
            first, second = edge.ends
            if first is not None and second is not None:
                a, b = find_representative(first), find_representative(second)
                if a == b:
                    self._report_loop(edge)
                    continue
                roots = {one for one in (root_by_body[a], root_by_body[b]) if one is not None}
                if len(roots) > 1:
                    both = " and ".join(sorted(roots))
                    what = f"this {edge.kind.value} joint connects two articulations: {both}"
                    self._report("outside-joint", edge.path, what)
                    continue
                representative[b] = a
                root_by_body[a] = next(iter(roots), None)
            tree_edges.append(edge)
        groups: dict[str, _Articulation] = {}
        for edge in tree_edges:
            key = find_representative(next(end for end in edge.ends if end is not None))
            groups.setdefault(key, _Articulation(root_by_body[key] or "", [], [])).edges.append(edge)
        for path in self._bodies:
            if (key := find_representative(path)) in groups:
                groups[key].bodies.append(path)
        # An articulation may contain several groups that are attached to the world.
        merged: dict[str, list[_Articulation]] = {}
        for group in groups.values():
            single = not group.path and len(group.bodies) == 1
            if single and group.edges[0].kind is JointKind.FIXED:
                continue  # A single body that is fixed to the world is not a robot.
            self._set_articulation_path(group)
            merged.setdefault(self._find_root(group) or group.path, []).append(group)
        articulations = [own[0] if len(own) == 1 else self._merge(own, path) for path, own in merged.items()]
        paths = Counter(group.path for group in articulations)
        for group in articulations:
            if paths[group.path] > 1:
                group.path = self._find_root(group) or group.bodies[0]
        return articulations

    def _set_articulation_path(self, group: _Articulation) -> None:
        for edge in group.edges:
            if edge.prim.HasAPI(self.pxr.UsdPhysics.ArticulationRootAPI):
                group.path = edge.path
        group.path = group.path or self._find_root(group) or group.bodies[0]

    def _choose_articulation(
        self, articulations: list[_Articulation], articulation: str | None
    ) -> _Articulation:
        """Return the named articulation; for the path of an ancestor, join all articulations below it."""
        if not articulations:
            message = "this stage has no joint between bodies"
            remedy = "apply PhysicsRigidBodyAPI to the links, and connect them with UsdPhysics joints"
            raise InputError(message, where=self.source, found=f"{len(self._bodies)} bodies", remedy=remedy)
        paths = [group.path for group in articulations]
        if articulation is None:
            if len(articulations) > 1:
                message = f"this stage has {len(articulations)} articulations"
                remedy = (
                    "choose one with --articulation PATH; the PATH of an ancestor chooses all articulations"
                    " below it"
                )
                raise InputError(message, where=self.source, found=", ".join(paths[:8]), remedy=remedy)
            return articulations[0]
        if not articulation:
            raise UnknownNameError("articulation", articulation, paths, where=self.source)
        matching = [
            group for group in articulations if articulation in (group.path, group.path.rpartition("/")[2])
        ]
        if len(matching) == 1:
            return matching[0]
        below = [group for group in articulations if group.path.startswith(articulation.rstrip("/") + "/")]
        if matching or not below:
            raise UnknownNameError("articulation", articulation, paths, where=self.source)
        return self._merge(below, articulation.rstrip("/") or "/")

    def _merge(self, groups: list[_Articulation], path: str) -> _Articulation:
        for group in groups:
            if len(groups) > 1 and self._find_root(group) is not None:
                what = "this articulation is not attached to the world, so it cannot be joined with others"
                where = f"{self.source}: {group.path}"
                raise InputError(what, where=where, remedy="choose one articulation")
        bodies = [body for group in groups for body in group.bodies]
        return _Articulation(path, bodies, [edge for group in groups for edge in group.edges])

    def _find_root(self, group: _Articulation) -> str | None:
        """Return the root body of a group, or None if the root is the world."""
        if any(None in edge.ends for edge in group.edges):
            return None
        if group.path in group.bodies:
            return group.path
        children = {edge.ends[1] for edge in group.edges}
        return next((path for path in group.bodies if path not in children), group.bodies[0])

    # -- the tree ------------------------------------------------------------------------------------

    def _make_tree(self, group: _Articulation) -> tuple[KinematicTree, dict[str, str]]:
        root = self._find_root(group)
        edges_of_body: dict[str | None, list[_JointPrim]] = {}
        for edge in group.edges:
            for end in edge.ends:
                edges_of_body.setdefault(end, []).append(edge)
        ordered, reached, open_ = list[tuple[_JointPrim, bool]](), {root}, deque([root])
        used = set[str]()
        while open_:
            here = open_.popleft()
            for edge in edges_of_body.get(here, []):
                backwards = edge.ends[1] == here
                there = edge.ends[0 if backwards else 1]
                if edge.path in used:
                    continue
                used.add(edge.path)
                if there in reached:
                    self._report_loop(edge)
                    continue
                reached.add(there)
                edge.name = make_unique(edge.name, self._used_joint_names)
                ordered.append((edge, backwards))
                open_.append(there)
        links: dict[str | None, str] = (
            {None: make_unique("world", self._used_link_names)} if root is None else {}
        )
        for path in [root, *(edge.ends[0 if back else 1] for edge, back in ordered)]:
            if path is not None:
                links[path] = make_unique(self._make_link_name(path), self._used_link_names)
        own = {edge.path: list(self._make_joints(edge, links, backwards=back)) for edge, back in ordered}
        rows = [row for edge, _ in ordered for row in own[edge.path]]
        in_stage = [joint.name for edge in self._edges for joint, _, _ in own.get(edge.path, ())]
        rules = dict(self._resolve_mimic_rules([edge for edge, _ in ordered]))
        rows = [(replace(joint, mimic=rules.get(joint.name)), a, b) for joint, a, b in rows]
        for edge, _ in ordered:
            if self._is_outside(edge, group):
                what = f"this {edge.kind.value} joint leads to a body outside {group.path}"
                self._report("outside-joint", edge.path, what)
        prims = {link: path for path, link in links.items() if path is not None}
        for path, parent in self._find_frames(list(prims.values())):
            link = make_unique(path.rpartition("/")[2], self._used_link_names)
            try:
                T = inverse(self._bodies[parent].T) @ self._world_pose(self.stage.GetPrimAtPath(path))[0]
            except InputError as error:
                self._report("unused-in-usd", path, f"this Xform is no link: {error.what}", error.remedy)
                continue
            joint = make_fixed_joint(make_unique(f"{link}_fixed", self._used_joint_names), T)
            bounds = self._rounding_of_transforms(path, parent, joint.length)
            self._single_rounding_terms[joint.name] = *bounds, joint.length, 0.0, 0.0
            rows.append((joint, links[parent], link))
            prims[link] = path
        self._joint_names = (*in_stage, *(joint.name for joint, _, _ in rows[len(in_stage) :]))
        self._joints_read = {edge.path: self._joints_read[edge.path] for edge, _ in ordered}
        tops = {path.split("/")[1] for path in (group.path, *group.bodies) if path != "/"}
        top = group.path.split("/")[1] or (tops.pop() if len(tops) == 1 else Path(self.source).stem)
        return build_tree(top, links[root], rows), prims

    def _report_loop(self, edge: _JointPrim) -> None:
        what = f"this {edge.kind.value} joint closes a loop, which a tree cannot represent"
        self._report("left-out-of-usd", edge.path, what)

    def _is_outside(self, edge: _JointPrim, group: _Articulation) -> bool:
        inside = group.path + "/"
        if group.path in self._bodies or not any(path.startswith(inside) for path in group.bodies):
            return False
        below = [end == group.path or end.startswith(inside) for end in edge.ends if end is not None]
        return len(set(below)) > 1

    def _make_link_name(self, path: str) -> str:
        parts, same = path.split("/")[1:], [other.split("/")[1:] for other in self._bodies]
        for n in range(1, len(parts) + 1):
            if sum(other[-n:] == parts[-n:] for other in same) <= 1:
                return "_".join(parts[-n:])
        return parts[-1]

    def _make_joints(
        self, edge: _JointPrim, links: Mapping[str | None, str], *, backwards: bool
    ) -> Iterator[tuple[Joint, str, str]]:
        (A, B), (parent, child), axis, kind = edge.frames, edge.ends, edge.axis, edge.kind
        if backwards:
            A, B, parent, child, axis = B, A, child, parent, -axis
        name, here, there = edge.name, links[parent], links[child]
        mimic_error = SINGLE_ROUNDOFF if any(map(_is_mimic, _schemas(edge.prim))) else 0.0
        lever = float(np.linalg.norm(B[:3, 3]))
        self._single_rounding_terms[name] = *edge.rounding, edge.length_sum, mimic_error, lever
        if kind is JointKind.FIXED:
            yield make_fixed_joint(name, A @ inverse(B)), here, there
            return
        free = kind in (JointKind.PLANAR, JointKind.FLOATING)
        if free and (backwards or (kind is JointKind.FLOATING and parent is not None)):
            raise InputError(
                "a floating joint needs the world as body0, and a planar joint the parent body",
                where=f"{self.source}: joint {edge.path}",
                found=kind.value,
                remedy="exchange body0 and body1 of this joint, or write several joints",
            )
        limit = None if free else self._make_limit(edge)
        if kind is JointKind.FLOATING:
            A = B = np.eye(4)
        elif not free and (kind is JointKind.PRISMATIC or not B[:3, 3].any()):
            axis = B[:3, :3] @ axis
            axis, A, B = axis / np.linalg.norm(axis), A @ inverse(B), np.eye(4)
        joint = Joint(name, kind, 0, A, axis, limit)
        if (np.eye(4) == B).all():
            yield joint, here, there
            return
        # In a URDF, joint and child link have the same frame. If the frames of a USD joint and its child
        # differ, the joint moves an additional link. A fixed joint connects the additional link with the
        # child link.
        between = make_unique(f"{name}_link", self._used_link_names)
        yield joint, here, between
        yield (
            make_fixed_joint(make_unique(f"{there}_fixed", self._used_joint_names), inverse(B)),
            between,
            there,
        )

    def _make_limit(self, edge: _JointPrim) -> Limit | None:
        lower, upper = edge.limits
        names = ("newton:velocityLimit", "physxJoint:maxJointVelocity")
        rates = (self._read_value(edge.prim, name) for name in names)
        rate = next((float(x) for x in rates if x is not None), math.inf)
        rate = rate * self._factor(edge.kind) if 0.0 < rate < _LARGEST_SINGLE else math.inf
        if edge.kind is JointKind.CONTINUOUS:
            if math.isfinite(lower) or math.isfinite(upper):
                what = "the only limit of the joint is ignored: a URDF joint has two limits or none"
                self._report("unused-in-usd", edge.path, what)
            return None if math.isinf(rate) else Limit(-math.inf, math.inf, rate, math.inf)
        largest = math.degrees(max(abs(lower), abs(upper)))
        turns = edge.kind is JointKind.REVOLUTE
        if turns and _NEGLIGIBLE_LIMIT_DEGREES < largest <= MAX_PLAUSIBLE_ANGLE and upper > lower:
            words = f"{math.degrees(lower):g} to {math.degrees(upper):g} degrees"
            what = f"the limits of this joint are {words}: the numbers are probably radians"
            self._report("limit-unit", edge.path, what, "write the limits in degrees")
        if not (math.isfinite(lower) and math.isfinite(upper)):
            low, high = replace_missing_limits(lower, upper)
            absent, value = "limits", f"+-{FALLBACK_PRISMATIC_LIMIT:g}"
            if math.isfinite(lower):
                absent, value = "an upper limit", f"{high:+g}"
            elif math.isfinite(upper):
                absent, value = "a lower limit", f"{low:+g}"
            what = f"a prismatic joint without {absent} gets {value} m, because URDF requires limits"
            self._report("unused-in-usd", edge.path, what)
            lower, upper = low, high
        return Limit(lower, upper, rate, math.inf)

    def _find_frames(self, bodies: Sequence[str]) -> Iterator[tuple[str, str]]:
        """Yield the path of each Xform prim that becomes a link, with the path of the body above the prim."""
        body_api, shape = self.pxr.UsdPhysics.RigidBodyAPI, self.pxr.UsdGeom.Gprim

        def find_child_frames(prim: Any, body: str) -> Iterator[tuple[str, str]]:
            for child in prim.GetChildren():
                is_expanded = str(child.GetPath()) in self.expanded_instances
                if child.HasAPI(body_api) or child.IsInstance() or is_expanded:
                    continue
                kind = child.GetTypeName()
                if kind == "Scope":
                    yield from find_child_frames(child, body)
                if kind != "Xform" or child.GetName().lower() in _SHAPE_XFORM_NAMES:
                    continue
                inside = self.pxr.Usd.PrimRange(child, self.pxr.Usd.TraverseInstanceProxies())
                groups_shapes = (
                    not any(one.HasAPI(body_api) for one in self.pxr.Usd.PrimRange(child))
                    and not any(one.IsA(shape) for one in child.GetChildren())
                    and any(one.IsA(shape) for one in inside)
                )
                if not groups_shapes:
                    yield str(child.GetPath()), body
                    yield from find_child_frames(child, body)

        for body in bodies:
            yield from find_child_frames(self.stage.GetPrimAtPath(body), body)

    # -- mimic joints --------------------------------------------------------------------------------

    def _resolve_mimic_rules(self, edges: Sequence[_JointPrim]) -> Iterator[tuple[str, Mimic]]:
        by_path = {edge.path: edge for edge in edges}
        rules: dict[str, Mimic] = {}
        for edge in edges:
            for rule in self._read_mimic_rules(edge):
                mimicked_joint = by_path.get(rule.mimicked_joint)
                if edge.kind.nq != 1:
                    what = f"a {edge.kind.value} joint cannot mimic another joint"
                    self._report("lost-mimic", edge.path, what, "remove the rule")
                elif mimicked_joint is edge:
                    self._report(
                        "lost-mimic", edge.path, "this joint mimics itself", "correct the relationship"
                    )
                elif mimicked_joint is None or mimicked_joint.kind.nq != 1:
                    what = "the mimic rule of this joint names no mimicked joint"
                    if named := rule.mimicked_joint:
                        what = f"this joint mimics {named}, which is not a joint with one coordinate"
                    self._report("lost-mimic", edge.path, what, "correct the relationship")
                elif edge.path in rules or depends_on(rules, rule.mimicked_joint, edge.path):
                    what = "this joint has two mimic rules, or mimics itself through other joints"
                    self._report("lost-mimic", edge.path, what, "remove a rule")
                else:
                    rules[edge.path] = rule
        for path in rules:
            rule = resolve_rule(rules, path)
            yield by_path[path].name, replace(rule, mimicked_joint=by_path[rule.mimicked_joint].name)

    def _read_mimic_rules(self, edge: _JointPrim) -> Iterator[Mimic]:
        """Yield the mimic rules of a joint (offset in rad or m); `mimicked_joint` is the path of a prim."""
        prim, schemas = edge.prim, _schemas(edge.prim)
        own = self._factor(edge.kind)
        if "NewtonMimicAPI" in schemas:
            if self._read_value(prim, "newton:mimicEnabled") is False:
                self._report("left-out-of-usd", edge.path, "the mimic rule of this joint is disabled")
                return
            mimicked_joint = _target(prim, "newton:mimicJoint")
            c0, c1 = self._read_value(prim, "newton:mimicCoef0"), self._read_value(prim, "newton:mimicCoef1")
            multiplier, offset = 1.0 if c1 is None else float(c1), 0.0 if c0 is None else float(c0)
            self._compare_units(edge, mimicked_joint)
            yield Mimic(mimicked_joint, multiplier, offset * own)
            return
        for schema in schemas:
            base, _, freedom = schema.partition(":")
            if base != "PhysxMimicJointAPI":
                continue
            prefix = f"physxMimicJoint:{freedom}"
            mimicked_joint = _target(prim, f"{prefix}:referenceJoint")
            gearing, offset = (
                self._read_value(prim, f"{prefix}:gearing"),
                self._read_value(prim, f"{prefix}:offset"),
            )
            multiplier = -1.0 if gearing is None else -float(gearing)
            self._compare_units(edge, mimicked_joint)
            yield Mimic(mimicked_joint, multiplier, -float(offset or 0.0) * own)

    def _factor(self, kind: JointKind) -> float:
        return self._meters_per_unit if kind is JointKind.PRISMATIC else math.pi / 180.0

    def _compare_units(self, edge: _JointPrim, mimicked_joint: str) -> None:
        kind = next((one.kind for one in self._edges if one.path == mimicked_joint), edge.kind)
        if (edge.kind is JointKind.PRISMATIC) != (kind is JointKind.PRISMATIC):
            what = "USD defines no unit for mimic rules between angle and length; urdfkin uses m and rad"
            self._report("lost-mimic", edge.path, what, "compare the joint with the simulator")

    # -- the whole stage -----------------------------------------------------------------------------

    def _report_loose_bodies(self, chosen: _Articulation, articulations: Sequence[_Articulation]) -> None:
        joined = {path for group in articulations for path in group.bodies}
        top = f"/{chosen.path.split('/')[1]}/".replace("//", "/")
        for path in self._bodies:
            if path not in joined and (path + "/").startswith(top):
                what = "no joint connects this body with the robot"
                self._report("loose-body", path, what, "add a joint, or remove PhysicsRigidBodyAPI")

    def _find_rest_configuration(
        self, tree: KinematicTree, group: _Articulation, links: Mapping[str, str], rest_poses: FloatArray
    ) -> FloatArray:
        q = np.zeros(tree.nq)
        placed = dict(zip(links.values(), rest_poses, strict=True))
        values = {}
        for edge in group.edges:
            (A, B), (first, second) = edge.frames, edge.ends
            T0 = np.eye(4) if first is None else placed[first]
            T1 = np.eye(4) if second is None else placed[second]
            J = inverse(T0 @ A) @ T1 @ B
            if edge.kind is JointKind.PRISMATIC:
                values[edge.path] = float(edge.axis @ J[:3, 3])
            elif edge.kind in (JointKind.REVOLUTE, JointKind.CONTINUOUS):
                S = J[:3, :3] - J[:3, :3].T
                sine = float(edge.axis @ np.array([S[2, 1], S[0, 2], S[1, 0]])) / 2.0
                values[edge.path] = math.atan2(sine, (float(np.trace(J[:3, :3])) - 1.0) / 2.0)
        by_name = {edge.name: edge.path for edge in group.edges if edge.path in self._joints_read}
        for joint, at in zip(tree.joints, tree.q_index, strict=True):
            if joint.kind is JointKind.FLOATING:
                q[at + 6] = 1.0
            elif joint.nq == 1 and by_name.get(joint.name) in values:
                q[at] = values[by_name[joint.name]]
        return q

    def _report_unit_and_up_axis(self, rest_poses: FloatArray) -> None:
        if not self.stage.HasAuthoredMetadata("metersPerUnit"):
            size = float(np.ptp(rest_poses[:, :3, 3], axis=0).max(initial=0.0))
            what = f"the stage has no metersPerUnit, so a unit is a centimetre: the robot spans {size:.3g} m"
            self._report("unit-scale", "", what, "write metersPerUnit = 1 if lengths are metres")
        if not self.stage.HasAuthoredMetadata("upAxis"):
            what = f"the stage has no upAxis, so {self.pxr.UsdGeom.GetStageUpAxis(self.stage)} is up"
            self._report("up-axis", "", what, 'write upAxis = "Z"')

    def _report_layer_differences(self, paths: Sequence[str]) -> None:
        root = self.stage.GetRootLayer()
        known = {root, self.stage.GetSessionLayer()}
        above = {str(one) for path in paths for one in self.pxr.Sdf.Path(path).GetPrefixes()}
        for path in sorted(above, key=lambda path: (path.count("/"), path)):
            prim = self.stage.GetPrimAtPath(path)
            for layer in [spec.layer for spec in prim.GetPrimStack()]:
                if layer not in known:
                    known.add(layer)
                    name = os.path.relpath(layer.identifier, Path(root.realPath).parent)
                    self._report_layer_difference(layer.pseudoRoot, name, prim)

    def _report_layer_difference(self, layer_root: Any, name: str, prim: Any) -> None:
        tokens, path = self.pxr.UsdGeom.Tokens, str(prim.GetPath())
        if layer_root.HasInfo(tokens.metersPerUnit):
            unit = float(layer_root.GetInfo(tokens.metersPerUnit))
            factor = unit / self._meters_per_unit
            if abs(factor - 1.0) > SINGLE_ROUNDOFF and not self._has_scale(prim, factor):
                what = f"the layer {name} has metersPerUnit {unit:g}, but the stage {self._meters_per_unit:g}"
                remedy = f"scale this prim by {factor:g}, or save the layer in the unit of the stage"
                self._report("unit-scale", path, f"{what}; lengths of the layer are not converted", remedy)
        up = str(self.pxr.UsdGeom.GetStageUpAxis(self.stage))
        if (
            layer_root.HasInfo(tokens.upAxis)
            and layer_root.GetInfo(tokens.upAxis) != up
            and not self._has_units_resolve(prim)
        ):
            what = f"the layer {name} has upAxis {layer_root.GetInfo(tokens.upAxis)}, but the stage {up}"
            remedy = "rotate this prim, or save the layer with the up axis of the stage"
            self._report("up-axis", path, f"{what}; the layer is not rotated", remedy)

    def _has_scale(self, prim: Any, factor: float) -> bool:
        M = np.array(self._cache.GetLocalToWorldTransform(prim))[:3, :3]
        scale = np.linalg.norm(M, axis=1) / factor
        return bool(
            (np.abs(scale - 1.0) <= _MAX_SHEAR * SINGLE_ROUNDOFF * prim.GetPath().pathElementCount).all()
        )

    def _has_units_resolve(self, prim: Any) -> bool:
        """Return whether a prim or an ancestor has a `unitsResolve` operation.

        A `unitsResolve` operation converts units or axes.
        """
        while prim and not prim.IsPseudoRoot():
            if any(str(name).endswith(":unitsResolve") for name in prim.GetPropertyNames()):
                return True
            prim = prim.GetParent()
        return False


def _rounding(x: FloatArray) -> FloatArray:
    """Return half an ulp in single precision for each number, or 0 for a zero."""
    half = 0.5 * np.spacing(np.abs(x).astype(np.float32)).astype(np.float64)
    return np.asarray(np.where(x == 0.0, 0.0, half))


def _quaternion_rounding(xyzw: FloatArray) -> float:
    """Return a bound (rad) on the error of a rotation from a quaternion rounded to single precision.

    The rotation changes by twice the angle between the exact and the rounded quaternion. Each of the four
    numbers changes by at most its rounding error, so the difference of the quaternions is a vector in a
    four-dimensional box. Only the component of this vector that is perpendicular to the quaternion changes
    the rotation. The perpendicular component is longest at a corner of the box. Therefore, all corners are
    compared.
    """
    unit = xyzw / np.linalg.norm(xyzw)
    corners = _rounding(xyzw) * np.array(list(product((-1.0, 1.0), repeat=4)))
    across = np.linalg.norm(corners - np.outer(corners @ unit, unit), axis=1).max()
    return 2.0 * float(across / np.linalg.norm(xyzw))


def _is_mimic(schema: str) -> bool:
    return schema.partition(":")[0] in _MIMIC_SCHEMAS


def _target(prim: Any, name: str) -> str:
    targets = prim.GetRelationship(name).GetTargets() if prim.HasRelationship(name) else []
    return str(targets[0]) if targets else ""


def _schemas(prim: Any) -> list[str]:
    """Return the names of the applied API schemas, including schemas unknown to OpenUSD."""
    return [str(one) for one in prim.GetPrimTypeInfo().GetAppliedAPISchemas()]


def _unit(i: int) -> FloatArray:
    axis: FloatArray = np.eye(3)[i]
    return axis
