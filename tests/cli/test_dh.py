"""`urdfkin dh` prints and converts tables with their check, and compares tables."""

from pathlib import Path

import pytest

from tests.cli.running import Done, good, urdfkin
from urdfkin.cli.dh import FORMATS
from urdfkin.dh.export import FORMATS as EXPORTED

UR5 = ("ur5", "--base", "base", "--tip", "tool0")


def run(*words: str) -> Done:
    return urdfkin("dh", *words)


def test_dh_prints_the_table_with_the_check_and_has_every_format_of_the_package() -> None:
    text = good("dh", *UR5, "--snap", "1e-6", "--degrees", "--millimetres").text
    assert "ur5: base to tool0, standard Denavit-Hartenberg parameters" in text
    assert "2  shoulder_lift_joint     -425            0       0           q2" in text
    assert "turns by at most" in text
    assert "prismatic" not in text  # the ur5 has none
    assert "agrees within rounding and snapping" in text
    assert set(FORMATS) == {*EXPORTED, "urdf", "svg"}
    page = (Path(__file__).parents[2] / "docs" / "dh.md").read_text()
    command, shown = page.split("```console\n$ urdfkin dh ")[1].split("```")[0].split("\n", 1)
    assert run(*command.split()).text.startswith(shown)


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMATS)
def test_dh_writes_a_table_in_every_format(form: str, tmp_path: Path) -> None:
    if form == "svg":
        pytest.importorskip("matplotlib")
    good("dh", *UR5, "--format", form, "--snap", "1e-6", "-o", str(tmp_path / "table"))
    assert "ur5" in (tmp_path / "table").read_text()


@pytest.mark.slow
def test_a_written_table_can_be_read_compared_and_converted(tmp_path: Path) -> None:
    file = str(tmp_path / "arm.toml")
    run(*UR5, "--snap", "1e-6", "--format", "toml", "-o", file)
    text = good("dh", file, "--convention", "modified").text
    assert "base to tool0, modified" in text
    assert "3  elbow_joint" in text
    assert run(*UR5, "--compare", file).code == 0
    assert run(file, "--format", "urdf").text.startswith('<robot name="ur5"')


@pytest.mark.parametrize(
    "names", ['joint = "base"', 'joint = "tip"', 'joint = "j"}]\nbase_frame = "x"\ntip_frame = "x" #']
)
def test_a_table_with_equal_names_of_joints_and_frames_is_checked(names: str, tmp_path: Path) -> None:
    file = tmp_path / "arm.toml"
    file.write_text(f'convention = "standard"\nrows = [{{a = 0.3, {names}}}]\n')
    for options in ([], ["--snap", "1e-6"]):
        assert "agrees within rounding" in good("dh", str(file), *options).text


def test_a_comparison_does_not_hide_that_mimic_rules_are_not_compared(tmp_path: Path) -> None:
    table, urdf = tmp_path / "arm.toml", str(tmp_path / "arm.urdf")
    rows = '{{joint = "a", a = 1}}, {{joint = "b", a = 1, mimic = {{mimicked_joint = "a", multiplier = {}}}}}'
    lines = f'convention = "standard"\nrows = [{rows}]\n'
    table.write_text(lines.format(2))
    good("dh", str(table), "--format", "urdf", "-o", urdf)
    table.write_text(lines.format(3))
    assert "mimic rules of the table are not compared" in good("dh", urdf, "--compare", str(table)).text
    data = good("dh", urdf, "--compare", str(table), "--format", "json").data
    assert {"row": 2, "cell": "mimic"} in data["not_compared"]


@pytest.mark.parametrize("words", ["dh ur5 --compare ur5 --tolerance -1", "structure kinova --opw -1"])
def test_a_negative_tolerance_is_refused(words: str) -> None:
    refused = urdfkin(words)
    assert (refused.code, "-1.0 is not in the range x>=0" in refused.err) == (2, True)


def test_dh_all_prints_a_table_for_each_leaf() -> None:
    assert good("dh solo12 --all").text.count("standard Denavit-Hartenberg parameters") == 4
    documents = run("solo12", "--all", "--format", "json").data
    assert [one["tip_frame"] for one in documents] == ["FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"]
    assert all("agrees within rounding" in one["checked"] for one in documents)


@pytest.mark.parametrize("form", ["terminal", "markdown", "csv", "json"])
def test_dh_tree_prints_the_whole_tree_as_one_table(form: str) -> None:
    result = good("dh solo12 --tree --format", form)
    assert "eps*scale" in result.text + result.err
    assert "FL_HFE" in result.text


@pytest.mark.slow
def test_the_exit_code_of_a_comparison_is_the_verdict() -> None:
    assert "agrees exactly" in good("dh ur5 --compare ur5").text
    wrong = urdfkin("dh ur5 --compare ur3 --base base --tip tool0")
    assert (wrong.code, "DIFFERS" in wrong.text) == (1, True)
    data = urdfkin("dh kinova --compare kinova --format json").data
    assert data["agrees"]
    assert [one["cell"] for one in data["differences"]] == ["d"]
