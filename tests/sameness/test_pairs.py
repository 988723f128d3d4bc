"""Pairs made of the catalogue's robots by known changes: the verdict is right on every one.

`python -m tests.sameness.test_pairs` tries all changes on all robots; the tests take turns.
"""

from __future__ import annotations

import sys
import time
import warnings
from functools import cache, partial, reduce

import pytest

import urdfkin
from tests.sameness import pairs
from tests.sameness.pairs import Change
from urdfkin.model.tree import KinematicTree
from urdfkin.robot import Robot
from urdfkin.sameness.result import Verdict
from urdfkin.urdf.catalogue import catalogue
from urdfkin.urdf.writer import to_urdf


def everything(tree: KinematicTree) -> KinematicTree:
    changes: list[Change] = [pairs.merged, pairs.split, pairs.flipped, pairs.shifted, pairs.on_a_stand]
    return reduce(lambda changed, change: change(changed), changes, tree)


ALIKE: dict[str, Change] = {
    "base moved": pairs.on_a_stand,
    "links split": pairs.split,
    "links merged": pairs.merged,
    "axes flipped": pairs.flipped,
    "zeros shifted": pairs.shifted,
    "all renamed": pairs.renamed,
    "other way up": pairs.rerooted,
    "counted elsewhere": pairs.counted_elsewhere,
    "slides exchanged": pairs.exchanged,
    "all of it": everything,
}
UNLIKE: dict[str, Change] = {
    **{f"tilted by {a:g}": partial(pairs.tilted, angle=a) for a in (1e-9, 1e-7, 1e-5, 1e-3, 1e-2)},
    **{f"moved by {x:g}": partial(pairs.lengthened, metres=x) for x in (1e-9, 1e-4)},
    "axis bent": partial(pairs.bent_axis, angle=1e-3),
    "other rule": pairs.with_another_rule,
}
ROBOTS = sorted(catalogue())


@cache
def robot(name: str) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        tree = urdfkin.load(name, verify=False).tree
        return urdfkin.load(to_urdf(pairs.bounded(tree)), verify=False)


def changed(name: str, change: Change) -> Robot | None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", urdfkin.UrdfWarning)
        tree = change(robot(name).tree)
        return None if tree is robot(name).tree else urdfkin.load(to_urdf(tree), verify=False)


@pytest.mark.slow
@pytest.mark.parametrize("turn", range(len(ROBOTS)), ids=ROBOTS)
def test_what_is_the_same_robot_is_found_to_be_so(turn: int) -> None:
    what = list(ALIKE)[turn % len(ALIKE)]
    other = changed(ROBOTS[turn], ALIKE[what])
    if other is None:  # nothing to turn over
        return
    found = urdfkin.same(robot(ROBOTS[turn]), other, bounds=False)
    assert found, (what, found.differences[:3])


@pytest.mark.slow
@pytest.mark.parametrize("turn", range(len(ROBOTS)), ids=ROBOTS)
def test_what_is_not_is_found_out_and_the_joint_named(turn: int) -> None:
    what = list(UNLIKE)[turn % (len(UNLIKE) - 1)]
    tree = robot(ROBOTS[turn]).tree
    if not pairs.moving(tree):
        return
    other = changed(ROBOTS[turn], UNLIKE[what])
    assert other is not None
    found = urdfkin.same(robot(ROBOTS[turn]), other, bounds=False)
    assert found.verdict is Verdict.DIFFERS, what
    chain = pairs.moving(tree)
    at = chain[len(chain) // 2]
    assert found.differences[0].place in {f"joint {tree.joints[at].name}", f"link {tree.links[at + 1]}"}


FOLLOWED = ["panda", "pr2", "talos", "baxter"]


@pytest.mark.parametrize("name", FOLLOWED)
def test_a_follower_that_moves_by_a_tenth_more_is_found_out(name: str) -> None:
    found = urdfkin.same(robot(name), changed(name, UNLIKE["other rule"]) or robot(name), bounds=False)
    assert [one.what for one in found.differences] == ["mimic rule"]


def main() -> None:
    """All changes on all robots."""
    wrong, tried, began = [], 0, time.process_time()
    for name in sys.argv[1:] or ROBOTS:
        for alike, changes in ((True, ALIKE), (False, UNLIKE)):
            for what, change in changes.items():
                moves = bool(pairs.moving(robot(name).tree))
                other = changed(name, change) if alike or moves else None
                if other is None or (what == "other rule" and other is robot(name)):
                    continue
                tried += 1
                if bool(urdfkin.same(robot(name), other, bounds=False)) is not alike:
                    wrong.append(f"{name}, {what}")
    print(
        f"{tried - len(wrong)} of {tried} verdicts right, {time.process_time() - began:.0f} s",
        *wrong,
        sep="\n",
    )


if __name__ == "__main__":
    main()
