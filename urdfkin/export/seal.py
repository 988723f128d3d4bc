"""A file's digest in its own head: whether its numbers, its test vectors and its claims are as written.

It is a digest, not a signature: it shows that a file was changed, not who wrote it.
"""

from __future__ import annotations

import hashlib
import re

_ZEROS = "0" * 64
#: The line of a head that `seal` completes.
SEAL = f"Seal sha256 {_ZEROS}"
_LINE = re.compile(r"^([ %*]*Seal sha256 )([0-9a-f]{64})$", re.MULTILINE)


def seal(text: str) -> str:
    """A file's text with its digest in the place of the zeros."""
    return _LINE.sub(lambda found: found[1] + _digest(text), text, count=1)


def is_sealed(text: str) -> bool | None:
    """Whether a file is as it was written, whatever its line ends; None: it has no seal."""
    text = text.replace("\r\n", "\n")
    if (found := _LINE.search(text)) is None:
        return None
    return _digest(_LINE.sub(lambda line: line[1] + _ZEROS, text, count=1)) == found[2]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
