"""The search for how B is laid on A: where to begin, in which order, whose joint is whose, and how nearly."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice

from urdfkin.model.mechanisms.alignment import Alignment, Gauge
from urdfkin.model.mechanisms.free_zeros import zeros_by_rules
from urdfkin.model.mechanisms.mechanism import Mechanism, Tolerance, tolerance_of
from urdfkin.model.mechanisms.pairing import Pairing
from urdfkin.model.mechanisms.walk import TWICE_AS_WELL, Ahead, Walk, better

#: Of joints whose order does not matter, so many orders are tried: all of five slides.
MOST_ORDERS = 120
#: So many steps ahead each search takes in all, seconds: TALOS without a name takes 500, Baxter 1,000.
MOST_AHEAD = 2000
#: What is off by so little (rad, and as a share of the size) is taken for nothing where nothing else helps.
NEARLY = (1e-11, 1e-9, 1e-7, 1e-5, 1e-3)
#: So many times joints that are called otherwise are taken for each other.
MOST_EXCHANGED = 12


def align(a: Mechanism, b: Mechanism, given: Mapping[str, str], gauge: Gauge | None = None) -> Alignment:
    """Lay B on A.

    Args:
        a: One.
        b: The other.
        given: Joints of A and their names in B.
        gauge: What is free; None: whatever makes most agree.
    """
    if gauge is not None:
        for taken in gauge.orders:
            b = b.in_order(taken)
        return _laid(a, b, given, gauge)
    best = _laid(a, b, given, None, Ahead(MOST_AHEAD))
    for orders in b.orders_of_runs(tolerance_of(a, b)):
        if best.complete:
            break
        as_it_is, run = best.b, next(orders)
        for names in _orders_to_try(a, as_it_is, given, run, orders):
            moved = [k for k, name in enumerate(names) if name != run[k]]
            other = as_it_is.in_order(names[moved[0] : moved[-1] + 1])
            found = _laid(a, other, given, None)
            if better((found.matched, found.worst), (best.matched, best.worst)):
                best = found
    return _by_rules(_nearly(_exchanged(best, given), given))


def _orders_to_try(
    a: Mechanism, b: Mechanism, given: Mapping[str, str], run: Sequence[str], orders: Iterator[list[str]]
) -> Iterator[Sequence[str]]:
    """Other orders of a run of B's joints: the one of A where A has all their names, else any.

    Args:
        a: One.
        b: The other.
        given: Joints of A and their names in B.
        run: Names of B's joints, from the inner body outwards.
        orders: All other orders that their axes allow.
    """
    called = {given.get(joint.name, joint.name): i for i, joint in enumerate(a.tree.joints)}
    if not all(name in called for name in run):
        yield from islice(orders, MOST_ORDERS)
        return
    named = sorted(run, key=called.__getitem__)
    if list(run) in (named, named[::-1]):
        return
    yield from (order for order in (named, named[::-1]) if b.may_be_taken(order, tolerance_of(a, b)))


def _by_rules(best: Alignment) -> Alignment:
    """The same with zeros that mimic rules give, where all that agreed agrees still."""
    zeros = zeros_by_rules(best, tolerance_of(best.a, best.b))
    if not zeros:
        return best
    gauge = best.gauge
    found = _laid(best.a, best.b, best.names, replace(gauge, zeros={**gauge.zeros, **zeros}))
    return found if found.differing <= best.differing and found.worst <= best.worst else best


def _exchanged(best: Alignment, given: Mapping[str, str]) -> Alignment:
    """Joints on one body that share no name taken for each other: arms that mirror each other, say."""
    if best.only_a or best.only_b:  # two robots, which no exchange makes one
        return best
    tried, ahead = set[frozenset[tuple[int, int]]](), Ahead(MOST_AHEAD)
    while (two := next((two for two in best.exchangeable(given) if two not in tried), None)) is not None:
        tried.add(two)
        if len(tried) > MOST_EXCHANGED:
            break
        joints = best.a.tree.joints, best.b.tree.joints
        (a, b), (c, d) = two
        other = {joints[0][a].name: joints[1][d].name, joints[0][c].name: joints[1][b].name}
        found = _laid(best.a, best.b, {**given, **other}, None, ahead, base=best.base)
        if better((found.matched, found.worst), (best.matched, best.worst)):
            best, given = found, {**given, **other}
    return best


def _nearly(best: Alignment, given: Mapping[str, str]) -> Alignment:
    """Another way to lay them on each other, which agrees by far more; the same where none is.

    Where each axis is off by a little, none says which of two ways is meant, as one that agrees would. So
    what is little is taken for nothing, more and more of it, until all agree; with what was free set as that
    search found it, they are laid on each other once more and all that is little is told. What is off by more
    is no way chosen wrongly unless something before it is off by less.
    """
    a, b, (least, most), ahead = best.a, best.b, best.inner_off, Ahead(MOST_AHEAD)
    for angle in NEARLY:
        if not least < angle * best.size < TWICE_AS_WELL * most:
            continue
        tolerance = Tolerance(angle, angle * best.size)
        rough = _laid(a, b, given, None, ahead, tolerance, best.base)
        if rough.inner_off[1] or (len(rough.only_a), len(rough.only_b)) != (
            len(best.only_a),
            len(best.only_b),
        ):
            continue
        exact = _laid(a, b, rough.names, rough.gauge)
        return exact if exact.inner_off[1] < TWICE_AS_WELL * most else best
    return best


def _laid(
    a: Mechanism,
    b: Mechanism,
    given: Mapping[str, str],
    gauge: Gauge | None,
    ahead: Ahead | None = None,
    tolerance: Tolerance | None = None,
    base: tuple[int, int] | None = None,
) -> Alignment:
    """The best of all bodies to begin at, or of the one of two links, with some steps ahead."""
    tolerance = tolerance or tolerance_of(a, b)
    walk = Walk(a, b, Pairing(a, b, given, tolerance), gauge, ahead or Ahead(0), tolerance, base)
    best: Alignment | None = None
    for bodies, X in walk.beginnings():
        found = walk.run(bodies, X)
        if best is None or better((found.matched, found.worst), (best.matched, best.worst)):
            best = found
        if not best.worst and not (best.only_a and best.only_b):
            break
    assert best is not None
    return best
