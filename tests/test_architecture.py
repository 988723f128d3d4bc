"""The house is as docs/architecture.toml says: imports lead one way, a foreign library has one door."""

import subprocess
import sys
from pathlib import Path

import pytest

from scripts.make_architecture import (
    DOORS,
    PAGE,
    PICTURE,
    ROOMS,
    all_named,
    circles,
    imports,
    modules,
    named,
    page,
    picture,
    room_of,
    upwards,
)

#: More than these nobody keeps in mind: those of the package, what is run from outside aside.
MOST_ROOMS = 20
OURS = [module for module in modules() if module.split(".")[0] == "urdfkin"]


def foreign(module: str) -> set[str]:
    """The libraries that a module imports, Python's own aside."""
    names = {name.split(".")[0] for name in all_named()[module]}
    return names - {"urdfkin", *sys.stdlib_module_names}


def test_every_module_lies_in_a_room_of_the_plan_and_every_room_is_lived_in() -> None:
    assert {room_of(module) for module in modules()} == {room.name for room in ROOMS}


def test_the_house_has_no_more_rooms_than_one_can_keep_in_mind() -> None:
    assert len({room_of(module) for module in OURS}) <= MOST_ROOMS


def test_no_import_leads_up() -> None:
    assert upwards() == []


def test_no_modules_lead_to_each_other() -> None:
    assert circles() == []


@pytest.mark.parametrize(
    "text",
    [
        "import urdfkin.robot",
        "from urdfkin import robot",
        "from urdfkin.robot import Robot",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from urdfkin.robot import Robot",
        "def f():\n    from urdfkin.robot import Robot",
        "try:\n    pass\nfinally:\n    import urdfkin.robot as r",
        "import_module('urdfkin.robot')",
        "ROW = ('robot', 'urdfkin.robot:Robot.sample')",
    ],
)
def test_an_import_counts_wherever_it_stands_and_whatever_for(text: str) -> None:
    assert {"urdfkin.robot", "urdfkin.robot.Robot", "urdfkin.robot.*"} & set(named(text))


def test_the_imports_that_are_counted_are_those_of_the_files() -> None:
    assert "urdfkin.errors" in imports()["urdfkin.robot"]
    assert imports()["urdfkin.kinematics.equations"] == frozenset(), "the equations import nothing"


@pytest.mark.parametrize("library", DOORS)
def test_a_foreign_library_has_one_door(library: str) -> None:
    users = {module for module in OURS if library in foreign(module)}
    assert users
    assert {module for module in users if not {module, room_of(module)} & set(DOORS[library])} == set()


def test_no_library_comes_in_beside_the_doors() -> None:
    assert set().union(*map(foreign, OURS)) == {"numpy", *DOORS}


def test_the_picture_and_the_table_are_of_today() -> None:
    assert PICTURE.read_text(encoding="utf-8") == picture()
    assert PAGE.read_text(encoding="utf-8") == page()


def test_what_the_page_names_is_there() -> None:
    root = Path(__file__).parents[1]
    words = PAGE.read_text(encoding="utf-8").replace("(", " ").replace(")", " ").split("`")[1::2]
    paths = [word for word in words if word.startswith(("urdfkin/", "tests/", "scripts/", "docs/"))]
    assert len(paths) > 10
    assert [path for path in paths if not (root / path).exists()] == []


def test_importing_the_package_or_asking_for_help_loads_nothing_heavy() -> None:
    heavy = "{'numpy', 'numba', 'pinocchio', 'yourdfpy', 'rich', 'matplotlib', 'lxml'}"
    for code in ("import urdfkin", "import urdfkin.cli as c; c.cli(['--help'], standalone_mode=False)"):
        script = f"import sys; {code}; print(sorted({heavy} & set(sys.modules)))"
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
        assert done.stdout.strip().endswith("[]"), code
