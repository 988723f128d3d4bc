"""Every command that prints a table has every format of a table."""

import csv
import io
import json
from pathlib import Path

import pytest

from tests.cli.running import urdfkin
from urdfkin.cli.output import Answer
from urdfkin.errors.display import Code, Matrix, Strong, Table, TextDocument

#: A command line -> a word of its table, as text and in LaTeX.
TABLES = {
    "robots --family arm": "panda",
    "info elbow": "wrist",
    "jacobian elbow": "vx",
    "placement elbow": "x of frame",
    "hessian elbow": "changed by",
    "acceleration elbow --v random --breakdown": "Coriolis",
    "singular-values elbow": "condition",
    "imu elbow": "proper acceleration",
    "chain elbow": "revolute",
    "structure ur5": "axes",
    "diff ur5 ur5_limited --no-effects": "limit",
    "same ur5 ur5_limited": "ur5",
    "calibrate elbow": "identifiable",
    "screws elbow": "joint",
    "dh elbow": "joint",
    "dh elbow --tree": "sigma",
    "dh ur5 --compare ur5": "exactly",
}


def written(line: str, form: str) -> str:
    done = urdfkin(*line.split(), "--format", form)
    assert done.code in (0, 1), done.err
    assert "error" not in done.err
    return done.text


@pytest.mark.parametrize("line", TABLES)
def test_a_table_is_written_in_every_format(line: str) -> None:
    word = TABLES[line]
    named = "terminal" if line.startswith(("screws", "dh")) else "table"
    assert word in written(line, named)
    markdown, html, latex = (written(line, form) for form in ("markdown", "html", "latex"))
    assert word in markdown
    assert word in html
    assert word in latex
    assert "</" in html
    assert "\\" in latex
    json.loads(written(line, "json"))


@pytest.mark.parametrize(
    "line", [line for line in TABLES if line.split()[0] in ("robots", "info", "chain", "diff")]
)
def test_csv_has_one_width_and_numbers_that_stay_numbers(line: str) -> None:
    heads, *rows = csv.reader(io.StringIO(written(line, "csv")))
    assert rows
    assert {len(row) for row in rows} == {len(heads)}
    assert not any(cell.startswith("'-") and cell[2:3].isdigit() for row in rows for cell in row)


@pytest.mark.parametrize(
    ("suffix", "begin"), [(".txt", "ur5:"), (".md", "**ur5"), (".html", "<div>"), (".tex", "\\textbf")]
)
def test_the_suffix_of_a_file_selects_the_format_of_a_table(suffix: str, begin: str, tmp_path: Path) -> None:
    path = tmp_path / f"table{suffix}"
    done = urdfkin("jacobian", "ur5", "-o", str(path))
    assert (done.code, done.out, done.err) == (0, b"", "")
    text = path.read_text()
    assert text.startswith(begin)
    assert "verified by Pinocchio" in text


def test_the_check_is_part_of_json_or_is_printed_beside_the_data() -> None:
    done = urdfkin("chain", "ur5", "--format", "json")
    assert done.err == ""
    assert done.data["verified"] is True
    assert done.data["check"].startswith("Pinocchio")
    done = urdfkin("chain", "ur5", "--format", "csv")
    assert done.err.startswith("Pinocchio")
    done = urdfkin("chain", "ur5", "--no-verify", "--format", "json")
    assert (done.code, done.data["verified"]) == (3, False)


def test_an_entry_for_a_printed_format_replaces_the_document() -> None:
    answer = Answer(lambda: TextDocument("title"), {"html": lambda: "page"}, "checked")
    assert answer.write("html") == ("page", False)
    assert answer.write("table") == ("title\nchecked\n", True)


def test_a_document_has_matrices_code_and_emphasis_in_every_format() -> None:
    parts: list[str | Table | Matrix] = [Code("T(i)"), "", Strong("sure")]
    parts.append(Matrix([["1", "-20"], ["300", "4"]]))
    document = TextDocument("", [*parts, Table(("a_b", "[m]"), [("c_d", -0.5)], names=(0,))])
    text, markdown, html, latex = (document.written(form) for form in ("table", "markdown", "html", "latex"))
    assert text.startswith("T(i)\n\nsure\n    1  -20\n  300    4\na_b   [m]\n")
    assert markdown.startswith("`T(i)`\n\n**sure**\n\n```\n  1  -20\n300    4\n```\n\n| a\\_b |")
    assert "| `c_d` | -0.5 |" in markdown
    assert html.count("<td") == 6
    assert r"\begin{bmatrix}1 & -20 \\ 300 & 4\end{bmatrix}" in latex
