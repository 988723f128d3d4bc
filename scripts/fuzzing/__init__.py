"""Parts of scripts/fuzz.py: how mutants are made, and what is asked of each."""

#: What may happen to a mutant.
GOOD = (
    "refused",
    "verified",
    "not verified, with a finding that says why",
    "too large to compute, with a finding",
)
