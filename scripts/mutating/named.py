"""Slips that went unnoticed once, by name: a text of a file, the text instead, the test that fails."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass

from scripts.mutating.selection import TESTS


@dataclass(frozen=True)
class Named:
    """One slip.

    Attributes:
        claim: What must not go unnoticed.
        module: Where, `urdfkin.validation.error_stats`.
        before: A piece of the module's text, which stands there once.
        after: What is put in its place.
        test: The test that must fail then, and passes without.
    """

    claim: str
    module: str
    before: str
    after: str
    test: str


def named_slips() -> list[Named]:
    """Those of tests/attacks/named_slips.toml."""
    text = (TESTS / "attacks" / "named_slips.toml").read_text(encoding="utf-8")
    return [Named(**slip) for slip in tomllib.loads(text)["slip"]]
