"""Odd URDFs, each with the verdict it deserves and the codes and lines it must be given; a module a topic."""

from importlib import import_module

from tests.urdf.lint.cases.arm import Case
from urdfkin.urdf.lint.pages import TOPICS

CASES: list[Case] = [
    case for topic in TOPICS for case in import_module(f"tests.urdf.lint.cases.{topic}").CASES
]
