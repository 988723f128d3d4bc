"""Read the named mutants, which were once not detected.

Each replaces a text of a file and has a test that must fail.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass

from scripts.mutating.selection import TESTS


@dataclass(frozen=True)
class Named:
    """One named mutant.

    Attributes:
        claim: The mistake that must be detected.
        module: The module, such as `urdfkin.validation.error_stats`.
        before: A text that occurs exactly once in the module.
        after: The text that replaces `before`.
        test: The test that fails with the mutant and passes without it.
    """

    claim: str
    module: str
    before: str
    after: str
    test: str


def named_slips() -> list[Named]:
    """Return the mutants of tests/attacks/named_slips.toml."""
    text = (TESTS / "attacks" / "named_slips.toml").read_text(encoding="utf-8")
    return [Named(**slip) for slip in tomllib.loads(text)["slip"]]
