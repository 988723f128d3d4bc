"""Write the result of `urdfkin same` as a certificate, and check a certificate against two models."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal, TypedDict, cast

import numpy as np

from urdfkin.comparison.bounds import DistanceSearch, own_poses, pinocchio_poses, tighten
from urdfkin.comparison.result import Confirmation, ConfirmationState, Difference, Sameness, Verdict
from urdfkin.comparison.verdict import CONFIRMATION_SAMPLES, Comparator
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.mechanisms.mechanism import (
    Alignment,
    AlignmentChoices,
    FramePair,
    FreeJointConversion,
    Variables,
    is_joint_pose,
    pose_difference,
    variables_of,
)
from urdfkin.model.mechanisms.upper_bound import COARSE_GRID, FINE_GRID, upper_bounds
from urdfkin.model.tree import JointKind, Mimic
from urdfkin.robot import Robot
from urdfkin.system.documents import (
    Count,
    DocumentKind,
    Header,
    NonNegativeFloat,
    TransformRows,
    as_json_data,
    doc,
    of_length,
)
from urdfkin.verify.oracles import PINOCCHIO, package_versions

#: Maximum number of boxes in memory during `recheck`.
MAX_RECHECK_BOXES = 2**22
#: Relative tolerance of the numbers in a certificate, and absolute tolerance (m or rad) near zero. The
#: tolerances allow for different rounding errors on the machine that wrote the certificate.
_RELATIVE_TOLERANCE, _ZERO_TOLERANCE = 1e-9, 1e-15
#: The relative tolerance of a bound is this number times the machine epsilon.
_BOUND_TOLERANCE = 64.0
#: `recheck` computes these entries again, and compares the results with the certificate.
RECOMPUTED_ENTRIES = ("up_to", "remarks", "joints", "orders", "links", "base", "base_links", "rounding")


class CertifiedModel(TypedDict):
    """Name and source of a model."""

    name: Annotated[str, doc("Name of the robot.")]
    source: Annotated[
        str, doc("Path, catalogue name, - for standard input, or a label such as <text> or <bytes>.")
    ]


class CertifiedRule(TypedDict):
    """Mimic rule: value = multiplier * (mimicked value) + offset."""

    mimicked_joint: Annotated[str, doc("Name of the mimicked joint.")]
    multiplier: Annotated[float, doc("Factor by which the mimicked joint's value is multiplied.")]
    offset: Annotated[float, doc("Number that is added to multiplier * (mimicked value), rad or m.")]


Value = str | float | list[str | float | None] | CertifiedRule | None


class DifferenceEntry(TypedDict):
    """A difference between the two models."""

    place: Annotated[
        str, doc("Joint or link of A, for example `joint elbow`. The name is B's if A has no such element.")
    ]
    what: Annotated[
        str, doc("Name of the parameter that differs, for example `axis`, `mimic rule` or `limits`.")
    ]
    a: Annotated[Value, doc("Value of the parameter in A; null without a value.")]
    b: Annotated[Value, doc("Value of the parameter in B; null without a value.")]
    radians: Annotated[
        NonNegativeFloat, doc("Angular part of the difference, radians; 0 if no angle differs.")
    ]
    metres: Annotated[
        NonNegativeFloat, doc("Linear part of the difference, metres; 0 if no distance differs.")
    ]
    detail: Annotated[
        Literal["", "alone", "converted"],
        doc(
            "`alone`: the joint's axis differs, but the links after the joint agree."
            " `converted`: B's limits are in A's coordinate."
        ),
    ]


class CertifiedConversion(TypedDict):
    """Conversion of a planar or floating joint's pose from A to B: `T_B = M T_A N` or `T_B = M T_A^-1 N`."""

    before: Annotated[TransformRows, doc("Matrix M (4, 4), multiplied from the left.")]
    behind: Annotated[TransformRows, doc("Matrix N (4, 4), multiplied from the right.")]
    back: Annotated[
        bool,
        doc(
            "Whether the formula is `T_B = M T_A^-1 N`. This is so if the joint's parent link in A matches"
            " its child link in B."
        ),
    ]


class CertifiedJoint(TypedDict):
    """Matching joints of A and B."""

    a: Annotated[str, doc("Name of the joint in A.")]
    b: Annotated[str, doc("Name of the joint in B.")]
    sense: Annotated[Literal[1, -1], doc("1 or -1; value in B = `sense` * (value in A) + `offset`.")]
    offset: Annotated[float, doc("Constant `offset`, rad or m.")]
    conversion: Annotated[
        CertifiedConversion | None,
        doc("Conversion of a planar or floating joint's pose from A to B; null without a conversion."),
    ]


class ToolEntry(TypedDict):
    """Two matching links that `same` reports as different tools."""

    a: Annotated[str, doc("Link of A.")]
    b: Annotated[str, doc("Link of B.")]
    pose: Annotated[TransformRows, doc("Pose of the link of B in the frame of the link of A.")]


class Rounding(TypedDict):
    """Largest distance and angle that `same` treats as rounding errors.

    Planar, floating and unlimited prismatic joints are assumed to travel at most 10 m.
    """

    metres: NonNegativeFloat
    radians: NonNegativeFloat


class FrameEntry(TypedDict):
    """Interval that contains the largest distance between two matching frames."""

    frame: Annotated[str, doc("Link of A.")]
    frame_b: Annotated[str, doc("Link of B.")]
    lower: Annotated[
        NonNegativeFloat,
        doc(
            "Lower bound of the largest distance, metres. It equals the computed distance at `q_a` and `q_b`,"
            " minus the largest rounding error."
        ),
    ]
    upper: Annotated[
        NonNegativeFloat | None,
        doc(
            "Proven upper bound of the distance, metres; null without a proof. The bound holds in all"
            " configurations within limits."
        ),
    ]
    radians: Annotated[
        NonNegativeFloat | None,
        doc(
            "Proven upper bound of the angle, radians; null without a proof. The bound holds in all"
            " configurations within limits."
        ),
    ]
    radians_seen: Annotated[
        NonNegativeFloat, doc("Angle between the orientations at `q_a` and `q_b`, radians.")
    ]
    q_a: Annotated[list[float], doc("Configuration of A; empty without a difference.")]
    q_b: Annotated[list[float], doc("Configuration of B that corresponds to `q_a`.")]


class Confirmed(TypedDict):
    """Pinocchio's confirmation of the bounds."""

    state: Annotated[ConfirmationState, doc("Whether the oracle confirmed the bounds.")]
    by: Annotated[str, doc("Name and version of the oracle; empty if the oracle did not check the bounds.")]
    configurations: Annotated[Count, doc("Number of configurations at which the oracle checked the bounds.")]
    metres: Annotated[NonNegativeFloat, doc("Largest distance that the oracle computed, metres.")]
    reason: Annotated[str, doc("Reason why the oracle computed no distances, or empty.")]


class SameCertificate(Header):
    """Certificate of a result of `same`."""

    a: CertifiedModel
    b: CertifiedModel
    up_to: Annotated[
        list[Literal["base", "zeros", "senses", "free joints", "tools"]],
        doc("Kinds of changes that bring B closest to A."),
    ]
    differences: Annotated[
        list[DifferenceEntry],
        doc(
            "Differences, in order from the base to the tips. The list ends with the joints of only one"
            " model, and the links after different moving joints in A and B."
        ),
    ]
    remarks: Annotated[
        list[DifferenceEntry],
        doc("Differences without effect on motion: limits, joint kinds, and links that only one model has."),
    ]
    joints: Annotated[list[CertifiedJoint], doc("Matched pairs of a joint of A and a joint of B.")]
    links: Annotated[list[Annotated[list[str], of_length(2)]], doc("Matched links: one of A and one of B.")]
    tools: Annotated[
        list[ToolEntry],
        doc(
            "Pairs of matched links that `same` treats as different tool frames. The pose between two tool"
            " frames is a change of B, not a difference."
        ),
    ]
    orders: Annotated[
        list[list[str]], doc("Consecutive joints of B whose order was changed, in the new order.")
    ]
    base: Annotated[TransformRows, doc("Pose of B's root link in A's root frame, in the zero configuration.")]
    base_links: Annotated[
        list[str], of_length(2), doc("Links of A and B that serve as reference frames of the poses.")
    ]
    rounding: Rounding
    frames: Annotated[
        list[FrameEntry],
        doc("For each pair of matched links: interval of the largest distance after the changes of B."),
    ]
    as_written: Annotated[
        FrameEntry | None,
        doc(
            "The frame with the largest distance between the unchanged models, and its interval. The entry is"
            " null if B needs no changes. It is also null without common frames."
        ),
    ]
    checked: Confirmed


#: The layout of the document.
SAME = DocumentKind(
    "urdfkin-same/1", SameCertificate, tuple(v.value for v in Verdict), "urdfkin same A B --certificate FILE"
)


def certificate(result: Sameness, command: str | None = None) -> SameCertificate:
    a, b = (
        {"name": name, "source": source} for name, source in zip(result.names, result.sources, strict=True)
    )
    document = {
        "schema": SAME.name,
        "versions": package_versions(),
        "sha256": result.digests,
        "verdict": result.verdict,
        "command": command,
        "a": a,
        "b": b,
        **{name: getattr(result, name) for name in _COPIED_ATTRIBUTES},
        "checked": result.confirmation,
        "rounding": dict(zip(("metres", "radians"), result.rounding, strict=True)),
    }
    return cast("SameCertificate", as_json_data(document))


#: The certificate copies these attributes of `Sameness`, under the same names.
_COPIED_ATTRIBUTES = (
    "up_to", "differences", "remarks", "joints", "links", "tools", "orders", "base", "base_links", "frames",
    "as_written",
)  # fmt: skip


def difference_text(entry: DifferenceEntry) -> str:
    a, b = (
        Mimic(**x) if isinstance(x, dict) else tuple(x) if isinstance(x, list) else x
        for x in (entry["a"], entry["b"])
    )
    size = entry["radians"], entry["metres"]
    return Difference(entry["place"], entry["what"], a, b, *size, entry["detail"]).words


def recheck(document: SameCertificate, a: Robot, b: Robot) -> list[str]:
    """Check a certificate against two models.

    `recheck` matches the joints as in the certificate. If the verdict is "differs", `recheck` compares the
    models a second time, and matches the joints like `same` without the argument `map`. The second verdict
    must also be "differs".

    Returns:
        A line for each statement that is wrong or not proven.

    Raises:
        InputError: the certificate was made for other models, or names an unknown joint or link.
    """
    for k, robot in enumerate((a, b)):
        if (claimed := document["sha256"][k : k + 1]) != [robot.sha256]:
            raise InputError(
                "the certificate belongs to another version of this robot",
                where=f"model {'AB'[k]}",
                found=f"SHA-256 {robot.sha256[:12]}..., not {str(*claimed)[:12]}...",
                remedy="compare the models again: urdfkin same A B",
            )
    joint_map = {one["a"]: one["b"] for one in document["joints"]}
    try:
        return list(_errors(document, Comparator((a, b), joint_map, bounds=True)))
    except UnknownNameError as error:
        raise InputError(
            "the certificate names a joint or link that one of the models does not have", found=str(error)
        ) from error


def _errors(document: SameCertificate, comparator: Comparator) -> Iterator[str]:
    choices = _read_choices(document)
    if (error := _choices_error(document, choices, comparator)) is not None:
        yield error
        return
    joint_map = {one["a"]: one["b"] for one in document["joints"]}
    comparator.merge_fixed_joints_except(joint_map)
    alignment = comparator.align(joint_map, choices)
    variables = variables_of(alignment, comparator.tolerance)
    result = comparator.result_without_bounds(alignment, variables)
    wrong = list(_statement_errors(document, comparator, result))
    yield from wrong
    claims = {(frame["frame"], frame["frame_b"]): frame for frame in document["frames"]}
    if len(claims) < len(document["frames"]):
        yield "`frames`: a frame has two intervals"
    search = comparator.search(alignment, variables)
    for frame, names in zip(alignment.frames, result.links, strict=True):
        if (claim := claims.pop(names, None)) is None:
            yield f"frame {names[0]} has no interval"
        else:
            yield from _interval_errors(search, frame, claim, result.rounding, use_branch_and_bound=not wrong)
    yield from (f"frame {names[0]} is not a common frame of the models" for names in claims)
    if document["verdict"] == Verdict.DIFFERS.value and not wrong:
        free = Comparator(comparator.robots, {}, bounds=True)
        other = free.alignment()
        better = free.result_without_bounds(other, variables_of(other, free.tolerance)).verdict
        if better is not Verdict.DIFFERS:
            yield f"`verdict`: another alignment of B with A gives {better.value}, not differs"
    if result.after:
        yield from _as_written_errors(
            document["as_written"], comparator, alignment, use_branch_and_bound=not wrong
        )
    elif document["as_written"] is not None:
        yield "`as_written`: B needs no changes, so this entry must be null"
    yield from _confirmation_errors(document["checked"], comparator, alignment, variables)


def _statement_errors(document: SameCertificate, comparator: Comparator, result: Sameness) -> Iterator[str]:
    models = document["a"], document["b"]
    for which, model, robot in zip("AB", models, comparator.robots, strict=True):
        if model["name"] != robot.name:
            yield f"model {which}: its name is {robot.name}, not {model['name']}"
    correct = certificate(result)
    expected = {(one["place"], one["what"]): one for one in correct["differences"]}
    claimed = {(one["place"], one["what"]): one for one in document["differences"]}
    for key, one in expected.items():
        if key not in claimed:
            yield f"`differences`: this difference is missing: {difference_text(one)}"
    for key, one in claimed.items():
        if key not in expected:
            yield f"`differences`: this is not a difference: {difference_text(one)}"
    if len(claimed) < len(document["differences"]):
        yield "`differences`: an entry is listed twice"
    for key, one in claimed.items():
        if key in expected and not _same_difference(one, expected[key], result.rounding):
            yield f"`differences`: the size or a value is wrong in: {difference_text(one)}"
    if not _equal(document["tools"], correct["tools"], max(result.rounding)):
        yield "`tools`: the models give different entries"
    if document["verdict"] != result.verdict.value:
        yield f"`verdict`: the models give {result.verdict.value}, not {document['verdict']}"
    # Rounding errors of the conversions' matrices grow with the distances between the joints.
    tolerance = max(comparator.tolerance.angle, comparator.tolerance.distance)
    yield from (
        f"`{name}`: the models give a different entry"
        for name in RECOMPUTED_ENTRIES
        if not _equal(
            dict(document)[name], dict(correct)[name], tolerance if name == "joints" else _ZERO_TOLERANCE
        )
    )


def _same_difference(
    claimed: DifferenceEntry, expected: DifferenceEntry, rounding: tuple[float, float]
) -> bool:
    return (
        all(_equal(claimed[part], expected[part]) for part in ("a", "b", "detail"))
        and _equal(claimed["metres"], expected["metres"], rounding[0])
        and _equal(claimed["radians"], expected["radians"], rounding[1])
    )


def _confirmation_errors(
    claimed: Confirmed, comparator: Comparator, alignment: Alignment, variables: Variables
) -> Iterator[str]:
    state, reason = claimed["state"], claimed["reason"]
    if state != "confirmed" and reason and claimed == as_json_data(Confirmation(state, reason=reason)):
        return
    known = claimed["by"].startswith(f"{PINOCCHIO.title} ")
    if state != "confirmed" or reason or claimed["configurations"] != CONFIRMATION_SAMPLES or not known:
        yield (
            f"`checked`: the entry must contain a confirmation at {CONFIRMATION_SAMPLES} configurations,"
            " or the reason why Pinocchio did not confirm the bounds"
        )
        return
    metres = float(comparator.pinocchio_distances(alignment, variables).max(initial=0.0))
    rounding = comparator.rounding(alignment, variables)[0]
    if not math.isclose(claimed["metres"], metres, rel_tol=_RELATIVE_TOLERANCE, abs_tol=rounding):
        yield f"`checked`: Pinocchio finds at most {metres:.2g} m, not {claimed['metres']:.2g} m"


def _read_choices(document: SameCertificate) -> AlignmentChoices:
    joints, base = document["joints"], document["base_links"]
    alone = {one["place"] for one in document["differences"] if one["detail"] == "alone"}
    return AlignmentChoices(
        (base[0], base[1]),
        np.array(document["base"]),
        {one["a"]: (one["sense"], one["offset"]) for one in joints},
        {
            one["a"]: FreeJointConversion(np.array(given["before"]), np.array(given["behind"]), given["back"])
            for one in joints
            if (given := one["conversion"]) is not None
        },
        tuple(tuple(names) for names in document["orders"]),
        {one["a"] for one in joints if f"joint {one['a']}" in alone},
    )


def _choices_error(
    document: SameCertificate, choices: AlignmentChoices, comparator: Comparator
) -> str | None:
    a, b = comparator.mechanisms
    for joint in document["joints"]:
        a.tree.joint_index(joint["a"])
        b.tree.joint_index(joint["b"])
    if not is_joint_pose(JointKind.FLOATING, choices.X):
        return "`base`: the matrix is not a rigid motion"
    for name, conversion in choices.conversions.items():
        if not conversion.holds_for(a.tree.joints[a.tree.joint_index(name)].kind):
            return f"joint {name}: its conversion is not possible for a joint of this kind"
    for names in choices.orders:
        if not b.allows_order(names, comparator.tolerance):
            order = ", ".join(names)
            return (
                f"`orders`: the order {order} is not possible: the joints are not consecutive, or the order"
                " changes the robot's motion"
            )
        b = b.reorder(names)
    return None


def _equal(claimed: Any, expected: Any, zero: float = _ZERO_TOLERANCE) -> bool:
    """Return whether two entries are equal up to rounding, with the absolute tolerance `zero`."""
    if isinstance(expected, dict):
        return (
            isinstance(claimed, dict)
            and claimed.keys() == expected.keys()
            and all(_equal(claimed[key], expected[key], zero) for key in expected)
        )
    if isinstance(expected, list):
        return (
            isinstance(claimed, list)
            and len(claimed) == len(expected)
            and all(_equal(*pair, zero) for pair in zip(claimed, expected, strict=True))
        )
    if isinstance(expected, float) and isinstance(claimed, float | int):
        return math.isclose(claimed, expected, rel_tol=_RELATIVE_TOLERANCE, abs_tol=zero)
    return bool(claimed == expected)


def _as_written_errors(
    claim: FrameEntry | None, comparator: Comparator, alignment: Alignment, *, use_branch_and_bound: bool
) -> Iterator[str]:
    written = comparator.align_as_written(alignment)
    if claim is None:
        if written.frames:
            yield "`as_written` is missing; it must contain the largest distance between the unchanged models"
        return
    variables = variables_of(written, comparator.tolerance)
    links = [tree.links for tree in comparator.trees]
    frames = {(links[0][frame.a], links[1][frame.b]): frame for frame in written.frames}
    if (frame := frames.get((claim["frame"], claim["frame_b"]))) is None:
        yield f"`as_written`: frame {claim['frame']} is not a common frame of the models"
        return
    search = comparator.search(written, variables, as_written=True)
    rounding = comparator.rounding(written, variables)
    distances = search.sample_distances(written.frames)[0].max(axis=0)
    if claim["upper"] is not None and distances.max() > claim["upper"] + rounding[0]:
        farthest = links[0][written.frames[int(distances.argmax())].a]
        yield f"`as_written`: frame {farthest} has a larger distance, {distances.max():.6g} m"
    problems = _interval_errors(search, frame, claim, rounding, use_branch_and_bound=use_branch_and_bound)
    yield from (f"`as_written`: {line}" for line in problems)


def _interval_errors(
    search: DistanceSearch,
    frame: FramePair,
    claim: FrameEntry,
    rounding: tuple[float, float],
    *,
    use_branch_and_bound: bool,
) -> Iterator[str]:
    """Yield an error for each wrong or unproven bound.

    `rounding` is the largest distance (m) and angle (rad) that rounding can cause.
    """
    problems = list[str]()
    if claim["lower"] > 0.0 or claim["radians_seen"] > 0.0:
        problems += _lower_bound_errors(search, frame, claim, rounding)
    yield from problems
    upper = math.inf if claim["upper"] is None else claim["upper"]
    upper_angle = math.inf if claim["radians"] is None else claim["radians"]
    if claim["lower"] > upper or claim["radians_seen"] > upper_angle:
        yield f"frame {claim['frame']}: a lower bound is larger than the upper bound"
    metres, radians = upper - rounding[0], upper_angle - rounding[1]
    for grid in (COARSE_GRID, FINE_GRID):
        proven = math.inf, math.inf
        if not search.unbounded:
            proven = upper_bounds(search.alignment, search.variables, frame, grid)
        if holds := _within(proven[0], metres, rounding[0]) and _within(proven[1], radians, rounding[1]):
            break
    if holds:
        return
    place = f"frame {claim['frame']}"
    if _within(proven[1], radians, rounding[1]):
        if problems or not use_branch_and_bound:
            return
        attained = max(claim["lower"], float(search.sample_distances([frame])[0].max()))
        if metres < attained - 2.0 * rounding[0]:
            yield f"{place}: its upper bound is wrong: {attained:.6g} m is attained"
            return
        if not search.unbounded:
            proven = tighten(search, frame, metres, proven[0], MAX_RECHECK_BOXES), proven[1]
        if _within(proven[0], metres, rounding[0]):
            return
    yield (
        f"{place}: its upper bound is not proven; the proven bounds are {proven[0]:.6g} m and"
        f" {proven[1]:.6g} rad"
    )


def _lower_bound_errors(
    search: DistanceSearch, frame: FramePair, claim: FrameEntry, rounding: tuple[float, float]
) -> Iterator[str]:
    place = f"frame {claim['frame']}"
    q_a, q_b = np.array([claim["q_a"]]), np.array([claim["q_b"]])
    if not search.correspond(q_a, q_b):
        yield f"{place}: `q_a` and `q_b` are not corresponding configurations, or a value exceeds a limit"
        return
    for computed, by in ((own_poses, "urdfkin"), (pinocchio_poses, "Pinocchio")):
        poses = search.poses_at(q_a, q_b, [frame], computed)
        radians, metres = pose_difference(*(T[0, 0] for T in poses))
        if metres < claim["lower"] - rounding[0]:
            yield f"{place}: {by} finds {metres:.6g} m at `q_a`, `q_b`, not {claim['lower']:.6g} m"
        if radians < claim["radians_seen"] - rounding[1]:
            yield (
                f"{place}: {by} finds {radians:.6g} rad at `q_a`, `q_b`, not {claim['radians_seen']:.6g} rad"
            )


def _within(proven: float, claimed: float, rounding: float) -> bool:
    return proven <= claimed + rounding + _BOUND_TOLERANCE * EPS * abs(claimed) or not math.isfinite(claimed)
