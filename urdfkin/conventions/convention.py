"""A convention as data: the built-in ones and those of a user's TOML file.

A user's file may begin from a built-in convention and change some of its joints:

    like = "urdf"                     # the default
    joints = ["shoulder", "elbow"]    # the order, optional
    angle = "deg"                     # unit of all angles, optional

    [joint.elbow]
    name = "2"                        # its name in the tool
    sign = -1
    zero = 12.5                       # the tool's value where the URDF's joint is at 0, in the tool's unit
    unit = 4096                       # units of one turn; or "rad", "deg", "turn", "m", "mm"

The value in the tool is `sign * value * factor + zero`.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from urdfkin.errors import InputError, UnknownNameError
from urdfkin.errors.validators import is_real, safe_repr
from urdfkin.system.files import exists, read_text, shortened

#: Factors from rad or m to a unit.
_UNITS = {"rad": 1.0, "deg": 180.0 / math.pi, "turn": 0.5 / math.pi, "m": 1.0, "mm": 1000.0}
_ANGLES, _LENGTHS = ("rad", "deg", "turn"), ("m", "mm")
_CHOICES: dict[str, tuple[Any, ...]] = {
    "order": (
        "depth first, by name",
        "depth first, by file",
        "depth first, by link",
        "breadth first, by name",
        "breadth first, with fixed joints",
        "file",
        "name",
        "given",
    ),
    "continuous": (1, 2),
    "mimic": ("none", "own"),
    "quaternion": ("xyzw", "wxyz"),
    "base_q": ("position first", "quaternion first"),
    "base_v": ("linear first", "angular first"),
    "linear": ("body", "parent"),
    "angular": ("body", "parent"),
    "point": ("origin", "centre of mass"),
    "planar": ("body", "parent"),
    "six": ("linear first", "angular first"),
    "names": ("urdf", "usd"),
    "angle": _ANGLES,
}


@dataclass(frozen=True, slots=True)
class JointRule:
    """A joint's value in a tool: `factor * value + zero`, in the tool's unit.

    Attributes:
        name: Its name in the tool; None: the name in the URDF.
        factor: Sign times units per rad or m; None: the convention's unit.
        zero: The tool's value where the URDF's joint is at 0.
        of: "angle" or "length" if the unit fits only one of them, else "".
    """

    name: str | None = None
    factor: float | None = None
    zero: float = 0.0
    sign: float = 1.0
    of: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Convention:
    """The layout of q, v, a, Jacobians and six-vectors in a tool.

    The default values are urdfkin's own convention. `conventions.toml` explains each attribute.

    >>> find_convention("mujoco").quaternion, find_convention("drake").base_q
    ('wxyz', 'quaternion first')
    """

    name: str
    title: str = ""
    order: str = "depth first, by name"
    joints: tuple[str, ...] = ()
    continuous: int = 1
    mimic: str = "none"
    quaternion: str = "xyzw"
    base_q: str = "position first"
    base_v: str = "linear first"
    linear: str = "body"
    angular: str = "body"
    point: str = "origin"
    planar: str = "body"
    six: str = "linear first"
    names: str = "urdf"
    angle: str = "rad"
    rules: Mapping[str, JointRule] = field(default_factory=dict)
    evidence: str = ""
    sources: tuple[str, ...] = ()
    note: str = ""

    @property
    def angle_factor(self) -> float:
        """Units of the convention in one radian."""
        return _UNITS[self.angle]


@cache
def _built_in() -> dict[str, Convention]:
    text = Path(__file__).with_name("conventions.toml").read_text("utf-8")
    return {
        name: Convention(name=name, **{**row, "sources": tuple(row.get("sources", ()))})
        for name, row in tomllib.loads(text).items()
    }


#: Names of the built-in conventions, in the order of tables; a test compares them with conventions.toml.
BUILT_IN = (
    "urdfkin", "pinocchio", "urdf", "mujoco", "drake", "idyntree", "rtb", "kdl", "isaaclab", "isaacgym",
    "newton", "usd", "ros", "alphabetical",
)  # fmt: skip


def find_convention(name: str | Path | Convention) -> Convention:
    """Return a convention by its name, from a TOML file, or unchanged.

    Raises:
        UnknownNameError: there is no such convention, and no such file.
        InputError: the file has an unknown key, an invalid value, or two columns of one name.
        SourceError: the file cannot be read.
    """
    if isinstance(name, Convention):
        return name
    if not isinstance(name, str | Path):
        raise InputError("a convention must be a name or a TOML file", found=safe_repr(name))
    if (known := _built_in().get(str(name))) is not None:
        return known
    path = Path(name)
    if path.suffix == ".toml" or exists(path):
        return read_convention(read_text(path), shortened(path), path.stem)
    raise UnknownNameError("convention", str(name), BUILT_IN)


def read_convention(text: str, where: str, name: str) -> Convention:
    """Return the convention of a TOML text.

    Raises:
        InputError: invalid TOML, an unknown key, an invalid value, or two columns of one name.
        UnknownNameError: `like` names no built-in convention.
    """
    try:
        found = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError("this is not a TOML file", where=where, found=str(error)) from None
    like = found.pop("like", "urdf")
    if like not in _built_in():
        raise UnknownNameError("convention", str(like), BUILT_IN, where=where)
    base = replace(_built_in()[like], name=name, title=name, evidence="", sources=(), note="")
    changes: dict[str, Any] = {}
    for word in ("name", "title", "note"):
        if word in found:
            changes[word] = _text(found.pop(word), word, where)
    joints = found.pop("joints", None)
    if joints is not None:
        if not isinstance(joints, list) or not all(isinstance(joint, str) for joint in joints):
            raise InputError("`joints` must be a list of names", where=where, found=safe_repr(joints))
        changes |= {"order": "given", "joints": tuple(joints)}
        _demand_once(joints, where)
    rules = found.pop("joint", {})
    if not isinstance(rules, dict) or not all(isinstance(rule, dict) for rule in rules.values()):
        raise InputError(
            "`joint` must contain tables, such as [joint.elbow]", where=where, found=safe_repr(rules)
        )
    changes["rules"] = {joint: _rule(rule, f"{where}: joint {joint}") for joint, rule in rules.items()}
    columns = [rule.name for rule in changes["rules"].values() if rule.name is not None]
    _demand_once(columns, where)
    for key, value in found.items():
        if key not in _CHOICES:
            raise UnknownNameError("key", key, (*_CHOICES, "like", "joints", "joint", "title"), where=where)
        if value not in _CHOICES[key]:
            words = ", ".join(map(str, _CHOICES[key]))
            raise InputError(f"`{key}` must be one of: {words}", where=where, found=safe_repr(value))
        changes[key] = value
    return replace(base, **changes)


def _demand_once(names: list[str], where: str) -> None:
    if len(set(names)) != len(names):
        double = next(name for i, name in enumerate(names) if name in names[:i])
        raise InputError("two joints have the same name in the convention", where=where, found=repr(double))


def _text(value: object, word: str, where: str) -> str:
    if not isinstance(value, str):
        raise InputError(f"`{word}` must be a text", where=where, found=safe_repr(value))
    return value


def _number(value: object, word: str, where: str) -> float:
    if not is_real(value) or not math.isfinite(value):
        raise InputError(f"`{word}` must be a finite number", where=where, found=safe_repr(value))
    return float(value)


def _rule(rule: dict[str, Any], where: str) -> JointRule:
    """Return the rule of a joint from its table."""
    for key in rule:
        if key not in ("name", "sign", "zero", "unit"):
            raise UnknownNameError("key", key, ("name", "sign", "zero", "unit"), where=where)
    name = _text(rule["name"], "name", where) if "name" in rule else None
    sign = _number(rule.get("sign", 1), "sign", where)
    if abs(sign) != 1.0:
        raise InputError("`sign` must be 1 or -1", where=where, found=safe_repr(rule["sign"]))
    zero = _number(rule.get("zero", 0.0), "zero", where)
    unit = rule.get("unit")
    if unit is None:
        return JointRule(name, None, zero, sign)
    if isinstance(unit, str):
        if unit not in _UNITS:
            raise UnknownNameError("unit", unit, _UNITS, where=where)
        return JointRule(name, sign * _UNITS[unit], zero, sign, "length" if unit in _LENGTHS else "angle")
    per_turn = _number(unit, "unit", where)
    if per_turn <= 0.0:
        raise InputError(
            "`unit` must be positive: the number of units in one turn", where=where, found=safe_repr(unit)
        )
    return JointRule(name, sign * per_turn / math.tau, zero, sign, "angle")
