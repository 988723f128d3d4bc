"""The pages on the Hessian and on accelerations run, print what they say, and say of others what is so."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import urdfkin
from tests.test_tour import BLOCK, tidy
from urdfkin.model.tree import FloatArray

DOCS = Path(__file__).parents[1] / "docs"
PAGE = (DOCS / "accelerations.md").read_text(encoding="utf-8")
Q, V, A = np.array([np.pi / 2.0, 0.5]), np.array([2.0, 0.3]), np.zeros(2)


@pytest.mark.parametrize("page", ["hessian", "accelerations"])
def test_every_block_prints_what_stands_below_it(page: str) -> None:
    blocks = BLOCK.findall((DOCS / f"{page}.md").read_text(encoding="utf-8"))
    kinds = [kind for kind, _ in blocks]
    assert kinds == ["python", "text"] * (len(blocks) // 2)
    namespace: dict[str, Any] = {}
    for (_, code), (_, shown) in zip(blocks[::2], blocks[1::2], strict=True):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, page, "exec"), namespace)
        assert tidy(printed.getvalue()) == tidy(shown)


def rows(library: str) -> list[tuple[str, FloatArray]]:
    """What the table says of a library: the call and the bead's numbers."""
    found, owner = [], ""
    for line in PAGE.splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) == 4:
            owner = cells[0] or owner
            numbers = re.findall(r"-?\d+(?:\.\d+)?", cells[2])
            if owner.startswith(library) and len(numbers) == 3:
                found.append((cells[1], np.array(numbers, dtype=float)))
    return found


def wheel() -> str:
    text = re.search(r'"""(<robot.*?</robot>)"""', PAGE, re.DOTALL)
    assert text is not None
    return text[1]


def test_what_the_page_says_of_pinocchio_is_so() -> None:
    model = pin.buildModelFromXML(wheel(), mimic=False)
    q = urdfkin.load(wheel()).to_pinocchio(Q)
    data, frame, aligned = model.createData(), model.getFrameId("bead"), pin.LOCAL_WORLD_ALIGNED
    pin.forwardKinematics(model, data, q, V, A)
    pin.computeJointJacobiansTimeVariation(model, data, q, V)
    rates = [pin.getFrameJacobianTimeVariation(model, data, frame, r) @ V for r in (aligned, pin.WORLD)]
    asked = [
        pin.getFrameClassicalAcceleration(model, data, frame, aligned).linear,
        pin.getFrameAcceleration(model, data, frame, aligned).linear,
        *(rate[:3] for rate in rates),
    ]
    said = rows("Pinocchio")
    assert len(said) == len(asked)
    for (call, numbers), theirs in zip(said, asked, strict=True):
        np.testing.assert_allclose(theirs, numbers, atol=1e-12, err_msg=call)
    (own,) = rows("urdfkin")
    np.testing.assert_allclose(urdfkin.load(wheel()).acceleration(Q, V, A, "bead")[:3], own[1], atol=1e-12)


def test_what_the_page_says_of_mujoco_is_so() -> None:
    mujoco = pytest.importorskip("mujoco")
    inertial = (
        '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    spec = mujoco.MjSpec.from_string(re.sub(r'(<link name="\w+")/>', rf"\1>{inertial}</link>", wheel()))
    spec.body("bead").add_site(name="bead")
    for name in ("FRAMELINACC", "ACCELEROMETER"):
        kind = getattr(mujoco.mjtSensor, f"mjSENS_{name}")
        spec.add_sensor(name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="bead")
    model = spec.compile()
    data, J_rate = mujoco.MjData(model), np.zeros((3, 2))
    data.qpos[:], data.qvel[:], data.qacc[:] = Q, V, A
    mujoco.mj_inverse(model, data)
    mujoco.mj_jacDot(model, data, J_rate, None, data.site("bead").xpos, model.body("bead").id)
    asked = [J_rate @ V, data.sensor("FRAMELINACC").data, data.sensor("ACCELEROMETER").data]
    said = rows("MuJoCo")
    assert len(said) == len(asked)
    for (call, numbers), theirs in zip(said, asked, strict=True):
        np.testing.assert_allclose(theirs, numbers, atol=1e-12, err_msg=call)
