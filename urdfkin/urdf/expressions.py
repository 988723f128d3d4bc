"""Evaluate the expressions `${...}` of a xacro file without Python's `eval`.

The package xacro passes expressions to `eval`. Before that, xacro searches the expression for forbidden
names, but does not search the body of a lambda. A lambda can therefore read any attribute, and run any
program.

This module interprets the syntax tree of an expression. An expression may call only xacro's functions and the
methods in `_METHODS`.
"""

from __future__ import annotations

import ast
import operator
from collections import ChainMap
from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any

_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
_UNARY: dict[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
}
_COMPARE: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.In: lambda value, many: value in many,
    ast.NotIn: lambda value, many: value not in many,
}

#: Methods that an expression may call. `str.format` is excluded because it can read attributes.
_METHODS: dict[type, str] = {
    str: "capitalize count endswith find index isalnum isalpha isdigit isnumeric join ljust lower lstrip"
    " partition removeprefix removesuffix replace rfind rjust rpartition rsplit rstrip split splitlines"
    " startswith strip title upper zfill",
    list: "append copy count extend index insert pop remove reverse sort",
    tuple: "count index",
    dict: "copy get items keys pop setdefault update values",
    float: "is_integer",
}
_INDEXABLE_TYPES = (str, list, tuple, dict, range)


class RefusedError(Exception):
    """A xacro file does something that is not allowed."""


def evaluate(expression: str, names: Mapping[str, Any], functions: Collection[object]) -> Any:
    """Return the value of an expression that calls only `functions` and `_METHODS`.

    Raise RefusedError for forbidden content, NameError for an unknown name, and SyntaxError for text that is
    not an expression.
    """
    tree = ast.parse(expression.strip(), mode="eval")
    return _Evaluation(names, functions).value(tree.body)


class _Evaluation:
    """Evaluate a syntax tree; for example, the method `BinOp` evaluates nodes of `ast.BinOp`."""

    def __init__(self, names: Mapping[str, Any], functions: Collection[object]) -> None:
        self._names, self._functions = names, functions

    def value(self, node: ast.expr) -> Any:
        rule: Callable[[Any], Any] | None = getattr(self, type(node).__name__, None)
        if rule is None:
            raise RefusedError(f"the expression '{ast.unparse(node)[:80]}' is not allowed")
        return rule(node)

    def Constant(self, node: ast.Constant) -> Any:
        if not isinstance(node.value, str | int | float | None):
            raise RefusedError(f"{node.value!r} is neither text nor a number")
        return node.value

    def Name(self, node: ast.Name) -> Any:
        try:
            return self._names[node.id]
        except KeyError:
            raise NameError(f"name {node.id!r} is not defined") from None

    def Attribute(self, node: ast.Attribute) -> Any:
        owner, name = self.value(node.value), node.attr
        for kind, methods in _METHODS.items():
            if isinstance(owner, kind) and name in methods.split():
                return getattr(owner, name)
        if isinstance(owner, dict) and not name.startswith("_"):
            try:
                return owner[name]  # xacro stores namespaces and YAML files as dictionaries.
            except (KeyError, AttributeError):
                raise NameError(f"{name!r} is not defined in '{ast.unparse(node.value)[:80]}'") from None
        kind_name = type(owner).__name__
        raise RefusedError(f"the attribute {name!r} of {kind_name!r} is not allowed in expressions")

    def Subscript(self, node: ast.Subscript) -> Any:
        owner = self.value(node.value)
        if not isinstance(owner, _INDEXABLE_TYPES):
            raise RefusedError(f"expressions may not index a {type(owner).__name__!r}")
        return owner[self.value(node.slice)]

    def Slice(self, node: ast.Slice) -> slice:
        parts = (node.lower, node.upper, node.step)
        return slice(*(None if part is None else self.value(part) for part in parts))

    def Call(self, node: ast.Call) -> Any:
        called = self.value(node.func)
        method = isinstance(getattr(called, "__self__", None), tuple(_METHODS))
        if not method and not any(called is function for function in self._functions):
            raise RefusedError(f"'{ast.unparse(node.func)[:80]}' is not a function of xacro")
        words: dict[str, Any] = {}
        for word in node.keywords:
            words |= self.value(word.value) if word.arg is None else {word.arg: self.value(word.value)}
        return called(*self._elements(node.args), **words)

    def List(self, node: ast.List) -> list[Any]:
        return list(self._elements(node.elts))

    def Tuple(self, node: ast.Tuple) -> tuple[Any, ...]:
        return tuple(self._elements(node.elts))

    def _elements(self, nodes: list[ast.expr]) -> Iterator[Any]:
        for node in nodes:
            if isinstance(node, ast.Starred):
                yield from self.value(node.value)
            else:
                yield self.value(node)

    def BinOp(self, node: ast.BinOp) -> Any:
        return _find_operation(_BINARY, node, node.op)(self.value(node.left), self.value(node.right))

    def UnaryOp(self, node: ast.UnaryOp) -> Any:
        return _find_operation(_UNARY, node, node.op)(self.value(node.operand))

    def BoolOp(self, node: ast.BoolOp) -> Any:
        decisive = isinstance(node.op, ast.Or)
        for part in node.values[:-1]:
            if bool(value := self.value(part)) is decisive:
                return value
        return self.value(node.values[-1])

    def Compare(self, node: ast.Compare) -> Any:
        left, result = self.value(node.left), True
        for op, part in zip(node.ops, node.comparators, strict=True):
            right = self.value(part)
            if not (result := _find_operation(_COMPARE, node, op)(left, right)):
                break
            left = right
        return result

    def IfExp(self, node: ast.IfExp) -> Any:
        return self.value(node.body if self.value(node.test) else node.orelse)

    def ListComp(self, node: ast.ListComp | ast.GeneratorExp) -> list[Any]:
        return [inner.value(node.elt) for inner in self._iterations(node.generators)]

    GeneratorExp = ListComp

    def _iterations(self, loops: list[ast.comprehension]) -> Iterator[_Evaluation]:
        """Run nested loops; for each iteration, yield an `_Evaluation` that knows the loop variables."""
        if not loops:
            yield self
            return
        loop, *others = loops
        for value in self.value(loop.iter):
            # Copying `self._names` would evaluate all xacro properties, even unused properties.
            scope = ChainMap(dict(_bind_targets(loop.target, value)), self._names)  # type: ignore[arg-type]
            inner = _Evaluation(scope, self._functions)
            if all(inner.value(condition) for condition in loop.ifs):
                yield from inner._iterations(others)


def _bind_targets(target: ast.expr, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(target, ast.Name):
        yield target.id, value
    elif isinstance(target, ast.Tuple | ast.List):
        for part, one in zip(target.elts, value, strict=True):
            yield from _bind_targets(part, one)
    else:
        text = ast.unparse(target)[:80]
        raise RefusedError(f"'{text}' is not a loop variable: use a name or a tuple of names")


def _find_operation(
    rules: Mapping[Any, Callable[..., Any]], node: ast.expr, op: ast.AST
) -> Callable[..., Any]:
    if type(op) not in rules:
        raise RefusedError(f"the operator in '{ast.unparse(node)[:80]}' is not allowed")
    return rules[type(op)]
