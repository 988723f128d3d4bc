"""What is drawn over a robot: joint velocities, the ellipsoid of velocity, the acceleration's parts.

The columns of the Jacobian are the frame's velocities for unit rates (7.85); joint rates of length one fill
an ellipsoid whose axes are the left singular vectors, its half-lengths the singular values; the acceleration
is the sum of its transverse, centripetal, Coriolis and sliding parts (7.125, 7.130).


The border to viser: a robot's picture, which is told where things are and draws them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from urdfkin.compiled.breakdown import KINDS
from urdfkin.dh.table import DHTable
from urdfkin.errors.escape import printable
from urdfkin.kinematics.rotation import quaternion_of
from urdfkin.model.tree import FloatArray, KinematicTree
from urdfkin.motion.frame_motion import FrameMotion
from urdfkin.robot import Robot
from urdfkin.view.scene import GREY, Shape, mesh, shapes

#: The colour of each part of the acceleration, 0 to 255, and of their sum.
PART_COLOURS = {
    "transverse": (0, 114, 178),
    "centripetal": (213, 94, 0),
    "coriolis": (0, 158, 115),
    "sliding": (204, 121, 167),
    "sum": (30, 30, 30),
}
LINEAR, ANGULAR = (0, 114, 178), (204, 121, 167)
#: The largest arrow is this part of the robot's reach.
_SHARE = 0.3


@dataclass(frozen=True, eq=False)
class Arrows:
    """Arrows in the world.

    Attributes:
        points: (n, 2, 3) from and to, metres.
        colours: (n, 3) 0 to 255.
        names: One for each.
    """

    points: FloatArray
    colours: np.ndarray
    names: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """Half-lengths (3,) in metres as drawn, centre (3,), orientation (4,) scalar first."""

    half: FloatArray
    centre: FloatArray
    wxyz: FloatArray


def jacobian_arrows(x: FrameMotion, rates: tuple[str, ...], reach: float, *, angular: bool) -> Arrows:
    """The frame's velocity for a unit rate of each joint alone, in world axes, from the frame's origin.

    Args:
        x: A motion of one sample in LOCAL_WORLD_ALIGNED.
        rates: A name for each column.
        reach: The robot's size, for the arrows' scale.
        angular: Angular velocities instead of linear ones.
    """
    rows = slice(3, 6) if angular else slice(0, 3)
    columns = x.jacobian[0, rows].T
    keep = np.linalg.norm(columns, axis=1) > 1e-9
    colour = ANGULAR if angular else LINEAR
    names = tuple(name for name, kept in zip(rates, keep, strict=True) if kept)
    return _arrows(x, columns[keep], [colour] * int(keep.sum()), names, reach)


def acceleration_arrows(x: FrameMotion, reach: float) -> Arrows:
    """The parts of the frame's linear acceleration and their sum, in world axes, from the frame's origin."""
    parts = np.vstack([x.parts.by_kind[0, :, :3], x.acceleration[0, :3]])
    keep = np.linalg.norm(parts, axis=1) > 1e-9
    names = tuple(name for name, kept in zip((*KINDS, "sum"), keep, strict=True) if kept)
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
    scale = _SHARE * reach / largest if largest > 0.0 else 0.0
    points = np.stack([start, start + scale * vectors], axis=1)
    return Arrows(points, np.array(colours, dtype=np.uint8).reshape(-1, 3), names)


def velocity_ellipsoid(x: FrameMotion, reach: float, *, angular: bool = False) -> Ellipsoid:
    """Where the frame's velocity can point for joint rates of length one.

    A direction that no joint moves is drawn as thin as can be seen.

    Args:
        x: A motion of one sample in LOCAL_WORLD_ALIGNED.
        reach: The robot's size, for the scale.
        angular: Of the angular velocity.
    """
    J = x.jacobian[0, slice(3, 6) if angular else slice(0, 3)]
    full = np.hstack([J, np.zeros((3, max(0, 3 - J.shape[1])))])
    U, s, _ = np.linalg.svd(full)
    U = U * np.array([1.0, 1.0, np.sign(np.linalg.det(U))])
    largest = float(s[0])
    half = _SHARE * reach * (s / largest if largest > 0.0 else np.zeros(3))
    half = np.maximum(half, 0.002 * reach)
    return Ellipsoid(half, x.placement[0, :3, 3], scalar_first(U))


def scalar_first(R: FloatArray) -> FloatArray:
    """(..., 4) quaternions (w, x, y, z), as viewers want them."""
    return np.asarray(np.roll(quaternion_of(R), 1, axis=-1), dtype=np.float64)


_BONE, _TURN, _SLIDE = (142, 153, 168), (47, 111, 208), (208, 122, 28)
#: How the shapes can be seen, and which names stand beside the frames.
SOLID, SEE_THROUGH = "solid", "see-through"
SHAPES = (SOLID, SEE_THROUGH, "hidden")
NAMES = ("none", "links", "joints")
#: How much of what lies behind a shape that is seen through it hides.
_THIN = 0.3
_NORMAL, _OFFSET = (194, 52, 139), (22, 128, 138)


class Stage:
    """A robot in viser's scene: links as frames, shapes or a skeleton below them, overlays beside them.

    Attributes:
        missing: Meshes that could not be shown.
        reach: The robot's size in metres.
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
        self._middle = 0.5 * (Ts[:, :3, 3].max(axis=0) + Ts[:, :3, 3].min(axis=0))
        self._camera = self._middle + self.reach * np.array([1.1, -1.3, 0.6])
        server.initial_camera.position, server.initial_camera.look_at = self._camera, self._middle
        server.on_client_connect(self._look)
        self._links = [self._scene.add_frame(f"/robot/{i}", show_axes=False) for i in range(len(tree.links))]
        self._axes = self._scene.add_batched_axes(
            "/axes",
            batched_wxyzs=scalar_first(Ts[:, :3, :3]),
            batched_positions=Ts[:, :3, 3],
            axes_length=0.07 * self.reach,
            axes_radius=0.0015 * self.reach,
            visible=False,
        )
        self._labels = {kind: self._add_names(kind, tree) for kind in NAMES[1:]}
        self._skeleton: list[Any] = []
        self._shapes: list[tuple[Shape, Any]] = []
        self._ghosts: list[Any] = []
        bare = self._add_shapes(tree)
        self._add_skeleton(tree, Ts)
        self.show(shapes=SOLID, skeleton=bare, axes=False, names=NAMES[0])
        self._dh: list[Any] = []

    def _add_shapes(self, tree: KinematicTree) -> bool:
        """Returns whether so little can be shown that the skeleton is wanted."""
        self.missing: list[Shape] = []
        for k, shape in enumerate(shapes(self.robot)):
            handle = self._add_shape(f"/robot/{tree.link_index(shape.link)}/shape{k}", shape)
            if handle is None:
                self.missing.append(shape)
            else:
                self._shapes.append((shape, handle))
        return not self._shapes or bool(self.missing)

    def _add_shape(self, name: str, shape: Shape) -> Any | None:
        if shape.kind == "mesh":
            whole = mesh(shape)
            return None if whole is None else self._scene.add_mesh_trimesh(name, whole)
        place = {"wxyz": scalar_first(shape.T_link_shape[:3, :3]), "position": shape.T_link_shape[:3, 3]}
        *rgb, opacity = shape.colour or GREY
        look = {"color": tuple(round(255 * x) for x in rgb), "opacity": None if opacity == 1.0 else opacity}
        if shape.kind == "box":
            return self._scene.add_box(name, dimensions=shape.size, **look, **place)
        if shape.kind == "sphere":
            return self._scene.add_icosphere(name, radius=shape.size[0], **look, **place)
        return self._scene.add_cylinder(name, radius=shape.size[0], height=shape.size[1], **look, **place)

    def _add_skeleton(self, tree: KinematicTree, Ts: FloatArray) -> None:
        r = 0.014 * self.reach
        for i, joint in enumerate(tree.joints):
            p = joint.T_parent_joint[:3, 3]
            if (length := float(np.linalg.norm(p))) > 1e-6 * self.reach:
                R = _towards(p / length)
                self._skeleton.append(
                    self._scene.add_cylinder(
                        f"/robot/{joint.parent}/bone{i}",
                        radius=0.3 * r,
                        height=length,
                        color=_BONE,
                        wxyz=scalar_first(R),
                        position=p / 2,
                    )
                )
            if joint.kind.has_axis:
                self._skeleton.append(
                    self._scene.add_cylinder(
                        f"/robot/{i + 1}/joint{i}",
                        radius=r if joint.kind.turns else 0.6 * r,
                        height=2.2 * r if joint.kind.turns else 3.4 * r,
                        color=_TURN if joint.kind.turns else _SLIDE,
                        wxyz=scalar_first(_towards(joint.axis)),
                    )
                )

    def _add_names(self, kind: str, tree: KinematicTree) -> list[Any]:
        """Names of links, or of the joints that move, each where its frame is."""
        of_joints = [joint.name if joint.kind.nv else "" for joint in tree.joints]
        words = tree.links if kind == "links" else ("", *of_joints)
        return [
            self._scene.add_label(
                f"/robot/{i}/{kind}",
                printable(word),
                font_screen_scale=0.7,
                anchor="bottom-left",
                visible=False,
            )
            for i, word in enumerate(words)
            if word
        ]

    def _add_ghosts(self) -> list[Any]:
        """The shapes once more, to be seen through: made when somebody first asks for them."""
        ghosts = []
        for shape, solid in self._shapes:
            name = f"{solid.name}-ghost"
            if shape.kind != "mesh":
                ghosts.append(self._add_shape(name, replace(shape, colour=(*GREY[:3], _THIN))))
            elif (whole := mesh(shape)) is not None:
                look = {"color": tuple(round(255 * x) for x in GREY[:3]), "opacity": _THIN}
                ghosts.append(self._scene.add_mesh_simple(name, whole.vertices, whole.faces, **look))
        return ghosts

    def look(self) -> None:
        """Everybody looks from where they began."""
        for client in self._server.get_clients().values():
            self._look(client)

    def _look(self, client: Any) -> None:
        """Past the panel, which covers the lower half of a telephone."""
        down = np.zeros(3)
        if client.camera.aspect < 1.0:
            down[2] = -0.35 * float(np.linalg.norm(self._camera - self._middle))
        with client.atomic():
            client.camera.up_direction = (0.0, 0.0, 1.0)
            client.camera.position, client.camera.look_at = self._camera + down, self._middle + down

    def show(self, *, shapes: str, skeleton: bool, axes: bool, names: str) -> None:
        """Which parts are seen: `shapes` is one of `SHAPES`, `names` one of `NAMES`."""
        self.skeleton_shown = skeleton
        if shapes == SEE_THROUGH and not self._ghosts:
            self._ghosts = self._add_ghosts()
        for _, handle in self._shapes:
            handle.visible = shapes == SOLID
        for handle in self._ghosts:
            handle.visible = shapes == SEE_THROUGH
        for kind, labels in self._labels.items():
            for handle in labels:
                handle.visible = names == kind
        for handle in self._skeleton:
            handle.visible = skeleton
        self._axes.visible = axes

    def move(self, Ts: FloatArray) -> None:
        """Put every link where (links, 4, 4) says."""
        wxyzs, positions = scalar_first(Ts[:, :3, :3]), Ts[:, :3, 3]
        with self._server.atomic():
            for link, wxyz, position in zip(self._links, wxyzs, positions, strict=True):
                link.wxyz, link.position = wxyz, position
            self._axes.batched_wxyzs, self._axes.batched_positions = wxyzs, positions

    # -- overlays ------------------------------------------------------------------------------------

    def arrows(self, name: str, arrows: Arrows | None) -> None:
        """Draw arrows in place of what had the same name; None draws none."""
        size = 0.008 * self.reach
        none = arrows is None or not len(arrows.points)
        self._scene.add_arrows(
            f"/{name}",
            points=np.zeros((1, 2, 3)) if arrows is None or none else arrows.points,
            colors=(0, 0, 0) if arrows is None or none else arrows.colours,
            shaft_radius=0.4 * size,
            head_radius=size,
            head_length=2.4 * size,
            visible=not none,
        )

    def ellipsoid(self, shape: Ellipsoid | None) -> None:
        """Draw the ellipsoid of velocity; None draws none."""
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

    def table(self, table: DHTable | None, q: FloatArray, T_world_base: FloatArray) -> None:
        """Draw a table's frames, offsets d and common normals a at its own coordinates; None draws none."""
        for handle in self._dh:
            handle.remove()
        self._dh = []
        if table is None:
            return
        frames = T_world_base @ table.frames(q)
        starts, corners, ends = _segments(table, q, frames)
        parts = ((starts, corners, _OFFSET), (corners, ends, _NORMAL))
        if str(table.convention) == "modified":
            parts = ((starts, corners, _NORMAL), (corners, ends, _OFFSET))
        self._dh.append(
            self._scene.add_batched_axes(
                "/dh/frames",
                batched_wxyzs=scalar_first(frames[:, :3, :3]),
                batched_positions=frames[:, :3, 3],
                axes_length=0.1 * self.reach,
                axes_radius=0.0035 * self.reach,
            )
        )
        for k, (start, end, colour) in enumerate(parts):
            if len(start):
                self._dh.append(
                    self._scene.add_line_segments(
                        f"/dh/lines{k}",
                        points=np.stack([start, end], axis=1),
                        colors=colour,
                        thickness=0.006 * self.reach,
                    )
                )


def _segments(table: DHTable, q: FloatArray, frames: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(rows, 3) each: where a row's frame begins, turns from its first axis to its second, and ends."""
    starts, ends = frames[:-1, :3, 3], frames[1:, :3, 3]
    if str(table.convention) == "standard":
        # d along the old z, then a along the new x.
        a = np.array([row.a for row in table.rows]).reshape(-1, 1)
        return starts, ends - a * frames[1:, :3, 0], ends
    a = np.array([row.a for row in table.rows]).reshape(-1, 1)
    return starts, starts + a * frames[:-1, :3, 0], ends


def _towards(axis: FloatArray) -> FloatArray:
    """(3, 3) a rotation whose z is `axis`."""
    side = np.eye(3)[int(np.abs(axis).argmin())]
    x = np.cross(side, axis)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(axis, x), axis], axis=-1)
