"""Each program on the page about other libraries shows its defect, until a version fixes it."""

import re
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from tests.pages import DOCS, blocks

pytest.importorskip("mujoco")
PAGE = DOCS / "upstream.md"


def programs() -> dict[str, int]:
    """Return the headings of the programs that end with `found` and `expected`, with their index."""
    parts = re.split(r"^##+ ", PAGE.read_text("utf-8"), flags=re.M)[1:]
    titles, at = {}, -1
    for part in parts:
        for code in re.findall(r"```py(?:thon)?\n(.*?)```", part, flags=re.S):
            at += 1
            if "expected" in code and "def poses" not in code:
                titles[part.partition("\n")[0]] = at
    return titles


PROGRAMS = programs()
_names: dict[str, Any] = {}
_run: list[int] = []


def outcome(at: int) -> tuple[np.ndarray, np.ndarray]:
    """Run the programs of the page up to one; return what the library found and what was expected."""
    codes = [code for kind, code in blocks("upstream.md") if kind in ("python", "py")]
    for k in range(len(_run), at + 1):
        exec(codes[k], _names)
        _run.append(k)
        if k in PROGRAMS.values():
            _names[f"outcome {k}"] = _names["found"], _names["expected"]
    found: tuple[np.ndarray, np.ndarray] = _names[f"outcome {at}"]
    return found


@pytest.mark.xfail(
    raises=AssertionError, strict=True, reason="a defect of the library; once it is gone, its entry goes"
)
@pytest.mark.parametrize("title", PROGRAMS)
def test_the_library_no_longer_has_the_defect(title: str) -> None:
    if title.startswith("Robotics Toolbox"):
        pytest.importorskip("roboticstoolbox")
    found, expected = outcome(PROGRAMS[title])
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_every_entry_has_a_program() -> None:
    assert len(PROGRAMS) == 11


@pytest.mark.parametrize("moving_after", [False, True])
def test_the_derivative_after_a_mimic_joint_is_wrong_only_where_the_page_says(moving_after: bool) -> None:
    limit = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'
    third = ("revolute", f'<axis xyz="1 0 0"/>{limit}') if moving_after else ("fixed", "")
    model = pin.buildModelFromXML(
        f"""<robot name="r"><link name="base"/><link name="a"/><link name="b"/><link name="tip"/>
        <joint name="first" type="revolute"><parent link="base"/><child link="a"/>
        <axis xyz="0 0 1"/>{limit}</joint>
        <joint name="second" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.5 0 0"/>
        <axis xyz="0 1 0"/>{limit}<mimic joint="first" multiplier="2"/></joint>
        <joint name="third" type="{third[0]}"><parent link="b"/><child link="tip"/>
        <origin xyz="0.2 0.1 0" rpy="0.3 0 0"/>{third[1]}</joint></robot>""",
        mimic=True,
    )
    data, h = model.createData(), 1e-6
    q, v = np.linspace(0.3, 0.5, model.nq), np.linspace(0.7, -0.4, model.nv)
    references = pin.LOCAL, pin.WORLD, pin.LOCAL_WORLD_ALIGNED

    def error(name: str, reference: pin.ReferenceFrame, *, of_frame: bool) -> float:
        index = model.getFrameId(name) if of_frame else model.getJointId(name)
        get = pin.getFrameJacobian if of_frame else pin.getJointJacobian
        rate = pin.getFrameJacobianTimeVariation if of_frame else pin.getJointJacobianTimeVariation

        def jacobian(q: np.ndarray) -> np.ndarray:
            pin.computeJointJacobians(model, data, q)
            pin.updateFramePlacements(model, data)
            return np.array(get(model, data, index, reference))

        expected = (jacobian(q + h * v) - jacobian(q - h * v)) / (2.0 * h)
        pin.computeJointJacobiansTimeVariation(model, data, q, v)
        pin.updateFramePlacements(model, data)
        return float(np.abs(rate(model, data, index, reference) - expected).max())

    wrong = {
        (name, reference)
        for name in ("second", "tip")
        for reference in references
        if error(name, reference, of_frame=True) > 1e-3
    }
    aligned = {("second", pin.LOCAL_WORLD_ALIGNED), ("tip", pin.LOCAL_WORLD_ALIGNED)}
    assert wrong == (aligned | {("tip", pin.LOCAL)} if moving_after else aligned)
    assert all(error("second", reference, of_frame=False) < 1e-7 for reference in references)
