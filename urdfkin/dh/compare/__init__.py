"""Compare a URDF with a published Denavit-Hartenberg table."""

from urdfkin.dh.compare.agreement import TOLERANCE, compare, fast_fit_errors
from urdfkin.dh.compare.hypotheses import BetterInterpretation, convention_that_fits, diagnose
from urdfkin.dh.compare.result import CellDifference, Mistake, TableComparison, document

__all__ = [
    "TOLERANCE",
    "BetterInterpretation",
    "CellDifference",
    "Mistake",
    "TableComparison",
    "compare",
    "convention_that_fits",
    "diagnose",
    "document",
    "fast_fit_errors",
]
