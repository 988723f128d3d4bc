"""Convert names of a URDF to identifiers, and to text for comments, that are valid in every language.

Identifiers are short, ASCII and unique. The exported code adds a prefix such as `s_` or `q_`, so that no
identifier is a keyword.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from urdfkin.dh.export.code import sanitize

#: Maximum length of an identifier without a prefix; MATLAB allows 63 characters with the prefix.
_LONGEST = 40
_LONGEST_IN_COMMENT = 80


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
    found: dict[str, str] = {}
    for name in names:
        word, k = safe(name), 1
        identifier = word
        while identifier.lower() in found:
            k += 1
            identifier = f"{word}_{k}"
        found[identifier.lower()] = identifier
    return list(found.values())


def title(robot: str, frame: str) -> str:
    """Return the prefix of the exported functions of a frame; it begins with a letter.

    >>> title("panda", "panda_hand"), title("ur5", "tool0"), title("2", "x"), title("", "my arm")
    ('panda_hand', 'ur5_tool0', 'robot_2_x', 'my_arm')
    """
    first, second = safe(robot) if robot else "", safe(frame)
    word = second if second.startswith(first) else f"{first}_{second}"
    return word if word[0].isalpha() else f"robot_{word}"


def comment_name(name: str) -> str:
    return comment_text(name if len(name) <= _LONGEST_IN_COMMENT else f"{name[:_LONGEST_IN_COMMENT]}...")


def comment_text(text: str) -> str:
    r"""Return a text as printable ASCII that does not end a comment in any language.

    Question marks are replaced too, because C's trigraphs, such as ??/, contain question marks.

    >>> comment_text("*/ int x; ??/")
    '_/ int x; __/'
    """
    return sanitize(text).replace("?", "_")
