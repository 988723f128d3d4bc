"""Everything that needs Numba: number types, kernels, and their cache.

Numba reads settings from a file `.numba_config.yaml` in the current folder, when it is imported and before
each compilation. One of them is the folder of its cache, whose files are executed. To avoid that, this
package reads Numba's settings from the environment only, unless a program imported Numba before.
"""

from __future__ import annotations

import os
import sys

from urdfkin.system.processes import not_reading

if "numba" not in sys.modules:
    with not_reading(".numba_config.yaml"):
        from numba.core import config
    config._config_fname = os.devnull
