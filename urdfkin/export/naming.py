"""Names of a URDF in code: an identifier in every language, or words in a comment; never anything else.

An identifier gets a prefix of ours wherever it is used (`s_`, `q_`), so that none is a keyword; it is ASCII,
short, and no two are alike.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from urdfkin.dh.export.numeric_code import plain

#: MATLAB takes names of 63 letters.
_LONGEST = 40
_LONGEST_SHOWN = 80


def safe(name: str) -> str:
    """Letters, digits and single low lines.

    >>> safe("panda_joint1"), safe("*/ int x; //"), safe("%")
    ('panda_joint1', 'int_x', 'x')
    """
    word = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")[:_LONGEST].strip("_")
    return word or "x"


def all_safe(names: Iterable[str]) -> list[str]:
    """The same for several, no two alike, whatever letters a language takes for equal.

    >>> all_safe(["a b", "a/b", "A_b_2"])
    ['a_b', 'a_b_2', 'A_b_2_2']
    """
    found, taken = list[str](), set[str]()
    for name in names:
        word, k = safe(name), 1
        candidate = word
        while candidate.lower() in taken:
            k += 1
            candidate = f"{word}_{k}"
        taken.add(candidate.lower())
        found.append(candidate)
    return found


def title(robot: str, frame: str) -> str:
    """What a frame's code is called; it begins with a letter and always gets a suffix.

    >>> title("panda", "panda_hand"), title("ur5", "tool0"), title("2", "x"), title("", "my arm")
    ('panda_hand', 'ur5_tool0', 'robot_2_x', 'my_arm')
    """
    first, second = safe(robot) if robot else "", safe(frame)
    word = second if second.startswith(first) else f"{first}_{second}"
    return word if word[0].isalpha() else f"robot_{word}"


def shown(name: str) -> str:
    """A name in a comment of any language, not at any length."""
    return quiet(name if len(name) <= _LONGEST_SHOWN else f"{name[:_LONGEST_SHOWN]}...")


def quiet(text: str) -> str:
    r"""Words for a comment of any language: printable ASCII that ends none, C's trigraphs included.

    >>> quiet("*/ int x; ??/")
    '_/ int x; __/'
    """
    return plain(text).replace("?", "_")
