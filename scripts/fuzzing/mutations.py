"""Make mutants of real URDFs; the same seed and number give the same bytes on any machine.

There are four families: bytes, tokens, attributes, and structure (new parents, closed loops, swapped names,
changed types and mimic rules).
"""

import contextlib
import random
import re
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from xml.etree import ElementTree as ET

from scripts.fuzzing import Case

#: Maximum size (bytes) of a mutated file, because mutants of larger files are slow to test.
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

_BYTES = ("flip_a_bit", "delete_bytes", "insert_bytes", "repeat_bytes", "cut_off", "other_encoding")
_TOKENS = ("odd_number", "odd_value", "odd_blank", "swap_values", "prologue")
_ATTRIBUTES = (
    *("attribute_away", "attribute_renamed", "version", "element_away", "element_twice", "tag_changed"),
)
_STRUCTURE = (
    *("reparent", "close_a_loop", "swap_names", "rename", "kind_changed", "mimic_added", "element_moved"),
    *("origin_changed", "axis_changed", "limit_changed"),
)
#: Half of all changes are changes of structure, because urdfkin rejects most mutants of the other families.
FAMILIES = (_BYTES, _TOKENS, _ATTRIBUTES, *3 * (_STRUCTURE,))
_VALUE = re.compile(rb'([\w:]+)\s*=\s*"([^"]*)"')
_NUMBER = re.compile(rb"-?[0-9]+\.?[0-9]*(?:e-?[0-9]+)?")


def make_mutant(seed: int, number: int, files: Sequence[Path]) -> Case:
    rng = random.Random(f"{seed}:{number}")
    path = rng.choice(list(files))
    data, names = path.read_bytes(), [path.stem]
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        kind = rng.choice(rng.choice(FAMILIES))
        change = _change_bytes if kind in _BYTES else _change_tokens if kind in _TOKENS else _change_tree
        data = change(rng, kind, data)
        names.append(kind)
    return Case(" ".join(names), data)


def _change_bytes(rng: random.Random, kind: str, data: bytes) -> bytes:
    position = rng.randrange(len(data) + 1)
    match kind:
        case "flip_a_bit":
            flipped = bytes(byte ^ (1 << rng.randrange(8)) for byte in data[position : position + 1])
            return data[:position] + flipped + data[position + 1 :]
        case "delete_bytes":
            return data[:position] + data[position + rng.choice((1, 2, 8, 64, 512)) :]
        case "insert_bytes":
            odd = (b"\0", b"\xff", b"\xef\xbb\xbf", b"<", b"&", b"\r")
            return data[:position] + rng.choice((rng.randbytes(rng.randrange(1, 9)), *odd)) + data[position:]
        case "repeat_bytes":
            end = position + rng.choice((1, 10, 100, 2000))
            return data[:end] + data[position:end] * rng.choice((1, 1, 5)) + data[end:]
        case "cut_off":
            return data[:position]
    encoding = rng.choice(("utf-16", "utf-16-le", "utf-32", "utf-8-sig"))
    return data.decode("utf-8", "replace").encode(encoding, "replace")


def _change_tokens(rng: random.Random, kind: str, data: bytes) -> bytes:
    if kind == "prologue":
        odd = (b"\n", b"<!DOCTYPE robot>", b'<!DOCTYPE r [<!ENTITY a "b">]>', b"<!-- -->", b"text")
        return rng.choice(odd) + data
    pattern = {"odd_number": _NUMBER, "odd_blank": re.compile(rb" ")}.get(kind, _VALUE)
    # The first match after a random position is searched, because a search for all matches is slower.
    starts = [rng.randrange(len(data) + 1) for _ in range(2)]
    first, second = (pattern.search(data, position) or pattern.search(data) for position in starts)
    if first is None or second is None:
        return data
    group = pattern.groups  # Group 2 is an attribute's value, and group 0 is the whole match.
    if kind == "swap_values":
        if first.start() == second.start():
            return data
        first, second = sorted((first, second), key=lambda match: match.start())
        middle = data[first.end(2) : second.start(2)]
        return data[: first.start(2)] + second[2] + middle + first[2] + data[second.end(2) :]
    pieces = {
        "odd_number": [text.encode() for text in ODD_NUMBERS],
        "odd_value": [text.encode("utf-8", "surrogatepass") for text in (*ODD_NUMBERS, *ODD_TEXTS)],
        "odd_blank": [b"\t", b"\n", b"\r\n", b"  ", b"", b"\xc2\xa0"],
    }
    return data[: first.start(group)] + rng.choice(pieces[kind]) + data[first.end(group) :]


def _change_tree(rng: random.Random, kind: str, data: bytes) -> bytes:
    try:
        root = ET.fromstring(data)
    except (ET.ParseError, ValueError, LookupError):
        return data
    if root.tag != "robot":
        return data
    # If the file has no element to which the change `kind` applies, the tree stays unchanged.
    with contextlib.suppress(IndexError):
        (_change_structure if kind in _STRUCTURE else _change_elements)(rng, kind, root)
    changed: bytes = ET.tostring(root, encoding="utf-8")
    return changed


def _change_elements(rng: random.Random, kind: str, root: ET.Element) -> None:
    match kind:
        case "attribute_away":
            element = rng.choice([e for e in root.iter() if e.attrib])
            del element.attrib[rng.choice(sorted(element.attrib))]
        case "attribute_renamed":
            element = rng.choice([e for e in root.iter() if e.attrib])
            name = rng.choice(sorted(element.attrib))
            other = rng.choice((name.upper(), name + "s", name[:-1] or "x", "quat_xyzw"))
            element.set(other, element.attrib.pop(name))
        case "version":
            root.set("version", rng.choice(("1.0", "1.1", "1.2", "2.0", "", "one", "1")))
        case "element_away":
            parent = rng.choice([e for e in (root, *root.findall("joint"), *root.findall("link")) if len(e)])
            parent.remove(rng.choice(list(parent)))
        case "element_twice":
            parent = rng.choice([e for e in (root, *root.findall("joint")) if len(e)])
            parent.insert(rng.randrange(len(parent) + 1), rng.choice(list(parent)))
        case "tag_changed":
            rng.choice(list(root.iter())).tag = rng.choice(TAGS)


def _change_structure(rng: random.Random, kind: str, root: ET.Element) -> None:
    first, second = ([rng.choice(root.findall(tag)) for _ in range(2)] for tag in ("link", "joint"))
    (link, other_link), (joint, other_joint) = first, second
    elements = rng.choice((first, second))
    match kind:
        case "reparent":
            joint.findall(rng.choice(("parent", "child")))[0].set("link", link.get("name", ""))
        case "close_a_loop":
            loop = ET.SubElement(root, "joint", name="loop", type=rng.choice(KINDS))
            ET.SubElement(loop, "parent", link=link.get("name", ""))
            ET.SubElement(loop, "child", link=other_link.get("name", ""))
        case "swap_names":
            names = [element.get("name", "") for element in elements]
            for element, name in zip(elements, reversed(names), strict=True):
                element.set("name", name)
        case "rename":
            old = elements[0].get("name", "")
            new = rng.choice([text for text in ODD_TEXTS if "\x00" not in text and "&" not in text])
            elements[0].set("name", new)
            for element, key in product(root.iter(), ("link", "joint")):
                if element.get(key) == old:
                    element.set(key, new)
        case "kind_changed":
            joint.set("type", rng.choice(KINDS))
        case "mimic_added":
            multiplier = rng.choice(("0", "1", "-2.5", "1e-300", "1e300"))
            attributes = {"joint": other_joint.get("name", ""), "multiplier": multiplier, "offset": "0.1"}
            ET.SubElement(joint, "mimic", attributes)
        case "element_moved":
            element = rng.choice(list(root))
            root.remove(element)
            home = rng.choice([root, *root])
            home.insert(rng.randrange(len(home) + 1), element)
        case "origin_changed" | "axis_changed":
            tag = kind.removesuffix("_changed")
            child = joint.find(tag)
            child = ET.SubElement(joint, tag) if child is None else child
            odd = ("0", "1e-310", "-3.5e2", "1e17", "0.1", "1", "-1", "1e-200", "1e200", "0.577")
            values = [rng.choice((*odd, repr(rng.gauss(0, 3)))) for _ in range(3)]
            child.set(rng.choice(("xyz", "rpy") if tag == "origin" else ("xyz",)), " ".join(values))
        case "limit_changed":
            limit = rng.choice(root.findall("joint/limit"))
            name = rng.choice(("lower", "upper", "effort", "velocity"))
            limit.set(name, rng.choice(("0", "-1", "1e308", "-1e308", "90")))
