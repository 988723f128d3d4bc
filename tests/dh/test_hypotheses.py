"""For a misread table, the fitting interpretation is reported; for a table of another robot, none is."""

import json
import math
import re
import warnings
from pathlib import Path
from typing import Any

import pytest

from tests.cli.running import good, refused
from tests.cli.test_dh import UR5, run
from tests.dh.arms import CONVENTIONS, elbow, published
from tests.reading import present
from urdfkin.dh import DHTable, make_dh_table, read_table, table_from_rows
from urdfkin.dh.compare import TIP_TOLERANCE, find_better_interpretation
from urdfkin.dh.compare.hypotheses import find_table_warnings, other_interpretations, parse_interpretation
from urdfkin.dh.parse_table import reference_path
from urdfkin.dh.units import COLUMNS
from urdfkin.model.chain import make_chain
from urdfkin.robot.loading import load
from urdfkin.urdf.findings import UrdfWarning

SWAPPED_A_D = ("d", "alpha", "a", "theta")
SWAPPED_ANGLES = ("a", "theta", "d", "alpha")
TOOLBOX = ("theta", "d", "a", "alpha")
CRAIG = ("alpha", "a", "d", "theta")


def written(
    table: DHTable, convention: str, columns: tuple[str, ...] = COLUMNS, mm: bool = False, deg: bool = False
) -> dict[str, Any]:
    """Return the table's cells as a file that states only a convention, which may be wrong."""
    rows = []
    for row in table.rows:
        cells: dict[str, Any] = {name: getattr(row, name) for name in COLUMNS}
        if mm:
            cells |= {name: cells[name] * 1e3 for name in ("a", "d")}
        if deg:
            cells |= {name: math.degrees(cells[name]) for name in ("alpha", "theta")}
        rows.append([*(cells[name] for name in columns), "R" if row.kind.turns else "P"])
    return {"convention": convention, "rows": rows}


MISTAKES: dict[str, tuple[dict[str, Any], str]] = {
    "other convention": ({}, "{}"),
    "millimetres": ({"mm": True}, "{}, millimetres"),
    "degrees": ({"deg": True}, "{}, degrees"),
    "both units": ({"mm": True, "deg": True}, "{}, millimetres, degrees"),
    "a and d": ({"columns": SWAPPED_A_D}, "{}, its columns a, alpha, d, theta as d, alpha, a, theta"),
    "alpha, theta": ({"columns": SWAPPED_ANGLES}, "{}, its columns a, alpha, d, theta as a, theta, d, alpha"),
    "toolbox": ({"columns": TOOLBOX}, "{}, its columns a, alpha, d, theta as theta, d, a, alpha"),
    "Craig": ({"columns": CRAIG, "mm": True}, "{}, millimetres, its columns a, alpha, d, theta as alpha"),
}


@pytest.mark.slow
@pytest.mark.parametrize("mistake", MISTAKES)
@pytest.mark.parametrize("name", ["kinova", "panda", "ur5"])
def test_each_mistake_of_units_or_columns_is_named_with_the_wrong_convention(name: str, mistake: str) -> None:
    path, reference = published(name)
    options, words = MISTAKES[mistake]
    wrong = "modified" if str(reference.convention) == "standard" else "standard"
    found = present(find_better_interpretation(path, written(reference, wrong, **options), TIP_TOLERANCE))
    assert found.interpretation.differences(found.stated).startswith(words.format(reference.convention))
    assert found.metres <= 5.01e-5
    assert found.interpretation.difference_count(found.stated) <= 4


@pytest.mark.parametrize("kinds", ["RRPRRR", "PRRRRR"])
def test_wrong_units_are_named_for_an_arm_with_a_prismatic_joint(kinds: str) -> None:
    tree = elbow(kinds)
    found = present(
        find_better_interpretation(
            make_chain(tree, "tip"), written(make_dh_table(tree, "tip"), "standard", mm=True), 1e-6
        )
    )
    assert found.interpretation.differences(found.stated) == "millimetres"


@pytest.mark.slow
def test_a_table_of_a_different_robot_fits_no_interpretation() -> None:
    reference = read_table(reference_path("ur3"))
    path = load("ur5").chain("tool0", "base")
    assert find_better_interpretation(path, written(reference, "standard"), TIP_TOLERANCE, 0.3) is None
    assert (
        find_better_interpretation(
            path, written(table_from_rows([[0.1, 0, 0, 0]], "standard"), "standard"), 1e-4
        )
        is None
    )


@pytest.mark.parametrize("rows", [None, 3, ["abc"], [3.0]])
def test_an_invalid_table_has_no_other_interpretation(rows: Any) -> None:
    assert list(other_interpretations({"convention": "standard", "rows": rows})) == []


def test_interpretations_with_the_fewest_changes_are_tried_first() -> None:
    data = written(make_dh_table(elbow(), "tip"), "standard")
    stated = parse_interpretation(data)
    counts = [other.difference_count(stated) for other, _ in other_interpretations(data)]
    assert counts == sorted(counts)
    assert counts[0] == 1


@pytest.mark.slow
def test_a_comparison_names_the_fitting_interpretation_and_exits_with_1(tmp_path: Path) -> None:
    file = tmp_path / "ur5.toml"
    rows: list[list[float]] = [
        [0, 90, 89.159], [-425, 0, 0], [-392.25, 0, 0], [0, 90, 109.15], [0, -90, 94.65], [0, 0, 82.3],
    ]  # fmt: skip
    text = f"rows = {[[*row, 0] for row in rows]}\n"
    file.write_text('convention = "modified"\nangles = "degrees"\n' + text)
    result = run(*UR5, "--compare", str(file))
    assert result.code == 1
    assert "rad when it is read as standard, millimetres\n" in result.text
    file.write_text('convention = "standard"\n' + text)
    words = "more than one turn.*the table agrees with the URDF to .* read as millimetres, degrees"
    assert re.search(words, refused("dh", *UR5, "--compare", str(file)))
    # A variable in the column theta must not prevent the hint.
    lines = [",".join(map(str, [*row, f"q{k}"])) for k, row in enumerate(rows, 1)]
    for convention in ("convention: standard\n", ""):
        file = tmp_path / "ur5.csv"
        file.write_text(f"{convention}a,alpha,d,theta\n" + "\n".join(lines))
        assert re.search(words, refused("dh", *UR5, "--compare", str(file)))


def test_a_table_with_implausible_units_or_columns_causes_a_warning() -> None:
    deg = {"angles": "degrees"}
    assert (
        "look like numbers in radians"
        in find_table_warnings(table_from_rows([[0.4, 1.5708, 0, 0]], "standard", **deg))[0]
    )
    metres = table_from_rows([[0.4, 0, 0, 0]], "standard", lengths="mm")
    assert "so the numbers are probably metres" in find_table_warnings(metres)[0]
    exchanged = [{"a": 1.5708, "alpha": 0.4}, {"a": -1.5708, "alpha": 0.3}]
    assert "a and alpha look exchanged" in find_table_warnings(table_from_rows(exchanged, "standard"))[0]
    for name in ("kinova", "panda", "ur3", "ur5", "ur10", "xarm7_modified", "xarm7_standard"):
        assert find_table_warnings(read_table(reference_path(name))) == []


def test_loading_a_table_that_looks_like_millimetres_causes_a_warning() -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        load(table_from_rows([[425, 0, 0, 0], [392.25, 0, 0, 0]], "standard"), verify=False)
    assert "lengths up to 425 m look like numbers in millimetres" in str(caught[0].message)
    assert caught[0].category is UrdfWarning
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load(table_from_rows([[0.425, 0, 0, 0], [0.39225, 0, 0, 0]], "standard"), verify=False)


#: Cells a, alpha and d of the UR5; the modified convention writes a and alpha in the next row.
LINKS: list[list[Any]] = [[0, "pi/2"], [-0.425, 0], [-0.39225, 0], [0, "pi/2"], [0, "-pi/2"]]
OFFSETS = [0.089159, 0, 0, 0.10915, 0.09465, 0.0823]


def nameless(file: Path, convention: str) -> Path:
    links = [*LINKS, [0, 0]] if convention == "standard" else [[0, 0], *LINKS]
    rows = [[*link, d, 0] for link, d in zip(links, OFFSETS, strict=True)]
    file.write_text(f"rows = {json.dumps(rows)}\n")
    return file


@pytest.mark.slow
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_a_table_without_convention_is_compared_in_the_convention_that_fits(
    tmp_path: Path, convention: str
) -> None:
    words = "dh", *UR5, "--compare", str(nameless(tmp_path / "ur5.toml", convention))
    assert f"The table names no convention; {convention} fits best." in good(*words).text
    assert good(*words, "--format", "json").data["read_as"] == convention


@pytest.mark.slow
def test_a_table_without_convention_and_in_wrong_units_is_refused_with_the_units(tmp_path: Path) -> None:
    file = nameless(tmp_path / "ur5.toml", "modified")
    file.write_text(file.read_text().replace('"-pi/2"', "-90").replace('"pi/2"', "90"))
    words = "more than one turn.*the table agrees with the URDF to .* when it is read as degrees"
    assert re.search(words, refused("dh", *UR5, "--compare", str(file)))


def test_an_error_in_a_table_without_convention_is_reported_with_the_name_of_the_file(tmp_path: Path) -> None:
    file = tmp_path / "ur5.toml"
    file.write_text("rows = [[0, 0, 0, 'x']]\n")
    assert "ur5.toml, row 1, theta: this is not a number" in refused("dh", *UR5, "--compare", str(file))


@pytest.mark.slow
def test_a_table_that_fits_no_convention_is_refused_with_the_tip_errors(tmp_path: Path) -> None:
    file = nameless(tmp_path / "ur5.toml", "standard")
    said = refused("dh", "ur3", *UR5[1:], "--compare", str(file))
    assert re.search("and neither fits: found tip errors .* mm as standard and .* as modified", said)
    assert "the path have different joints" in refused("dh panda --compare", str(file))


@pytest.mark.slow
def test_a_mistake_in_a_table_without_convention_is_named_with_the_convention(tmp_path: Path) -> None:
    file = nameless(tmp_path / "ur5.toml", "standard")
    file.write_text(file.read_text().replace("0.425, 0", '0.425, "pi/2"'))
    result = run(*UR5, "--compare", str(file))
    assert result.code == 1
    assert "standard fits best" in result.text
    assert "row 2, shoulder_lift_joint: alpha = 0 rad, not pi/2" in result.text
