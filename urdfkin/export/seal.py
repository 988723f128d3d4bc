"""Write and check the seal of an exported file: the digest of the text, in the file's header.

The seal shows whether the header, the code or the test vectors of the file were changed. A seal is not a
signature, so it does not prove who wrote the file.
"""

from __future__ import annotations

import hashlib
import re

_ZEROS = "0" * 64
#: Line of the header in which `seal` replaces the zeros by the digest.
SEAL = f"Seal sha256 {_ZEROS}"
_LINE = re.compile(r"^([ %*]*Seal sha256 )([0-9a-f]{64})$", re.MULTILINE)


def seal(text: str) -> str:
    """Replace the 64 zeros in the file's header by the digest."""
    return _LINE.sub(lambda found: found[1] + _digest(text), text, count=1)


def is_sealed(text: str) -> bool | None:
    """Return whether the file's digest is correct; None without a digest."""
    text = text.replace("\r\n", "\n")
    if (found := _LINE.search(text)) is None:
        return None
    return _digest(_LINE.sub(lambda line: line[1] + _ZEROS, text, count=1)) == found[2]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
