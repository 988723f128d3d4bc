"""No name adds an element, an attribute, a script or a line to any form that urdfkin writes.

The structure of a parsed text with hostile names is compared with the structure with harmless names.
"""

import ast
import json
import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, cast

import jsonschema
import pytest
from lxml import etree
from markdown_it import MarkdownIt

import urdfkin
from tests.attacks.hostile import IN_XML, NAMES, chain_of_all, urdf
from tests.attacks.test_exported_names import code_alone
from tests.markup import Page
from urdfkin.dh import DHTable, export
from urdfkin.dh.parse_table import read_table
from urdfkin.dh.tree_parameters import make_tree_parameters, tree_document
from urdfkin.dh.units import Units
from urdfkin.errors.escape import csv_cell, from_csv_cell, markdown_code, markdown_text
from urdfkin.errors.escape import latex_text as escaped
from urdfkin.export import write as code_text
from urdfkin.export.forms import make_chain_code
from urdfkin.report.compare import compare, markdown_of
from urdfkin.report.html import as_html
from urdfkin.report.junit import as_junit
from urdfkin.report.markdown import as_markdown
from urdfkin.validation.campaign import validate
from urdfkin.validation.document import VALIDATION, Document
from urdfkin.view.dh_drawing import draw_table_svg

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::urdfkin.urdf.findings.UrdfWarning")]


def tame(name: str) -> str:
    return f"n{list(NAMES.values()).index(name)}"


def same(name: str) -> str:
    return name


@cache
def _report(called: Callable[[str], str]) -> str:
    """Return the report of a robot with all names that XML allows, and of a failed robot for each name."""
    names = [called(name) for name in IN_XML.values()]
    document: Any = validate([chain_of_all(names, called(NAMES["line"]))], samples=1).as_dict()
    whole = document["robots"][0]
    refused = {**whole, "checks": [], "joints": [], "frames": [], "chains": [], "model": None, "results": 0}
    document["robots"] += [
        {**refused, "name": n, "source": n, "reason": f"{n}: no\n  {n}: yes", "verdict": "bad input"}
        for n in map(called, NAMES.values())
    ]
    whole["source"] = called(NAMES["colours"])
    failed = whole["checks"][0]
    failed["failed"] = 1
    # Both names have the same width, because the number of ticks of the plot depends on the width.
    whole["checks"][2] |= {"quantity": "<b>|`\x1b" if called is same else "abcdefghij"}
    failed["worst_case"] |= {"replay": called(NAMES["code"]), "frame": called(NAMES["line"])}
    document |= {"verdict": "disagrees", "command": called(NAMES["code"])}
    document |= {"started": called(NAMES["end of data"])}
    document["versions"] = {key: called(NAMES["script"]) for key in document["versions"]}
    return json.dumps(document)


def report(called: Callable[[str], str]) -> Document:
    return cast("Document", json.loads(_report(called)))


def test_the_html_and_junit_forms_of_a_report_have_the_same_elements_with_any_names() -> None:
    jsonschema.validate(report(same), VALIDATION.schema())
    hostile, plain = (Page(as_html(report(called))) for called in (same, tame))
    assert hostile.skeleton == plain.skeleton
    data = [script for script in hostile.scripts if script.lstrip().startswith(("{", "["))]
    links = [json.loads(script)["links"] for script in data if '"links"' in script]
    assert links == [["base", *IN_XML.values()]]
    code = [[s for s in page.scripts if not s.lstrip().startswith(("{", "["))] for page in (hostile, plain)]
    assert code[0] == code[1]
    trees = [etree.fromstring(as_junit(report(called))) for called in (same, tame)]
    skeletons = [[(element.tag, sorted(element.attrib)) for element in tree.iter()] for tree in trees]
    assert skeletons[0] == skeletons[1]


@pytest.mark.parametrize("html", [True, False])
def test_a_report_in_markdown_has_the_same_elements_with_any_names(html: bool) -> None:
    for write in (as_markdown, _compared):
        hostile, plain = (write(report(called)) for called in (same, tame))
        assert hostile.count("\n") == plain.count("\n")
        assert rendered(hostile, html).skeleton == rendered(plain, html).skeleton
        assert not re.search(r"@\w|://|www\.|#\d", rendered(hostile, html).prose)


def _compared(document: Document) -> str:
    """Return the comparison with a report of only the first robot."""
    empty: Any = {**document, "robots": document["robots"][:1]}
    return markdown_of(document, empty, compare(document, empty))


def rendered(text: str, html: bool) -> Page:
    parser = MarkdownIt("commonmark", {"html": html}).enable(["table", "strikethrough"])
    return Page(str(parser.render(text)))


@cache
def _table() -> DHTable:
    return urdfkin.load("planar_two_link").dh()


def table(name: str) -> DHTable:
    rows = tuple(replace(row, joint=f"{name} {i}") for i, row in enumerate(_table().rows))
    return replace(_table(), robot=name, base_frame=name, tip_frame=name, rows=rows)


@pytest.mark.parametrize("kind", IN_XML)
def test_a_report_of_snapped_values_has_the_same_elements_with_any_name(kind: str) -> None:
    def page(name: str) -> Page:
        text = urdf(name).replace('<origin xyz="0.3 0 0"/>', '<origin xyz="0.3 0 0" rpy="1.5708 0 0"/>')
        snapped = urdfkin.load(text).dh(snap=1e-3)
        assert snapped.snap is not None
        assert snapped.snap.changes
        return rendered(export(snapped, "markdown"), True)

    assert page(IN_XML[kind]).skeleton == page("tame_name").skeleton


def structure(name: str, form: str) -> Any:
    """Return an exported table without its names: elements of Markdown, code, or the number of lines."""
    text = export(table(name), form)
    if form == "latex":
        return text.count("\n")
    if form == "markdown":
        pages = [rendered(text, html) for html in (True, False)]
        assert not any(re.search(r"@\w|://|www\.", page.prose) for page in pages)
        return [page.skeleton for page in pages]
    if form.startswith("matlab"):
        first, *lines = text.split("\n")
        assert re.fullmatch(r"function (\w+|\[T, q\]) = \w+\(\)", first)
        return [re.sub("'[^']*'", "''", line) for line in lines if not line.startswith("%")]
    tree = ast.parse(text)
    constants = [node for node in ast.walk(tree) if isinstance(node, ast.Constant)]
    words = {constant.value for constant in constants}
    assert name.isidentifier() or name not in words or not name.isascii() or name.isprintable()
    for constant in constants:
        constant.value = "" if isinstance(constant.value, str) else constant.value
    return ast.dump(tree)


FORMS = ("markdown", "latex", "sympy", "roboticstoolbox", "ets", "matlab-symbolic", "matlab-rst")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", NAMES)
def test_an_exported_table_has_the_same_structure_with_any_name(kind: str, form: str) -> None:
    assert structure(NAMES[kind], form) == structure("tame_name", form)


@pytest.mark.parametrize("kind", NAMES)
def test_a_name_in_markdown_is_one_code_element_or_one_paragraph(kind: str) -> None:
    cell = rendered(f"| a | b |\n| --- | --- |\n| {markdown_code(NAMES[kind])} | x |\n", True)
    tags = [tag for tag, _ in cell.skeleton if tag in ("td", "code", "tr")]
    assert tags == ["tr", "tr", "td", "code", "td"]
    prose = rendered(markdown_text(NAMES[kind]), True)
    assert prose.skeleton == [("p", ()), ("/p", ())]
    assert not re.search(r"@\w|://|www\.|#\d", prose.prose)


@pytest.mark.parametrize("form", ["markdown", "terminal"])
def test_a_table_of_the_whole_tree_has_the_same_lines_with_any_names(form: str) -> None:
    texts = [
        tree_document(make_tree_parameters(urdfkin.load(chain_of_all(names, names[0])).tree), Units()).render(
            form
        )
        for names in (list(IN_XML.values()), [f"n{k}" for k in range(len(IN_XML))])
    ]
    assert texts[0].count("\n") == texts[1].count("\n")
    if form == "markdown":
        hostile, plain = (rendered(text, True) for text in texts)
        assert hostile.skeleton == plain.skeleton


@pytest.mark.parametrize("kind", NAMES)
def test_a_name_in_latex_has_no_active_character(kind: str) -> None:
    known = r"\\textbackslash\{\}|\\textasciitilde\{\}|\\textasciicircum\{\}|\\[&%$#_{}]"
    assert not re.search(r"[\\{}$&#^_~%\n\r]", re.sub(known, "", escaped(NAMES[kind])))


@pytest.mark.parametrize("kind", NAMES)
def test_code_with_a_proof_is_the_same_with_any_name_and_compiles(kind: str, tmp_path: Path) -> None:
    def code(name: str) -> list[str]:
        written = make_chain_code(table(name), ["placement"], name="chain", verify=False)
        words = written.identifiers["q"]
        assert all(re.fullmatch(r"\w+", word, re.ASCII) for word in words)
        found = []
        for form in ("numpy", "casadi", "c", "matlab"):
            text = code_alone(code_text(written, form), form)
            for k, word in enumerate(words):
                text = re.sub(rf"\b([scq])_{word}\b", rf"\1_joint{k}", text)
            found.append(text)
        return found

    assert code(NAMES[kind]) == code("tame_name")
    if shutil.which("gcc"):
        file = tmp_path / "table.c"
        file.write_text(export(table(NAMES[kind]), "c", verify=False))
        subprocess.run(["gcc", "-std=c99", "-Wall", "-Werror", "-fsyntax-only", file], check=True)


@pytest.mark.parametrize("form", ["json", "toml", "csv"])
@pytest.mark.parametrize("kind", NAMES)
def test_a_table_that_is_written_and_read_has_the_same_names(kind: str, form: str, tmp_path: Path) -> None:
    file = tmp_path / f"table.{form}"
    file.write_text(export(table(NAMES[kind]), form), encoding="utf-8")
    found = read_table(file)
    assert (found.robot, found.base_frame, found.tip_frame) == (NAMES[kind],) * 3
    # In CSV, characters that act on a log or a terminal stay escaped.
    if form != "csv" or (NAMES[kind].isprintable() and "##" not in NAMES[kind]):
        assert [row.joint for row in found.rows] == [f"{NAMES[kind]} {i}" for i in range(2)]


@pytest.mark.parametrize("name", ["=1+1", "+x", "-x", "@x", "'=1", " =1", "\t=1", "'''@x", "'x", "x'", "'"])
def test_a_name_in_csv_is_no_formula(name: str) -> None:
    cell = csv_cell(name)
    assert not cell.startswith(("=", "+", "-", "@", "\t", "\r"))
    if name.isprintable():
        assert from_csv_cell(cell) == name


def test_a_drawing_has_the_same_elements_with_any_names() -> None:
    def elements(called: Callable[[str], str]) -> list[Any]:
        names = [called(name) for name in IN_XML.values()]
        robot = urdfkin.load(chain_of_all(names, called(NAMES["math"])))
        svg = etree.fromstring(draw_table_svg(robot.dh(names[-1])).encode())
        comments = [str(comment.text).strip() for comment in svg.iter(etree.Comment)]
        assert [c for c in comments if not re.fullmatch(r"\$[xz]_\{\d+\}\$(, \$[xz]_\{\d+\}\$)*", c)] == []
        return [
            (element.tag, sorted(element.attrib)) for element in svg.iter() if "path" not in str(element.tag)
        ]

    assert elements(same) == elements(tame)


@pytest.mark.parametrize("name", ["J$$(x)", "$x^2$", "J$$", r"$\frac{", r"\$x$"])
def test_dollar_signs_in_a_name_are_not_rendered_as_mathematics(name: str) -> None:
    svg = etree.fromstring(draw_table_svg(table(name)).encode())
    assert name in " ".join("".join(map(str, element.itertext())) for element in svg.iter("{*}text"))
