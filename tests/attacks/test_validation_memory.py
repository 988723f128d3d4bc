"""The memory of a validation is estimated before use, bounded, and linear in the number of links."""

import resource
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import urdfkin
from tests.attacks.test_validation_runs import chunks
from tests.cli.running import python
from tests.urdfs import chain, joint, limit
from urdfkin.compiled import evaluate
from urdfkin.compiled.plan import compile_tree
from urdfkin.errors import OracleError
from urdfkin.validation import chunk as chunk_module
from urdfkin.validation import memory
from urdfkin.validation.campaign import validate
from urdfkin.validation.chunk import run_chunk
from urdfkin.validation.document import ValidationVerdict
from urdfkin.validation.robot_input import make_robot_input
from urdfkin.verify.pinocchio import PinocchioOracle

GB = 10**9


def test_blocks_contain_each_item_once_and_processes_share_half_of_the_free_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(memory, "MAX_BLOCK_BYTES", 1000)
    for count, size, most in ((10, 300, 3), (9, 300, 3), (1, 300, 1), (5, 2000, 1), (0, 300, 0)):
        found = list(memory.blocks(count, size))
        assert [i for block in found for i in range(count)[block]] == list(range(count))
        assert max(block.stop - block.start for block in found) == most
    monkeypatch.setattr(memory, "_find_free_bytes", lambda: iter([12 * GB, 8 * GB]))
    assert memory.limit() == 4 * GB
    assert memory.limit(4) == GB
    monkeypatch.setattr(memory, "_find_free_bytes", lambda: iter([]))
    assert memory.limit() is None


@pytest.mark.long
@pytest.mark.parametrize("source", ["talos", "double_pendulum", "planar_two_link"])
@pytest.mark.parametrize("root_joint", [None, "planar"])
def test_comparing_in_blocks_changes_no_number(
    source: str, root_joint: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    (chunk,) = chunks(make_robot_input(source, None, root_joint), 5, 3)
    whole = run_chunk(chunk)
    monkeypatch.setattr(memory, "MAX_BLOCK_BYTES", 2 * memory.frame_array_bytes(8, len(whole.joints)))
    parts = run_chunk(chunk)
    assert parts.error_stats == whole.error_stats
    assert list(parts.error_stats) == list(whole.error_stats)


@pytest.mark.long
def test_no_array_of_a_block_is_larger_than_a_block(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes: list[int] = []

    def recorded(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **kwargs: Any) -> Any:
            result = function(*args, **kwargs)
            sizes.extend(part.nbytes for part in (result if isinstance(result, tuple) else (result,)))
            return result

        return call

    for name in ("placements", "velocities", "accelerations", "jacobians", "jacobian_rates"):
        for where in (evaluate, PinocchioOracle):
            monkeypatch.setattr(where, name, recorded(getattr(where, name)))
    monkeypatch.setattr(memory, "MAX_BLOCK_BYTES", 100_000)
    (chunk,) = chunks(make_robot_input("talos"), 5, 3)
    run_chunk(chunk)
    assert len(sizes) > 100
    assert 50_000 < max(sizes) <= 100_000


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
def test_the_memory_of_a_compiled_tree_is_linear_in_the_number_of_links() -> None:
    peaks = []
    for links in (500, 2000):
        tree = urdfkin.load(chain([""] * links, "fixed")).tree
        tracemalloc.start()
        compile_tree(tree, range(len(tree.links)))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 6 * peaks[0]


@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
def test_a_compiled_tree_has_the_joints_and_depths_of_the_paths_to_its_frames() -> None:
    robot = urdfkin.load("talos")
    links = [5, 40, 0, 17, 40]
    plan = compile_tree(robot.tree, links)
    paths = [robot.tree.path(link) for link in links]
    assert plan.depth.tolist() == [len(path) for path in paths]
    wanted = sorted({i for path in paths for i in path if robot.tree.joints[i].kind.nv})
    assert list(plan.joints) == wanted
    for (_, place), independent_joints in zip(plan.frames, plan.target_columns, strict=True):
        own = {wanted.index(i) for i in paths[place] if i in wanted}
        assert {
            int(plan.columns[c, 0]) for c in range(len(plan.columns)) if independent_joints[c] >= 0
        } == own


def test_a_robot_that_needs_too_much_memory_is_not_verified_and_pinocchio_builds_no_model(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(memory, "limit", lambda processes=1: 2_000_000 // processes)
    monkeypatch.setattr(PinocchioOracle, "__init__", pytest.fail)
    monkeypatch.setattr(chunk_module, "_cache", {})
    robot = validate("talos", samples=1).robots[0]
    assert robot.verdict is ValidationVerdict.NOT_VERIFIED
    message = "not enough memory to check the robot (all processes of a validation may use 50% of the free"
    assert message in str(robot.reason)
    assert "GB needed, 0.002 GB allowed for each process" in str(robot.reason)
    assert robot.summary.model is not None


@pytest.mark.long
def test_the_needed_memory_grows_with_the_cube_of_nv_and_with_the_links() -> None:
    trees = [urdfkin.load(chain([limit()] * n, "revolute")).tree for n in (100, 200)]
    needs = [memory.estimate_bytes(tree, 28) for tree in trees]
    assert needs[1] - needs[0] >= 64 * (200**3 - 100**3)
    assert needs[0] == 64 * 100**3 + 24_000 * 101 + 12 * min(32 * 2**20, 2 * 101 * 28 * 8 * 600)
    one_link = urdfkin.load('<robot name="r"><link name="l0"/></robot>').tree
    assert memory.estimate_bytes(one_link, 28) == 24_000 + 12 * 2 * 28 * 8 * 16
    leaves = (f'<link name="e{i}"/>' + joint(f"e{i}", "fixed", "l100", f"e{i}") for i in range(1000))
    wide = chain([limit()] * 100, "revolute").replace("</robot>", "".join([*leaves, "</robot>"]))
    assert memory.estimate_bytes(urdfkin.load(wide).tree, 28) > needs[0] + 1000 * 16_000
    memory.check(trees[0], 28, needs[0])
    memory.check(trees[0], 28, None)
    with pytest.raises(OracleError, match="not enough memory"):
        memory.check(trees[0], 28, needs[0] - 1)


MACHINE = {"proc/meminfo": "MemTotal: 9000000 kB\nMemAvailable:  8000000 kB\n"}
CONTAINER = MACHINE | {
    "proc/self/cgroup": "4:memory:/docker/abc\n2:cpu:/docker/abc\n",
    "cgroup/memory/memory.limit_in_bytes": "3000000000\n",
    "cgroup/memory/memory.usage_in_bytes": "1000000000\n",
}
OUTER_GROUP = MACHINE | {
    "proc/self/cgroup": "0::/outer/inner\n",
    "cgroup/outer/memory.max": "6000000000\n",
    "cgroup/outer/memory.current": "5000000000\n",
    "cgroup/outer/memory.stat": "anon 1\ninactive_file 2000000000\n",  # these files count as free memory
    "cgroup/outer/inner/memory.max": "max\n",
    "cgroup/outer/inner/memory.current": "1000000000\n",
}
INNER_GROUP = OUTER_GROUP | {"cgroup/outer/inner/memory.max": "1500000000\n"}


@pytest.mark.parametrize(
    ("files", "limit"),
    [(MACHINE, 4_096_000_000), (CONTAINER, GB), (OUTER_GROUP, 1_500_000_000), (INNER_GROUP, 250_000_000)],
    ids=["machine", "container", "outer group", "inner group"],
)
def test_the_memory_limit_is_half_of_the_free_memory_of_the_machine_container_or_control_group(
    files: dict[str, str], limit: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "_PROC", tmp_path / "proc")
    monkeypatch.setattr(memory, "_CGROUPS", tmp_path / "cgroup")
    monkeypatch.setattr(resource, "getrlimit", lambda _: (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    assert memory.limit() == limit


@pytest.mark.long
def test_the_memory_limit_depends_on_the_limit_of_the_process() -> None:
    done = python(
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (3 * 10**9,) * 2)\n"
        "from urdfkin.validation import memory; print(memory.limit())"
    )
    assert 0 < int(done.stdout) < 1.5 * GB


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
def test_many_fixed_links_are_checked_in_little_memory() -> None:
    done = python(
        "import resource, sys, warnings; warnings.simplefilter('ignore')\n"
        "from tests.urdfs import chain\n"
        "from urdfkin.validation.campaign import validate\n"
        "def peak(): return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024\n"
        "assert validate(chain([''] * 300, 'fixed'), samples=1).passed\n"
        "before = peak()\n"
        "assert validate(chain([''] * 5000, 'fixed'), samples=1).passed\n"
        "print(peak() - before)"
    )
    assert int(done.stdout) < 400  # MB; the paths to all frames took 1 GB
