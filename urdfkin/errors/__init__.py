"""Exceptions of urdfkin.

A message states the problem, the place, the wrong value and the remedy. The exception has an attribute for
each part of the message.
"""

from __future__ import annotations

import difflib
import heapq
import sys
import warnings
from collections.abc import Callable, Iterable
from enum import Enum
from typing import Any, Self, TypeVar

from urdfkin.errors.escape import log_line

#: `find_similar_names` compares at most this number of characters at the start of a name.
_COMPARED_PREFIX_LENGTH = 128
MAX_CHARACTER_PAIRS = 1_000_000
_MAX_SUGGESTIONS = 3


def find_similar_names(
    word: str, valid_names: Iterable[str], *, cutoff: float = 0.6, work: int = MAX_CHARACTER_PAIRS
) -> list[str]:
    """Return up to three known names that are similar to `word`, the most similar first.

    The comparison ignores case and uses only the first 128 characters of a name. A returned name has at least
    the similarity `cutoff`, from 0 to 1, as in `difflib.get_close_matches`. The search compares at most
    `work` pairs of characters.

    >>> find_similar_names("pandahand", ["panda_hand", "elbow", "base"])
    ['panda_hand']
    >>> find_similar_names("UR5", ["ur5", "panda"])
    ['ur5']
    """
    prefix = word[:_COMPARED_PREFIX_LENGTH].lower()
    matcher = difflib.SequenceMatcher(b=prefix)
    found = []
    for name in valid_names:
        matcher.set_seq1(name[:_COMPARED_PREFIX_LENGTH].lower())
        if matcher.real_quick_ratio() < cutoff or matcher.quick_ratio() < cutoff:
            continue
        work -= len(prefix) * len(name[:_COMPARED_PREFIX_LENGTH])
        if work < 0:
            break
        if (similarity := matcher.ratio()) >= cutoff:
            found.append((similarity, name))
    return [name for _, name in heapq.nlargest(_MAX_SUGGESTIONS, found)]


class QuestionsSection(Enum):
    """A section of docs/questions.md. `str` returns the command that prints the section.

    >>> print(QuestionsSection.MIMIC_JOINTS)
    see `urdfkin explain mimic-joints`
    """

    REFERENCE_FRAMES = "reference-frames"
    TWO_ACCELERATIONS = "two-accelerations"
    JOINT_ORDER = "joint-order"
    CONTINUOUS_JOINTS = "continuous-joints"
    MIMIC_JOINTS = "mimic-joints"
    PACKAGES_AND_MESHES = "packages-and-meshes"
    URDF_TO_DH = "urdf-to-dh"
    WHICH_DH_CONVENTION = "which-dh-convention"
    DH_AND_URDF_DISAGREE = "dh-and-urdf-disagree"
    UNKNOWN_FRAMES = "unknown-frames"
    ROW_ORDER = "row-order"
    FIXED_JOINTS = "fixed-joints"
    WRONG_PINOCCHIO = "the-wrong-pinocchio"
    AXES = "axes-that-are-not-unit-vectors"
    XACRO = "xacro-without-ros"
    GRAVITY = "gravity-in-an-acceleration"
    FLOATING_BASES = "floating-bases"
    LOCKED_JOINTS = "locked-joints"
    DEGREES = "degrees"
    SINGULARITY = "singularity"

    def __str__(self) -> str:
        return f"see `urdfkin explain {self.value}`"


class DegreesWarning(UserWarning):
    """Values of q look like degrees, but urdfkin expects radians.

    >>> import urdfkin
    >>> issubclass(urdfkin.DegreesWarning, UserWarning)
    True
    """


def warn_caller(message: str, category: type[Warning]) -> None:
    """Issue a warning for the line outside urdfkin that called urdfkin."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and str(frame.f_globals.get("__name__")).startswith("urdfkin."):
        level, frame = level + 1, frame.f_back
    warnings.warn(message, category, stacklevel=level)


_E = TypeVar("_E", bound="UrdfkinError")


class UrdfkinError(Exception):
    """Base class of all exceptions that urdfkin raises intentionally.

    Attributes:
        what: The problem without a full stop, such as "a length is negative".
        where: Place of the problem: a line of a file, a frame or a sample. None means unknown.
        found: The wrong value, or a description of it, such as "shape (1,)".
        remedy: Instruction for the user.
        question: Section of docs/questions.md. The message ends with the command that prints the section.
        is_disagreement: True if urdfkin and Pinocchio disagree; False if the input is wrong.

    >>> error = UrdfkinError("a length is negative", where="arm.urdf:3", found="-1", remedy="remove the sign")
    >>> print(error)
    arm.urdf:3: a length is negative: found -1; remove the sign
    """

    is_disagreement = False

    def __init__(
        self,
        what: str,
        *,
        where: str | None = None,
        found: str | None = None,
        remedy: str | None = None,
        question: QuestionsSection | None = None,
    ) -> None:
        super().__init__(what)
        self.what = what
        self.where = where
        self.found = found
        self.remedy = remedy
        self.question = question

    def __str__(self) -> str:
        place = f"{self.where}: " if self.where else ""
        found = f": found {self.found}" if self.found else ""
        remedy = f"; {self.remedy}" if self.remedy else ""
        apart = " " if remedy.endswith("?") else "; "
        question = f"{apart}{self.question}" if self.question else ""
        # A name from a file must not add lines or terminal commands to the message.
        return log_line(f"{place}{self.what}{found}{remedy}{question}")

    def __reduce__(self) -> tuple[Callable[..., Self], tuple[Any, ...]]:
        # `validate --jobs` pickles errors, and Python's own `__reduce__` loses keyword arguments.
        return _unpickle_error, (type(self), self.__dict__)


def _unpickle_error(cls: type[_E], state: dict[str, Any]) -> _E:
    error = cls.__new__(cls, state["what"])
    error.args = (state["what"],)
    error.__dict__.update(state)
    return error


class InputError(UrdfkinError, ValueError):
    """An argument is invalid, for example a wrong length, an infinite value or a non-orthogonal rotation.

    >>> import urdfkin
    >>> arm = urdfkin.load("planar_two_link")
    >>> try:
    ...     T = arm.placement([0.0])
    ... except urdfkin.InputError as error:
    ...     print(error.found)
    shape (1,)
    """


class NotFiniteError(InputError):
    """A coordinate, joint velocity or joint acceleration is infinite or NaN."""


class RangeError(InputError):
    """A result is too large for double precision."""


class UnknownNameError(UrdfkinError, LookupError):
    """A name does not exist.

    The message suggests similar existing names. If no name is similar, the message lists up to six names.

    Attributes:
        name: The unknown name.
        nearest: Up to three similar existing names.

    >>> import urdfkin
    >>> arm = urdfkin.load("planar_two_link")
    >>> try:
    ...     T = arm.placement([0.0, 0.0], "tipp")
    ... except urdfkin.UnknownNameError as error:
    ...     print(error.nearest)
    ('tip',)
    """

    def __init__(
        self,
        kind: str,
        name: str,
        valid_names: Iterable[str],
        *,
        where: str | None = None,
        question: QuestionsSection | None = None,
    ) -> None:
        names = sorted(set(valid_names))
        close = find_similar_names(name, names, cutoff=0.5)
        if close:
            remedy = f"did you mean {', '.join(close)}?"
        elif names:
            count = "is 1" if len(names) == 1 else f"are {len(names)}"
            remedy = f"there {count}: {', '.join(names[:6])}{', ...' if len(names) > 6 else ''}"
        else:
            remedy = "there are none"
        super().__init__(f"unknown {kind} {name!r}", where=where, remedy=remedy, question=question)
        self.name = name
        self.nearest = tuple(close)


class OracleError(UrdfkinError):
    """Pinocchio rejects a robot, or parses a different robot from the same text."""


class InstallationError(UrdfkinError, ImportError):
    """A required library is missing, or a different library of the same name is installed."""


class SourceError(UrdfkinError, OSError):
    """A file cannot be read or written.

    >>> import urdfkin
    >>> try:
    ...     robot = urdfkin.load("missing/arm.urdf")
    ... except urdfkin.SourceError as error:
    ...     print(error.where)
    missing/arm.urdf
    """


class RepresentationSingularityError(InputError):
    """Euler angles are too near to their representational singularity (7.56).

    At the singularity, some angular velocities correspond to no derivatives of the angles.

    Attributes:
        sequence: The sequence of the Euler angles, as in the message.
        distance: Distance (rad) of the middle angle from its value at the singularity.
        sample: Index of the worst sample of a batch, or () for a single sample.
    """

    def __init__(self, sequence: str, distance: float, sample: tuple[int, ...]) -> None:
        super().__init__(
            f"the Euler angles {sequence} are too near to their representational singularity, where some "
            "angular velocities correspond to no angle rates",
            where=f"sample {list(sample)}" if sample else None,
            found=f"a middle angle {distance:.3g} rad from the singularity",
            remedy="describe the orientation by another sequence or by a quaternion",
        )
        self.sequence = sequence
        self.distance = distance
        self.sample = sample
