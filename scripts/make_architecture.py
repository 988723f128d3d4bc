"""Draw the imports between packages. Write docs/images/architecture.svg and a table in docs/architecture.md.

docs/architecture.toml defines the packages and their order. tests/test_architecture.py checks the imports
with the functions of this script. Every import counts: imports for types, imports inside functions, and
modules that are named in a string for a lazy import.
"""

import ast
import re
import sys
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from html import escape
from pathlib import Path
from typing import NamedTuple

from scripts.pages import DOCS, insert_parts, table

ROOT = DOCS.parent
PAGE, PICTURE = DOCS / "architecture.md", DOCS / "images" / "architecture.svg"
PLAN = tomllib.loads((DOCS / "architecture.toml").read_text(encoding="utf-8"))

#: Maps a foreign library to the modules that may import the library.
IMPORTERS: dict[str, list[str]] = PLAN["importers"]
_TREES = ("urdfkin", "scripts", "examples")
_NAMED = re.compile(r"(urdfkin(?:\.\w+)+)(?::[\w.]+)?")


class Package(NamedTuple):
    """A package, or a module outside all packages."""

    name: str
    purpose: str
    contents: str = ""


PACKAGES = [Package(**package) for package in PLAN["package"]]


@cache
def modules() -> dict[str, Path]:
    files = [path.relative_to(ROOT) for tree in _TREES for path in sorted((ROOT / tree).rglob("*.py"))]
    return {".".join(path.with_suffix("").parts).removesuffix(".__init__"): ROOT / path for path in files}


def package_of(module: str) -> str:
    """Return the package of a module.

    >>> package_of("urdfkin.robot"), package_of("urdfkin"), package_of("scripts.mutating.operators")
    ('robot', 'urdfkin', 'scripts')
    """
    tree, *rest = module.split(".")
    return rest[0] if tree == "urdfkin" and rest and rest != ["__main__"] else tree


def imported_names(text: str) -> Iterator[str]:
    """Yield the names that a module's text imports.

    >>> list(imported_names("if TYPE_CHECKING: from urdfkin.errors import InputError"))
    ['urdfkin.errors.InputError']
    >>> list(imported_names("COMMANDS = {'plot': 'urdfkin.cli.view'}"))
    ['urdfkin.cli.view.*']
    """
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{'.' * node.level}{node.module or ''}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Constant) and (match := _NAMED.fullmatch(str(node.value))):
            yield f"{match[1]}.*"


@cache
def imported_names_by_module() -> Mapping[str, frozenset[str]]:
    return {
        module: frozenset(imported_names(path.read_text(encoding="utf-8")))
        for module, path in modules().items()
    }


@cache
def imports_by_module() -> Mapping[str, frozenset[str]]:
    found: dict[str, frozenset[str]] = {}
    for module, names in imported_names_by_module().items():
        heads = {name: name.rpartition(".")[::2] for name in names}
        # An imported name is a module (`urdfkin.robot.loading`) or is defined in one (`urdfkin.robot.Robot`).
        ours = [
            name if name in modules() and last not in _reexported(head) else head
            for name, (head, last) in heads.items()
        ]
        found[module] = frozenset(ours) & modules().keys() - {module}
    return found


@cache
def _reexported(package: str) -> frozenset[str]:
    """Return the names that `__init__.py` imports, which can hide submodules of the same name."""
    path = modules().get(package)
    if path is None or path.name != "__init__.py":
        return frozenset()
    body = ast.parse(path.read_text(encoding="utf-8")).body
    taken = [node for node in body if isinstance(node, ast.ImportFrom) and node.module != package]
    return frozenset(alias.asname or alias.name for node in taken for alias in node.names)


def find_forbidden_imports() -> list[str]:
    """Return the imports that break the order of packages."""
    rank = {package.name: number for number, package in enumerate(PACKAGES)}
    return sorted(
        f"{module} imports {other}"
        for module, others in imports_by_module().items()
        for other in others
        if package_of(module) != package_of(other) and rank[package_of(other)] > rank[package_of(module)]
    )


def find_cycles() -> list[list[str]]:
    try:
        TopologicalSorter(imports_by_module()).prepare()
    except CycleError as error:
        return [error.args[1]]
    return []


def package_imports() -> set[tuple[str, str]]:
    pairs = (
        (package_of(module), package_of(imported))
        for module, imports in imports_by_module().items()
        for imported in imports
    )
    return {(importer, imported) for importer, imported in pairs if importer != imported}


_ROW, _LEFT, _TOP, _CELL = 30, 118, 88, 24


def draw_picture() -> str:
    """Return an SVG picture; a dot shows that one package imports another."""
    index = {package.name: number for number, package in enumerate(PACKAGES)}
    width, height = _LEFT + _CELL * len(PACKAGES) + 470, _TOP + _ROW * len(PACKAGES) + 12
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}"'
        ' font-family="sans-serif" font-size="13">',
        "<title>The packages of urdfkin: each imports only packages above it</title>",
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    for number, package in enumerate(PACKAGES):
        y, cell_x = _TOP + _ROW * number, _LEFT + _CELL * number
        purpose = escape(package.purpose.replace("`", ""))
        lines += [
            f'<rect x="6" y="{y}" width="{cell_x + _CELL - 8}" height="{_ROW - 4}" rx="5" fill="#eef2f7"/>',
            f'<rect x="6" y="{y}" width="{_LEFT - 16}" height="{_ROW - 4}" rx="5" fill="#0072B2"/>',
            f'<text x="14" y="{y + 18}" fill="#ffffff" font-weight="bold">{package.name}</text>',
            f'<rect x="{cell_x + 4}" y="{y + 5}" width="16" height="16" rx="3" fill="#0072B2"/>',
            f'<text x="{cell_x + _CELL + 8}" y="{y + 18}" fill="#222222">{purpose}</text>',
            f'<text transform="translate({cell_x + 16} {_TOP - 8}) rotate(-90)" fill="#666">'
            f"{package.name}</text>",
        ]
    for below, above in sorted(
        (index[importer], index[imported]) for importer, imported in package_imports()
    ):
        x, y = _LEFT + _CELL * above + _CELL // 2, _TOP + _ROW * below + 13
        title = f"{PACKAGES[below].name} imports {PACKAGES[above].name}"
        lines.append(f'<circle cx="{x}" cy="{y}" r="5" fill="#D55E00"><title>{title}</title></circle>')
    return "\n".join((*lines, "</svg>", ""))


def make_page() -> str:
    rows = [(f"`{package.name}`", package.purpose, package.contents) for package in PACKAGES]
    packages = table(("Package", "Purpose", "Contents"), rows)
    return insert_parts(PAGE.read_text(encoding="utf-8"), packages=packages)


if __name__ == "__main__":
    if wrong := [*find_forbidden_imports(), *map(" <-> ".join, find_cycles())]:
        sys.exit("\n".join(wrong))
    PAGE.write_text(make_page(), encoding="utf-8")
    PICTURE.write_text(draw_picture(), encoding="utf-8")
    print(f"{len(PACKAGES)} packages, {len(package_imports())} imports between them")
