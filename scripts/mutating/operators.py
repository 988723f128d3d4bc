"""Make all mutants of a file; each mutant changes one node of the file's syntax tree.

Texts, types and compiled kernels are not mutated.
"""

import ast
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

_COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
_OPERATIONS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.Pow: ast.Mult, ast.MatMult: ast.Add, ast.Mod: ast.Mult, ast.BitOr: ast.BitAnd, ast.BitAnd: ast.BitOr,
}  # fmt: skip
_STATEMENTS: dict[type[ast.stmt], type[ast.stmt]] = {
    ast.Raise: ast.Pass, ast.Continue: ast.Break, ast.Break: ast.Continue,
}  # fmt: skip
_DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
_NAMES = {"min": "max", "max": "min", "any": "all", "all": "any"}


@dataclass(frozen=True)
class Change:
    """One mutant: a new value in the syntax tree.

    | change | `container` | `key` |
    |---|---|---|
    | element of a list | the list | index of the element |
    | field of a node | the node | name of the field |
    """

    node: ast.AST  # The mutant's description quotes this node.
    container: Any
    key: int | str
    value: Any

    @property
    def line(self) -> int:
        return getattr(self.node, "lineno", 0)

    @property
    def text(self) -> str:
        before = _describe(self.node)
        with self.applied() as old:
            after = _describe(self.node if self.node is not old else self.value)
        return f"{before}  ->  {after}"

    @contextmanager
    def applied(self) -> Iterator[Any]:
        """Put the mutant's value into the tree for a `with` block, and yield the replaced value."""
        old = self.put(self.value)
        try:
            yield old
        finally:
            self.put(old)

    def put(self, value: Any) -> Any:
        if isinstance(self.key, int):
            old, self.container[self.key] = self.container[self.key], value
        else:
            old = getattr(self.container, self.key)
            setattr(self.container, self.key, value)
        return old


def list_changes(tree: ast.Module) -> list[Change]:
    """Return all mutants of a file; applying a mutant changes the given tree."""
    return [
        change
        for node in _executed_nodes(tree)
        for change in (*_expression_changes(node), *_statement_changes(node))
    ]


def apply_change(source: str, number: int) -> ast.Module:
    tree = ast.parse(source)
    change = list_changes(tree)[number]
    change.put(change.value)
    return ast.fix_missing_locations(tree)


@lru_cache(maxsize=1)
def _definitions(tree: ast.Module) -> list[ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef]:
    found = (node for node in ast.walk(tree) if isinstance(node, _DEFINITIONS))
    return sorted(found, key=lambda node: node.lineno)


def function_at(tree: ast.Module, line: int) -> str:
    """Return the function around a line, or ""."""
    return ".".join(node.name for node in _definitions(tree) if node.lineno <= line <= (node.end_lineno or 0))


def replace_code(source: str, function: str, before: str, after: str) -> ast.Module:
    """Replace a piece of code that a function or class contains exactly once.

    The name "" means the whole file.
    """
    tree = ast.parse(source)
    alternatives = [[ast.unparse(node) for node in nodes] for nodes in _parse_alternatives(before)]
    matches = [
        (node, field, index, len(texts))
        for node in ast.walk(_definition(tree, function))
        for field, value in ast.iter_fields(node)
        for nodes in [value if isinstance(value, list) else [value]]
        for texts in alternatives
        for index in range(len(nodes))
        if [ast.unparse(x) for x in nodes[index : index + len(texts)] if isinstance(x, ast.AST)] == texts
    ]
    if len(matches) != 1:
        raise ValueError(f"found {len(matches)} times in {function or 'the file'}: {before}")
    (node, field, index, size), *_ = matches
    old = getattr(node, field)
    if isinstance(old, list):
        old[index : index + size] = _parse_as(after, type(old[index]))
    else:
        setattr(node, field, _parse_as(after, type(old))[0])
    return ast.fix_missing_locations(tree)


def _definition(tree: ast.Module, function: str) -> ast.AST:
    node: ast.AST = tree
    for name in filter(None, function.split(".")):
        inner = (x for x in ast.walk(node) if isinstance(x, _DEFINITIONS) and x.name == name)
        if (node := next(inner, None)) is None:  # type: ignore[assignment]
            raise ValueError(f"the file has no function {function}")
    return node


def _parse_alternatives(code: str) -> list[list[ast.AST]]:
    """Parse code as an expression, statements or keyword arguments."""
    readings = []
    for kinds in ((ast.expr,), (ast.stmt, ast.keyword)):
        for kind in kinds:
            with suppress(SyntaxError):
                readings.append(_parse_as(code, kind))
        if any(readings):
            return readings
    raise ValueError(f"not code: {code}")


def _parse_as(code: str, kind: type) -> list[ast.AST]:
    if issubclass(kind, ast.stmt):
        return [*ast.parse(code).body]
    if issubclass(kind, ast.expr):
        return [ast.parse(code, mode="eval").body]
    call: Any = ast.parse(f"f({code})", mode="eval").body
    return [*call.keywords]


def _executed_nodes(node: ast.AST) -> Iterator[ast.AST]:
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "format_spec", "type_params"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not _is_for_types(child):
                yield from _executed_nodes(child)


def _is_for_types(node: ast.AST) -> bool:
    if isinstance(node, ast.If):
        return ast.unparse(node.test) == "TYPE_CHECKING"
    return isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"


def _expression_changes(node: ast.AST) -> Iterator[Change]:
    match node:
        case ast.Compare():
            for i, op in enumerate(node.ops):
                yield Change(node, node.ops, i, _COMPARISONS[type(op)]())
        case ast.BoolOp():
            yield Change(node, node, "op", ast.Or() if isinstance(node.op, ast.And) else ast.And())
        case ast.BinOp() | ast.AugAssign() if type(node.op) in _OPERATIONS and not _concerns_text(node):
            yield Change(node, node, "op", _OPERATIONS[type(node.op)]())
        case ast.UnaryOp(op=ast.USub()):
            yield Change(node, node, "op", ast.UAdd())
        case ast.UnaryOp(op=ast.Not()):
            yield Change(node, node, "operand", ast.UnaryOp(ast.Not(), node.operand))
        case ast.Constant(value=bool() | int() | float() as value):
            yield Change(node, node, "value", _other_value(value))
        case ast.Name(id=name) if name in _NAMES:
            yield Change(node, node, "id", _NAMES[name])


def _statement_changes(node: ast.AST) -> Iterator[Change]:
    match node:
        case ast.If(test=test) | ast.IfExp(test=test) if isinstance(
            test, ast.Name | ast.Attribute | ast.Call
        ):
            yield Change(node, node, "test", ast.UnaryOp(ast.Not(), test))
        case ast.Expr(value=ast.Call()):
            yield Change(node, node, "value", ast.Constant(None))
    for field in ("body", "orelse", "finalbody"):
        statements = getattr(node, field, None)
        for i, statement in enumerate(statements if isinstance(statements, list) else ()):
            if (other := _STATEMENTS.get(type(statement))) is not None:
                yield Change(statement, statements, i, other())


def _describe(node: ast.AST) -> str:
    if isinstance(node, ast.If):
        return f"if {ast.unparse(node.test)}"
    return " ".join(ast.unparse(ast.fix_missing_locations(node)).split())[:90]


def _other_value(value: bool | int | float) -> bool | int | float:
    if isinstance(value, bool):
        return not value
    return value + 1 if isinstance(value, int) else value * 1.5 + 0.0 if value else 1.0


def _concerns_text(node: ast.BinOp | ast.AugAssign) -> bool:
    """Return whether a constant operand is a string or None."""
    parts = [node.value] if isinstance(node, ast.AugAssign) else [node.left, node.right]
    return any(
        isinstance(part, ast.JoinedStr)
        or (isinstance(part, ast.Constant) and isinstance(part.value, str | None))
        for part in parts
    )
