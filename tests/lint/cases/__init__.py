"""Odd URDFs, each with the verdict it deserves and the codes and lines it must be given."""

from tests.lint.cases.arm import Case
from tests.lint.cases.dialect import dialect_cases
from tests.lint.cases.extras import extras_cases
from tests.lint.cases.joints import joints_cases
from tests.lint.cases.numbers import numbers_cases
from tests.lint.cases.structure import structure_cases
from tests.lint.cases.suspicious import suspicious_cases
from tests.lint.cases.text import text_cases

CASES: list[Case] = [
    *text_cases(),
    *dialect_cases(),
    *numbers_cases(),
    *structure_cases(),
    *joints_cases(),
    *suspicious_cases(),
    *extras_cases(),
]
