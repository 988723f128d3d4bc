"""What the 3D view of a robot needs, as small as it can be: links, joints, chains with their tables.

The numbers are for the eye: seven digits. Everything that is computed with stands in the JSON document.
"""

from __future__ import annotations

from typing import Any

from urdfkin.report.document import Chain, Model, Table

_KINDS = ("fixed", "revolute", "continuous", "prismatic", "planar", "floating")


def scene(model: Model, chains: list[Chain]) -> dict[str, Any]:
    """A robot for the page's script, `assets/view3d.js`.

    Returns:
        `links`: names. `joints`: one list each of name, kind's index, parent link, child link, pose in the
        parent (three rows of four), axis or 0, place in q or -1, lower, upper (None: no bound), mimic
        (leader's place in q, multiplier, offset) or 0. `chains`: base link, tip link, two tables.
    """
    links = {name: i for i, name in enumerate(model["links"])}
    joints = {joint["name"]: i for i, joint in enumerate(model["joints"])}
    return {
        "links": model["links"],
        "nq": model["nq"],
        "joints": [_joint(model, i, links) for i in range(len(model["joints"]))],
        "tip": _link(model["tip"], links, joints),
        "chains": [
            {
                "base": _link(chain["base"], links, joints),
                "tip": _link(chain["tip"], links, joints),
                "standard": _table(chain["standard"], joints),
                "modified": _table(chain["modified"], joints),
            }
            for chain in chains
        ],
    }


def _joint(model: Model, i: int, links: dict[str, int]) -> list[Any]:
    joint = model["joints"][i]
    limit, mimic = joint["limit"], joint["mimic"]
    return [
        joint["name"],
        _KINDS.index(joint["kind"]),
        links[joint["parent"]],
        links[joint["child"]],
        [_short(x) for row in joint["placement"][:3] for x in row],
        [_short(x) for x in joint["axis"]] if joint["axis"] else 0,
        -1 if joint["q"] is None else joint["q"],
        None if limit is None or limit["lower"] is None else _short(limit["lower"]),
        None if limit is None or limit["upper"] is None else _short(limit["upper"]),
        [joint["q"], mimic["multiplier"], mimic["offset"]] if mimic else 0,
    ]


def _table(table: Table, joints: dict[str, int]) -> dict[str, Any]:
    return {
        "base": [_short(x) for row in table["base"][:3] for x in row],
        "tool": [_short(x) for row in table["tool"][:3] for x in row],
        "rows": [
            [
                joints[row["joint"]],
                *(_short(row[key]) for key in ("a", "alpha", "beta", "d", "theta")),
                row["sense"],
            ]
            for row in table["rows"]
        ],
    }


def _link(frame: str, links: dict[str, int], joints: dict[str, int]) -> int:
    """The link that carries a frame."""
    kind, _, rest = frame.partition(":")
    if kind in ("link", "joint") and (rest in links or rest in joints):
        frame = rest
    return links[frame] if frame in links else joints[frame] + 1


def _short(value: float) -> float | int:
    rounded = float(f"{value:.7g}")
    return int(rounded) if rounded == int(rounded) else rounded
