"""The oracles Pinocchio (default) and MuJoCo.

>>> oracle_library("pinocchio").title
'Pinocchio'
"""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Literal

from urdfkin.errors import UnknownNameError
from urdfkin.errors.validators import as_str
from urdfkin.system.lazy_import import installed_version, lazy_import

OracleName = Literal["pinocchio", "mujoco"]


@dataclass(frozen=True, slots=True)
class OracleLibrary:
    """A library that checks urdfkin's results.

    Attributes:
        make_oracle: Constructor of an `Oracle`.
        adapt_magnitudes: Converts `Magnitudes` for Pinocchio to `Magnitudes` for the library.
    """

    name: OracleName
    title: str
    package: str
    version: Callable[[], str]
    make_oracle: Callable[..., Any]
    adapt_magnitudes: Callable[[Any], Any]

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[str]]:
        return _restore_library, (self.name,)

    @property
    def name_and_version(self) -> str:
        return f"{self.title} {self.version()}"


PINOCCHIO = OracleLibrary(
    "pinocchio",
    "Pinocchio",
    "pin",
    lazy_import("urdfkin.verify.pinocchio:version"),
    lazy_import("urdfkin.verify.pinocchio:PinocchioOracle"),
    lambda magnitudes: magnitudes,
)
MUJOCO = OracleLibrary(
    "mujoco",
    "MuJoCo",
    "mujoco",
    lazy_import("urdfkin.urdf.mujoco:version"),
    lazy_import("urdfkin.verify.mujoco:MujocoOracle"),
    lazy_import("urdfkin.verify.bounds:mujoco_magnitudes"),
)
ORACLES: dict[str, OracleLibrary] = {oracle.name: oracle for oracle in (PINOCCHIO, MUJOCO)}


def _restore_library(name: str) -> OracleLibrary:
    return ORACLES[name]


def oracle_library(name: object) -> OracleLibrary:
    library_name = as_str(name, "oracle")
    if (oracle := ORACLES.get(library_name)) is None:
        raise UnknownNameError("oracle", library_name, ORACLES)
    if oracle is not PINOCCHIO:
        oracle.version()  # `version` raises an error if the library is missing.
    return oracle


def package_version(package: str) -> str:
    return installed_version(package) or ("a checkout" if package == "urdfkin" else "not installed")


def package_versions(oracles: Iterable[str | None] = ()) -> dict[str, str]:
    packages = ["urdfkin", "numpy", "numba", "yourdfpy", "example-robot-data"]
    packages += sorted({ORACLES[name].package for name in oracles if name in ORACLES})
    found = {package: package_version(package) for package in packages}
    return {"python": platform.python_version(), "pin": PINOCCHIO.version()} | found
