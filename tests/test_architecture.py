"""Imports follow docs/architecture.toml: one direction, no cycle, one importer per foreign library."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import urdfkin
from scripts.make_architecture import (
    IMPORTERS,
    PACKAGES,
    PAGE,
    PICTURE,
    draw_picture,
    find_cycles,
    find_forbidden_imports,
    imported_names,
    imported_names_by_module,
    imports_by_module,
    make_page,
    modules,
    package_of,
)

#: The most packages and loose modules of `urdfkin`; a reader must be able to remember them.
MOST_PACKAGES = 17
OURS = [module for module in modules() if module.split(".")[0] == "urdfkin"]


def foreign(module: str) -> set[str]:
    """Return the foreign libraries that a module imports."""
    names = {name.split(".")[0] for name in imported_names_by_module()[module]}
    return names - {"urdfkin", *sys.stdlib_module_names}


def test_every_module_belongs_to_a_planned_package_and_no_package_is_empty() -> None:
    assert {package_of(module) for module in modules()} == {package.name for package in PACKAGES}


def test_the_number_of_packages_stays_small() -> None:
    assert len({package_of(module) for module in OURS}) <= MOST_PACKAGES


def test_no_package_imports_a_later_one() -> None:
    assert find_forbidden_imports() == []


def test_no_modules_import_each_other_in_a_cycle() -> None:
    assert find_cycles() == []


@pytest.mark.parametrize(
    "text",
    [
        "import urdfkin.robot", "from urdfkin import robot", "from urdfkin.robot import Robot",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from urdfkin.robot import Robot",
        "def f():\n    from urdfkin.robot import Robot",
        "try:\n    pass\nfinally:\n    import urdfkin.robot as r", "import_module('urdfkin.robot')",
        "ROW = ('robot', 'urdfkin.robot:Robot.sample')",
    ],
)  # fmt: skip
def test_every_form_of_import_counts(text: str) -> None:
    assert {"urdfkin.robot", "urdfkin.robot.Robot", "urdfkin.robot.*"} & set(imported_names(text))


def test_the_counted_imports_are_those_of_the_files() -> None:
    assert "urdfkin.errors" in imports_by_module()["urdfkin.robot"]
    assert imports_by_module()["urdfkin.kinematics.equations"] == frozenset(), "the equations import nothing"


@pytest.mark.parametrize("library", IMPORTERS)
def test_a_foreign_library_is_imported_only_where_planned(library: str) -> None:
    users = {module for module in OURS if library in foreign(module)}
    assert users
    assert {module for module in users if not {module, package_of(module)} & set(IMPORTERS[library])} == set()


def test_no_unplanned_library_is_imported() -> None:
    assert set().union(*map(foreign, OURS)) == {"numpy", *IMPORTERS}


def test_the_picture_and_the_table_are_current() -> None:
    assert PICTURE.read_text(encoding="utf-8") == draw_picture()
    assert PAGE.read_text(encoding="utf-8") == make_page()


def test_every_path_on_the_page_exists() -> None:
    root = Path(__file__).parents[1]
    words = PAGE.read_text(encoding="utf-8").replace("(", " ").replace(")", " ").split("`")[1::2]
    paths = [word for word in words if word.startswith(("urdfkin/", "tests/", "scripts/", "docs/"))]
    assert len(paths) > 10
    assert [path for path in paths if not (root / path).exists()] == []


def test_import_and_help_load_no_heavy_module() -> None:
    heavy = "{'numpy', 'numba', 'pinocchio', 'yourdfpy', 'rich', 'matplotlib', 'lxml'}"
    for code in ("import urdfkin", "import urdfkin.cli as c; c.cli(['--help'], standalone_mode=False)"):
        script = f"import sys; {code}; print(sorted({heavy} & set(sys.modules)))"
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
        assert done.stdout.strip().endswith("[]"), code


#: Two kinds of numbers have these classes: numbers in Python, and numbers in a compiled kernel.
TWICE = {"ConstantNumber", "Product"}


def test_each_class_has_its_own_name() -> None:
    found = [
        node.name
        for path in Path(urdfkin.__file__).parent.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.ClassDef)
    ]
    assert {name for name in found if found.count(name) > 1} == TWICE
