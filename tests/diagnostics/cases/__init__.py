"""Odd URDFs, each with the verdict it deserves and the codes and lines it must be given."""

from tests.diagnostics.cases.arm import Case
from tests.diagnostics.cases.dialect import dialect_cases
from tests.diagnostics.cases.extras import extras_cases
from tests.diagnostics.cases.joints import joints_cases
from tests.diagnostics.cases.numbers import numbers_cases
from tests.diagnostics.cases.structure import structure_cases
from tests.diagnostics.cases.suspicious import suspicious_cases
from tests.diagnostics.cases.text import text_cases

CASES: list[Case] = [
    *text_cases(),
    *dialect_cases(),
    *numbers_cases(),
    *structure_cases(),
    *joints_cases(),
    *suspicious_cases(),
    *extras_cases(),
]
