"""Findings of `load` about MJCF and USD: parts that a tree cannot represent, and probable mistakes.

A finding names an MJCF element by the tag and the name of the element, or a USD prim by its path. urdfkin
searches for the element in the first 10 MB of the file, and adds the line of the element to the finding. In
included files, other layers and binary files, urdfkin does not search for elements.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from html import unescape
from typing import TYPE_CHECKING

from urdfkin.urdf.findings import NEWLINE, NOTE, WARNING, Finding, Rule
from urdfkin.urdf.records import ATTRIBUTE, START_TAG

if TYPE_CHECKING:
    from collections.abc import Callable

    from urdfkin.urdf.mjcf import MjcfRemark
    from urdfkin.urdf.usd import UsdRemark

LEFT_OUT_MOTION = Rule("MJCF101", "left-out-motion", WARNING)
LEFT_OUT = Rule("MJCF102", "left-out", NOTE)
ANGLE_UNIT = Rule("MJCF201", "angle-unit", WARNING)

LEFT_OUT_OF_USD = Rule("USD101", "left-out-of-usd", WARNING)
UNUSED_IN_USD = Rule("USD102", "unused-in-usd", NOTE)
MISSING_LAYER = Rule("USD103", "missing-layer", WARNING)
TIME_SAMPLES = Rule("USD104", "time-samples", WARNING)
OUTSIDE_JOINT = Rule("USD201", "outside-joint", WARNING)
LOOSE_BODY = Rule("USD202", "loose-body", WARNING)
LOST_MIMIC = Rule("USD203", "lost-mimic", WARNING)
UNIT_SCALE = Rule("USD301", "unit-scale", WARNING)
UP_AXIS = Rule("USD302", "up-axis", WARNING)
LIMIT_UNIT = Rule("USD303", "limit-unit", WARNING)
REST_POSE = Rule("USD304", "rest-pose", WARNING)
MIRRORED_BODY = Rule("USD305", "mirrored-body", WARNING)


_MAX_SEARCHED_BYTES = 10_000_000
#: Beginnings and ends of XML markup that is not an element.
_SKIPPED_MARKUP = {b"<!--": b"-->", b"<![CDATA[": b"]]>", b"<?": b"?>", b"<!": b">"}
#: MJCF elements that findings report by tag, without a name. Keys are tags in the file; values are tags in
#: the finding.
_NAMELESS = {"compiler": "compiler", "tendon": "tendon", "flex": "flex", "flexcomp": "flex"}
#: Regular expression for the beginning of a prim in a USD text file, or for a delimiter. Delimiters are
#: parentheses, braces, and the beginnings of comments, strings, references and arrays.
_PRIM_OR_DELIMITER = re.compile(
    rb'''\b(?:def|over|class)\s+(?:[\w:]+\s+)?"([^"]*)"|#|"""|\'\'\'|"|\'|@@@|@|\[|[(){}]'''
)
#: Maps the beginning of a USD comment, array, string or reference to a regular expression for its end.
_SKIPPED_TEXT = {
    b"#": re.compile(rb"[\r\n]"),
    b"[": re.compile(rb"\]"),
    **{quote: re.compile(rb"(?:\\.|[^\\])*?" + quote, re.DOTALL) for quote in (b'"""', b"'''", b'"', b"'")},
    b"@@@": re.compile(rb"@@@"),
    b"@": re.compile(rb"@"),
}
#: Maps (tag, name) of an element or prim to (line, column, width) of its beginning. Lines and columns count
#: from 1.
_Positions = Mapping[tuple[str | None, str | None], tuple[int, int, int]]


def make_mjcf_findings(remarks: Iterable[MjcfRemark], file: str, data: bytes) -> tuple[Finding, ...]:
    remarks = tuple(remarks)
    places = _find_positions(data, _find_elements) if any(remark.where for remark in remarks) else {}
    findings = []
    for remark in remarks:
        tag, _, name = (remark.where or "").partition(" ")
        rule = LEFT_OUT_MOTION if remark.moves else LEFT_OUT if remark.remedy is None else ANGLE_UNIT
        findings.append(_make_finding(rule, remark, file, tag or None, name or None, places))
    return tuple(findings)


def make_usd_findings(remarks: Iterable[UsdRemark], file: str, data: bytes) -> tuple[Finding, ...]:
    remarks = tuple(remarks)
    rules = {rule.slug: rule for rule in globals().values() if isinstance(rule, Rule)}
    is_text = data.startswith(b"#usda") and any(remark.where for remark in remarks)
    places = _find_positions(data, _find_prims) if is_text else {}
    return tuple(
        _make_finding(
            rules[remark.kind], remark, file, "prim" if remark.where else None, remark.where or None, places
        )
        for remark in remarks
    )


def _make_finding(
    rule: Rule,
    remark: MjcfRemark | UsdRemark,
    file: str,
    element: str | None,
    name: str | None,
    places: _Positions,
) -> Finding:
    line, column, width = places.get((element, name), (1, 1, 0))
    return Finding(
        rule.id,
        rule.severity,
        remark.what,
        None,
        remark.remedy,
        file,
        line,
        column,
        element,
        name,
        width=width,
    )


def _find_positions(
    data: bytes, search: Callable[[bytes], Iterator[tuple[str, str | None, int, int]]]
) -> _Positions:
    """Return the position of the first element with each tag and name."""
    found: dict[tuple[str | None, str | None], tuple[int, int]] = {}
    for element, name, first, last in search(data[:_MAX_SEARCHED_BYTES]):
        found.setdefault((element, name), (first, last))
    places, line, start, cursor = {}, 1, 0, 0
    for key, (first, last) in sorted(found.items(), key=lambda item: item[1]):
        for end in NEWLINE.finditer(data, cursor, first):
            line, start = line + 1, end.end()
        cursor = first
        before, marked = (data[i:j].decode("utf-8", "replace") for i, j in ((start, first), (first, last)))
        places[key] = line, len(before) + 1, len(marked.splitlines()[0])
    return places


def _find_elements(data: bytes) -> Iterator[tuple[str, str | None, int, int]]:
    """Yield tag, name and span (in bytes) of each MJCF element that a finding can name.

    An equality constraint without a name is identified by its index. After an `<include>`, the index is
    unknown, so constraints without a name are skipped.
    """
    above, equalities, includes = list[str](), 0, False
    at = data.find(b"<")
    while at >= 0:
        end = next((end for begin, end in _SKIPPED_MARKUP.items() if data.startswith(begin, at)), None)
        tag = None if end else START_TAG.match(data, at)
        if end is not None:
            at = data.find(end, at)
            if at < 0:
                return
        elif tag is None or data.startswith(b"</", at):
            del above[-1:]
        else:
            word = tag[0][1:].split(None, 1)[0].rstrip(b"/>").decode("utf-8", "replace")
            last, name = at + 1 + len(word.encode()), None
            for match in ATTRIBUTE.finditer(data, last, tag.end()):
                if match[1] == b"name":
                    name, last = unescape(match[2][1:-1].decode("utf-8", "replace")), match.end()
            includes = includes or word == "include"
            if "worldbody" in above and word in ("body", "joint", "freejoint") and name is not None:
                yield word.removeprefix("free"), name, at, last
            elif above[-1:] == ["equality"] and "default" not in above:
                if name is not None or not includes:
                    yield "equality", str(equalities) if name is None else name, at, last
                equalities += 1
            elif word in _NAMELESS and "default" not in above:
                yield _NAMELESS[word], None, at, last
            if not tag[0].endswith(b"/>"):
                above.append(word)
        at = data.find(b"<", at + 1)


def _find_prims(data: bytes) -> Iterator[tuple[str, str, int, int]]:
    """Yield "prim", the path and the span (in bytes) of each prim in a USD text file."""
    above, prim, cursor, inside = list[str](), "", 0, 0
    while (found := _PRIM_OR_DELIMITER.search(data, cursor)) is not None:
        cursor, token = found.end(), found[0]
        if found[1] is not None:
            prim = "/" + found[1].decode("utf-8", "replace")
            yield "prim", "".join(above) + prim, found.start(), found.end()
        elif token in b"()":  # Braces inside parentheses enclose dictionaries, not prims.
            inside += 1 if token == b"(" else -1
        elif token == b"{":
            above += [] if inside else [prim]
            prim = prim if inside else ""
        elif token == b"}":
            del above[len(above) if inside else -1 :]
        else:
            end = _SKIPPED_TEXT[token].search(data, cursor)
            if end is None:
                return
            cursor = end.end()
