"""Looks are read from the URDF as it stands, files are found where the documented search says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import urdfkin
from urdfkin.kinematics.rotation import rotation_from_rpy
from urdfkin.view.scene import mesh, mesh_file, shapes

URDF = """<robot name="r">
  <material name="blue"><color rgba="0 0 1 0.5"/></material>
  <link name="a">
    <visual><origin xyz="1 2 3" rpy="0.1 0.2 0.3"/><geometry><box size="1 2 3"/></geometry>
      <material name="blue"/></visual>
    <visual><geometry><cylinder radius="0.5" length="2"/></geometry></visual>
    <visual><geometry><sphere radius="0.25"/></geometry>
      <material name="own"><color rgba="1 0 0 1"/></material></visual>
    <visual><geometry><mesh filename="package://nowhere/x.stl"/></geometry></visual>
  </link>
</robot>"""


def test_primitives_come_with_size_place_and_colour() -> None:
    box, cylinder, sphere, missing = shapes(urdfkin.load(URDF))
    assert (box.kind, box.size, box.colour) == ("box", (1.0, 2.0, 3.0), (0.0, 0.0, 1.0, 0.5))
    np.testing.assert_array_equal(box.T_link_shape[:3, :3], rotation_from_rpy((0.1, 0.2, 0.3)))
    np.testing.assert_array_equal(box.T_link_shape[:3, 3], [1, 2, 3])
    assert (cylinder.kind, cylinder.size, cylinder.colour) == ("cylinder", (0.5, 2.0), None)
    assert (sphere.kind, sphere.size, sphere.colour) == ("sphere", (0.25,), (1.0, 0.0, 0.0, 1.0))
    assert missing.missing
    assert mesh(missing) is None


def test_meshes_are_found_by_package_by_file_and_beside_the_urdf(tmp_path: Path) -> None:
    file = tmp_path / "robots" / "meshes" / "a b.stl"
    file.parent.mkdir(parents=True)
    file.write_text("solid")
    urdf = tmp_path / "robots" / "urdf" / "r.urdf"
    urdf.parent.mkdir()
    for address in (
        "package://robots/meshes/a b.stl",
        "package:///robots/meshes/a b.stl",
        "../meshes/a b.stl",
        file.as_uri(),
    ):
        found = mesh_file(address, urdf)
        assert found is not None, address
        assert found.samefile(file)
    for address in ("", "package://robots/none.stl", "http://robots/meshes/a.stl", "a\0b"):
        assert mesh_file(address, urdf) is None


@pytest.mark.parametrize("name", ["panda", "ur5", "talos"])
def test_every_mesh_of_the_catalogues_robots_is_found(name: str) -> None:
    found = shapes(urdfkin.load(name))
    assert len(found) > 5
    assert [shape for shape in found if shape.missing] == []


def test_a_broken_mesh_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "x.stl").write_text("solid nothing\nfacet what")
    path = tmp_path / "r.urdf"
    path.write_text(URDF.replace("package://nowhere/x.stl", "x.stl"))
    *_, broken = shapes(urdfkin.load(path))
    assert not broken.missing
    assert mesh(broken) is None
