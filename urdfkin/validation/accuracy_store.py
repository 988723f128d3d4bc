"""What the judge found, kept in a campaign's store: it takes seconds a robot, and is interrupted too.

What it was asked for stands in `judge.json`; a judgement lies beside the chunks, under the sha256 of
all that its numbers depend on, and under the same seal.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from urdfkin.errors import InputError
from urdfkin.system.files import read_if_there
from urdfkin.validation.accuracy import Errors, Judgement, Line
from urdfkin.validation.answer import DamagedError, packed, unpacked
from urdfkin.validation.manifest import LAYOUT
from urdfkin.validation.results import version
from urdfkin.validation.store import JUDGE, JUDGED, Store


@dataclass(frozen=True, slots=True)
class NotJudged:
    """Why there is no judgement of a robot."""

    reason: str


@dataclass(frozen=True, slots=True)
class Asked:
    """What the judge was asked for.

    Attributes:
        samples: Configurations of each robot.
        seed: What they are drawn from.
        moving_base: Whether the root links move, at random.
    """

    samples: int
    seed: int
    moving_base: bool

    @property
    def words(self) -> str:
        """As options."""
        moving = " --judge-moving-base" if self.moving_base else ""
        return f"--judge-samples {self.samples} --seed {self.seed}{moving}"


class AccuracyResult:
    """The judgements in a store.

    Args:
        store: Where.
        asked: For what.
    """

    def __init__(self, store: Store, asked: Asked) -> None:
        self._store, self._asked = store, asked

    @classmethod
    def merge(cls, store: Store, others: Sequence[Store]) -> None:
        """Copy what other stores of the same campaign have and this one has not.

        Raises:
            InputError: they were asked for different things.
        """
        theirs = [judged for judged in map(cls.of, others) if judged is not None]
        if theirs:
            mine = cls.of(store) or cls(store, theirs[0]._asked)
            for judged in theirs:
                mine._demand_same(judged)
            mine.begin()
            for judged in theirs:
                mine._take(judged)

    @classmethod
    def of(cls, store: Store) -> AccuracyResult | None:
        """Those that were asked for last; None: the judge was not asked."""
        try:
            if (content := read_if_there(store.folder / JUDGE)) is None:
                return None
            data = json.loads(content)
            asked = Asked(int(data["samples"]), int(data["seed"]), bool(data["moving_base"]))
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            store.tell(
                f"{store.folder / JUDGE} says nothing ({type(error).__name__}): judgements are left out"
            )
            return None
        return cls(store, asked)

    def begin(self) -> None:
        """Write down what is asked for."""
        self._store.write(JUDGE, (json.dumps(asdict(self._asked)) + "\n").encode())

    def found(self, robot: int) -> Judgement | NotJudged | None:
        """What is known of a robot."""
        return self._store.kept(self._key(robot), JUDGED, _read)

    def has(self, robot: int) -> bool:
        """Whether something is known of a robot, by the file's name."""
        return self._store.has(self._key(robot), JUDGED)

    def keep(self, robot: int, found: Judgement | NotJudged) -> None:
        """Write it down."""
        key = self._key(robot)
        self._store.keep_part(key, JUDGED, packed(key, {"judge": asdict(found)}))

    def stamp(self, robot: int) -> str:
        """The sha256 of the text that was compared."""
        return self._store.manifest.robots[robot][1]

    def _take(self, other: AccuracyResult) -> None:
        for robot in range(len(self._store.manifest.robots)):
            if self.found(robot) is None and (found := other.found(robot)) is not None:
                self.keep(robot, found)

    def _demand_same(self, other: AccuracyResult) -> None:
        if other._asked != self._asked:
            raise InputError(
                "judged with other options",
                where=str(other._store.folder),
                found=f"{other._asked.words}, and {self._asked.words} in {self._store.folder}",
                remedy="judge all parts with the same",
            )

    def _key(self, robot: int) -> str:
        manifest = self._store.manifest
        origin, stamp = manifest.robots[robot]
        origin = replace(origin, oracle=None)  # a second witness is not asked
        numbers = [manifest.provenance, version("mpmath"), asdict(self._asked), asdict(origin), stamp]
        return hashlib.sha256(json.dumps([LAYOUT, "judge", *numbers], sort_keys=True).encode()).hexdigest()


def _read(key: str, content: bytes) -> Judgement | NotJudged:
    data: dict[str, Any] = unpacked(key, content)["judge"]
    try:
        if "reason" in data:
            return NotJudged(str(data["reason"]))
        lines = (
            Line(**line | {side: Errors(**line[side]) for side in ("urdfkin", "pinocchio")})
            for line in data["lines"]
        )
        return Judgement(**data | {"lines": tuple(lines)})
    except (KeyError, TypeError, AttributeError) as error:
        raise DamagedError(f"no judgement of urdfkin's ({type(error).__name__})") from error
