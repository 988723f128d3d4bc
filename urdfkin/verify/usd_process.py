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
    read = read_usd(
        request["path"],
        request["name"],
        variants=[tuple(pair) for pair in request["variants"]],
        articulation=request["articulation"],
    )
    return {
        "urdf": to_urdf(read.tree),
        "single": read.single_rounding_terms,
        "remarks": [astuple(one) for one in read.remarks],
        "prims": read.prims,
        "rest": pack_array(read.rest_poses[:, :3]),
        "rest_q": read.rest_q.tolist(),
        "joints": _read_joints_twice(read),
    }


def _read_joints_twice(read: Usd) -> dict[str, Any]:
    """Read each joint with both readers."""
    pxr = import_openusd()
    physics, found = pxr.UsdPhysics, {}
    load = getattr(physics, "UsdPhysicsLoadStageFromPrimRange", None) or physics.LoadUsdPhysicsFromRange
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        parsed = load(read.stage, ["/"])
    for paths, descriptions in parsed.values():
        for path, one in zip(paths, descriptions, strict=True):
            # A joint with PhysicsArticulationRootAPI has two descriptions in OpenUSD.
            # One describes the joint, and the other describes an articulation and is skipped.
            if str(path) in read.joints and isinstance(one, physics.JointDesc):
                found[str(path)] = _describe_joint(physics, one, read)
    return {path: [ours.as_list(), found.get(path)] for path, ours in read.joints.items()}


def _describe_joint(physics: Any, one: Any, read: Usd) -> list[Any]:
    """Return `UsdJoint.as_list` for OpenUSD's joint."""
    frames = []
    for i in (0, 1):
        p, quaternion = getattr(one, f"localPose{i}Position"), getattr(one, f"localPose{i}Orientation")
        xyzw = np.array([*quaternion.GetImaginary(), quaternion.GetReal()], float)
        frames.append((np.array(p, float) * read.meters_per_unit, xyzw / np.linalg.norm(xyzw)))
    free = _degrees_of_freedom(physics, one)
    ends = getattr(one, "limit", None)
    if isinstance(one, physics.D6JointDesc):
        own = {str(pair.first).rpartition(".")[2].lower(): pair.second for pair in one.jointLimits}
        # The limits `ends` are None for a joint with several free directions.
        ends = own.get(free.lower())
    factor = np.pi / 180.0 if free.startswith("rot") else read.meters_per_unit
    limits = (
        (float(ends.lower) * factor, float(ends.upper) * factor) if ends is not None else (-np.inf, np.inf)
    )
    return UsdJoint(free, str(one.body0), str(one.body1), *frames[0], *frames[1], limits, 0.0).as_list()


def _degrees_of_freedom(physics: Any, one: Any) -> str:
    """Return names such as "transX rotX"."""
    for kind, word in ((physics.RevoluteJointDesc, "rot"), (physics.PrismaticJointDesc, "trans")):
        if isinstance(one, kind):
            return f"{word}{str(one.axis).rpartition('.')[2][-1].upper()}"
    if isinstance(one, physics.D6JointDesc):
        ranges = [(str(pair.first).rpartition(".")[2], pair.second) for pair in one.jointLimits]
        locked = {word[0].lower() + word[1:] for word, ends in ranges if ends.lower > ends.upper}
        return " ".join(
            freedom
            for freedom in ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")
            if freedom not in locked
        )
    return ""
