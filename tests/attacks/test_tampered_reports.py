"""An edited report is refused with its contradiction, or `report compare` names it: never a traceback."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.cli.running import Done, urdfkin
from tests.report.documents import arms, failing, hostile
from tests.robots import odd_urdfs
from urdfkin.report.reading import contradictions
from urdfkin.validation.campaign import validate


def _first(d: Any) -> Any:
    return d["robots"][0]


def _check(d: Any) -> Any:
    return _first(d)["checks"][1]


def _joint(d: Any) -> Any:
    return _first(d)["model"]["joints"][0]


def _set(entry: Callable[[Any], Any], **values: Any) -> Callable[[Any], None]:
    return lambda d: entry(d).update(values)


def _less(entry: Callable[[Any], Any], key: str) -> Callable[[Any], None]:
    return lambda d: entry(d).update({key: entry(d)[key] - 1})


def _delete(entry: Callable[[Any], Any], key: Any) -> Callable[[Any], None]:
    return lambda d: entry(d).__delitem__(key)


#: How a report of a run that passed is edited, and what is said against it.
EDITED: dict[str, tuple[Callable[[Any], None], str]] = {
    "verdict of the run": (
        _set(lambda d: d, verdict="not verified"),
        "`verdict` is not verified, but every robot was verified",
    ),
    "digest of a text": (
        lambda d: d["sha256"].__setitem__(0, 64 * "0"),
        "`sha256` differs from the digests of the robots",
    ),
    "no digest": (_set(lambda d: d, sha256=[]), "`sha256` differs from the digests of the robots"),
    "no command": (_set(lambda d: d, command=None), "`command` is missing"),
    "version of the oracle": (_delete(lambda d: d["versions"], "pin"), "`versions` has no version of pin"),
    "interrupted": (
        _set(lambda d: d, interrupted=True),
        "`verdict` is verified, but the validation was interrupted",
    ),
    "verdict": (_set(_first, verdict="not verified"), "there is no `reason`"),
    "disagrees": (_set(_first, verdict="disagrees"), "nothing lies outside its bound"),
    "reason": (_set(_first, reason="a reason"), "verified, but `reason` says"),
    "asked": (_set(lambda d: d, asked=5), "`verdict` is verified, but 3 of 5 robots without a report"),
    "asked for fewer": (_set(lambda d: d, asked=1), "`asked` is 1, but 2 robots"),
    "reason of the run": (_set(lambda d: d, reason="none"), "`reason` is none, but the run has passed"),
    "results": (_less(_check, "results"), "samples of"),
    "results of the robot": (_less(_first, "results"), "`results` is not "),
    "failed": (_set(_check, failed=1), "`failed` is 1 of"),
    "failed of the robot": (_set(_first, failed=1), "`failed` is not 0"),
    "samples": (_less(lambda d: d, "samples"), "`samples` is 9, but 8 samples were requested"),
    "samples of the robot": (_less(_first, "samples"), "only 8 of 9 samples"),
    "worst": (_set(_check, worst=0.5), "`worst` is 0.5, but"),
    "share, smaller": (_set(_check, share_of_bound=1e-9), "`share_of_bound` is 1e-09, but `worst` is"),
    "share, larger": (_set(_check, share_of_bound=0.99), "`share_of_bound` is 0.99, but `worst` is"),
    "share beyond": (_set(_check, share_of_bound=1.4), "but `share_of_bound` is 1.4"),
    "share, no number": (_set(_check, share_of_bound=None), "but `share_of_bound` is inf"),
    "bound": (_set(_check, bound=[1e9, 2e9]), "`bound` is 1e+09 to 2e+09"),
    "median": (_set(_check, median=1e9), "`median` is 1000000000.0, but"),
    "p99": (_set(_check, p99=0.0), "`p99` is 0.0, but"),
    "histogram": (lambda d: _check(d)["histogram"].reverse(), "not in the last bin of the histogram"),
    "histogram, shorter": (_delete(lambda d: _check(d)["histogram"], 0), "`histogram` does not contain"),
    "edges": (lambda d: d["histogram_edges"].reverse(), "`histogram_edges` are not in ascending order"),
    "no edges": (_set(lambda d: d, histogram_edges=[]), "`histogram_edges` are not in ascending order"),
    "worst by frame": (
        _delete(lambda d: _check(d)["worst_by_subject"], 0),
        "must have one entry for each of",
    ),
    "frame of the case": (
        _set(lambda d: _check(d)["worst_case"], frame="link:none"),
        "is not one of the compared frames",
    ),
    "disagreement of the case": (
        _set(lambda d: _check(d)["worst_case"], disagreement=1e6),
        "`worst_case` has 1000000.0 at",
    ),
    "smaller case": (
        _set(lambda d: _check(d)["worst_case"], disagreement=0.0),
        "`worst_case`: the disagreement 0 is not",
    ),
    "q of the case": (_delete(lambda d: _check(d)["worst_case"]["q"], 0), "the length of q, v or a differs"),
    "sample of the case": (_set(lambda d: _check(d)["worst_case"], sample=99), "no sample 99 among 9"),
    "no case": (_set(_check, worst_case=None), "`worst_case` is missing, but something disagrees"),
    "a check twice": (lambda d: _first(d)["checks"].append(_check(d)), "a quantity occurs twice"),
    "no model": (_set(_first, model=None), "`model` is missing, but something was compared"),
    "a frame less": (
        _delete(lambda d: _first(d)["frames"], 0),
        "`joints` or `frames` differ from those of the model",
    ),
    "a joint less": (
        _delete(lambda d: _first(d)["joints"], 0),
        "`joints` or `frames` differ from those of the model",
    ),
    "a joint of the model less": (
        _delete(lambda d: _first(d)["model"]["joints"], 0),
        "`links` of `model` must be",
    ),
    "a parent that is none": (
        _set(_joint, parent="nowhere"),
        "parent link nowhere must come before the joint",
    ),
    "a parent that comes later": (
        lambda d: _joint(d).update(parent=_first(d)["model"]["links"][3]),
        "must come before the joint",
    ),
    "a name twice": (
        lambda d: _joint(d).update(name=_first(d)["model"]["joints"][1]["name"]),
        "a name occurs twice",
    ),
    "a long axis": (_set(_joint, axis=[0.0, 0.0, 2.0]), "is not a unit vector"),
    "no axis": (_set(_joint, axis=None), "must have an axis"),
    "kind": (_set(_joint, kind="fixed", axis=None), "`joints` or `frames` differ from those of the model"),
    "sheared placement": (
        lambda d: _joint(d)["placement"][0].__setitem__(0, 3.0),
        "its placement is not a rigid transform",
    ),
    "q index": (_set(_joint, q=4), "wrong index in q or v"),
    "v index": (_set(_joint, v=None), "wrong index in q or v"),
    "nq": (_set(lambda d: _first(d)["model"], nq=3), "coordinates and"),
    "coordinates": (_delete(lambda d: _first(d)["model"]["coordinates"], 0), "coordinates and"),
    "leader": (
        _set(_joint, mimic={"leader": "nobody", "multiplier": 1.0, "offset": 0.0}),
        "it cannot mimic nobody",
    ),
    "tip": (_set(lambda d: _first(d)["model"], tip="nowhere"), "no frame nowhere"),
    "base of a table": (_set(lambda d: _first(d)["chains"][0], base="nowhere"), "no frame nowhere"),
    "joint of a table": (
        _set(lambda d: _first(d)["chains"][0]["standard"]["rows"][0], joint="none"),
        "no revolute joint none",
    ),
    "share of a table": (
        _set(lambda d: _first(d)["chains"][0], share_of_bound=3.0),
        "verified, but something lies outside its bound",
    ),
    "a second reader that differs": (
        _set(lambda d: _first(d)["second_reader"], differences=["joint j: axis"]),
        "verified, but something",
    ),
    "a table not compared": (_set(lambda d: _first(d)["chains"][0], samples=0), "but were not compared"),
}


def written(document: Any, path: Path) -> Path:
    path.write_text(json.dumps(document))
    return path


def run(*words: str | Path) -> Done:
    done = urdfkin(*map(str, words))
    assert "Traceback" not in done.err, done.err
    return done


@pytest.mark.slow
@pytest.mark.parametrize("name", EDITED)
def test_a_report_that_contradicts_itself_is_refused_with_what_contradicts(name: str, tmp_path: Path) -> None:
    edit, words = EDITED[name]
    document = arms()
    edit(document)
    assert any(words in said for said in contradictions(document)), list(contradictions(document))
    path, good = written(document, tmp_path / "edited.json"), written(arms(), tmp_path / "good.json")
    for command in (("report", path), ("report", "compare", good, path), ("report", "compare", path, good)):
        done = run(*command)
        assert done.code == 2, done.text
        assert f"{path}: the report contradicts itself: found " in done.err
    assert words in done.err or len(list(contradictions(document))) > 3


@pytest.mark.parametrize("make", [arms, hostile, failing])
def test_what_validate_writes_does_not_contradict_itself(make: Callable[[], Any]) -> None:
    assert list(contradictions(make())) == []


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
def test_no_odd_robots_report_contradicts_itself() -> None:
    texts = [odd_urdfs.urdf_of(name) for name in odd_urdfs.NAMES]
    report = validate([*texts, "nonsense", "talos"], samples=30)
    assert list(contradictions(json.loads(json.dumps(report.as_dict())))) == []


def _turned(d: Any) -> None:
    joint = _joint(d)
    joint["axis"] = [-x for x in joint["axis"]]


def _moved(d: Any) -> None:
    _joint(d)["placement"][0][3] += 0.1


@pytest.mark.slow
@pytest.mark.parametrize(("edit", "what"), [(_turned, "axis"), (_moved, "origin")])
def test_another_axis_or_place_is_told_as_a_change_of_the_robot(
    edit: Callable[[Any], None], what: str, tmp_path: Path
) -> None:
    document = arms()
    edit(document)
    done = run(
        "report", "compare", written(arms(), tmp_path / "a.json"), written(document, tmp_path / "b.json")
    )
    assert done.code == 0
    assert f"panda: joint {_joint(arms())['name']}, {what}: " in done.text


@pytest.mark.parametrize(
    "text", ["NaN", "Infinity", "-Infinity", "1e999", "[" * 100_000, '{"seed": 1' + "0" * 5000]
)
@pytest.mark.parametrize("command", ["show", "compare"])
def test_json_that_no_document_can_be_is_refused(text: str, command: str, tmp_path: Path) -> None:
    path = tmp_path / "odd.json"
    path.write_text(json.dumps(arms()).replace('"seconds": ', f'"seconds": {text}, "other": ', 1))
    done = run("report", command, *([path] if command == "show" else [path, path]))
    assert done.code == 2
    assert "not a JSON file" in done.err


@pytest.mark.parametrize("source", ["ur5", "panda"])
def test_a_robot_that_was_validated_twice_is_reported_twice(source: str, tmp_path: Path) -> None:
    document = arms()
    for robot in document["robots"]:
        robot["source"] = source
    done = run("report", written(document, tmp_path / "twice.json"))
    assert done.code == 0, done.err
