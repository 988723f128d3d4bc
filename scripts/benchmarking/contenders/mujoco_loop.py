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
    back = np.argsort(order)
    names = {
        **{name: getattr(mujoco, f"mj_{name}") for name in ("kinematics", "comPos", "comVel", "jacBody")},
        **{"rne": mujoco.mj_rnePostConstraint, "get": mujoco.mj_objectAcceleration},
        **{"m": model, "d": data, "qpos": data.qpos, "qvel": data.qvel, "qacc": data.qacc},
        **{"body": model.body(subject.frame).id, "kind": mujoco.mjtObj.mjOBJ_XBODY},
        "x": np.empty(subject.width(quantity)),
    }
    place = ("qpos[:] = q", "kinematics(m, d)", "comPos(m, d)")
    if quantity == "jacobian":
        names |= {"linear": names["x"][:3], "angular": names["x"][3:]}
        lines = (*place, "jacBody(m, d, linear, angular, body)", "x")
        store = (*place, "jacBody(m, d, out[k, :3], out[k, 3:], body)")
        read = {"read": lambda J: J[..., back]}
    else:
        move = (*place, "qvel[:] = v", "qacc[:] = a", "comVel(m, d)", "rne(m, d)")
        lines = (*move, "get(m, d, kind, body, x, 0)", "x")
        store = (*move, "get(m, d, kind, body, out[k], 0)")
        read = {"read": lambda x: x[..., LINEAR_FIRST]}
    yield Calls("MuJoCo, loop", names, lines, store, order, read_one=np.array, **read)


def batches(subject: Subject, quantity: str) -> Iterator[Work]:
    """One configuration after the other."""
    for one in calls(subject, quantity):
        yield one.batch(subject, quantity)
