"""MuJoCo, called in a loop: `mj_jacBody`, and `mj_objectAcceleration` without gravity."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from scripts.benchmarking.bare import bare_urdf
from scripts.benchmarking.calls import Calls
from scripts.benchmarking.conventions import LINEAR_FIRST, positions
from scripts.benchmarking.subject import Subject
from scripts.benchmarking.work import Work

LIBRARY = "mujoco"


def calls(subject: Subject, quantity: str) -> Iterator[Calls]:
    """Links that are welded on keep their names; accelerations come as [angular; linear], classical."""
    flags = {"fusestatic": "false", "discardvisual": "true"}
    model = mujoco.MjModel.from_xml_string(bare_urdf(subject.urdf, flags=flags))
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    theirs = [model.joint(i).name for i in range(model.njnt)]
    order = positions(subject.robot.joint_names, theirs)
    x = np.empty(subject.width(quantity))
    names = {
        **{name: getattr(mujoco, f"mj_{name}") for name in ("kinematics", "comPos", "comVel", "jacBody")},
        **{"rne": mujoco.mj_rnePostConstraint, "get": mujoco.mj_objectAcceleration},
        **{"m": model, "d": data, "qpos": data.qpos, "qvel": data.qvel, "qacc": data.qacc},
        **{"body": model.body(subject.frame).id, "kind": mujoco.mjtObj.mjOBJ_XBODY},
        **{"x": x, "linear": x[:3], "angular": x[3:]},
    }
    back = np.argsort(order)
    yield Calls(
        "MuJoCo, loop",
        names,
        _lines(quantity, "linear, angular", "x"),
        _lines(quantity, "out[k, :3], out[k, 3:]", "out[k]")[:-1],
        order,
        read=lambda x: x[..., back] if quantity == "jacobian" else x[..., LINEAR_FIRST],
    )


def _lines(quantity: str, rows: str, result: str) -> tuple[str, ...]:
    """The calls for one configuration, which write into arrays; the last line is the result."""
    place = ("qpos[:] = q", "kinematics(m, d)", "comPos(m, d)")
    if quantity == "jacobian":
        return (*place, f"jacBody(m, d, {rows}, body)", result)
    return (
        *place,
        "qvel[:] = v",
        "qacc[:] = a",
        "comVel(m, d)",
        "rne(m, d)",
        f"get(m, d, kind, body, {result}, 0)",
        result,
    )


def batches(subject: Subject, quantity: str) -> Iterator[Work]:
    """One configuration after the other."""
    for one in calls(subject, quantity):
        yield one.batch(subject, quantity)
