"""What the first kernel of a process brings with it."""

import subprocess

import numpy as np
import pytest

import urdfkin
from urdfkin.system.interpreter import own_python

_TRIED = """
import numba, numpy as np, urdfkin
urdfkin.load("one_link", verify=False).placement(np.zeros(1))
before = "scipy.linalg" in sys.modules
product = numba.njit(lambda x, y: np.dot(x, y))(np.array([1.0, 2.0]), np.array([3.0, 4.0]))
print(before, product, "scipy.linalg" in sys.modules)
"""


@pytest.mark.slow
def test_scipy_is_imported_for_compiled_code_that_calls_blas_and_for_none_of_ours() -> None:
    urdfkin.load("one_link", verify=False).placement(np.zeros(1))  # kept from here on: compiling imports more
    done = subprocess.run(own_python(_TRIED), check=True, capture_output=True, text=True)
    assert done.stdout == "False 11.0 True\n"
