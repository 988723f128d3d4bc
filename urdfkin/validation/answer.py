"""Run a chunk, return a result or the reason of a failure, and encode this answer for a file.

If an exception occurs while a robot is validated, the answer contains the exception's message. An answer is
plain data, because some exceptions cannot be sent between processes.

A file contains an answer as compressed JSON, with the key of the chunk and a checksum (sha256). A file
contains only data and no code, because the file may come from another machine. Damaged, truncated, renamed
and foreign files are detected before their data are used.
"""

from __future__ import annotations

import hashlib
import json
import traceback
import zlib
from dataclasses import dataclass, replace
from typing import Any

from urdfkin.errors import OracleError, UrdfkinError
from urdfkin.system.documents import as_data, from_data
from urdfkin.urdf.lint import UrdfError
from urdfkin.validation.chunk import Chunk, ChunkResult, run_chunk
from urdfkin.validation.document import ValidationVerdict
from urdfkin.validation.error_stats import ErrorStats, Key
from urdfkin.validation.robot_input import RobotInput
from urdfkin.validation.robot_summary import EMPTY_SUMMARY, RobotSummary, make_finding_entries


@dataclass(frozen=True, slots=True)
class Failure:
    """The reason why a robot was not checked.

    Attributes:
        is_transient: Whether a resumed run computes the chunk again, for example after a lost answer.
        error: Traceback of an unexpected error.
    """

    verdict: ValidationVerdict
    reason: str
    summary: RobotSummary = EMPTY_SUMMARY
    error: str | None = None
    is_transient: bool = False


Answer = ChunkResult | Failure


def answer_chunk(chunk: Chunk) -> Answer:
    try:
        return run_chunk(chunk)
    except Exception as error:
        return make_failure(chunk.robot_input, error)


def make_failure(robot_input: RobotInput, error: Exception) -> Failure:
    if not isinstance(error, UrdfkinError):
        return make_unexpected_failure(error)
    if isinstance(error, UrdfError):
        summary = RobotSummary(findings=make_finding_entries(error.findings))
    else:
        summary = _summarize_unchecked(robot_input)
    is_oracle = isinstance(error, OracleError)
    verdict = ValidationVerdict.NOT_VERIFIED if is_oracle else ValidationVerdict.BAD_INPUT
    return Failure(verdict, str(error), summary)


def _summarize_unchecked(robot_input: RobotInput) -> RobotSummary:
    try:
        return RobotSummary.of(robot_input.make_robot(), None)
    except Exception:
        return EMPTY_SUMMARY


def make_unexpected_failure(error: Exception) -> Failure:
    reason = f"unexpected error in urdfkin, please report it: {_name_and_message(error)}"
    traceback_text = "".join(traceback.format_exception(error))
    return Failure(ValidationVerdict.NOT_VERIFIED, reason, error=traceback_text)


def make_lost_failure(problem: str, error: Exception) -> Failure:
    reason = f"{problem}: {_name_and_message(error)}"
    return Failure(ValidationVerdict.NOT_VERIFIED, reason, is_transient=True)


def _name_and_message(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split()) or 'no message'}"


CRASHED = "the process that validated the robot crashed"
CRASHED_TWICE = (
    "the process that validated the robot crashed; a second process, for this robot only, also crashed"
)


def make_crash_failure(robot_input: RobotInput, reason: str, cause: str) -> Failure:
    return Failure(ValidationVerdict.NOT_VERIFIED, f"{robot_input.label}: {reason}: found {cause}")


_MAGIC = b"urdfkin-chunk/1\n"
_DIGEST_SIZE = hashlib.sha256().digest_size
#: Maximum size of the data in a file after decompression. A larger file counts as damaged.
_MAX_UNPACKED_BYTES = 2**27


class DamagedError(Exception):
    """A file is damaged or has another key."""


def encode_answer(key: str, answer: Answer) -> bytes:
    if isinstance(answer, Failure):
        return pack(key, {"failure": answer})
    rows = list(answer.error_stats.items())  # Keys of JSON objects must be strings.
    return pack(key, {"error_stats": rows, "result": replace(answer, error_stats={})})


def decode_answer(key: str, content: bytes) -> Answer:
    body = unpack(key, content)
    try:
        if "failure" in body:
            return from_data(body["failure"], Failure)
        error_stats = dict(from_data(body["error_stats"], list[tuple[Key, ErrorStats]]))
        return replace(from_data(body["result"], ChunkResult), error_stats=error_stats)
    except (ValueError, KeyError) as error:
        raise DamagedError(f"not a chunk of urdfkin ({error})") from error


def pack(key: str, body: dict[str, Any]) -> bytes:
    """Return the bytes of a file in a store; doubles are stored exactly."""
    data = zlib.compress(json.dumps(as_data({"key": key} | body), separators=(",", ":")).encode(), 1)
    return _MAGIC + hashlib.sha256(data).digest() + data


def unpack(key: str, content: bytes) -> dict[str, Any]:
    checksum, data = content[len(_MAGIC) :][:_DIGEST_SIZE], content[len(_MAGIC) + _DIGEST_SIZE :]
    if not content.startswith(_MAGIC):
        raise DamagedError("not a chunk of urdfkin")
    if hashlib.sha256(data).digest() != checksum:
        raise DamagedError("the checksum in the file does not match its content")
    try:
        body: dict[str, Any] = json.loads(zlib.decompressobj().decompress(data, _MAX_UNPACKED_BYTES))
        if body["key"] != key:
            raise DamagedError("the file belongs to another chunk")
    except (ValueError, KeyError, TypeError, zlib.error, RecursionError) as error:
        raise DamagedError(f"not a chunk of urdfkin ({type(error).__name__})") from error
    return body
