"""An edited report is refused with the contradiction, or `report compare` shows the change."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.cli.running import good, refused
from tests.report.documents import arms, failing, hostile
from tests.robots import odd_urdfs
from urdfkin.report.reading import contradictions
from urdfkin.validation.campaign import validate

#: Path of each edited part of a report.
PLACES = {
    "run": (), "robot": ("robots", 0), "check": ("robots", 0, "checks", 1), "model": ("robots", 0, "model"),
    "case": ("robots", 0, "checks", 1, "worst_case"), "joint": ("robots", 0, "model", "joints", 0),
    "next joint": ("robots", 0, "model", "joints", 1), "chain": ("robots", 0, "chains", 0),
    "row": ("robots", 0, "chains", 0, "standard", "rows", 0),
}  # fmt: skip
LESS, GONE = "one less", "left out"
#: Edits of a report of a passed run (place, entry, new value), each with a part of the contradiction.
EDITED: list[tuple[str, Any, Any, str]] = [
    ("run", "verdict", "not verified", "`verdict` is not verified, but every robot was verified"),
    ("run", ("sha256", 0), "0" * 64, "`sha256` differs from the digests of the robots"),
    ("run", "sha256", [], "`sha256` differs from the digests of the robots"),
    ("run", "command", None, "`command` is missing"),
    ("run", "interrupted", True, "`verdict` is verified, but the validation was interrupted"),
    ("run", "robots_requested", 5, "`verdict` is verified, but 3 of 5 robots without a report"),
    ("run", "robots_requested", 1, "`robots_requested` is 1, but 2 robots"),
    ("run", "reason", "none", "`reason` is none, but the run has passed"),
    ("run", "samples", LESS, "`samples` is 9, but 8 samples were requested"),
    ("run", "histogram_edges", reversed, "`histogram_edges` are not in ascending order"),
    ("run", "histogram_edges", [], "`histogram_edges` are not in ascending order"),
    ("run", ("versions", "pin"), GONE, "`versions` has no version of pin"),
    ("robot", "verdict", "not verified", "there is no `reason`"),
    ("robot", "verdict", "disagrees", "nothing lies outside its bound"),
    ("robot", "reason", "a reason", "verified, but `reason` says"),
    ("robot", "results", LESS, "but the sum over the robot's checks is "),
    ("robot", "failed", 1, "`failed` is 1, but the sum over the robot's checks is 0"),
    ("robot", "samples", LESS, "only 8 of 9 samples"),
    ("robot", "checks", lambda checks: [*checks, checks[1]], "a quantity occurs twice"),
    ("robot", "model", None, "`model` is missing, but `checks` or `chains` is not empty"),
    ("robot", ("frames", 0), GONE, "`joints` or `frames` differ from those of the model"),
    ("robot", ("joints", 0), GONE, "`joints` or `frames` differ from those of the model"),
    ("robot", ("second_reader", "differences"), ["joint j: axis"], "verified, but something"),
    ("check", "results", LESS, "samples of"),
    ("check", "failed", 1, "`failed` is 1 of"),
    ("check", "worst", 0.5, "`worst` is 0.5, but"),
    ("check", "bound_ratio", 1e-9, "`bound_ratio` is 1e-09, but `worst` is"),
    ("check", "bound_ratio", 0.99, "`bound_ratio` is 0.99, but `worst` is"),
    ("check", "bound_ratio", 1.4, "but `bound_ratio` is 1.4"),
    ("check", "bound_ratio", None, "but `bound_ratio` is inf"),
    ("check", "bound", [1e9, 2e9], "`bound` is 1e+09 to 2e+09"),
    ("check", "median", 1e9, "`median` is 1000000000.0, but"),
    ("check", "p99", 0.0, "`p99` is 0.0, but"),
    (
        "check",
        "histogram",
        reversed,
        "but the last bin of `histogram` with results does not contain this value",
    ),
    ("check", ("histogram", 0), GONE, "`histogram` has "),
    ("check", ("worst_by_subject", 0), GONE, "must have one entry for each of"),
    ("check", "worst_case", None, "`worst_case` is missing, but `worst` is "),
    ("case", "frame", "link:none", "is not one of the compared frames"),
    ("case", "disagreement", 1e6, "`worst_case` has 1000000.0 at"),
    ("case", "disagreement", 0.0, "`worst_case`: the disagreement 0 is not"),
    ("case", ("q", 0), GONE, "the length of q, v or a differs"),
    ("case", "sample", 99, "no sample 99 among 9"),
    ("model", ("joints", 0), GONE, "`links` of `model` must be"),
    ("model", "nq", 3, "coordinates and"),
    ("model", ("coordinates", 0), GONE, "coordinates and"),
    ("model", "tip", "nowhere", "no frame nowhere"),
    ("joint", "parent", "nowhere", "parent link nowhere must come before the joint"),
    ("joint", "parent", "panda_link3", "must come before the joint"),
    ("next joint", "name", "panda_joint1", "a name occurs twice"),
    ("joint", "axis", [0.0, 0.0, 2.0], "is not a unit vector"),
    ("joint", "axis", None, "must have an axis"),
    ("joint", "kind", "fixed", "`joints` or `frames` differ from those of the model"),
    ("joint", ("placement", 0, 0), 3.0, "its placement is not a rigid transform"),
    ("joint", "q", 4, "wrong index in q or v"),
    ("joint", "v", None, "wrong index in q or v"),
    (
        "joint",
        "mimic",
        {"mimicked_joint": "nobody", "multiplier": 1.0, "offset": 0.0},
        "it cannot mimic nobody",
    ),
    ("chain", "base", "nowhere", "no frame nowhere"),
    ("chain", "bound_ratio", 3.0, "verified, but something lies outside its bound"),
    ("chain", "samples", 0, "`samples` is 0, but `metres`, `worst` or `bound_ratio` has a value"),
    ("row", "joint", "none", "no revolute joint none"),
]


def entry(document: Any, *place: Any) -> Any:
    for key in place:
        document = document[key]
    return document


def edit(document: Any, place: str, name: Any, value: Any) -> None:
    *path, key = name if isinstance(name, tuple) else (name,)
    home = entry(document, *PLACES[place], *path)
    if value == GONE:
        del home[key]
    elif value == LESS:
        home[key] -= 1
    elif callable(value):
        home[key] = list(value(home[key]))
    else:
        home[key] = value


def written(document: Any, path: Path) -> Path:
    path.write_text(json.dumps(document))
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "name", "value", "words"), EDITED, ids=[f"{row[0]} {row[1]}: {row[3]}" for row in EDITED]
)
def test_a_report_that_contradicts_itself_is_refused_with_the_contradiction(
    place: str, name: Any, value: Any, words: str, tmp_path: Path
) -> None:
    document = arms()
    edit(document, place, name, value)
    assert any(words in line for line in contradictions(document)), list(contradictions(document))
    path, right = written(document, tmp_path / "edited.json"), written(arms(), tmp_path / "right.json")
    for command in (("report", path), ("report", "compare", right, path), ("report", "compare", path, right)):
        err = refused(*map(str, command))
        assert f"{path}: the report contradicts itself: found " in err
    assert words in err or len(list(contradictions(document))) > 3


def odd() -> Any:
    texts = [odd_urdfs.urdf_of(name) for name in odd_urdfs.NAMES]
    report = validate([*texts, "nonsense", "talos"], samples=30)
    return json.loads(json.dumps(report.as_dict()))


@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
@pytest.mark.parametrize("make", [arms, hostile, failing, pytest.param(odd, marks=pytest.mark.slow)])
def test_a_report_of_validate_does_not_contradict_itself(make: Callable[[], Any]) -> None:
    assert list(contradictions(make())) == []


@pytest.mark.slow
@pytest.mark.parametrize("what", ["axis", "origin"])
def test_a_changed_axis_or_origin_is_a_change_of_the_robot(what: str, tmp_path: Path) -> None:
    document: Any = arms()
    joint = entry(document, *PLACES["joint"])
    if what == "axis":
        joint["axis"] = [-x for x in joint["axis"]]
    else:
        joint["placement"][0][3] += 0.1
    old, new = written(arms(), tmp_path / "a.json"), written(document, tmp_path / "b.json")
    assert f"panda: joint {joint['name']}, {what}: " in good("report compare", str(old), str(new)).text


@pytest.mark.parametrize(
    "text", ["NaN", "Infinity", "-Infinity", "1e999", "[" * 100_000, '{"seed": 1' + "0" * 5000]
)
@pytest.mark.parametrize("command", ["show", "compare"])
def test_invalid_json_is_refused(text: str, command: str, tmp_path: Path) -> None:
    path = tmp_path / "odd.json"
    path.write_text(json.dumps(arms()).replace('"seconds": ', f'"seconds": {text}, "other": ', 1))
    files = [str(path)] * (1 if command == "show" else 2)
    assert "not a JSON file" in refused("report", command, *files)


@pytest.mark.parametrize("source", ["ur5", "panda"])
def test_a_robot_that_was_validated_twice_is_reported_twice(source: str, tmp_path: Path) -> None:
    document = arms()
    for robot in document["robots"]:
        robot["source"] = source
    good("report", str(written(document, tmp_path / "twice.json")))
