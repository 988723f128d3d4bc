"""The modules that need Numba: number types, kernels, and the cache of kernels.

Numba reads settings from a file `.numba_config.yaml` in the current folder, during its import and before each
compilation. The file can select a cache folder, and Numba executes the files in the cache. A malicious file
could therefore run any code. To prevent this, this package imports Numba in the folder `/` if the current
folder contains such a file, and then disables the reading of the file. If a program imports Numba first, this
protection fails.
"""

from __future__ import annotations

import os
import sys

from urdfkin.system.processes import leave_folder_with_settings

if "numba" not in sys.modules:
    with leave_folder_with_settings(".numba_config.yaml"):
        from numba.core import config
    config._config_fname = os.devnull
