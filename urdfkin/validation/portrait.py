"""What a report tells about a robot besides its checks: its parts, what was found in its file, its tables.

Plain data from the start, so that it can come back from another process and go into JSON as it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from urdfkin.lint import Finding
from urdfkin.robot import Robot
from urdfkin.validation.chains import chains_of
from urdfkin.validation.description import describe
from urdfkin.verify.pinocchio import Oracle


@dataclass(frozen=True, slots=True)
class Portrait:
    """A robot for the reader of a report.

    Attributes:
        model: As `urdfkin.validation.description.describe` gives it; None if the robot could not be read.
        findings: As `Finding.as_dict` gives them.
        chains: Denavit-Hartenberg tables of its chains, both conventions each.
    """

    model: dict[str, Any] | None = None
    findings: tuple[dict[str, Any], ...] = ()
    chains: tuple[dict[str, Any], ...] = ()

    @classmethod
    def of(cls, robot: Robot, oracle: Oracle | None) -> Portrait:
        """The portrait of a robot that was loaded; its tables are checked where Pinocchio can."""
        return cls(describe(robot), as_data(robot.findings), chains_of(robot, oracle))

    @property
    def disagreements(self) -> tuple[str, ...]:
        """What is said of each chain whose tables lie outside their bound."""
        return tuple(said for chain in self.chains if (said := chain_disagreement(chain)) is not None)


def chain_disagreement(chain: Mapping[str, Any]) -> str | None:
    """How a chain's tables disagree with Pinocchio; None if they do not, or were not compared."""
    share = chain["share_of_bound"]
    if not chain["samples"] or (share is not None and share <= 1.0):
        return None
    how = "beyond all numbers" if share is None else f"{share:.3g} times the bound"
    off = "" if chain["metres"] is None else f", tip {chain['metres']:.2g} m off"
    return f"the Denavit-Hartenberg tables from {chain['base']} to {chain['tip']} disagree: {how}{off}"


#: Of a robot nothing is known about.
NO_PORTRAIT = Portrait()


def as_data(findings: Iterable[Finding]) -> tuple[dict[str, Any], ...]:
    """Findings as JSON has them."""
    return tuple(finding.as_dict() for finding in findings)
