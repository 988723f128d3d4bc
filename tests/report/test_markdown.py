"""Markdown for a comment: whole tables, no names that come alive, and never too long."""

from __future__ import annotations

import copy

import pytest
from markdown_it import MarkdownIt

from tests.report.documents import HOSTILE_ROBOT, arms, failing, hostile
from urdfkin.errors.escape import markdown_code, markdown_text
from urdfkin.report.markdown import LIMIT, as_markdown, fenced

GITHUB_LIMIT = 65_536


def rendered(markdown: str) -> str:
    return str(MarkdownIt("commonmark", {"html": True}).enable("table").render(markdown))


def test_a_good_run_has_a_row_for_each_robot_and_the_line_that_repeats_it() -> None:
    html = rendered(as_markdown(arms()))
    assert html.count("<tr>") == 3
    assert "✅ Verified against Pinocchio" in html
    assert "urdfkin validate panda ur5 --samples 6 --seed 0" in html


def test_failures_come_first_with_their_replay_line() -> None:
    markdown = as_markdown(failing())
    assert markdown.index("broken.urdf") < markdown.index("| `ur5`")
    assert "❌ Not verified" in markdown
    assert "3 of" in markdown
    assert "urdfkin velocity panda --frame" in markdown


def test_hostile_names_stay_text() -> None:
    html = rendered(as_markdown(hostile()))
    assert "<script" not in html
    assert "<img" not in html
    assert markdown_code(HOSTILE_ROBOT) in as_markdown(hostile())
    assert rendered(markdown_text("a|b `c` *d* <e> @f #g [h](i)")).strip().replace("\u2060", "") == (
        "<p>a|b `c` *d* &lt;e&gt; @f #g [h](i)</p>"
    )


def test_a_fence_is_longer_than_what_it_holds() -> None:
    assert fenced("a ``` b").startswith("````sh\n")


@pytest.mark.slow
def test_a_thousand_robots_still_fit_a_comment_and_the_rest_is_counted() -> None:
    document = arms()
    document["robots"] = [copy.deepcopy(document["robots"][0]) for _ in range(1000)]
    markdown = as_markdown(document)
    assert len(markdown) <= LIMIT < GITHUB_LIMIT
    assert "further robots left out" in markdown
