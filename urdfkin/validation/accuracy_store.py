"""Save the results of the accuracy study, so that an interrupted study can be resumed.

The store is the folder with the results of the validation. `accuracy.json` contains the settings. Each
robot's result is a file with a checksum, in the same folder as the chunks. The file name is the sha256 of all
data that determine the numbers in the file.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

from urdfkin.errors import InputError
from urdfkin.system.documents import from_data
from urdfkin.system.files import read_if_exists
from urdfkin.validation.accuracy import AccuracyStudy
from urdfkin.validation.answer import DamagedError, pack, unpack
from urdfkin.validation.manifest import LAYOUT
from urdfkin.validation.store import STUDY_FILE, STUDY_SUFFIX, Store
from urdfkin.verify.oracles import version


@dataclass(frozen=True, slots=True)
class FailedStudy:
    reason: str


@dataclass(frozen=True, slots=True)
class StudySettings:
    """Settings of the accuracy study; `moving_base` gives each root link a random motion."""

    samples: int
    seed: int
    moving_base: bool

    @property
    def options(self) -> str:
        moving = " --accuracy-moving-base" if self.moving_base else ""
        return f"--accuracy-samples {self.samples} --seed {self.seed}{moving}"


class AccuracyResult:
    def __init__(self, store: Store, settings: StudySettings) -> None:
        self._store, self._settings = store, settings

    @classmethod
    def merge(cls, store: Store, others: Sequence[Store]) -> None:
        theirs = [results for results in map(cls.of, others) if results is not None]
        if not theirs:
            return
        own = cls.of(store) or cls(store, theirs[0]._settings)
        for results in theirs:
            own._check_same(results)
        own.begin()
        for results in theirs:
            for robot in range(len(store.manifest.robots)):
                if own.found(robot) is None and (found := results.found(robot)) is not None:
                    own.keep(robot, found)

    @classmethod
    def of(cls, store: Store) -> AccuracyResult | None:
        """Return the results in a store; None if there are none, or the settings are unreadable."""
        try:
            if (content := read_if_exists(store.folder / STUDY_FILE)) is None:
                return None
            settings = from_data(json.loads(content), StudySettings)
        except (OSError, ValueError, RecursionError) as error:
            store.tell(
                f"{store.folder / STUDY_FILE} cannot be read ({type(error).__name__}): the report has no"
                " accuracy results"
            )
            return None
        return cls(store, settings)

    def begin(self) -> None:
        self._store.write(STUDY_FILE, (json.dumps(asdict(self._settings)) + "\n").encode())

    def found(self, robot: int) -> AccuracyStudy | FailedStudy | None:
        return self._store.entry(self._key(robot), STUDY_SUFFIX, _decode)

    def has(self, robot: int) -> bool:
        return self._store.has(self._key(robot), STUDY_SUFFIX)

    def keep(self, robot: int, found: AccuracyStudy | FailedStudy) -> None:
        key = self._key(robot)
        self._store.write_entry(key, STUDY_SUFFIX, pack(key, {"accuracy": found}))

    def stamp(self, robot: int) -> str:
        """Return the sha256 of the robot's text."""
        return self._store.manifest.robots[robot][1]

    def _check_same(self, other: AccuracyResult) -> None:
        if other._settings != self._settings:
            raise InputError(
                "the accuracy results in the two folders were computed with different options",
                where=str(other._store.folder),
                found=f"{other._settings.options}, and {self._settings.options} in {self._store.folder}",
                remedy="run the accuracy study with the same options for both folders",
            )

    def _key(self, robot: int) -> str:
        manifest = self._store.manifest
        origin, stamp = manifest.robots[robot]
        origin = replace(origin, oracle=None)  # The study uses no second oracle.
        parts = [manifest.provenance, version("python-flint"), asdict(self._settings), asdict(origin), stamp]
        return hashlib.sha256(json.dumps([LAYOUT, "accuracy", *parts], sort_keys=True).encode()).hexdigest()


def _decode(key: str, content: bytes) -> AccuracyStudy | FailedStudy:
    data = unpack(key, content).get("accuracy")
    try:
        if isinstance(data, dict) and "reason" in data:
            return from_data(data, FailedStudy)
        return from_data(data, AccuracyStudy)
    except ValueError as error:
        raise DamagedError(f"not an accuracy result of urdfkin ({error})") from error
