"""What becomes of a chunk: its result, or why there is none. Nothing that a robot raises goes further.

An answer is plain data. Errors themselves need not survive the way between processes, and some do not.
"""

from __future__ import annotations

import traceback
from dataclasses import dataclass

from urdfkin.errors import UrdfkinError
from urdfkin.lint import UrdfError
from urdfkin.validation.chunk import Chunk, ChunkResult, run_chunk
from urdfkin.validation.outcome import Verdict
from urdfkin.validation.portrait import NO_PORTRAIT, Portrait, as_data
from urdfkin.validation.subject import Subject
from urdfkin.verify.pinocchio import OracleError


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a robot was not checked.

    Attributes:
        verdict: Whether its file is at fault or something else.
        reason: In words.
        portrait: What can be told of it all the same.
        error: The traceback of an error that nobody foresaw.
        passing: Whether it was the machinery that failed, not the robot: to be tried again, not kept.
    """

    verdict: Verdict
    reason: str
    portrait: Portrait = NO_PORTRAIT
    error: str | None = None
    passing: bool = False


#: What comes back for a chunk.
Answer = ChunkResult | Failure


def answer(chunk: Chunk) -> Answer:
    """Run a chunk; whatever it raises is an answer too, but for an interrupt."""
    try:
        return run_chunk(chunk)
    except Exception as error:
        return failure(chunk.subject, error)


def failure(subject: Subject, error: Exception) -> Failure:
    """The answer for a robot that raised something."""
    if isinstance(error, UrdfError):
        return Failure(Verdict.BAD_INPUT, str(error), Portrait(findings=as_data(error.findings)))
    if isinstance(error, OracleError):
        return Failure(Verdict.NOT_VERIFIED, str(error), _portrait(subject))
    if isinstance(error, UrdfkinError):
        return Failure(Verdict.BAD_INPUT, str(error), _portrait(subject))
    return Failure(Verdict.NOT_VERIFIED, unforeseen(error), error=traced(error))


def unforeseen(error: Exception) -> str:
    """The words for an error that nobody foresaw."""
    told = " ".join(str(error).split()) or "no message"
    return f"an unforeseen error in urdfkin, please report it: {type(error).__name__}: {told}"


def traced(error: Exception) -> str:
    """The whole traceback of an error."""
    return "".join(traceback.format_exception(error))


def _portrait(subject: Subject) -> Portrait:
    """A robot's parts, if it can be read; its tables are nobody's work here."""
    try:
        return Portrait.of(subject.read(), None)
    except Exception:
        return NO_PORTRAIT
