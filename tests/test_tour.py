"""docs/tour.md runs, prints what it says, and has its pictures."""

import re
from pathlib import Path

import pytest

from tests.pages import DOCS

pytestmark = pytest.mark.slow

TOUR = (DOCS / "tour.md").read_text(encoding="utf-8")


def test_every_picture_is_there_and_described() -> None:
    pictures = re.findall(r"!\[(.+?)\]\((.+?)\)", TOUR)
    assert len(pictures) >= 8
    for described, file in pictures:
        assert len(described) > 20
        assert (DOCS / file).read_text(encoding="utf-8").lstrip().startswith("<?xml")


def test_every_section_of_the_chapter_has_its_place() -> None:
    for section in ("7.1", "7.2", "7.3", "7.4", "7.5", "7.6", "7.7"):
        assert re.search(rf"^## .*{re.escape(section)}\b", TOUR, re.MULTILINE), section


@pytest.mark.slow
def test_the_pictures_can_be_drawn_again(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from scripts import make_tour  # noqa: PLC0415  needs the extra

    make_tour.main(tmp_path)
    drawn = {path.name for path in tmp_path.iterdir()}
    assert drawn == {Path(file).name for _, file in re.findall(r"!\[(.+?)\]\((.+?)\)", TOUR)}
