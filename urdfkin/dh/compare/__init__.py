"""Compare a URDF with a published Denavit-Hartenberg table."""

from urdfkin.dh.compare.agreement import TIP_TOLERANCE, compare, fast_fit_errors
from urdfkin.dh.compare.hypotheses import BetterInterpretation, find_better_interpretation, find_dh_convention
from urdfkin.dh.compare.result import CellDifference, Mistake, TableComparison, comparison_document

__all__ = [
    "TIP_TOLERANCE",
    "BetterInterpretation",
    "CellDifference",
    "Mistake",
    "TableComparison",
    "compare",
    "comparison_document",
    "fast_fit_errors",
    "find_better_interpretation",
    "find_dh_convention",
]
