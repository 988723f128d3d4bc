"""Whatever a robot is read from, no more of it is read than was allowed, and it is read once."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path
from typing import Any
from xml.parsers import expat

import pytest

import urdfkin
from tests.urdf.lint.cases.arm import arm, axis
from urdfkin.errors import SourceError
from urdfkin.system.files import MOST, read_standard_input
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.sources import read_source

MOST_HERE = 1000


@pytest.fixture
def large(tmp_path: Path) -> Path:
    place = tmp_path / "large.urdf"
    place.write_bytes(b"<" * 5000)
    return place


@pytest.mark.parametrize("how", ["path", "word", "bytes stream", "text stream", "standard input"])
def test_reading_ends_one_byte_after_what_is_allowed(
    how: str, large: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = large.read_bytes()
    source: Any = {
        "path": large, "word": os.fspath(large), "bytes stream": io.BytesIO(data),
        "text stream": io.StringIO(data.decode()), "standard input": "-",
    }[how]  # fmt: skip
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))
    assert len(read_source(source, MOST_HERE).data) == MOST_HERE + 1


def test_a_robot_of_the_catalogue_is_read_no_further_either() -> None:
    assert len(read_source("panda", MOST_HERE).data) == MOST_HERE + 1
    assert len(read_source("panda").data) > MOST_HERE + 1


def test_a_device_that_never_ends_is_read_up_to_what_is_allowed() -> None:
    assert len(read_source(Path("/dev/zero"), MOST_HERE).data) == MOST_HERE + 1
    assert MOST == 100_000_000


def test_standard_input_is_read_whole_where_nothing_limits_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"0.1,0.2\n0.3,0.4\n")))
    assert read_standard_input() == b"0.1,0.2\n0.3,0.4\n"


def test_an_address_in_a_package_leads_to_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "arm_description"
    (package / "urdf").mkdir(parents=True)
    (package / "urdf" / "arm.urdf").write_text("<robot/>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    read = read_source("package://arm_description/urdf/arm.urdf")
    assert (read.data, read.source) == (b"<robot/>", str(package / "urdf" / "arm.urdf"))


def test_a_package_that_is_nowhere_is_called_as_it_was_written() -> None:
    with pytest.raises(SourceError, match=r"^package://nowhere/arm.urdf: the package 'nowhere' is"):
        read_source("package://nowhere/arm.urdf")


def test_no_name_of_the_catalogue_has_a_point_or_a_separator() -> None:
    assert not [name for name in catalogue() if set(name) & {".", "/", os.sep}]


# -- a text is read once to be checked and computed; Pinocchio's side reads it again when it is asked --------

FOLLOWS = arm(follow='<mimic joint="j1" multiplier="-0.5"/>')


@pytest.fixture
def parsers(monkeypatch: pytest.MonkeyPatch) -> list[expat.XMLParserType]:
    """Every parser that is made."""
    made: list[expat.XMLParserType] = []
    create = expat.ParserCreate

    def noted(encoding: str) -> expat.XMLParserType:
        made.append(create(encoding))
        return made[-1]

    monkeypatch.setattr(expat, "ParserCreate", noted)
    return made


@pytest.mark.parametrize("text", [arm(), FOLLOWS, axis("1e-13 0 1")], ids=["plain", "follows", "tilted"])
def test_load_reads_the_text_once(text: str, parsers: list[expat.XMLParserType]) -> None:
    urdfkin.load(text)
    assert len(parsers) == 1


def test_the_rules_of_followers_are_read_again_when_a_result_is_checked(
    parsers: list[expat.XMLParserType],
) -> None:
    robot = urdfkin.load(FOLLOWS)
    robot.placement([0.3], "tool")
    assert robot.certificate().verified
    assert len(parsers) == 2
