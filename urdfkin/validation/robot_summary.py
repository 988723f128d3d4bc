"""Summary of a robot for the validation report.

`urdfkin info --format json` prints only the result of `describe`. The summary has the links and joints, the
findings in the file, Denavit-Hartenberg tables, and a comparison with yourdfpy. The summary is plain data,
which can be sent between processes and written as JSON.

The chains of a catalogue robot are the limbs in the catalogue. For other robots, the chains are the paths
from the base to the leaves. If several paths have the same moving joints, only one of them is a chain.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from urdfkin.dh import DHTable
from urdfkin.dh.make import make_dh_table
from urdfkin.errors import InputError
from urdfkin.model.configuration import RangeReduction, draw_samples, range_reductions
from urdfkin.robot import Robot
from urdfkin.system.documents import as_json_data
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.lint import Finding
from urdfkin.validation.document import Chain, ReportedDHRow, ReportedModel, ReportedSecondReading
from urdfkin.validation.document import ReportedFinding as FindingEntry
from urdfkin.verify.oracle import Oracle
from urdfkin.verify.second_reader import compare_with_yourdfpy
from urdfkin.verify.tables import check_table


def describe(robot: Robot) -> ReportedModel:
    """Return plain data for JSON: coordinates, frames, and every joint with its placement, axis and limits.

    >>> import urdfkin
    >>> data = describe(urdfkin.load("ur5"))
    >>> data["nq"], {joint["kind"] for joint in data["joints"]} == {"fixed", "revolute"}
    (6, True)
    """
    tree = robot.tree
    reductions = {one.joint: one for one in range_reductions(tree)}
    data = {
        "name": robot.name,
        "source": robot.source,
        "path": robot.path,
        "sha256": robot.sha256,
        "mimic": robot.origin.mimic if robot.verifier.mimic else False,
        "root_joint": robot.root_joint,
        "nq": robot.nq,
        "nv": robot.nv,
        "base": robot.base_frame,
        "tip": robot.tip_frame,
        "coordinates": robot.coordinate_names,
        "rates": robot.velocity_names,
        "frames": robot.frame_names,
        "links": robot.link_names,
        "joints": [_describe_joint(robot, i, reductions) for i in range(len(tree.joints))],
    }
    return cast("ReportedModel", as_json_data(data))


def _describe_joint(robot: Robot, i: int, reductions: dict[str, RangeReduction]) -> dict[str, Any]:
    tree = robot.tree
    joint = tree.joints[i]
    return {
        "name": joint.name,
        "kind": joint.kind,
        "parent": tree.links[joint.parent],
        "child": tree.links[i + 1],
        "placement": joint.T_parent_joint,
        "axis": joint.axis if joint.kind.has_axis else None,
        "q": tree.q_index[i] if joint.kind.nq else None,
        "v": tree.v_index[i] if joint.kind.nv else None,
        "limit": joint.limit,
        "mimic": joint.mimic,
        "remaining_range": _remaining_range(reductions.get(joint.name)),
        **({} if joint.lock is None else {"locked": joint.lock.value}),
    }


def _remaining_range(reduction: RangeReduction | None) -> dict[str, Any] | None:
    """Return the range of a mimicked joint within the limits of its mimic joints.

    The result is None if the joint keeps its whole range. The ends are None if the limits allow at most one
    value.
    """
    if reduction is None:
        return None
    lower, upper = reduction.allowed_range or (None, None)
    return {"lower": lower, "upper": upper, "by": reduction.mimic_joints}


MAX_CHAINS = 12
_SAMPLES = 10
_CONVENTIONS = ("standard", "modified")


def make_chains(robot: Robot, oracle: Oracle | None) -> tuple[Chain, ...]:
    """Return the chains and their DH tables, as plain data.

    Without an oracle, the tables are not checked.
    """
    found = []
    for limb, base, tip in _find_chains(robot):
        try:
            tables = {name: make_dh_table(robot.tree, tip, base, name) for name in _CONVENTIONS}
        except InputError:
            continue  # Denavit-Hartenberg tables contain no planar or floating joints.
        if any(table.rows for table in tables.values()):
            found.append({"limb": limb, "base": base, "tip": tip} | _describe_tables(robot, oracle, tables))
    return tuple(as_json_data(found))


def _find_chains(robot: Robot) -> Iterator[tuple[str | None, str, str]]:
    entry = catalogue().get(robot.source)
    if entry is not None and entry.limbs:
        yield from ((limb, base, tip) for limb, (base, tip) in entry.limbs.items())
        return
    tree, seen = robot.tree, set[tuple[int, ...]]()
    for leaf in sorted(tree.leaves(), key=lambda leaf: tree.links[leaf] != robot.tip_frame):
        moving = tuple(i for i in tree.path(leaf) if tree.joints[i].kind.nv)
        if moving and moving not in seen and len(seen) < MAX_CHAINS:
            seen.add(moving)
            yield None, robot.base_frame, tree.link_frames[leaf]


def _describe_tables(robot: Robot, oracle: Oracle | None, tables: dict[str, DHTable]) -> dict[str, Any]:
    data: dict[str, Any] = {
        name: {
            "rows": [
                {entry: getattr(row, entry) for entry in ReportedDHRow.__annotations__} for row in table.rows
            ],
            "base": table.base,
            "tool": table.tool,
        }
        for name, table in tables.items()
    }
    if oracle is None:
        return data | {"samples": 0, "metres": None, "worst": None, "bound_ratio": None}
    samples = draw_samples(robot.tree, _SAMPLES, np.random.default_rng(0), with_zero_and_limits=True)
    checks = [check_table(oracle, robot.tree, table, samples) for table in tables.values()]
    return data | {
        "samples": checks[0].samples,
        "metres": max(check.metres for check in checks),
        "worst": max(units for check in checks for units in check.units.values()),
        "bound_ratio": max(ratio for check in checks for ratio in check.bound_ratios.values()),
    }


@dataclass(frozen=True, slots=True)
class RobotSummary:
    """Summary of a robot in a report; `model` is None if the robot could not be read."""

    model: ReportedModel | None = None
    findings: tuple[FindingEntry, ...] = ()
    chains: tuple[Chain, ...] = ()
    second_reader: ReportedSecondReading | None = None

    @classmethod
    def of(cls, robot: Robot, oracle: Oracle | None) -> RobotSummary:
        mimic, has_root_joint = robot.verifier.mimic, robot.root_joint is not None
        reading = as_json_data(
            compare_with_yourdfpy(robot.urdf, robot.tree, mimic=mimic, root_joint=has_root_joint)
        )
        return cls(describe(robot), make_finding_entries(robot.findings), make_chains(robot, oracle), reading)

    @property
    def disagreements(self) -> tuple[str, ...]:
        found = [text for chain in self.chains if (text := chain_disagreement(chain)) is not None]
        if self.second_reader and (text := reader_disagreement(self.second_reader)) is not None:
            found.append(text)
        return tuple(found)


def chain_disagreement(chain: Chain) -> str | None:
    bound_ratio = chain["bound_ratio"]
    if not chain["samples"] or (bound_ratio is not None and bound_ratio <= 1.0):
        return None
    how = "by an infinite amount" if bound_ratio is None else f"{bound_ratio:.3g} times the bound"
    off = "" if chain["metres"] is None else f", tip {chain['metres']:.2g} m off"
    return (
        f"the Denavit-Hartenberg tables from {chain['base']} to {chain['tip']} disagree with"
        f" Pinocchio: {how}{off}"
    )


def reader_disagreement(reading: ReportedSecondReading) -> str | None:
    if not reading["differences"]:
        return None
    return f"{reading['by']} reads another robot from the file: {'; '.join(reading['differences'])}"


EMPTY_SUMMARY = RobotSummary()


def make_finding_entries(findings: Iterable[Finding]) -> tuple[FindingEntry, ...]:
    return tuple(cast("FindingEntry", finding.as_dict()) for finding in findings)
