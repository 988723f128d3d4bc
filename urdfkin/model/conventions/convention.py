"""Built-in conventions, and conventions from a user's TOML file.

The target program can be any other program or library for robots. A user's file may start from a built-in
convention, and change its settings and some of its joints:

    like = "urdf"                     # the default
    joints = ["shoulder", "elbow"]    # the order, optional
    angle = "deg"                     # unit of all angles, optional

    [joint.elbow]
    name = "2"                        # its name in the target program
    sign = -1
    zero = 12.5                       # the program's value where the URDF's joint is at 0, in its unit
    unit = 4096                       # units of one turn; or "rad", "deg", "turn", "m", "mm"

The joint value in the target program is `sign * factor * value + zero`. The number `value` is the joint value
of the URDF in rad or m, and `factor` converts rad or m to `unit`.
"""

from __future__ import annotations

import json
import math
import re
import string
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from urdfkin.errors import InputError, UnknownNameError
from urdfkin.errors.validators import float_or_infinity, is_real, safe_repr
from urdfkin.system.files import abbreviate_path, may_exist, read_text

#: Factors that convert rad or m to each unit.
_UNITS = {"rad": 1.0, "deg": 180.0 / math.pi, "turn": 0.5 / math.pi, "m": 1.0, "mm": 1000.0}
#: Converted values and Jacobians stay finite.
_SMALLEST_UNIT = 1e-100
_ANGLES, _LENGTHS = ("rad", "deg", "turn"), ("m", "mm")
_CHOICES: dict[str, tuple[Any, ...]] = {
    "order": (
        "depth first, by name", "depth first, by file", "depth first, by link", "breadth first, by name",
        "breadth first, by file", "breadth first, with fixed joints", "file", "name", "given",
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
    "six_vectors": ("linear first", "angular first"),
    "names": ("urdf", "usd", "identifier", "isaacsim"),
    "angle": _ANGLES,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class JointRule:
    """The conversion of a joint value x (rad or m) to another program's value, `factor * x + zero`.

    `factor` includes `sign`.

    Attributes:
        zero: The other program's value for the joint value 0.
        unit: Name of the unit ("rad", "deg", "turn", "m" or "mm"), or the number of units in one turn.
            None means the convention's unit, and `factor` is None.

    Raises:
        InputError: an attribute has an invalid value.
        UnknownNameError: there is no such unit.
    """

    name: str | None = None
    sign: float = 1.0
    zero: float = 0.0
    unit: str | float | None = None

    def __post_init__(self) -> None:
        _check_rule(self.name, self.sign, self.zero, self.unit, "JointRule")

    @property
    def factor(self) -> float | None:
        if self.unit is None:
            return None
        return self.sign * (_UNITS[self.unit] if isinstance(self.unit, str) else self.unit / math.tau)

    @property
    def unit_kind(self) -> str:
        if self.unit is None:
            return ""
        return "length" if self.unit in _LENGTHS else "angle"


@dataclass(frozen=True, slots=True, kw_only=True)
class Convention:
    """The layout of q, v, a and six-vectors in another program.

    The defaults are urdfkin's convention. The first lines of `conventions.toml` explain `order`, `evidence`,
    `measurement`, and all attributes from `continuous` to `angle`.

    Attributes:
        joints: Names of the joints in order. Only the order "given" uses these names.
        rules: Rules of single joints, by the joint's name in the URDF.

    Raises:
        InputError: an attribute has an invalid value.
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
    six_vectors: str = "linear first"
    names: str = "urdf"
    angle: str = "rad"
    rules: Mapping[str, JointRule] = field(default_factory=dict)
    evidence: str = ""
    measurement: str = ""
    sources: tuple[str, ...] = ()
    note: str = ""

    def __post_init__(self) -> None:
        where = f"convention {_as_text(self.name, 'name', 'Convention')}"
        for key in _CHOICES:
            _check_choice(key, getattr(self, key), where)
        if not isinstance(self.joints, tuple | list) or not all(isinstance(x, str) for x in self.joints):
            raise InputError("`joints` must be a list of names", where=where, found=safe_repr(self.joints))
        if not isinstance(self.rules, Mapping) or not all(
            isinstance(rule, JointRule) for rule in self.rules.values()
        ):
            raise InputError("`rules` must map names to JointRule", where=where, found=safe_repr(self.rules))

    @property
    def angle_factor(self) -> float:
        return _UNITS[self.angle]

    @property
    def angle_unit(self) -> str:
        """Unit of angles that a text may state, as in "90deg"; "" if a text must state no unit."""
        return "rad" if self.angle == "rad" else ""


@cache
def _load_built_in() -> dict[str, Convention]:
    text = Path(__file__).with_name("conventions.toml").read_text("utf-8")
    return {
        name: Convention(name=name, **{**row, "sources": tuple(row.get("sources", ()))})
        for name, row in tomllib.loads(text).items()
    }


#: Names of the built-in conventions, in the order of conventions.toml.
BUILT_IN_NAMES = (
    "urdfkin", "pinocchio", "urdf", "mujoco", "drake", "idyntree", "rtb", "kdl", "isaaclab", "isaaclab3",
    "isaacgym", "newton", "newton-usd", "usd", "ros", "alphabetical",
)  # fmt: skip


def find_convention(name: str | Path | Convention) -> Convention:
    if isinstance(name, Convention):
        return name
    if not isinstance(name, str | Path):
        raise InputError("a convention must be a name or a TOML file", found=safe_repr(name))
    if (known := _load_built_in().get(str(name))) is not None:
        return known
    path = Path(name)
    if path.suffix == ".toml" or (name != "" and may_exist(path)):
        return parse_convention(read_text(path), abbreviate_path(path), path.stem)
    error = UnknownNameError("convention", str(name), BUILT_IN_NAMES)
    names = "`urdfkin order ROBOT` lists all conventions; the name of a convention file ends with .toml"
    error.remedy = f"{error.remedy} {names}"
    raise error


def parse_convention(text: str, where: str, name: str) -> Convention:
    """Parse a convention's TOML text; `name` is the default name and title."""
    try:
        entries = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError("the convention file is not valid TOML", where=where, found=str(error)) from None
    like = entries.pop("like", "urdf")
    if not isinstance(like, str) or like not in _load_built_in():
        raise UnknownNameError("convention", str(like), BUILT_IN_NAMES, where=where)
    base = replace(
        _load_built_in()[like], name=name, title=name, evidence="", measurement="", sources=(), note=""
    )
    changes: dict[str, Any] = {}
    for key in ("name", "title", "note"):
        if key in entries:
            changes[key] = _as_text(entries.pop(key), key, where)
    joints = entries.pop("joints", None)
    if joints is not None:
        if not isinstance(joints, list) or not all(isinstance(joint, str) for joint in joints):
            raise InputError("`joints` must be a list of names", where=where, found=safe_repr(joints))
        changes |= {"order": "given", "joints": tuple(joints)}
        check_unique(joints, where)
    rules = entries.pop("joint", {})
    if not isinstance(rules, dict) or not all(isinstance(rule, dict) for rule in rules.values()):
        raise InputError(
            "`joint` must contain tables, such as [joint.elbow]", where=where, found=safe_repr(rules)
        )
    changes["rules"] = {joint: _parse_rule(rule, f"{where}: joint {joint}") for joint, rule in rules.items()}
    check_unique([rule.name for rule in changes["rules"].values() if rule.name is not None], where)
    for key, value in entries.items():
        if key not in _CHOICES:
            raise UnknownNameError("key", key, (*_CHOICES, "like", "joints", "joint", "title"), where=where)
        _check_choice(key, value, where)
        changes[key] = value
    return replace(base, **changes)


def _check_choice(key: str, value: object, where: str) -> None:
    choices = _CHOICES[key]
    if isinstance(value, bool) or not isinstance(value, type(choices[0])) or value not in choices:
        words = ", ".join(map(str, choices))
        raise InputError(f"`{key}` must be one of: {words}", where=where, found=safe_repr(value))


def check_unique(names: Sequence[str], where: str) -> None:
    if len(set(names)) != len(names):
        double = next(name for i, name in enumerate(names) if name in names[:i])
        raise InputError("two joints have the same name in the convention", where=where, found=repr(double))


def _as_text(value: object, key: str, where: str) -> str:
    if not isinstance(value, str):
        raise InputError(f"`{key}` must be a text", where=where, found=safe_repr(value))
    return value


def _as_number(value: object, key: str, where: str) -> float:
    if not is_real(value) or not math.isfinite(number := float_or_infinity(value)):
        raise InputError(f"`{key}` must be a finite number", where=where, found=safe_repr(value))
    return number


def _parse_rule(rule: dict[str, Any], where: str) -> JointRule:
    for key in rule:
        if key not in ("name", "sign", "zero", "unit"):
            raise UnknownNameError("key", key, ("name", "sign", "zero", "unit"), where=where)
    _check_rule(rule.get("name"), rule.get("sign", 1), rule.get("zero", 0.0), rule.get("unit"), where)
    unit = rule.get("unit")
    return JointRule(
        rule.get("name"),
        float(rule.get("sign", 1)),
        float(rule.get("zero", 0.0)),
        unit if unit is None or isinstance(unit, str) else float(unit),
    )


def _check_rule(name: object, sign: object, zero: object, unit: object, where: str) -> None:
    if name is not None:
        _as_text(name, "name", where)
    if abs(_as_number(sign, "sign", where)) != 1.0:
        raise InputError("`sign` must be 1 or -1", where=where, found=safe_repr(sign))
    _as_number(zero, "zero", where)
    if isinstance(unit, str):
        if unit not in _UNITS:
            raise UnknownNameError("unit", unit, _UNITS, where=where)
    elif unit is not None:
        number = _as_number(unit, "unit", where)
        if not _SMALLEST_UNIT <= number <= 1.0 / _SMALLEST_UNIT:
            raise InputError(
                f"`unit` must be a positive number from {_SMALLEST_UNIT:g} to {1.0 / _SMALLEST_UNIT:g}",
                where=where,
                found=safe_repr(number),
                remedy="write the number of units in one turn, for example 360 for degrees",
            )


def as_toml(convention: Convention) -> str:
    lines = [f"{word} = {_quote(text)}" for word in ("title", "note") if (text := getattr(convention, word))]
    lines.append('like = "urdfkin"')
    if convention.order == "given":
        lines.append(f"joints = [{', '.join(map(_quote, convention.joints))}]")
    plain = Convention(name="")
    for key in _CHOICES:
        value = getattr(convention, key)
        if value != getattr(plain, key) and value != "given":
            lines.append(f"{key} = {value if isinstance(value, int) else _quote(value)}")
    for joint, rule in convention.rules.items():
        lines += ["", f"[joint.{_quote(joint)}]"]
        lines += [] if rule.name is None else [f"name = {_quote(rule.name)}"]
        lines += [] if rule.sign == 1.0 else ["sign = -1"]
        lines += [] if not rule.zero else [f"zero = {float(rule.zero)!r}"]
        if rule.unit is not None:
            unit = _quote(rule.unit) if isinstance(rule.unit, str) else repr(float(rule.unit))
            lines.append(f"unit = {unit}")
    return "\n".join(lines) + "\n"


def _quote(text: str) -> str:
    """Quote as JSON does. TOML also requires an escape for DEL."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


# -- names -------------------------------------------------------------------------------------------

_IDENTIFIER = re.compile("[A-Za-z_][A-Za-z0-9_]*")
_BASE_62_DIGITS = string.digits + string.ascii_uppercase + string.ascii_lowercase
#: An encoded number consists of digits of base 62.
#: The last digit is less than this number. All other digits are at least this number.
_PUNYCODE_THRESHOLD = 31


def spell_name(name: str, style: str) -> str:
    """Return a name as another program writes it.

    >>> [spell_name("1", style) for style in ("urdf", "usd", "identifier", "isaacsim")]
    ['1', 'tn__1_', '_', 'a_1']
    """
    match style:
        case "usd":
            return encode_usd_name(name)
        case "identifier":
            return make_identifier(name)
        case "isaacsim":
            valid = make_identifier(f"_{name}" if re.match("[0-9]", name) else name)
            return f"a{valid}" if valid.startswith("_") else valid
    return name


def spellings(name: str) -> frozenset[str]:
    """Return the spellings of a name in all styles.

    >>> sorted(spellings("arm-2"))
    ['arm-2', 'arm_2', 'tn__arm2_g6']
    """
    return frozenset(spell_name(name, style) for style in ("urdf", "usd", "identifier", "isaacsim"))


def make_identifier(name: str) -> str:
    """Replace each invalid byte by "_", as OpenUSD's `TfMakeValidIdentifier` does.

    >>> make_identifier("1"), make_identifier("arm-2")
    ('_', 'arm_2')
    """
    octets = name.encode().decode("latin-1")
    return re.sub(r"^[^A-Za-z_]|[^A-Za-z0-9_]", "_", octets) or "_"


def encode_usd_name(name: str) -> str:
    """Transcode a name as `usdex.core.getValidPrimName` of OpenUSD Exchange does.

    An identifier is returned unchanged. The code of any other name begins with "tn__" and the kept
    characters: ASCII letters, digits and "_". If there are kept characters, "_" follows. Each other
    character gives the number d n + p in base 62, as in Punycode, in the order of the code points:

    | Symbol | Meaning |
    |---|---|
    | d | code point minus the previous code point (at first 0) |
    | n | number of possible positions |
    | p | position among the characters that are already encoded |

    Source: github.com/PixarAnimationStudios/OpenUSD-proposals, proposals/transcoding_invalid_identifiers.

    >>> encode_usd_name("1"), encode_usd_name("arm-2"), encode_usd_name("arm_2")
    ('tn__1_', 'tn__arm2_g6', 'arm_2')
    """
    if _IDENTIFIER.fullmatch(name):
        return name
    placed = [i for i, letter in enumerate(name) if letter == "_" or (letter.isascii() and letter.isalnum())]
    out = "tn__" + "".join(name[i] for i in placed) + ("_" if placed else "")
    previous = 0
    for code, i in sorted((ord(letter), i) for i, letter in enumerate(name) if i not in set(placed)):
        number = (code - previous) * (len(placed) + 1) + sum(k < i for k in placed)
        while number >= _PUNYCODE_THRESHOLD:
            rest, digit = divmod(number - _PUNYCODE_THRESHOLD, len(_BASE_62_DIGITS) - _PUNYCODE_THRESHOLD)
            out += _BASE_62_DIGITS[_PUNYCODE_THRESHOLD + digit]
            number = rest
        out += _BASE_62_DIGITS[number]
        placed.append(i)
        previous = code
    return out
