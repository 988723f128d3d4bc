"""Every small slip that could be made in a file: one place of its syntax tree changed, one at a time.

The slips are those that tests miss most easily: a comparison's edge, a condition turned round, a number off,
a sign, a call left out, an error not raised. Texts, types and what compiled kernels hold are left alone.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

_COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
_OPERATIONS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.Pow: ast.Mult, ast.MatMult: ast.Add, ast.Mod: ast.Mult, ast.BitOr: ast.BitAnd, ast.BitAnd: ast.BitOr,
}  # fmt: skip
_NAMES = {"min": "max", "max": "min", "any": "all", "all": "any"}


@dataclass(frozen=True)
class Slip:
    """One change.

    Attributes:
        line: Where.
        what: The text as it was and as it is, for a person.
        make: Changes the tree in place.
    """

    line: int
    what: str
    make: Callable[[], None]


def slips(tree: ast.Module) -> list[Slip]:
    """Every slip of a file, always in the same order; making one changes the tree it was found in."""
    return [slip for node in _code(tree) for slip in (*_of_expression(node), *_of_statement(node))]


def mutated(source: str, number: int) -> ast.Module:
    """A file's tree with one slip in it."""
    tree = ast.parse(source)
    slips(tree)[number].make()
    return ast.fix_missing_locations(tree)


def function_at(tree: ast.Module, line: int) -> str:
    """The function or class in which a line stands, `Tally.percentile`; empty outside of all."""
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    around = (node for node in ast.walk(tree) if isinstance(node, kinds))
    found = [node for node in around if node.lineno <= line <= (node.end_lineno or 0)]
    return ".".join(node.name for node in sorted(found, key=lambda node: node.lineno))


def rewritten(source: str, before: str, after: str) -> ast.Module:
    """A file's tree with one piece of its text replaced.

    Raises:
        ValueError: the text does not stand there exactly once.
    """
    if source.count(before) != 1:
        raise ValueError(f"found {source.count(before)} times: {before}")
    return ast.parse(source.replace(before, after))


def _code(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes that do something when the program runs: no types, no texts, no decorators."""
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "format_spec", "type_params"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not _for_types(child):
                yield from _code(child)


def _for_types(node: ast.AST) -> bool:
    if isinstance(node, ast.If):
        return ast.unparse(node.test) == "TYPE_CHECKING"
    return isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"


def _of_expression(node: ast.AST) -> Iterator[Slip]:
    match node:
        case ast.Compare():
            for i, op in enumerate(node.ops):
                yield _set(node, node.ops, i, _COMPARISONS[type(op)]())
        case ast.BoolOp():
            yield _set(node, node, "op", ast.Or() if isinstance(node.op, ast.And) else ast.And())
        case ast.BinOp() | ast.AugAssign() if type(node.op) in _OPERATIONS and not _of_text(node):
            yield _set(node, node, "op", _OPERATIONS[type(node.op)]())
        case ast.UnaryOp(op=ast.USub()):
            yield _set(node, node, "op", ast.UAdd())
        case ast.UnaryOp(op=ast.Not()):
            yield _set(node, node, "operand", _not(node.operand))
        case ast.Constant(value=bool() | int() | float() as value):
            yield _set(node, node, "value", _other(value))
        case ast.Name(id=name) if name in _NAMES:
            yield _set(node, node, "id", _NAMES[name])


def _of_statement(node: ast.AST) -> Iterator[Slip]:
    match node:
        case ast.If(test=ast.Name() | ast.Attribute() | ast.Call() as test):
            yield _set(node, node, "test", _not(test))
        case ast.IfExp(test=ast.Name() | ast.Attribute() | ast.Call() as test):
            yield _set(node, node, "test", _not(test))
        case ast.Expr(value=ast.Call()):
            yield _set(node, node, "value", ast.Constant(None))
    for field in ("body", "orelse", "finalbody"):
        statements = getattr(node, field, None)
        if isinstance(statements, list):
            yield from _left_out(statements)


def _left_out(statements: list[ast.stmt]) -> Iterator[Slip]:
    for i, statement in enumerate(statements):
        if isinstance(statement, ast.Raise):
            yield _set(statement, statements, i, ast.Pass())
        elif isinstance(statement, ast.Continue):
            yield _set(statement, statements, i, ast.Break())
        elif isinstance(statement, ast.Break):
            yield _set(statement, statements, i, ast.Continue())


def _set(shown: ast.AST, home: Any, place: int | str, value: Any) -> Slip:
    """Put a value into a list's place or a node's field; the words show the statement before and after."""

    def make() -> None:
        if isinstance(place, int):
            home[place] = value
        else:
            setattr(home, place, value)

    before = _short(shown)
    old = home[place] if isinstance(place, int) else getattr(home, place)
    make()
    after = _short(shown if shown is not old else value)
    if isinstance(place, int):
        home[place] = old
    else:
        setattr(home, place, old)
    return Slip(getattr(shown, "lineno", 0), f"{before}  ->  {after}", make)


def _short(node: ast.AST) -> str:
    if isinstance(node, ast.If):
        return f"if {ast.unparse(node.test)}"
    return " ".join(ast.unparse(ast.fix_missing_locations(node)).split())[:90]


def _not(test: ast.expr) -> ast.expr:
    return ast.UnaryOp(ast.Not(), test)


def _other(value: bool | int | float) -> bool | int | float:
    if isinstance(value, bool):
        return not value
    return value + 1 if isinstance(value, int) else value * 1.5 + 0.0 if value else 1.0


def _of_text(node: ast.BinOp | ast.AugAssign) -> bool:
    """Texts that are joined, and types that are united."""
    parts = [node.value] if isinstance(node, ast.AugAssign) else [node.left, node.right]
    return any(
        isinstance(part, ast.JoinedStr)
        or (isinstance(part, ast.Constant) and isinstance(part.value, str | None))
        for part in parts
    )
