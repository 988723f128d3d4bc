"""Check that the bytes are UTF-8, and report any other encoding. Nothing is guessed or repaired."""

from __future__ import annotations

import codecs
import re

from urdfkin.lint.finding import Fix, quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import ERROR, NOTE, WARNING, Rule
from urdfkin.system.files import Edit

EMPTY = Rule("URDF101", "empty-file", ERROR)
ENCODING = Rule("URDF102", "not-utf8", ERROR)
DECLARED = Rule("URDF103", "declared-encoding", ERROR)
DECLARED_ASCII = Rule("URDF104", "declared-encoding-unused", WARNING)
XML_VERSION = Rule("URDF111", "xml-version", WARNING)
BYTE_ORDER_MARK = Rule("URDF113", "byte-order-mark", NOTE)

#: Byte order marks of encodings other than UTF-8; the longer ones first.
_MARKS = (
    (codecs.BOM_UTF32_LE, "UTF-32"),
    (codecs.BOM_UTF32_BE, "UTF-32"),
    (codecs.BOM_UTF16_LE, "UTF-16"),
    (codecs.BOM_UTF16_BE, "UTF-16"),
)

#: First bytes of '<' in wide encodings without a byte order mark.
_WIDE = ((b"<\0\0\0", "UTF-32"), (b"\0\0\0<", "UTF-32"), (b"<\0", "UTF-16"), (b"\0<", "UTF-16"))

_DECLARATION = re.compile(rb"""<\?xml(?=\s)[^>]*?\?>""")
_ENCODING = re.compile(rb"""\sencoding\s*=\s*["']([^"']*)["']""")
_VERSION = re.compile(rb"""\sversion\s*=\s*["']([^"']*)["']""")

#: Encodings that contain ASCII: a text of ASCII characters is the same in each.
_ASCII_SUPERSETS = re.compile(r"(iso8859|windows125|cp125|latin|koi8|mac)")


def utf8_bytes(report: Reporter, data: bytes) -> bytes | None:
    """Return the bytes without a byte order mark if they are UTF-8; None after an error.

    Args:
        report: The reporter, which receives the findings.
        data: The bytes of the file.
    """
    if not data.strip():
        what = "the file is empty" if not data else "the file contains only white space"
        report.add(EMPTY, what, remedy="check the program that wrote it")
        return None
    wide = next((name for mark, name in (*_MARKS, *_WIDE) if data.startswith(mark)), None)
    if wide is not None:
        report.add(ENCODING, "the file is not UTF-8 text", found=wide, remedy="save the file as UTF-8")
        return None
    marked = data.startswith(codecs.BOM_UTF8)
    text = data.removeprefix(codecs.BOM_UTF8)
    declared = _declared_encoding(text)
    if not (_is_utf8(report, text, declared) and _agrees(report, text, declared)):
        return None
    if marked:
        report.add(BYTE_ORDER_MARK, "the text begins with a byte order mark", remedy="remove it if you can")
    return text


def _declared_encoding(text: bytes) -> str | None:
    """Return the encoding in the XML declaration, as written."""
    declaration = _DECLARATION.match(text.lstrip())
    match = _ENCODING.search(declaration[0]) if declaration else None
    return match[1].decode("ascii", "replace") if match else None


def _is_utf8(report: Reporter, text: bytes, declared: str | None) -> bool:
    zero = text.find(b"\0")
    if zero >= 0:
        report.add(
            ENCODING,
            "the text contains a zero byte: some readers stop there, others continue",
            remedy="check the file: it is not a text file, or it is damaged",
            position=line_and_column(text, zero),
        )
        return False
    try:
        text.decode("utf-8")
    except UnicodeDecodeError as error:
        claim = f", although the file declares {declared}" if declared else ""
        report.add(
            ENCODING,
            f"a byte is not UTF-8{claim}",
            found=f"0x{text[error.start]:02x}",
            remedy="save the file as UTF-8",
            position=line_and_column(text, error.start),
        )
        return False
    return True


def _agrees(report: Reporter, text: bytes, declared: str | None) -> bool:
    """Return whether the XML declaration is compatible with UTF-8."""
    declaration = _DECLARATION.match(text)
    version = _VERSION.search(declaration[0]) if declaration else None
    if version is not None and version[1] != b"1.0":
        found = quoted(version[1].decode())
        report.add(XML_VERSION, "the XML version is not 1.0", found=found, remedy='write version="1.0"')
    if declared is None or _codec(declared) in ("utf-8", "ascii"):
        return True
    if text.isascii() and _ASCII_SUPERSETS.match(_codec(declared) or ""):
        report.add(
            DECLARED_ASCII,
            "the declared encoding is not UTF-8, but every character is ASCII",
            found=quoted(declared),
            remedy='write encoding="UTF-8"',
            fix=lambda: Fix((Edit(*named.span(1), "UTF-8"),)) if (named := _ENCODING.search(text)) else None,
        )
        return True
    report.add(
        DECLARED,
        "the declared encoding is not UTF-8",
        found=quoted(declared),
        remedy='save the file as UTF-8 and write encoding="UTF-8"',
    )
    return False


def _codec(name: str) -> str | None:
    """Return Python's name of an encoding, in lower case; None if it is unknown."""
    try:
        return codecs.lookup(name).name.lower().replace("-", "").replace("utf8", "utf-8")
    except LookupError:
        return None


def line_and_column(data: bytes, offset: int) -> tuple[int, int]:
    """Return the line and the column of a byte, both from 1."""
    before = data[: max(offset, 0)].decode("utf-8", "replace")
    return before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1
