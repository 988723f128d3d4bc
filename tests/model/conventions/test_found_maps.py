"""What `same` finds between two models is a convention: joint order, names, senses and zeros of the other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from tests.cli.running import urdfkin as run
from tests.comparison.pairs import disguised, loaded, robot
from urdfkin.comparison.result import Sameness
from urdfkin.errors import InputError
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.base_motion import STILL_STATE
from urdfkin.model.conventions import BUILT_IN, Convention, Conversion, as_toml, find_convention
from urdfkin.model.conventions.convention import JointRule, read_convention
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import catalogue
from urdfkin.verify.bounds import magnitudes
from urdfkin.verify.quantities import JACOBIAN, PLACEMENT, Quantity

ALIGNED = Reference.LOCAL_WORLD_ALIGNED
FEW = ["ur5", "panda", "a1", "tiago", "kinova", "talos_reduced", "so101", "double_pendulum"]


def _room(robot: Robot, q: FloatArray, links: list[str], quantity: Quantity) -> FloatArray:
    """Return the bound of the rounding errors of a quantity at q (nq,): (links, ...)."""
    plan = robot.plan([robot.tree.link_index(link) for link in links])
    bound = quantity.bound(plan, magnitudes(plan, q[None], None, None, STILL_STATE), ALIGNED)
    found: FloatArray = (EPS * bound.k * bound.scale)[0]
    return found


def _excess(found: Sameness, a: Robot, b: Robot, conversion: Conversion) -> float:
    """Return the largest difference of placements and Jacobians of A and B as a fraction of its bound.

    The bound is the distance and the angle that `same` counts as rounding, plus the rounding errors of both
    computations. B's placement is that of four products.
    """
    metres, radians = found.rounding
    tools = {(tool.a, tool.b): tool.pose for tool in found.tools}
    pairs = [pair for pair in found.links if pair not in tools] or list(found.links)
    ours, theirs = ([pair[k] for pair in pairs] for k in (0, 1))
    worst = 0.0
    for q_a in a.sample(3, 5):
        q_b = conversion.to(q_a)
        base = f"link:{found.base_links[1]}"
        X = found.base @ b.placement(b.neutral(), base) @ np.linalg.inv(b.placement(q_b, base))
        T_a, T_b = (
            a.placement(q_a, [f"link:{x}" for x in ours]),
            b.placement(q_b, [f"link:{x}" for x in theirs]),
        )
        for k, pair in enumerate(pairs):
            T_a[k] = T_a[k] @ tools.get(pair, np.eye(4))
        room = _room(a, q_a, ours, PLACEMENT) + 4.0 * _room(b, q_b, theirs, PLACEMENT)
        room[:, :3, :3] += radians
        room[:, :3, 3] += metres + EPS * np.abs(X[:3, 3]).max() * 16.0
        worst = max(worst, float((np.abs(T_a - X @ T_b)[:, :3] / room[:, :3]).max()))
        if len(tools) == len(found.links):
            continue  # each frame is another one, so that its Jacobian is
        J_a = a.jacobian(q_a, [f"link:{x}" for x in ours])
        J_b = b.jacobian(q_b, [f"link:{x}" for x in theirs])
        turned = np.kron(np.eye(2), X[:3, :3]) @ conversion.from_jacobian(q_a, J_b)
        room = _room(a, q_a, ours, JACOBIAN) + radians
        room += 4.0 * np.abs(conversion.from_jacobian(q_a, _room(b, q_b, theirs, JACOBIAN))).max()
        room[:, :3] += metres + radians * np.abs(T_a[:, :3, 3]).max()
        worst = max(worst, float((np.abs(J_a - turned) / room).max()))
    return worst


def _found(name: str, seed: int) -> tuple[Sameness, Robot, Robot]:
    a = robot(name)
    b = loaded(disguised(a.tree, seed))
    return urdfkin.same(a, b, bounds=False), a, b


def _hold(name: str, seed: int, folder: Path) -> None:
    found, a, b = _found(name, seed)
    file = folder / "found.toml"
    file.write_text(as_toml(found.convention()))
    conversion = a.convention(file)
    q = a.sample(4)
    assert np.array_equal(conversion.to(q), found.to_b(q))
    assert np.allclose(conversion.from_(conversion.to(q)), q, 0, 1e-14)
    assert _excess(found, a, b, conversion) <= 1.0


@pytest.mark.filterwarnings("ignore::urdfkin.DegreesWarning")  # a zero moves values beyond the limits
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name", FEW)
def test_a_map_converts_to_a_model_with_other_names_senses_zeros_and_order(
    name: str, seed: int, tmp_path: Path
) -> None:
    _hold(name, seed, tmp_path)


@pytest.mark.filterwarnings("ignore::urdfkin.DegreesWarning")  # a zero moves values beyond the limits
@pytest.mark.long
@pytest.mark.parametrize("name", sorted(set(catalogue()) - set(FEW)))
def test_a_map_converts_to_a_disguise_of_every_robot(name: str, tmp_path: Path) -> None:
    if robot(name).tree.nq:
        _hold(name, 2, tmp_path)


def _wrong(right: Convention, mistake: str) -> Convention:
    rules, joints = dict(right.rules), list(right.joints)
    turned = next(x for x, rule in rules.items() if rule.sign < 0)
    moved = next(x for x, rule in rules.items() if rule.zero)
    match mistake:
        case "sign":
            rules[turned] = replace(rules[turned], sign=1.0)
        case "zero":
            rules[moved] = replace(rules[moved], zero=rules[moved].zero + 1e-6)
        case "order":
            joints[0], joints[1] = joints[1], joints[0]
    return replace(right, rules=rules, joints=tuple(joints))


@pytest.mark.parametrize("mistake", ["sign", "zero", "order"])
@pytest.mark.parametrize("name", ["ur5", "a1", "tiago"])
def test_a_planted_mistake_in_a_map_is_seen(name: str, mistake: str) -> None:
    found, a, b = _found(name, 0)
    assert _excess(found, a, b, a.convention(_wrong(found.convention(), mistake))) > 100.0


ARM = """<robot name="arm"><link name="l0"/><link name="l1"/><link name="l2"/>
<joint name="a" type="revolute"><parent link="l0"/><child link="l1"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/>{}</joint>
<joint name="b" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="1 0 0"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/>{}</joint></robot>"""


@pytest.mark.filterwarnings("ignore:.*URDF527")
def test_a_leader_of_one_model_may_be_a_mimic_joint_of_the_other() -> None:
    leads, follows = (
        '<mimic joint="b" multiplier="0.5" offset="-0.05"/>',
        '<mimic joint="a" multiplier="2" offset="0.1"/>',
    )
    a, b = (urdfkin.load(ARM.format(*words), verify=False) for words in (("", follows), (leads, "")))
    found = urdfkin.same(a, b, bounds=False)
    conversion = a.convention(found.convention())
    assert conversion.joint_names == ("b",)
    assert conversion.to([0.3]).tolist() == [0.7]
    assert np.allclose(conversion.from_([0.7]), [0.3], 0, 1e-15)
    J = a.with_convention(found.convention()).jacobian([0.7], "l2")
    assert np.allclose(J, b.jacobian([0.7], "l2"), 0, 1e-15)


def test_a_coordinate_of_one_model_only_is_an_error_that_names_its_joint() -> None:
    a, b = (urdfkin.load(ARM.format("", ""), verify=False) for _ in "ab")
    shorter = urdfkin.load(b.urdf.replace('name="b" type="revolute"', 'name="b" type="fixed"'), verify=False)
    with pytest.raises(InputError, match=r"a joint of B has no joint of A.*found b"):
        urdfkin.same(shorter, b, bounds=False).convention()
    with pytest.raises(InputError, match=r"the order of joints lacks a joint.*found b"):
        urdfkin.same(a, shorter, bounds=False).convention()


def test_a_free_joint_with_another_frame_is_an_error() -> None:
    text = '<robot name="r"><link name="l0"/><link name="l1"/><joint name="f" type="floating">'
    text += '<parent link="l0"/><child link="l1"/><origin xyz="{} 0 0"/></joint></robot>'
    a, b = (urdfkin.load(text.format(x), verify=False) for x in (0, 1))
    with pytest.raises(InputError, match="a free joint has another frame in B"):
        urdfkin.same(a, b, bounds=False).convention()


def test_the_command_writes_a_map_that_other_commands_read(tmp_path: Path) -> None:
    a, b = robot("ur5"), loaded(disguised(robot("ur5").tree, 3))
    files = [tmp_path / name for name in ("a.urdf", "b.urdf", "map.toml")]
    for file, one in zip(files, (a, b), strict=False):
        file.write_text(one.urdf)
    done = run("same", *map(str, files[:2]), "--boxes", "0", "--write-map", str(files[2]))
    assert done.code == 0, done.err
    q = a.sample(1)[0]
    theirs = urdfkin.same(a, b, bounds=False).to_b(q)
    text = ",".join(map(repr, theirs.tolist()))
    frame = a.link_names[-1]
    done = run(
        "placement",
        str(files[0]),
        "--convention",
        str(files[2]),
        "--frame",
        frame,
        "--q",
        text,
        "--format",
        "json",
    )
    assert done.code == 0, done.err
    assert np.allclose(done.data["result"][0], a.placement(q, frame), 0, 1e-14)
    order = run("order", str(files[0]), "--to", str(files[2])).text
    assert "q_to = q_from[..., [" in order or "np.array" in order


@pytest.mark.parametrize("name", [name for name in BUILT_IN if name != "idyntree"])
def test_a_convention_that_is_written_as_toml_is_read_back(name: str) -> None:
    how = find_convention(name)
    rules = {
        'a "b" \\ \x7f é': JointRule("1 é\n", -1.0, -0.1 + 0.2, "deg"),
        "c": JointRule(None, 1.0, 1e-300, 4096.0),
        "d": JointRule("m", unit="mm"),
    }
    how = replace(how, rules=rules, evidence="", measured="", sources=())
    assert read_convention(as_toml(how), "text", how.name) == how
    given = replace(how, order="given", joints=("m", "c"))
    assert read_convention(as_toml(given), "text", how.name) == given
