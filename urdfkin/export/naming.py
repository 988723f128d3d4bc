"""Convert names in a URDF to identifiers and comments for exported code.

Identifiers are short, ASCII and unique. The exported code adds a prefix such as `s_` or `q_`, so that no
identifier is a keyword of a programming language.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from urdfkin.dh.export.code import sanitize

#: Maximum length of a name without prefix and number. MATLAB allows 63 characters in all.
_MAX_LENGTH = 40
#: Maximum length of a prefix. MATLAB code appends 11 characters to it: `_kinematics`.
_MAX_PREFIX_LENGTH = 52
_MAX_COMMENT_LENGTH = 80


def safe_name(name: str) -> str:
    """Return a name of at most 40 letters, digits and single underscores.

    >>> safe_name("panda_joint1"), safe_name("*/ int x; //"), safe_name("%")
    ('panda_joint1', 'int_x', 'x')
    """
    word = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")[:_MAX_LENGTH].strip("_")
    return word or "x"


def unique_safe_names(names: Iterable[str]) -> list[str]:
    """Return a different identifier for each name.

    Identifiers also differ if case is ignored.

    >>> unique_safe_names(["a b", "a/b", "A_b_2"])
    ['a_b', 'a_b_2', 'A_b_2_2']
    """
    found: dict[str, str] = {}
    for name in names:
        word, k = safe_name(name), 1
        identifier = word
        while identifier.lower() in found:
            k += 1
            identifier = f"{word}_{k}"
        found[identifier.lower()] = identifier
    return list(found.values())


def function_prefix(robot: str, frame: str) -> str:
    """Return the prefix of a frame's exported functions.

    The prefix begins with a letter and has at most 52 characters. It contains only the name of the frame if a
    prefix with the names of the robot and the frame would be longer.

    >>> function_prefix("panda", "panda_hand"), function_prefix("ur5", "tool0")
    ('panda_hand', 'ur5_tool0')
    >>> function_prefix("2", "x"), function_prefix("", "my arm")
    ('robot_2_x', 'my_arm')
    """
    first, second = safe_name(robot) if robot else "", safe_name(frame)
    both = second if second.startswith(first) else f"{first}_{second}"
    prefixes = [word if word[0].isalpha() else f"robot_{word}" for word in (both, second)]
    return prefixes[0] if len(prefixes[0]) <= _MAX_PREFIX_LENGTH else prefixes[1]


def comment_name(name: str) -> str:
    return comment_text(name if len(name) <= _MAX_COMMENT_LENGTH else f"{name[:_MAX_COMMENT_LENGTH]}...")


def comment_text(text: str) -> str:
    """Replace characters that could end a comment.

    Question marks are also replaced, because they begin C's trigraphs, such as ??/.

    >>> comment_text("*/ int x; ??/")
    '_/ int x; __/'
    """
    return sanitize(text).replace("?", "_")
