"""What holds for every test: how properties are searched, and that processes run the code under test.

Linear algebra takes one thread: there are as many tests at a time as cores, and two threads in each that wait
for one another took six times one's processor time for a fit of 140 numbers.

Hundreds of tests start a process, and each would compile the whole package again where Python was told to
keep no bytecode: half of what such a test takes. It is kept in `__pycache__`, as usual.

Properties are tried on the same examples in every run, so that a verdict depends on the commit alone.
`pytest --hypothesis-profile=search` tries new ones.
"""

import os
import sys
from pathlib import Path

from hypothesis import HealthCheck, settings

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
