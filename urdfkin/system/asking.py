"""What a lower room has done by a higher one: it asks by a word, and knows nobody above it.

Who answers is said where the package is put together, in `urdfkin/__init__.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_ANSWERS: dict[str, Callable[..., Any]] = {}


def answer(word: str, function: Callable[..., Any]) -> None:
    """Have a function answer to a word."""
    _ANSWERS[word] = function


def ask(word: str) -> Callable[..., Any]:
    """The function that answers to a word."""
    return _ANSWERS[word]
