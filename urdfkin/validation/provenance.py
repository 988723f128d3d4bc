"""What the numbers of a validation depend on besides the robots: our own code, and the libraries."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

from urdfkin.system.files import read_bytes
from urdfkin.system.versions import installed_version

_PACKAGE = Path(__file__).resolve().parents[1]
#: What only shows results, and may change between two runs of a campaign.
_SHOWING = ("cli", "motion", "report", "view")
#: Libraries that compute or read.
LIBRARIES = ("urdfkin", "pin", "numpy", "numba", "llvmlite", "yourdfpy", "mujoco")


@cache
def provenance() -> dict[str, str]:
    """Versions, and digests of urdfkin's own files: of all that compute, and of the equations."""
    equations = hashlib.sha256(read_bytes(_PACKAGE / "kinematics" / "equations.py")).hexdigest()
    return {name: version(name) for name in LIBRARIES} | {"code": _code(), "equations": equations}


def version(package: str) -> str:
    """The version of an installed package; in words where there is none."""
    return installed_version(package) or ("a checkout" if package == "urdfkin" else "not installed")


def _code() -> str:
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*")):
        place = path.relative_to(_PACKAGE)
        if path.suffix in (".py", ".toml", ".json") and place.parts[0] not in _SHOWING:
            content = read_bytes(path)
            digest.update(f"{place.as_posix()}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()
