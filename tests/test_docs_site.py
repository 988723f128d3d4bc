"""The documentation site builds without a warning, works offline, and is readable in a browser."""

from __future__ import annotations

import inspect
import json
import logging
import os
import pydoc
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import urdfkin
from scripts.docs_site import (
    LIBRARY,
    find_address,
    make_commands_page,
    make_library_page,
    make_notebook,
    make_subject_page,
)
from tests.pages import DOCS, blocks, pages
from tests.report.browser import Browser, opened
from urdfkin.cli import commands
from urdfkin.kinematics.registry import equations

if not os.environ.get("CI"):  # there it must be
    pytest.importorskip("mkdocs", reason="the extra `docs` is not installed")

ROOT = DOCS.parent


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the site as `make site` does."""
    from mkdocs.commands.build import build
    from mkdocs.config import load_config

    folder = tmp_path_factory.mktemp("site")
    logging.getLogger("mkdocs").setLevel(logging.WARNING)
    config = load_config(str(ROOT / "mkdocs.yml"), site_dir=str(folder), strict=True)
    config.plugins.on_startup(command="build", dirty=False)
    build(config)  # with `strict`, a missing link or heading is an error
    return folder


def documented() -> Iterator[tuple[str, object]]:
    """Yield the names of the reference with the public members of classes, and the equations' functions."""
    for name in re.findall(r"`(urdfkin\.kinematics\.[\w.]+)`", (DOCS / "equations.md").read_text("utf-8")):
        yield name, pydoc.locate(name)
    for _, _, names in LIBRARY.values():
        for name in names.split():
            found = pydoc.locate(find_address(name))
            yield name, found
            for member, value in vars(found).items() if inspect.isclass(found) else ():
                defined = inspect.isfunction(value) or isinstance(
                    value, property | classmethod | staticmethod
                )
                if defined and not member.startswith("_"):
                    yield f"{name}.{member}", value


def test_every_name_of_the_reference_has_a_docstring() -> None:
    names = dict(documented())
    assert {"Robot.jacobian", "same"} <= set(names)
    assert [name for name, found in names.items() if not inspect.getdoc(found)] == []


@pytest.mark.long
def test_every_page_is_built_and_in_the_menu(site: Path) -> None:
    built = {str(path.relative_to(site)) for path in site.rglob("*.html")} - {"404.html"}
    assert built == {page.removesuffix("md") + "html" for page in (*pages(), "cli.md", "api.md", *LIBRARY)}
    menu = (site / "index.html").read_text("utf-8").partition('class="md-nav__list"')[2]
    assert built - set(re.findall(r'href="([^"#]+)"', menu)) == set()


@pytest.mark.long
@pytest.mark.browser
def test_a_picture_follows_the_theme_that_the_reader_chooses(site: Path, tmp_path: Path) -> None:
    shown = (
        "return [...document.querySelectorAll('article img')].filter((one) => one.checkVisibility())"
        ".map((one) => one.currentSrc.split('/').pop().split('#')[0])"
    )
    with opened(tmp_path, width=1280, height=900, dark=False) as browser:
        browser.chrome.get((site / "viewer.html").as_uri())
        assert browser.js(shown) == ["viewer.png", "viewer-phone.png"]
        browser.js("document.querySelector('label[for=__palette_1]').click()")
        assert browser.js(shown) == ["viewer-dark.png", "viewer-phone-dark.png"]


@pytest.mark.long
def test_every_equation_is_mathml_and_no_latex_is_left(site: Path) -> None:
    page = (site / "equations.html").read_text("utf-8")
    assert page.count("<math") == len(equations())
    for path in site.rglob("*.html"):
        assert "$<code>" not in path.read_text("utf-8"), path


@pytest.mark.long
@pytest.mark.browser
def test_the_site_works_from_disk_without_network_and_has_a_search(site: Path, desk: Browser) -> None:
    desk.requests()
    for page in ("index", "questions", "lessons/planar-arm", "api"):
        desk.open(site / f"{page}.html")
        assert [url for url in desk.requests() if not url.startswith(("file:", "data:"))] == []
        assert desk.errors() == []
    desk.js(
        "const box = document.querySelector('input.md-search__input'); box.focus(); box.value = 'continuous';"
        "box.dispatchEvent(new KeyboardEvent('keyup', {bubbles: true}))"
    )
    desk.wait("return document.querySelectorAll('.md-search-result__item').length > 2")
    assert desk.errors() == []


@pytest.mark.long
@pytest.mark.browser
def test_no_page_is_wider_than_a_phone(site: Path, desk: Browser) -> None:
    desk.become(390, 844)
    try:
        for page in (
            "index", "questions", "reference-frames", "equations", "lessons/planar-arm", "cli", "api",
            "api/robot", "api/kinematics", "api/tables",
        ):  # fmt: skip
            desk.open(site / f"{page}.html")
            desk.settle()
            assert desk.js("return document.documentElement.scrollWidth") <= 390, page
    finally:
        desk.become()


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with opened(tmp_path_factory.mktemp("profile")) as browser:
        browser.chrome.get("about:blank")  # requests of a new tab are not from the page
        yield browser


def test_the_pages_of_commands_and_library_contain_every_name() -> None:
    page = make_commands_page()
    assert [name for name in commands() if f"\n## urdfkin {name}\n" not in page] == []
    assert "Usage: urdfkin report merge" in page
    shown = [name for _, _, names in LIBRARY.values() for name in names.split()]
    assert sorted(name for name in shown if name in urdfkin.__all__) == sorted(urdfkin.__all__)
    offered = dir(urdfkin.load("one_link"))
    members = {name for name in offered if name in vars(urdfkin.Robot) and name[0] != "_"}
    assert {name for name in shown if "." not in name} - set(urdfkin.__all__) == members
    assert shown[0] == "load"
    for path, (_, _, names) in LIBRARY.items():
        described = re.findall(r"^::: (.*)$", make_subject_page(path), re.MULTILINE)
        assert described == [find_address(name) for name in names.split()]
        assert [
            name for name in names.split() if f"({path}#{find_address(name)})" not in make_library_page()
        ] == []


def _documented() -> list[str]:
    """Return the full path of each name on the library pages, and of each public member of its classes."""
    found = []
    for name in " ".join(names for _, _, names in LIBRARY.values()).split():
        path = find_address(name)
        module, _, own = path.rpartition(".")
        found.append(path)
        if name != "Robot" and isinstance(cls := getattr(pydoc.locate(module), own), type):
            members = {k: v for k, v in vars(cls).items() if not k.startswith("_") and inspect.getdoc(v)}
            found += [f"{path}.{k}" for k, v in members.items() if callable(v) or hasattr(v, "__get__")]
    return found


@pytest.mark.parametrize("path", _documented())
def test_each_name_in_the_reference_has_an_example(path: str) -> None:
    """The doctests run with the other tests of the package."""
    module, _, own = path.rpartition(".")
    assert ">>> " in (inspect.getdoc(inspect.getattr_static(pydoc.locate(module), own)) or "")


@pytest.mark.parametrize("page", [page for page in pages() if page.startswith("lessons/")])
def test_a_lesson_becomes_a_notebook_with_its_outputs(page: str) -> None:
    made = json.loads(json.dumps(make_notebook((DOCS / page).read_text("utf-8"))))
    code = [cell for cell in made["cells"] if cell["cell_type"] == "code"]
    told = blocks(page)
    assert [cell["source"] for cell in code] == [text.rstrip() for kind, text in told if kind == "python"]
    shown = [output["text"] for cell in code for output in cell["outputs"]]
    assert shown == [text for kind, text in told if kind == "text"]
    words = "".join(cell["source"] for cell in made["cells"] if cell["cell_type"] == "markdown")
    assert "```" not in words
    assert words.count("$") >= 2
    assert "`$" not in words


@pytest.mark.long
def test_a_doctest_in_a_docstring_is_a_block_of_code() -> None:
    from scripts.docs_docstrings import fence_doctests

    shown = "It adds.\n\n```pycon\n>>> add(1,\n...     2)\n3\n```\n\nAnd so on."
    assert fence_doctests("It adds.\n\n>>> add(1,\n...     2)\n3\n\nAnd so on.") == shown
    assert fence_doctests("Example:\n    >>> 1\n    1\n") == "```pycon\n>>> 1\n1\n```\n"
    shown = "One.\n\n    ```pycon\n    >>> 1\n    1\n    ```\n    "
    assert fence_doctests("One.\n\n    Example:\n        >>> 1\n        1\n    ") == shown
