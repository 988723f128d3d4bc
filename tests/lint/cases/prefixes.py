"""Prefixes."""

from tests.lint.cases.arm import ACCEPT, Case, arm

CASES = [
    Case("prefixed-extension", arm(robot='name="r" xmlns:d="http://d"', more="<d:joint/>"), ACCEPT),
]
