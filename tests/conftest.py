"""Settings for every test: threads, bytecode, Hypothesis examples and garbage collection.

Linear algebra uses one thread. pytest runs one test on each core, and a second thread in each test made a fit
of 140 numbers six times slower.

Processes that tests start read and write bytecode in `__pycache__`. Otherwise, each of hundreds of processes
would compile the package again, which takes half of the time of such a test.

Hypothesis tries the same examples in every run, so the result of a test depends only on the commit. The seed
of a test is the hash of its source, and no run reads examples of earlier runs. By default, Hypothesis also
draws constants from the imported modules. Constants are disabled, because the imported modules depend on the
tests of the run. `pytest --hypothesis-profile=search` tries new examples, including constants.

Collected tests exist until the end of the run, so the garbage collector ignores them. The garbage collector
is also disabled while pytest collects tests. Otherwise, the collection of ten thousand tests takes a third
longer.
"""

import gc
import os
import signal
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
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # NumPy reads the variable when it is imported
# A shell ignores SIGINT for a process in the background. Tests of Ctrl-C need the default handler.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# `nohup` ignores SIGHUP. Tests of a closed terminal need the default handler.
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

# A deadline would fail on a busy machine. Trees need many draws and are large.
_UNHURRIED = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
settings.register_profile("same", _UNHURRIED, derandomize=True)
settings.register_profile("search", _UNHURRIED, derandomize=False, print_blob=True)
settings.load_profile("same")


def _collects_constants_of(path: str) -> bool:
    return settings.get_current_profile_name() != "same" and is_local_module_file(path)


# This function is not public; tests/test_same_examples.py fails if another version of Hypothesis lacks it.
vars(providers)["is_local_module_file"] = _collects_constants_of


def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark long tests as slow, so that `-m "not slow"` excludes both."""
    if item.get_closest_marker("long"):
        item.add_marker("slow")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Disable garbage collection while tests are collected, and exclude the tests from later collections."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
