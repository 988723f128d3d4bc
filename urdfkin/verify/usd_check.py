"""Read a USD stage in a process with limits on time and memory, and compare the robot with OpenUSD's readers.

Pinocchio reads the URDF text that urdfkin writes for the tree. Pinocchio's checks do not cover the conversion
from the USD stage (scene) to the tree. `load` therefore makes two comparisons:

- OpenUSD's parser UsdPhysics reads the joints. UsdPhysics and urdfkin's parser must find the same bodies,
  frames, degrees of freedom and limits for each joint. A difference raises OracleError.
- OpenUSD's module UsdGeom computes the transforms of the prims (scene objects). The file states these
  transforms separately from the joint frames. In the stage's configuration of the joints, each link must have
  its prim's transform. `load` reports a difference as a warning.

A stage stores numbers in single precision. Both comparisons allow only differences that rounding to single
precision can cause.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np

from urdfkin.compiled.plan import compile_tree
from urdfkin.errors import InputError, OracleError
from urdfkin.kinematics.rotation import rotation_from_quaternion
from urdfkin.kinematics.roundings import SINGLE_ROUNDOFF
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.configuration import largest_value
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree, LinkFrame, inverse, pose
from urdfkin.system.files import expand_home, read_bytes
from urdfkin.system.processes import python_command, run_python
from urdfkin.urdf.usd import UsdRemark, version
from urdfkin.verify.mjcf_process import MAX_OUTPUT_BYTES, parse_answers, unpack_array
from urdfkin.verify.quantities import PLACEMENT
from urdfkin.verify.verifier import Verifier

#: Time limit for reading a stage, seconds.
TIMEOUT = 60.0
#: Tolerance for the angle (rad) between urdfkin's and UsdPhysics's orientation of the same joint frame. The
#: unit is SINGLE_ROUNDOFF, the relative error of one rounding to single precision. `_check_joint` derives
#: this bound.
_ROTATION_ROUNDINGS = 18.0
#: Tolerance for the distance between urdfkin's and UsdPhysics's origin of the same joint frame. The unit is
#: SINGLE_ROUNDOFF times `UsdJoint.length_sum`. `_check_joint` derives this bound.
_ORIGIN_ROUNDINGS = 3.0
#: Bound on the angle error (rad) of one operation in a prim's transform, such as a rotation. The unit is
#: SINGLE_ROUNDOFF. `_compare_prim_poses` derives this bound.
_TRANSFORM_ROUNDINGS = 6.0 * np.pi


@dataclass(frozen=True, slots=True)
class UsdReading:
    urdf: str
    remarks: tuple[UsdRemark, ...]
    path: str
    answer: Mapping[str, Any]


def read_usd(
    source: str | os.PathLike[str],
    *,
    variants: Sequence[tuple[str, str]] = (),
    articulation: str | None = None,
    timeout: float = TIMEOUT,
) -> UsdReading:
    """Read a USD stage in a separate process.

    `variants` contains pairs (variant set, variant). `timeout` is in seconds.

    Raises:
        SourceError: The file is missing.
        InputError: OpenUSD or urdfkin rejects the stage, or the process ends without a robot.
    """
    version()
    path = expand_home(source)
    read_bytes(path)  # Raises SourceError.
    request = {
        "path": os.path.realpath(path),
        "name": str(path),
        "variants": [list(pair) for pair in variants],
        "articulation": articulation,
        "seconds": ceil(timeout) + 1,
    }
    command = python_command(
        "from urdfkin.verify.usd_process import serve; serve()", options=("-B", "-X", "utf8")
    )
    output, status = run_python(command, json.dumps(request).encode(), timeout, MAX_OUTPUT_BYTES)
    answers, ending = parse_answers(output, status, library="OpenUSD", name=str(path), timeout=timeout)
    if not answers:
        raise InputError(
            "OpenUSD cannot read this stage",
            where=str(path),
            found=ending,
            remedy="check that the file is complete",
        )
    answer = answers[-1]
    return UsdReading(answer["urdf"], tuple(UsdRemark(*one) for one in answer["remarks"]), str(path), answer)


def check_usd_source(verifier: Verifier, reading: UsdReading) -> tuple[str, tuple[UsdRemark, ...]]:
    """Compare a robot with OpenUSD's data. Return a sentence about the result, and at most one remark.

    Raises:
        OracleError: UsdPhysics reads a joint differently.
    """
    joints = reading.answer["joints"]
    ratio = max((_check_joint(verifier.tree.name, path, *pair) for path, pair in joints.items()), default=0.0)
    line = (
        f"compared with OpenUSD {version()}: UsdPhysics and urdfkin read the same {len(joints)} joints"
        f" ({ratio:.1%} of the bound of single precision)"
    )
    rest, remarks = _compare_prim_poses(verifier.tree, reading.answer)
    return f"{line}; {rest}", remarks


def _check_joint(name: str, path: str, ours: list[Any], theirs: list[Any] | None) -> float:
    """Return the largest ratio of difference to bound.

    Bounds, with u = `SINGLE_ROUNDOFF`, the relative error of one rounding to single precision:

        rounded quaternion: angle error <= 2 u
        product of two quaternions: error <= 4 u in each number
        vector of the four errors: length 8 u
        angle error: twice this length, 16 u
        sum of both angle errors: 18 u
        `_ROTATION_ROUNDINGS` = 18

        scale factor, scaled origin, transformed origin: one rounding each
        `_ORIGIN_ROUNDINGS` = 3
    """
    if theirs is None:
        raise _make_error(f"{name}, joint {path}", "the parser does not find this joint")
    if ours[:3] != theirs[:3]:
        raise _make_error(f"{name}, joint {path}", f"{theirs[:3]} instead of {ours[:3]}")
    size, ratios = ours[8], [0.0]
    for p, quaternion in ((3, 4), (5, 6)):
        distance = float(np.linalg.norm(np.subtract(ours[p], theirs[p])))
        if distance > 0.0:
            ratios.append(distance / (_ORIGIN_ROUNDINGS * SINGLE_ROUNDOFF * size) if size else np.inf)
        R = rotation_from_quaternion(ours[quaternion]).T @ rotation_from_quaternion(theirs[quaternion])
        ratios.append(_compute_angle(R) / (_ROTATION_ROUNDINGS * SINGLE_ROUNDOFF))
    for a, b in zip(ours[7], theirs[7], strict=True):
        if a != b:
            ratios.append(abs(a - b) / (SINGLE_ROUNDOFF * abs(a)) if a and np.isfinite(a) else np.inf)
    if not max(ratios) <= 1.0:
        raise _make_error(f"{name}, joint {path}", f"{max(ratios):.3g} times the bound of single precision")
    return max(ratios)


def _make_error(where: str, found: str) -> OracleError:
    return OracleError(
        "OpenUSD's parser of UsdPhysics and urdfkin disagree about this joint",
        where=where,
        found=found,
        remedy="please report this as an error of urdfkin, with the file",
    )


def _compute_angle(R: FloatArray) -> float:
    """Return a rotation's angle, rad. Small angles keep full accuracy."""
    sine = np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
    return float(np.arctan2(sine, (np.trace(R) - 1.0) / 2.0))


#: `urdfkin.urdf.usd.Usd.single_rounding_terms` defines the five numbers.
SingleRoundingTerms = Mapping[str, tuple[float, float, float, float, float]]


@dataclass(frozen=True, slots=True, eq=False)
class SinglePrecisionErrors:
    """Bounds on errors of rounding to single precision.

    Attributes:
        links: (links, 2) largest position error (m) and largest angle error (rad) in any configuration.
        joints: (joints, 3) position error (m), angle error (rad), and relative error of the mimic rule.
            The first two are errors of the child link's pose in the parent link, at q = 0.
    """

    links: FloatArray
    joints: FloatArray


def bound_single_precision_errors(
    tree: KinematicTree, rounding_terms: SingleRoundingTerms
) -> SinglePrecisionErrors:
    """Bound the errors of rounding to single precision.

        error of a stored number <= half the distance to the next number in single precision
        error of 0: none

        | Stored | Error |
        |---|---|
        | origin | length of the vector of the three errors |
        | unit quaternion | angle: twice the length of the vector of the four errors |
        | mimic rule m q + c | 2^-24 (abs(m q) + abs(c)), at the largest q within the limits |

        angle error t: moves each later link by <= t times the length of the path to this link

    Pose errors of a joint:

        A: pose of the joint's frame in the first body
        B: pose of the joint's frame in the second body
        A B^-1: pose of the second body in the first body, at q = 0
        p: origin of B
        w: sum of the position errors of A and B
        e: sum of the angle errors of A and B
        angle error of A B^-1 <= e
        position error of A B^-1 <= w + e |p|

    Entries of `rounding_terms`:

        revolute joint: e |p| = 0; if p is not zero, B is a separate fixed joint after the revolute joint
            the entry of the revolute joint includes the errors of B; the fixed joint has no entry
        other joints: the last of the five numbers is |p|
        locked prismatic joint: q displaces the child link too
            |q| <= length of the constant offset + lengths of the two origins
        no entry: no rounding errors
    """
    link_errors, joint_errors = np.zeros((len(tree.links), 2)), np.zeros((len(tree.joints), 3))
    for i, joint in enumerate(tree.joints):
        position_error, angle, size, mimic_error, lever = rounding_terms.get(
            joint.name, (0.0, 0.0, 0.0, 0.0, 0.0)
        )
        if joint.lock:
            lever = size + joint.length
        joint_errors[i] = position_error + angle * (0.0 if joint.kind.turns else lever), angle, mimic_error
        length = max(joint.length, size)
        slides = joint.kind is JointKind.PRISMATIC
        if slides:
            length += largest_value(joint.limit)
        if joint.mimic is not None:
            rule, mimicked_joint = joint.mimic, tree.joints[tree.joint_index(joint.mimic.mimicked_joint)]
            value_error = mimic_error * (
                abs(rule.multiplier) * largest_value(mimicked_joint.limit) + abs(rule.offset)
            )
            position_error, angle = (
                (position_error + value_error, angle) if slides else (position_error, angle + value_error)
            )
        parent_position_error, parent_angle_error = link_errors[joint.parent]
        link_errors[i + 1] = (
            parent_position_error + position_error + (parent_angle_error + angle) * length,
            parent_angle_error + angle,
        )
    return SinglePrecisionErrors(link_errors, joint_errors)


def _compare_prim_poses(tree: KinematicTree, answer: Mapping[str, Any]) -> tuple[str, tuple[UsdRemark, ...]]:
    """Compare the poses of links and prims. Return a sentence, and at most one remark.

    Bounds, with u = `SINGLE_ROUNDOFF` and n joints on the path from the root:

        transform of a prim: n + 1 operations (an assumption)
        angle error of one operation <= 6 pi u, the largest of three values
        `_TRANSFORM_ROUNDINGS` = 6 pi

        angles: at most three rotations of at most one turn
            errors <= 2 pi u each, 6 pi u in all
        quaternion: vector of the four errors, length <= u
            component perpendicular to the quaternion: the rotation changes by <= 2 u
            component parallel to the quaternion: the length changes; UsdGeom does not normalize
            rotation by the angle t: changes by <= 2 u sin t
            sum <= 4 u
        matrix: vector of the nine errors, length <= sqrt(3) u
            normalizing the rows does not increase this length
            rotation by a small angle t: the nine entries change by a vector of length sqrt(2) t
            angle error <= sqrt(3/2) u

        position error of one operation <= u + angle error, times the diameter of the robot
        diameter <= twice the largest distance of a prim from the stage's origin
    """
    prims: dict[str, str] = answer["prims"]
    rows = unpack_array(answer["rest"])
    rest = np.array([pose(row[:, :3], row[:, 3]) for row in rows])
    q = np.array([answer["rest_q"]], dtype=np.float64)
    plan = compile_tree(tree, [tree.frame_link(LinkFrame.of(name)) for name in prims])
    ours: FloatArray = PLACEMENT.compute_results(plan, (q,), None, base=FIXED_BASE_STATE)[0]
    # The root's pose is arbitrary, so poses are relative to the root.
    if tree.links[0] in prims:
        at = list(prims).index(tree.links[0])
        rest = inverse(rest[at]) @ rest
    link_errors = bound_single_precision_errors(tree, answer["single"]).links
    max_distance = float(np.linalg.norm(unpack_array(answer["rest"])[:, :, 3], axis=1).max(initial=0.0))
    remarks, worst = [], (0.0, 0.0)
    ratios = []
    for k, (name, path) in enumerate(prims.items()):
        link = tree.link_index(name)
        depth = len(tree.path(link)) + 1
        distance = float(np.linalg.norm(ours[k, :3, 3] - rest[k, :3, 3]))
        angle = _compute_angle(ours[k, :3, :3].T @ rest[k, :3, :3])
        angle_bound = link_errors[link, 1] + depth * _TRANSFORM_ROUNDINGS * SINGLE_ROUNDOFF
        distance_bound = (
            link_errors[link, 0] + depth * SINGLE_ROUNDOFF * (1.0 + _TRANSFORM_ROUNDINGS) * 2.0 * max_distance
        )
        ratio = max(distance / distance_bound if distance else 0.0, angle / angle_bound if angle else 0.0)
        ratios.append(ratio)
        worst = max(worst[0], distance), max(worst[1], angle)
        if ratio > 1.0:
            what = (
                f"the prim's pose and the pose computed from the joints differ by {distance:.3g} m"
                f" and {np.degrees(angle):.3g} degrees"
            )
            remarks.append(
                UsdRemark("rest-pose", path, what, "correct the joint's frames or the prim's transform")
            )
    moved = (
        int(np.count_nonzero(np.abs(q) > 0.0)) if not any(joint.kind.nq > 1 for joint in tree.joints) else 0
    )
    where = (
        f"at the stage's configuration, with {moved} joint{'s' * (moved > 1)} not at zero"
        if moved
        else "at q = 0"
    )
    if remarks:
        line = (
            f"UsdGeom and the joints place {len(remarks)} of {len(prims)} prims differently,"
            f" by up to {worst[0]:.3g} m"
        )
        # An error of one body displaces all later bodies, so only the first difference is reported.
        return line, tuple(remarks[:1])
    return (
        f"UsdGeom's transforms of {len(prims)} prims agree {where}"
        f" ({max(ratios, default=0.0):.1%} of the bound)",
        (),
    )
