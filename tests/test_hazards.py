"""A call that would crash Pinocchio is not made, and the result states that it was not checked."""

import threading

import pytest

import urdfkin
from tests.random_chains import shift, z_joint
from tests.reading import tree_of
from tests.urdfs import loaded
from urdfkin.model.tree import JointKind, KinematicTree, build_tree, with_root_joint
from urdfkin.urdf.writer import to_urdf
from urdfkin.verify.verifier import NotVerifiedWarning

pytestmark = pytest.mark.slow


def chain(count: int, kind: JointKind = JointKind.FIXED) -> KinematicTree:
    joints = ((z_joint(f"j{i}", shift(0.5, 0, 0), kind), f"l{i}", f"l{i + 1}") for i in range(count))
    return build_tree("chain", "l0", [*joints])


@pytest.mark.slow
@pytest.mark.parametrize("where", ["main thread", "another thread"])
def test_a_chain_too_deep_for_the_stack_is_verified(where: str) -> None:
    """Pinocchio's parser crashes at about 3,800 links, or at 480 links in a thread with 1 MB of stack."""
    robot = urdfkin.load(to_urdf(chain(5_000)))
    answers = []

    def ask() -> None:
        answers.append(robot.placement(robot.neutral(), "l5000"))

    if where == "main thread":
        ask()
    else:
        thread = threading.Thread(target=ask)
        thread.start()
        thread.join()
    assert answers[0][0, 3] == 2500.0
    assert robot.certificate().verified


def test_a_robot_too_large_for_pinocchios_memory_is_computed_with_the_reason_why_it_is_not_verified() -> None:
    tree = chain(500, JointKind.CONTINUOUS)
    robot = urdfkin.load(to_urdf(tree))
    with pytest.warns(NotVerifiedWarning, match="500, which needs 8 GB"):
        J = robot.jacobian(robot.neutral(), "l500")
    assert J.shape == (6, 500)
    assert not robot.certificate().verified


def test_validate_reports_robots_that_cannot_be_verified() -> None:
    report = urdfkin.validate([to_urdf(chain(500, JointKind.CONTINUOUS))], samples=1)
    assert not report.passed
    assert "500, which" in str(report.robots[0].reason)


@pytest.mark.parametrize("kind", [JointKind.FLOATING, JointKind.PLANAR])
def test_a_file_with_a_root_named_universe_is_verified(kind: JointKind) -> None:
    """The robot has the names that urdfkin gives to an added root joint, but urdfkin has added none."""
    text = to_urdf(with_root_joint(chain(2), kind))
    robot = loaded(text)
    robot.placement(robot.sample(2, seed=0), "l2")
    assert robot.certificate().verified
    assert tree_of(text.encode()).links[0] == "universe"


def test_a_robot_with_a_root_joint_is_verified() -> None:
    robot = urdfkin.load(to_urdf(chain(2)), root_joint="planar")
    robot.placement(robot.sample(2, seed=0), "l2")
    assert robot.certificate().verified
