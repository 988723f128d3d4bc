"""Modules that need Numba: number types, kernels, cache of kernels.

Numba reads settings from `.numba_config.yaml` in the current folder. This happens during Numba's import and
before each compilation. The file can select a cache folder. Numba executes the files of the cache. A
malicious file could therefore run any code. This package imports Numba in another folder, and prevents later
reading of the file. If a program imports Numba first, this protection fails.
"""

from __future__ import annotations

import os
import sys

from urdfkin.system.processes import leave_folder_with_settings

if "numba" not in sys.modules:
    with leave_folder_with_settings(".numba_config.yaml"):
        from numba.core import config
    config._config_fname = os.devnull
