"""Compile an MJCF file with MuJoCo and with Pinocchio's MJCF reader, in a separate process.

A few lines of MJCF, such as nested `<replicate>` or `nuser_body`, can require any amount of time and memory,
or crash a parser. The process reads a request from standard input, and writes each answer as a line of JSON
to standard output:

1. the robot, compiled without shapes and inertias
2. the robot, compiled from the complete file, or the reason why MuJoCo does not compile this file
3. the placements of the bodies by Pinocchio's reader

A request without samples gets no third answer, and gets the second answer only if MuJoCo aligns a free body
with its inertial frame.

If the process ends early, the answers that it has already written remain valid.
"""

from __future__ import annotations

import base64
import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import astuple
from typing import Any

import numpy as np

from urdfkin.errors import InputError, InstallationError, OracleError, UrdfkinError
from urdfkin.model.configuration import neutral, sample
from urdfkin.model.tree import FloatArray
from urdfkin.urdf.confinement import MAX_MEMORY, limit_process
from urdfkin.urdf.mjcf import Mjcf, read_mjcf
from urdfkin.urdf.mujoco import import_mujoco
from urdfkin.urdf.writer import to_urdf
from urdfkin.verify.pinocchio import pinocchio

_FREE_JOINT_SIZE = 7
_MAX_NAMES = 5
MAX_OUTPUT_BYTES = 400_000_000

_MEMORY_HINT = f"it takes more than {MAX_MEMORY / 1024**3:g} GiB of memory"


def serve() -> None:
    request = json.load(sys.stdin)
    try:
        # Without a warning function, MuJoCo writes a log file.
        import_mujoco().set_mju_user_warning(lambda message: None)
        if request["path"] is not None and request["samples"]:
            with suppress(InstallationError):
                pinocchio()
        limit_process(request["seconds"])
        for answer in compute_answers(request):
            write_answer(answer)
    except Exception as error:
        write_answer(make_error_answer(error, "MuJoCo cannot compile this MJCF"))
    # `os._exit` skips the exit handlers of the libraries.
    os._exit(0)


def make_error_answer(error: Exception, what: str) -> dict[str, Any]:
    """Describe an error. If the error is not an `UrdfkinError`, `what` states the problem."""
    if isinstance(error, UrdfkinError):
        parts = {key: getattr(error, key) for key in ("what", "where", "remedy")}
        return {"error": parts | {"found": _add_memory_hint(error.found)}}
    found = _MEMORY_HINT if isinstance(error, MemoryError) else f"{type(error).__name__}: {error}"[:2000]
    return {"error": {"what": what, "found": found}}


def _add_memory_hint(found: str | None) -> str | None:
    return f"{found} Perhaps {_MEMORY_HINT}" if found and found.endswith("unknown exception!") else found


def write_answer(answer: Mapping[str, Any]) -> None:
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()


def parse_answers(
    output: bytes, status: int | None, *, library: str, name: str, timeout: float
) -> tuple[list[dict[str, Any]], str]:
    """Parse the output of a process.

    `status` is None if the process exceeded `timeout` (s).

    Returns:
        All answers, and a text about the end of the process. The text explains a missing answer.

    Raises:
        InputError: An answer is an error.
    """
    lines = output.splitlines(keepends=True)
    answers = [json.loads(line) for line in lines if line.startswith(b"{") and line.endswith(b"}\n")]
    for answer in answers:
        if (error := answer.get("error")) is not None:
            parts = {key: error.get(key) for key in ("found", "remedy")}
            raise InputError(error["what"], where=error.get("where") or name, **parts)
    if status is None:
        return answers, f"{library} did not finish within {timeout:g} s"
    if len(output) > MAX_OUTPUT_BYTES:
        return answers, f"{library} returned more than {MAX_OUTPUT_BYTES} bytes"
    return answers, f"{library}'s process ended with status {status}: perhaps {_MEMORY_HINT}"


def compute_answers(request: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    path, samples = request["path"], int(request["samples"])
    source = path if path is not None else request["text"]
    mjcf = read_mjcf(source, request["name"])
    q = _make_configurations(mjcf, samples)
    yield _make_robot_answer(mjcf, q)
    if samples or mjcf.aligns_free_bodies:
        try:
            complete = read_mjcf(source, request["name"], with_shapes=True)
            q = _make_configurations(complete, samples)
            yield _make_robot_answer(complete, q)
            mjcf = complete
        except (MemoryError, InputError, import_mujoco().FatalError) as error:
            if isinstance(error, InputError) and error.remedy is not None:
                raise  # MuJoCo compiles the file, but urdfkin does not support the model.
            found = error.found if isinstance(error, InputError) else str(error)
            yield {"shapes_refusal": _add_memory_hint(found) or _MEMORY_HINT}
    if samples and path is not None:
        yield {"pinocchio": _compute_with_pinocchio(path, mjcf, q)}


def _make_configurations(mjcf: Mjcf, samples: int) -> FloatArray:
    if not samples:
        return np.empty((0, mjcf.tree.nq))
    drawn = sample(mjcf.tree, samples, np.random.default_rng(0))
    return np.vstack((neutral(mjcf.tree), drawn))


def _make_robot_answer(mjcf: Mjcf, q: FloatArray) -> dict[str, Any]:
    answer: dict[str, Any] = {
        "urdf": to_urdf(mjcf.tree, mjcf.joint_names),
        "listed": [astuple(one) for one in mjcf.remarks],
        "whole": mjcf.with_shapes,
        "frames": [(name, kind) for name, (kind, _) in mjcf.frames.items()],
        "rules": [(i, name) for i, name in mjcf.mimic_equalities.items()],
        "apart": sorted(mjcf.other_equalities),
    }
    if len(q):
        answer |= {
            "q": pack_array(q),
            "placements": pack_array(mjcf.placements(q)[..., :3, :]),
            "lengths": pack_array(mjcf.origin_distance_bounds(q)),
            "angles": pack_array(mjcf.hinge_angle_sums(q)),
            "residuals": pack_array(mjcf.residuals(q)),
            "rule_sizes": pack_array(mjcf.rule_scales(q)),
        }
    return answer


def pack_array(numbers: FloatArray) -> dict[str, Any]:
    data = np.ascontiguousarray(numbers, dtype="<f8")
    return {"shape": data.shape, "base64": base64.b64encode(data.tobytes()).decode("ascii")}


def unpack_array(found: Mapping[str, Any]) -> FloatArray:
    numbers = np.frombuffer(base64.b64decode(found["base64"]), dtype="<f8")
    return numbers.reshape([int(n) for n in found["shape"]]).astype(np.float64)


def _compute_with_pinocchio(path: str, mjcf: Mjcf, q: FloatArray) -> dict[str, Any]:
    bodies = [name for name, (kind, i) in mjcf.frames.items() if kind == "body" and i]
    try:
        placements = _compute_pinocchio_placements(path, mjcf.qpos(q), mjcf.qpos_index, bodies)
    except (OracleError, InstallationError) as error:
        return {"error": str(error)}
    return {"bodies": bodies, "placements": pack_array(placements[..., :3, :])}


def _compute_pinocchio_placements(
    path: str, qpos: FloatArray, qpos_index: Mapping[str, int], bodies: Sequence[str]
) -> FloatArray:
    # `qpos_index` contains each joint's first index in a row of `qpos`.
    pin = pinocchio()
    try:
        model = pin.buildModelFromMJCF(path)
    except Exception as error:  # Pinocchio's parsers raise many types of exceptions.
        raise OracleError("the reader does not accept the file", found=str(error).strip()) from error
    q_ranges = dict(_list_coordinates(model, list(qpos_index)))
    if q_ranges.keys() != qpos_index.keys():
        found = ", ".join(sorted(q_ranges.keys() ^ qpos_index.keys())[:_MAX_NAMES])
        raise OracleError("the reader finds different joints", found=found)
    if missing := [name for name in bodies if not model.existFrame(name)]:
        raise OracleError("the reader does not find one of the bodies in the file", found=missing[0])
    data, out = model.createData(), np.empty((len(qpos), len(bodies), 4, 4))
    ids = [int(model.getFrameId(name, pin.FrameType.BODY)) for name in bodies]
    for k, qpos_row in enumerate(qpos):
        q = pin.neutral(model)
        for name, at in qpos_index.items():
            (first, count), x = q_ranges[name], qpos_row[at]
            if count == _FREE_JOINT_SIZE:
                q[first : first + 7] = [*qpos_row[at : at + 3], *np.roll(qpos_row[at + 3 : at + 7], -1)]
            elif count == 1:
                q[first] = x
            else:  # In Pinocchio, a revolute joint without limits has two coordinates: cosine and sine.
                q[first : first + 2] = np.cos(x), np.sin(x)
        pin.framesForwardKinematics(model, data, q)
        out[k] = [data.oMf[i].homogeneous for i in ids]
    return out


def _list_coordinates(model: Any, names: Sequence[str]) -> Iterator[tuple[str, tuple[int, int]]]:
    """Yield each joint's name, index in q and size.

    Pinocchio combines the joints `x` and `y` of a body into `Composite_x`.
    """
    for j, name in list(enumerate(map(str, model.names)))[1:]:
        joint, first = model.joints[j], name.removeprefix("Composite_")
        if first != name and first in names:
            k = names.index(first)
            for i, part in enumerate(names[k : k + joint.nq]):
                yield part, (joint.idx_q + i, 1)
        else:
            yield name, (joint.idx_q, joint.nq)
