"""3D view of a robot in a notebook cell, in a frame without network access."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from urdfkin.errors.escape import log_line
from urdfkin.report.figures import scene
from urdfkin.report.html import as_is, asset, rendered
from urdfkin.report.reading import moving_names
from urdfkin.validation.robot_summary import describe

if TYPE_CHECKING:
    from urdfkin.model.tree import FloatArray
    from urdfkin.robot import Robot


class NotebookView:
    """The 3D view of `Robot.view` in a notebook: `q` (nq,) is the first configuration, `height` is in px."""

    def __init__(self, robot: Robot, q: FloatArray, height: int) -> None:
        self._name, self._height = robot.name, height
        self._description, self._q = describe(robot), q.tolist()

    def __repr__(self) -> str:
        return log_line(f"<a view of {self._name}, which is displayed as the last line of a notebook cell>")

    def page(self) -> str:
        data: dict[str, Any] = {"source": self._name, "joints": moving_names(self._description), "chains": []}
        return rendered(
            "cell.html.j2",
            data=data,
            robot={"index": 0, "scene": scene(self._description, []) | {"start": self._q}},
            three=as_is(asset("three.min.js")),
            view_script=as_is(asset("view3d.js")),
        )

    def _repr_html_(self) -> str:
        # The HTML frame may run its own scripts but cannot access the notebook.
        return (
            f'<iframe sandbox="allow-scripts" title="{escape(self._name)}" srcdoc="{escape(self.page())}"'
            f' style="width:100%;height:{self._height}px;border:0"></iframe>'
        )
