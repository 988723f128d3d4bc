"""A robot is read from any source only up to a limit, and only once."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path
from xml.parsers import expat

import pytest

import urdfkin
from tests.urdf.lint.cases.arm import arm, axis
from urdfkin.errors import SourceError
from urdfkin.system.files import MOST, read_standard_input
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.sources import Source, read_source

MOST_HERE = 1000


def test_at_most_one_byte_more_than_the_limit_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, large = b"<" * 5000, tmp_path / "large.urdf"
    large.write_bytes(data)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))
    streams = io.BytesIO(data), io.StringIO(data.decode())
    sources: tuple[Source, ...] = (large, os.fspath(large), *streams, "-", "panda", Path("/dev/zero"))
    for source in sources:
        assert len(read_source(source, MOST_HERE).data) == MOST_HERE + 1
    assert len(read_source("panda").data) > MOST_HERE + 1
    assert MOST == 100_000_000


def test_standard_input_is_read_completely_without_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"0.1,0.2\n0.3,0.4\n")))
    assert read_standard_input() == b"0.1,0.2\n0.3,0.4\n"


def test_a_package_address_is_the_file_in_the_package_or_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "arm_description"
    (package / "urdf").mkdir(parents=True)
    (package / "urdf" / "arm.urdf").write_text("<robot/>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    read = read_source("package://arm_description/urdf/arm.urdf")
    assert (read.data, read.source) == (b"<robot/>", str(package / "urdf" / "arm.urdf"))
    with pytest.raises(SourceError, match=r"^package://nowhere/arm.urdf: the package 'nowhere' is"):
        read_source("package://nowhere/arm.urdf")


def test_no_name_of_the_catalogue_contains_a_dot_or_a_separator() -> None:
    assert not [name for name in catalogue() if set(name) & {".", "/", os.sep}]


# -- parsers -------------------------------------------------------------------------------------------------

FOLLOWS = arm(follow='<mimic joint="j1" multiplier="-0.5"/>')


@pytest.fixture
def parsers(monkeypatch: pytest.MonkeyPatch) -> list[expat.XMLParserType]:
    """List of all XML parsers that the test creates."""
    made: list[expat.XMLParserType] = []
    create = expat.ParserCreate

    def noted(encoding: str) -> expat.XMLParserType:
        made.append(create(encoding))
        return made[-1]

    monkeypatch.setattr(expat, "ParserCreate", noted)
    return made


@pytest.mark.parametrize("text", [arm(), FOLLOWS, axis("1e-13 0 1")], ids=["plain", "follows", "tilted"])
def test_load_parses_the_text_once_and_the_oracle_parses_mimic_rules_again(
    text: str, parsers: list[expat.XMLParserType]
) -> None:
    robot = urdfkin.load(text)
    assert len(parsers) == 1
    if text == FOLLOWS:
        robot.placement([0.3], "tool")
        assert robot.certificate().verified
        assert len(parsers) == 2
