"""The history of several reports: order, robots, changes, and files that cannot be used."""

import json
import os
from pathlib import Path

import pytest

from tests.cli.running import good, refused, urdfkin
from tests.markup import Page
from tests.report.documents import HOSTILE_ROBOT, arms, failing, hostile, months_runs, run_on, saved
from urdfkin.errors import InputError
from urdfkin.report import history as module
from urdfkin.report.history import as_html, document, list_changes, read_history, verdict_marks
from urdfkin.report.html import format_date
from urdfkin.validation.campaign import validate


@pytest.fixture
def month(tmp_path: Path) -> Path:
    """A folder with eight reports; the order of the names is opposite to the order of the runs."""
    for i, report in enumerate(reversed(months_runs())):
        saved(tmp_path / f"{i}.json", report)
    return tmp_path


def test_runs_are_ordered_by_start_and_a_copy_counts_once(month: Path) -> None:
    found = read_history([month])
    assert [run["started"][8:10] for run in found.runs] == [f"{day:02}" for day in range(1, 9)]
    assert [Path(run["file"]).stem for run in found.runs] == list("76543210")
    assert [run["verdict"] for run in found.runs] == ["verified"] * 4 + ["disagrees"] + ["verified"] * 3
    saved(month / "latest.json", months_runs()[-1])
    found = read_history([month])
    assert len(found.runs) == 8
    assert [one["reason"] for one in found.repeated] == [f"the same run as {month / '0.json'}"]
    assert found.exit_code == 0


@pytest.mark.parametrize(
    ("started", "words"),
    [
        ("2026-11-28T10:30:00+00:00", "28 November 2026, 10:30 UTC"),
        ("2026-11-28T10:30:00Z", "28 November 2026, 10:30 UTC"),
        ("2026-11-28T10:30:00", "28 November 2026, 10:30 UTC"),  # a time without an offset is in UTC
        ("2026-11-28T10:30:00+05:45", "28 November 2026, 04:45 UTC"),
        ("2026-12-31T23:30:00-08:00", "1 January 2027, 07:30 UTC"),
        ("0001-01-01T00:30:00+02:00", "0001-01-01T00:30:00+02:00"),  # before the first year of Python's dates
        ("yesterday", "yesterday"),
    ],
)
def test_a_page_states_a_start_time_in_utc(started: str, words: str) -> None:
    assert format_date(started) == words


def test_a_history_states_start_times_in_utc(tmp_path: Path) -> None:
    saved(tmp_path / "a.json", arms() | {"started": "2026-11-28T01:30:00+02:00"})
    saved(tmp_path / "b.json", arms() | {"started": "2026-11-27T20:00:00-05:00"})
    found = read_history([tmp_path])
    text, page = document(found).text(), as_html(found)
    for date in ("2026-11-27 23:30", "2026-11-28 01:00"):
        assert date in text
        assert date in page
    assert "28 November 2026, 01:00 UTC" in page


def test_the_history_of_a_robot_has_a_point_for_each_run_with_the_robot(month: Path) -> None:
    found = read_history([month])
    assert {name: verdict_marks(found, points) for name, points in found.robots.items()} == {
        "panda": "✓✓✓✓✗✓✓✓", "ur5": "✓✓✓✓✓✓✓✓", "broken.urdf": "····✗···",
    }  # fmt: skip
    point = found.robots["panda"][4]
    assert (point["verdict"], point["failed"], point["worst"], point["bound_ratio"]) == (
        "disagrees", 3, None, None,
    )  # fmt: skip
    assert [point["warnings"] for point in found.robots["panda"]] == [0, 0, 28, 28, 0, 0, 0, 0]


def test_changes_have_the_index_of_the_run_and_regressions_come_first(month: Path) -> None:
    found = read_history([month])
    rows = [
        (run, change["robot"], change["what"], change["regression"]) for run, change in list_changes(found)
    ]
    assert rows[0] == (5, "broken.urdf", "robot", True)
    assert (5, None, "version of pin", False) in rows
    assert (5, "ur5", "joint shoulder_pan_joint, axis", False) in rows
    assert (4, "panda", "verdict", True) in rows
    assert [run for run, *_ in rows] == sorted((run for run, *_ in rows), reverse=True)


def test_a_terminal_shows_the_latest_runs_and_changes_or_all(
    month: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = good("report history", str(month))
    assert "run 5, REGRESSION panda: verdict: verified -> disagrees" in done.text
    assert "panda        ✓✓✓✓✗✓✓✓  verified" in done.text
    assert done.text.splitlines()[-1] == "8 runs; latest verdict: verified, as in the 2 runs before"
    monkeypatch.setattr(module, "MAX_SHOWN", 3)
    found = read_history([month])
    some, everything = document(found).text(), document(found, all_=True).text()
    assert "13 more: --all shows them" in some
    assert ("2026-11-05" in some, "2026-11-05" in everything) == (False, True)
    assert "more: --all" not in everything


def test_a_page_states_that_it_leaves_out_old_runs_and_changes(
    month: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = read_history([month])
    assert "shows the latest" not in as_html(found)
    monkeypatch.setattr(module, "_MAX_LISTED", 3)
    page = as_html(found)
    assert "8 runs, 10 changes" in page
    assert "The table shows the latest 3 runs." in page
    assert "The list shows the latest 3 changes." in page


def test_a_renamed_file_continues_the_history_of_its_robot(tmp_path: Path) -> None:
    before, after = run_on(1, arms()), run_on(2, arms())
    after["robots"][0]["source"] = "robots/panda.urdf"
    found = read_history([saved(tmp_path / "a.json", before), saved(tmp_path / "b.json", after)])
    assert [point["source"] for point in found.robots["robots/panda.urdf"]] == ["panda", "robots/panda.urdf"]
    assert "panda" not in found.robots
    page = as_html(found)
    assert "file: panda → robots/panda.urdf" in page


def test_a_renamed_file_does_not_replace_the_history_of_an_earlier_file(tmp_path: Path) -> None:
    runs = [run_on(day, arms()) for day in (1, 2, 3)]
    for report in runs[1:]:
        report |= {"robots": report["robots"][1:], "sha256": report["sha256"][1:], "robots_requested": 1}
    runs[2]["robots"][0]["source"] = "panda"  # The file ur5 gets the name of the removed file panda.
    found = read_history([saved(tmp_path / f"{i}.json", report) for i, report in enumerate(runs)])
    marks = {name: verdict_marks(found, points) for name, points in found.robots.items()}
    assert marks == {"panda": "✓·✓", "ur5": "✓✓·"}


@pytest.mark.slow
def test_a_store_counts_as_a_run_in_the_history(tmp_path: Path) -> None:
    validate("planar_two_link", samples=2, store=tmp_path / "nightly" / "store")
    saved(tmp_path / "nightly" / "a.json", run_on(1, arms()))
    found = read_history([tmp_path / "nightly"])
    assert {run["file"] for run in found.runs} == {str(tmp_path / "nightly" / x) for x in ("store", "a.json")}
    assert found.exit_code == 0


def test_unusable_files_are_listed_and_the_other_files_are_used(month: Path) -> None:
    os.mkfifo(month / "pipe.json")
    (month / "broken.json").write_text(json.dumps(arms())[:500])
    (month / "other.json").write_text('{"schema": "other/1"}')
    edited = arms()
    edited["robots"][0]["failed"] = 7
    saved(month / "edited.json", edited)
    done = urdfkin("report history", str(month))
    assert done.code == 2
    for name, reason in (
        ("pipe", "not a regular file"),
        ("broken", "not a JSON file"),
        ("other", "not a file with the layout urdfkin-validation/1"),
        ("edited", "the report contradicts itself"),
    ):
        assert f"not used: {month / name}.json: {reason}" in done.text
    assert "8 runs;" in done.text


def test_the_number_and_size_of_reports_are_limited(month: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_FILES", 7)
    with pytest.raises(InputError, match="more than 7 files"):
        read_history([month])
    monkeypatch.setattr(module, "MOST_FILES", 8)
    monkeypatch.setattr(module, "MOST_RUNS", 7)
    with pytest.raises(InputError, match="more than 7 reports"):
        read_history([month])
    monkeypatch.undo()
    monkeypatch.setattr(module, "MAX_BYTES", 1000)
    with pytest.raises(InputError, match=r"no report to show: found .*too large"):
        read_history([month])


def test_a_history_without_a_report_is_an_error_with_the_remedy(tmp_path: Path) -> None:
    err = refused("report history", str(tmp_path))
    assert "no report to show" in err
    assert "urdfkin validate ROBOT --json FILE" in err
    assert urdfkin("report history").code == 2


def test_the_page_has_no_script_no_address_and_no_hostile_element(tmp_path: Path) -> None:
    reports = [run_on(1, hostile()), run_on(2, hostile())]
    reports[1]["robots"][1]["source"] = '"><img src=x onerror=hacked()>'
    page = as_html(
        read_history([saved(tmp_path / f"{i}.json", one) for i, one in enumerate(reports)]), "<b>command"
    )
    elements = Page(page).elements
    assert {tag for tag, _ in elements}.isdisjoint({"script", "img", "iframe", "object", "form", "base"})
    addresses = [attributes.get(name) for _, attributes in elements for name in ("href", "src", "action")]
    assert all((address or "#robot-").startswith(("#robot-", "data:,")) for address in addresses)
    assert HOSTILE_ROBOT not in page
    assert "&lt;script&gt;" in page
    assert "default-src &#39;none&#39;" in page or "default-src 'none'" in page


def test_the_suffix_selects_the_page_whose_colour_is_that_of_the_latest_verdict(tmp_path: Path) -> None:
    good, bad = (
        saved(tmp_path / "a.json", run_on(1, arms())),
        saved(tmp_path / "b.json", run_on(2, failing())),
    )
    pages = []
    for name, words in (("bad", [good, bad]), ("good", [good])):
        path = tmp_path / f"{name}.html"
        assert urdfkin("report history", *map(str, words), "--output", str(path)).code == 0
        pages.append(path.read_text(encoding="utf-8"))
    assert '<div class="verdict bad">' in pages[0]
    assert "2 runs; latest verdict: disagrees, before: verified" in pages[0]
    assert '<div class="verdict good">' in pages[1]


def test_the_schema_describes_the_ratio_to_the_bound_as_a_ratio() -> None:
    types = module.HISTORY.schema()["$defs"]
    for name in ("ValidationRun", "Point"):
        assert "ratio" in types[name]["properties"]["bound_ratio"]["description"]
