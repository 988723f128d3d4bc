"""The viewer reads shapes from the URDF, finds mesh files, and draws ellipsoids and arrows to scale."""

from pathlib import Path

import numpy as np
import pytest

import urdfkin
from urdfkin.kinematics.rotation import rotation_from_quaternion, rotation_from_rpy
from urdfkin.robot.frame_motion import FrameMotion, frame_motion
from urdfkin.view.scene import make_mesh, mesh_file, shapes
from urdfkin.view.stage import acceleration_arrows, jacobian_arrows, velocity_ellipsoid
from urdfkin.view.viewer import describe_motion

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


def test_shapes_have_size_placement_and_colour_and_a_broken_mesh_is_omitted(tmp_path: Path) -> None:
    box, cylinder, sphere, missing = shapes(urdfkin.load(URDF))
    assert (box.kind, box.size, box.colour) == ("box", (1.0, 2.0, 3.0), (0.0, 0.0, 1.0, 0.5))
    np.testing.assert_array_equal(box.T_link_shape[:3, :3], rotation_from_rpy((0.1, 0.2, 0.3)))
    np.testing.assert_array_equal(box.T_link_shape[:3, 3], [1, 2, 3])
    assert (cylinder.kind, cylinder.size, cylinder.colour) == ("cylinder", (0.5, 2.0), None)
    assert (sphere.kind, sphere.size, sphere.colour) == ("sphere", (0.25,), (1.0, 0.0, 0.0, 1.0))
    assert missing.is_missing
    assert make_mesh(missing) is None
    (tmp_path / "x.stl").write_text("solid nothing\nfacet what")
    path = tmp_path / "r.urdf"
    path.write_text(URDF.replace("package://nowhere/x.stl", "x.stl"))
    *_, broken = shapes(urdfkin.load(path))
    assert not broken.is_missing
    assert make_mesh(broken) is None


def test_meshes_are_found_by_package_address_file_address_and_relative_path(tmp_path: Path) -> None:
    file = tmp_path / "robots" / "meshes" / "a b.stl"
    file.parent.mkdir(parents=True)
    file.write_text("solid")
    urdf = tmp_path / "robots" / "urdf" / "r.urdf"
    urdf.parent.mkdir()
    packaged = "package://robots/meshes/a b.stl", "package:///robots/meshes/a b.stl"
    for address in (*packaged, "../meshes/a b.stl", file.as_uri()):
        found = mesh_file(address, urdf)
        assert found is not None, address
        assert found.samefile(file)
    for address in ("", "package://robots/none.stl", "http://robots/meshes/a.stl", "a\0b"):
        assert mesh_file(address, urdf) is None


@pytest.mark.parametrize("name", ["panda", "ur5", "talos"])
def test_every_mesh_of_a_catalogue_robot_is_found(name: str) -> None:
    found = shapes(urdfkin.load(name))
    assert len(found) > 5
    assert [shape for shape in found if shape.is_missing] == []


@pytest.fixture(scope="module")
def x() -> FrameMotion:
    robot = urdfkin.load("panda")
    rng = np.random.default_rng(0)
    v, a = rng.standard_normal((2, 1, robot.nv))
    return frame_motion(robot, (robot.sample(1, 3), v, a), robot.tip_frame)


@pytest.mark.parametrize("angular", [False, True])
def test_velocities_of_unit_joint_velocities_lie_inside_the_ellipsoid_and_reach_the_surface(
    angular: bool, x: FrameMotion
) -> None:
    shape = velocity_ellipsoid(x, 1.0, angular=angular)
    R = rotation_from_quaternion(np.roll(shape.wxyz, -1))
    J = x.jacobian[0, slice(3, 6) if angular else slice(0, 3)]
    rates = np.random.default_rng(1).standard_normal((2000, J.shape[1]))
    rates /= np.linalg.norm(rates, axis=1, keepdims=True)
    scale = 0.3 / np.linalg.svd(J, compute_uv=False)[0]
    inside = np.linalg.norm((scale * rates @ J.T @ R) / shape.half, axis=1)
    assert inside.max() <= 1.0 + 1e-12
    # Rates along the right singular vectors reach the ends of the axes.
    Vh = np.linalg.svd(J)[2]
    tips = np.linalg.norm((scale * Vh[:3] @ J.T @ R) / shape.half, axis=1)
    np.testing.assert_allclose(tips, 1.0, rtol=1e-12)


def test_a_flat_ellipsoid_is_visible_and_the_text_contains_the_results(x: FrameMotion) -> None:
    robot = urdfkin.load("ur5")
    zero = np.zeros((1, 6))
    shape = velocity_ellipsoid(frame_motion(robot, (zero, zero, zero), "base_link"), 2.0)
    np.testing.assert_array_equal(shape.half, 0.004)
    words = describe_motion(x)
    assert "**✓ verified** by Pinocchio" in words
    assert f"{x.placement[0, 0, 3]:.4g}" in words


def test_arrows_show_jacobian_columns_and_acceleration_parts_at_one_scale(x: FrameMotion) -> None:
    rates = urdfkin.load("panda").velocity_names
    arrows = jacobian_arrows(x, rates, 1.0, angular=False)
    vectors = arrows.points[:, 1] - arrows.points[:, 0]
    columns = x.jacobian[0, :3].T[[rates.index(name) for name in arrows.names]]
    ratio = vectors / np.where(columns == 0.0, np.inf, columns)
    np.testing.assert_allclose(ratio[ratio != 0.0], ratio.max(), rtol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1).max(), 0.3)
    parts = acceleration_arrows(x, 1.0)
    assert parts.names[-1] == "sum"
    ends = parts.points[:, 1] - parts.points[:, 0]
    np.testing.assert_allclose(ends[:-1].sum(axis=0), ends[-1], atol=1e-12)
