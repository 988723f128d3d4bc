"""What becomes of a chunk: its result, or why there is none. Nothing that a robot raises goes further.

An answer is plain data. Errors themselves need not survive the way between processes, and some do not.


An answer as a file's bytes: compressed JSON under the key of its chunk, sealed by a digest.

Data and nothing else: what is read here may come from another machine, and must not be able to run. A file
that was damaged, cut short, renamed or made by something else is told from a whole one before it is used.
"""

from __future__ import annotations

import hashlib
import json
import traceback
import zlib
from dataclasses import asdict, dataclass
from typing import Any

from urdfkin.errors import UrdfkinError
from urdfkin.lint import UrdfError
from urdfkin.validation.chunk import Chunk, ChunkResult, run_chunk
from urdfkin.validation.error_stats import HISTOGRAM_EDGES, Key, Pair, Tally, ThreeSides, WorstCase
from urdfkin.validation.outcome import Verdict
from urdfkin.validation.robot_input import RobotInput
from urdfkin.validation.robot_summary import NO_PORTRAIT, RobotSummary, as_data
from urdfkin.validation.timings import Clock
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
    portrait: RobotSummary = NO_PORTRAIT
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


def failure(subject: RobotInput, error: Exception) -> Failure:
    """The answer for a robot that raised something."""
    if isinstance(error, UrdfError):
        return Failure(Verdict.BAD_INPUT, str(error), RobotSummary(findings=as_data(error.findings)))
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


def _portrait(subject: RobotInput) -> RobotSummary:
    """A robot's parts, if it can be read; its tables are nobody's work here."""
    try:
        return RobotSummary.of(subject.read(), None)
    except Exception:
        return NO_PORTRAIT


_MAGIC = b"urdfkin-chunk/1\n"
_DIGEST = hashlib.sha256().digest_size
#: What a file may become when it is unpacked: more is nobody's answer.
_MOST = 2**27


class DamagedError(Exception):
    """Bytes that are no answer for the chunk; the message says how."""


def written(key: str, found: Answer) -> bytes:
    """An answer's file."""
    return packed(key, _failure(found) if isinstance(found, Failure) else _result(found))


def read(key: str, content: bytes) -> Answer:
    """The answer for a chunk from a file's bytes.

    Raises:
        DamagedError: they are not what was written for it.
    """
    body = unpacked(key, content)
    try:
        return _read_failure(body["failure"]) if "failure" in body else _read_result(body["result"])
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise DamagedError(f"not a chunk of urdfkin's ({type(error).__name__})") from error


def packed(key: str, body: dict[str, Any]) -> bytes:
    """Data as a file's bytes, under its key and a seal."""
    data = zlib.compress(json.dumps({"key": key} | body, separators=(",", ":")).encode(), 1)
    return _MAGIC + hashlib.sha256(data).digest() + data


def unpacked(key: str, content: bytes) -> dict[str, Any]:
    """The data in a file's bytes.

    Raises:
        DamagedError: they are not what was written under the key.
    """
    seal, data = content[len(_MAGIC) :][:_DIGEST], content[len(_MAGIC) + _DIGEST :]
    if not content.startswith(_MAGIC):
        raise DamagedError("not a chunk of urdfkin's")
    if hashlib.sha256(data).digest() != seal:
        raise DamagedError("its content is not what was written")
    try:
        body: dict[str, Any] = json.loads(zlib.decompressobj().decompress(data, _MOST))
        if body["key"] != key:
            raise DamagedError("it is another chunk's")
    except (ValueError, KeyError, TypeError, zlib.error, RecursionError) as error:
        raise DamagedError(f"not a chunk of urdfkin's ({type(error).__name__})") from error
    return body


def _failure(found: Failure) -> dict[str, Any]:
    return {
        "failure": {
            "verdict": found.verdict.value,
            "reason": found.reason,
            "portrait": asdict(found.portrait),
            "error": found.error,
        }
    }


def _read_failure(data: dict[str, Any]) -> Failure:
    return Failure(Verdict(data["verdict"]), data["reason"], _portrait_from(data["portrait"]), data["error"])


def _result(found: ChunkResult) -> dict[str, Any]:
    return {
        "result": {
            "name": found.name,
            "joints": found.joints,
            "frames": found.frames,
            "tallies": [[*key, _tally(tally)] for key, tally in found.tallies.items()],
            "samples": found.samples,
            "seconds": found.seconds,
            "clock": asdict(found.clock),
            "portrait": asdict(found.portrait) if found.portrait else None,
        }
    }


def _read_result(data: dict[str, Any]) -> ChunkResult:
    tallies: dict[Key, Tally] = {(row[0], row[1]): _read_tally(row[2]) for row in data["tallies"]}
    return ChunkResult(
        name=data["name"],
        joints=tuple(data["joints"]),
        frames=tuple(data["frames"]),
        tallies=tallies,
        samples=data["samples"],
        seconds=data["seconds"],
        clock=Clock(**data["clock"]),
        portrait=_portrait_from(data["portrait"]) if data["portrait"] else None,
    )


def _portrait_from(data: dict[str, Any]) -> RobotSummary:
    return RobotSummary(data["model"], tuple(data["findings"]), tuple(data["chains"]))


def _tally(tally: Tally) -> list[Any]:
    """Its numbers in their order; a double's shortest decimals are read back as the same double."""
    case = tally.case
    return [
        tally.results,
        tally.failed,
        tally.worst,
        tally.share,
        [[place, count] for place, count in enumerate(tally.histogram) if count],
        tally.by_frame,
        None if case is None else [case.share, case.units, case.sample, case.frame, case.q, case.v, case.a],
        tally.bounds,
        asdict(tally.witness) if tally.witness else None,
    ]


def _read_tally(data: list[Any]) -> Tally:
    results, failed, worst, share, counts, by_frame, case, bounds, witness = data
    histogram = [0] * (len(HISTOGRAM_EDGES) + 1)
    for place, count in counts:
        histogram[place] = count
    return Tally(
        results,
        failed,
        worst,
        share,
        tuple(histogram),
        tuple(by_frame),
        None if case is None else WorstCase(*case[:4], *map(tuple, case[4:])),
        (bounds[0], bounds[1]),
        None if witness is None else _three_sides(witness),
    )


def _three_sides(data: dict[str, Any]) -> ThreeSides:
    first, second, third = data["alone"]
    pairs = Pair(**data["urdfkin"]), Pair(**data["pinocchio"])
    return ThreeSides(data["by"], *pairs, (first, second, third), data["undecided"])
