"""Define the answer of a chunk (a result, or the reason of a failure), and the file format of answers.

Every exception that a robot raises becomes an answer. An answer is plain data, because some exceptions cannot
be sent between processes.

A file contains compressed JSON with the key of its chunk and a checksum (sha256). The file may come from
another machine, so it contains only data and no code. Damaged, truncated, renamed and foreign files are
detected before their data are used.
"""

from __future__ import annotations

import hashlib
import json
import traceback
import zlib
from dataclasses import dataclass, replace
from typing import Any

from urdfkin.errors import OracleError, UrdfkinError
from urdfkin.system.documents import as_data, typed
from urdfkin.urdf.lint import UrdfError
from urdfkin.validation.chunk import Chunk, ChunkResult, run_chunk
from urdfkin.validation.error_stats import Key, Tally
from urdfkin.validation.outcome import ValidationVerdict
from urdfkin.validation.robot_input import RobotInput
from urdfkin.validation.robot_summary import NO_PORTRAIT, RobotSummary, entries_of


@dataclass(frozen=True, slots=True)
class Failure:
    """The reason why a robot was not checked.

    Attributes:
        verdict: BAD_INPUT if the robot's file has an error, NOT_VERIFIED otherwise.
        portrait: Summary of the parts of the robot that could be read.
        error: The traceback of an unexpected error; None otherwise.
        passing: Whether the process or the cluster caused the failure, not the robot. Such a failure is not
            stored, so that a resumed run computes the chunk again.
    """

    verdict: ValidationVerdict
    reason: str
    portrait: RobotSummary = NO_PORTRAIT
    error: str | None = None
    passing: bool = False


Answer = ChunkResult | Failure


def answer(chunk: Chunk) -> Answer:
    """Run a chunk and return its result; every exception except an interrupt becomes a `Failure`."""
    try:
        return run_chunk(chunk)
    except Exception as error:
        return failure(chunk.subject, error)


def failure(subject: RobotInput, error: Exception) -> Failure:
    if isinstance(error, UrdfError):
        return Failure(
            ValidationVerdict.BAD_INPUT, str(error), RobotSummary(findings=entries_of(error.findings))
        )
    if isinstance(error, OracleError):
        return Failure(ValidationVerdict.NOT_VERIFIED, str(error), _portrait(subject))
    if isinstance(error, UrdfkinError):
        return Failure(ValidationVerdict.BAD_INPUT, str(error), _portrait(subject))
    return Failure(ValidationVerdict.NOT_VERIFIED, unexpected_error(error), error=format_traceback(error))


def unexpected_error(error: Exception) -> str:
    message = " ".join(str(error).split()) or "no message"
    return f"unexpected error in urdfkin, please report it: {type(error).__name__}: {message}"


def format_traceback(error: Exception) -> str:
    return "".join(traceback.format_exception(error))


def _portrait(subject: RobotInput) -> RobotSummary:
    """Return the summary of a robot without a check of its tables; the empty summary if it cannot be read."""
    try:
        return RobotSummary.of(subject.read(), None)
    except Exception:
        return NO_PORTRAIT


_MAGIC = b"urdfkin-chunk/1\n"
_DIGEST = hashlib.sha256().digest_size
#: Maximum size of an unpacked file, bytes; no answer of urdfkin is larger.
_MOST = 2**27


class DamagedError(Exception):
    """Error for a file that does not contain the results of its chunk; the message states the reason."""


def written(key: str, found: Answer) -> bytes:
    if isinstance(found, Failure):
        return packed(key, {"failure": found})
    rows = list(found.tallies.items())  # a key of a JSON object must be a string
    return packed(key, {"tallies": rows, "result": replace(found, tallies={})})


def read(key: str, content: bytes) -> Answer:
    """Return the answer of a chunk; raise DamagedError if the file is damaged or belongs to another chunk."""
    body = unpacked(key, content)
    try:
        if "failure" in body:
            return typed(body["failure"], Failure)
        tallies = dict(typed(body["tallies"], list[tuple[Key, Tally]]))
        return replace(typed(body["result"], ChunkResult), tallies=tallies)
    except (ValueError, KeyError) as error:
        raise DamagedError(f"not a chunk of urdfkin ({error})") from error


def packed(key: str, body: dict[str, Any]) -> bytes:
    """Return results as the bytes of a file, with their key and a checksum.

    JSON contains each double with enough decimals to read back the same double, and infinity as Python's word
    `Infinity`.
    """
    data = zlib.compress(json.dumps(as_data({"key": key} | body), separators=(",", ":")).encode(), 1)
    return _MAGIC + hashlib.sha256(data).digest() + data


def unpacked(key: str, content: bytes) -> dict[str, Any]:
    """Return the data in a file; raise DamagedError if the file is damaged or belongs to another key."""
    checksum, data = content[len(_MAGIC) :][:_DIGEST], content[len(_MAGIC) + _DIGEST :]
    if not content.startswith(_MAGIC):
        raise DamagedError("not a chunk of urdfkin")
    if hashlib.sha256(data).digest() != checksum:
        raise DamagedError("the checksum in the file does not match its content")
    try:
        body: dict[str, Any] = json.loads(zlib.decompressobj().decompress(data, _MOST))
        if body["key"] != key:
            raise DamagedError("the file belongs to another chunk")
    except (ValueError, KeyError, TypeError, zlib.error, RecursionError) as error:
        raise DamagedError(f"not a chunk of urdfkin ({type(error).__name__})") from error
    return body
