"""Odd URDFs with the expected verdict, codes and lines. Each module has the cases of one module of rules."""

from importlib import import_module

from tests.urdf.lint.cases.arm import Case
from urdfkin.urdf.lint.pages import TOPICS

CASES: list[Case] = [
    case for topic in TOPICS for case in import_module(f"tests.urdf.lint.cases.{topic}").CASES
]
