"""Check that the packages and files of meshes exist. No mesh is opened."""

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
    """Report each package that is not found once, and each missing file.

    Args:
        report: The reporter, which receives the findings.
        root: The root element of the document.
        beside: The file of the URDF; None if the URDF is text. Then only packages are searched, on the
            search paths of the environment.
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
            f"package {quoted(package)} of {_count(len(meshes))} is not found"
            if package
            else f"the address of {_count(len(meshes))} names no package",
            meshes[0],
            attribute="filename",
            found=quoted(meshes[0].attributes["filename"]),
            remedy="add the package's folder to ROS_PACKAGE_PATH; kinematics needs no mesh",
        )


def check_address(report: Reporter, mesh: Element) -> None:
    """Report a mesh with an address on the network."""
    filename = mesh.attributes["filename"]
    if filename.lower().startswith(("http:", "https:", "ftp:")):
        report.add(
            MESH_REMOTE,
            "the mesh is on the network; it was not downloaded",
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
    """Return whether the address is a path (relative to the URDF) that does not exist."""
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
