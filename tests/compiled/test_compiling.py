"""What the first kernel of a process brings with it."""

import subprocess

import numpy as np
import pytest

import urdfkin
from urdfkin.system.processes import own_python

_TRIED = """
import numba.np.linalg, numpy as np, urdfkin
urdfkin.load("one_link", verify=False).prepare("tip").placement(np.zeros(1))
print("scipy.linalg" in sys.modules)
numba.np.linalg.ensure_blas()
print("scipy.linalg" in sys.modules)
"""


@pytest.mark.long
def test_scipy_is_imported_for_compiled_code_that_calls_blas_and_for_none_of_ours() -> None:
    # Kept from here on: compiling imports more.
    urdfkin.load("one_link", verify=False).prepare("tip").placement(np.zeros(1))
    done = subprocess.run(own_python(_TRIED), check=True, capture_output=True, text=True)
    assert done.stdout == "False\nTrue\n"
