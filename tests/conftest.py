"""What holds for every test: how properties are searched, and that processes run the code under test.

Linear algebra takes one thread: there are as many tests at a time as cores, and two threads in each that wait
for one another took six times one's processor time for a fit of 140 numbers.

Hundreds of tests start a process, and each would compile the whole package again where Python was told to
keep no bytecode: half of what such a test takes. It is kept in `__pycache__`, as usual.

Properties are tried on the same examples in every run, so that a verdict depends on the commit alone: the
seed of a test is the hash of its source, and no run reads what an earlier one kept. By itself Hypothesis also
draws constants from the modules imported so far, which depend on the tests that run together: not here.
`pytest --hypothesis-profile=search` tries new examples, those constants among them.

What is collected lives until the end, so no garbage is looked for among ten thousand tests: not while they
are gathered, which took a third longer, and not each time that garbage is looked for later.
"""

import gc
import os
import sys
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers
from hypothesis.internal.constants_ast import is_local_module_file

_ROOT = str(Path(__file__).parents[1])
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (_ROOT, os.environ.get("PYTHONPATH"))))
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # NumPy reads it when it is imported

# No deadline: a busy machine is no counterexample. Trees are built from many draws, and are large.
_UNHURRIED = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
settings.register_profile("same", _UNHURRIED, derandomize=True)
settings.register_profile("search", _UNHURRIED, derandomize=False, print_blob=True)
settings.load_profile("same")


def _collects_constants_of(path: str) -> bool:
    return settings.get_current_profile_name() != "same" and is_local_module_file(path)


# Not public: tests/test_same_examples.py fails if another version of Hypothesis collects constants otherwise.
vars(providers)["is_local_module_file"] = _collects_constants_of


def pytest_itemcollected(item: pytest.Item) -> None:
    """Let `-m "not slow"` leave out long tests too."""
    if item.get_closest_marker("long"):
        item.add_marker("slow")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect without looking for garbage, and leave what was collected out of every search."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
