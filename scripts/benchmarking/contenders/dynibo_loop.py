"""dynibo (Rust), called in a loop: `jacobian(out=)` and `forward_acceleration_kinematics`."""

from __future__ import annotations

from collections.abc import Iterator

import dynibo
import numpy as np

from scripts.benchmarking.calls import Calls
from scripts.benchmarking.conventions import LINEAR_FIRST, breadth_first, positions
from scripts.benchmarking.subject import Subject
from scripts.benchmarking.work import Work
from urdfkin.tree import FloatArray

LIBRARY = "dynibo"


def calls(subject: Subject, quantity: str) -> Iterator[Calls]:
    """Rows come as [angular; linear], joints breadth first, a matrix column by column."""
    robot = dynibo.Robot.from_urdf(str(subject.file))
    nv, order = subject.nv, positions(subject.robot.joint_names, breadth_first(subject.urdf))
    back = np.argsort(order)

    def read(flat: FloatArray) -> FloatArray:
        return flat.reshape(-1, nv, 6).transpose(0, 2, 1)[:, LINEAR_FIRST][..., back]

    names = {"robot": robot, "frame": robot.link_id(subject.frame), "buffer": np.empty(6 * nv)}
    if quantity == "jacobian":
        lines = ("robot.jacobian(q, frame, out=buffer)",)
        into = ("robot.jacobian(q, frame, out=out[k])",)
        yield Calls("dynibo, loop", names, lines, into, order, (6 * nv,), read)
        return
    line = "robot.forward_acceleration_kinematics(q, v, a, frame)"
    store = (f"x = {line}", "out[k, :3] = x.linear", "out[k, 3:] = x.angular")
    yield Calls(
        "dynibo, loop",
        names,
        (line,),
        store,
        order,
        read_one=lambda x: np.array([*x.linear, *x.angular]),
    )


def batches(subject: Subject, quantity: str) -> Iterator[Work]:
    """One configuration after the other."""
    for one in calls(subject, quantity):
        yield one.batch(subject, quantity)
