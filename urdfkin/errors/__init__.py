"""Names that look like another, found in bounded time.

Where a message leads whoever asks why: headings of docs/questions.md, which `urdfkin explain` prints.

One family of exceptions, each with the facts a person needs to act on it.

Every message says what is wrong, where, what was found and what to do about it; the same facts are
attributes, so that a program need not read the sentence.
"""

from __future__ import annotations

import difflib
import heapq
from collections.abc import Callable, Iterable
from enum import Enum
from typing import Any, Self, TypeVar

from urdfkin.errors.escape import log_line

#: Characters of a name that are compared.
_COMPARED = 128

#: Pairs of characters that are compared for one word, after what tells at a glance that names differ.
WORK = 1_000_000
#: How many names are offered.
_OFFERED = 3


def nearest(word: str, known: Iterable[str], *, cutoff: float = 0.6, work: int = WORK) -> list[str]:
    """Up to three known names that look like `word`, the nearest first, as `difflib.get_close_matches`.

    Args:
        word: What was written.
        known: The names there are.
        cutoff: How alike they must be, from 0 to 1.
        work: Pairs of characters to compare before the search ends with what it has.

    >>> nearest("pandahand", ["panda_hand", "elbow", "base"])
    ['panda_hand']
    """
    begins = word[:_COMPARED]
    matcher = difflib.SequenceMatcher(b=begins)
    found = []
    for name in known:
        matcher.set_seq1(name[:_COMPARED])
        if matcher.real_quick_ratio() < cutoff or matcher.quick_ratio() < cutoff:
            continue
        work -= len(begins) * len(name[:_COMPARED])
        if work < 0:
            break
        if (alike := matcher.ratio()) >= cutoff:
            found.append((alike, name))
    return [name for _, name in heapq.nlargest(_OFFERED, found)]


class Question(Enum):
    """A question by its heading's anchor; as text, the command that answers it.

    >>> print(Question.MIMIC_JOINTS)
    `urdfkin explain mimic-joints` says more
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

    def __str__(self) -> str:
        return f"`urdfkin explain {self.value}` says more"


_E = TypeVar("_E", bound="UrdfkinError")


class UrdfkinError(Exception):
    """Root of everything urdfkin raises on purpose.

    Attributes:
        what: The claim in one clause, without a full stop.
        where: File, line, frame, sample: whatever locates it; None when there is no place.
        found: The offending value, as the user wrote it.
        remedy: What to do.
        question: What people ask who see this; the message ends with the command that answers it.
        is_disagreement: Whether it is urdfkin and Pinocchio that disagree, not the input that is wrong.
    """

    is_disagreement = False

    def __init__(
        self,
        what: str,
        *,
        where: str | None = None,
        found: str | None = None,
        remedy: str | None = None,
        question: Question | None = None,
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
        # Names and files are in it: none of them may add a line or act on a terminal.
        return log_line(f"{place}{self.what}{found}{remedy}{question}")

    def __reduce__(self) -> tuple[Callable[..., Self], tuple[Any, ...]]:
        # Errors cross process borders in `validate --jobs`; the default would lose the keyword fields.
        return _rebuild, (type(self), self.__dict__)


def _rebuild(cls: type[_E], state: dict[str, Any]) -> _E:
    error = cls.__new__(cls, state["what"])
    error.args = (state["what"],)
    error.__dict__.update(state)
    return error


class InputError(UrdfkinError, ValueError):
    """A value handed to urdfkin cannot be used: wrong length, not finite, not a rotation, ..."""


class NotFiniteError(InputError):
    """A coordinate or rate that is infinite or no number."""


class RangeError(InputError):
    """Numbers so large that what is computed from them leaves the range of double precision."""


class UnknownNameError(UrdfkinError, LookupError):
    """A name that does not exist; the message offers the nearest ones that do.

    Attributes:
        name: The name that was asked for.
        nearest: Up to three existing names that look like it.
    """

    def __init__(
        self,
        kind: str,
        name: str,
        known: Iterable[str],
        *,
        where: str | None = None,
        question: Question | None = None,
    ) -> None:
        names = sorted(set(known))
        close = nearest(name, names, cutoff=0.5)
        if close:
            remedy = f"did you mean {', '.join(close)}?"
        elif names:
            remedy = f"there are {len(names)}: {', '.join(names[:6])}{', ...' if len(names) > 6 else ''}"
        else:
            remedy = "there are none"
        super().__init__(f"unknown {kind} {name!r}", where=where, remedy=remedy, question=question)
        self.name = name
        self.nearest = tuple(close)


class OracleError(UrdfkinError):
    """Pinocchio refuses a robot, or reads another robot from the same text."""


class InstallationError(UrdfkinError, ImportError):
    """A library that urdfkin needs is missing, or another one goes by its name."""


class SourceError(UrdfkinError, OSError):
    """A file that cannot be read or written."""


class RepresentationSingularityError(InputError):
    """Angles at which an orientation's rates cannot be had: the text's representational singularity.

    Nothing is wrong with the motion, only with its description (7.56).

    Attributes:
        sequence: The Euler sequence.
        distance: How far the middle angle is from the singularity, radians.
        sample: Index of the worst member of the batch, () for a single one.
    """

    def __init__(self, sequence: str, distance: float, sample: tuple[int, ...]) -> None:
        super().__init__(
            f"the Euler angles {sequence} are at their representational singularity: "
            "some angular velocities have no rates there",
            where=f"sample {list(sample)}" if sample else None,
            found=f"a middle angle {distance:.3g} rad from it",
            remedy="describe the orientation by another sequence or by a quaternion",
        )
        self.sequence = sequence
        self.distance = distance
        self.sample = sample
