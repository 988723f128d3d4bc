"""How far a campaign has come."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Standing:
    """What is done and what is to do.

    Attributes:
        robots_done: Robots of which everything is there, or that failed.
        robots: Robots in all.
        chunks_done: Chunks that need no more waiting for.
        chunks: Chunks in all.
        chunks_kept: Chunks of those done that were there from an earlier run.
        failures: Robots that disagree or could not be checked, so far.
        label: The robot in hand.
    """

    robots_done: int
    robots: int
    chunks_done: int
    chunks: int
    chunks_kept: int
    failures: int
    label: str
