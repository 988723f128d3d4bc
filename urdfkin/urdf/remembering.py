"""Trees that were read before, on disk: reading one takes a millisecond, importing the parser half a second.

A tree is kept under a digest of everything it depends on: what the URDF says of links and joints, how it is
read, the sources that read it and the parser's version. What is damaged is read anew, what cannot be written
is not kept; both are said.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import pickle
from functools import cache
from pathlib import Path

from urdfkin.model import tree
from urdfkin.model.tree import KinematicTree
from urdfkin.system.keeping import kept_folder
from urdfkin.system.sealed import damaged, keep, kept
from urdfkin.urdf.reader import read_tree
from urdfkin.urdf.records import RobotRecord
from urdfkin.urdf.skeleton import skeleton


def remembered_tree(urdf: RobotRecord, *, mimic: bool = True, root_joint: str | None = None) -> KinematicTree:
    """As `read_tree`, from disk where it was read before; for robots that come again: nothing is deleted.

    Raises:
        InputError: as `read_tree`.
        UnknownNameError: as `read_tree`.
    """
    folder = _folder()
    if folder is None:
        return read_tree(urdf, mimic=mimic, root_joint=root_joint)
    place = folder / hashlib.sha256(repr((skeleton(urdf), mimic, root_joint)).encode()).hexdigest()[:32]
    if (content := kept(place)) is not None:
        try:
            if isinstance(found := pickle.loads(content), KinematicTree):
                return found
        except Exception as error:  # whole, but of another time: it may fail in any way
            damaged(place, str(error))
    read = read_tree(urdf, mimic=mimic, root_joint=root_joint)
    keep(place, pickle.dumps(read))
    return read


@cache
def _folder() -> Path | None:
    sources = (Path(tree.__file__), *sorted(Path(__file__).parent.glob("*.py")))
    return kept_folder("trees", sources, importlib.metadata.version("yourdfpy"))
