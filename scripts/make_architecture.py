"""Draw who imports whom: docs/images/architecture.svg and the table of rooms in docs/architecture.md.

The rooms and their order stand in docs/architecture.toml and nowhere else; tests/test_architecture.py holds
the imports against them with the functions of this file. Every import counts: those for types alone, those
inside functions, and modules that are named in a string to be imported when they are asked for.
"""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from html import escape
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PAGE, PICTURE = ROOT / "docs" / "architecture.md", ROOT / "docs" / "images" / "architecture.svg"
PLAN = tomllib.loads((ROOT / "docs" / "architecture.toml").read_text(encoding="utf-8"))

#: Who may import a foreign library: one module, or the modules of one room or two.
DOORS: dict[str, list[str]] = PLAN["doors"]
#: Whose imports count; of what is run from outside the package, the scripts and the examples.
_TREES = ("urdfkin", "scripts", "examples")
_NAMED = re.compile(r"(urdfkin(?:\.\w+)+)(?::[\w.]+)?")


class Room(NamedTuple):
    """A folder of modules, or a loose file."""

    name: str
    says: str
    holds: str = ""


#: From the ground up: a room imports what stands before it.
ROOMS = [Room(**room) for room in PLAN["room"]]


@cache
def modules() -> dict[str, Path]:
    """Every module by its name."""
    files = [path for tree in _TREES for path in sorted((ROOT / tree).rglob("*.py"))]
    return {_module(path): path for path in files}


def _module(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def room_of(module: str) -> str:
    """`verify` for `urdfkin.verify.bounds`; outside the package, the folder.

    >>> room_of("urdfkin.robot"), room_of("urdfkin"), room_of("scripts.mutating.operators")
    ('robot', 'urdfkin', 'scripts')
    """
    tree, *rest = module.split(".")
    return rest[0] if tree == "urdfkin" and rest else tree


def named(text: str) -> Iterator[str]:
    """What a module's text imports, wherever in it and whatever for; what stands in a string ends in `.*`.

    >>> list(named("if TYPE_CHECKING: from urdfkin.errors import InputError"))
    ['urdfkin.errors.InputError']
    >>> list(named("COMMANDS = {'plot': 'urdfkin.cli.plot'}"))
    ['urdfkin.cli.plot.*']
    """
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{'.' * node.level}{node.module or ''}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Constant) and (found := _NAMED.fullmatch(str(node.value))):
            yield f"{found[1]}.*"


@cache
def all_named() -> Mapping[str, frozenset[str]]:
    """What each module imports, ours and others'."""
    return {module: frozenset(named(path.read_text(encoding="utf-8"))) for module, path in modules().items()}


@cache
def imports() -> Mapping[str, frozenset[str]]:
    """Which modules each module imports."""
    known = modules()
    return {module: frozenset(_of_ours(names, known)) - {module} for module, names in all_named().items()}


def _of_ours(names: Iterable[str], known: Mapping[str, Path]) -> Iterator[str]:
    for name in names:
        head, _, last = name.rpartition(".")
        if name in known and last not in _given_away(head):
            yield name
        elif head in known:
            yield head


@cache
def _given_away(package: str) -> frozenset[str]:
    """Names that a package takes from its modules: `from package import name` means that, not a module."""
    path = modules().get(package)
    if path is None or path.name != "__init__.py":
        return frozenset()
    taken = (
        node for node in ast.parse(path.read_text(encoding="utf-8")).body if isinstance(node, ast.ImportFrom)
    )
    return frozenset(
        alias.asname or alias.name for node in taken if node.module != package for alias in node.names
    )


def upwards() -> list[str]:
    """Imports of what does not stand before the importing room."""
    rank = {room.name: number for number, room in enumerate(ROOMS)}
    return sorted(
        f"{module} imports {other}"
        for module, others in imports().items()
        for other in others
        if room_of(module) != room_of(other) and rank[room_of(other)] > rank[room_of(module)]
    )


def circles() -> list[list[str]]:
    """Modules that lead to each other."""
    reached = {module: _reached(module) for module in imports()}
    groups = {frozenset(o for o in others if module in reached[o]) for module, others in reached.items()}
    return sorted(sorted(group) for group in groups if group)


def _reached(module: str) -> set[str]:
    """Where one gets from a module, import by import."""
    seen: set[str] = set()
    ahead = set(imports()[module])
    while ahead:
        seen |= ahead
        ahead = set().union(*(imports()[other] for other in ahead)) - seen
    return seen


def arrows() -> set[tuple[str, str]]:
    """Which room imports which."""
    pairs = {(room_of(module), room_of(other)) for module, others in imports().items() for other in others}
    return {(room, other) for room, other in pairs if room != other}


def table() -> str:
    """The rooms in Markdown, from the ground up."""
    rows = [f"| `{room.name}` | {room.says} | {room.holds} |" for room in ROOMS]
    return "\n".join(("| room | what it is | holds |", "|---|---|---|", *rows))


_ROW, _LEFT, _TOP, _CELL = 30, 118, 88, 24


def picture() -> str:
    """The rooms from the ground up, and in each one's row a dot for each room that it imports."""
    place = {room.name: number for number, room in enumerate(ROOMS)}
    width, height = _LEFT + _CELL * len(ROOMS) + 470, _TOP + _ROW * len(ROOMS) + 12
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}"'
        ' font-family="sans-serif" font-size="13">',
        "<title>The rooms of urdfkin: each imports only what stands above it</title>",
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    for number, room in enumerate(ROOMS):
        y, own, says = _TOP + _ROW * number, _LEFT + _CELL * number, escape(room.says.replace("`", ""))
        lines += [
            f'<rect x="6" y="{y}" width="{own + _CELL - 8}" height="{_ROW - 4}" rx="5" fill="#eef2f7"/>',
            f'<rect x="6" y="{y}" width="{_LEFT - 16}" height="{_ROW - 4}" rx="5" fill="#2f5d8a"/>',
            f'<text x="14" y="{y + 18}" fill="#ffffff" font-weight="bold">{room.name}</text>',
            f'<rect x="{own + 4}" y="{y + 5}" width="16" height="16" rx="3" fill="#2f5d8a"/>',
            f'<text x="{own + _CELL + 8}" y="{y + 18}" fill="#222222">{says}</text>',
            f'<text transform="translate({own + 16} {_TOP - 8}) rotate(-90)" fill="#666">{room.name}</text>',
        ]
    for below, above in sorted((place[one], place[other]) for one, other in arrows()):
        x, y = _LEFT + _CELL * above + _CELL // 2, _TOP + _ROW * below + 13
        said = f"{ROOMS[below].name} imports {ROOMS[above].name}"
        lines.append(f'<circle cx="{x}" cy="{y}" r="5" fill="#c8553d"><title>{said}</title></circle>')
    return "\n".join((*lines, "</svg>", ""))


def page() -> str:
    """docs/architecture.md with its table of rooms as it is."""
    text = PAGE.read_text(encoding="utf-8")
    return re.sub(r"(?s)(<!-- rooms -->\n).*?(\n<!-- /rooms -->)", lambda m: m[1] + table() + m[2], text)


if __name__ == "__main__":
    if wrong := [*upwards(), *map(" <-> ".join, circles())]:
        sys.exit("\n".join(wrong))
    PAGE.write_text(page(), encoding="utf-8")
    PICTURE.write_text(picture(), encoding="utf-8")
    print(f"{len(ROOMS)} rooms, {len(arrows())} arrows")
