"""Does a URDF agree with the vendor's table?"""

from urdfkin.dh.compare.agreement import TOLERANCE, compare
from urdfkin.dh.compare.result import CellDifference, Comparison, Mistake
from urdfkin.dh.compare.slips import Slip, convention_that_fits, diagnose
from urdfkin.dh.compare.text import comparison_text

__all__ = [
    "TOLERANCE",
    "CellDifference",
    "Comparison",
    "Mistake",
    "Slip",
    "compare",
    "comparison_text",
    "convention_that_fits",
    "diagnose",
]
