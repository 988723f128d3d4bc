"""The HTML page is self-contained, complete and small, and escapes every name."""

import copy
import hashlib
import json
import re
from functools import cache
from pathlib import Path

import pytest

from tests.markup import Page
from tests.reading import present
from tests.report.documents import arms, failing, hostile
from urdfkin.report import html as html_module
from urdfkin.report import pages
from urdfkin.report.figures import distributions
from urdfkin.report.html import as_html
from urdfkin.report.pages import angle
from urdfkin.report.words import VERDICTS
from urdfkin.urdf.catalogue import example_robot_data_names
from urdfkin.validation.campaign import validate
from urdfkin.validation.document import Document

pytestmark = pytest.mark.slow

ASSETS = Path(html_module.__file__).parent / "assets"


@cache
def page(name: str) -> Page:
    return Page(as_html({"arms": arms, "hostile": hostile, "failing": failing}[name]()))


def test_a_page_refers_to_no_other_file_and_each_id_is_unique() -> None:
    for tag, attributes in page("arms").elements:
        for name in ("src", "href", "xlink:href", "action", "data", "poster", "srcset"):
            value = attributes.get(name)
            assert value is None or value.startswith(("#", "data:,")), (tag, name, value)
    style = (ASSETS / "report.css").read_text()
    assert "url(" not in style
    assert "@import" not in style
    metas = {a.get("http-equiv"): a["content"] for a in page("arms").all("meta") if "content" in a}
    assert str(metas["Content-Security-Policy"]).startswith("default-src 'none'")
    ids = [attributes["id"] for _, attributes in page("arms").elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    for _, attributes in page("arms").elements:
        for name in ("href", "clip-path"):
            assert set(re.findall(r"#([\w-]+)", attributes.get(name) or "")) <= set(ids), attributes
        assert attributes.get("aria-labelledby") in (*ids, None, ""), attributes


def test_a_page_has_checks_versions_and_the_command_that_repeats_the_run() -> None:
    text = page("arms").text
    for words in (
        "Verified against Pinocchio", "seed 0", "urdfkin validate panda ur5 --samples 6 --seed 0", "numpy",
        "panda_joint7", "Denavit-Hartenberg", "modified (proximal, Craig)", "Worst cases",
        "urdfkin acceleration panda --frame", "Findings in the file", "MIT License",
    ):  # fmt: skip
        assert words in text, words


def test_a_page_states_failures_in_words_and_the_reason_first() -> None:
    text = page("failing").text
    assert "Not verified against Pinocchio" in text
    assert "1 of 3 robots disagrees, 1 of 3 robots has bad input." in text
    assert "1 robot verified." in text
    assert "✗ 3" in text
    assert "URDF502" in text
    computation, model = banner(failing())
    assert "1 of 3 files unusable" in model
    assert computation.index("bad input") < computation.index("results lie outside")


def test_tables_agree_on_the_page_if_the_ratio_to_the_bound_is_at_most_one() -> None:
    document = copy.deepcopy(arms())
    chains = [chain for robot in document["robots"] for chain in robot["chains"]]
    assert as_html(document).count("Both tables agree with Pinocchio") == len(chains) > 0
    for chain in chains[1:]:
        chain["bound_ratio"] = 1.01
    text = as_html(document)
    assert text.count("Both tables agree with Pinocchio") == 1
    assert text.count("The tables disagree with Pinocchio") == len(chains) - 1


def test_plots_pictures_and_tables_are_accessible() -> None:
    arms_page = page("arms")
    plots = [a for a in arms_page.all("svg") if a.get("class") == "plot"]
    assert len(plots) == 2
    assert all(plot.get("role") == "img" for plot in plots)
    assert "Distribution of the disagreement with Pinocchio, panda" in arms_page.text
    assert all(a.get("aria-label") for a in arms_page.all("canvas"))
    for attributes in arms_page.all("input") + arms_page.all("select"):
        assert attributes.get("type") != "image"
    assert arms_page.all("html") == [{"lang": "en"}]
    assert all(a.get("scope") in ("row", "col") for a in arms_page.all("th"))


def test_a_page_without_matplotlib_states_that_plots_are_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(html_module, "has_matplotlib", lambda: False)
    text = as_html(arms())
    assert "pip install &#39;matplotlib&gt;=3.10.7&#39;" in text
    assert 'class="plot"' not in text


def test_equal_documents_give_equal_pages_and_a_robot_adds_at_most_140_kilobytes() -> None:
    assert as_html(arms()) == as_html(arms())
    two, one = arms(), arms()
    del one["robots"][0]
    assert len(as_html(two)) - len(as_html(one)) < 140_000


@pytest.mark.long
def test_the_page_of_all_68_robots_is_at_most_10_megabytes() -> None:
    document = validate(example_robot_data_names(), samples=0).as_dict()
    assert len(document["robots"]) == 68
    text = as_html(document)
    assert 3_000_000 < len(text.encode()) <= 10_000_000
    assert text.count('class="plot"') == 68


@pytest.mark.parametrize(
    ("radians", "text"),
    [(0.0, "0"), (1.5707963267948966, "π/2"), (-3.141592653589793, "−π"), (1.5708, "1.5708")],
)
def test_only_an_exact_fraction_of_pi_is_shown_with_pi(radians: float, text: str) -> None:
    assert angle(radians) == text


def test_the_bundled_library_has_the_published_checksum_and_version() -> None:
    lines = (ASSETS / "three.sha256").read_text().splitlines()
    sums = {name: digest for digest, name in map(str.split, lines)}
    assert set(sums) == {"three.min.js", "three.LICENSE.txt"}
    for name, digest in sums.items():
        assert hashlib.sha256((ASSETS / name).read_bytes()).hexdigest() == digest
    named = json.loads((Path(__file__).parents[2] / "scripts" / "three" / "package.json").read_text())
    head = (ASSETS / "three.min.js").read_text(encoding="utf-8")[:200]
    assert f"three.js {named['dependencies']['three']}, MIT licence" in head


def test_failed_robots_come_first_are_open_and_have_the_command_that_computes_the_result_again() -> None:
    text = as_html(failing())
    heads = re.findall(r'<details class="robot" id="robot-\d+" data-verdict="([^"]*)"[^>]*?( open)?>', text)
    order = [VERDICTS.index(verdict) for verdict, _ in heads]
    assert order == sorted(order)
    assert order[0] < order[-1]
    assert all(bool(opened) == (verdict != "verified") for verdict, opened in heads)
    rows = re.findall(r'<tr data-verdict="([^"]*)"', text)
    assert rows == [verdict for verdict, _ in heads]
    panda = text[text.index('data-verdict="disagrees"') :]
    failures = panda.index("Results outside their bound")
    assert failures < panda.index("Disagreements and bounds")
    assert failures < panda.index("urdfkin velocity panda --frame") < panda.index("<h3>Checks</h3>")


def test_counts_of_configurations_moving_joints_and_errors_are_right() -> None:
    document = failing()
    robot = next(robot for robot in document["robots"] if robot["findings"])
    first = robot["findings"][0]
    robot["findings"] = [{**first, "severity": "error"}, {**first, "severity": "warning"}]
    assert pages.overview_row(robot, [])["findings"] == "1 error, 1 warning"
    document = arms()
    robot = document["robots"][1]
    robot["verdict"], robot["checks"], robot["joints"], robot["results"] = "not verified", [], [], 0
    assert "6 of them move" in as_html(document)
    text = as_html(arms() | {"samples": 1})
    assert "1 random configuration for each robot" in text


def test_the_colour_of_the_heat_map_depends_on_the_ratio_to_the_bound() -> None:
    robot = arms()["robots"][1]
    model = present(robot["model"])
    _, rows = pages.heat_map(robot, model)
    edges = (0.0, *pages.HEAT_EDGES)
    largest = max(check["bound_ratio"] or 0.0 for check in robot["checks"])
    steps = [cell.step for _, cells in rows for cell in cells if cell.text]
    assert max(steps) == sum(largest > edge for edge in edges)
    for check in robot["checks"]:
        check["worst_by_subject"] = [0.5 * (check["bound"][0] or 0.0) for _ in check["worst_by_subject"]]
        check["bound_ratio"] = 0.5
    _, rows = pages.heat_map(robot, model)
    assert {cell.step for _, cells in rows for cell in cells if cell.text} == {sum(e < 0.5 for e in edges)}


def banner(document: Document) -> list[str]:
    """Return the two texts of the banner, about the computation and about the model."""
    sections = re.findall(r'<section class="verdict .*?</section>', as_html(document), re.DOTALL)
    return [" ".join(re.sub("<[^>]+>", " ", section).split()) for section in sections]


def test_the_banner_states_the_results_of_the_computation_and_of_the_model() -> None:
    document = arms()
    computation, model = banner(document)
    assert computation.startswith("Are urdfkin's results correct? Verified against Pinocchio")
    assert model.startswith("Is the model right? No errors and no warnings")
    assert "No model was read" in banner(document | {"robots": []})[1]
    (note, *_) = document["robots"][0]["findings"]
    document["robots"][0]["findings"] = []
    document["robots"][1]["findings"] = [note | {"severity": "warning"}] * 2
    assert "Warnings in 1 of 2 files 2 warnings" in banner(document)[1]
    document["robots"][0]["findings"] = [note | {"severity": "error"}]
    assert "Errors in 1 of 2 files 1 error, 2 warnings. Show the first" in banner(document)[1]


def test_each_error_in_a_file_is_on_the_page_once(tmp_path: Path) -> None:
    bad = tmp_path / "bad.urdf"
    bad.write_text('<robot name="r"><link name="a"/><link name="a"/><joint name="j"/></robot>')
    document = validate([str(bad)], samples=1).as_dict()
    text = as_html(document)
    assert "the URDF has 4 errors" in text
    assert text.count("another link has this name") == 1
    document["robots"][0]["findings"] = []
    assert as_html(document).count("another link has this name") == 1


def test_a_value_that_is_not_finite_has_a_mark_in_the_plot_and_in_its_cell_of_the_heat_map() -> None:
    document = failing()
    robot = next(robot for robot in document["robots"] if robot["verdict"] == "disagrees")
    assert "not finite" in distributions(robot, document["histogram_edges"], "p0-")
    _, rows = pages.heat_map(robot, present(robot["model"]))
    cells = [cell for _, row in rows for cell in row]
    red = [cell.step > len(pages.HEAT_EDGES) for cell in cells]
    assert red == [cell.text == "not finite" for cell in cells]
    assert 0 < sum(red) < len(rows)
