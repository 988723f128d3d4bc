"""The text's recursion, sections 7.4 and 7.7, once, compiled, for whole batches.

Numba would take settings from a file `.numba_config.yaml` in the current folder, when it is imported and
before each compilation: among them the folder of its cache, whose files are run. Here they come from the
environment alone, unless a program imported Numba before.
"""

from __future__ import annotations

import os
import sys

from urdfkin.system.processes import not_reading

if "numba" not in sys.modules:
    with not_reading(".numba_config.yaml"):
        from numba.core import config
    config._config_fname = os.devnull
