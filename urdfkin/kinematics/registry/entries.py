"""The equations as data, read from the TOML files beside this one."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

#: The highest equation number of the chapter.
LAST = 130
#: Equations of the chapter's page 2, which is missing from the text that this project has. (7.7 stood there
#: as well, but section 7.2 says what it was.)
LOST = ("7.6", "7.8", "7.9", "7.10")

_FILES = (
    "7_1_planar",
    "7_2_1_fixed_axis",
    "7_2_2_any_rotation",
    "7_2_4_angles",
    "7_3_spatial",
    "7_4_joints",
    "7_4_5_examples",
    "7_5_manipulator_jacobian",
    "7_6_acceleration",
    "7_7_manipulator_accelerations",
)


@dataclass(frozen=True, slots=True)
class Equation:
    """One numbered equation.

    Attributes:
        number: As printed, "7.130".
        statement: In urdfkin's notation, plain characters.
        latex: The same, in LaTeX.
        meaning: One or two sentences.
        written: The functions of `urdfkin.kinematics.equations` that are it, by name.
        functions: What computes it, "module:name".
        tests: Tests that fail without it, "file::name".
        against: The independent source that the tests compare with.
    """

    number: str
    statement: str
    latex: str
    meaning: str
    written: tuple[str, ...]
    functions: tuple[str, ...]
    tests: tuple[str, ...]
    against: str


@dataclass(frozen=True, slots=True)
class Section:
    """A section of the chapter.

    Attributes:
        number: As printed, "7.2.4, 7.2.5" for several.
        title: What it is about.
        equations: In the text's order.
    """

    number: str
    title: str
    equations: tuple[Equation, ...]


@dataclass(frozen=True, slots=True)
class Misprint:
    """Something in the chapter that is wrong or incomplete.

    Attributes:
        where: In the text.
        printed: What stands there.
        correct: What should.
        proof: Why, in a sentence.
        test: The test that shows it, "file::name".
    """

    where: str
    printed: str
    correct: str
    proof: str
    test: str


@cache
def sections() -> tuple[Section, ...]:
    """The chapter's sections with their equations, in order."""
    return tuple(_section(_read(name)) for name in _FILES)


@cache
def equations() -> dict[str, Equation]:
    """Every equation by its number, in order."""
    return {equation.number: equation for section in sections() for equation in section.equations}


@cache
def misprints() -> tuple[Misprint, ...]:
    """What is wrong in the chapter, with the proof."""
    return tuple(Misprint(**entry) for entry in _read("misprints")["misprint"])


def _read(name: str) -> dict[str, Any]:
    return tomllib.loads((Path(__file__).with_name("data") / f"{name}.toml").read_text(encoding="utf-8"))


def _section(data: dict[str, Any]) -> Section:
    entries = tuple(_equation({**_defaults(data), **entry}) for entry in data["equation"])
    return Section(data["section"], data["title"], entries)


def _defaults(data: dict[str, Any]) -> dict[str, Any]:
    return {"test_file": data["test_file"], "against": data["against"]}


def _equation(entry: dict[str, Any]) -> Equation:
    names = entry.get("tests") or [entry["test"]]
    return Equation(
        number=entry["number"],
        statement=entry["statement"],
        latex=entry["latex"],
        meaning=entry["meaning"],
        written=tuple(entry.get("written", ())),
        functions=tuple(entry["functions"]),
        tests=tuple(f"{entry['test_file']}::{name}" for name in names),
        against=entry["against"],
    )
