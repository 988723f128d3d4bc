"""The border to trimesh: mesh files as vertices and faces."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from urdfkin.view.shapes import GREY, Shape

#: More faces than this make a browser slow; such a mesh is shown all the same.
_LARGEST_FILE = 200_000_000


@lru_cache(maxsize=256)
def _read(file: Path) -> Any:
    import trimesh  # noqa: PLC0415  half a second

    return trimesh.load(file, force="scene", process=False)


def mesh(shape: Shape) -> Any | None:
    """A trimesh.Trimesh in the link's axes, coloured as the URDF or the file says; None if unreadable."""
    import trimesh  # noqa: PLC0415

    if shape.file is None or shape.file.stat().st_size > _LARGEST_FILE:
        return None
    try:
        whole = _read(shape.file).to_mesh().copy()
    except Exception:
        return None
    if not isinstance(whole, trimesh.Trimesh) or not len(whole.faces):
        return None
    whole.apply_transform(shape.T_link_shape @ np.diag([*shape.size, 1.0]))
    if shape.colour is not None:
        whole.visual = trimesh.visual.ColorVisuals(whole, face_colors=[round(255 * x) for x in shape.colour])
    elif shape.file.suffix.lower() == ".stl":
        whole.visual = trimesh.visual.ColorVisuals(whole, face_colors=[round(255 * x) for x in GREY])
    return whole
