"""The border to trimesh: mesh files as vertices and faces."""

from __future__ import annotations

import io
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from urdfkin.system.files import read_bytes
from urdfkin.view.shapes import GREY, Shape

#: Bytes of a mesh, a material or a texture; what is larger is not shown.
LARGEST_FILE = 200_000_000


@lru_cache(maxsize=256)
def _read(file: Path) -> Any:
    import trimesh  # noqa: PLC0415  half a second

    class Beside(trimesh.resolvers.FilePathResolver):
        """Materials and textures: regular files in the mesh's folder or below it."""

        def get(self, name: str) -> bytes:
            folder = Path(self.parent).resolve()
            for path in (folder / name.strip().lstrip("/"), folder / Path(name).name):
                if path.resolve().is_relative_to(folder) and path.is_file():
                    return read_bytes(path, LARGEST_FILE)
            raise FileNotFoundError(name)

    data = io.BytesIO(read_bytes(file, LARGEST_FILE))
    kind = file.suffix.lower().removeprefix(".")
    return trimesh.load(data, file_type=kind, resolver=Beside(str(file)), force="scene", process=False)


def mesh(shape: Shape) -> Any | None:
    """A trimesh.Trimesh in the link's axes, coloured as the URDF or the file says; None if unreadable."""
    import trimesh  # noqa: PLC0415

    if shape.file is None:
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
