"""The page about speed contains the measured numbers at the right places, and no other numbers."""

import json
import re

import pytest

from scripts import make_pages as maker
from scripts.benchmarking.tables import NOT_MEASURED, format_number, make_page, make_tables

TEXT = maker.page_path("performance").read_text("utf-8")
FIGURES = json.loads(maker.FIGURES.read_text("utf-8"))


def test_the_page_shows_the_figures_of_its_file() -> None:
    assert maker.make_page("performance") == TEXT, "run python scripts/make_pages.py performance"


def test_a_different_figure_gives_a_different_page() -> None:
    first, *others = FIGURES["rows"]
    changed = {**FIGURES, "rows": [{**first, "median_ns": 12_345.0}, *others]}
    assert "| 12,345 |" in make_page(TEXT, changed)


def test_the_first_table_separates_all_threads_and_code_compiled_for_one_robot() -> None:
    rows = [row for row in FIGURES["rows"] if row["section"] == "batch"]
    batch = {(f"{row['robot']}, {row['quantity']}", row["label"]): row["ratio"] for row in rows}
    (summary,) = [words for words in make_tables(FIGURES) if words.section == "summary"]
    heads = list(enumerate(summary.head))
    threads, compiled = (next(i for i, head in heads if word in head) for word in ("all threads", "compiled"))
    several = f"urdfkin, {FIGURES['machine']['processors']} threads"
    for row in summary.rows:
        assert row[threads] == format_number(batch[row[0], several])
        assert row[compiled] == format_number(batch[row[0], "urdfkin, compiled for this robot, 1 thread"])


def test_figures_without_a_marker_on_the_page_are_refused() -> None:
    with pytest.raises(ValueError, match="places for"):
        make_page(TEXT.replace("<!-- figures: floor -->", ""), FIGURES)


def test_no_figure_is_written_by_hand() -> None:
    text = re.sub(r"<!-- figures: \w+ -->.*?<!-- end -->", "", TEXT, flags=re.DOTALL)
    assert re.findall(r"\d (?:ns|us|times|GB/s|MB)\b", text) == []


def test_the_picture_is_a_small_file() -> None:
    assert maker.PICTURE.is_file()
    assert maker.PICTURE.stat().st_size < 60_000


def test_figures_that_were_not_measured_are_marked_as_missing() -> None:
    without = {**FIGURES, "rows": [row for row in FIGURES["rows"] if row["section"] != "sizes"]}
    place = make_page(TEXT, without).partition("<!-- figures: sizes -->\n")[2]
    assert place.startswith(NOT_MEASURED)


def test_the_page_shows_the_time_of_each_step_of_a_batch_and_of_a_single_call() -> None:
    where = [
        {
            "kind": kind, "robot": "panda", "quantity": "jacobian", "ns": 40.0,
            "parts": {"walk": 10.0, "rest": 30.0},
        }
        for kind in ("batch", "single")
    ]  # fmt: skip
    assert make_page(TEXT, {**FIGURES, "where": where}).count("| walk | 10.0 (25 %) |") == 2
