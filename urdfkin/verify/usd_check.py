"""Read a USD stage in a process with limits on time and memory, and compare the robot with OpenUSD's readers.

Pinocchio reads the URDF text that urdfkin writes for the tree. Pinocchio's checks do not cover the conversion
from the USD stage (scene) to the tree. `load` therefore makes two comparisons:

- OpenUSD's parser UsdPhysics reads the joints. UsdPhysics and urdfkin's parser must find the same bodies,
  frames, degrees of freedom and limits for each joint. A difference raises OracleError.
- OpenUSD's module UsdGeom computes the transforms of the prims (scene objects). The stage shows the robot in
  one configuration. In this configuration, each link must have the placement of the link's prim. The file
  states the prims' transforms separately from the joint frames. A difference means that the joint frames
  contradict the prims' transforms; `load` reports the difference as a warning.

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
#: Angle between the joint frames of OpenUSD and urdfkin, rad:
#: at most `_ROTATION_ROUNDINGS * SINGLE_ROUNDOFF`, see `_check_joint`.
_ROTATION_ROUNDINGS = 18.0
#: Rounding errors in a joint's origin, see `_check_joint`.
_ORIGIN_ROUNDINGS = 3.0
#: A prim's transform consists of operations, such as rotations.
#: Angle error of one operation, in `SINGLE_ROUNDOFF`, rad.
#: `_compare_prims` derives this bound.
_TRANSFORM_ROUNDINGS = 6.0 * np.pi


@dataclass(frozen=True, slots=True)
class UsdReading:
    """The result of reading a USD stage in a separate process.

    `urdf` is the stage's tree as a URDF text. `answer` contains all data that the process returned.
    """

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
    """Read the robot of a USD file in a process with limits on time (s) and memory.

    OpenUSD also reads the files to which the stage refers. `variants` contains pairs (variant set, variant).
    Raises SourceError if the file cannot be read or is too large. Raises InputError if OpenUSD is missing,
    rejects the file or exceeds a limit, or for an unsupported joint.
    """
    version()
    path = expand_home(source)
    read_bytes(path)  # `read_bytes` raises SourceError if the file is missing.
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
    """Compare a robot with OpenUSD's data of the stage; return a sentence and remarks about prims.

    Raises OracleError if OpenUSD's parser and urdfkin disagree about a joint.
    """
    joints = reading.answer["joints"]
    share = max((_check_joint(verifier.tree.name, path, *pair) for path, pair in joints.items()), default=0.0)
    line = (
        f"compared with OpenUSD {version()}: UsdPhysics and urdfkin read the same {len(joints)} joints"
        f" ({share:.1%} of the bound of single precision)"
    )
    rest, remarks = _compare_prims(verifier.tree, reading.answer)
    return f"{line}; {rest}", remarks


def _check_joint(name: str, path: str, ours: list[Any], theirs: list[Any] | None) -> float:
    """Compare urdfkin's and OpenUSD's data of a joint; return the largest ratio of a difference to its bound.

    Let u = `SINGLE_ROUNDOFF` be the relative error of one rounding to single precision.

    - Rotation: rounding the four numbers of a quaternion changes the angle by at most 2 u. The product of two
      quaternions adds 4 u to each number. The vector of the four errors has the length 8 u. The angle error
      is twice this length, 16 u. The sum of both angle errors is 18 u, so `_ROTATION_ROUNDINGS` is 18.
    - Origin: the scale factor, the scaled origin and the transformed origin have one rounding error each.
      `_ORIGIN_ROUNDINGS` is therefore 3.
    """
    if theirs is None:
        raise _error(f"{name}, joint {path}", "the parser does not find this joint")
    if ours[:3] != theirs[:3]:
        raise _error(f"{name}, joint {path}", f"{theirs[:3]} instead of {ours[:3]}")
    size, shares = ours[8], [0.0]
    for p, quaternion in ((3, 4), (5, 6)):
        off = float(np.linalg.norm(np.subtract(ours[p], theirs[p])))
        if off > 0.0:
            shares.append(off / (_ORIGIN_ROUNDINGS * SINGLE_ROUNDOFF * size) if size else np.inf)
        R = rotation_from_quaternion(ours[quaternion]).T @ rotation_from_quaternion(theirs[quaternion])
        shares.append(_angle(R) / (_ROTATION_ROUNDINGS * SINGLE_ROUNDOFF))
    for a, b in zip(ours[7], theirs[7], strict=True):
        finite = abs(a) < np.inf
        if finite and a != b:
            shares.append(abs(a - b) / (SINGLE_ROUNDOFF * abs(a)) if a else np.inf)
    if not max(shares) <= 1.0:
        raise _error(f"{name}, joint {path}", f"{max(shares):.3g} times the bound of single precision")
    return max(shares)


def _error(where: str, found: str) -> OracleError:
    return OracleError(
        "OpenUSD's parser of UsdPhysics and urdfkin disagree about this joint",
        where=where,
        found=found,
        remedy="please report this as an error of urdfkin, with the file",
    )


def _angle(R: FloatArray) -> float:
    """Return the angle (rad) of a rotation, with full accuracy for small angles."""
    sine = np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
    return float(np.arctan2(sine, (np.trace(R) - 1.0) / 2.0))


#: Five bounds on single precision rounding for each joint.
#: `urdfkin.urdf.usd.Usd.single_precision` defines the five numbers.
SingleErrors = Mapping[str, tuple[float, float, float, float, float]]


@dataclass(frozen=True, slots=True, eq=False)
class SinglePrecisionErrors:
    """Bounds on the errors that rounding to single precision causes in a robot's links and joints.

    Attributes:
        links: (links, 2) largest position error (m) and angle error (rad) of each link, over all
            configurations.
        joints: (joints, 3) errors of each joint in the zero configuration. Columns 0 and 1 are the largest
            position error (m) and angle error (rad) of the child link's frame relative to the parent link's
            frame. Column 2 is the relative error of the multiplier and the offset in the joint's mimic rule.
    """

    links: FloatArray
    joints: FloatArray


def bound_single_precision_errors(tree: KinematicTree, single: SingleErrors) -> SinglePrecisionErrors:
    """Return bounds on the errors that rounding to single precision causes in links and joints.

    The error of a stored number is at most half the distance to the next number in single precision; 0 has no
    error.

    | Stored | Error |
    |---|---|
    | origin | length of the vector of the three errors |
    | unit quaternion | angle error: twice the length of the vector of the four errors |
    | mimic rule m q + c | 2^-24 times the sum of the sizes of m q and c, at the largest q within the limits |

    An angle error moves each later link by at most the angle times the length of the path to this link.

    A stage states the pose A of a joint's frame in one body, and the pose B in the other body. In the zero
    configuration, the pose of the second body in the first body is A B^-1. Let p be the origin of B. Let w be
    the sum of the position errors of A and B. Let e be the sum of the angle errors of A and B. The angle
    error of A B^-1 is at most e, and the position error of A B^-1 is at most w + e |p|.

    - Revolute joint: the term e |p| is 0. If p is not zero, urdfkin writes B as a separate fixed joint after
      the revolute joint. In `single`, the numbers of the revolute joint include the errors of B. The fixed
      joint therefore has no entry in `single`.
    - Other joints: the last of the joint's five numbers in `single` is |p|.
    - Locked prismatic joint: the value q also displaces the child link. |q| is at most the length of the
      joint's constant offset plus the lengths of the two origins.
    - Joint without an entry in `single`: no rounding errors.
    """
    link_errors, joint_errors = np.zeros((len(tree.links), 2)), np.zeros((len(tree.joints), 3))
    for i, joint in enumerate(tree.joints):
        position_error, angle, size, share, lever = single.get(joint.name, (0.0, 0.0, 0.0, 0.0, 0.0))
        if joint.lock:
            lever = size + joint.length
        joint_errors[i] = position_error + angle * (0.0 if joint.kind.turns else lever), angle, share
        length = max(joint.length, size)
        slides = joint.kind is JointKind.PRISMATIC
        if slides:
            length += largest_value(joint.limit)
        if joint.mimic is not None:
            rule, mimicked_joint = joint.mimic, tree.joints[tree.joint_index(joint.mimic.mimicked_joint)]
            off = share * (abs(rule.multiplier) * largest_value(mimicked_joint.limit) + abs(rule.offset))
            position_error, angle = (position_error + off, angle) if slides else (position_error, angle + off)
        parent_position_error, parent_angle_error = link_errors[joint.parent]
        link_errors[i + 1] = (
            parent_position_error + position_error + (parent_angle_error + angle) * length,
            parent_angle_error + angle,
        )
    return SinglePrecisionErrors(link_errors, joint_errors)


def _compare_prims(tree: KinematicTree, answer: Mapping[str, Any]) -> tuple[str, tuple[UsdRemark, ...]]:
    """Compare the placements of links with the transforms of their prims, in the stage's configuration.

    The bound assumes that a prim's transform consists of n + 1 operations, where n is the number of joints on
    the path from the root. With u = `SINGLE_ROUNDOFF`, the angle error of one operation is at most
    `_TRANSFORM_ROUNDINGS` u, the largest of these three values:

    - Angles: at most three rotations of at most one turn, with errors of at most 2 pi u each: 6 pi u.
    - Quaternion: the vector of the four errors is at most u long. The component of this vector perpendicular
      to the quaternion changes the rotation by at most 2 u. The component parallel to the quaternion changes
      the length of the quaternion. UsdGeom does not normalize the quaternion, so a rotation by the angle t
      changes by at most 2 u sin t. The sum is at most 4 u.
    - Matrix: the nine errors form a vector with a length of at most sqrt(3) u. Normalizing the rows does not
      increase this length. A rotation by a small angle t changes the nine entries by a vector of the length
      sqrt(2) t. The angle error is therefore at most sqrt(3/2) u.
    """
    prims: dict[str, str] = answer["prims"]
    rows = unpack_array(answer["rest"])
    rest = np.array([pose(row[:, :3], row[:, 3]) for row in rows])
    q = np.array([answer["rest_q"]], dtype=np.float64)
    plan = compile_tree(tree, [tree.frame_link(LinkFrame.of(name)) for name in prims])
    ours: FloatArray = PLACEMENT.compute_results(plan, (q,), None, base=FIXED_BASE_STATE)[0]
    # The root's pose is arbitrary, so poses are relative to it.
    if tree.links[0] in prims:
        at = list(prims).index(tree.links[0])
        rest = inverse(rest[at]) @ rest
    link_errors = bound_single_precision_errors(tree, answer["single"]).links
    far = float(np.linalg.norm(unpack_array(answer["rest"])[:, :, 3], axis=1).max(initial=0.0))
    remarks, worst = [], (0.0, 0.0)
    shares = []
    for k, (name, path) in enumerate(prims.items()):
        link = tree.link_index(name)
        depth = len(tree.path(link)) + 1
        off = float(np.linalg.norm(ours[k, :3, 3] - rest[k, :3, 3]))
        angle = _angle(ours[k, :3, :3].T @ rest[k, :3, :3])
        turn = link_errors[link, 1] + depth * _TRANSFORM_ROUNDINGS * SINGLE_ROUNDOFF
        length = link_errors[link, 0] + depth * SINGLE_ROUNDOFF * (1.0 + _TRANSFORM_ROUNDINGS) * 2.0 * far
        share = max(off / length if off else 0.0, angle / turn if angle else 0.0)
        shares.append(share)
        worst = max(worst[0], off), max(worst[1], angle)
        if share > 1.0:
            what = (
                f"the prim's pose and the pose computed from the joints differ by {off:.3g} m"
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
        words = (
            f"UsdGeom and the joints place {len(remarks)} of {len(prims)} prims differently,"
            f" by up to {worst[0]:.3g} m"
        )
        # Only the first difference is reported, because later bodies move too.
        return words, tuple(remarks[:1])
    return (
        f"UsdGeom's transforms of {len(prims)} prims agree {where}"
        f" ({max(shares, default=0.0):.1%} of the bound)",
        (),
    )
