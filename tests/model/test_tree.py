"""The tree keeps Pinocchio's order, resolves names and stays read-only."""

import pickle

import numpy as np
import pytest

from urdfkin.errors import InputError, UnknownNameError
from urdfkin.model.tree import Joint, JointKind, KinematicTree, Mimic, build_tree, with_root_joint


def joint(name: str, kind: JointKind = JointKind.REVOLUTE, mimic: Mimic | None = None) -> Joint:
    return Joint(name, kind, 0, np.eye(4), np.array([0.0, 0.0, 1.0]), mimic=mimic)


@pytest.fixture
def hand() -> KinematicTree:
    """A palm with a thumb of one joint and a finger of two, the second following the first."""
    return build_tree(
        "hand",
        "palm",
        [
            (joint("tip", mimic=Mimic("finger", 0.5, 0.1)), "finger_link", "tip_link"),
            (joint("thumb", JointKind.CONTINUOUS), "palm", "thumb_link"),
            (joint("mount", JointKind.FIXED), "tip_link", "nail"),
            (joint("finger"), "palm", "finger_link"),
        ],
    )


def test_joints_stand_depth_first_and_siblings_by_name(hand: KinematicTree) -> None:
    assert [j.name for j in hand.joints] == ["finger", "tip", "mount", "thumb"]
    assert hand.links == ("palm", "finger_link", "tip_link", "nail", "thumb_link")
    assert [j.parent for j in hand.joints] == [0, 1, 2, 0]


def test_a_follower_has_no_coordinate_and_points_at_its_leaders(hand: KinematicTree) -> None:
    assert (hand.nq, hand.nv) == (2, 2)
    assert hand.q_index[hand.joint_index("tip")] == hand.q_index[hand.joint_index("finger")] == 0
    assert hand.q_index[hand.joint_index("thumb")] == 1


def test_a_joints_frame_is_its_child_links_frame(hand: KinematicTree) -> None:
    assert hand.frame_link("tip") == hand.frame_link("tip_link") == 2
    assert hand.frame_names[:4] == ("palm", "finger", "finger_link", "tip")


def test_an_unknown_frame_offers_the_nearest_names(hand: KinematicTree) -> None:
    with pytest.raises(UnknownNameError, match=r"unknown frame 'tip_lnk'; did you mean tip_link"):
        hand.frame_link("tip_lnk")


def test_a_name_of_a_link_and_of_a_joint_elsewhere_must_be_told_apart() -> None:
    tree = build_tree("r", "a", [(joint("b"), "a", "c"), (joint("d"), "c", "b")])
    with pytest.raises(InputError, match=r"write 'link:b' or 'joint:b'"):
        tree.frame_link("b")
    assert (tree.frame_link("link:b"), tree.frame_link("joint:b")) == (2, 1)
    assert [tree.frame_name(link) for link in range(3)] == ["a", "c", "link:b"]


def test_the_path_leads_from_the_root_outwards(hand: KinematicTree) -> None:
    assert [hand.joints[i].name for i in hand.path(hand.link_index("nail"))] == ["finger", "tip", "mount"]
    assert [hand.links[i] for i in hand.leaves()] == ["nail", "thumb_link"]


def test_a_root_joint_hangs_the_robot_from_the_universe(hand: KinematicTree) -> None:
    free = with_root_joint(hand, JointKind.FLOATING)
    assert (free.nq, free.nv) == (9, 8)
    assert free.links[:2] == ("universe", "palm")
    assert free.joints[0].name == "root_joint"
    with pytest.raises(InputError, match="root_joint"):
        with_root_joint(free, JointKind.PLANAR)


def test_a_loop_or_an_island_is_refused() -> None:
    with pytest.raises(InputError, match="cannot be reached"):
        build_tree("r", "a", [(joint("x"), "b", "c")])
    with pytest.raises(InputError, match="loop"):
        build_tree("r", "a", [(joint("x"), "a", "b"), (joint("y"), "b", "a")])


def test_a_follower_of_a_follower_is_refused() -> None:
    first = joint("b", mimic=Mimic("a", 1.0, 0.0))
    second = joint("c", mimic=Mimic("b", 1.0, 0.0))
    with pytest.raises(InputError, match="mimic only an independent joint"):
        build_tree("r", "l0", [(joint("a"), "l0", "l1"), (first, "l1", "l2"), (second, "l2", "l3")])


def test_arrays_are_read_only_before_and_after_pickling(hand: KinematicTree) -> None:
    for tree in (hand, pickle.loads(pickle.dumps(hand))):
        with pytest.raises(ValueError, match="read-only"):
            tree.joints[0].T_parent_joint[0, 3] = 1.0


@pytest.mark.slow
def test_a_chain_of_50000_links_needs_no_deep_stack() -> None:
    chain = [(joint(f"j{i}"), f"l{i}", f"l{i + 1}") for i in range(50_000)]
    tree = build_tree("long", "l0", chain)
    assert tree.nq == 50_000
    assert len(tree.path(50_000)) == 50_000
