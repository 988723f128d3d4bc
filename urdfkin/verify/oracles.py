"""Who can be asked whether a result is true: Pinocchio, which is asked by default, and MuJoCo.

>>> WITNESSES["mujoco"].title
'MuJoCo'
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from urdfkin.errors import UnknownNameError
from urdfkin.errors.validators import as_str
from urdfkin.system.lazy_import import lazy_import

#: By which name a witness is asked for.
WitnessName = Literal["pinocchio", "mujoco"]


@dataclass(frozen=True, slots=True)
class Witness:
    """A library that computes the same from its own reading of the text.

    Attributes:
        name: As it is asked for.
        title: As a sentence has it.
        package: As Python's packages have it.
        version: The version that is installed, found without importing it.
        oracle: Makes its model of a robot, (text, tree, mimic=, moving_base=, root_joint=).
        size: The magnitudes that its bound is made of: see `urdfkin.verify.bounds`.
    """

    name: WitnessName
    title: str
    package: str
    version: Callable[[], str]
    oracle: Callable[..., Any]
    size: Callable[[Any], Any]

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[str]]:
        return _known, (self.name,)

    @property
    def words(self) -> str:
        """Name and version, for certificates."""
        return f"{self.title} {self.version()}"


PINOCCHIO = Witness(
    "pinocchio",
    "Pinocchio",
    "pin",
    lazy_import("urdfkin.verify.pinocchio:version"),
    lazy_import("urdfkin.verify.pinocchio:Oracle"),
    lambda size: size,
)
MUJOCO = Witness(
    "mujoco",
    "MuJoCo",
    "mujoco",
    lazy_import("urdfkin.urdf.mujoco:version"),
    lazy_import("urdfkin.verify.mujoco:MujocoOracle"),
    lazy_import("urdfkin.verify.bounds:about_the_root"),
)
WITNESSES: dict[str, Witness] = {witness.name: witness for witness in (PINOCCHIO, MUJOCO)}


def _known(name: str) -> Witness:
    return WITNESSES[name]


def witness_of(name: object) -> Witness:
    """The witness of that name.

    Raises:
        UnknownNameError: there is none.
        InputError: it is not installed.
    """
    asked = as_str(name, "oracle")
    witness = next((one for one in WITNESSES.values() if one.name == asked), None)
    if witness is None:
        raise UnknownNameError("oracle", asked, WITNESSES)
    if witness is not PINOCCHIO:
        witness.version()  # now rather than in the middle of something
    return witness
