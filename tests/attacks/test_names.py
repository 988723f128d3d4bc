"""Each name is one frame for urdfkin and Pinocchio or an error, even a name such as `link:foo`."""

import copy
import pickle
from xml.sax.saxutils import quoteattr

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import urdfkin
from scripts.fuzzing.robots import INTERNAL_NAMES as POOL
from tests.urdfs import joint, limit, loaded
from tests.urdfs import robot as urdf
from urdfkin import BaseMotion
from urdfkin.errors import InputError, OracleError, UnknownNameError
from urdfkin.model.tree import JointFrame, KinematicTree, LinkFrame
from urdfkin.validation.accuracy import accuracy_study
from urdfkin.verify.oracle import QueryBatch

#: Names of frames that the tests search.
FRAMES = (*POOL, *(f"{prefix}:{name}" for prefix in ("link", "joint") for name in POOL))

#: Pose of the base.
TURNED = np.array([[0.0, -1.0, 0.0, 1.0], [1.0, 0.0, 0.0, 2.0], [0.0, 0.0, 1.0, 3.0], [0.0, 0.0, 0.0, 1.0]])


#: A robot with a link `foo` at (1, 0, 0) and a link `link:foo` at (1, 2, 0).
LIKE_OURS = urdf(
    joint("j1", "continuous", "base", "foo", 'xyz="1 0 0"'),
    joint("j2", "continuous", "foo", "link:foo", 'xyz="0 2 0"'),
)


def test_an_exact_name_has_priority_and_a_linkframe_object_is_the_link() -> None:
    foo, other, frame = [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], LinkFrame.of("foo")
    robot, q = loaded(LIKE_OURS), [0.0, 0.0]
    for base in (None, BaseMotion()):
        for name, place in (("link:foo", other), ("link:link:foo", other), ("foo", foo), (frame, foo)):
            assert robot.placement(q, name, base=base)[:3, 3].tolist() == place
    assert robot.certificate().verified
    robot = loaded(LIKE_OURS)
    assert robot.relative_placement(q, "base", frame)[:3, 3].tolist() == [-1.0, 0.0, 0.0]
    assert robot.relative_placement(q, "base", "link:foo")[:3, 3].tolist() == [-1.0, -2.0, 0.0]
    assert robot.certificate().verified


def test_the_comparison_with_pinocchio_finds_a_frame_of_the_wrong_link(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = KinematicTree.frame_link

    def prefix_first(tree: KinematicTree, name: str) -> int:
        prefix, _, rest = name.partition(":")
        return tree.link_index(rest) if prefix == "link" and rest in tree.links else right(tree, name)

    monkeypatch.setattr(KinematicTree, "frame_link", prefix_first)
    with pytest.raises(urdfkin.VerificationError):
        loaded(LIKE_OURS).placement([0.0, 0.0], "link:foo")


def test_prepared_frames_with_equal_text_are_different_frames() -> None:
    robot = loaded(LIKE_OURS)
    q = np.zeros(2)
    ways = "link:foo", LinkFrame.of("foo"), "link:foo"
    assert [robot.prepare(frame).placement(q)[1, 3] for frame in ways] == [2.0, 0.0, 2.0]
    assert [robot.placement(q, frame, verify=False)[1, 3] for frame in ways] == [2.0, 0.0, 2.0]
    assert pickle.loads(pickle.dumps(robot.prepare(LinkFrame.of("foo")))).placement(q)[1, 3] == 0.0


def test_every_entry_of_all_frames_refers_to_the_correct_link_also_in_a_copy() -> None:
    robot = loaded(LIKE_OURS)
    assert robot.all_frames == ("link:base", "link:foo", "link:link:foo", "joint:j1", "joint:j2")
    assert [robot.tree.frame_link(frame) for frame in robot.all_frames] == [0, 1, 2, 1, 2]
    for copied in (copy.deepcopy(robot.all_frames), pickle.loads(pickle.dumps(robot.all_frames))):
        assert [robot.tree.frame_link(frame) for frame in copied] == [0, 1, 2, 1, 2]
    assert urdfkin.validate([LIKE_OURS.encode()], samples=2).passed
    assert max(line.pinocchio.worst for line in accuracy_study(loaded(LIKE_OURS), samples=1).lines) < 10.0


@pytest.mark.parametrize("name", ["anymal_c", "so100", "z1", "b1_z1"])
def test_a_robot_with_a_link_and_a_joint_of_equal_name_moves_with_the_base(name: str) -> None:
    robot = urdfkin.load(name)
    shared = {joint.name for joint in robot.tree.joints} & set(robot.link_names)
    assert shared
    twists = robot.velocity(robot.neutral(), np.ones(robot.nv), robot.link_frames)
    assert twists.shape == (len(robot.link_names), 6)
    q, base = robot.sample(2, 3), BaseMotion(TURNED, np.arange(6.0), np.arange(6.0) - 2.0)
    everywhere = robot.placement(q, robot.link_frames, base=base)
    np.testing.assert_allclose(everywhere, TURNED @ robot.placement(q, robot.link_frames), atol=1e-14)
    v, a = np.random.default_rng(1).normal(size=(2, 2, robot.nv))
    for frame in [f(own) for own in sorted(shared)[:2] for f in (LinkFrame.of, JointFrame.of)]:
        robot.acceleration(q, v, a, [frame], base=base)
        robot.jacobian(q, [frame], "local", base=base)
    assert robot.certificate().verified


@pytest.mark.parametrize("root_joint", ["floating", "planar"])
def test_the_world_and_the_root_joint_move_with_the_base(root_joint: str) -> None:
    robot = loaded(LIKE_OURS, root_joint=root_joint)
    base = BaseMotion(TURNED, np.arange(6.0))
    q, v = robot.neutral(), np.zeros(robot.nv)
    np.testing.assert_allclose(robot.placement(q, "universe", base=base), TURNED, atol=1e-15)
    for frame in ("universe", "link:universe", "root_joint", "joint:root_joint", "base"):
        np.testing.assert_allclose(robot.velocity(q, v, frame, base=base), np.arange(6.0), atol=1e-14)
    assert robot.placement(q, robot.link_frames, base=base).shape == (4, 4, 4)
    assert robot.certificate().verified


def test_the_remedy_for_an_ambiguous_name_is_correct() -> None:
    crossed = (
        joint("b", "fixed", "a", "link:b", 'xyz="1 0 0"'),
        joint("c", "fixed", "link:b", "b", 'xyz="0 1 0"'),
    )
    robot = loaded(urdf(*crossed))
    with pytest.raises(InputError, match=r"write 'joint:c' or 'joint:b'$"):
        robot.placement([], "b")
    assert robot.placement([], "joint:c")[:2, 3].tolist() == [1.0, 1.0]
    assert robot.placement([], "joint:b")[:2, 3].tolist() == [1.0, 0.0]
    with pytest.raises(OracleError, match="two of Pinocchio's frames have this name"):
        robot.verifier.oracle().placements(QueryBatch(["b"], (np.zeros((1, 0)),)))
    with pytest.raises(OracleError, match="Pinocchio has no such frame: found 'link:d'"):
        robot.verifier.oracle().placements(QueryBatch(["link:d"], (np.zeros((1, 0)),)))


def meant(name: str, links: list[str], joints: list[str]) -> int | str:
    """Return the index of the link that a name means, or "ambiguous" or "unknown"."""
    link = links.index(name) if name in links else None
    joint = joints.index(name) + 1 if name in joints else None
    if link is not None and joint is not None and link != joint:
        return "ambiguous"
    if link is not None or joint is not None:
        return link if link is not None else joint or 0
    for prefix, known, first in (("link:", links, 0), ("joint:", joints, 1)):
        if name.startswith(prefix) and name[len(prefix) :] in known:
            return known.index(name[len(prefix) :]) + first
    return "unknown"


@pytest.mark.slow
@settings(max_examples=60)
@given(
    links=st.lists(st.sampled_from(POOL), min_size=1, max_size=5, unique=True),
    data=st.data(),
    root_joint=st.sampled_from([None, None, "floating", "planar"]),
)
def test_every_hostile_name_is_the_same_frame_in_urdfkin_and_pinocchio(
    links: list[str], data: st.DataObject, root_joint: str | None
) -> None:
    n = len(links) - 1
    joints = data.draw(st.lists(st.sampled_from(POOL), min_size=n, max_size=n, unique=True))
    assume("universe" not in joints)  # Pinocchio does not find a joint with this name (URDF404)
    assume(root_joint is None or ("universe" not in links and "root_joint" not in joints))
    places, rows = [np.zeros(3)], []
    for k in range(n):
        parent = data.draw(st.integers(0, k))
        kind = data.draw(st.sampled_from(["continuous", "fixed", "prismatic"]))
        step = np.roll([10.0**-k, 0.0, 0.0], k)
        places.append(places[parent] + step)
        origin = f'xyz="{" ".join(map(str, step))}"'
        rows.append(joint(joints[k], kind, links[parent], links[k + 1], origin, more=limit(0, 0)))
    text = urdf(*rows) if rows else f'<robot name="r"><link name={quoteattr(links[0])}/></robot>'
    robot = loaded(text, root_joint=root_joint)
    if root_joint is not None:
        links, joints = ["universe", *links], ["root_joint", *joints]
        places = [np.zeros(3), *places]
    q = robot.neutral()
    for base, T in ((None, np.eye(4)), (BaseMotion(TURNED), TURNED)):
        for name in FRAMES:
            where = meant(name, links, joints)
            if isinstance(where, str):
                wanted = InputError if where == "ambiguous" else UnknownNameError
                with pytest.raises(wanted):
                    robot.placement(q, name, base=base)
                with pytest.raises(OracleError):
                    robot.verifier.oracle(base).placements(QueryBatch([name], (q[np.newaxis],)))
            else:
                found = robot.placement(q, name, base=base)[:3, 3]
                np.testing.assert_allclose(found, T[:3, :3] @ places[where] + T[:3, 3], atol=1e-14)
        every = robot.placement(q, robot.link_frames, base=base)[:, :3, 3]
        expected = [T[:3, :3] @ places[links.index(name)] + T[:3, 3] for name in robot.link_names]
        np.testing.assert_allclose(every, expected, atol=1e-14)
        robot.jacobian(q, robot.all_frames, base=base)
    assert robot.certificate().verified
