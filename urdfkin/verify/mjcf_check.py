"""Read an MJCF file in a process with limits on time and memory, and compare the robot with MuJoCo's model.

Pinocchio reads the URDF text that urdfkin writes for the tree. Pinocchio's checks do not cover the conversion
from the MJCF file to the tree. `load` therefore makes three comparisons:

- MuJoCo computes the placements of bodies and sites, which must agree with the tree's placements.
- The joint equalities of MuJoCo's model must agree with the tree's mimic rules.
- Pinocchio's MJCF reader computes the placements of bodies. Pinocchio reads some files differently, so a
  difference from Pinocchio is reported, but is not an error.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np

from urdfkin.compiled.plan import compile_tree
from urdfkin.errors import InputError, OracleError, RangeError
from urdfkin.errors.escape import escape_unprintable
from urdfkin.kinematics.roundings import EPS, MJCF_MIMIC_ROUNDINGS
from urdfkin.model.base_motion import FIXED_BASE_STATE
from urdfkin.model.tree import FloatArray, LinkFrame
from urdfkin.system.files import expand_home
from urdfkin.system.processes import python_command, run_python
from urdfkin.urdf.mjcf import MjcfRemark, is_text, source_name
from urdfkin.urdf.mujoco import version
from urdfkin.verify.bounds import (
    Bound,
    broadcast_k,
    compute_magnitudes,
    mjcf_placement_bound,
    mujoco_magnitudes,
)
from urdfkin.verify.comparison import bound_ratios, worst_disagreements
from urdfkin.verify.mjcf_process import MAX_OUTPUT_BYTES, parse_answers, unpack_array
from urdfkin.verify.quantities import PLACEMENT
from urdfkin.verify.verifier import Verifier

#: Number of random configurations besides the zero configuration.
_SAMPLE_COUNT = 8
#: Time limit for reading a file, seconds.
TIMEOUT = 60.0
_MAX_QUOTE_LENGTH = 300


@dataclass(frozen=True, slots=True)
class MjcfReading:
    """The robot of an MJCF file, as plain data.

    Attributes:
        remarks: Elements that the tree lacks.
        path: Path of the file, or None for MJCF text.
        answer: Last answer with a robot, from the process that reads the file.
        shapes_refusal: Reason why MuJoCo compiles the file only without shapes and inertias. None if MuJoCo
            compiles the complete file. Not valid with `with_check_data=False`.
        pinocchio: Placements of bodies by Pinocchio's MJCF reader, an error, or None without an answer.
    """

    urdf: str
    remarks: tuple[MjcfRemark, ...]
    path: str | None
    answer: Mapping[str, Any]
    shapes_refusal: str | None
    pinocchio: Mapping[str, Any] | None


def read_mjcf(
    source: str | bytes | os.PathLike[str],
    *,
    with_check_data: bool = True,
    timeout: float = TIMEOUT,
    name: str | None = None,
) -> MjcfReading:
    """Read an MJCF file or text in a separate process.

    With `with_check_data`, the process computes data for `check_mjcf_source`. `timeout` is in seconds. `name`
    is the name of the source in messages, for example `<stdin>`.

    Raises:
        InputError: MuJoCo or urdfkin rejects the file, or the process ends without a robot.
    """
    version()
    name = source_name(source) if name is None else name
    text = isinstance(source, bytes) or is_text(source)
    path = None if text else str(expand_home(os.fspath(source)))  # type: ignore[arg-type]
    request = {
        "path": path,
        "text": _decode_text(source, name) if text else None,
        "name": name,
        "samples": _SAMPLE_COUNT if with_check_data else 0,
        "seconds": ceil(timeout) + 1,
    }
    answers, ending = _request_answers(request, timeout)
    robot_answers = [answer for answer in answers if "urdf" in answer]
    if not robot_answers:
        raise InputError(
            "MuJoCo cannot compile this MJCF",
            where=name,
            found=ending,
            remedy="check the file for very large numbers, for example in <replicate>",
        )
    refusals = [answer["shapes_refusal"] for answer in answers if "shapes_refusal" in answer]
    return MjcfReading(
        robot_answers[-1]["urdf"],
        tuple(MjcfRemark(*one) for one in robot_answers[-1]["listed"]),
        path,
        robot_answers[-1],
        None
        if robot_answers[-1]["whole"]
        else escape_unprintable((refusals or [ending])[0])[:_MAX_QUOTE_LENGTH],
        next((answer["pinocchio"] for answer in answers if "pinocchio" in answer), None),
    )


def _decode_text(source: str | bytes | os.PathLike[str], name: str) -> str:
    try:
        return source.decode("utf-8-sig") if isinstance(source, bytes) else str(source).lstrip("\ufeff")
    except UnicodeDecodeError as error:
        raise InputError("MuJoCo does not accept this MJCF", where=name, found=str(error)) from None


def _request_answers(request: Mapping[str, Any], timeout: float) -> tuple[list[dict[str, Any]], str]:
    command = python_command(
        "from urdfkin.verify.mjcf_process import serve; serve()", options=("-B", "-X", "utf8")
    )
    output, status = run_python(command, json.dumps(request).encode(), timeout, MAX_OUTPUT_BYTES)
    return parse_answers(output, status, library="MuJoCo", name=request["name"], timeout=timeout)


def check_mjcf_source(verifier: Verifier, reading: MjcfReading) -> str:
    """Compare a robot with MuJoCo's model, and return a sentence about the result.

    Raises:
        OracleError: A body, a site or a mimic rule differs from MuJoCo's by more than rounding errors.
        RangeError: The bound on a position exceeds the range of doubles.
    """
    tree, answer = verifier.tree, reading.answer
    q = unpack_array(answer["q"])
    frames = [LinkFrame.of(name) for name, _ in answer["frames"]]
    plan = compile_tree(tree, [tree.frame_link(frame) for frame in frames])
    ours: FloatArray = PLACEMENT.compute_results(plan, (q,), None, base=FIXED_BASE_STATE)
    # The factor 2 allows for the rounded angles in the URDF text.
    magnitudes = mujoco_magnitudes(compute_magnitudes(plan, q, None, None, FIXED_BASE_STATE))
    bound = PLACEMENT.bound(plan, magnitudes, None)
    bound = Bound(bound.scale, 2.0 * bound.k)
    bound = mjcf_placement_bound(bound, unpack_array(answer["lengths"]), unpack_array(answer["angles"]))
    if not np.isfinite(bound.scale).all():
        raise RangeError(
            "the bound on a position exceeds the range of double precision",
            where=tree.name,
            remedy="give smaller numbers",
        )
    ratio = _compute_bound_ratios(ours, _unpack_placements(answer["placements"]), bound)
    if not (ratio <= 1.0).all():
        k, f = np.unravel_index(int(np.nan_to_num(ratio, nan=np.inf).argmax()), ratio.shape)
        raise _make_error(
            f"{tree.name}, {frames[f]}", f"{ratio[k, f]:.3g} times the bound of rounding, MuJoCo {version()}"
        )
    rule_ratio = _check_rules(tree.name, answer)
    line = (
        f"compared with MuJoCo {version()}: {len(frames)} bodies and sites of the MJCF agree in {len(q)}"
        f" configurations ({ratio.max(initial=0.0):.1%} of the bound)"
    )
    if rule_ratio is not None:
        line += f", and {len(answer['rules'])} mimic rules agree ({rule_ratio:.1%})"
    if reading.shapes_refusal is not None:
        line += f"; MuJoCo compiles the file only without shapes and inertias: {reading.shapes_refusal}"
    return f"{line}; {_compare_with_pinocchio(reading, ours, bound)}"


def _check_rules(name: str, answer: Mapping[str, Any]) -> float | None:
    """Return the largest ratio of error to bound, or None for a robot without mimic rules."""
    rules = {int(i): str(joint) for i, joint in answer["rules"]}
    residuals, sizes = unpack_array(answer["residuals"]), unpack_array(answer["rule_sizes"])
    active = set(np.flatnonzero(~np.isnan(residuals).all(axis=0)).tolist())
    if different := active.symmetric_difference(rules.keys() | set(answer["apart"])):
        first = min(different)
        what = f"mimic joint {rules[first]}" if first in rules else f"equality {first}"
        raise _make_error(
            f"{name}, {what}",
            f"MuJoCo {version()} {'has' if first in active else 'does not have'} this constraint",
        )
    if not rules:
        return None
    equalities = sorted(rules)
    residuals, sizes = residuals[:, equalities], sizes[:, equalities]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.abs(residuals) / (MJCF_MIMIC_ROUNDINGS * EPS * sizes)
    ratio = np.where(residuals == 0.0, 0.0, ratio)
    if not (ratio <= 1.0).all():
        k, i = np.unravel_index(int(np.nan_to_num(ratio, nan=np.inf).argmax()), ratio.shape)
        off = abs(residuals[k, i])
        raise _make_error(
            f"{name}, mimic joint {rules[equalities[i]]}", f"MuJoCo {version()} differs by {off:.3g}"
        )
    return float(ratio.max())


def _make_error(where: str, found: str) -> OracleError:
    return OracleError(
        "the robot made from an MJCF file differs from the file",
        where=where,
        found=found,
        remedy="please report this as an error of urdfkin, with the file",
    )


def _unpack_placements(found: Mapping[str, Any]) -> FloatArray:
    rows = unpack_array(found)
    T = np.zeros((*rows.shape[:2], 4, 4))
    T[..., :3, :], T[..., 3, 3] = rows, 1.0
    return T


def _compute_bound_ratios(ours: FloatArray, theirs: FloatArray, bound: Bound) -> FloatArray:
    units = worst_disagreements(ours, theirs, bound.scale, 2)
    return bound_ratios(units, broadcast_k(bound, units.shape))


def _compare_with_pinocchio(reading: MjcfReading, ours: FloatArray, bound: Bound) -> str:
    if reading.path is None:
        return "not compared with Pinocchio's MJCF reader, which needs a file"
    found = reading.pinocchio or {"error": "the process of the reader ended"}
    if "error" in found:
        return f"not compared with Pinocchio's MJCF reader ({found['error']})"
    names = list(found["bodies"])
    if not names:
        return "not compared with Pinocchio's MJCF reader, because the file has no bodies"
    frame_names = [name for name, _ in reading.answer["frames"]]
    bodies, theirs = [frame_names.index(name) for name in names], _unpack_placements(found["placements"])
    ratio = _compute_bound_ratios(ours[:, bodies], theirs, Bound(bound.scale[:, bodies], bound.k[:, bodies]))
    if (ratio <= 1.0).all():
        return "Pinocchio's MJCF reader agrees on the poses of the bodies"
    f = int(ratio.max(axis=0).argmax())
    off = np.abs(ours[:, bodies[f]] - theirs[:, f])[:, :3]
    return (
        f"Pinocchio's MJCF reader disagrees: its {names[f]} differs by up to {off[..., 3].max():.3g} m,"
        f" and its axes by {off[..., :3].max():.3g}"
    )
