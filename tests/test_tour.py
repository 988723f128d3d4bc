"""docs/tour.md runs, prints what it says, and has its pictures."""

import contextlib
import io
import re
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.slow

DOCS = Path(__file__).parents[1] / "docs"
TOUR = (DOCS / "tour.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"```(python|text)\n(.*?)```", re.DOTALL)


def test_every_block_runs_and_prints_what_stands_below_it() -> None:
    namespace: dict[str, Any] = {}
    blocks = BLOCK.findall(TOUR)
    assert sum(kind == "python" for kind, _ in blocks) > 10
    for i, (kind, text) in enumerate(blocks):
        if kind != "python":
            continue
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(text, "docs/tour.md", "exec"), namespace)
        shown = blocks[i + 1][1] if i + 1 < len(blocks) and blocks[i + 1][0] == "text" else ""
        # A zero may print as -0: its sign is rounding.
        assert tidy(printed.getvalue()) == tidy(shown), text


def tidy(text: str) -> list[str]:
    return re.sub(r"-0\.(?![0-9])", " 0.", re.sub(r"[\[\]]", " ", text)).split()


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
