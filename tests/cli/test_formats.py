"""Every table has every format, the suffix selects the format, and files are written completely or not."""

import csv
import errno
import io
import json
import os
import tempfile
import tomllib
from pathlib import Path
from typing import Any, NoReturn

import pytest

from tests.cli.running import good, refused, urdfkin
from urdfkin.cli.output import Answer, check_writable
from urdfkin.dh import read_table
from urdfkin.errors import SourceError
from urdfkin.errors.display import CodeLine, Matrix, Strong, Table, TextDocument
from urdfkin.system.files import write_file

#: For each command line, a word of its table in text and in LaTeX
TABLES = {
    "robots --family arm": "panda", "info elbow": "wrist", "jacobian elbow": "vx",
    "placement elbow": "x of frame", "hessian elbow": "changed by",
    "acceleration elbow --v random --breakdown": "Coriolis", "singular-values elbow": "condition",
    "imu elbow": "proper acceleration", "chain elbow": "revolute", "structure ur5": "axes",
    "diff ur5 ur5_limited --no-effects": "limit", "same ur5 ur5_limited": "ur5",
    "calibrate elbow": "identifiable", "screws elbow": "joint", "dh elbow": "joint",
    "dh elbow --tree": "sigma", "dh ur5 --compare ur5": "exactly",
}  # fmt: skip


def written(line: str, form: str) -> str:
    done = urdfkin(*line.split(), "--format", form)
    assert done.code in (0, 1), done.err
    assert "error" not in done.err
    return done.text


@pytest.mark.parametrize("line", TABLES)
def test_a_table_is_written_in_every_format(line: str) -> None:
    named = "terminal" if line.startswith(("screws", "dh")) else "table"
    texts = {form: written(line, form) for form in (named, "markdown", "html", "latex")}
    assert [form for form, text in texts.items() if TABLES[line] not in text] == []
    assert "</" in texts["html"]
    assert "\\" in texts["latex"]
    json.loads(written(line, "json"))


@pytest.mark.parametrize(
    "line", [line for line in TABLES if line.split()[0] in ("robots", "info", "chain", "diff")]
)
def test_csv_rows_have_equal_length_and_negative_numbers_are_not_quoted(line: str) -> None:
    heads, *rows = csv.reader(io.StringIO(written(line, "csv")))
    assert rows
    assert {len(row) for row in rows} == {len(heads)}
    assert not any(cell.startswith("'-") and cell[2:3].isdigit() for row in rows for cell in row)


@pytest.mark.parametrize(
    ("suffix", "begin"), [(".txt", "ur5:"), (".md", "**ur5"), (".html", "<div>"), (".tex", "\\textbf")]
)
def test_the_suffix_of_a_file_selects_the_format_of_a_table(suffix: str, begin: str, tmp_path: Path) -> None:
    path = tmp_path / f"table{suffix}"
    done = urdfkin("jacobian ur5 -o", str(path))
    assert (done.code, done.out, done.err) == (0, b"", "")
    text = path.read_text()
    assert text.startswith(begin)
    assert "verified by Pinocchio" in text


def test_the_check_is_part_of_json_and_is_printed_on_stderr_for_csv() -> None:
    done = urdfkin("chain ur5 --format json")
    assert done.err == ""
    assert done.data["verified"] is True
    assert done.data["check"].startswith("Pinocchio")
    done = urdfkin("chain ur5 --format csv")
    assert done.err.startswith("Pinocchio")


@pytest.mark.parametrize("line", ["jacobian panda", "imu ur5", "chain ur5", "dh ur5 --base base --tip tool0"])
def test_an_unverified_result_is_marked_and_exits_with_3(line: str) -> None:
    done = urdfkin(f"{line} --no-verify")
    assert (done.code, "NOT VERIFIED" in done.text) == (3, True)
    if not line.startswith("dh"):
        assert urdfkin(f"{line} --no-verify --format json").data["verified"] is False


def test_an_entry_for_a_printed_format_replaces_the_document() -> None:
    answer = Answer(lambda: TextDocument("title"), {"html": lambda: "page"}, "checked")
    assert answer.convert("html") == ("page", False)
    assert answer.convert("table") == ("title\nchecked\n", True)


def test_a_document_has_matrices_code_and_emphasis_in_every_format() -> None:
    parts: list[str | Table | Matrix] = [CodeLine("T(i)"), "", Strong("sure")]
    parts.append(Matrix([["1", "-20"], ["300", "4"]]))
    document = TextDocument("", [*parts, Table(("a_b", "[m]"), [("c_d", -0.5)], names=(0,))])
    text, markdown, html, latex = (document.render(form) for form in ("table", "markdown", "html", "latex"))
    assert text.startswith("T(i)\n\nsure\n    1  -20\n  300    4\na_b   [m]\n")
    assert markdown.startswith("`T(i)`\n\n**sure**\n\n```\n  1  -20\n300    4\n```\n\n| a\\_b |")
    assert "| `c_d` | -0.5 |" in markdown
    assert html.count("<td") == 6
    assert r"\begin{bmatrix}1 & -20 \\ 300 & 4\end{bmatrix}" in latex


# -- suffixes --------------------------------------------------------------------------------------

ELBOW = str(Path(__file__).parents[2] / "robots" / "elbow.urdf")
WORDS = ("jacobian", "elbow", "--q", "random:2")


@pytest.mark.parametrize("suffix", ["npy", "json", "csv", "CSV"])
def test_a_suffix_writes_the_bytes_of_its_format(suffix: str, tmp_path: Path) -> None:
    good(*WORDS, "-o", str(tmp_path / f"J.{suffix}"))
    assert (tmp_path / f"J.{suffix}").read_bytes() == good(*WORDS, "--format", suffix.lower()).out


def test_the_format_option_applies_to_an_unknown_suffix_and_a_suffix_to_a_breakdown(tmp_path: Path) -> None:
    assert urdfkin(*WORDS, "--format", "json", "-o", str(tmp_path / "J.dat")).code == 0
    assert len(json.loads((tmp_path / "J.dat").read_text())["result"]) == 2
    assert urdfkin(*WORDS, "-o", str(tmp_path / "J")).code == 0
    assert (tmp_path / "J").read_text().startswith("sample,row,joint_1")
    words = ("acceleration", "elbow", "--breakdown", "--v", "random", "-o", str(tmp_path / "parts.json"))
    assert urdfkin(*words).code == 0
    assert json.loads((tmp_path / "parts.json").read_text())["quantity"] == "acceleration breakdown"


@pytest.mark.slow
def test_the_suffix_of_a_file_selects_the_format_of_a_dh_table(tmp_path: Path) -> None:
    starts = {"urdf": "<robot", "md": "**elbow: ", "tex": "\\begin{table}", "m": "% Kinematics of elbow"}
    for ending in ("toml", "json", "csv", "py", "c", *starts):
        good("dh elbow -o", str(tmp_path / f"t.{ending}"))
    rows = [read_table(tmp_path / f"t.{ending}").rows for ending in ("toml", "json", "csv")]
    assert rows[0] == rows[1] == rows[2]
    assert tomllib.loads((tmp_path / "t.toml").read_text())["convention"] == "standard"
    for ending, start in (starts | {"c": "/*"}).items():
        assert (tmp_path / f"t.{ending}").read_text().startswith(start), ending
    good("dh elbow --format roboticstoolbox -o", str(tmp_path / "r.py"))
    assert "roboticstoolbox" in (tmp_path / "r.py").read_text()
    assert "contradicts the file's suffix" in refused("dh elbow --format toml -o", str(tmp_path / "t.json"))


@pytest.mark.slow
def test_a_validation_states_the_verdict_and_the_written_files(tmp_path: Path) -> None:
    html, data = str(tmp_path / "r.html"), str(tmp_path / "r.json")
    done = urdfkin("validate elbow --samples 1 --html", html, "--json", data)
    *_, summary, wrote = done.text.splitlines()
    assert summary.startswith("verified: 1 robot, ")
    assert wrote == f"wrote {data}, {html}"


@pytest.mark.parametrize("style", ["terminal", "json"])
def test_an_unreadable_file_is_not_counted_as_checked(style: str, tmp_path: Path) -> None:
    done = urdfkin("check", ELBOW, str(tmp_path / "none.urdf"), "--format", style)
    assert done.code == 2
    if style == "json":
        assert done.data["files"] == [ELBOW]
    else:
        assert done.text == "no findings in 1 file\n"


# -- files are written completely or not at all ------------------------------------------------------


def test_writing_a_file_leaves_no_other_file_and_preserves_permissions(tmp_path: Path) -> None:
    place = tmp_path / "out.json"
    write_file(place, b"first")
    assert place.stat().st_mode & 0o777 == 0o666 & ~_umask()
    place.chmod(0o640)
    write_file(place, b"second")
    assert [path.name for path in tmp_path.iterdir()] == ["out.json"]
    assert (place.read_bytes(), place.stat().st_mode & 0o777) == (b"second", 0o640)


def full(*_: Any) -> NoReturn:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("where", ["chmod", "replace", "write"])
def test_an_incomplete_write_leaves_the_old_file_unchanged_and_no_other_file(
    where: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    original = tempfile.NamedTemporaryFile

    def full_disk(*words: Any, **how: Any) -> Any:
        stream = original(*words, **how)
        stream.write = full  # type: ignore[method-assign]
        return stream

    path = tmp_path / "out.json"
    path.write_text("before")
    if where == "write":
        monkeypatch.setattr(tempfile, "NamedTemporaryFile", full_disk)
    else:
        monkeypatch.setattr(Path, where, full)
    with pytest.raises(SourceError, match="No space left"):
        write_file(path, b"after")
    assert [file.name for file in tmp_path.iterdir()] == ["out.json"]
    assert path.read_bytes() == b"before"


def test_a_file_is_written_through_a_link_and_a_check_for_write_access_leaves_no_file(tmp_path: Path) -> None:
    check_writable(tmp_path / "out.json", None)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(SourceError, match="cannot be written"):
        check_writable(tmp_path / "no such folder" / "out.json")
    (tmp_path / "there").mkdir()
    link = tmp_path / "link.json"
    link.symlink_to(tmp_path / "there" / "out.json")
    check_writable(link)
    write_file(link, b"data")
    assert link.is_symlink()
    assert [path.name for path in (tmp_path / "there").iterdir()] == ["out.json"]


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def test_an_output_does_not_replace_an_input_file(tmp_path: Path) -> None:
    urdf = Path("robots/polar.urdf").read_text()
    robot, function = tmp_path / "arm.urdf", tmp_path / "f.py"
    for path in (robot, function):
        path.write_text(urdf)
    for words in (
        ["placement", robot, "--format", "json", "--output", robot],
        ["validate", robot, "--samples", "5", "--json", robot],
        ["export", robot, "--to", "c", "--output", robot],
        ["same", "polar", robot, "--html", robot],
        ["check", tmp_path, "--output", robot],
        ["check", robot, "--write-baseline", robot],
        ["verify", function, "polar", "--junit", function],
    ):
        done = urdfkin(*map(str, words))
        assert (done.code, "the output would replace the input" in done.err) == (2, True), words
    assert robot.read_text() == function.read_text() == urdf


def test_a_dash_writes_findings_to_standard_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Path("docs/examples/broken_arm.urdf").resolve()
    monkeypatch.chdir(tmp_path)
    assert "URDF507" in urdfkin("check", str(robot), "--output", "-").text
    assert not Path("-").exists()
