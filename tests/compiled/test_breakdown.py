"""The parts of an acceleration: each is what it says, and together they are the whole."""

import numpy as np
import pytest

from tests.odd_tree import odd_tree, pose, state
from urdfkin.compiled.breakdown import KINDS, acceleration_breakdown
from urdfkin.compiled.evaluate import accelerations
from urdfkin.compiled.plan import compile_tree
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import KinematicTree

ROOM = 64 * np.finfo(np.float64).eps * 30.0


@pytest.fixture(scope="module")
def odd() -> KinematicTree:
    return odd_tree()


@pytest.mark.parametrize("reference", list(Reference))
@pytest.mark.parametrize("link", ["base", "body", "wrist", "tyre"])
def test_the_parts_add_up_to_the_recursions_acceleration(
    odd: KinematicTree, link: str, reference: Reference
) -> None:
    at = odd.link_index(link)
    q, v, a = state(odd, 21, 1)
    generator = np.random.default_rng(2)
    base = BaseMotion(pose(generator), generator.normal(size=6), generator.normal(size=6)).state(())
    parts = acceleration_breakdown(odd, at, q, v, a, reference, base)
    whole = accelerations(compile_tree(odd, [at]), q, v, a, reference, base=base)[:, 0]
    assert np.abs(parts.total - whole).max() <= ROOM
    assert np.abs(parts.base + parts.by_kind.sum(axis=-2) - whole).max() <= ROOM


def test_a_joint_that_stands_still_contributes_nothing(odd: KinematicTree) -> None:
    q, v, a = state(odd, 3, 3)
    slide = odd.v_index[odd.joint_index("slide")]
    v[:, slide] = a[:, slide] = 0.0
    parts = acceleration_breakdown(odd, odd.link_index("wrist"), q, v, a)
    assert parts.joints == ("free", "arm", "slide", "follower")
    assert not parts.by_joint[:, 2].any()
    assert parts.by_joint[:, 1].all()
    # The wrist turns about its own origin: it moves nothing there, it only turns.
    assert not parts.by_joint[:, 3, :3].any()
    assert parts.by_joint[:, 3, 3:].all()


def test_doubling_a_rate_and_an_acceleration_scales_each_kind_as_its_formula_says(odd: KinematicTree) -> None:
    q, v, a = state(odd, 3, 4)
    wrist, slide = odd.link_index("wrist"), odd.v_index[odd.joint_index("slide")]
    once = acceleration_breakdown(odd, wrist, q, v, a).terms[:, 2]
    v[:, slide] *= 2.0
    a[:, slide] *= 3.0
    now = acceleration_breakdown(odd, wrist, q, v, a).terms[:, 2]
    for kind, factor in (("coriolis", 2.0), ("sliding", 3.0)):
        at = KINDS.index(kind)
        assert np.abs(now[:, at] - factor * once[:, at]).max() <= ROOM
        assert once[:, at, :3].all()
    for kind in ("transverse", "centripetal"):
        assert not now[:, KINDS.index(kind)].any()


def test_a_batch_may_be_empty(odd: KinematicTree) -> None:
    q, v, a = state(odd, 1, 5)
    assert acceleration_breakdown(odd, 5, q[:0], v[:0], a[:0]).total.shape == (0, 6)
