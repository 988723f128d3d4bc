"""Write test vectors: configurations of a robot, and the results that a correct program computes for them.

The results are computed with at least 50 digits, and written with 17 digits. Each number has a tolerance.
Test vectors name the robot's URDF file and the file's SHA-256. If the robot is not in the catalogue, its URDF
file is written too. The file `robots/features.toml` defines small robots, each with one feature of URDF.
Results are computed from the decimal numbers in the URDF. Configurations are computed from SHA-256 digests of
the robot's name, the names of joints, and indices. Therefore, the vectors depend only on the URDF and the
robot's name.
"""

from __future__ import annotations

import hashlib
import math
import re
import tomllib
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, Decimal, localcontext
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, TypedDict

import numpy as np

from urdfkin.errors.escape import json_text, log_line
from urdfkin.kinematics.roundings import EPS, SMALLEST_SUBNORMAL
from urdfkin.model.configuration import coordinate_ranges, neutral
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, JointKind, KinematicTree
from urdfkin.robot import Robot
from urdfkin.robot.loading import load
from urdfkin.system.documents import Count, DocumentKind, NonNegativeFloat, Sha256, doc, of_length
from urdfkin.system.files import MAX_DATA_BYTES, read_bytes, read_text, write_file
from urdfkin.system.lazy_import import lazy_import
from urdfkin.system.resources import robots_dir
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.findings import UrdfWarning
from urdfkin.verify.bounds import true_value_magnitudes
from urdfkin.verify.exact.numbers import (
    REFERENCE_DIGITS,
    conversion_errors,
    enough_digits,
    format_decimal,
    precision,
    read_exact_joints,
)
from urdfkin.verify.exact.recursion import compute_motion
from urdfkin.verify.quantities import (
    ACCELERATION,
    HESSIAN,
    JACOBIAN,
    JACOBIAN_RATE,
    PLACEMENT,
    VELOCITY,
    Quantity,
)

#: A program that reads version 1.0 can read all versions 1.x.
VERSION = "1.0"
LICENCE = "CC0-1.0"
#: Number of configurations of each robot. In the first configuration, joints are at 0, or at the nearest
#: limit if the limits exclude 0.
SAMPLES = 3
#: Largest absolute value of random v and a. The same limit holds for random q of planar and floating joints,
#: except quaternions.
_MAX_RANDOM = 2.0
#: Inputs are rounded to multiples of 1 / 1024, except quaternions and values at a joint limit. These
#: multiples have at most ten decimals, and a double represents them without rounding.
_STEPS_PER_UNIT = 1024.0
#: Numbers of significant digits of the tolerance k * eps * scale. The tolerance is first rounded to the
#: nearest number with 12 digits, because the further digits differ between processors. The tolerance is then
#: rounded upward to 3 digits.
_TOLERANCE_DIGITS, _FIRST_TOLERANCE_DIGITS = 3, 12

SPATIAL_ACCELERATION = replace(
    ACCELERATION,
    name="spatial acceleration",
    compute_intervals=lazy_import("urdfkin.verify.exact.recursion:spatial_acceleration_values"),
)
#: The spatial acceleration is the classical acceleration minus w x v. The bound of ACCELERATION includes the
#: error of w x v. Therefore, spatial and classical acceleration have the same bound.
QUANTITIES = (
    PLACEMENT, VELOCITY, JACOBIAN, JACOBIAN_RATE, HESSIAN, ACCELERATION, SPATIAL_ACCELERATION,
)  # fmt: skip


class JointEntry(TypedDict):
    """A joint, and the indices of its elements in q, v and a."""

    name: Annotated[str, doc("Name of the joint.")]
    type: Annotated[str, doc("Type of the joint in the URDF.")]
    q: Annotated[list[Count], of_length(2), doc("Pair [start, stop]: q[start:stop] belongs to the joint.")]
    v: Annotated[
        list[Count],
        of_length(2),
        doc("Pair [start, stop]: v[start:stop] and a[start:stop] belong to the joint."),
    ]


class Result(TypedDict):
    """The values of one quantity of one frame, in metres, radians and seconds."""

    quantity: Literal[
        "placement",
        "velocity",
        "jacobian",
        "jacobian rate",
        "hessian",
        "acceleration",
        "spatial acceleration",
    ]
    frame: Annotated[str, doc("Name of a link.")]
    reference: Annotated[
        Literal["local", "world", "local_world_aligned"] | None,
        doc("Reference frame; null for a placement."),
    ]
    shape: Annotated[list[Count], doc("Shape of the result. The last index varies fastest in the lists.")]
    k: Annotated[NonNegativeFloat, doc("Factor k: a tolerance is k * 2^-52 times the size of the terms.")]
    value: Annotated[list[float], doc("The true values, rounded to 17 significant digits.")]
    tolerance: Annotated[
        list[float], doc("Largest allowed difference from the true value; 0 requires an equal result.")
    ]


class Sample(TypedDict):
    """A configuration with joint velocities and accelerations, and its results."""

    q: Annotated[list[float], doc("Coordinates: rad, m, quaternion x y z w.")]
    v: Annotated[
        list[float],
        doc("Joint velocities. The velocities of a planar or floating joint are in the child link's axes."),
    ]
    a: Annotated[list[float], doc("Joint accelerations: the time derivatives of v.")]
    results: list[Result]


class Vectors(TypedDict):
    """Test vectors of one robot."""

    schema: Annotated[str, doc("Name and version of the layout of this document.")]
    version: Annotated[str, doc("Version of the vectors.")]
    license: Annotated[
        str | None, doc("SPDX identifier of the licence; null: the licence of the robot's file applies.")
    ]
    robot: Annotated[str, doc("Name of the feature or robot.")]
    file: Annotated[str, doc("Path of the URDF, in this folder or in example-robot-data.")]
    sha256: Annotated[Sha256, doc("SHA-256 of the URDF file.")]
    rule: Annotated[str | None, doc("The rule of the URDF standard that this robot tests, or null.")]
    note: Annotated[
        str | None,
        doc(
            "Known difference between libraries, or the reason why the robot's mimic rules are invalid;"
            " null: no note."
        ),
    ]
    joints: list[JointEntry]
    samples: list[Sample]


VECTORS = DocumentKind("urdfkin-vectors/1", Vectors, (), "urdfkin vectors write DIR")


# -- the robots -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Feature:
    """A small robot with one feature of URDF.

    Attributes:
        note: Known difference between libraries.
    """

    name: str
    rule: str
    note: str | None
    text: str
    data: bytes
    frames: tuple[str, ...]


def file_stem(name: str) -> str:
    """Return the name of a robot's files without a suffix.

    >>> file_stem("rpy at pitch -pi/2")
    'rpy_at_pitch_minus_pi_2'
    """
    return re.sub(r"[^\w.]+", "_", name.replace(" -", " minus ")).strip("_.") or "robot"


@cache
def load_features() -> Mapping[str, Feature]:
    """Return the features in `robots/features.toml` by name.

    >>> load_features()["axis of length 2"].rule
    'The axis is a direction: its length has no effect on an angle.'
    """
    data = tomllib.loads(read_text(robots_dir() / "features.toml"))
    return {row["name"]: _make_feature(row, data["parts"]) for row in data["feature"]}


def _make_feature(row: Mapping[str, Any], parts: Mapping[str, str]) -> Feature:
    text = row.get("file") or _make_urdf(row)
    for name, part in (*parts.items(), ("inertial", _INERTIAL)):
        text = text.replace(f"{{{name}}}", part)
    data = (row.get("head", "") + text).encode(row.get("encoding", "utf-8"))
    return Feature(row["name"], row["rule"], row.get("note"), text, data, tuple(row.get("frames", ("tip",))))


_INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'


def _make_urdf(row: Mapping[str, Any]) -> str:
    joints = row.get("joints")
    if joints is None:
        joints = (
            f'{{j1}}<joint name="j2" type="{row.get("type", "revolute")}">\n'
            f'  <parent link="a"/><child link="tip"/>\n  {row["j2"]}\n</joint>\n'
        )
    children = re.findall(r'child link="([^"]+)"', joints.replace("{j1}", 'child link="a"'))
    links = "".join(
        f'<link name="{link}">{{inertial}}</link>\n' for link in dict.fromkeys(["base", *children])
    )
    version = f' version="{row["version"]}"' if "version" in row else ""
    return f'<robot name="r"{version}>\n{links}{joints}</robot>\n'


# -- configurations -------------------------------------------------------------------------------------


def _hash_to_fraction(*words: object) -> float:
    """Return a number in [0, 1) from the SHA-256 digest of `words`."""
    digest = hashlib.sha256("\n".join(map(str, words)).encode()).digest()
    return int.from_bytes(digest[:6], "big") / 2.0**48


def _round_to_grid(x: float) -> float:
    return round(x * _STEPS_PER_UNIT) / _STEPS_PER_UNIT


def make_configuration(
    tree: KinematicTree, name: str, sample: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return q, v and a of a sample.

    The numbers depend only on the sample's index, and on the robot's name, joints and limits.
    """
    q, ranges = neutral(tree), coordinate_ranges(tree)
    for joint, start in zip(tree.joints, tree.q_index, strict=True):
        fractions = [_hash_to_fraction(name, sample, joint.name, k) for k in range(joint.nq)]
        if joint.nq == 1:
            lower, upper = ranges[joint.name]
            value = _round_to_grid(lower + (upper - lower) * fractions[0]) if sample else 0.0
            q[start] = min(max(value, lower), upper)
        elif joint.kind is JointKind.FLOATING and sample:
            quaternion = [2.0 * x - 1.0 for x in fractions[3:]]
            length = math.sqrt(math.fsum(x * x for x in quaternion))
            q[start + 3 : start + 7] = [x / length for x in quaternion]
        if joint.nq > 1 and sample:
            q[start : start + 3] = [_round_to_grid(_MAX_RANDOM * (2.0 * x - 1.0)) for x in fractions[:3]]
    v, a = (
        np.array(
            [
                _round_to_grid(_MAX_RANDOM * (2.0 * _hash_to_fraction(name, sample, of, k) - 1.0))
                for k in range(tree.nv)
            ]
        )
        for of in "va"
    )
    return q, v, a


# -- tolerances -----------------------------------------------------------------------------------------


def _format_tolerance(k: float, scale: float) -> str:
    """Return k * eps * scale, rounded as `_TOLERANCE_DIGITS` describes.

    eps * scale is at least the smallest positive double, unless the scale is 0.
    """
    if scale == 0.0:
        return "0"
    with localcontext(prec=_FIRST_TOLERANCE_DIGITS):
        number = +Decimal(k * max(EPS * scale, SMALLEST_SUBNORMAL))
    with localcontext(prec=_TOLERANCE_DIGITS, rounding=ROUND_CEILING):
        return str((+number).normalize())


# -- files ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class VectorFiles:
    """The files of one robot.

    Attributes:
        numbers: Number of expected values in the test vectors.
    """

    robot: str
    files: tuple[Path, ...]
    numbers: int


@dataclass(frozen=True, slots=True)
class _Header:
    robot: str
    file: str
    sha256: str
    rule: str | None = None
    note: str | None = None
    license: str | None = LICENCE


def write_features(folder: Path, samples: int = SAMPLES) -> Iterator[VectorFiles]:
    for feature in load_features().values():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UrdfWarning)
            robot = load(feature.text, verify=False)
        stem_path = folder / file_stem(feature.name)
        file = stem_path.with_name(f"{stem_path.name}.urdf")
        write_file(file, feature.data)
        sha256 = hashlib.sha256(feature.data).hexdigest()
        header = _Header(feature.name, file.name, sha256, feature.rule, feature.note)
        found = _write_vectors(stem_path, robot, header, feature.frames, samples)
        yield replace(found, files=(*found.files, file))


def write_robot(folder: Path, robot: Robot, samples: int = SAMPLES) -> VectorFiles:
    """Write the test vectors of the robot's default tip.

    If the robot is not in the catalogue, the function also writes the URDF.
    """
    frames, name = (robot.tip_frame,), name_of(robot)
    if (entry := catalogue().get(robot.source)) is not None:
        sha256 = hashlib.sha256(read_bytes(entry.path)).hexdigest()
        header = _Header(name, entry.relative_path.as_posix(), sha256, note=entry.mimic_problem)
        return _write_vectors(folder / file_stem(name), robot, header, frames, samples)
    data, file = robot.urdf.encode(), f"{file_stem(name)}.urdf"
    write_file(folder / file, data)
    header = _Header(name, file, hashlib.sha256(data).hexdigest(), license=None)
    found = _write_vectors(folder / file_stem(name), robot, header, frames, samples)
    return replace(found, files=(*found.files, folder / file))


def write_catalogue(folder: Path, samples: int = SAMPLES) -> Iterator[VectorFiles]:
    for name in catalogue():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UrdfWarning)
            robot = load(name, verify=False)
        yield write_robot(folder, robot, samples)


def name_of(robot: Robot) -> str:
    return robot.source if robot.source in catalogue() else robot.name


def write_sums(folder: Path, written: Sequence[VectorFiles]) -> Path:
    """Write SHA256SUMS for all files, in the format of `sha256sum --check`."""
    lines = [
        f"{hashlib.sha256(read_bytes(path, MAX_DATA_BYTES)).hexdigest()}  {path.name}\n"
        for one in written
        for path in one.files
    ]
    write_file(folder / "SHA256SUMS", "".join(sorted(lines, key=lambda line: line[66:])).encode())
    return folder / "SHA256SUMS"


def _write_vectors(
    stem_path: Path, robot: Robot, header: _Header, frames: Sequence[str], samples: int
) -> VectorFiles:
    tree = robot.tree
    found = [_compute_sample(robot, header.robot, frames, sample) for sample in range(samples)]
    rows = [
        f"# {VECTORS.name} version {VERSION}, {header.license or 'no licence'}: {log_line(header.robot)}",
        f"# file {log_line(header.file)}, sha256 {header.sha256}",
        "# sample, frame, reference, quantity, values, tolerances",
    ]
    parts = []
    for index, (inputs, results) in enumerate(found):
        rows += [f"{index}\t-\t-\t{name}\t{' '.join(x)}\t" for name, x in inputs.items()]
        rows += [
            f"{index}\t{log_line(one['frame'])}\t{one['reference'] or '-'}\t{one['quantity']}"
            f"\t{' '.join(one['value'])}\t{' '.join(one['tolerance'])}"
            for one in results
        ]
        lists = ",\n".join(f'   "{name}": [{", ".join(x)}]' for name, x in inputs.items())
        texts = ",\n".join(f"    {_format_result(one)}" for one in results)
        parts.append(f'  {{\n{lists},\n   "results": [\n{texts}\n   ]\n  }}')
    joints = [
        {"name": joint.name, "type": joint.kind.value, "q": [i, i + joint.nq], "v": [j, j + joint.nv]}
        for joint, i, j in zip(tree.joints, tree.q_index, tree.v_index, strict=True)
        if joint.nq
    ]
    entries = {"schema": VECTORS.name, "version": VERSION, "license": header.license, "robot": header.robot}
    entries |= {"file": header.file, "sha256": header.sha256, "rule": header.rule, "note": header.note}
    top = "".join(
        f" {json_text(name)}: {json_text(entry)},\n" for name, entry in {**entries, "joints": joints}.items()
    )
    body = ",\n".join(parts)
    files = stem_path.with_name(f"{stem_path.name}.json"), stem_path.with_name(f"{stem_path.name}.tsv")
    write_file(files[0], f'{{\n{top} "samples": [\n{body}\n ]\n}}\n'.encode())
    write_file(files[1], "".join(f"{row}\n" for row in rows).encode())
    return VectorFiles(header.robot, files, sum(len(one["value"]) for _, results in found for one in results))


def _format_result(result: Mapping[str, Any]) -> str:
    """Return a result as JSON. The decimal texts in `value` and `tolerance` become numbers, unrounded."""
    texts = {name: json_text(x) for name, x in result.items()}
    texts |= {name: f"[{', '.join(result[name])}]" for name in ("value", "tolerance")}
    return f"{{{', '.join(f'{json_text(name)}: {text}' for name, text in texts.items())}}}"


def _compute_sample(
    robot: Robot, name: str, frames: Sequence[str], sample: int
) -> tuple[dict[str, list[str]], list[dict[str, Any]]]:
    q, v, a = make_configuration(robot.tree, name, sample)
    inputs = {name: [repr(float(x)) for x in array] for name, array in zip("qva", (q, v, a), strict=True)}
    digits = max(REFERENCE_DIGITS, enough_digits(len(robot.tree.joints)))
    while True:
        results = list(_compute_results(robot, frames, (q, v, a), digits))
        if all(None not in one["value"] for one in results):
            return inputs, results
        digits *= 2


def _compute_results(
    robot: Robot, frames: Sequence[str], inputs: tuple[FloatArray, ...], digits: int
) -> Iterator[dict[str, Any]]:
    """Compute results with intervals of `digits` digits.

    An entry of `value` is None if its interval is too wide for `format_decimal`.
    """
    tree, (q, v, a) = robot.tree, inputs
    for frame in frames:
        link = tree.frame_link(frame)
        plan, path = robot.plan((link,)), tree.path(link)
        batch = q[np.newaxis], v[np.newaxis], a[np.newaxis]
        magnitudes = true_value_magnitudes(plan, *batch, conversion_errors(robot.urdf, tree, path, batch[0]))
        with precision(digits):
            motion = compute_motion(tree, read_exact_joints(robot.urdf, tree, path), q, v, a)
            for row in QUANTITIES:
                for reference in row.references:
                    yield _make_result_entry(
                        row, motion, link, reference, frame, row.bound(plan, magnitudes, reference)
                    )


def _make_result_entry(
    row: Quantity, motion: Any, link: int, reference: Reference | None, frame: str, bound: Any
) -> dict[str, Any]:
    values = row.enclose(motion, link, reference)
    k = float(bound.k.reshape(-1)[0])
    scale = np.broadcast_to(bound.scale[0, 0], values.shape).reshape(-1).tolist()
    return {
        "quantity": row.name,
        "frame": frame,
        "reference": None if reference is None else reference.name.lower(),
        "shape": list(values.shape),
        "k": round(k, 6),
        "value": [
            format_decimal(x, k * EPS * s) for x, s in zip(values.reshape(-1).tolist(), scale, strict=True)
        ],
        "tolerance": [_format_tolerance(k, s) for s in scale],
    }
