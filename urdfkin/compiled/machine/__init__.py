"""The modules that need Numba: number types, kernels, and the cache of kernels.

Numba reads settings from a file `.numba_config.yaml` in the current folder, during its import and before each
compilation. One of these settings is the folder of Numba's cache, and Numba executes the files in the cache.
A malicious settings file in the current folder could therefore run any code. This package makes Numba ignore
the settings file and read only environment variables. Numba still reads the settings file if a program
imports Numba before this package.
"""

from __future__ import annotations

import os
import sys

from urdfkin.system.processes import avoid_settings_file

if "numba" not in sys.modules:
    with avoid_settings_file(".numba_config.yaml"):
        from numba.core import config
    config._config_fname = os.devnull
