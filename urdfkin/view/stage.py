"""Draw a robot in viser's scene, with arrows, the velocity ellipsoid and Denavit-Hartenberg frames.

- A column of the Jacobian is the frame's velocity if one joint velocity is 1 and all others are 0 (7.85).
- For joint velocities of length 1, the frame's velocity vector ends inside an ellipsoid or on the ellipsoid's
  surface. The axes of the ellipsoid are the left singular vectors of the Jacobian, and the
  half-lengths are the singular values.
- The acceleration is the sum of transverse, centripetal, Coriolis and sliding parts (7.125, 7.130).
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from urdfkin.compiled.breakdown import ACCELERATION_KINDS
from urdfkin.dh.table import DHConvention, DHTable
from urdfkin.errors.escape import escape_unprintable
from urdfkin.kinematics.rotation import quaternion_of
from urdfkin.model.tree import FloatArray, KinematicTree
from urdfkin.robot import Robot
from urdfkin.robot.frame_motion import FrameMotion
from urdfkin.view.dh_drawing import row_corners
from urdfkin.view.scene import GREY, Shape, corners, make_mesh, shapes

#: Colours of the acceleration's parts, RGB from 0 to 255.
PART_COLOURS = {
    "transverse": (0, 114, 178),
    "centripetal": (213, 94, 0),
    "coriolis": (0, 158, 115),
    "sliding": (204, 121, 167),
    "sum": (30, 30, 30),
}
LINEAR_COLOUR, ANGULAR_COLOUR = (0, 114, 178), (204, 121, 167)
#: Length of the longest arrow, as a fraction of the robot's size.
_ARROW_FRACTION = 0.3


@dataclass(frozen=True, eq=False)
class Arrows:
    """Arrows in the world: points (n, 2, 3) in metres, and colours (n, 3) from 0 to 255."""

    points: FloatArray
    colours: np.ndarray
    names: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """An ellipsoid in the world: half-lengths and centre (3,) in metres, and a quaternion wxyz."""

    half: FloatArray
    centre: FloatArray
    wxyz: FloatArray


def jacobian_arrows(x: FrameMotion, rates: tuple[str, ...], reach: float, *, angular: bool) -> Arrows:
    """Return an arrow for the linear or angular part of each column of the Jacobian.

    `x` has one sample, in LOCAL_WORLD_ALIGNED. A part with a norm of at most 1e-9 has no arrow.
    """
    rows = slice(3, 6) if angular else slice(0, 3)
    columns = x.jacobian[0, rows].T
    keep = np.linalg.norm(columns, axis=1) > 1e-9
    colour = ANGULAR_COLOUR if angular else LINEAR_COLOUR
    names = tuple(name for name, used in zip(rates, keep, strict=True) if used)
    return _arrows(x, columns[keep], [colour] * int(keep.sum()), names, reach)


def acceleration_arrows(x: FrameMotion, reach: float) -> Arrows:
    """Return an arrow for each of `ACCELERATION_KINDS`, and one for their sum.

    `x` has one sample, in LOCAL_WORLD_ALIGNED. An acceleration of at most 1e-9 m/s^2 has no arrow.
    """
    parts = np.vstack([x.breakdown.by_kind[0, :, :3], x.acceleration[0, :3]])
    keep = np.linalg.norm(parts, axis=1) > 1e-9
    names = tuple(name for name, used in zip((*ACCELERATION_KINDS, "sum"), keep, strict=True) if used)
    return _arrows(x, parts[keep], [PART_COLOURS[name] for name in names], names, reach)


def _arrows(
    x: FrameMotion,
    vectors: FloatArray,
    colours: list[tuple[int, int, int]],
    names: tuple[str, ...],
    reach: float,
) -> Arrows:
    start = np.broadcast_to(x.placement[0, :3, 3], vectors.shape)
    largest = float(np.linalg.norm(vectors, axis=1).max(initial=0.0))
    scale = _ARROW_FRACTION * reach / largest if largest > 0.0 else 0.0
    points = np.stack([start, start + scale * vectors], axis=1)
    return Arrows(points, np.array(colours, dtype=np.uint8).reshape(-1, 3), names)


def velocity_ellipsoid(x: FrameMotion, reach: float, *, angular: bool = False) -> Ellipsoid:
    """Return the ellipsoid of the frame's velocities for joint velocities of norm 1, scaled for the scene.

    `x` has one sample, in LOCAL_WORLD_ALIGNED. `reach` is the robot's size (m). The largest half-length is
    0.3 `reach`, unless the Jacobian is 0.
    """
    J = x.jacobian[0, slice(3, 6) if angular else slice(0, 3)]
    full = np.hstack([J, np.zeros((3, max(0, 3 - J.shape[1])))])
    U, s, _ = np.linalg.svd(full)
    U = U * np.array([1.0, 1.0, np.sign(np.linalg.det(U))])
    largest = float(s[0])
    half = _ARROW_FRACTION * reach * (s / largest if largest > 0.0 else np.zeros(3))
    half = np.maximum(half, 0.002 * reach)  # A small thickness keeps a flat ellipsoid visible.
    return Ellipsoid(half, x.placement[0, :3, 3], quaternions_scalar_first(U))


def quaternions_scalar_first(R: FloatArray) -> FloatArray:
    """Convert rotation matrices (..., 3, 3) to quaternions (..., 4) in viser's order w, x, y, z."""
    return np.asarray(np.roll(quaternion_of(R), 1, axis=-1), dtype=np.float64)


#: Maximum time until a page has its final layout, in seconds.
_LAYOUT_TIME = 15.0
_CAMERA_DIRECTION = np.array([1.1, -1.3, 0.6])
#: Fraction of the view that the robot fills.
_FILLED_FRACTION = 0.85
#: Viser's vertical field of view (rad).
_FOV = np.deg2rad(75.0)


def camera(points: FloatArray, *, aspect: float, fov: float) -> tuple[FloatArray, FloatArray]:
    """Return the position of the camera and the point at which the camera looks, both (3,) in m.

    All `points` (n, 3) are in the picture, with a margin. `fov` is the vertical field of view (rad), and
    `aspect` is width / height.
    """
    middle = 0.5 * (points.max(axis=0) + points.min(axis=0))
    back = _CAMERA_DIRECTION / np.linalg.norm(_CAMERA_DIRECTION)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    height = _FILLED_FRACTION * np.tan(0.5 * fov)
    x, y, z = np.abs((points - middle) @ right), np.abs((points - middle) @ up), (points - middle) @ back
    distance = float(np.max(z + np.maximum(x / (height * aspect), y / height)))
    return middle + max(distance, 0.1) * back, middle


_LINK_COLOUR, _REVOLUTE_COLOUR, _PRISMATIC_COLOUR = (142, 153, 168), (0, 114, 178), (230, 159, 0)
SOLID, SEE_THROUGH = "solid", "see-through"
SHAPE_CHOICES = (SOLID, SEE_THROUGH, "hidden")
NAME_CHOICES = ("none", "links", "joints")
_OPACITY = 0.3
_NORMAL_COLOUR, _OFFSET_COLOUR = (230, 159, 0), (86, 180, 233)


class Stage:
    """A robot in viser's scene.

    `reach` (m) is the robot's size: the diagonal of a box around the link origins in the neutral
    configuration. `missing` lists the meshes that cannot be shown.
    """

    def __init__(self, server: Any, robot: Robot) -> None:
        self._scene, self._server, self.robot = server.scene, server, robot
        tree = robot.tree
        Ts = robot.placement(robot.neutral(), robot.link_frames, verify=False)
        self.reach = float(np.linalg.norm(np.ptp(Ts[:, :3, 3], axis=0))) or 1.0
        self._scene.set_up_direction("+z")
        self._scene.add_grid(
            "/floor", width=3 * self.reach, height=3 * self.reach, cell_size=self.reach / 5,
            position=(0.0, 0.0, min(0.0, float(Ts[:, 2, 3].min()))),
        )  # fmt: skip
        self._links = [self._scene.add_frame(f"/robot/{i}", show_axes=False) for i in range(len(tree.links))]
        self._axes = self._scene.add_batched_axes(
            "/axes",
            batched_wxyzs=quaternions_scalar_first(Ts[:, :3, :3]),
            batched_positions=Ts[:, :3, 3],
            axes_length=0.07 * self.reach,
            axes_radius=0.0015 * self.reach,
            visible=False,
        )
        self._labels = {kind: self._add_names(kind, tree) for kind in NAME_CHOICES[1:]}
        self._skeleton: list[Any] = []
        self._shapes: list[tuple[Shape, Any]] = []
        self._transparent: list[Any] = []
        self._corners: list[tuple[int, FloatArray]] = []
        needs_skeleton = self._add_shapes(tree)
        self._add_skeleton(tree)
        self.show(shapes=SOLID, skeleton=needs_skeleton, axes=False, names=NAME_CHOICES[0])
        self._dh: list[Any] = []
        self.set_initial_camera(Ts[np.newaxis])
        server.on_client_connect(self._set_first_camera)

    def set_initial_camera(self, Ts: FloatArray) -> None:
        """Set the first camera of new pages, so that the robot is visible in n configurations.

        `Ts` (n, links, 4, 4) contains the placements of the links.
        """
        points = [Ts[:, :, :3, 3].reshape(-1, 3)]
        for link, box in self._corners:
            R, p = Ts[:, link, :3, :3], Ts[:, link, np.newaxis, :3, 3]
            points.append((box @ R.swapaxes(-1, -2) + p).reshape(-1, 3))
        self._points_in_view = np.concatenate(points)
        initial = self._server.initial_camera
        initial.position, initial.look_at = camera(self._points_in_view, aspect=1.2, fov=_FOV)

    def _add_shapes(self, tree: KinematicTree) -> bool:
        """Add the visual shapes, and return whether the skeleton must be shown because shapes are missing."""
        self.missing: list[Shape] = []
        for k, shape in enumerate(shapes(self.robot)):
            handle = self._add_shape(f"/robot/{tree.link_index(shape.link)}/shape{k}", shape)
            if handle is None:
                self.missing.append(shape)
            else:
                self._shapes.append((shape, handle))
                self._corners.append((tree.link_index(shape.link), corners(shape)))
        return not self._shapes or bool(self.missing)

    def _add_shape(self, name: str, shape: Shape) -> Any | None:
        if shape.kind == "mesh":
            whole = make_mesh(shape)
            return None if whole is None else self._scene.add_mesh_trimesh(name, whole)
        pose = {
            "wxyz": quaternions_scalar_first(shape.T_link_shape[:3, :3]),
            "position": shape.T_link_shape[:3, 3],
        }
        *rgb, opacity = shape.colour or GREY
        look = {"color": tuple(round(255 * x) for x in rgb), "opacity": None if opacity == 1.0 else opacity}
        if shape.kind == "box":
            return self._scene.add_box(name, dimensions=shape.size, **look, **pose)
        if shape.kind == "sphere":
            return self._scene.add_icosphere(name, radius=shape.size[0], **look, **pose)
        return self._scene.add_cylinder(name, radius=shape.size[0], height=shape.size[1], **look, **pose)

    def _add_skeleton(self, tree: KinematicTree) -> None:
        r, p0 = 0.014 * self.reach, np.zeros(3)

        def add(name: str, axis: FloatArray, radius: float, height: float, color: Any, p: FloatArray) -> None:
            look = {"radius": radius, "height": height, "color": color}
            pose = {"wxyz": quaternions_scalar_first(_rotate_z_to(axis)), "position": p}
            self._skeleton.append(self._scene.add_cylinder(f"/robot/{name}", **look, **pose))

        for i, joint in enumerate(tree.joints):
            p = joint.T_parent_joint[:3, 3]
            if (length := float(np.linalg.norm(p))) > 1e-6 * self.reach:
                add(f"{joint.parent}/bone{i}", p / length, 0.3 * r, length, _LINK_COLOUR, p / 2)
            if joint.kind.turns:
                add(f"{i + 1}/joint{i}", joint.axis, r, 2.2 * r, _REVOLUTE_COLOUR, p0)
            elif joint.kind.has_axis:
                add(f"{i + 1}/joint{i}", joint.axis, 0.6 * r, 3.4 * r, _PRISMATIC_COLOUR, p0)

    def _add_names(self, kind: str, tree: KinematicTree) -> list[Any]:
        joint_names = [joint.name if joint.kind.nv else "" for joint in tree.joints]
        words = tree.links if kind == "links" else ("", *joint_names)
        return [
            self._scene.add_label(
                f"/robot/{i}/{kind}",
                escape_unprintable(word),
                font_screen_scale=0.7,
                anchor="bottom-left",
                visible=False,
            )
            for i, word in enumerate(words)
            if word
        ]

    def _add_transparent_copies(self) -> list[Any]:
        copies = []
        for shape, solid in self._shapes:
            name = f"{solid.name}-transparent"
            if shape.kind != "mesh":
                copies.append(self._add_shape(name, replace(shape, colour=(*GREY[:3], _OPACITY))))
            elif (whole := make_mesh(shape)) is not None:
                look = {"color": tuple(round(255 * x) for x in GREY[:3]), "opacity": _OPACITY}
                copies.append(self._scene.add_mesh_simple(name, whole.vertices, whole.faces, **look))
        return copies

    def reset_cameras(self) -> None:
        for client in self._server.get_clients().values():
            self._set_camera(client)

    def _set_first_camera(self, client: Any) -> None:
        """Set the camera of a new page, and set it again if the panel makes the view narrower."""
        begin, last_aspect = time.monotonic(), 0.0

        def update_camera(_: Any) -> None:
            nonlocal last_aspect
            aspect = client.camera.aspect
            if aspect != last_aspect and time.monotonic() - begin < _LAYOUT_TIME:
                last_aspect = aspect
                self._set_camera(client)

        client.camera.on_update(update_camera)
        update_camera(None)

    def _set_camera(self, client: Any) -> None:
        position, middle = camera(self._points_in_view, aspect=client.camera.aspect, fov=client.camera.fov)
        with client.atomic():
            client.camera.up_direction = (0.0, 0.0, 1.0)
            client.camera.position, client.camera.look_at = position, middle

    def show(self, *, shapes: str, skeleton: bool, axes: bool, names: str) -> None:
        self.skeleton_shown = skeleton
        if shapes == SEE_THROUGH and not self._transparent:
            self._transparent = self._add_transparent_copies()
        for _, handle in self._shapes:
            handle.visible = shapes == SOLID
        for handle in self._transparent:
            handle.visible = shapes == SEE_THROUGH
        for kind, labels in self._labels.items():
            for handle in labels:
                handle.visible = names == kind
        for handle in self._skeleton:
            handle.visible = skeleton
        self._axes.visible = axes

    def move(self, Ts: FloatArray) -> None:
        """Move the links to the placements (links, 4, 4)."""
        wxyzs, positions = quaternions_scalar_first(Ts[:, :3, :3]), Ts[:, :3, 3]
        with self._server.atomic():
            for link, wxyz, position in zip(self._links, wxyzs, positions, strict=True):
                link.wxyz, link.position = wxyz, position
            self._axes.batched_wxyzs, self._axes.batched_positions = wxyzs, positions

    # -- overlays ------------------------------------------------------------------------------------

    def draw_arrows(self, name: str, arrows: Arrows | None) -> None:
        size = 0.008 * self.reach
        visible = arrows is not None and len(arrows.points) > 0
        self._scene.add_arrows(
            f"/{name}",
            points=arrows.points if arrows is not None and visible else np.zeros((1, 2, 3)),
            colors=arrows.colours if arrows is not None and visible else (0, 0, 0),
            shaft_radius=0.4 * size,
            head_radius=size,
            head_length=2.4 * size,
            visible=visible,
        )

    def draw_ellipsoid(self, shape: Ellipsoid | None) -> None:
        self._scene.add_icosphere(
            "/ellipsoid",
            radius=1.0,
            color=(0, 114, 178),
            opacity=0.35,
            scale=(1.0, 1.0, 1.0) if shape is None else tuple(float(x) for x in shape.half),
            wxyz=(1.0, 0.0, 0.0, 0.0) if shape is None else shape.wxyz,
            position=(0.0, 0.0, 0.0) if shape is None else shape.centre,
            visible=shape is not None,
        )

    def draw_table(self, table: DHTable | None, q: FloatArray, T_world_base: FloatArray) -> None:
        for handle in self._dh:
            handle.remove()
        self._dh = []
        if table is None:
            return
        frames = T_world_base @ table.frames(q)
        starts, middles, ends = frames[:-1, :3, 3], row_corners(table, frames), frames[1:, :3, 3]
        standard = table.convention is DHConvention.STANDARD
        first, second = (_OFFSET_COLOUR, _NORMAL_COLOUR) if standard else (_NORMAL_COLOUR, _OFFSET_COLOUR)
        axes = self._scene.add_batched_axes(
            "/dh/frames",
            batched_wxyzs=quaternions_scalar_first(frames[:, :3, :3]),
            batched_positions=frames[:, :3, 3],
            axes_length=0.1 * self.reach,
            axes_radius=0.0035 * self.reach,
        )
        self._dh.append(axes)
        for k, (start, end, colour) in enumerate(((starts, middles, first), (middles, ends, second))):
            if len(start):
                look = {"colors": colour, "thickness": 0.006 * self.reach}
                points = np.stack([start, end], axis=1)
                self._dh.append(self._scene.add_line_segments(f"/dh/lines{k}", points=points, **look))


def _rotate_z_to(axis: FloatArray) -> FloatArray:
    side = np.eye(3)[int(np.abs(axis).argmin())]
    x = np.cross(side, axis)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(axis, x), axis], axis=-1)
