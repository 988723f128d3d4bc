"""Certificates (records of a robot's checked and unchecked results), and `VerificationError`."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Annotated, TypedDict, cast

import numpy as np

from urdfkin.compiled.plan import IntArray
from urdfkin.errors import UrdfkinError
from urdfkin.errors.display import Displayable, Table, TextDocument
from urdfkin.errors.escape import json_text, log_line
from urdfkin.errors.validators import as_path
from urdfkin.model.tree import FloatArray
from urdfkin.system.documents import Count, DocumentKind, Header, NonNegativeFloat, as_json_data, doc
from urdfkin.system.files import expand_home, write_file
from urdfkin.system.locks import make_fork_safe_lock
from urdfkin.verify.comparison import BatchComparison
from urdfkin.verify.oracles import package_versions
from urdfkin.verify.quantities import QUANTITIES

#: Reason why results of calls with verify=False are unchecked.
CHECK_DISABLED = "the check was turned off by verify=False"
_ledger_lock = make_fork_safe_lock()


class VerificationError(UrdfkinError):
    """The results of urdfkin and the oracle differ by more than rounding can explain.

    At least one of the two results is wrong.

    Attributes:
        quantity: Name of the quantity.
        frame: Name of the frame.
        reference: Name of the reference frame. For an analytical Jacobian or an orientation, `reference` is
            the representation of the rotation, such as "quaternion".
        index: Index of the worst sample in the batch.
        ours: urdfkin's result for the worst sample.
        theirs: The oracle's result for the worst sample.
        bound: Largest allowed difference of each number.
        units: Largest difference, in multiples of eps * scale. The scale of an orientation is 1.
        reproduce: Shell command or line of Python that computes the sample again.

    >>> import urdfkin
    >>> issubclass(urdfkin.VerificationError, urdfkin.UrdfkinError)
    True
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
            remedy=f"reproduce the difference with: {reproduce}",
        )
        self.quantity, self.frame, self.reference, self.index = quantity, frame, reference, index
        self.ours, self.theirs, self.bound = ours, theirs, bound
        self.units, self.reproduce = units, reproduce


@dataclass(frozen=True, slots=True)
class CertificateLine:
    """The line about one quantity in a certificate.

    Attributes:
        checked: Number of results that the oracle confirmed.
        worst: Largest difference, in multiples of eps * scale.
        bound_ratio: Largest ratio of a difference to its bound; above 1 after a `VerificationError`.
        unchecked: Number of results without a check.
    """

    quantity: str
    checked: int
    worst: float
    bound_ratio: float
    unchecked: int


class LineEntry(TypedDict):
    """The line about one quantity in the JSON file of a certificate."""

    quantity: Annotated[str, doc("Name of the quantity.")]
    checked: Annotated[Count, doc("Number of results that the oracle confirmed.")]
    worst: Annotated[
        NonNegativeFloat | None,
        doc(
            "Largest difference between a result and the oracle's result, in multiples of eps * scale;"
            " null: this multiple is not finite."
        ),
    ]
    bound_ratio: Annotated[
        NonNegativeFloat | None,
        doc("Largest ratio of a difference to its bound; null: the ratio is not finite."),
    ]
    unchecked: Annotated[Count, doc("Number of results that were returned without a check.")]


class CertificateDocument(Header):
    """A saved certificate as plain data: a robot's checked and unchecked results."""

    robot: Annotated[str, doc("The robot's name.")]
    source: Annotated[
        str, doc("Path, catalogue name, - for standard input, or a label such as <text> or <bytes>.")
    ]
    source_notes: Annotated[
        str,
        doc(
            "Notes about the conversion of the source to URDF, and about locked joints;"
            " empty for a URDF without locked joints."
        ),
    ]
    oracle: Annotated[str, doc("Name and version of the oracle.")]
    lines: Annotated[list[LineEntry], doc("One entry for each computed quantity.")]
    not_verified: Annotated[
        list[str], doc("Reasons why results were not checked; empty if every result was checked.")
    ]


CERTIFICATE = DocumentKind(
    "urdfkin-certificate/1",
    CertificateDocument,
    ("verified", "not verified"),
    "robot.certificate().save(FILE)",
)


@dataclass(frozen=True, slots=True)
class Certificate(Displayable):
    """The record of a robot's checked and unchecked results.

    Attributes:
        robot: The robot's name.
        oracle: Name and version of the oracle, such as "Pinocchio 4.1.0".
        lines: One line for each computed quantity.
        not_verified: Reasons why results were not checked; empty if every result was checked.
        source_notes: Notes about the conversion of the source to URDF, and about locked joints. A URDF
            without locked joints has no notes.
        source: Source of the robot: a path, a catalogue name, "-" for standard input, or a label such as
            "<text>".
        sha256: SHA-256 digest of the MJCF or USD file, or of the URDF text in UTF-8.
        urdfkin: Version of urdfkin.

    >>> import urdfkin
    >>> arm = urdfkin.load("planar_two_link")
    >>> J = arm.jacobian([0.0, 0.0], "tip")
    >>> arm.certificate().lines[0].quantity, arm.certificate().verified
    ('jacobian', True)
    """

    robot: str
    oracle: str
    lines: tuple[CertificateLine, ...]
    not_verified: tuple[str, ...]
    source_notes: str = ""
    source: str = ""
    sha256: str = ""
    urdfkin: str = ""

    @property
    def verified(self) -> bool:
        """True if results exist, and all are checked and within their bounds.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> J = arm.jacobian([0.0, 0.0], "tip")
        >>> arm.certificate().verified
        True
        """
        return any(line.checked for line in self.lines) and not any(
            line.unchecked or not line.bound_ratio <= 1.0 for line in self.lines
        )

    def as_dict(self) -> CertificateDocument:
        """Return the certificate as plain data for JSON.

        A number that is not finite becomes null.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> J = arm.jacobian([0.0, 0.0], "tip")
        >>> arm.certificate().as_dict()["lines"][0]["quantity"]
        'jacobian'
        """
        document = {
            "schema": CERTIFICATE.name,
            "versions": package_versions() | ({"urdfkin": self.urdfkin} if self.urdfkin else {}),
            "sha256": [self.sha256 or None],
            "verdict": CERTIFICATE.verdicts[not self.verified],
            "command": None,
            **{name: getattr(self, name) for name in ("robot", "source", "source_notes", "oracle")},
            "lines": self.lines,
            "not_verified": self.not_verified,
        }
        return cast("CertificateDocument", as_json_data(document))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the certificate as JSON.

        After an error, no partial file remains.

        Raises:
            SourceError: the folder does not exist, or the file cannot be written.

        >>> import urdfkin
        >>> arm = urdfkin.load("planar_two_link")
        >>> J = arm.jacobian([0.0, 0.0], "tip")
        >>> import tempfile
        >>> from pathlib import Path
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = Path(folder) / "certificate.json"
        ...     arm.certificate().save(path)
        ...     path.exists()
        True
        """
        write_file(expand_home(as_path(path, "path")), (json_text(self.as_dict()) + "\n").encode())

    def _text_document(self) -> TextDocument:
        heads = ("quantity", "checked", "not checked", "worst [eps*scale]", "of the bound")
        rows = [
            (x.quantity, str(x.checked), str(x.unchecked), f"{x.worst:.2g}", f"{x.bound_ratio:.1%}")
            for x in self.lines
        ]
        word = "verified" if self.verified else "NOT verified"
        parts: list[str | Table] = [
            Table(heads, rows),
            *(f"Not verified: {reason}." for reason in self.not_verified),
            *([f"Read: {self.source_notes}."] if self.source_notes else []),
        ]
        if self.sha256:
            parts.append(f"Computed by urdfkin {self.urdfkin} from {self.source} (sha256 {self.sha256}).")
        return TextDocument(f"{self.robot}: {word} by {self.oracle}", parts)

    def __str__(self) -> str:
        head = f"{self.robot}, checked by {self.oracle}"
        if self.sha256:
            head += f", computed by urdfkin {self.urdfkin} from {self.source} (sha256 {self.sha256})"
        rows = [head] + [
            f"  {line.quantity}: {line.checked} checked, worst {line.worst:.2g} eps*scale"
            f" ({line.bound_ratio:.1%} of the bound)"
            + (f", {line.unchecked} not checked" if line.unchecked else "")
            for line in self.lines
        ]
        rows += [f"  read: {self.source_notes}"] if self.source_notes else []
        rows += [f"  not verified: {reason}" for reason in self.not_verified]
        return "\n".join(map(log_line, rows))


@dataclass(slots=True)
class Account:
    """Counts the results of one quantity.

    Attributes:
        unchecked: Number of unchecked results of calls that check only a sample of their results.
        disabled_checks: Results of calls with verify=False.
        counters: One pair (array, index) for each prepared function with verify=False. The function counts
            its results in `array[index]`.
    """

    checked: BatchComparison = field(default_factory=BatchComparison)
    unchecked: int = 0
    disabled_checks: int = 0
    counters: list[tuple[IntArray, int]] = field(default_factory=list)

    def line(self, quantity: str) -> CertificateLine:
        found = self.checked
        unchecked = self.unchecked + self.count_disabled_checks()
        return CertificateLine(quantity, found.result_count, found.worst, found.bound_ratio, unchecked)

    def count_disabled_checks(self) -> int:
        return self.disabled_checks + sum(int(counts[index]) for counts, index in self.counters)


@dataclass
class Ledger:
    """Counts a robot's checked and unchecked results. Several threads may use a ledger at once."""

    _accounts: dict[str, Account] = field(default_factory=dict)
    _reasons: dict[str, None] = field(default_factory=dict)

    def account(self, quantity: str) -> Account:
        if (known := self._accounts.get(quantity)) is not None:
            return known
        with _ledger_lock:
            return self._accounts.setdefault(quantity, Account())

    def count_checked(self, quantity: str, comparison: BatchComparison) -> None:
        account = self.account(quantity)
        with _ledger_lock:
            account.checked += comparison

    def count_unchecked(self, quantity: str, results: int, reason: str | None = None) -> None:
        """Count unchecked results. `reason` is None for calls with verify=False."""
        account = self.account(quantity)
        with _ledger_lock:
            if reason is None:
                account.disabled_checks += results
            else:
                account.unchecked += results
                self._reasons[reason] = None

    def certificate(self, robot: str, oracle: str) -> Certificate:
        with _ledger_lock:
            accounts = {name: self._accounts[name] for name in QUANTITIES if name in self._accounts}
            has_disabled_checks = any(account.count_disabled_checks() for account in accounts.values())
            reasons = (*([CHECK_DISABLED] if has_disabled_checks else []), *self._reasons)
            lines = [account.line(name) for name, account in accounts.items()]
            known = (x for x in lines if x.checked or x.unchecked or not x.bound_ratio <= 1.0)
            return Certificate(robot, oracle, tuple(known), reasons)

    def __reduce__(self) -> tuple[type[Ledger], tuple[()]]:
        # The counts of a copy begin at 0, because the copy may be used in another process.
        return type(self), ()
