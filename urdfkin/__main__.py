"""`python -m urdfkin` is the `urdfkin` command."""

import os
import sys

# Python has put the current folder first on its path. From here on nothing is imported from there, unless
# urdfkin itself was. Not by pathlib, which might be the first such import.
_home = os.path.realpath(f"{__file__}/../..")
if not sys.flags.safe_path and os.path.realpath(sys.path[0]) != _home:
    del sys.path[0]

from urdfkin.cli import main  # noqa: E402

main()
