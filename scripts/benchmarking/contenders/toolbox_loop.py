"""The Robotics Toolbox, called in a loop: `jacob0` of the path, and its time derivative from `hessian0`."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
import roboticstoolbox as rtb

from scripts.benchmarking.calls import Calls
from scripts.benchmarking.conventions import positions, spread
from scripts.benchmarking.subject import Subject
from scripts.benchmarking.work import Work

LIBRARY = "roboticstoolbox-python"
_REMARK = "computes the path's columns alone"


def calls(subject: Subject, quantity: str) -> Iterator[Calls]:
    """Rows are [linear; angular]; an acceleration is J a and Jdot v, as `jacob0_dot` does it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the toolbox deprecates its own reader
        robot: Any = rtb.Robot.URDF(str(subject.file))
    path = robot.ets(end=subject.frame)
    moving = sorted((link for link in robot.links if link.jindex is not None), key=lambda x: x.jindex)
    order = positions(subject.robot.joint_names, [link._joint_name for link in moving])
    columns = [int(i) for i in path.jindices]
    names = {"path": path, "tensordot": np.tensordot, "columns": np.array(columns)}
    if quantity == "jacobian":
        ours = [order[i] for i in columns]
        yield Calls(
            "Robotics Toolbox, loop",
            names,
            ("path.jacob0(q)",),
            order=order,
            shape=(6, len(columns)),
            read=lambda J: spread(J, ours, subject.nv),
            remark=_REMARK,
        )
        return
    lines = (
        "J = path.jacob0(q)",
        "v = v[columns]",
        "J @ a[columns] + tensordot(path.hessian0(q, J0=J), v, (0, 0)) @ v",
    )
    yield Calls("Robotics Toolbox, loop", names, lines, order=order, remark=_REMARK)


def batches(subject: Subject, quantity: str) -> Iterator[Work]:
    """One configuration after the other."""
    for one in calls(subject, quantity):
        yield one.batch(subject, quantity)
