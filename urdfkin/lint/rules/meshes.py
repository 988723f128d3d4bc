"""Whether the packages and files that meshes are said to lie in exist; no mesh is ever opened."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from urdfkin.lint.finding import quoted
from urdfkin.lint.reporter import Reporter
from urdfkin.lint.rule import WARNING, Rule
from urdfkin.urdf.element import Element
from urdfkin.urdf.packages import find_package, split_uri

MESH_MISSING = Rule("URDF706", "mesh-missing", WARNING)
MESH_REMOTE = Rule("URDF707", "mesh-remote", WARNING)


def check_meshes(report: Reporter, root: Element, beside: Path | None) -> None:
    """Report packages that are not found, each once, and files that are missing.

    Args:
        report: Where findings go.
        root: The document's root element.
        beside: The file the URDF was read from; None when it came as text, and then only packages are
            looked for, in the environment.
    """
    packages: dict[str, Path | None] = {}
    missing: dict[str, list[Element]] = {}
    for mesh in _meshes(root):
        filename = mesh.attributes.get("filename", "").strip()
        parts = split_uri(filename)
        if parts is not None:
            package, path = parts
            if package not in packages:
                packages[package] = find_package(package, beside)
            folder = packages[package]
            if folder is None:
                missing.setdefault(package, []).append(mesh)
            elif not _exists(folder / path):
                _report_file(report, mesh, filename)
        elif _is_missing_file(filename, beside):
            _report_file(report, mesh, filename)
    for package, meshes in missing.items():
        report.add(
            MESH_MISSING,
            f"package {quoted(package)} is not found, where {_count(len(meshes))} should be"
            if package
            else f"an address names no package, for {_count(len(meshes))}",
            meshes[0],
            attribute="filename",
            found=quoted(meshes[0].attributes["filename"]),
            remedy="kinematics needs no mesh; add the package's folder to ROS_PACKAGE_PATH to find it",
        )


def check_address(report: Reporter, mesh: Element) -> None:
    """Whether an address leads into the network."""
    filename = mesh.attributes["filename"]
    if filename.lower().startswith(("http:", "https:", "ftp:")):
        report.add(
            MESH_REMOTE,
            "the mesh lies on the network; nothing was fetched",
            mesh,
            attribute="filename",
            found=quoted(filename),
            remedy="copy it into a package",
        )


def _meshes(root: Element) -> Iterator[Element]:
    for link in root.all("link"):
        for shape in link.children:
            geometry = shape.first("geometry") if shape.tag in ("visual", "collision") else None
            if geometry is not None:
                yield from geometry.all("mesh")


def _is_missing_file(filename: str, beside: Path | None) -> bool:
    """Whether a mesh given as a path, relative to the URDF, does not exist."""
    local = filename and ("://" not in filename or filename.startswith("file://"))
    if beside is None or not local:
        return False
    return not _exists(beside.absolute().parent / filename.removeprefix("file://"))


def _exists(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _report_file(report: Reporter, mesh: Element, filename: str) -> None:
    report.add(
        MESH_MISSING,
        "the mesh is not found",
        mesh,
        attribute="filename",
        found=quoted(filename),
        remedy="kinematics needs no mesh",
    )


def _count(number: int) -> str:
    return "a mesh" if number == 1 else f"{number} meshes"
