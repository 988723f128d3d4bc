"""Parse a URDF: first the bytes into XML elements, then the elements into records of links and joints.

The XML parser is expat. expat reports the position of every start tag, and parses deep nesting without
recursion. expat keeps namespace prefixes, and opens no file. If a document type declaration has brackets or
refers to an external file, parsing stops with an error. Therefore, only the entities of XML itself are
expanded, for example `&amp;`.

A number is a finite decimal number in ASCII, as in urdfdom. The parser repairs nothing; every problem is a
finding.
"""

from __future__ import annotations

import codecs
import difflib
import html
import math
import re
from dataclasses import dataclass
from functools import lru_cache
from xml.parsers import expat

from urdfkin.errors.numbers import DECIMAL
from urdfkin.system.files import Edit
from urdfkin.urdf.findings import (
    COMMENT_MARK,
    ERROR,
    MAX_QUOTE_LENGTH,
    NEWLINE,
    NOTE,
    REFUSES,
    WARNING,
    Comment,
    Fix,
    Reporter,
    Rule,
    Severity,
    quote,
    shorten,
    start_of_blanks,
)
from urdfkin.urdf.records import (
    FURTHER_LIMITS,
    ORACLE_DEPTH,
    Element,
    JointRecord,
    LimitRecord,
    MimicRecord,
    RobotRecord,
)

# -- bytes

EMPTY_FILE = Rule("URDF101", "empty-file", ERROR)
NOT_UTF8 = Rule("URDF102", "not-utf8", ERROR)
DECLARED_ENCODING = Rule("URDF103", "declared-encoding", ERROR)
UNUSED_DECLARED_ENCODING = Rule("URDF104", "declared-encoding-unused", WARNING)
XML_VERSION = Rule("URDF111", "xml-version", WARNING)
BYTE_ORDER_MARK = Rule("URDF113", "byte-order-mark", NOTE)

#: First bytes of XML files in UTF-32 and UTF-16. UTF-32 comes first, because its byte order mark begins with
#: the byte order mark of UTF-16.
_WIDE_ENCODINGS = {
    "UTF-32": (codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE, b"<\0\0\0", b"\0\0\0<"),
    "UTF-16": (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE, b"<\0", b"\0<"),
}

_DECLARATION = re.compile(rb"""<\?xml(?=\s)[^>]*?\?>""")
_ENCODING = re.compile(rb"""\sencoding\s*=\s*["']([^"']*)["']""")
_XML_VERSION = re.compile(rb"""\sversion\s*=\s*["']([^"']*)["']""")

#: Names of encodings in which ASCII characters have the same bytes as in UTF-8.
_ASCII_SUPERSETS = re.compile(r"(iso8859|windows125|cp125|latin|koi8|mac)")


def read_utf8(report: Reporter, data: bytes) -> bytes | None:
    """Return the UTF-8 bytes without a byte order mark; None after an error."""
    if not data.strip():
        what = "the file is empty" if not data else "the file contains only white space"
        report.add(EMPTY_FILE, what, remedy="check the program that wrote the file")
        return None
    wide = next((encoding for encoding, begins in _WIDE_ENCODINGS.items() if data.startswith(begins)), None)
    if wide is not None:
        report.add(NOT_UTF8, "the file is not UTF-8 text", found=wide, remedy="save the file as UTF-8")
        return None
    text = data.removeprefix(codecs.BOM_UTF8)
    declared = _declared_encoding(text)
    if not (_check_utf8(report, text, declared) and _check_declaration(report, text, declared)):
        return None
    if len(text) < len(data):
        what = "the text begins with a byte order mark"
        report.add(BYTE_ORDER_MARK, what, remedy="remove the byte order mark if you can")
    return text


def _declared_encoding(text: bytes) -> str | None:
    declaration = _DECLARATION.match(text.lstrip())
    match = _ENCODING.search(declaration[0]) if declaration else None
    return match[1].decode("ascii", "replace") if match else None


def _check_utf8(report: Reporter, text: bytes, declared: str | None) -> bool:
    zero = text.find(b"\0")
    if zero >= 0:
        message = "the text contains a zero byte: some readers stop there, others continue"
        remedy = "check the file: it is not a text file, or it is damaged"
        if text.startswith(b"PXR-USDC"):
            message, remedy = _USD_ERROR
        report.add(NOT_UTF8, message, remedy=remedy, position=line_and_column(text, zero))
        return False
    try:
        text.decode("utf-8")
    except UnicodeDecodeError as error:
        claim = f", and the file declares {declared}" if declared else ""
        message = f"a byte is not UTF-8{claim}"
        remedy = "save the file as UTF-8"
        found = f"0x{text[error.start]:02x}"
        report.add(NOT_UTF8, message, found=found, remedy=remedy, position=line_and_column(text, error.start))
        return False
    return True


def _check_declaration(report: Reporter, text: bytes, declared: str | None) -> bool:
    """Return whether the XML declaration is compatible with UTF-8."""
    declaration = _DECLARATION.match(text)
    version = _XML_VERSION.search(declaration[0]) if declaration else None
    if version is not None and version[1] != b"1.0":
        found = quote(version[1].decode())
        report.add(XML_VERSION, "the XML version is not 1.0", found=found, remedy='write version="1.0"')
    codec = None if declared is None else _find_codec(declared)
    if declared is None or codec == "utf-8" or (codec == "ascii" and text.isascii()):
        return True
    if text.isascii() and _ASCII_SUPERSETS.match(codec or ""):
        message = "the declared encoding is not UTF-8, but every character is ASCII"
        match = _ENCODING.search(text)
        fix = None if match is None else Fix((Edit(*match.span(1), "UTF-8"),))
        remedy, found = 'write encoding="UTF-8"', quote(declared)
        report.add(UNUSED_DECLARED_ENCODING, message, found=found, remedy=remedy, fix=lambda: fix)
        return True
    remedy = 'save the file as UTF-8 and write encoding="UTF-8"'
    report.add(DECLARED_ENCODING, "the declared encoding is not UTF-8", found=quote(declared), remedy=remedy)
    return False


def _find_codec(name: str) -> str | None:
    """Return Python's name of an encoding in lower case, without hyphens except in `utf-8`."""
    try:
        return codecs.lookup(name).name.lower().replace("-", "").replace("utf8", "utf-8")
    except LookupError:
        return None


def line_and_column(data: bytes, offset: int) -> tuple[int, int]:
    """Return the line and the column (in characters) of a byte; both start at 1."""
    lines = NEWLINE.split(data[: max(offset, 0)])
    return len(lines), len(lines[-1].decode("utf-8", "replace")) + 1


# -- XML elements

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

#: Maximum depth of nested elements in older versions of libxml2.
LIBXML2_DEPTH = 256

#: Maximum number of bytes that expat parses in one call.
_CHUNK_SIZE = 1_000_000

#: Number of stored characters after which the rest of an element's text is ignored.
_MAX_STORED_TEXT = 2 * MAX_QUOTE_LENGTH

#: Attributes that name a link or joint.
_NAME_ATTRIBUTES = frozenset({"name", "link", "joint"})


class _StopError(Exception):
    """An error after which the parser does not interpret the rest of the file."""


def read_document(report: Reporter) -> Element | None:
    """Parse the file of `report` and return its root element; None after an error.

    If the file is UTF-8, `report.data` becomes the text without a byte order mark.
    """
    data, max_bytes = report.data, report.limits.bytes
    if len(data) > max_bytes:
        message = "the file is too large"
        remedy = "if the file is correct, raise the limit with --max-bytes"
        report.add(TOO_LARGE, message, found=f"{len(data)} bytes, more than {max_bytes}", remedy=remedy)
        return None
    text = read_utf8(report, data)
    if text is None:
        return None
    report.data = text
    builder = _Builder(report)
    try:
        builder.read(text)
    except _StopError:
        return None
    except expat.ExpatError as error:
        builder.report_syntax_error(error)
        return None
    if builder.max_depth > LIBXML2_DEPTH:
        rule, reader, max_depth = DEEP_NESTING, "older readers built on libxml2 refuse", LIBXML2_DEPTH
        if builder.max_depth > ORACLE_DEPTH:
            rule, reader, max_depth = TOO_DEEP_FOR_ORACLE, "urdfdom refuses", ORACLE_DEPTH
        what = f"elements are nested {builder.max_depth} deep"
        report.add(
            rule,
            what,
            builder.deepest_element,
            remedy=f"remove the nesting: {reader} more than {max_depth} levels",
        )
    return builder.root


class _Builder:
    """Build the tree of elements from the events of expat, and check the limits."""

    def __init__(self, report: Reporter) -> None:
        self.report, self.limits = report, report.limits
        self.root: Element | None = None
        self.open: list[Element] = []
        self.has_content = False
        self.count = self.max_depth = 0
        self.deepest_element: Element | None = None
        self.pending_comments: list[Comment] = []
        self.has_ignore_comment = COMMENT_MARK.encode() in report.data
        self.parser = parser = expat.ParserCreate("utf-8")
        parser.buffer_text = True
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.CharacterDataHandler = self.characters
        parser.StartDoctypeDeclHandler = self.doctype
        parser.CommentHandler = self.comment
        parser.ProcessingInstructionHandler = self.instruction
        parser.SkippedEntityHandler = self.handle_skipped_entity

    def read(self, data: bytes) -> None:
        whole, size = memoryview(data), min(_CHUNK_SIZE, self.limits.markup)
        for start in range(0, len(whole), size):
            fed = min(start + size, len(whole))
            self.parser.Parse(whole[start:fed], False)
            # If a tag or comment is incomplete, `CurrentByteIndex` is the position of its first byte.
            if fed - max(self.parser.CurrentByteIndex, 0) > self.limits.markup:
                found = f"more than {self.limits.markup} bytes without an end"
                self.refuse(MARKUP_TOO_LONG, "markup", "a tag, comment or instruction is too long", found)
        self.parser.Parse(b"", True)

    def position(self) -> tuple[int, int]:
        return self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        parent = self.open[-1] if self.open else None
        element = Element(tag, attributes, parent, *self.position(), self.parser.CurrentByteIndex)
        if parent is None:
            self.root, self.has_content = element, True
            if not self.has_ignore_comment:
                self.parser.CommentHandler = None
        else:
            element.top_level_ancestor = None if parent is self.root else parent.top_level_element
            parent.append(element)
        for comment in self.pending_comments:
            comment.element = element
        self.pending_comments.clear()
        self.open.append(element)
        self.count += 1
        if len(self.open) > self.max_depth:
            self.max_depth, self.deepest_element = len(self.open), element
        self.check_limits(tag, attributes)

    def check_limits(self, tag: str, attributes: dict[str, str]) -> None:
        size_limits = self.limits
        if self.max_depth > size_limits.depth:
            self.refuse(
                TOO_DEEP, "depth", "elements are nested too deep", f"more than {size_limits.depth} levels"
            )
        if self.count > size_limits.elements:
            self.refuse(
                TOO_MANY_ELEMENTS, "elements", "too many elements", f"more than {size_limits.elements}"
            )
        if len(attributes) > size_limits.attributes:
            found = f"{len(attributes)} in <{shorten(tag)}>, more than {size_limits.attributes}"
            self.refuse(TOO_MANY_ATTRIBUTES, "attributes", "an element has too many attributes", found)
        if len(tag) > size_limits.name:
            self.refuse_name("the tag of an element", tag)
        for key, value in attributes.items():
            if len(key) > size_limits.name:
                self.refuse_name("the name of an attribute", key)
            if len(value) > size_limits.name and key in _NAME_ATTRIBUTES:
                self.refuse_name(f"the {key} of <{shorten(tag)}>", value)

    def refuse_name(self, what: str, name: str) -> None:
        found = f"{quote(name, 30)} of {len(name)} characters, more than {self.limits.name}"
        self.refuse(NAME_TOO_LONG, "name", f"{what} is too long", found)

    def refuse(self, code: Rule, limit: str, message: str, found: str) -> None:
        remedy = f"if the file is correct, raise the limit with --max-{limit}"
        self.report.add(code, message, found=found, remedy=remedy, position=self.position())
        raise _StopError

    def end(self, tag: str) -> None:
        self.pending_comments.clear()
        element = self.open.pop()
        if element.text:
            element.text = element.text.strip()

    def characters(self, text: str) -> None:
        element = self.open[-1]
        if len(element.text) < _MAX_STORED_TEXT and not text.isspace():
            element.text += (text if element.text else text.lstrip())[:_MAX_STORED_TEXT]

    def comment(self, text: str) -> None:
        self.has_content = True
        if text.lstrip().startswith(COMMENT_MARK):
            start = start_of_blanks(self.report.data, self.parser.CurrentByteIndex, b" \t")
            follows_text = start > 0 and self.report.data[start - 1] not in b"\r\n"
            comment = Comment(text, *self.position(), follows_text)
            self.report.comments.append(comment)
            self.pending_comments.append(comment)

    def instruction(self, target: str, text: str) -> None:
        if self.has_content:
            message = "a processing instruction is not at the beginning of the file; urdfdom refuses the file"
            remedy = "remove the instruction, or move it before every element, comment and document type"
            found = quote(f"<?{target} {text}".strip() + "?>")
            self.report.add(INSTRUCTION, message, found=found, remedy=remedy, position=self.position())

    def doctype(self, name: str, system: str | None, public: str | None, has_subset: int) -> None:
        self.has_content = True
        start = self.report.data.rfind(b"<!DOCTYPE", 0, self.parser.CurrentByteIndex)
        position = line_and_column(self.report.data, start)
        if system is None and public is None and not has_subset:
            message = "a document type declaration has no use in a URDF"
            remedy, found = "remove the declaration, which is ignored", quote(f"<!DOCTYPE {name}>")
            self.report.add(DOCTYPE, message, found=found, remedy=remedy, position=position)
            return
        what = "refers to an external definition"
        if has_subset:
            what = "has brackets [ ], which can define entities"
        found = quote(f"<!DOCTYPE {name} [...") if system is None else quote(system)
        message = f"the document type declaration {what}"
        remedy = "remove the declaration and write the values directly; nothing was expanded or opened"
        self.report.add(ENTITY, message, found=found, remedy=remedy, position=position)
        raise _StopError

    def handle_skipped_entity(self, name: str, is_parameter: int) -> None:
        self.report_undefined_entity(name)
        raise _StopError

    def report_undefined_entity(self, name: str | None) -> None:
        message = "the file uses an entity that XML does not define"
        remedy = "write the character itself, or one of &lt; &gt; &amp; &quot; &apos;"
        found = quote(f"&{name};") if name else None
        self.report.add(ENTITY, message, found=found, remedy=remedy, position=self.position())

    def report_syntax_error(self, error: expat.ExpatError) -> None:
        reason = expat.errors.messages[error.code]
        if reason == expat.errors.XML_ERROR_UNDEFINED_ENTITY:
            self.report_undefined_entity(self._entity_name())
            return
        innermost = self.open[-1] if self.open else None
        message, remedy = _TEXTS_BY_EXPAT_ERROR.get(reason, (reason, None))
        if innermost is not None:
            opened = f"<{innermost.tag}>, opened on line {innermost.line},"
            if reason == expat.errors.XML_ERROR_TAG_MISMATCH:
                remedy = f"close {opened} first"
            elif reason in (expat.errors.XML_ERROR_NO_ELEMENTS, expat.errors.XML_ERROR_UNCLOSED_TOKEN):
                message, remedy = "the file ends too early", f"close {opened}"
        if self.report.data.startswith(b"#usda"):
            message, remedy = _USD_ERROR
        found = None if reason == expat.errors.XML_ERROR_NO_ELEMENTS else self._text_at_error()
        message, position = f"not well-formed XML: {message}", (error.lineno, error.offset + 1)
        self.report.add(SYNTAX, message, found=found, remedy=remedy, position=position)

    def _entity_name(self) -> str | None:
        found = _ENTITY.finditer(self.report.data, self.parser.ErrorByteIndex)
        return next((match[1].decode() for match in found if match[1] not in _PREDEFINED), None)

    def _text_at_error(self) -> str | None:
        start = self.parser.ErrorByteIndex
        line = (self.report.data[start : start + 120].splitlines() or [b""])[0]
        text = line.decode("utf-8", "replace")[:30]
        return quote(text) if text.strip() else None


_ENTITY = re.compile(rb"&([A-Za-z_:\x80-\xff][^;\s<>&\"']{0,60});")
_USD_ERROR = "this is USD, not XML", "give the path of a file with a suffix such as .usda"
_PREDEFINED = (b"lt", b"gt", b"amp", b"quot", b"apos")

_TEXTS_BY_EXPAT_ERROR: dict[str, tuple[str, str | None]] = {
    expat.errors.XML_ERROR_SYNTAX: ("text instead of an element", "a URDF begins with <robot ...>"),
    expat.errors.XML_ERROR_INVALID_TOKEN: ("a character that XML does not allow here", None),
    expat.errors.XML_ERROR_BAD_CHAR_REF: ("a character that XML does not allow", None),
    expat.errors.XML_ERROR_TAG_MISMATCH: ("a closing tag does not match the open element", None),
    expat.errors.XML_ERROR_NO_ELEMENTS: ("the file has no element", "a URDF begins with <robot ...>"),
    expat.errors.XML_ERROR_DUPLICATE_ATTRIBUTE: (
        "an attribute occurs twice",
        "remove one of these attributes",
    ),
    expat.errors.XML_ERROR_MISPLACED_XML_PI: (
        "the XML declaration is not at the very beginning of the file",
        "remove the text before <?xml",
    ),
    expat.errors.XML_ERROR_JUNK_AFTER_DOC_ELEMENT: (
        "there is content after the closing tag of the root element",
        "write only one robot into a file",
    ),
}


# -- numbers in attributes

BAD_NUMBER = Rule("URDF301", "bad-number", ERROR)
BAD_VECTOR = Rule("URDF302", "bad-vector", ERROR)
WHITESPACE_IN_NUMBER = Rule("URDF303", "whitespace-in-number", WARNING, REFUSES)
UNDERFLOW = Rule("URDF304", "underflow", WARNING)
NUMBER_TOO_LONG = Rule("URDF305", "number-too-long", ERROR)

_BLANKS = re.compile(r"[ \t\r\n]+")


@dataclass(slots=True)
class NumberReader:
    """Read numbers from attributes, and report mistakes.

    `effect` is appended to the messages of both rules.
    """

    report: Reporter
    bad_number: Rule = BAD_NUMBER
    bad_vector: Rule = BAD_VECTOR  # For a wrong count of numbers.
    effect: str = ""

    def read_scalar(self, element: Element, attribute: str, default: float | None = None) -> float | None:
        """Return a number; `default` if the attribute is missing, None if the number is invalid."""
        written = element.attributes.get(attribute)
        if written is None:
            return default
        if self._is_too_long(element, attribute, written, self.report.limits.number):
            return None
        value = self._read_number(element, attribute, _BLANKS.sub(" ", written).strip(" "))
        if value is not None and written != written.rstrip():
            self._report_refused_by_urdfdom(element, attribute, "a space after the number")
        elif value is not None and self.report.has_replaced_characters:
            self._check_raw(element, attribute, 1)
        return value

    def read_vector(self, element: Element, attribute: str, count: int = 3) -> tuple[float, ...] | None:
        """Return `count` numbers; None if the attribute is missing or invalid."""
        written = element.attributes.get(attribute)
        if written is None:
            return None
        longest = self.report.limits.number
        if self._is_too_long(element, attribute, written, count * longest):
            return None
        pieces = [piece for piece in _BLANKS.split(written) if piece]
        if any(self._is_too_long(element, attribute, piece, longest) for piece in pieces):
            return None
        values: list[float] = []
        for piece in pieces:
            value = self._read_number(element, attribute, piece)
            if value is None:
                return None
            values.append(value)
        if len(values) != count:
            message = f"{attribute} needs {count} numbers, but has {len(values)}{self.effect}"
            remedy, found = f"write {count} numbers separated by spaces", f"{attribute}={quote(written)}"
            self.report.add(
                self.bad_vector, message, element, attribute=attribute, found=found, remedy=remedy
            )
            return None
        if self.report.has_replaced_characters:
            self._check_raw(element, attribute, count)
        return tuple(values)

    def _read_number(self, element: Element, attribute: str, piece: str) -> float | None:
        value = float(piece) if DECIMAL.fullmatch(piece) else None
        if value is not None and math.isfinite(value):
            if value == 0.0 and re.search("[1-9]", re.split("[eE]", piece)[0]):
                message = f"{attribute} contains a number too small for a double, which is read as zero"
                remedy, found = "check the exponent", quote(piece)
                self.report.add(UNDERFLOW, message, element, attribute=attribute, found=found, remedy=remedy)
            return value
        what = attribute if element.tag in _TAGS_OMITTED_IN_MESSAGES else f"{attribute} of <{element.tag}>"
        part = "" if piece == element.attributes[attribute] else "a part of "
        message, remedy = f"{part}{what} is not a number{self.effect}", _remedy(piece)
        if value is not None:
            message, remedy = f"{part}{what} is too large for a double{self.effect}", "check the exponent"
        found = quote(piece)
        self.report.add(self.bad_number, message, element, attribute=attribute, found=found, remedy=remedy)
        return None

    def _is_too_long(self, element: Element, attribute: str, written: str, max_length: int) -> bool:
        """Report a number that is too long, because the conversion of a long text takes quadratic time."""
        if len(written) <= max_length:
            return False
        found = f"{quote(written, 30)} of {len(written)} characters, more than {max_length}"
        remedy = "write 17 digits, enough for every double, or raise the limit with --max-number"
        self.report.add(
            NUMBER_TOO_LONG, f"{attribute} is too long for a number", element,
            attribute=attribute, found=found, remedy=remedy, severity=self.bad_number.severity,
        )  # fmt: skip
        return True

    def _check_raw(self, element: Element, attribute: str, count: int) -> None:
        """Report tabs and line ends between or after numbers, because urdfdom refuses these characters.

        The raw text is read, because expat replaces tabs and line ends.
        """
        raw_value = self.report.raw_value(element, attribute)
        if raw_value is None or self._is_too_long(
            element, attribute, raw_value, count * self.report.limits.number
        ):
            return
        seen = html.unescape(_LEADING_ZEROS_OF_REFERENCE.sub(r"\1", raw_value))
        pieces = [seen] if count == 1 else [piece for piece in seen.split(" ") if piece]
        if not all(DECIMAL.fullmatch(piece.lstrip("\t\r\n ")) for piece in pieces):
            self._report_refused_by_urdfdom(
                element, attribute, "a tab or line end between or after the numbers"
            )

    def _report_refused_by_urdfdom(self, element: Element, attribute: str, what: str) -> None:
        value = element.attributes[attribute]
        rule, message = WHITESPACE_IN_NUMBER, f"{attribute} has {what}, which urdfdom refuses"
        if self.bad_number is not BAD_NUMBER:  # Kinematics does not use the number.
            rule, message = self.bad_number, f"{attribute} has {what}, which urdfdom does not read"
        self.report.add(
            rule,
            message,
            element,
            attribute=attribute,
            found=quote(self.report.raw_value(element, attribute) or value),
            remedy="write one space between numbers, and no space before or after the numbers",
            fix=lambda: self.report.make_value_fix(element, attribute, " ".join(value.split())),
        )


#: Tags that messages about invalid numbers omit.
_TAGS_OMITTED_IN_MESSAGES = ("origin", "axis", "limit")

#: Leading zeros of a character reference. The zeros are removed, because `html.unescape` fails for thousands
#: of zeros.
_LEADING_ZEROS_OF_REFERENCE = re.compile(r"(&#[xX]?)0+")

#: Patterns of invalid numbers, with remedies. The first matching pattern determines the remedy.
_REMEDIES = (
    (r"[+-]?(nan|inf|infinity)", "write a finite number"),
    (r".*\$[({].*", "expand the xacro first"),
    (r".*,.*", "separate numbers by spaces, and write decimals with a point"),
    (r"[+-]?0x.*", "write decimal digits"),
    (r"[+-]?[0-9.]+d[+-]?[0-9]+", "write the exponent with e"),
    (r".*[^\x00-\x7f].*", "write ASCII digits"),
    (r".*_.*", "write the digits without underscores"),
    (r"[\[({].*|.*[\])}]", "write the numbers without brackets"),
    (r"[+-]?[0-9.]+e[+-]?", "write digits after the e"),
    (r"[+-]?[0-9.]+[a-z]+", "write the number without a unit"),
    (r"", "the attribute is empty; write a number, or remove an optional attribute"),
)


def _remedy(piece: str) -> str:
    found = (text for pattern, text in _REMEDIES if re.fullmatch(pattern, piece, re.IGNORECASE | re.DOTALL))
    return next(found, "write a number such as -1.5 or 2e-3")


# -- links and joints

NOT_URDF = Rule("URDF201", "not-a-urdf", ERROR)
VERSION = Rule("URDF203", "urdf-version", ERROR)
NEWER_VERSION = Rule("URDF204", "newer-urdf-version", WARNING)
MISSING_ELEMENT = Rule("URDF210", "missing-element", ERROR)
MISSING_ATTRIBUTE = Rule("URDF211", "missing-attribute", ERROR)
MISSING_NAME = Rule("URDF401", "missing-name", ERROR)
DUPLICATE_NAME = Rule("URDF402", "duplicate-name", ERROR)
UNKNOWN_TYPE = Rule("URDF501", "unknown-joint-type", ERROR)
EMPTY_AXIS = Rule("URDF504", "axis-without-xyz", ERROR)
MISSING_LIMIT = Rule("URDF506", "missing-limit", ERROR)
IGNORED_VALUE = Rule("URDF510", "ignored-value", WARNING)
QUATERNION_IGNORED = Rule("URDF511", "quat-xyzw-ignored", WARNING)
QUAT_XYZW = Rule("URDF512", "quat-xyzw", WARNING)
BAD_QUATERNION = Rule("URDF513", "bad-quaternion", ERROR)

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "planar", "floating")

#: Newest URDF version that urdfdom 6 supports.
NEWEST_VERSION = (1, 2)
_VERSION = re.compile(r"\s*\+?([0-9]+)\.\+?([0-9]+)")

#: The square of a length between these limits neither underflows nor overflows.
MIN_VECTOR_LENGTH, MAX_VECTOR_LENGTH = 1e-150, 1e150


def read_robot(report: Reporter, root: Element) -> RobotRecord | None:
    if root.tag != "robot":
        _report_other_format(report, root)
        return None
    version = _read_version(report, root)
    robot = RobotRecord(root, version)
    for element in root.find_all("link"):
        name = read_name(report, element)
        if name and name in robot.links:
            report_duplicate(report, element, robot.links[name])
        elif name:
            robot.links[name] = element
    reader = JointReader(report, version)
    seen: dict[str, Element] = {}
    for element in root.find_all("joint"):
        joint = reader.read(element)
        if joint.name and joint.name in seen:
            report_duplicate(report, element, seen[joint.name])
        seen.setdefault(joint.name, element)
        robot.joints.append(joint)
    return robot


_REMEDY_BY_ROOT_TAG = {
    "sdf": "this is an SDF file; convert the file to a URDF first",
    "mujoco": "this is an MJCF file; `load` and the commands read MJCF files with the suffix .xml or .mjcf",
    "mujocoinclude": "this is a part of an MJCF file; load the file that includes it",
    "model": "this is a part of an SDF file; convert the file to a URDF first",
    "world": "this is a part of an SDF file; convert the file to a URDF first",
    "collada": "this is a COLLADA file",
    "html": "this is a web page, not a URDF",
    "launch": "this is a launch file; name the URDF that the launch file loads",
    "package": "this is a package manifest; the URDF is another file",
    "drake": "this is a Drake file; convert the file to a URDF first",
}


def _report_other_format(report: Reporter, root: Element) -> None:
    prefix, _, local = root.tag.rpartition(":")
    if local == "robot" and prefix:
        remedy = f"write <robot> without the prefix {prefix!r}"
    elif local.lower() == "robot":
        remedy = "write <robot> in lower case"
    else:
        remedy = _REMEDY_BY_ROOT_TAG.get(local.lower(), "a URDF begins with <robot name=...>")
    report.add(NOT_URDF, "the root element is not <robot>", root, found=f"<{root.tag}>", remedy=remedy)


def _read_version(report: Reporter, root: Element) -> tuple[int, int]:
    written = root.attributes.get("version")
    if written is None:
        return (1, 0)
    match = _VERSION.fullmatch(written)
    version = (int(match[1]), int(match[2])) if match and len(written) < 20 else None
    rule, remedy = VERSION, 'write version="1.0" if the file follows URDF 1.0, or remove the attribute'
    if version is None:
        message = "a URDF version has the form 1.0"
    elif version > NEWEST_VERSION:
        message = "the URDF version is later than 1.2, the last version that urdfdom and Pinocchio read"
        remedy = "write the version that the file follows, 1.0 to 1.2"
    elif version < (1, 0):
        message = "this URDF version does not exist"
    elif version == (1, 0):
        return version
    else:
        rule, message = NEWER_VERSION, "most readers support only URDF 1.0"
        remedy = "remove the attribute if the file uses only features of URDF 1.0"
    report.add(rule, message, root, attribute="version", found=quote(written), remedy=remedy)
    return version if version is not None and rule is NEWER_VERSION else (1, 0)


def read_name(report: Reporter, element: Element) -> str:
    """Return the name of a link or joint; report a missing name and return an empty string."""
    name = element.attributes.get("name")
    if not name:
        what = "has no name" if name is None else "has an empty name"
        remedy = f'write <{element.tag} name="...">'
        report.add(MISSING_NAME, f"a {element.tag} {what}", element, attribute="name", remedy=remedy)
    return name or ""


def report_duplicate(report: Reporter, element: Element, first: Element) -> None:
    message = f"another {element.tag} has this name"
    remedy = f"the first is on line {first.line}; rename one {element.tag}"
    report.add(DUPLICATE_NAME, message, element, attribute="name", remedy=remedy)


class JointReader:
    def __init__(self, report: Reporter, version: tuple[int, int]) -> None:
        self.report, self.version = report, version
        self.numbers = NumberReader(report)

    def read(self, element: Element) -> JointRecord:
        joint = JointRecord(element, read_name(self.report, element))
        joint.kind = self._read_kind(element)
        joint.parent, joint.child = self._read_end(element, "parent"), self._read_end(element, "child")
        self._read_origin(joint)
        self._read_axis(joint)
        self._read_limit(joint)
        self._read_mimic(joint)
        self._check_nonkinematic_elements(joint)
        return joint

    def read_required(
        self, element: Element, attribute: str, example: str, *, number: bool = False
    ) -> str | None:
        """Return a required attribute; report a missing or empty attribute and return None.

        If `number` is True, an empty attribute is not reported, because `NumberReader` reports it.
        """
        value = element.attributes.get(attribute)
        if value is None or not (value or number):
            empty = "" if value is None else ", which is empty"
            message = f"<{element.tag}> needs the attribute {attribute}{empty}"
            found, remedy = quote(element.text) if element.text else None, f"write {example}"
            self.report.add(
                MISSING_ATTRIBUTE, message, element, attribute=attribute, found=found, remedy=remedy
            )
        return value or None

    def _read_kind(self, element: Element) -> str | None:
        written = self.read_required(element, "type", '<joint name="..." type="revolute">')
        if written is None or written in JOINT_TYPES:
            return written
        close = nearest_tag(written, frozenset(JOINT_TYPES))
        message = "unknown joint type"
        remedy = f"did you mean {close}?" if close else f"the types are {', '.join(JOINT_TYPES)}"
        found = quote(written)
        self.report.add(UNKNOWN_TYPE, message, element, attribute="type", found=found, remedy=remedy)
        return None

    def _read_end(self, element: Element, tag: str) -> str | None:
        example = f'<{tag} link="..."/>'
        if (end := element.find(tag)) is None:
            self.report.add(MISSING_ELEMENT, f"the joint has no <{tag}>", element, remedy=f"write {example}")
            return None
        return self.read_required(end, "link", example)

    def _read_origin(self, joint: JointRecord) -> None:
        origin = joint.origin_element = joint.element.find("origin")
        if origin is None:
            return
        joint.xyz = self.numbers.read_vector(origin, "xyz") or joint.xyz
        joint.rpy = self.numbers.read_vector(origin, "rpy") or joint.rpy
        if "quat_xyzw" in origin.attributes:
            self._read_quaternion(joint, origin)

    def _read_quaternion(self, joint: JointRecord, origin: Element) -> None:
        found = f"quat_xyzw={quote(origin.attributes['quat_xyzw'])}"

        def add(rule: Rule, message: str, remedy: str) -> None:
            self.report.add(rule, message, origin, attribute="quat_xyzw", found=found, remedy=remedy)

        if self.version < (1, 1):
            message = 'quat_xyzw needs version="1.1" and is ignored'
            add(QUATERNION_IGNORED, message, "write the rotation as rpy")
            return
        quaternion = self.numbers.read_vector(origin, "quat_xyzw", 4)
        if quaternion is None:
            return
        both, zero = (
            "rpy" in origin.attributes,
            not MIN_VECTOR_LENGTH < sum(map(abs, quaternion)) < MAX_VECTOR_LENGTH,
        )
        if both:
            add(BAD_QUATERNION, "rpy and quat_xyzw are both given", "remove one of these attributes")
        elif zero:
            what = "has no usable length" if any(quaternion) else "is zero"
            add(BAD_QUATERNION, f"the quaternion {what}", 'the identity is "0 0 0 1"')
        else:
            joint.quaternion = quaternion
            message = "urdfkin uses quat_xyzw, but most readers ignore this rotation"
            add(QUAT_XYZW, message, "write the rotation as rpy for these readers")

    def _read_axis(self, joint: JointRecord) -> None:
        axis = joint.axis_element = joint.element.find("axis")
        if axis is None:
            return
        if joint.kind in ("fixed", "floating"):
            effect = f"; a {joint.kind} joint ignores its axis"
            NumberReader(self.report, IGNORED_VALUE, IGNORED_VALUE, effect).read_vector(axis, "xyz")
            return
        if "xyz" in axis.attributes:
            joint.axis = self.numbers.read_vector(axis, "xyz")
            return
        if not axis.attributes and (axis.text or any(x.tag == "xyz" and x.text for x in axis.children)):
            return  # Rule URDF212 reports text between tags.
        message = "some readers read <axis> without xyz as 1 0 0; urdfdom reads 0 0 0"
        remedy = 'write the axis, for example <axis xyz="1 0 0"/>'
        # For a planar joint, the missing axis is only a warning, because the joint ignores its axis and moves
        # in the XY plane of its frame.
        severity = Severity.WARNING if joint.kind == "planar" else None
        self.report.add(EMPTY_AXIS, message, axis, remedy=remedy, severity=severity)

    def _read_limit(self, joint: JointRecord) -> None:
        limit = joint.element.find("limit")
        bounded = joint.kind in ("revolute", "prismatic")
        if limit is None:
            if bounded:
                remedy = f"write {_LIMIT_EXAMPLE}"
                if joint.kind == "revolute":
                    remedy += ', or type="continuous" if the joint rotates without limits'
                what = f"a {joint.kind} joint needs a <limit>"
                self.report.add(MISSING_LIMIT, what, joint.element, remedy=remedy)
            return
        required = ("effort", "velocity") if self.version < (1, 2) else ("lower", "upper") if bounded else ()
        for attribute in required:
            self.read_required(limit, attribute, _LIMIT_EXAMPLE, number=True)
        names = ("lower", "upper", "effort", "velocity", *(FURTHER_LIMITS if self.version >= (1, 2) else ()))
        values = {name: self.numbers.read_scalar(limit, name) for name in names}
        joint.limit = LimitRecord(limit, **values)

    def _read_mimic(self, joint: JointRecord) -> None:
        mimic = joint.element.find("mimic")
        if mimic is None:
            return
        mimicked_joint = self.read_required(mimic, "joint", '<mimic joint="..."/>')
        multiplier = self.numbers.read_scalar(mimic, "multiplier", 1.0)
        offset = self.numbers.read_scalar(mimic, "offset", 0.0)
        if mimicked_joint is not None and multiplier is not None and offset is not None:
            joint.mimic = MimicRecord(mimic, mimicked_joint, multiplier, offset)

    def _check_nonkinematic_elements(self, joint: JointRecord) -> None:
        """Check elements that kinematics does not use; urdfdom refuses a file if one of them is invalid."""
        dynamics, safety = (joint.element.find(tag) for tag in ("dynamics", "safety_controller"))
        if dynamics is not None and not {"damping", "friction"} & dynamics.attributes.keys():
            self.read_required(dynamics, "damping", '<dynamics damping="0"/>, or remove <dynamics>')
        if safety is not None:
            example = '<safety_controller k_velocity="0"/>, or remove <safety_controller>'
            self.read_required(safety, "k_velocity", example, number=True)
        for tag, attributes in _UNUSED_NUMBERS.items():
            if (element := joint.element.find(tag)) is not None:
                for attribute in attributes:
                    self.numbers.read_scalar(element, attribute)


_LIMIT_EXAMPLE = '<limit lower="-1" upper="1" effort="10" velocity="1"/>'

#: Numeric attributes without effect on kinematics.
_UNUSED_NUMBERS = {
    "dynamics": ("damping", "friction"),
    "safety_controller": ("k_velocity", "k_position", "soft_lower_limit", "soft_upper_limit"),
    "calibration": ("rising", "falling"),
}


def nearest_tag(word: str, known: frozenset[str]) -> str | None:
    """Return the name in `known` that is most similar to `word`, or None.

    If no name is similar, the result is a name with the same letters in another order.
    """
    # The cache must not store a name of several megabytes.
    return _nearest_tag(word, known) if len(word) <= _MAX_WORD_LENGTH else None


@lru_cache(1024)
def _nearest_tag(word: str, known: frozenset[str]) -> str | None:
    folded = {name.lower(): name for name in known}
    close = difflib.get_close_matches(word.lower(), folded, n=1, cutoff=0.8)
    if close:
        return folded[close[0]]
    letters = sorted(word.lower())
    return next((name for name in sorted(known) if sorted(name.lower()) == letters), None)


#: Longer words are not similar to any tag or attribute of URDF.
_MAX_WORD_LENGTH = 32
