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
    usd = read_usd(
        request["path"],
        request["name"],
        variants=[tuple(pair) for pair in request["variants"]],
        articulation=request["articulation"],
    )
    return {
        "urdf": to_urdf(usd.tree),
        "single": usd.single_rounding_terms,
        "remarks": [astuple(one) for one in usd.remarks],
        "prims": usd.prims,
        "rest": pack_array(usd.rest_poses[:, :3]),
        "rest_q": usd.rest_q.tolist(),
        "joints": _read_joints_twice(usd),
    }


def _read_joints_twice(usd: Usd) -> dict[str, Any]:
    """Read each joint with both readers."""
    pxr = import_openusd()
    physics, found = pxr.UsdPhysics, {}
    load = getattr(physics, "UsdPhysicsLoadStageFromPrimRange", None) or physics.LoadUsdPhysicsFromRange
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        parsed = load(usd.stage, ["/"])
    for paths, descriptions in parsed.values():
        for path, description in zip(paths, descriptions, strict=True):
            # A joint with PhysicsArticulationRootAPI has two descriptions in OpenUSD.
            # One describes the joint, and the other describes an articulation and is skipped.
            if str(path) in usd.joints and isinstance(description, physics.JointDesc):
                found[str(path)] = _describe_joint(physics, description, usd)
    return {path: [ours.as_list(), found.get(path)] for path, ours in usd.joints.items()}


def _describe_joint(physics: Any, description: Any, usd: Usd) -> list[Any]:
    """Return `UsdJoint.as_list` for OpenUSD's joint."""
    frames = []
    for i in (0, 1):
        p = getattr(description, f"localPose{i}Position")
        quaternion = getattr(description, f"localPose{i}Orientation")
        xyzw = np.array([*quaternion.GetImaginary(), quaternion.GetReal()], float)
        frames.append((np.array(p, float) * usd.meters_per_unit, xyzw / np.linalg.norm(xyzw)))
    freedoms = _name_degrees_of_freedom(physics, description)
    limit = getattr(description, "limit", None)
    if isinstance(description, physics.D6JointDesc):
        limit_of_freedom = {
            str(pair.first).rpartition(".")[2].lower(): pair.second for pair in description.jointLimits
        }
        # The variable `limit` is None for a joint with several free directions.
        limit = limit_of_freedom.get(freedoms.lower())
    factor = np.pi / 180.0 if freedoms.startswith("rot") else usd.meters_per_unit
    limits = (
        (float(limit.lower) * factor, float(limit.upper) * factor) if limit is not None else (-np.inf, np.inf)
    )
    return UsdJoint(
        freedoms, str(description.body0), str(description.body1), *frames[0], *frames[1], limits, 0.0
    ).as_list()


def _name_degrees_of_freedom(physics: Any, description: Any) -> str:
    """Return names such as "transX rotX"."""
    for kind, word in ((physics.RevoluteJointDesc, "rot"), (physics.PrismaticJointDesc, "trans")):
        if isinstance(description, kind):
            return f"{word}{str(description.axis).rpartition('.')[2][-1].upper()}"
    if isinstance(description, physics.D6JointDesc):
        ranges = [(str(pair.first).rpartition(".")[2], pair.second) for pair in description.jointLimits]
        locked = {word[0].lower() + word[1:] for word, limit in ranges if limit.lower > limit.upper}
        return " ".join(
            freedom
            for freedom in ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")
            if freedom not in locked
        )
    return ""
