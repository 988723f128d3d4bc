"""Parse q, v and a: arrays, text, mappings by name, named poses, and tables with labels.

| input | example |
|---|---|
| numbers in order, between commas or blanks; brackets allowed | `0.3, 30deg, pi/2` |
| numbers by name, between commas | `shoulder=30deg, elbow=pi/2` |
| a named pose | `ready` |
| a named pose with changes | `ready, elbow=pi/2` |
| a mapping from names to numbers, text or batches | `{"shoulder": "30deg", "elbow": [0.1, 0.2]}` |
| a pandas Series or DataFrame, or another table with named columns | read as a mapping |

Without a named pose, a missing name is an error.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.errors import InputError, QuestionsSection, UnknownNameError
from urdfkin.errors.numbers import number_remedy, parse_float, parse_quantity
from urdfkin.errors.validators import safe_repr
from urdfkin.kinematics.inputs import FloatArray, as_floats

#: Types that q, v and a may have. `ArrayLike` contains `str`, for text such as "ready".
ConfigurationLike = ArrayLike | Mapping[str, ArrayLike]

_MAX_NAMES = 8
_BLANK_BEFORE_UNIT = re.compile(r" (?=(?:deg\w*|rad\w*|mm|m|°)(?: |/|$))")
_BLANKS_AROUND_OPERATORS = re.compile(r" ?([=*/]) ?")


class Hint(NamedTuple):
    remedy: str
    question: QuestionsSection


@dataclass(frozen=True, slots=True)
class CoordinateLayout:
    """Names and units of q, v or a.

    Attributes:
        units: "rad", "m", "" for a number without a unit, or None for an unknown unit.
        spans: First index and number of coordinates of each joint that has several coordinates.
        hints_by_name: Hints in errors about a joint without a coordinate, by the joint's name.
    """

    symbol: str
    names: tuple[str, ...]
    units: tuple[str | None, ...]
    spans: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    poses: Callable[[], Mapping[str, FloatArray]] = dict
    hints_by_name: Callable[[], Mapping[str, Hint]] = dict
    hints_by_length: Callable[[], Mapping[int, Hint]] = dict

    def parse(self, value: str | Mapping[str, ArrayLike], where: str | None = None) -> FloatArray:
        """Return the numbers that a text or mapping describes.

        >>> rest = {"neutral": np.zeros(2)}
        >>> arm = CoordinateLayout("q", ("shoulder", "elbow"), ("rad", "rad"), poses=lambda: rest)
        >>> arm.parse("neutral, elbow=2").tolist(), arm.parse({"elbow": [1, 2], "shoulder": 0.5}).tolist()
        ([0.0, 2.0], [[0.5, 1.0], [0.5, 2.0]])
        >>> arm.parse("elbow=30deg")
        Traceback (most recent call last):
        urdfkin.errors.InputError: q: no value for shoulder; give a value for each joint, or begin \
with 'neutral, elbow=...'
        """
        where = where or self.symbol
        if not isinstance(value, Mapping) and self._is_in_order(cells := self._split(value)):
            return self._parse_in_order(cells, where)
        values, pose = self.parse_by_name(value, where)
        return self._combine_values(values, where, pose)

    def parse_by_name(
        self, value: str | Mapping[str, ArrayLike], where: str
    ) -> tuple[dict[str, ArrayLike], FloatArray | None]:
        """Return the given values by name, and the pose that `value` names, or None.

        >>> CoordinateLayout("q", ("elbow",), ("rad",)).parse_by_name("elbow=30deg", "q")
        ({'elbow': '30deg'}, None)
        """
        if isinstance(value, Mapping):
            return dict(value), None
        cells, pose = self._split(value), None
        if not cells:
            return {}, None
        if self._is_in_order(cells):
            raise InputError("give each number with its name", where=where, found=repr(value.strip()[:60]))
        pairs = [_split_pair(cell) for cell in cells]
        if pairs[0][0] is None:
            pose = self._find_pose(cells[0], where)
            pairs = pairs[1:]
        values: dict[str, ArrayLike] = {}
        for name, number in pairs:
            if name is None or name in values:
                wrong = f"{name!r} twice" if name else repr(number[:60])
                raise InputError(
                    "give all numbers in order, or each number with its name", where=where, found=wrong
                )
            values[name] = number
        return values, pose

    def _split(self, text: str) -> list[str]:
        """Split a text into cells. A name may contain blanks and commas if the text has only this name."""
        name, _, _ = text.rpartition("=")
        return [text.strip()] if name.strip() in self.names else _split_cells(text)

    @staticmethod
    def _is_in_order(cells: Sequence[str]) -> bool:
        is_pose = len(cells) == 1 and _is_pose_name(cells[0])
        return not is_pose and all(_split_pair(cell)[0] is None for cell in cells)

    def check_names(self, names: Sequence[str], where: str) -> None:
        for name in names:
            if not isinstance(name, str) or (name not in self.names and name not in self.spans):
                raise self._unknown_name_error(name, where)

    def _find_pose(self, word: str, where: str) -> FloatArray:
        poses = self.poses()
        if word not in poses:
            raise UnknownNameError("pose", word[:60], poses, where=where)
        return poses[word]

    def _parse_in_order(self, cells: Sequence[str], where: str) -> FloatArray:
        if len(cells) != len(self.names):
            hint = self.hints_by_length().get(len(cells))
            raise wrong_count_error(self.names, len(cells), where, **hint._asdict() if hint else {})
        rows = zip(cells, self.names, self.units, strict=True)
        return np.array(
            [self._parse_number(text, f"{where}, {name}", unit) for text, name, unit in rows], float
        )

    def _combine_values(
        self, values: dict[str, ArrayLike], where: str, pose: FloatArray | None
    ) -> FloatArray:
        columns: dict[int, FloatArray] = {}
        index = {name: i for i, name in enumerate(self.names)}
        for name, value in values.items():
            if name in index:
                i = index[name]
                label = f"{where}, {name}"
                number = self._parse_number(value, label, self.units[i]) if isinstance(value, str) else value
                own = {i: as_floats(number, label)}
            else:
                own = self._parse_joint(name, value, where)
            if twice := [self.names[i] for i in own if i in columns]:
                raise InputError("a number is given twice", where=where, found=join_names(twice))
            columns |= own
        missing = [name for i, name in enumerate(self.names) if i not in columns]
        if missing and pose is None:
            begin = f"'neutral, {next(iter(values), missing[0])}=...'"
            raise InputError(
                f"no value for {join_names(missing)}",
                where=where,
                remedy=f"give a value for each joint, or begin with {begin}",
            )
        shapes = [x.shape for x in columns.values()]
        try:
            shape = np.broadcast_shapes(*shapes)
        except ValueError:
            raise InputError(
                "the batches have different shapes", where=where, found=safe_repr(shapes)
            ) from None
        out = np.empty((*shape, len(self.names)))
        out[...] = 0.0 if pose is None else pose
        for i, x in columns.items():
            out[..., i] = x
        return out

    def _parse_joint(self, name: object, value: ArrayLike, where: str) -> dict[int, FloatArray]:
        if not isinstance(name, str) or name not in self.spans:
            raise self._unknown_name_error(name, where)
        at, size = self.spans[name]
        x = as_floats(value, f"{where}, {name}")
        if x.shape[-1:] != (size,):
            names, count = self.names[at : at + size], (x.shape or (1,))[-1]
            raise wrong_count_error(
                names, count, f"{where}, {name}", question=QuestionsSection.FLOATING_BASES
            )
        return {at + k: x[..., k] for k in range(size)}

    def _unknown_name_error(self, name: object, where: str) -> InputError | UnknownNameError:
        kind = {"q": "coordinate", "v": "joint velocity"}.get(self.symbol, "joint acceleration")
        if not isinstance(name, str):
            return InputError(f"the name of a {kind} must be text", where=where, found=safe_repr(name))
        if (hint := self.hints_by_name().get(name)) is not None:
            return InputError(f"{name!r} is not a {kind}", where=where, **hint._asdict())
        return UnknownNameError(kind, name[:60], [*self.names, *self.spans], where=where)

    def _parse_number(self, text: str, where: str, unit: str | None) -> float:
        quantity = parse_quantity(text)
        value = parse_float(text) if quantity is None else quantity.value
        if value is None:
            hint = number_remedy(text) or "write 0.5, 30deg, pi/2 or 5mm"
            raise InputError("not a finite number", where=where, found=repr(text.strip()[:60]), remedy=hint)
        if quantity is None:
            return value
        order = "qva".index(self.symbol)
        other = unit is not None and quantity.unit not in (None, unit)
        if other or quantity.seconds_exponent not in (0, order):
            kinds = {"rad": "rad or deg", "m": "m or mm", "": "no unit", None: "rad, deg, m or mm"}[unit]
            per = ("", ", or these units per s", ", or these units per s^2")[order]
            hint = f"use {kinds}{per}"
            raise InputError("wrong unit", where=where, found=repr(text.strip()), remedy=hint)
        return value


def as_text_or_mapping(value: ConfigurationLike, where: str) -> str | Mapping[str, ArrayLike] | None:
    """Return text and mappings unchanged, and None for numbers.

    A table with labels becomes a mapping.

    >>> [as_text_or_mapping(value, "q") for value in ([0.5, 0.1], "ready", {"elbow": 0.5})]
    [None, 'ready', {'elbow': 0.5}]
    """
    if isinstance(value, np.ndarray):
        return None
    if isinstance(value, Mapping | str):
        return value
    if isinstance(value, list | tuple):
        if any(_labels(item) for item in value):
            raise InputError(
                "a list of labelled objects, such as dicts or rows of pandas, is not accepted",
                where=where,
                found=f"{len(value)} of them",
                remedy="give one mapping or table from names to values, or numbers in coordinate order",
            )
        return None
    labels = _labels(value)
    if twice := [safe_repr(label) for label, count in Counter(labels).items() if count > 1]:
        raise InputError("a label occurs twice", where=where, found=join_names(twice))
    table: Any = value
    return {label: table[label] for label in labels} or None


def _labels(value: object) -> list[Any]:
    """Return a table's labels. The default labels 0, 1, 2, ... are ignored."""
    table: Any = value
    if not hasattr(type(value), "__getitem__"):
        return []
    if hasattr(type(value), "keys"):
        labels = list(table.keys())
    else:
        columns = getattr(table, "column_names", getattr(table, "columns", ()))
        # In CasADi, `columns` is a method.
        labels = [] if callable(columns) else list(columns)
    return [] if labels == list(range(len(labels))) else labels


def wrong_count_error(
    names: Sequence[str],
    count: int,
    where: str,
    remedy: str | None = None,
    question: QuestionsSection | None = QuestionsSection.JOINT_ORDER,
) -> InputError:
    without = f", none for {join_names(names[count:])}" if count < len(names) else ""
    return InputError(
        f"{len(names)} numbers are expected ({join_names(names) or 'none: no joint moves'})",
        where=where,
        found=f"{count}{without}",
        remedy=remedy,
        question=question,
    )


def join_names(names: Sequence[str]) -> str:
    more = f", ... ({len(names)} in all)" if len(names) > _MAX_NAMES else ""
    return ", ".join(map(str, names[:_MAX_NAMES])) + more


def _split_cells(text: str) -> list[str]:
    text = " ".join(text.split())
    if text[:1] + text[-1:] in ("[]", "()", "{}"):
        text = text[1:-1].strip()
    if "," in text:
        return [cell.strip() for cell in text.removesuffix(",").split(",")]
    return _BLANK_BEFORE_UNIT.sub("", _BLANKS_AROUND_OPERATORS.sub(r"\1", text)).split()


def _split_pair(cell: str) -> tuple[str | None, str]:
    """Split "name=0.5" into name and number."""
    name, equals, number = cell.rpartition("=")
    return (name.strip(), number.strip()) if equals else (None, cell)


def _is_pose_name(text: str) -> bool:
    return (
        text[:1].isalpha()
        and "=" not in text
        and parse_quantity(text) is None
        and number_remedy(text) is None
    )
