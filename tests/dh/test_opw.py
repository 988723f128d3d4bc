"""OPW parameters come back from an arm whatever its zeros and senses, and place its tip."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.cli.test_dh import run_any
from urdfkin.dh import DHTable, table_from_rows
from urdfkin.dh.structure import opw_of
from urdfkin.errors import InputError
from urdfkin.robot.loading import load

H = math.pi / 2
NAMES = ("a1", "a2", "b", "c1", "c2", "c3", "c4")


def table(lengths: dict[str, float], offsets: list[float], signs: list[int], tilt: float = 0.0) -> DHTable:
    """The arm of the parameters, written as Brandstoetter's drawing has it."""
    cells = [
        (lengths["a1"], -H, lengths["c1"], 0.0),
        (lengths["c2"], tilt, 0.0, -H),
        (lengths["a2"], H, lengths["b"], H),
        (0.0, -H, lengths["c3"], 0.0),
        (0.0, H, 0.0, 0.0),
        (0.0, 0.0, lengths["c4"], 0.0),
    ]
    rows = [
        {"a": a, "alpha": alpha, "d": d, "theta": math.remainder(theta - offset, 2 * math.pi), "sense": sign}
        for (a, alpha, d, theta), offset, sign in zip(cells, offsets, signs, strict=True)
    ]
    return table_from_rows(rows, "standard")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_the_parameters_of_any_arm_come_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    drawn = rng.uniform([-0.4, -0.4, -0.3, 0.1, 0.3, 0.3, 0.05], [0.4, 0.4, 0.3, 0.6, 0.9, 0.9, 0.2])
    lengths = dict(zip(NAMES, drawn.tolist(), strict=True))
    for name in rng.choice(["a1", "a2", "b"], seed % 3, replace=False):
        lengths[str(name)] = 0.0
    signs = [int(s) for s in rng.choice([-1, 1], 6)]
    robot = load(table(lengths, list(rng.uniform(-3, 3, 6)), signs), verify=False)
    path = robot.chain("tip", "base")
    found = opw_of(path)
    q = rng.uniform(-3, 3, (50, 6))
    np.testing.assert_allclose(found.placement(q), path.placement(q), atol=1e-12)
    assert {name: abs(x) for name, x in found.lengths.items()} == pytest.approx(
        {name: abs(x) for name, x in lengths.items()}, abs=1e-12
    )
    assert min(found.lengths[name] for name in ("c1", "c2", "c3")) >= 0.0


@pytest.mark.slow
def test_a_calibrated_arm_is_refused_with_its_distance_or_taken_for_one() -> None:
    lengths = dict(zip(NAMES, (0.1, -0.1, 0.0, 0.4, 0.5, 0.5, 0.1), strict=True))
    path = load(table(lengths, [0.0] * 6, [1] * 6, tilt=2e-3), verify=False).chain("tip", "base")
    with pytest.raises(InputError, match=r"not ortho-parallel.*error of [0-9.]+ mm and 0.00[0-9]+ rad"):
        opw_of(path)
    found = opw_of(path, 0.02)
    assert found.lengths["c2"] == pytest.approx(0.5, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ur5", "panda"])
def test_an_arm_of_another_kind_is_refused(name: str) -> None:
    with pytest.raises(InputError, match=r"OPW arm must have six|not ortho-parallel"):
        opw_of(load(name, verify=False).chain())


@pytest.mark.slow
def test_the_command_writes_what_the_solvers_read(tmp_path: Path) -> None:
    result = run_any("structure", "kinova", "--opw", "0.001")
    assert result.exit_code == 0
    assert "is off by at most" in result.output
    lines = dict(line.split(": ", 1) for line in result.stdout.splitlines() if line.startswith("opw_"))
    assert sorted(lines) == [
        "opw_kinematics_geometric_parameters",
        "opw_kinematics_joint_offsets",
        "opw_kinematics_joint_sign_corrections",
    ]
    signs = tomllib.loads(f"x = {lines['opw_kinematics_joint_sign_corrections']}")["x"]
    assert all(abs(sign) == 1 for sign in signs)
