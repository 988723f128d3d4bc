"""Read the visual shapes of a URDF's links for the viewer, and load mesh files with trimesh."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit
from xml.etree.ElementTree import Element

import numpy as np

from urdfkin.kinematics.rotation import rotation_from_rpy
from urdfkin.model.tree import FloatArray, pose
from urdfkin.robot import Robot
from urdfkin.system.files import read_bytes
from urdfkin.system.plain_xml import parse_xml
from urdfkin.urdf.catalogue import catalogue, find_package, split_uri

#: Maximum size (bytes) of a mesh, material or texture file that the viewer shows.
LARGEST_FILE = 200_000_000


@lru_cache(maxsize=256)
def _load_mesh(file: Path) -> Any:
    import trimesh

    class SameFolder(trimesh.resolvers.FilePathResolver):
        """Finds only materials and textures that are regular files in the mesh's folder or a subfolder."""

        def get(self, name: str) -> bytes:
            folder = Path(self.parent).resolve()
            for path in (folder / name.strip().lstrip("/"), folder / Path(name).name):
                if path.resolve().is_relative_to(folder) and path.is_file():
                    return read_bytes(path, LARGEST_FILE)
            raise FileNotFoundError(name)

    data = io.BytesIO(read_bytes(file, LARGEST_FILE))
    kind = file.suffix.lower().removeprefix(".")
    return trimesh.load(data, file_type=kind, resolver=SameFolder(str(file)), force="scene", process=False)


def make_mesh(shape: Shape) -> Any | None:
    """Return the mesh of a shape as a coloured trimesh.Trimesh in the link's frame.

    Return None if the shape has no readable mesh file with faces.
    """
    import trimesh

    if shape.file is None:
        return None
    try:
        whole = _load_mesh(shape.file).to_mesh().copy()
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


def corners(shape: Shape) -> FloatArray:
    """Return the corners (8, 3) of a box around a shape, in the link's frame.

    The file of a mesh must be readable.
    """
    signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    if shape.kind == "mesh":
        lower, upper = make_mesh(shape).bounds  # type: ignore[union-attr]
        return np.asarray(0.5 * (lower + upper) + 0.5 * signs * (upper - lower))
    size = np.array(shape.size)
    half = size / 2.0 if shape.kind == "box" else np.array([size[0], size[0], size[-1]])
    if shape.kind == "cylinder":
        half[2] /= 2.0
    return np.asarray(signs * half @ shape.T_link_shape[:3, :3].T + shape.T_link_shape[:3, 3])


GREY = (0.72, 0.74, 0.78, 1.0)


@dataclass(frozen=True, slots=True)
class Shape:
    """One visual of a link.

    Attributes:
        kind: "box", "cylinder", "sphere" or "mesh".
        size: Size in m: (x, y, z) of a box, (radius, length) of a cylinder, (radius,) of a sphere. A mesh has
            the scale factors (x, y, z) instead.
        colour: Red, green, blue and opacity, each from 0 to 1. None: the colours of the mesh's file, or
            `GREY` for STL files and shapes without a file.
    """

    link: str
    kind: str
    size: tuple[float, ...]
    T_link_shape: FloatArray
    colour: tuple[float, float, float, float] | None
    file: Path | None = None
    address: str = ""

    @property
    def is_missing(self) -> bool:
        return self.kind == "mesh" and self.file is None


def shapes(robot: Robot) -> list[Shape]:
    """Return the visuals of a robot.

    Malformed visuals, and visuals with an unknown geometry such as a capsule, are left out.
    """
    root = parse_xml(robot.urdf)  # The URDF of a loaded robot is already checked.
    urdf_file = _file_of(robot)
    materials = {m.get("name"): _rgba(m) for m in root.findall("material") if m.find("color") is not None}
    found = []
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            shape = _shape(link.get("name", ""), visual, materials, urdf_file)
            if shape is not None:
                found.append(shape)
    return found


def _file_of(robot: Robot) -> Path | None:
    entry = catalogue().get(robot.source)
    path = entry.path if entry is not None else Path(robot.source)
    try:
        return path if path.is_file() else None
    except OSError:
        return None


def _shape(
    link: str,
    visual: Element,
    materials: dict[str | None, tuple[float, float, float, float] | None],
    urdf_file: Path | None,
) -> Shape | None:
    geometry = visual.find("geometry")
    if geometry is None or len(geometry) == 0:
        return None
    element, T = geometry[0], _pose(visual.find("origin"))
    material = visual.find("material")
    colour = None if material is None else _rgba(material) or materials.get(material.get("name"))
    size = _size(element)
    if T is None or size is None:
        return None
    address = element.get("filename", "") if element.tag == "mesh" else ""
    file = mesh_file(address, urdf_file) if address else None
    return Shape(link, element.tag, size, T, colour, file, address)


def _size(element: Element) -> tuple[float, ...] | None:
    names = {"box": ("size",), "cylinder": ("radius", "length"), "sphere": ("radius",)}
    if element.tag == "mesh":
        return _numbers(element.get("scale", "1 1 1"), 3)
    if element.tag not in names:
        return None
    words = " ".join(element.get(name, "") for name in names[element.tag])
    return _numbers(words, 3 if element.tag == "box" else len(names[element.tag]))


def _numbers(words: str, count: int) -> tuple[float, ...] | None:
    try:
        values = tuple(float(word) for word in words.split())
    except ValueError:
        return None
    return values if len(values) == count and all(map(math.isfinite, values)) else None


def _pose(origin: Element | None) -> FloatArray | None:
    if origin is None:
        return pose()
    xyz, rpy = (_numbers(origin.get(name, "0 0 0"), 3) for name in ("xyz", "rpy"))
    return None if xyz is None or rpy is None else pose(rotation_from_rpy(rpy), xyz)


def _rgba(material: Element) -> tuple[float, float, float, float] | None:
    color = material.find("color")
    values = None if color is None else _numbers(color.get("rgba", ""), 4)
    if values is None:
        return None
    r, g, b, a = (min(1.0, max(0.0, x)) for x in values)
    return r, g, b, a


def mesh_file(address: str, urdf_file: Path | None) -> Path | None:
    """Return the path of the mesh file at an address in a URDF; None if there is no such file.

    A relative path in the URDF is relative to the folder of the URDF.
    """
    candidates = list(_candidates(address, urdf_file))
    try:
        return next((path for path in candidates if path.is_file()), None)
    except OSError:
        return None


def _candidates(address: str, urdf_file: Path | None) -> Iterator[Path]:
    if not address or "\0" in address:
        return
    if (parts := split_uri(address)) is not None:
        # Some URDFs have a third slash before the package's name: package:///NAME.
        name, path = parts if parts[0] else parts[1].partition("/")[::2]
        package = find_package(name, urdf_file)
        if package is not None:
            yield package / path
    elif address.startswith("file://"):
        yield Path(unquote(urlsplit(address).path))
    elif "://" not in address:
        yield (urdf_file.parent if urdf_file is not None else Path()) / address
