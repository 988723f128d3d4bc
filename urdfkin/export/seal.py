"""Write and test the seal of an exported file: a digest of the whole text in the file's header.

It detects changes of the file's numbers, test vectors and statements. It is a digest, not a signature: it
does not prove who wrote the file.
"""

from __future__ import annotations

import hashlib
import re

_ZEROS = "0" * 64
#: The line of a file's header that `seal` completes.
SEAL = f"Seal sha256 {_ZEROS}"
_LINE = re.compile(r"^([ %*]*Seal sha256 )([0-9a-f]{64})$", re.MULTILINE)


def seal(text: str) -> str:
    """Return a file's text with its digest instead of the zeros."""
    return _LINE.sub(lambda found: found[1] + _digest(text), text, count=1)


def is_sealed(text: str) -> bool | None:
    """Return whether a file's text is unchanged, except for line ends; None if the text has no seal."""
    text = text.replace("\r\n", "\n")
    if (found := _LINE.search(text)) is None:
        return None
    return _digest(_LINE.sub(lambda line: line[1] + _ZEROS, text, count=1)) == found[2]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
