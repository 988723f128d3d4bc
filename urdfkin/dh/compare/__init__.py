"""Compare a URDF with a published Denavit-Hartenberg table."""

from urdfkin.dh.compare.agreement import TOLERANCE, compare
from urdfkin.dh.compare.result import CellDifference, Comparison, Mistake, document
from urdfkin.dh.compare.slips import CommonMistake, convention_that_fits, diagnose

__all__ = [
    "TOLERANCE",
    "CellDifference",
    "CommonMistake",
    "Comparison",
    "Mistake",
    "compare",
    "convention_that_fits",
    "diagnose",
    "document",
]
