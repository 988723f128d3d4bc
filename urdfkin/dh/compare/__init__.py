"""Compare a URDF with a published Denavit-Hartenberg table."""

from urdfkin.dh.compare.agreement import TOLERANCE, compare
from urdfkin.dh.compare.result import CellDifference, Mistake, TableComparison, document
from urdfkin.dh.compare.slips import CommonMistake, convention_that_fits, diagnose

__all__ = [
    "TOLERANCE",
    "CellDifference",
    "CommonMistake",
    "Mistake",
    "TableComparison",
    "compare",
    "convention_that_fits",
    "diagnose",
    "document",
]
