"""Compare two robot models: prove whether they move alike, and list their differences."""

from __future__ import annotations
