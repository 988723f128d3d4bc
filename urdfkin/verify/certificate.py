"""A command that computes one case again.

What was checked, how closely it agreed, and what was not checked.
"""

from __future__ import annotations

import math
import os
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from urdfkin.compiled.plan import IntArray
from urdfkin.errors import UrdfkinError
from urdfkin.errors.display import Displayable, Table, TextDocument
from urdfkin.errors.escape import json_text, log_line
from urdfkin.model.tree import FloatArray
from urdfkin.system.files import at_home, write_file
from urdfkin.system.processes import lock_over_forks
from urdfkin.urdf.sources import Origin
from urdfkin.verify.bounds import Bound, result_k
from urdfkin.verify.comparison import worst_of_each
from urdfkin.verify.quantities import QUANTITIES


def replay_line(
    origin: Origin, command: str, frame: str, reference: str | None, values: Mapping[str, Sequence[float]]
) -> str:
    """The command; numbers are written so that they read back exactly.

    Args:
        origin: The robot; a text has to be given to the command on standard input.
        command: The quantity's command.
        frame: A link or joint.
        reference: None for a placement, which has none.
        values: Numbers of q, v and a, as many of the three as the command takes.

    >>> replay_line(Origin("ur5"), "velocity", "tool 0", "local", {"q": [0.5, 0.1], "v": []})
    "urdfkin velocity ur5 --frame 'tool 0' --reference local --q 0.5,0.1 --v neutral"
    """
    words = ["urdfkin", command, origin.words, "--frame", shlex.quote(frame)]
    if reference:
        words += ["--reference", reference]
    for letter, numbers in values.items():
        words += [f"--{letter}", ",".join(repr(float(x)) for x in numbers) or "neutral"]
    return " ".join(words)


#: The reason that certificates give for what nobody wanted checked.
NOT_ASKED_FOR = "verify=False was asked for"
#: One entry after the other, in all ledgers.
_entering = lock_over_forks()


class VerificationError(UrdfkinError):
    """urdfkin and its oracle disagree by more than rounding can explain: one of the two is wrong.

    Attributes:
        quantity: What was compared.
        frame: Of which frame.
        reference: In which reference; of an analytical Jacobian, in which representation.
        index: Position of the worst sample in the batch.
        ours: urdfkin's value of that sample.
        theirs: The oracle's.
        bound: What the two may differ by, number for number.
        units: The disagreement, in eps * scale.
        reproduce: A line that computes the case again.
    """

    is_disagreement = True

    def __init__(
        self,
        quantity: str,
        frame: str,
        reference: str,
        *,
        index: tuple[int, ...],
        ours: FloatArray,
        theirs: FloatArray,
        bound: FloatArray,
        units: float,
        reproduce: str,
        oracle: str = "Pinocchio",
    ) -> None:
        difference = float(np.abs(ours - theirs).max())
        super().__init__(
            f"the {quantity} of {frame} ({reference}) disagrees with {oracle}'s",
            where=f"sample {list(index)}" if index else None,
            found=f"a difference of {difference:.3g}, {units:.3g} eps*scale",
            remedy=f"reproduce it with: {reproduce}",
        )
        self.quantity, self.frame, self.reference, self.index = quantity, frame, reference, index
        self.ours, self.theirs, self.bound = ours, theirs, bound
        self.units, self.reproduce = units, reproduce


@dataclass(frozen=True, slots=True)
class Comparison:
    """One batch of results held against Pinocchio's.

    Attributes:
        results: How many results (matrices or six-vectors) were compared.
        worst: The largest disagreement, in eps * scale.
        share: The largest disagreement as a share of its bound; above 1 is a failure.
        index: Where the largest share is, in the results' leading axes.
    """

    results: int
    worst: float
    share: float
    index: tuple[int, ...]

    @classmethod
    def of_nothing(cls) -> Comparison:
        """No results, which agree."""
        return cls(0, 0.0, 0.0, ())

    def __add__(self, other: Comparison) -> Comparison:
        """Both together; the place is that of the larger share."""
        first, second = (self, other) if self.share >= other.share else (other, self)
        return Comparison(
            self.results + other.results,
            max(self.worst, other.worst),
            first.share,
            first.index or second.index,
        )

    @property
    def agrees(self) -> bool:
        """Whether every number lies within its bound."""
        return self.share <= 1.0


def compare(ours: FloatArray, theirs: FloatArray, bound: Bound, axes: int) -> Comparison:
    """Hold results against Pinocchio's.

    Args:
        ours: Results with `axes` leading axes; what is left is one result.
        theirs: The same from Pinocchio.
        bound: Scale and k, broadcastable against them.
        axes: How many leading axes count results.
    """
    units = worst_of_each(ours, theirs, bound.scale, axes)
    if not units.size:
        return Comparison.of_nothing()
    share = units / result_k(bound, units.shape)
    index = np.unravel_index(int(share.argmax()), share.shape)
    return Comparison(units.size, float(units.max()), float(share.max()), tuple(int(i) for i in index))


@dataclass(frozen=True, slots=True)
class Line:
    """A quantity's line in a certificate.

    Attributes:
        quantity: What was computed.
        checked: How many results the oracle confirmed.
        worst: The largest disagreement among them, in eps * scale.
        share: The same as a share of the bound.
        unchecked: How many results were handed out without a check.
    """

    quantity: str
    checked: int
    worst: float
    share: float
    unchecked: int


#: What its JSON begins with.
_HEAD = ("robot", "source", "reading", "sha256", "urdfkin", "oracle")


@dataclass(frozen=True, slots=True)
class Certificate(Displayable):
    """What a robot's results so far are worth.

    Attributes:
        robot: The robot's name.
        oracle: Who checked, and in which version: "Pinocchio 4.1.0".
        lines: One for each quantity that was computed.
        not_verified: Why results were not checked, in words; empty where all were.
        reading: Who vouches for the way from another format to the URDF that is checked; empty for a URDF.
        source: Where the robot came from.
        sha256: The digest of its URDF's text as UTF-8; of the MJCF file that it was made of.
        urdfkin: The version that computed.
    """

    robot: str
    oracle: str
    lines: tuple[Line, ...]
    not_verified: tuple[str, ...]
    reading: str = ""
    source: str = ""
    sha256: str = ""
    urdfkin: str = ""

    @property
    def verified(self) -> bool:
        """Whether results were handed out and every one of them was checked and found within its bound."""
        return any(line.checked for line in self.lines) and not any(
            line.unchecked or not line.share <= 1.0 for line in self.lines
        )

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON; a figure beyond all numbers is null."""
        lines = [asdict(line) for line in self.lines]
        for line in lines:
            line |= {key: None for key in ("worst", "share") if not math.isfinite(line[key])}
        return {
            "schema": "urdfkin-certificate/1",
            **{name: getattr(self, name) for name in _HEAD},
            "verified": self.verified,
            "lines": lines,
            "not_verified": list(self.not_verified),
        }

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it as JSON, whole or not at all.

        Raises:
            SourceError: no permission, no such folder, no room.
        """
        write_file(at_home(path), (json_text(self.as_dict()) + "\n").encode())

    def _sheet(self) -> TextDocument:
        heads = ("quantity", "checked", "not checked", "worst [eps*scale]", "of the bound")
        rows = [
            (x.quantity, str(x.checked), str(x.unchecked), f"{x.worst:.2g}", f"{x.share:.1%}")
            for x in self.lines
        ]
        word = "verified" if self.verified else "NOT verified"
        made = f"Computed by urdfkin {self.urdfkin} from {self.source} (sha256 {self.sha256})."
        reasons = [f"Not verified: {reason}." for reason in self.not_verified]
        read = [f"Read: {self.reading}."] if self.reading else []
        return TextDocument(
            f"{self.robot}: {word} by {self.oracle}",
            (Table(heads, rows), *reasons, *read, *([made] if self.sha256 else [])),
        )

    def __str__(self) -> str:
        head = f"{self.robot}, checked by {self.oracle}"
        if self.sha256:
            head += f", computed by urdfkin {self.urdfkin} from {self.source} (sha256 {self.sha256})"
        rows = [head] + [
            f"  {line.quantity}: {line.checked} checked, worst {line.worst:.2g} eps*scale"
            f" ({line.share:.1%} of the bound)"
            + (f", {line.unchecked} not checked" if line.unchecked else "")
            for line in self.lines
        ]
        rows += [f"  read: {self.reading}"] if self.reading else []
        rows += [f"  not verified: {reason}" for reason in self.not_verified]
        return "\n".join(map(log_line, rows))


@dataclass(slots=True)
class Account:
    """What a ledger holds of one quantity.

    Attributes:
        checked: What Pinocchio confirmed.
        unchecked: How many results it could not check, or was not asked to because of a sample.
        not_asked_for: How many results nobody wanted checked.
        counters: Arrays and places in them where others count more of these, each as it goes.
    """

    checked: Comparison = field(default_factory=Comparison.of_nothing)
    unchecked: int = 0
    not_asked_for: int = 0
    counters: list[tuple[IntArray, int]] = field(default_factory=list)

    @property
    def unwanted(self) -> int:
        """All results that nobody wanted checked."""
        return self.not_asked_for + sum(int(counts[place]) for counts, place in self.counters)

    def line(self, quantity: str) -> Line:
        """The same as a certificate has it."""
        found = self.checked
        return Line(quantity, found.results, found.worst, found.share, self.unchecked + self.unwanted)


@dataclass
class Ledger:
    """Counts what a robot hands out; safe to use from several threads."""

    _accounts: dict[str, Account] = field(default_factory=dict)
    _reasons: dict[str, None] = field(default_factory=dict)

    def account(self, quantity: str) -> Account:
        """A quantity's account, for those who count often."""
        with _entering:
            return self._accounts.setdefault(quantity, Account())

    def checked(self, quantity: str, comparison: Comparison) -> None:
        """Enter results that Pinocchio confirmed."""
        account = self.account(quantity)
        with _entering:
            account.checked += comparison

    def unchecked(self, quantity: str, results: int, reason: str | None = None) -> None:
        """Enter results that were handed out without a check, and why; None if nobody wanted one."""
        account = self.account(quantity)
        with _entering:
            if reason is None:
                account.not_asked_for += results
            else:
                account.unchecked += results
                self._reasons[reason] = None

    def certificate(self, robot: str, oracle: str) -> Certificate:
        """What stands in the ledger now."""
        with _entering:
            found = [
                (quantity, self._accounts[quantity]) for quantity in QUANTITIES if quantity in self._accounts
            ]
            reasons = [NOT_ASKED_FOR] if any(account.unwanted for _, account in found) else []
            lines = [account.line(quantity) for quantity, account in found]
            return Certificate(
                robot,
                oracle,
                tuple(line for line in lines if line.checked or line.unchecked),
                (*reasons, *self._reasons),
            )

    def __reduce__(self) -> tuple[type[Ledger], tuple[()]]:
        # A copy in another process starts its own account.
        return type(self), ()
