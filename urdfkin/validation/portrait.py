"""What a report tells about a robot besides its checks: its parts, what was found in its file, its tables.

Plain data from the start, so that it can come back from another process and go into JSON as it is.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from urdfkin.description import describe
from urdfkin.diagnostics import Finding
from urdfkin.oracle import Oracle
from urdfkin.robot import Robot
from urdfkin.validation.chains import chains_of


@dataclass(frozen=True, slots=True)
class Portrait:
    """A robot for the reader of a report.

    Attributes:
        model: As `urdfkin.description.describe` gives it; None if the robot could not be read.
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
    def chains_agree(self) -> bool:
        """Whether no table that was checked lies outside its bound."""
        return all((chain["share_of_bound"] or 0.0) <= 1.0 for chain in self.chains)


#: Of a robot nothing is known about.
NO_PORTRAIT = Portrait()


def as_data(findings: Iterable[Finding]) -> tuple[dict[str, Any], ...]:
    """Findings as JSON has them."""
    return tuple(finding.as_dict() for finding in findings)
