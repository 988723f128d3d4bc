"""Whether a report's robot is one: a tree of links and joints, numbered as its coordinates say."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from urdfkin.report.document import Chain, Joint, Model

#: Coordinates and rates of each kind of joint.
_SIZES = {"fixed": (0, 0), "planar": (3, 3), "floating": (7, 6)}
_ONE = (1, 1)
_WITH_AXIS = ("revolute", "continuous", "prismatic")
#: How far a rotation or an axis may be from one: text of 6 digits was read.
_ROUNDED = 1e-5


def frame_names(model: Model) -> list[str]:
    """What was compared: every link, then every joint."""
    return [f"link:{name}" for name in model["links"]] + [f"joint:{j['name']}" for j in model["joints"]]


def moving_names(model: Model) -> list[str]:
    """The joints that move, followers too."""
    return [joint["name"] for joint in model["joints"] if joint["kind"] != "fixed"]


def column_names(model: Model) -> list[str]:
    """For each rate of every joint, followers too, the joint's name."""
    return [joint["name"] for joint in model["joints"] for _ in range(_size(joint)[1])]


def _size(joint: Joint) -> tuple[int, int]:
    return _SIZES.get(joint["kind"], _ONE)


def model_contradictions(model: Model, chains: Sequence[Chain]) -> Iterator[str]:
    """What a robot and its chains say against themselves."""
    links, joints = model["links"], model["joints"]
    names = [joint["name"] for joint in joints]
    if len(set(links)) != len(links) or len(set(names)) != len(names):
        yield "model: a name is there twice"
        return
    if links[1:] != [joint["child"] for joint in joints] or not links:
        yield "model: its links are not the root and the joints' children"
        return
    for i, joint in enumerate(joints):
        if joint["parent"] not in links[: i + 1]:
            yield f"model: joint {joint['name']}: parent {joint['parent']} does not stand before it"
        yield from _joint(joint, joints)
    yield from _numbering(model)
    frames = {*links, *names, *frame_names(model)}
    ends = [model["base"], model["tip"], *(end for chain in chains for end in (chain["base"], chain["tip"]))]
    yield from (f"model: there is no frame {end}" for end in ends if end not in frames)
    kinds = {joint["name"]: joint["kind"] for joint in joints}
    for chain in chains:
        for row in (*chain["standard"]["rows"], *chain["modified"]["rows"]):
            if kinds.get(row["joint"]) != row["kind"]:
                yield f"tables from {chain['base']} to {chain['tip']}: no {row['kind']} joint {row['joint']}"


def _joint(joint: Joint, joints: Sequence[Joint]) -> Iterator[str]:
    where, axis, mimic = f"model: joint {joint['name']}", joint["axis"], joint["mimic"]
    if (axis is not None) != (joint["kind"] in _WITH_AXIS):
        yield f"{where}: a {joint['kind']} joint {'with' if axis else 'without'} an axis"
    elif axis is not None and abs(math.hypot(*axis) - 1.0) > _ROUNDED:
        yield f"{where}: axis {axis} is not of length 1"
    rows = joint["placement"]
    R = [row[:3] for row in rows[:3]]
    dots = [sum(a * b for a, b in zip(R[i], R[j], strict=True)) - (i == j) for i, j in _PAIRS]
    if rows[3] != [0.0, 0.0, 0.0, 1.0] or max(map(abs, dots)) > _ROUNDED:
        yield f"{where}: its placement is none"
    if mimic is not None:
        leader = next((other for other in joints if other["name"] == mimic["leader"]), None)
        if leader is None or leader["mimic"] is not None or _size(leader) != _ONE or _size(joint) != _ONE:
            yield f"{where}: it cannot follow {mimic['leader']}"


_PAIRS = [(i, j) for i in range(3) for j in range(i + 1)]


def _numbering(model: Model) -> Iterator[str]:
    """Coordinates and rates are numbered joint by joint; followers have their leaders'."""
    q, v, places = 0, 0, dict[str, tuple[int | None, int | None]]()
    for joint in model["joints"]:
        if joint["mimic"] is None:
            nq, nv = _size(joint)
            places[joint["name"]] = (q, v) if nq else (None, None)
            q, v = q + nq, v + nv
    for joint in model["joints"]:
        owner = joint["mimic"]["leader"] if joint["mimic"] else joint["name"]
        if places.get(owner) != (joint["q"], joint["v"]):
            yield f"model: joint {joint['name']}: its coordinates begin elsewhere"
    if (model["nq"], model["nv"]) != (q, v) or (len(model["coordinates"]), len(model["rates"])) != (q, v):
        yield f"model: not the {q} coordinates and {v} rates of its joints"
