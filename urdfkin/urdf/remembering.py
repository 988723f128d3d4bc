"""Trees that were read before, on disk: reading one takes a millisecond, importing the parser half a second.

A tree is kept under a digest of everything it depends on: the URDF, how it is read, the sources that read it
and the parser's version. What cannot be read back is read anew, what cannot be written is not kept.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.metadata
import pickle
import tempfile
from functools import cache
from pathlib import Path

from urdfkin import tree
from urdfkin.keeping import kept_folder
from urdfkin.tree import KinematicTree
from urdfkin.urdf.reader import read_tree


def remembered_tree(data: bytes, *, mimic: bool = True, root_joint: str | None = None) -> KinematicTree:
    """As `read_tree`, from disk where it was read before; for robots that come again: nothing is deleted.

    Raises:
        InputError: as `read_tree`.
        UnknownNameError: as `read_tree`.
    """
    folder = _folder()
    if folder is None:
        return read_tree(data, mimic=mimic, root_joint=root_joint)
    place = folder / hashlib.sha256(repr((data, mimic, root_joint)).encode()).hexdigest()[:32]
    try:
        kept = pickle.loads(place.read_bytes())
    except Exception:  # a damaged file may fail in any way
        kept = None
    if isinstance(kept, KinematicTree):
        return kept
    read = read_tree(data, mimic=mimic, root_joint=root_joint)
    _keep(read, place)
    return read


@cache
def _folder() -> Path | None:
    sources = (Path(tree.__file__), *sorted(Path(__file__).parent.glob("*.py")))
    return kept_folder("trees", sources, importlib.metadata.version("yourdfpy"))


def _keep(read: KinematicTree, place: Path) -> None:
    with contextlib.suppress(OSError):
        with tempfile.NamedTemporaryFile(dir=place.parent, delete=False) as file:
            file.write(pickle.dumps(read))
        Path(file.name).replace(place)
