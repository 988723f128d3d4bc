"""Replace one module of the package by a mutant when the module is imported.

This file is in a folder on PYTHONPATH, so that each Python process of a test run loads it at its start.

The environment variable `URDFKIN_MUTANT` is the module's name and the mutant's number, for example
`urdfkin.validation.error_stats:17`. If `URDFKIN_MUTANT` has no number, the variable
`URDFKIN_MUTANT_CODE` is a JSON list of three texts: the name of a function, a piece of its code, and the new
code.
"""

import importlib.abc
import importlib.machinery
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from types import CodeType, ModuleType

MODULE, _, NUMBER = os.environ.get("URDFKIN_MUTANT", "").partition(":")
CODE = os.environ.get("URDFKIN_MUTANT_CODE", "")


class _Loader(importlib.machinery.SourceFileLoader):
    def get_code(self, fullname: str) -> CodeType:
        from scripts.mutating.operators import apply_change, replace_code

        source = Path(self.path).read_text(encoding="utf-8")
        tree = apply_change(source, int(NUMBER)) if NUMBER else replace_code(source, *json.loads(CODE))
        return compile(tree, str(self.path), "exec")


class _Finder(importlib.abc.MetaPathFinder):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname != MODULE:
            return None
        spec = importlib.machinery.PathFinder.find_spec(fullname, path)
        if spec is not None and spec.origin is not None:
            spec.loader = _Loader(fullname, spec.origin)
        return spec


if MODULE:
    sys.meta_path.insert(0, _Finder())
