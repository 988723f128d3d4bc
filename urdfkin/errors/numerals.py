"""Numbers as people write them: decimal digits in ASCII, finite, and nothing else.

Python's own `float` is far more generous: it takes `1_0`, Arabic digits, `nan` and `infinity`. It is only
asked once the grammar has agreed, which is that of `xs:double` without its special values.
"""

from __future__ import annotations

import math
import re

#: The grammar, which takes time linear in the length of a text.
DECIMAL = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_WHOLE = re.compile(r"[+-]?[0-9]+")
#: Longest number that is read; Python's conversion takes time quadratic in the length of absurd ones.
_LONGEST = 2000

#: What a refused number might have been meant as -> what to do about it; the first that matches.
_REMEDIES = (
    (r"", "it is empty: write a number"),
    (r"[+-]?(nan|inf|infinity)", "only finite numbers have a meaning here"),
    (r".*[^\x00-\x7f].*", "write ASCII digits and signs"),
    (r".*_.*", "write the digits without underscores"),
    (r"0[xXbBoO].*", "write it in decimal digits"),
    (r".*;.*", "separate numbers by commas"),
)


def decimal(text: str) -> float | None:
    """The finite number that a text is, blanks around it allowed; None where it is none.

    >>> decimal(" -1.5e-3"), decimal("1_0"), decimal("nan"), decimal("\u0661"), decimal("1e999")
    (-0.0015, None, None, None, None)
    """
    text = text.strip(" \t\r\n")
    if len(text) > _LONGEST or not DECIMAL.fullmatch(text):
        return None
    value = float(text)
    return value if math.isfinite(value) else None


def whole(text: str) -> int | None:
    """The whole number that a text is, blanks around it allowed; None where it is none.

    >>> whole("12"), whole("1_2"), whole("1.0"), whole("1e3")
    (12, None, None, None)
    """
    text = text.strip(" \t\r\n")
    return int(text) if len(text) <= _LONGEST and _WHOLE.fullmatch(text) else None


def remedy(text: str) -> str | None:
    """What to do about a text that is no number; None where there is no telling what was meant."""
    text = text.strip(" \t\r\n")
    found = (words for pattern, words in _REMEDIES if re.fullmatch(pattern, text, re.IGNORECASE | re.DOTALL))
    return next(found, None)
