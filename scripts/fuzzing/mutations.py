"""Make mutants of real URDFs; the same seed and number give the same bytes on any machine.

There are four families: bytes, tokens, attributes, and structure (new parents, closed loops, swapped names,
changed types and mimic rules).
"""

from __future__ import annotations

import contextlib
import functools
import random
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

from scripts.fuzzing import Case

#: Largest size of a file to mutate, in bytes. Larger files take longer and test nothing more.
LARGEST = 150_000

ODD_NUMBERS = (
    "0", "-0", "1e-400", "1e400", "1e308", "-1e308", "1e155", "1e-155", "1e-310", "5e-324", "nan",
    "inf", "-inf", "1.5708", "3.1416", "3.14159265", "90", "180", "1_0", "0x10", "1e", "1.", ".5", "+1",
    "--1", "1,5", "1e5.0", "", " ", "1 ", " 1", "1 2", "0 0 0", "1\t2", "١", "1d-1", "pi", "${pi}",
    "1" * 400, "0.1f", "1e17", "1e-17",
)  # fmt: skip
ODD_TEXTS = (
    "", " ", "base", "world", "universe", "root_joint", "../../x", "=1+1", "a" * 300, "\u202e", "ä",
    "a\u0308", "&lt;", "&#9;", "&foo;", "&#0;", "<", ">", '"', "'", "]]>", "-->", "\n", "\t", "\x00",
    "\ufeff", "\ud7ff",
)  # fmt: skip
KINDS = ("revolute", "continuous", "prismatic", "fixed", "planar", "floating", "ball", "Revolute", "")
TAGS = (
    *("link", "joint", "origin", "axis", "limit", "mimic", "parent", "child"),
    *("group", "Joint", "xacro:x", "gazebo"),
)

Mutator = Callable[[random.Random, bytes], bytes]


def mutant(seed: int, number: int, files: Sequence[Path]) -> Case:
    rng = random.Random(f"{seed}:{number}")
    path = rng.choice(list(files))
    data = path.read_bytes()
    done = [path.stem]
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        family = rng.choice(FAMILIES)
        mutate = rng.choice(family)
        data = mutate(rng, data)
        done.append(mutate.__name__.strip("_"))
    return Case(" ".join(done), data)


def _flip_a_bit(rng: random.Random, data: bytes) -> bytes:
    if not data:
        return data
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :]


def _delete_bytes(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + data[at + rng.choice((1, 2, 8, 64, 512)) :]


def _insert_bytes(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data) + 1)
    odd = (b"\0", b"\xff", b"\xef\xbb\xbf", b"<", b"&", b"\r")
    piece = rng.choice((rng.randbytes(rng.randrange(1, 9)), *odd))
    return data[:at] + piece + data[at:]


def _repeat_bytes(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data) + 1)
    end = at + rng.choice((1, 10, 100, 2000))
    return data[:end] + data[at:end] * rng.choice((1, 1, 5)) + data[end:]


def _cut_off(rng: random.Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _other_encoding(rng: random.Random, data: bytes) -> bytes:
    text = data.decode("utf-8", "replace")
    return text.encode(rng.choice(("utf-16", "utf-16-le", "utf-32", "utf-8-sig")), "replace")


_VALUE = re.compile(rb'([\w:]+)\s*=\s*"([^"]*)"')
_NUMBER = re.compile(rb"-?[0-9]+\.?[0-9]*(?:e-?[0-9]+)?")


def _odd_number(rng: random.Random, data: bytes) -> bytes:
    return _replace_one(rng, data, _NUMBER, rng.choice(ODD_NUMBERS).encode())


def _odd_value(rng: random.Random, data: bytes) -> bytes:
    match = _pick(rng, data, _VALUE)
    if match is None:
        return data
    value = rng.choice((*ODD_NUMBERS, *ODD_TEXTS)).encode("utf-8", "surrogatepass")
    return data[: match.start(2)] + value + data[match.end(2) :]


def _odd_blank(rng: random.Random, data: bytes) -> bytes:
    odd = (b"\t", b"\n", b"\r\n", b"  ", b"", b"\xc2\xa0")
    return _replace_one(rng, data, re.compile(rb" "), rng.choice(odd))


def _swap_values(rng: random.Random, data: bytes) -> bytes:
    first, second = _pick(rng, data, _VALUE), _pick(rng, data, _VALUE)
    if first is None or second is None or first.start() == second.start():
        return data
    if first.start() > second.start():
        first, second = second, first
    middle = data[first.end(2) : second.start(2)]
    return data[: first.start(2)] + second[2] + middle + first[2] + data[second.end(2) :]


def _prologue(rng: random.Random, data: bytes) -> bytes:
    odd = (b"\n", b"<!DOCTYPE robot>", b'<!DOCTYPE r [<!ENTITY a "b">]>', b"<!-- -->", b"text")
    return rng.choice(odd) + data


def _pick(rng: random.Random, data: bytes, pattern: re.Pattern[bytes]) -> re.Match[bytes] | None:
    # Take the first match after a random position, which is faster than finding all matches.
    at = rng.randrange(len(data) + 1)
    return pattern.search(data, at) or pattern.search(data)


def _replace_one(rng: random.Random, data: bytes, pattern: re.Pattern[bytes], piece: bytes) -> bytes:
    match = _pick(rng, data, pattern)
    return data if match is None else data[: match.start()] + piece + data[match.end() :]


def _on_tree(change: Callable[[random.Random, ET.Element], None]) -> Mutator:
    @functools.wraps(change)
    def mutate(rng: random.Random, data: bytes) -> bytes:
        try:
            root = ET.fromstring(data)
        except (ET.ParseError, ValueError, LookupError):
            return data
        if root.tag != "robot":
            return data
        # Many files have no element of some kind, which then cannot be changed.
        with contextlib.suppress(IndexError):
            change(rng, root)
        changed: bytes = ET.tostring(root, encoding="utf-8")
        return changed

    return mutate


def _part(rng: random.Random, root: ET.Element, *path: str) -> ET.Element:
    """Return a random element with this path; raise IndexError if there is none."""
    return rng.choice(root.findall("/".join(path)))


def _child(joint: ET.Element, tag: str) -> ET.Element:
    """Return the child of a joint with this tag; make it if it is missing."""
    found = joint.find(tag)
    return ET.SubElement(joint, tag) if found is None else found


def _attribute_away(rng: random.Random, root: ET.Element) -> None:
    element = rng.choice([e for e in root.iter() if e.attrib])
    del element.attrib[rng.choice(sorted(element.attrib))]


def _attribute_renamed(rng: random.Random, root: ET.Element) -> None:
    element = rng.choice([e for e in root.iter() if e.attrib])
    name = rng.choice(sorted(element.attrib))
    other = rng.choice((name.upper(), name + "s", name[:-1] or "x", "quat_xyzw"))
    element.set(other, element.attrib.pop(name))


def _version(rng: random.Random, root: ET.Element) -> None:
    root.set("version", rng.choice(("1.0", "1.1", "1.2", "2.0", "", "one", "1")))


def _element_away(rng: random.Random, root: ET.Element) -> None:
    parent = rng.choice([e for e in (root, *root.findall("joint"), *root.findall("link")) if len(e)])
    parent.remove(rng.choice(list(parent)))


def _element_twice(rng: random.Random, root: ET.Element) -> None:
    parent = rng.choice([e for e in (root, *root.findall("joint")) if len(e)])
    parent.insert(rng.randrange(len(parent) + 1), rng.choice(list(parent)))


def _element_moved(rng: random.Random, root: ET.Element) -> None:
    element = rng.choice(list(root))
    root.remove(element)
    home = rng.choice([root, *root])
    home.insert(rng.randrange(len(home) + 1), element)


def _tag_changed(rng: random.Random, root: ET.Element) -> None:
    rng.choice(list(root.iter())).tag = rng.choice(TAGS)


def _reparent(rng: random.Random, root: ET.Element) -> None:
    end, link = _part(rng, root, "joint", rng.choice(("parent", "child"))), _part(rng, root, "link")
    end.set("link", link.get("name", ""))


def _close_a_loop(rng: random.Random, root: ET.Element) -> None:
    first, second = _part(rng, root, "link"), _part(rng, root, "link")
    joint = ET.SubElement(root, "joint", name="loop", type=rng.choice(KINDS))
    ET.SubElement(joint, "parent", link=first.get("name", ""))
    ET.SubElement(joint, "child", link=second.get("name", ""))


def _swap_names(rng: random.Random, root: ET.Element) -> None:
    tag = rng.choice(("link", "joint"))
    first, second = _part(rng, root, tag), _part(rng, root, tag)
    one, two = first.get("name", ""), second.get("name", "")
    first.set("name", two)
    second.set("name", one)


def _rename(rng: random.Random, root: ET.Element) -> None:
    element = _part(rng, root, rng.choice(("link", "joint")))
    old = element.get("name", "")
    new = rng.choice([text for text in ODD_TEXTS if "\x00" not in text and "&" not in text])
    element.set("name", new)
    for end in root.iter():
        for key in ("link", "joint"):
            if end.get(key) == old:
                end.set(key, new)


def _kind_changed(rng: random.Random, root: ET.Element) -> None:
    _part(rng, root, "joint").set("type", rng.choice(KINDS))


def _mimic_added(rng: random.Random, root: ET.Element) -> None:
    joint, leader = _part(rng, root, "joint"), _part(rng, root, "joint")
    multiplier = rng.choice(("0", "1", "-2.5", "1e-300", "1e300"))
    ET.SubElement(joint, "mimic", joint=leader.get("name", ""), multiplier=multiplier, offset="0.1")


def _origin_changed(rng: random.Random, root: ET.Element) -> None:
    origin = _child(_part(rng, root, "joint"), "origin")
    odd = ("0", "1e-310", "-3.5e2", "1e17", "0.1")
    values = [rng.choice((*odd, repr(rng.uniform(-9, 9)))) for _ in range(3)]
    origin.set(rng.choice(("xyz", "rpy")), " ".join(values))


def _axis_changed(rng: random.Random, root: ET.Element) -> None:
    axis = _child(_part(rng, root, "joint"), "axis")
    odd = ("0", "1", "-1", "1e-200", "1e200", "0.577")
    values = [rng.choice((*odd, repr(rng.gauss(0, 1)))) for _ in range(3)]
    axis.set("xyz", " ".join(values))


def _limit_changed(rng: random.Random, root: ET.Element) -> None:
    limit = _part(rng, root, "joint", "limit")
    name = rng.choice(("lower", "upper", "effort", "velocity"))
    limit.set(name, rng.choice(("0", "-1", "1e308", "-1e308", "90")))


_ATTRIBUTES = (_attribute_away, _attribute_renamed, _version, _element_away, _element_twice, _tag_changed)
_STRUCTURE = (
    *(_reparent, _close_a_loop, _swap_names, _rename, _kind_changed, _mimic_added, _element_moved),
    *(_origin_changed, _axis_changed, _limit_changed),
)
#: Mutants of the structure are three times as frequent, because most other mutants are rejected.
FAMILIES: tuple[tuple[Mutator, ...], ...] = (
    (_flip_a_bit, _delete_bytes, _insert_bytes, _repeat_bytes, _cut_off, _other_encoding),
    (_odd_number, _odd_value, _odd_blank, _swap_values, _prologue),
    tuple(map(_on_tree, _ATTRIBUTES)),
    *3 * (tuple(map(_on_tree, _STRUCTURE)),),
)
