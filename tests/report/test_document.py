"""The JSON document conforms to the published schema, and other documents are refused."""

import copy
import json
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest
from jsonschema import Draft202012Validator

from tests.report.documents import arms, failing, hostile
from urdfkin.errors import InputError, SourceError
from urdfkin.report.reading import checked, read_document
from urdfkin.robot.loading import load
from urdfkin.validation.accuracy import accuracy_study
from urdfkin.validation.campaign import validate
from urdfkin.validation.document import VALIDATION

REFUSED = b'<?xml version="1.0"?><robot name="r"><link name="a"/><joint name="j" type="bent"/></robot>'


def errors(document: object) -> list[str]:
    found = Draft202012Validator(VALIDATION.schema()).iter_errors(document)
    return [f"{error.json_path}: {error.message}" for error in found]


def refused() -> Any:
    document: Any = validate(REFUSED, samples=1).as_dict()
    robot = document["robots"][0]
    assert robot["verdict"] == "bad input"
    assert robot["model"] is None
    assert {finding["severity"] for finding in robot["findings"]} >= {"error"}
    return document


def studied() -> Any:
    report = replace(validate("panda", samples=0), studies=(accuracy_study(load("panda"), samples=1),))
    document: Any = report.as_dict()
    assert len(document["robots"][0]["judge"]["lines"]) > 5
    return document


@pytest.mark.slow
@pytest.mark.parametrize("make", [arms, failing, hostile, refused, studied])
def test_every_report_conforms_to_the_schema(make: Any) -> None:
    assert errors(make()) == []


@pytest.mark.slow
def test_the_schema_describes_every_entry() -> None:
    strict = copy.deepcopy(VALIDATION.schema())
    for part in [strict, *strict["$defs"].values()]:
        if part.get("properties") and "additionalProperties" not in part:
            part["additionalProperties"] = False
    for document in (arms(), hostile()):
        assert [e.message for e in Draft202012Validator(strict).iter_errors(document)] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "spoil",
    [
        lambda d: d.pop("seed"),
        lambda d: d["robots"][0].pop("verdict"),
        lambda d: d["robots"][0]["checks"][0].update(results="many"),
        lambda d: d["robots"][0].update(verdict="fine"),
        lambda d: d["robots"][0]["model"]["joints"][0].update(placement=[[1.0]]),
        lambda d: d["robots"][0]["model"].update(sha256="0123"),
        lambda d: d["robots"][0]["checks"][0].update(worst=10**400),
        lambda d: d["robots"][0]["checks"][0].update(results=True),
        lambda d: d["robots"][0]["checks"][0].update(worst=-1.0),
        lambda d: d["robots"][0]["chains"][0]["standard"]["rows"][0].update(sense=2),
        lambda d: d["versions"].update(urdfkin=1),
        lambda d: d.update(verdict="fine"),
    ],
)
def test_a_document_with_a_wrong_entry_is_refused(spoil: Any) -> None:
    document = cast("dict[str, Any]", arms())
    spoil(document)
    with pytest.raises(InputError, match=r"does not conform to the layout urdfkin-validation/1: found \$"):
        checked(document, "results.json")


def test_a_file_is_read_back_unchanged_and_unknown_entries_are_ignored(tmp_path: Path) -> None:
    document: Any = arms()
    document["robots"][0]["checks"][0]["later"] = document["later"] = {"a": 1}
    assert checked(document, "results.json") == arms()
    path = tmp_path / "results.json"
    with pytest.raises(SourceError, match="cannot be read"):
        read_document(path)
    path.write_text(json.dumps(hostile()))
    assert read_document(path) == hostile()
