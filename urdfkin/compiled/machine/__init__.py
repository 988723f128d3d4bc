"""The modules that need Numba: number types, kernels, and the cache of kernels.

Numba reads settings from a file `.numba_config.yaml` in the current folder, when it is imported and before
each compilation. One of these settings is the folder of Numba's cache, and Numba executes the files of that
cache. A foreign file in the current folder could therefore run foreign code. To prevent this, this package
lets Numba read its settings from the environment only. This protection does not work if a program has
imported Numba before.
"""

from __future__ import annotations

import os
import sys

from urdfkin.system.processes import avoid_settings_file

if "numba" not in sys.modules:
    with avoid_settings_file(".numba_config.yaml"):
        from numba.core import config
    config._config_fname = os.devnull
