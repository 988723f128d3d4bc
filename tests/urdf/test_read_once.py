"""A text is read once to be checked and computed; Pinocchio's side reads it again when it is asked."""

from xml.parsers import expat

import pytest

import urdfkin
from tests.urdf.lint.cases.arm import arm, axis

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
