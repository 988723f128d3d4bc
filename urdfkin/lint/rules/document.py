"""XML to a light tree of elements with their places, without ever expanding or opening anything.

The parser is expat: it keeps names as the file writes them (`xacro:macro`), gives the exact place of every
start tag, needs no stack for deep nesting and cannot open anything by itself. A document type definition
with content stops it before the first entity could be expanded.
"""

from __future__ import annotations

import re
from xml.parsers import expat

from urdfkin.lint.finding import QUOTED, quoted, shortened
from urdfkin.lint.limits import ORACLE_DEPTH
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import ERROR, REFUSES, WARNING, Rule
from urdfkin.lint.rules.encoding import line_and_column, utf8_bytes
from urdfkin.lint.suppressions import MARK, Comment
from urdfkin.urdf.element import Element

SYNTAX = Rule("URDF105", "xml-syntax", ERROR)
ENTITY = Rule("URDF106", "entity", ERROR)
DOCTYPE = Rule("URDF107", "doctype", WARNING)
TOO_LARGE = Rule("URDF108", "too-large", ERROR)
DEEP_NESTING = Rule("URDF109", "deep-nesting", WARNING)
TOO_DEEP_FOR_ORACLE = Rule("URDF110", "too-deep-for-pinocchio", WARNING, REFUSES)
TOO_MANY_ELEMENTS = Rule("URDF114", "too-many-elements", ERROR)
TOO_DEEP = Rule("URDF115", "too-deep", ERROR)
TOO_MANY_ATTRIBUTES = Rule("URDF116", "too-many-attributes", ERROR)
NAME_TOO_LONG = Rule("URDF117", "name-too-long", ERROR)
INSTRUCTION = Rule("URDF118", "processing-instruction", WARNING, REFUSES)
MARKUP_TOO_LONG = Rule("URDF119", "markup-too-long", ERROR)

#: libxml2 refused deeper nesting for many years, and with it everything built on it.
COMMON_DEPTH = 256
_COMMON = ("older readers built on libxml2 refuse", COMMON_DEPTH)

#: Bytes that the parser is given at once.
_PIECE = 1_000_000

#: Characters of an element's text that are kept: more than a message shows.
_KEPT = 2 * QUOTED

#: Attributes that name links and joints.
_NAMES = frozenset({"name", "link", "joint"})


class _Stop(Exception):  # noqa: N818 - not an error: the parser has been told enough
    """Ends the parse after a finding that makes the rest meaningless."""


def read_document(report: Reporter) -> Element | None:
    """The root element of the reporter's file, or None after the finding that says why there is none."""
    data, most = report.data, report.limits.bytes
    if len(data) > most:
        report.add(
            TOO_LARGE,
            "the file is too large",
            found=f"{len(data)} bytes, more than {most}",
            remedy="raise the limit with --max-bytes if the file is right",
        )
        return None
    text = utf8_bytes(report, data)
    if text is None:
        return None
    report.data = text
    return _parse(report)


def _parse(report: Reporter) -> Element | None:
    builder = _Builder(report)
    try:
        builder.read(report.data)
    except _Stop:
        return None
    except expat.ExpatError as error:
        builder.syntax_error(error)
        return None
    if builder.deepest > COMMON_DEPTH:
        refused = builder.deepest > ORACLE_DEPTH
        reader, most = ("urdfdom refuses", ORACLE_DEPTH) if refused else _COMMON
        report.add(
            TOO_DEEP_FOR_ORACLE if refused else DEEP_NESTING,
            f"elements are nested {builder.deepest} deep",
            builder.deepest_element,
            remedy=f"{reader} more than {most}",
        )
    return builder.root


class _Builder:
    """Handlers that grow the tree and watch the limits."""

    def __init__(self, report: Reporter) -> None:
        self.report, self.limits = report, report.limits
        self.root: Element | None = None
        self.open: list[Element] = []
        self.begun = False
        self.count = self.deepest = 0
        self.deepest_element: Element | None = None
        self.waiting: list[Comment] = []
        self.marked = MARK.encode() in report.data
        self.parser = parser = expat.ParserCreate("utf-8")
        parser.buffer_text = True
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.CharacterDataHandler = self.characters
        parser.StartDoctypeDeclHandler = self.doctype
        parser.CommentHandler = self.comment
        parser.ProcessingInstructionHandler = self.instruction
        parser.SkippedEntityHandler = self.skipped

    def read(self, data: bytes) -> None:
        """Feed the parser piece by piece; what is not complete it reads again with the next piece."""
        whole, size = memoryview(data), min(_PIECE, self.limits.markup)
        for start in range(0, len(whole), size):
            fed = min(start + size, len(whole))
            self.parser.Parse(whole[start:fed], False)
            if fed - max(self.parser.CurrentByteIndex, 0) > self.limits.markup:
                found = f"more than {self.limits.markup} bytes without an end"
                self.refuse(MARKUP_TOO_LONG, "markup", "a tag, comment or instruction is too long", found)
        self.parser.Parse(b"", True)

    def here(self) -> tuple[int, int]:
        """Line and column of what expat is reading."""
        return self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        line, column = self.here()
        parent = self.open[-1] if self.open else None
        element = Element(tag, attributes, parent, line, column, self.parser.CurrentByteIndex)
        if parent is None:
            self.root, self.begun = element, True
            if not self.marked:
                self.parser.CommentHandler = None
        else:
            element.above = None if parent is self.root else parent.holder
            parent.append(element)
        for comment in self.waiting:
            comment.element = element
        self.waiting.clear()
        self.open.append(element)
        self.count += 1
        if len(self.open) > self.deepest:
            self.deepest, self.deepest_element = len(self.open), element
        self.keep_limits(tag, attributes)

    def keep_limits(self, tag: str, attributes: dict[str, str]) -> None:
        most = self.limits
        if self.deepest > most.depth:
            self.refuse(TOO_DEEP, "depth", "elements are nested too deep", f"more than {most.depth} levels")
        if self.count > most.elements:
            self.refuse(TOO_MANY_ELEMENTS, "elements", "too many elements", f"more than {most.elements}")
        if len(attributes) > most.attributes:
            found = f"{len(attributes)} in <{shortened(tag)}>, more than {most.attributes}"
            self.refuse(TOO_MANY_ATTRIBUTES, "attributes", "an element has too many attributes", found)
        if len(tag) > most.name:
            self.refuse_name("an element", tag)
        for key, value in attributes.items():
            if len(key) > most.name:
                self.refuse_name("an attribute", key)
            if len(value) > most.name and key in _NAMES:
                self.refuse_name("a link or joint", value)

    def refuse_name(self, owner: str, name: str) -> None:
        found = f"{quoted(name, 30)} of {len(name)} characters, more than {self.limits.name}"
        self.refuse(NAME_TOO_LONG, "name", f"the name of {owner} is too long", found)

    def refuse(self, code: Rule, limit: str, message: str, found: str) -> None:
        remedy = f"raise the limit with --max-{limit} if the file is right"
        self.report.add(code, message, found=found, remedy=remedy, position=self.here())
        raise _Stop

    def end(self, tag: str) -> None:
        self.waiting.clear()
        element = self.open.pop()
        if element.text:
            element.text = element.text.strip()

    def characters(self, text: str) -> None:
        element = self.open[-1]
        if len(element.text) < _KEPT and not text.isspace():
            element.text += (text if element.text else text.lstrip())[:_KEPT]

    def comment(self, text: str) -> None:
        self.begun = True
        if text.lstrip().startswith(MARK):
            comment = Comment(text, *self.here(), self._is_behind_something())
            self.report.comments.append(comment)
            self.waiting.append(comment)

    def _is_behind_something(self) -> bool:
        """Whether there is more than blanks before what expat is reading, on its line."""
        data, start = self.report.data, self.parser.CurrentByteIndex
        while start > 0 and data[start - 1] in b" \t":
            start -= 1
        return start > 0 and data[start - 1] not in b"\r\n"

    def instruction(self, target: str, text: str) -> None:
        """Judge a processing instruction: urdfdom's parser allows them at the very beginning alone."""
        if self.begun:
            self.report.add(
                INSTRUCTION,
                "a processing instruction stands after the beginning, where urdfdom refuses the file",
                found=quoted(f"<?{target} {text}".strip() + "?>"),
                remedy="remove it, or put it before everything but other instructions",
                position=self.here(),
            )

    def doctype(self, name: str, system: str | None, public: str | None, has_subset: int) -> None:
        """Judge a document type declaration before anything in it can act."""
        self.begun = True
        start = self.report.data.rfind(b"<!DOCTYPE", 0, self.parser.CurrentByteIndex)
        position = line_and_column(self.report.data, start)
        if system is None and public is None and not has_subset:
            self.report.add(
                DOCTYPE,
                "a document type declaration has no use in a URDF",
                found=quoted(f"<!DOCTYPE {name}>"),
                remedy="remove it; it is ignored",
                position=position,
            )
            return
        what = "has content of its own" if has_subset else "refers to an external definition"
        found = quoted(f"<!DOCTYPE {name} [...") if system is None else quoted(system)
        self.report.add(
            ENTITY,
            f"the document type declaration {what}",
            found=found,
            remedy="remove it and write values out; nothing was expanded or opened",
            position=position,
        )
        raise _Stop

    def skipped(self, name: str, is_parameter: int) -> None:
        self.undefined_entity(name)
        raise _Stop

    def undefined_entity(self, name: str | None) -> None:
        self.report.add(
            ENTITY,
            "an entity is used that XML does not define",
            found=quoted(f"&{name};") if name else None,
            remedy="write the character itself, or one of &lt; &gt; &amp; &quot; &apos;",
            position=self.here(),
        )

    def syntax_error(self, error: expat.ExpatError) -> None:
        """Say what expat found in the words of the file."""
        reason = expat.errors.messages[error.code]
        if reason == expat.errors.XML_ERROR_UNDEFINED_ENTITY:
            self.undefined_entity(self._entity_name())
            return
        innermost = self.open[-1] if self.open else None
        message, remedy = _REASONS.get(reason, (reason, None))
        if innermost is not None:
            opened = f"<{innermost.tag}>, opened on line {innermost.line},"
            if reason == expat.errors.XML_ERROR_TAG_MISMATCH:
                remedy = f"close {opened} first"
            elif reason in (expat.errors.XML_ERROR_NO_ELEMENTS, expat.errors.XML_ERROR_UNCLOSED_TOKEN):
                message, remedy = "the file ends too early", f"{opened} is never closed"
        ended = reason == expat.errors.XML_ERROR_NO_ELEMENTS
        self.report.add(
            SYNTAX,
            f"not well-formed XML: {message}",
            found=None if ended else self._around(),
            remedy=remedy,
            position=(error.lineno, error.offset + 1),
        )

    def _entity_name(self) -> str | None:
        """The first entity after the place of an error that XML itself does not define."""
        found = _ENTITY.finditer(self.report.data, self.parser.ErrorByteIndex)
        return next((match[1].decode() for match in found if match[1] not in _PREDEFINED), None)

    def _around(self) -> str | None:
        """The text at the place of an error, up to the end of its line."""
        start = self.parser.ErrorByteIndex
        line = (self.report.data[start : start + 120].splitlines() or [b""])[0]
        text = line.decode("utf-8", "replace")[:30]
        return quoted(text) if text.strip() else None


_ENTITY = re.compile(rb"&([A-Za-z_:\x80-\xff][^;\s<>&\"']{0,60});")
_PREDEFINED = (b"lt", b"gt", b"amp", b"quot", b"apos")

#: expat's reasons that deserve better words, and what to do about them.
_REASONS: dict[str, tuple[str, str | None]] = {
    expat.errors.XML_ERROR_SYNTAX: ("text where an element should begin", "a URDF begins with <robot ...>"),
    expat.errors.XML_ERROR_INVALID_TOKEN: ("a character that XML does not allow here", None),
    expat.errors.XML_ERROR_BAD_CHAR_REF: ("a character that XML does not allow", None),
    expat.errors.XML_ERROR_TAG_MISMATCH: ("a closing tag does not match the element that is open", None),
    expat.errors.XML_ERROR_NO_ELEMENTS: ("there is no element in the file", "a URDF begins with <robot ...>"),
    expat.errors.XML_ERROR_DUPLICATE_ATTRIBUTE: ("an attribute is given twice", "remove one of the two"),
    expat.errors.XML_ERROR_MISPLACED_XML_PI: (
        "the XML declaration is not at the very beginning of the file",
        "remove what stands before <?xml",
    ),
    expat.errors.XML_ERROR_JUNK_AFTER_DOC_ELEMENT: (
        "something follows the closing tag of the root element",
        "a file holds one robot",
    ),
}
