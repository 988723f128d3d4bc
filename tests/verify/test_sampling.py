"""What a validation draws: as many as asked for, special configurations first, some rates large."""

from __future__ import annotations

import numpy as np
import pytest

import urdfkin
from urdfkin.errors import InputError
from urdfkin.model.configuration import draw, draw_base, special


@pytest.mark.parametrize("with_special", [True, False])
def test_special_configurations_come_first_where_they_are_asked_for_and_nowhere_else(
    with_special: bool,
) -> None:
    robot = urdfkin.load("panda")
    drawn = draw(robot.tree, 40, np.random.default_rng(0), with_special=with_special)
    extra = 3 if with_special else 0
    assert drawn.q.shape[0] == drawn.v.shape[0] == drawn.a.shape[0] == 40 + extra
    assert (drawn.q[:3] == special(robot.tree)).all() == with_special
    limits = [joint.limit for joint in robot.tree.joints if joint.nq == 1]
    assert special(robot.tree)[1].tolist() == [limit.lower for limit in limits if limit]
    assert special(robot.tree)[2].tolist() == [limit.upper for limit in limits if limit]


def test_every_eighth_sample_has_rates_a_hundred_times_as_large() -> None:
    drawn = draw(urdfkin.load("panda").tree, 400, np.random.default_rng(0), with_special=False)
    for rates in (drawn.v, drawn.a):
        sizes = np.sqrt((rates**2).mean(axis=-1))
        assert 80.0 < sizes[::8].mean() < 120.0
        assert 0.8 < np.delete(sizes, np.s_[::8]).mean() < 1.2


def test_a_base_is_placed_and_moves_otherwise_in_every_sample() -> None:
    base = draw_base(400, np.random.default_rng(0))
    assert base.batch_shape == (400,)
    assert np.abs(base.placement[:, :3, 3]).max() <= 2.0
    assert np.unique(base.placement[:, :3, :3].round(6), axis=0).shape[0] == 400
    for rates in (base.velocity, base.acceleration):
        sizes = np.sqrt((rates**2).mean(axis=-1))
        assert 80.0 < sizes[::8].mean() < 120.0
        assert 0.8 < np.delete(sizes, np.s_[::8]).mean() < 1.2


def test_more_configurations_than_memory_holds_are_refused_in_one_line() -> None:
    robot = urdfkin.load("ur5", verify=False)
    with pytest.raises(InputError) as caught:
        robot.sample(10**15)
    assert str(caught.value) == (
        "ur5: this number of configurations does not fit into memory: found n = 1000000000000000, which are "
        "48000000 GB; draw them in parts, each with a seed of its own"
    )
    assert caught.value.__cause__ is None
