"""Which of Pinocchio's frames a name means, from the names and kinds in Pinocchio's own model.

`KinematicTree.frame_link` answers the same question from urdfkin's reading. The two share no code: a name
that the one takes for another frame's is found by the comparison of the numbers.
"""

from __future__ import annotations

import re
from typing import Any

from urdfkin.errors import OracleError
from urdfkin.model.frame_names import JointFrame, LinkFrame

#: Pinocchio's name of the world, which is what a root joint hangs from.
WORLD = "universe"
_PREFIXED = re.compile(r"(link|joint):(.*)", re.DOTALL)


class Frames:
    """Pinocchio's frames by name.

    Args:
        model: Pinocchio's model, as its parser made it.
        pin: The module.
        stands_on_world: Whether the robot hangs from a root joint: then the world is a link of it.
    """

    def __init__(self, model: Any, pin: Any, *, stands_on_world: bool) -> None:
        self._robot = str(model.name)
        self._bodies, self._joints = dict[str, int](), dict[str, int]()
        self._parents = [int(frame.parentFrame) for frame in model.frames]
        for index, frame in enumerate(model.frames):
            if index:  # the first is the world
                names = self._bodies if frame.type == pin.FrameType.BODY else self._joints
                names[frame.name] = index
        if stands_on_world:
            self._bodies[WORLD] = 0

    def index(self, name: str) -> int:
        """The frame that a name stands for, in the model as it was given.

        Raises:
            OracleError: nothing is called so, or a body and a joint in another place both are.
        """
        if isinstance(name, LinkFrame):
            return self._known(self._bodies, name, str(name)[5:])
        if isinstance(name, JointFrame):
            return self._known(self._joints, name, str(name)[6:])
        body, joint = self._bodies.get(name), self._joints.get(name)
        if body is not None and joint is not None and self._parents[body] != joint:
            raise self._error("two of Pinocchio's frames have this name", name)
        if body is not None:
            return body
        if joint is not None:
            return joint
        if (parts := _PREFIXED.fullmatch(name)) is None:
            raise self._error("Pinocchio has no such frame", name)
        return self._known(self._bodies if parts[1] == "link" else self._joints, name, parts[2])

    def _known(self, names: dict[str, int], asked: str, own: str) -> int:
        if (index := names.get(own)) is None:
            raise self._error("Pinocchio has no such frame", asked)
        return index

    def _error(self, what: str, name: str) -> OracleError:
        return OracleError(what, where=self._robot, found=repr(str(name)))
