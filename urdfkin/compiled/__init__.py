"""The textbook's recursion (sections 7.4 and 7.7), compiled to compute batches.

Numba reads its settings from a file `.numba_config.yaml` in the current folder, when Numba is imported and
before each compilation. One setting is the folder of Numba's cache, and Numba executes the files of this
folder. A file in the current folder could therefore run foreign code. To avoid this, this package makes Numba
read its settings from the environment only, unless the program imported Numba before this package.
"""

from __future__ import annotations

import os
import sys

from urdfkin.system.processes import not_reading

if "numba" not in sys.modules:
    with not_reading(".numba_config.yaml"):
        from numba.core import config
    config._config_fname = os.devnull
