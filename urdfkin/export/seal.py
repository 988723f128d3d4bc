"""Write and check the digest in the header of an exported file.

The digest of the whole text is called the seal. It shows whether numbers, test vectors or statements of the
file were changed. A seal is no signature, so it does not prove who wrote the file.
"""

from __future__ import annotations

import hashlib
import re

_ZEROS = "0" * 64
#: `seal` replaces the zeros in this line of the header by the digest.
SEAL = f"Seal sha256 {_ZEROS}"
_LINE = re.compile(r"^([ %*]*Seal sha256 )([0-9a-f]{64})$", re.MULTILINE)


def seal(text: str) -> str:
    """Replace the 64 zeros in the file's header by the digest, and return the new text."""
    return _LINE.sub(lambda found: found[1] + _digest(text), text, count=1)


def is_sealed(text: str) -> bool | None:
    """Return whether the digest in a file's header is correct for any line ends; None without a digest."""
    text = text.replace("\r\n", "\n")
    if (found := _LINE.search(text)) is None:
        return None
    return _digest(_LINE.sub(lambda line: line[1] + _ZEROS, text, count=1)) == found[2]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
