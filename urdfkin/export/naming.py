"""Convert names of a URDF to identifiers and to text for comments that are valid in every language.

Identifiers are short, ASCII and unique. The exported code adds a prefix such as `s_` or `q_`, so that no
identifier is a keyword.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from urdfkin.dh.export.code import plain

#: An identifier has at most this length without a prefix. With a prefix, MATLAB allows 63 characters.
_LONGEST = 40
_LONGEST_SHOWN = 80


def safe(name: str) -> str:
    """Return a name with only letters, digits and single underscores.

    >>> safe("panda_joint1"), safe("*/ int x; //"), safe("%")
    ('panda_joint1', 'int_x', 'x')
    """
    word = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")[:_LONGEST].strip("_")
    return word or "x"


def all_safe(names: Iterable[str]) -> list[str]:
    """Return a different identifier for each name, even for a language that ignores case.

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
    """Return the name of the exported code for a frame. The name begins with a letter; callers add a suffix.

    >>> title("panda", "panda_hand"), title("ur5", "tool0"), title("2", "x"), title("", "my arm")
    ('panda_hand', 'ur5_tool0', 'robot_2_x', 'my_arm')
    """
    first, second = safe(robot) if robot else "", safe(frame)
    word = second if second.startswith(first) else f"{first}_{second}"
    return word if word[0].isalpha() else f"robot_{word}"


def shown(name: str) -> str:
    """Return a name as text for a comment in any language, shortened to 80 characters."""
    return quiet(name if len(name) <= _LONGEST_SHOWN else f"{name[:_LONGEST_SHOWN]}...")


def quiet(text: str) -> str:
    r"""Return the text as printable ASCII that cannot end a comment in any language.

    C's trigraphs, such as ??/, are removed too.

    >>> quiet("*/ int x; ??/")
    '_/ int x; __/'
    """
    return plain(text).replace("?", "_")
