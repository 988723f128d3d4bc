"""Processes that tests start run the code under test, whatever folder they start in."""

import os
from pathlib import Path

_ROOT = str(Path(__file__).parents[1])
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (_ROOT, os.environ.get("PYTHONPATH"))))
