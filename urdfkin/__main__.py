"""Run the `urdfkin` command as `python -m urdfkin`."""

import os
import sys

# Python puts the current folder first on sys.path, where a file of the folder could replace a module.
# This code does not use pathlib, because the current folder may contain a file pathlib.py.
_package_parent = os.path.realpath(f"{__file__}/../..")
if not sys.flags.safe_path and os.path.realpath(sys.path[0]) != _package_parent:
    del sys.path[0]

from urdfkin.cli import main  # noqa: E402

main()
