"""Imports go in one direction, and each foreign library has one door."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "urdfkin"

#: Every part of the package, in the order in which they may build on one another: a module imports what
#: stands in its own row or above it. Imports inside functions count; those for types alone do not.
LAYERS = (
    ("errors", "nearest", "numerals", "roundings", "frame_names", "interpreter", "printable"),
    ("demands", "forking"),
    (
        "files",
        "kinematics",
        "rotation",
        "motion",
        "equations",
        "resources",
        "keeping",
        "sealed",
        "figure",
        "plain_xml",
    ),
    ("columns",),
    ("tree", "reference"),
    ("coupling", "followers", "configuration", "chain"),
    ("recursion",),
    ("urdf",),
    ("dh",),
    ("catalogue", "sources", "origin", "deep_stack"),
    ("lint",),
    ("oracle_frames", "oracle_layout", "oracle_base", "oracle"),
    ("asked", "call"),
    ("verification",),
    ("exact",),
    ("prepared", "enclosure", "robot"),
    ("from_table",),
    ("loading", "description", "unwrapping", "trajectory", "frame_motion"),
    ("judge", "validation"),
    ("plot", "report", "view"),
    ("cli",),
)
RANK = {part: rank for rank, row in enumerate(LAYERS) for part in row}

#: Who may import a foreign library: one door each.
DOORS = {
    "yourdfpy": {"urdf"},
    "pinocchio": {"oracle"},
    "numba": {"recursion"},
    "llvmlite": {"recursion"},
    "click": {"cli"},
    "rich": {"cli", "report"},
    "matplotlib": {"figure", "plot"},
    "viser": {"view"},
    "jinja2": {"report"},
    "xacrodoc": {"urdf"},
    "mpmath": {"exact"},
}

#: Those whose door is a single module.
ALONE = ("jinja2", "jsonschema", "pinocchio", "platformdirs", "trimesh", "viser", "xacrodoc", "yourdfpy")


def modules() -> Iterator[tuple[str, Path]]:
    for path in sorted(PACKAGE.rglob("*.py")):
        part = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
        if part not in ("__init__", "__main__"):
            yield part, path


@cache
def imported(path: Path) -> tuple[str, ...]:
    """Names of the modules a file imports, without those under `if TYPE_CHECKING`; each file is read once."""
    return tuple(_imported(path))


def _imported(path: Path) -> Iterator[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for_types = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    for node in ast.walk(tree):
        if id(node) in for_types:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            if node.module == "urdfkin":
                yield from (f"urdfkin.{alias.name}" for alias in node.names)
            else:
                yield node.module


def test_every_part_has_its_place() -> None:
    assert {part for part, _ in modules()} == set(RANK)


@pytest.mark.parametrize("part", RANK)
def test_a_part_builds_on_what_stands_above_it(part: str) -> None:
    below = sorted(
        f"{path.relative_to(PACKAGE)} imports {name}"
        for own, path in modules()
        if own == part
        for name in imported(path)
        if name.startswith("urdfkin.") and RANK[name.split(".")[1]] > RANK[part]
    )
    assert below == []


@pytest.mark.parametrize("library", DOORS)
def test_a_foreign_library_has_one_door(library: str) -> None:
    users = {part for part, path in modules() for name in imported(path) if name.split(".")[0] == library}
    assert users <= DOORS[library]


@cache
def everything_imported(path: Path) -> frozenset[str]:
    """What a file imports, for types and inside functions too; a name of a module by its full name."""
    names = set[str]()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            parts = {f"{node.module}.{alias.name}" for alias in node.names}
            names |= (parts & MODULES.keys()) or {node.module}
    return frozenset(names)


MODULES = {
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in PACKAGE.rglob("*.py")
}


@pytest.mark.parametrize("library", ALONE)
def test_exactly_one_module_imports(library: str) -> None:
    users = [
        name
        for name, path in MODULES.items()
        if library in {imported.split(".")[0] for imported in everything_imported(path)}
    ]
    assert len(users) == 1, users


@pytest.mark.parametrize("room", ["lint", "urdf"])
def test_no_module_of_a_room_comes_back_to_itself(room: str) -> None:
    own = {name: path for name, path in MODULES.items() if name.split(".")[1:2] == [room]}
    graph = {name: everything_imported(path) & own.keys() for name, path in own.items()}
    assert len(list(TopologicalSorter(graph).static_order())) == len(own)


def test_importing_the_package_or_asking_for_help_loads_nothing_heavy() -> None:
    heavy = "{'numpy', 'numba', 'pinocchio', 'yourdfpy', 'rich', 'matplotlib', 'lxml'}"
    for code in ("import urdfkin", "import urdfkin.cli as c; c.cli(['--help'], standalone_mode=False)"):
        script = f"import sys; {code}; print(sorted({heavy} & set(sys.modules)))"
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
        assert done.stdout.strip().endswith("[]"), code
