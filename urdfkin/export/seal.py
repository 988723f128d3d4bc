"""Write and check the digest in the header of an exported file.

It is called the seal. The seal is a digest of the whole text. It shows whether numbers, test vectors or
statements of the file were changed. It is no signature, so it does not prove who wrote the file.
"""

from __future__ import annotations

import hashlib
import re

_ZEROS = "0" * 64
#: The line in a file's header in which `seal` replaces zeros by the digest.
SEAL = f"Seal sha256 {_ZEROS}"
_LINE = re.compile(r"^([ %*]*Seal sha256 )([0-9a-f]{64})$", re.MULTILINE)


def seal(text: str) -> str:
    """Return a file's text with the seal. In the given text, zeros stand in the place of the seal."""
    return _LINE.sub(lambda found: found[1] + _digest(text), text, count=1)


def is_sealed(text: str) -> bool | None:
    """Return whether a file's text agrees with its seal; None if the text has no seal.

    Different line ends count as equal.
    """
    text = text.replace("\r\n", "\n")
    if (found := _LINE.search(text)) is None:
        return None
    return _digest(_LINE.sub(lambda line: line[1] + _ZEROS, text, count=1)) == found[2]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
