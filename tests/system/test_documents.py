"""Documents share one header; schemas are generated from the types that check documents from files."""

import copy
import json
from dataclasses import replace
from functools import cache
from operator import attrgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast

import pytest
from jsonschema import Draft202012Validator

import urdfkin
from tests.report.documents import arms, failing, hostile, run_on, saved
from urdfkin.comparison.certificate import SAME, certificate
from urdfkin.errors import InputError, SourceError
from urdfkin.report.compare import COMPARISON, compare
from urdfkin.report.history import HISTORY, read_history
from urdfkin.report.reading import check_document, read_document
from urdfkin.system.documents import DocumentKind, Header, as_data, as_json_data
from urdfkin.validation.accuracy import accuracy_study
from urdfkin.validation.campaign import validate
from urdfkin.validation.document import VALIDATION
from urdfkin.verify.certificate import CERTIFICATE

LAYOUTS: list[DocumentKind[Any]] = [VALIDATION, COMPARISON, HISTORY, SAME, CERTIFICATE]
of_every_layout = pytest.mark.parametrize("layout", LAYOUTS, ids=attrgetter("name"))


@cache
def _made(name: str) -> str:
    if name == SAME.name:
        return json.dumps(certificate(urdfkin.same("ur5", "ur5_limited", bounds=False), "urdfkin same"))
    if name == CERTIFICATE.name:
        robot = urdfkin.load("planar_two_link")
        robot.placement(robot.neutral(), "tip")
        robot.jacobian(robot.neutral(), "tip", verify=False)
        return json.dumps(robot.certificate().as_dict())
    if name == COMPARISON.name:
        new = arms()
        new["samples"] = 3
        return json.dumps(compare(arms(), new).as_dict("urdfkin compare"))
    if name == HISTORY.name:
        with TemporaryDirectory() as folder:
            for day in (1, 2):
                saved(Path(folder) / f"{day}.json", run_on(day, arms()))
            return json.dumps(read_history([Path(folder)]).as_dict("urdfkin report history"))
    return json.dumps(arms())


def made(layout: DocumentKind[Any]) -> Any:
    return json.loads(_made(layout.name))


def errors(schema: dict[str, Any], document: object) -> list[str]:
    found = Draft202012Validator(schema).iter_errors(document)
    return [f"{error.json_path}: {error.message}" for error in found]


@of_every_layout
def test_each_document_conforms_to_the_generated_schema_and_is_read_back_unchanged(
    layout: DocumentKind[Any], tmp_path: Path
) -> None:
    schema = json.loads(layout.schema_text())
    Draft202012Validator.check_schema(schema)
    assert errors(schema, made(layout)) == []
    (tmp_path / "document.json").write_text(json.dumps(made(layout)))
    assert layout.read(tmp_path / "document.json") == made(layout)


@of_every_layout
def test_each_document_begins_with_the_same_header(layout: DocumentKind[Any]) -> None:
    header = ["schema", "versions", "sha256", "verdict", "command"]
    assert list(Header.__annotations__) == header
    assert list(made(layout))[:5] == list(layout.schema()["properties"])[:5] == header
    assert {"urdfkin", "pin", "python"} <= made(layout)["versions"].keys()
    assert all(len(digest) == 64 for digest in made(layout)["sha256"])


@of_every_layout
def test_every_entry_of_a_schema_is_described(layout: DocumentKind[Any]) -> None:
    schema = layout.schema()
    for part in (schema, *schema["$defs"].values()):
        assert part["description"]
        for name, entry in part["properties"].items():
            assert "description" in entry or "$ref" in entry or name in ("metres", "radians"), name


@of_every_layout
@pytest.mark.parametrize(
    ("entry", "value", "said"),
    [
        ("versions", {"pin": 4}, "$.versions"),
        ("sha256", ["0"], "$.sha256[0]"),
        ("sha256", None, "$.sha256"),
        ("verdict", "fine", "$.verdict: 'fine' is none of"),
        ("command", 1, "$.command"),
    ],
)
def test_a_wrong_header_is_refused_with_the_place_and_what_to_do(
    layout: DocumentKind[Any], entry: str, value: object, said: str
) -> None:
    with pytest.raises(InputError) as error:
        layout.validate(made(layout) | {entry: value}, "a.json")
    assert str(error.value).startswith(f"a.json: does not conform to the layout {layout.name}: found $")
    assert said in str(error.value)
    assert error.value.remedy == f"write it again with: {layout.command}"
    schema = Draft202012Validator(layout.schema())
    assert not schema.is_valid(made(layout) | {entry: value})


@of_every_layout
def test_a_wrong_document_type_and_an_unknown_version_are_different_errors(layout: DocumentKind[Any]) -> None:
    family, _, version = layout.name.rpartition("/")
    with pytest.raises(InputError, match=f"unknown version of the layout {family}.*reads version {version}:"):
        layout.validate({"schema": f"{family}/99"}, "a.json")
    others: list[Any] = [None, [], "text", {}, {"schema": None}, {"schema": "other/1"}, {"schema": {"a": 1}}]
    for data in others:
        with pytest.raises(InputError, match=f"not a file with the layout {layout.name}.*write one with: "):
            layout.validate(data, "a.json")


@pytest.mark.parametrize("layout", [COMPARISON, HISTORY, SAME, CERTIFICATE], ids=attrgetter("name"))
def test_an_unknown_entry_of_a_certificate_is_refused_with_its_place(layout: DocumentKind[Any]) -> None:
    with pytest.raises(InputError, match=r"found \$: unknown entry 'more'"):
        layout.validate(made(layout) | {"more": 1}, "a.json")


def test_an_unknown_entry_at_any_depth_is_refused() -> None:
    document = made(SAME)
    document["remarks"][1]["words"] = "a sentence"
    with pytest.raises(InputError, match=r"found \$\.remarks\[1\]: unknown entry 'words'"):
        SAME.validate(document, "a.json")
    assert not Draft202012Validator(SAME.schema()).is_valid(document)


@pytest.mark.parametrize(
    "text", ["NaN", "-Infinity", "1e999", "[" * 100_000, "1" + "0" * 5000, "{", "", "\udc80", '"\x00']
)
@of_every_layout
def test_a_file_that_is_not_json_is_refused(layout: DocumentKind[Any], text: str, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(InputError, match="not a JSON file"):
        layout.read(path)


@of_every_layout
def test_a_page_instead_of_json_is_named(layout: DocumentKind[Any], tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    path.write_text("\n<!doctype html>")
    with pytest.raises(InputError, match="not a JSON file: found an HTML or XML file"):
        layout.read(path)


def test_serialized_data_has_no_infinity_and_preserves_names_that_are_not_valid_text() -> None:
    assert as_json_data({"a": (float("inf"), float("nan"), -0.0, "\udc80")}) == {
        "a": [None, None, -0.0, "\udc80"]
    }
    assert as_data({"a": float("inf")}) == {"a": float("inf")}


# -- reports of a validation --------------------------------------------------------------------------

REFUSED = b'<?xml version="1.0"?><robot name="r"><link name="a"/><joint name="j" type="bent"/></robot>'


def refused() -> Any:
    document: Any = validate(REFUSED, samples=1).as_dict()
    robot = document["robots"][0]
    assert robot["verdict"] == "bad input"
    assert robot["model"] is None
    assert {finding["severity"] for finding in robot["findings"]} >= {"error"}
    return document


def studied() -> Any:
    report = replace(
        validate("panda", samples=0), studies=(accuracy_study(urdfkin.load("panda"), samples=1),)
    )
    document: Any = report.as_dict()
    assert len(document["robots"][0]["accuracy"]["lines"]) > 5
    return document


@pytest.mark.slow
@pytest.mark.parametrize("make", [arms, failing, hostile, refused, studied])
def test_every_report_conforms_to_the_schema(make: Any) -> None:
    assert errors(VALIDATION.schema(), make()) == []


@pytest.mark.slow
def test_the_schema_describes_every_entry() -> None:
    strict = copy.deepcopy(VALIDATION.schema())
    for part in [strict, *strict["$defs"].values()]:
        if part.get("properties") and "additionalProperties" not in part:
            part["additionalProperties"] = False
    for document in (arms(), hostile()):
        assert errors(strict, document) == []


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
        check_document(document, "results.json")


def test_a_file_is_read_back_unchanged_and_unknown_entries_are_ignored(tmp_path: Path) -> None:
    document: Any = arms()
    document["robots"][0]["checks"][0]["later"] = document["later"] = {"a": 1}
    assert check_document(document, "results.json") == arms()
    with pytest.raises(SourceError, match="no such file"):
        read_document(tmp_path / "results.json")
    assert read_document(saved(tmp_path / "results.json", hostile())) == hostile()
