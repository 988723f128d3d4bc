"""Read a USD stage in a separate process, with urdfkin's reader and with OpenUSD's readers.

A USD stage (scene) can require any amount of time and memory, or crash OpenUSD's parsers, which are written
in C++. The request and the answer are JSON on standard input and standard output.

OpenUSD's package UsdPhysics has its own code for bodies, joint frames and limits. The answer contains the
data from UsdPhysics and from `urdfkin.urdf.usd`, for a comparison.
"""

from __future__ import annotations

import json
import os
import sys
import warnings
from collections.abc import Mapping
from dataclasses import astuple
from typing import Any

import numpy as np

from urdfkin.urdf.confinement import limit_process
from urdfkin.urdf.usd import Usd, UsdJoint, import_openusd, read_usd
from urdfkin.urdf.writer import to_urdf
from urdfkin.verify.mjcf_process import make_error_answer, pack_array, write_answer

#: A limit of at least this absolute value means that the joint has no limit.
_LARGEST_SINGLE = float(np.finfo(np.float32).max)


def serve() -> None:
    request = json.load(sys.stdin)
    os.environ["PXR_WORK_THREAD_LIMIT"] = "1"  # A confined process cannot start threads.
    try:
        import_openusd()
        limit_process(request["seconds"])
        write_answer(read_stage(request))
    except Exception as error:
        write_answer(make_error_answer(error, "OpenUSD cannot read this stage"))
    # `os._exit` skips the exit handlers of the libraries.
    os._exit(0)


def read_stage(request: Mapping[str, Any]) -> dict[str, Any]:
    usd = read_usd(
        request["path"],
        request["name"],
        variants=[tuple(pair) for pair in request["variants"]],
        articulation=request["articulation"],
    )
    return {
        "urdf": to_urdf(usd.tree, usd.joint_names),
        "single": usd.single_rounding_terms,
        "remarks": [astuple(one) for one in usd.remarks],
        "prims": usd.prims,
        "rest": pack_array(usd.rest_poses[:, :3]),
        "rest_q": usd.rest_q.tolist(),
        "joints": _read_joints_twice(usd),
    }


def _read_joints_twice(usd: Usd) -> dict[str, Any]:
    """Return pairs (urdfkin's description, UsdPhysics's description or None), by path."""
    pxr = import_openusd()
    physics, found = pxr.UsdPhysics, {}
    load = getattr(physics, "UsdPhysicsLoadStageFromPrimRange", None) or physics.LoadUsdPhysicsFromRange
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        parsed = load(usd.stage, ["/"])
    for paths, descriptions in parsed.values():
        for path, description in zip(paths, descriptions, strict=True):
            # For a joint with PhysicsArticulationRootAPI, OpenUSD also describes an articulation.
            if str(path) in usd.joints and isinstance(description, physics.JointDesc):
                found[str(path)] = _describe_joint(physics, str(path), description, usd)
    return {path: [ours.as_list(), found.get(path)] for path, ours in usd.joints.items()}


def _describe_joint(physics: Any, path: str, description: Any, usd: Usd) -> list[Any]:
    """Return `UsdJoint.as_list` for OpenUSD's joint."""
    frames = []
    for i in (0, 1):
        p = getattr(description, f"localPose{i}Position")
        quaternion = getattr(description, f"localPose{i}Orientation")
        xyzw = np.array([*quaternion.GetImaginary(), quaternion.GetReal()], float)
        frames.append((np.array(p, float) * usd.meters_per_unit, xyzw / np.linalg.norm(xyzw)))
    freedoms = _name_degrees_of_freedom(physics, description)
    factor = np.pi / 180.0 if freedoms.startswith("rot") else usd.meters_per_unit
    lower, upper = _read_limits(physics, path, description, usd)
    limits = lower * factor, upper * factor
    bodies = str(description.body0), str(description.body1)
    return UsdJoint(freedoms, *bodies, *frames[0], *frames[1], limits, 0.0).as_list()


def _read_limits(physics: Any, path: str, description: Any, usd: Usd) -> tuple[float, float]:
    """Return UsdPhysics's limits in degrees or stage units."""
    names: dict[str, str] = {}
    if isinstance(description, physics.D6JointDesc):
        freedom = _name_degrees_of_freedom(physics, description)
        # A joint with several degrees of freedom has no limits.
        limits = (x.second for x in description.jointLimits if freedom == _name_direction(x.first))
        limit = next(limits, None)
    else:
        limit = getattr(description, "limit", None)
        names = {"lower": "physics:lowerLimit", "upper": "physics:upperLimit"}
    if limit is None:
        return -np.inf, np.inf
    prim = usd.stage.GetPrimAtPath(path)
    ends = {"lower": -np.inf, "upper": np.inf}
    for end in ends:
        x = float(getattr(limit, end))
        # UsdPhysics returns 90 and -90 for the blocked limits of revolute and prismatic joints.
        is_blocked = end in names and prim.GetAttribute(names[end]).Get() is None
        if not is_blocked:
            ends[end] = x if abs(x) < _LARGEST_SINGLE else float(np.copysign(np.inf, x))
    return ends["lower"], ends["upper"]


def _name_degrees_of_freedom(physics: Any, description: Any) -> str:
    """Return names such as "transX rotX"."""
    for kind, word in ((physics.RevoluteJointDesc, "rot"), (physics.PrismaticJointDesc, "trans")):
        if isinstance(description, kind):
            return f"{word}{str(description.axis).rpartition('.')[2][-1].upper()}"
    if isinstance(description, physics.D6JointDesc):
        limits = [(_name_direction(pair.first), pair.second) for pair in description.jointLimits]
        locked = {direction for direction, limit in limits if limit.lower > limit.upper}
        return " ".join(
            freedom
            for freedom in ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")
            if freedom not in locked
        )
    return ""


def _name_direction(axis: Any) -> str:
    """Convert a name such as `JointDOF.TransX` to "transX"."""
    word = str(axis).rpartition(".")[2]
    return word[0].lower() + word[1:]
