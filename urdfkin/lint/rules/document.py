"""Parse XML to a tree of elements with positions, without expanding entities or opening files.

The parser is expat. It does not change names (`xacro:macro`), reports the position of every start tag, needs
no stack for deep nesting, and opens no file. A document type definition with content stops the parser before
it expands an entity.
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

#: Older versions of libxml2, and the readers built on it, refuse deeper nesting.
COMMON_DEPTH = 256
_COMMON = ("older readers built on libxml2 refuse", COMMON_DEPTH)

#: Bytes per call of the parser.
_PIECE = 1_000_000

#: Characters of an element's text that are stored: more than a message quotes.
_STORED = 2 * QUOTED

#: Attributes with names of links and joints.
_NAMES = frozenset({"name", "link", "joint"})


class _Stop(Exception):  # noqa: N818 - control flow, not an error
    """Stop the parser after a finding that makes the rest of the file meaningless."""


def read_document(report: Reporter) -> Element | None:
    """Return the root element of the reporter's file, or None after a finding with the reason."""
    data, most = report.data, report.limits.bytes
    if len(data) > most:
        report.add(
            TOO_LARGE,
            "the file is too large",
            found=f"{len(data)} bytes, more than {most}",
            remedy="if the file is correct, raise the limit with --max-bytes",
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
    """The handlers of the parser, which build the tree and check the limits."""

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
        """Feed the parser in pieces. expat reads incomplete markup again with the next piece."""
        whole, size = memoryview(data), min(_PIECE, self.limits.markup)
        for start in range(0, len(whole), size):
            fed = min(start + size, len(whole))
            self.parser.Parse(whole[start:fed], False)
            if fed - max(self.parser.CurrentByteIndex, 0) > self.limits.markup:
                found = f"more than {self.limits.markup} bytes without an end"
                self.refuse(MARKUP_TOO_LONG, "markup", "a tag, comment or instruction is too long", found)
        self.parser.Parse(b"", True)

    def here(self) -> tuple[int, int]:
        """Return the line and the column of the parser's position."""
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
        self.check_limits(tag, attributes)

    def check_limits(self, tag: str, attributes: dict[str, str]) -> None:
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
        remedy = f"if the file is correct, raise the limit with --max-{limit}"
        self.report.add(code, message, found=found, remedy=remedy, position=self.here())
        raise _Stop

    def end(self, tag: str) -> None:
        self.waiting.clear()
        element = self.open.pop()
        if element.text:
            element.text = element.text.strip()

    def characters(self, text: str) -> None:
        element = self.open[-1]
        if len(element.text) < _STORED and not text.isspace():
            element.text += (text if element.text else text.lstrip())[:_STORED]

    def comment(self, text: str) -> None:
        self.begun = True
        if text.lstrip().startswith(MARK):
            comment = Comment(text, *self.here(), self._is_behind_something())
            self.report.comments.append(comment)
            self.waiting.append(comment)

    def _is_behind_something(self) -> bool:
        """Return whether the line has other text before the parser's position."""
        data, start = self.report.data, self.parser.CurrentByteIndex
        while start > 0 and data[start - 1] in b" \t":
            start -= 1
        return start > 0 and data[start - 1] not in b"\r\n"

    def instruction(self, target: str, text: str) -> None:
        """Report a processing instruction that is not at the beginning, where urdfdom allows it."""
        if self.begun:
            self.report.add(
                INSTRUCTION,
                "a processing instruction is not at the beginning of the file; urdfdom refuses the file",
                found=quoted(f"<?{target} {text}".strip() + "?>"),
                remedy="remove it, or move it to the beginning; only other instructions may precede it",
                position=self.here(),
            )

    def doctype(self, name: str, system: str | None, public: str | None, has_subset: int) -> None:
        """Report a document type declaration, and stop before its content has an effect."""
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
        what = "contains definitions" if has_subset else "refers to an external definition"
        found = quoted(f"<!DOCTYPE {name} [...") if system is None else quoted(system)
        self.report.add(
            ENTITY,
            f"the document type declaration {what}",
            found=found,
            remedy="remove it and write the values directly; nothing was expanded or opened",
            position=position,
        )
        raise _Stop

    def skipped(self, name: str, is_parameter: int) -> None:
        self.undefined_entity(name)
        raise _Stop

    def undefined_entity(self, name: str | None) -> None:
        self.report.add(
            ENTITY,
            "the file uses an entity that XML does not define",
            found=quoted(f"&{name};") if name else None,
            remedy="write the character itself, or one of &lt; &gt; &amp; &quot; &apos;",
            position=self.here(),
        )

    def syntax_error(self, error: expat.ExpatError) -> None:
        """Report a syntax error with its position and the text there."""
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
                message, remedy = "the file ends too early", f"close {opened}"
        ended = reason == expat.errors.XML_ERROR_NO_ELEMENTS
        self.report.add(
            SYNTAX,
            f"not well-formed XML: {message}",
            found=None if ended else self._around(),
            remedy=remedy,
            position=(error.lineno, error.offset + 1),
        )

    def _entity_name(self) -> str | None:
        """Return the first entity after the position of an error that XML itself does not define."""
        found = _ENTITY.finditer(self.report.data, self.parser.ErrorByteIndex)
        return next((match[1].decode() for match in found if match[1] not in _PREDEFINED), None)

    def _around(self) -> str | None:
        """Return the text at the position of an error, up to the end of its line."""
        start = self.parser.ErrorByteIndex
        line = (self.report.data[start : start + 120].splitlines() or [b""])[0]
        text = line.decode("utf-8", "replace")[:30]
        return quoted(text) if text.strip() else None


_ENTITY = re.compile(rb"&([A-Za-z_:\x80-\xff][^;\s<>&\"']{0,60});")
_PREDEFINED = (b"lt", b"gt", b"amp", b"quot", b"apos")

#: expat's message -> a clearer message and a remedy.
_REASONS: dict[str, tuple[str, str | None]] = {
    expat.errors.XML_ERROR_SYNTAX: ("text instead of an element", "a URDF begins with <robot ...>"),
    expat.errors.XML_ERROR_INVALID_TOKEN: ("a character that XML does not allow here", None),
    expat.errors.XML_ERROR_BAD_CHAR_REF: ("a character that XML does not allow", None),
    expat.errors.XML_ERROR_TAG_MISMATCH: ("a closing tag does not match the open element", None),
    expat.errors.XML_ERROR_NO_ELEMENTS: ("the file has no element", "a URDF begins with <robot ...>"),
    expat.errors.XML_ERROR_DUPLICATE_ATTRIBUTE: ("an attribute is given twice", "remove one of the two"),
    expat.errors.XML_ERROR_MISPLACED_XML_PI: (
        "the XML declaration is not at the very beginning of the file",
        "remove the text before <?xml",
    ),
    expat.errors.XML_ERROR_JUNK_AFTER_DOC_ELEMENT: (
        "there is content after the closing tag of the root element",
        "a file contains one robot",
    ),
}
