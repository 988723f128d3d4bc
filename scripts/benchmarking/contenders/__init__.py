"""One module for each contender; it imports its library at the top and is skipped where that is missing.

A module has `LIBRARY`, the distribution's name, and `batches(subject)`, a `Work` for each quantity it has;
one that takes single configurations has `calls(subject)` too, from which its batches are made.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from importlib import metadata, util
from typing import Any

#: Module here, and the module it needs.
CONTENDERS = {
    "urdfkin_batch": "urdfkin",
    "pinocchio_loop": "pinocchio",
    "pinocchio_processes": "pinocchio",
    "dynibo_loop": "dynibo",
    "mujoco_loop": "mujoco",
    "drake_loop": "pydrake",
    "toolbox_loop": "roboticstoolbox",
    "torch_batch": "pytorch_kinematics",
    "jax_batch": "jax",
}
#: What must be there: what the benchmark is about.
ALWAYS = ("urdfkin_batch", "pinocchio_loop", "pinocchio_processes")


@dataclass(frozen=True)
class Contender:
    """A contender that can be asked, or the reason why not.

    Attributes:
        library: The distribution.
        version: As installed; None if it is not.
        module: Its file; None if it is not installed.
    """

    library: str
    version: str | None
    module: Any = None

    @property
    def state(self) -> str:
        """For the list of libraries."""
        return self.version or "not installed"


def find(*, peers: bool = True) -> list[Contender]:
    """Every contender in the order of the tables; without `peers` urdfkin and Pinocchio alone."""
    names = CONTENDERS if peers else ALWAYS
    return [_contender(name) for name in names]


def _contender(name: str) -> Contender:
    if util.find_spec(CONTENDERS[name]) is None:
        return Contender(CONTENDERS[name], None)
    module = importlib.import_module(f"{__name__}.{name}")
    try:
        version = metadata.version(module.LIBRARY)
    except metadata.PackageNotFoundError:
        version = "a checkout"
    return Contender(module.LIBRARY, version, module)
