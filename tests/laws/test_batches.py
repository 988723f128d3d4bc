"""A configuration has the same bits alone, in a prepared frame, and in any row of a batch."""

import math
import tracemalloc
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.laws.subjects import NAMES, as_a_block, by_the_robot, differing, prepared, robot_of, state
from tests.robots.odd_urdfs import Urdf
from tests.urdfs import loaded
from urdfkin import load
from urdfkin.compiled.evaluate import ROWS_PER_PART
from urdfkin.compiled.plan import LANES
from urdfkin.errors import InputError, RangeError, RepresentationSingularityError
from urdfkin.kinematics.rotation import euler_of, singularity_distance
from urdfkin.model.base_motion import BaseMotion
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot

Compute = Callable[..., FloatArray]

QUANTITIES: dict[str, Compute] = {
    "placement": lambda r, q, v, a, **how: r.placement(q, r.tip_frame, **how),
    "velocity": lambda r, q, v, a, **how: r.velocity(q, v, r.tip_frame, **how),
    "jacobian": lambda r, q, v, a, **how: r.jacobian(q, r.tip_frame, "local", **how),
    "jacobian_rate": lambda r, q, v, a, **how: r.jacobian_rate(q, v, r.tip_frame, "world", **how),
    "hessian": lambda r, q, v, a, **how: r.hessian(q, r.tip_frame, "local", **how),
    "acceleration": lambda r, q, v, a, **how: r.acceleration(q, v, a, r.tip_frame, "world", **how),
    "placements": lambda r, q, v, a, **how: r.placement(q, r.link_frames, **how),
    "velocities": lambda r, q, v, a, **how: r.velocity(q, v, r.link_frames, **how),
    "jacobians": lambda r, q, v, a, **how: r.jacobian(q, r.link_frames, **how),
    "hessians": lambda r, q, v, a, **how: r.hessian(q, r.link_frames[-3:], "world", **how),
    "accelerations": lambda r, q, v, a, **how: r.acceleration(q, v, a, r.link_frames, **how),
}


@pytest.fixture(scope="module", params=NAMES)
def robot(request: pytest.FixtureRequest) -> Robot:
    return robot_of(request.param)


@pytest.mark.parametrize("shape", [(), (1,), (0,), (5,), (16,), (2, 0, 3), (2, 3), (1, 4, 1, 5)])
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_results_have_the_leading_shape_of_the_inputs(quantity: str, shape: tuple[int, ...]) -> None:
    robot = robot_of("tree_3")
    compute = QUANTITIES[quantity]
    q, v, a = state(robot, int(np.prod(shape)), 2)
    flat = compute(robot, q, v, a)
    shaped = compute(robot, *(x.reshape(*shape, x.shape[1]) for x in (q, v, a)))
    assert not differing(shaped, flat.reshape(*shape, *flat.shape[1:]))
    assert shaped.flags.c_contiguous
    assert shaped.dtype == np.float64


@pytest.mark.slow
@settings(max_examples=30)
@given(st.data())
def test_q_v_a_and_base_broadcast_as_in_numpy(data: st.DataObject) -> None:
    robot = load("panda", verify=False)
    full = data.draw(st.lists(st.integers(0, 4), max_size=3).map(tuple), label="shape")
    shapes = [_thinned(data, full) for _ in range(6)]
    whole = np.broadcast_shapes(*shapes)
    generator = np.random.default_rng(3)
    q, v, a = (generator.normal(size=(*shape, robot.nv)) for shape in shapes[:3])
    T = np.broadcast_to(np.eye(4), (*shapes[3], 4, 4)).copy()
    T[..., :3, 3] = generator.normal(size=(*shapes[3], 3))
    base = BaseMotion(T, *(generator.normal(size=(*shape, 6)) for shape in shapes[4:]))
    result = robot.acceleration(q, v, a, "panda_hand", base=base)
    assert result.shape == (*whole, 6)
    q, v, a = (np.broadcast_to(x, (*whole, robot.nv)) for x in (q, v, a))
    fields = ((T, (4, 4)), (base.velocity, (6,)), (base.acceleration, (6,)))
    same = BaseMotion(*(np.broadcast_to(x, (*whole, *own)) for x, own in fields))
    assert not differing(result, robot.acceleration(q, v, a, "panda_hand", base=same))


def _thinned(data: st.DataObject, shape: tuple[int, ...]) -> tuple[int, ...]:
    cut = data.draw(st.integers(0, len(shape)))
    return tuple(1 if data.draw(st.booleans()) else size for size in shape[cut:])


def test_inputs_of_any_memory_layout_and_type_give_the_same_result() -> None:
    robot = load("panda")
    q = robot.sample(12, 4)
    straight = robot.jacobian(q, "panda_hand")
    wide = np.zeros((24, 16))
    wide[::2, ::2] = q
    read_only = q.copy()
    read_only.setflags(write=False)
    layouts = [np.asfortranarray(q), wide[::2, ::2], q[::-1][::-1], read_only]
    for other in (*layouts, q.tolist(), q.astype(">f8")):
        assert (robot.jacobian(other, "panda_hand") == straight).all()
    for other in (q.astype(np.float32), np.zeros(8, dtype=np.int64)):
        expected = robot.jacobian(other.astype(float), "panda_hand")
        assert (robot.jacobian(other, "panda_hand") == expected).all()


def test_inputs_do_not_change_and_results_are_not_shared() -> None:
    robot = load("ur5")
    q = robot.sample(4, 5)
    before = q.copy()
    robot.jacobian(q, "tool0")[...] = 7.0
    assert (q == before).all()
    assert not (robot.jacobian(q, "tool0") == 7.0).any()


@pytest.mark.parametrize("shape", [(), (3,), (2, 17), (0,)])
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_out_is_written_and_returned_for_any_number_of_threads(quantity: str, shape: tuple[int, ...]) -> None:
    robot, compute = load("panda"), QUANTITIES[quantity]
    q, v, a = (x.reshape(*shape, 8) for x in state(robot, int(np.prod(shape)), 6))
    expected = compute(robot, q, v, a)
    for how in ({}, {"threads": 2, "verify": "sample"}):
        out = np.full_like(expected, np.nan)
        assert compute(robot, q, v, a, out=out, **how) is out
        assert (out == expected).all()
        with pytest.raises(InputError, match="out must be a writable"):
            compute(robot, q, v, a, out=np.zeros((*expected.shape[:-1], 2)), **how)
    assert (compute(robot, q, v, a, threads=2) == expected).all()


def test_an_out_of_a_wrong_shape_or_with_memory_of_an_input_is_refused() -> None:
    robot = load("ur5")
    q, v = robot.sample(3, 7), np.ones((3, 6))
    for out in (np.zeros((3, 6, 7)), np.zeros((6, 6)), np.zeros((3, 6, 6), order="F")):
        with pytest.raises(InputError, match=r"out must be a writable C-contiguous .*\(3, 6, 6\)"):
            robot.jacobian(q, "tool0", out=out)
    with pytest.raises(InputError, match="share memory"):
        robot.velocity(q, v, "tool0", out=v)
    assert (v == 1.0).all()


class Subclass(np.ndarray):
    """A subclass of NumPy's array, whose methods may be overridden."""


#: Arrays with the type, the shape and the memory order of a plain array.
NOT_PLAIN: dict[str, Callable[[tuple[int, ...]], Any]] = {
    "matrix": lambda shape: np.matrix(np.zeros(shape)),
    "masked": np.ma.zeros,
    "subclass": lambda shape: np.zeros(shape).view(Subclass),
    "not aligned": lambda shape: (
        np.zeros(8 * math.prod(shape) + 8, np.uint8)[1:-7].view(float).reshape(shape)
    ),
}


@pytest.mark.parametrize("kind", NOT_PLAIN)
@pytest.mark.filterwarnings("ignore:the matrix subclass:PendingDeprecationWarning")
def test_an_out_that_is_no_plain_array_is_refused_and_not_changed(kind: str) -> None:
    robot = load("ur5", verify=False)
    q, one, table = robot.sample(1, 1)[0], NOT_PLAIN[kind]((6, 6)), NOT_PLAIN[kind]((4, 4))
    prepared, compiled = robot.prepare("tool0"), robot.compile("tool0")
    calls = [
        lambda: robot.jacobian(q, "tool0", out=one),
        lambda: robot.jacobian(q, "tool0", out=one, threads=1),
        lambda: robot.jacobian_rate(q, q, "tool0", out=one),
        lambda: robot.analytical_jacobian(q, "tool0", out=one),
        lambda: robot.velocity(np.tile(q, (6, 1)), q, "tool0", out=one),
        lambda: robot.relative_placement(q, "tool0", "base_link", out=table),
        lambda: prepared.jacobian(q, out=one),
        lambda: prepared.placement(q, out=table),
        lambda: compiled.jacobian(q, out=one),
        lambda: compiled.placement(q, out=table),
    ]
    for call in calls:
        with pytest.raises(InputError, match="out must be a writable C-contiguous float64 array"):
            call()
    assert not np.asarray(one).any()
    assert not np.asarray(table).any()


def test_an_out_may_be_a_memory_mapped_file(tmp_path: Path) -> None:
    robot = load("ur5")
    q = robot.sample(5, 1)
    out = np.memmap(tmp_path / "jacobians", np.float64, "w+", shape=(5, 6, 6))
    assert robot.jacobian(q, "tool0", out=out) is out
    assert (out == robot.jacobian(q, "tool0")).all()


def test_a_q_that_consists_of_views_of_out_is_read_before_out_is_written() -> None:
    robot = load("ur5")
    expected = robot.velocity(robot.sample(2, 1), np.ones(6), "tool0")
    out = robot.sample(2, 1)
    assert robot.velocity([out[0], out[1]], np.ones(6), "tool0", out=out) is out
    assert (out == expected).all()


@pytest.mark.slow
def test_concurrent_threads_get_the_same_results_as_one_thread() -> None:
    robot = load("a1")
    batches = [state(robot, n, n) for n in (1, 5, 16, 40, 100, 3, 64, 33) * 3]
    frames = robot.link_names

    def work(robot: Robot, k: int) -> list[FloatArray]:
        (q, v, a), frame = batches[k], frames[k % len(frames)]
        return [
            robot.placement(q, frame),
            robot.velocity(q, v, frame, "local"),
            robot.jacobian(q, frame),
            robot.jacobian_rate(q, v, frame, "world"),
            robot.acceleration(q, v, a, frame),
        ]

    fresh = load("a1")  # the first thread creates plans and Pinocchio's models
    with ThreadPoolExecutor(8) as pool:
        threaded = list(pool.map(partial(work, fresh), range(len(batches))))
    for k, results in enumerate(threaded):
        for one, other in zip(work(robot, k), results, strict=True):
            assert (one == other).all()
    lines = {str(line.quantity): line.checked for line in fresh.certificate().lines}
    assert set(lines.values()) == {sum(len(q) for q, _, _ in batches)}


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("single", ["q", "v", "a", "qv", "qa", "va"])
def test_one_configuration_with_many_rates_equals_repeated_configurations(single: str, threads: int) -> None:
    robot, n = robot_of("mimic_hand_40_sliding"), 5 * LANES + 3
    full = dict(zip("qva", state(robot, n, 9), strict=True))
    repeated = {name: np.repeat(x[:1], n, axis=0) if name in single else x for name, x in full.items()}
    once = {name: x[0] if name in single else x for name, x in full.items()}
    for reference in Reference:
        ways = [
            [
                robot.velocity(x["q"], x["v"], robot.tip_frame, reference, threads=threads),
                robot.jacobian_rate(x["q"], x["v"], robot.tip_frame, reference, threads=threads),
                robot.acceleration(x["q"], x["v"], x["a"], robot.link_frames, reference, threads=threads),
            ]
            for x in (once, repeated)
        ]
        # The first two do not depend on a.
        for one, other in zip(*ways, strict=True):
            assert not differing(np.broadcast_to(one, other.shape), other)


def test_one_configuration_with_many_rates_is_not_copied() -> None:
    robot, n = load("panda", verify=False), 100_000
    q, v, a = state(robot, n, 10)
    out = np.empty((n, 6))
    robot.acceleration(q[0], v, a, robot.tip_frame, out=out, threads=1)
    tracemalloc.start()
    try:
        robot.acceleration(q[0], v, a, robot.tip_frame, out=out, threads=2)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < q.nbytes / 20


@pytest.mark.parametrize("representation", ["ZYZ", "xyz", "quaternion"])
def test_analytical_jacobians_are_equal_in_parts_with_threads_and_in_out(representation: str) -> None:
    robot, frame, n = load("ur5", verify=False), "tool0", 2 * ROWS_PER_PART + 5
    q, _, _ = state(robot, n, 12)
    one = robot.analytical_jacobian(q[:ROWS_PER_PART], frame, representation, nearest=0.0, threads=1)
    out = np.full((n, *one.shape[1:]), np.nan)
    assert robot.analytical_jacobian(q, frame, representation, nearest=0.0, out=out, threads=2) is out
    assert not differing(out[:ROWS_PER_PART], one)
    for k in (0, ROWS_PER_PART - 1, ROWS_PER_PART, n - 1):
        assert not differing(robot.analytical_jacobian(q[k], frame, representation, nearest=0.0), out[k])
    refused = np.full((n, 6 + (representation != "quaternion"), 6), np.nan)
    with pytest.raises(InputError, match="out must be a writable"):
        robot.analytical_jacobian(q, frame, representation, out=refused)


@pytest.mark.parametrize("threads", [1, 2])
def test_the_sample_nearest_to_a_singularity_is_named(threads: int) -> None:
    robot = load("ur5", verify=False)
    q, _, _ = state(robot, 3 * ROWS_PER_PART, 15)
    distances = singularity_distance("ZYZ", euler_of("ZYZ", robot.placement(q, "tool0")[:, :3, :3]))
    with pytest.raises(RepresentationSingularityError) as caught:
        robot.analytical_jacobian(q.reshape(3, ROWS_PER_PART, 6), "tool0", nearest=1.6, threads=threads)
    assert caught.value.sample == divmod(int(distances.argmin()), ROWS_PER_PART)
    assert f"sample {list(caught.value.sample)}" in str(caught.value)
    assert caught.value.distance == distances.min()


@pytest.mark.slow
@pytest.mark.parametrize("reference", list(Reference))
def test_acceleration_breakdowns_are_equal_in_parts_with_threads_and_in_out(reference: Reference) -> None:
    robot, n = robot_of("planar_and_floating_in_the_middle"), 2 * ROWS_PER_PART + 5
    q, v, a = state(robot, n, 13)
    base = BaseMotion(velocity=np.linspace(-1.0, 1.0, 6 * n).reshape(n, 6))
    ask = partial(robot.acceleration_breakdown, frame=robot.tip_frame, reference=reference, verify=False)
    serial = ask(q, v, a, base=base, threads=1)
    out = np.full_like(serial.terms, np.nan)
    threaded = ask(q, v, a, base=base, threads=2, out=out)
    assert threaded.terms is out
    for k in (0, ROWS_PER_PART - 1, ROWS_PER_PART, n - 1):
        alone = ask(q[k], v[k], a[k], base=BaseMotion(velocity=base.velocity[k]))
        for parts in (serial, threaded):
            assert not differing(parts.terms[k], alone.terms)
            assert not differing(parts.base[k], alone.base)
    with pytest.raises(InputError, match="out must be a writable"):
        ask(q, v, a, out=out[:-1])


def test_the_error_of_an_overflow_in_a_breakdown_names_the_samples() -> None:
    robot = load("ur5", verify=False)
    q, v, a = state(robot, 2 * ROWS_PER_PART, 14)
    v[ROWS_PER_PART + 3] = 1e200
    with pytest.raises(RangeError, match=f"samples {ROWS_PER_PART} to {2 * ROWS_PER_PART - 1}: "):
        robot.acceleration_breakdown(q, v, a, "tool0", threads=2)


# -- bits of single configurations and of batches --------------------------------------------------

#: Rows of a block, of the next block, and of a partly filled block.
SAMPLES = 2 * LANES + 3
ROWS = (0, 7, 8, LANES - 1, LANES, 2 * LANES, SAMPLES - 1)
KINDS = ("revolute", "prismatic", "continuous")


def chain(joints: int) -> Robot:
    urdf = Urdf(f"chain_{joints}", joints)
    for i in range(joints):
        urdf.add(KINDS[i % 3])
    return loaded(urdf.text, verify=False)


def mixed(floating: bool) -> Robot:
    urdf = Urdf("mixed", 5)
    for kind in ("revolute", "planar", "prismatic", *["floating"] * floating, "continuous", "planar"):
        urdf.add(kind)
    urdf.add("revolute", mimic=("joint_0", -0.7, 0.2))
    return loaded(urdf.text, verify=False)


def faults(robot: Robot, frame: str, q: FloatArray, v: FloatArray, a: FloatArray) -> Iterator[str]:
    batch = dict(by_the_robot(robot, frame, q, v, a))
    for k in [row for row in ROWS if row < len(q)]:
        ways = {"alone": by_the_robot, "prepared": prepared, "as a block": as_a_block}
        for way, compute in ways.items():
            for what, one in compute(robot, frame, q[k], v[k], a[k]):
                if differing(batch[what][k], one):
                    yield f"{what} of {frame}, row {k}, {way}"


#: Robots of every kind, robots with planar, floating and mimic joints, and chains of any length.
SUBJECTS = [
    *(pytest.param(partial(robot_of, name), id=name) for name in NAMES),
    *(pytest.param(partial(mixed, floating), id=f"mixed {floating}") for floating in (False, True)),
    *(
        pytest.param(partial(chain, joints), id=f"chain of {joints}", marks=pytest.mark.slow)
        for joints in (*range(1, 21), 30, 33, 64, 70)
    ),
]


@pytest.mark.parametrize("made", SUBJECTS)
def test_results_are_equal_in_single_calls_and_batches(made: Callable[[], Robot]) -> None:
    robot = made()
    assert list(faults(robot, robot.tip_frame, *state(robot, SAMPLES, 2))) == []


@pytest.mark.slow
@pytest.mark.parametrize(("branches", "joints"), [(2, 4), (3, 8), (5, 7), (4, 17)])
def test_results_at_each_tip_of_a_tree_are_equal_in_single_calls_and_batches(
    branches: int, joints: int
) -> None:
    # Branches begin at one link, so the path to a tip needs only some blocks of coordinates.
    urdf = Urdf("broom", branches)
    for branch, i in product(range(branches), range(joints)):
        urdf.add(KINDS[(branch + i) % 3], None if i else 0, joint=f"b{branch}_{i:02}")
    robot = loaded(urdf.text, verify=False)
    for leaf in robot.tree.leaves():
        assert list(faults(robot, robot.tree.frame_name(leaf), *state(robot, LANES + 1, 4))) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tree_8", "mimic_hand_40_sliding", "planar_and_floating_in_the_middle"])
def test_each_frame_has_equal_results_alone_and_in_a_call_for_all_frames(name: str) -> None:
    robot = robot_of(name)
    x, frames = state(robot, LANES + 1, 5), [f"link:{name}" for name in robot.link_names]
    together = dict(by_the_robot(robot, frames, *x))
    for f, frame in enumerate(frames):
        for what, alone in by_the_robot(robot, frame, *x):
            assert not differing(np.ascontiguousarray(together[what][:, f]), alone), (what, frame)


@pytest.mark.slow
@pytest.mark.parametrize("size", [1e5, 1e7, 1e300])
def test_large_angles_do_not_change_other_rows(size: float) -> None:
    for robot in (robot_of("panda"), mixed(floating=True)):
        q, v, a = state(robot, SAMPLES, 6)
        ours = robot.tree.q_index[robot.tree.joint_index(robot.joint_names[0])]
        q[[3, 8, LANES + 2], ours] = [size, -size, np.nextafter(size, 0.0)]
        assert list(faults(robot, robot.tip_frame, q, v, a)) == []
        q[:, ours] = size * np.linspace(-1.0, 1.0, SAMPLES)
        assert list(faults(robot, robot.tip_frame, q, v, a)) == []


def test_signed_zeros_and_denormal_numbers_give_equal_results_in_single_calls_and_batches() -> None:
    for robot in (robot_of("panda"), mixed(floating=False), chain(9)):
        values = np.array([0.0, -0.0, 5e-324, -5e-324, 1e-310, np.finfo(float).tiny, np.pi, -np.pi / 2])
        generator = np.random.default_rng(7)
        q, v, a = (generator.choice(values, (SAMPLES, n)) for n in (robot.nq, robot.nv, robot.nv))
        q[0], q[1], v[0], a[0] = 0.0, -0.0, -0.0, 0.0
        assert list(faults(robot, robot.tip_frame, q, v, a)) == []
