"""An answer as a file's bytes: compressed JSON under the key of its chunk, sealed by a digest.

Data and nothing else: what is read here may come from another machine, and must not be able to run. A file
that was damaged, cut short, renamed or made by something else is told from a whole one before it is used.
"""

from __future__ import annotations

import hashlib
import json
import zlib
from dataclasses import asdict
from typing import Any

from urdfkin.validation.answer import Answer, Failure
from urdfkin.validation.chunk import ChunkResult
from urdfkin.validation.clock import Clock
from urdfkin.validation.outcome import Verdict
from urdfkin.validation.portrait import Portrait
from urdfkin.validation.tally import HISTOGRAM_EDGES, Key, Tally, WorstCase
from urdfkin.validation.three_sides import Pair, ThreeSides

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
    return Failure(Verdict(data["verdict"]), data["reason"], _portrait(data["portrait"]), data["error"])


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
        portrait=_portrait(data["portrait"]) if data["portrait"] else None,
    )


def _portrait(data: dict[str, Any]) -> Portrait:
    return Portrait(data["model"], tuple(data["findings"]), tuple(data["chains"]))


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
