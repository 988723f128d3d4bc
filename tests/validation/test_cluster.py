"""A cluster gives the results of one process, even if workers are killed; a crash is its robot's result."""

import contextlib
import gc
import json
import os
import pickle
import re
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import dask
import numpy as np
import psutil
import pytest
import yaml
from distributed import Client, LocalCluster
from distributed.comm.core import CommClosedError
from distributed.core import Status

from tests.reading import present
from tests.validation import faulty_worker
from tests.validation.test_store import numbers
from urdfkin.errors import InputError
from urdfkin.system.processes import python_command
from urdfkin.validation import cluster
from urdfkin.validation.answer import CRASHED_TWICE
from urdfkin.validation.campaign import read_stored_report, validate
from urdfkin.validation.cluster import Cluster, ClusterError, connect_cluster
from urdfkin.validation.collector import CampaignProgress
from urdfkin.validation.document import ValidationVerdict
from urdfkin.validation.results import provenance
from urdfkin.validation.robot_input import RobotInput, make_robot_input

pytestmark = [pytest.mark.long, pytest.mark.filterwarnings("ignore")]  # Dask warns when it shuts down

ROBOTS = ["planar_two_link", "no such robot", "double_pendulum"]
SAMPLES = 150
KILLED = ["planar_two_link", "double_pendulum"]
#: Number of seeds for killed workers; 20 seeds take some minutes.
SEEDS = int(os.environ.get("URDFKIN_SEEDS", "2"))


@pytest.fixture(scope="module")
def undisturbed() -> str:
    return numbers(validate(ROBOTS, samples=SAMPLES))


@pytest.fixture(scope="module")
def two() -> Iterator[Cluster]:
    """Two local workers."""
    messages: list[str] = []
    with connect_cluster("local:2", messages.append) as found:
        assert messages == ["2 workers"]
        yield found


@pytest.fixture(scope="module")
def processes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Cluster, LocalCluster]]:
    """Two of Dask's worker processes, and the cluster that replaces a killed process."""
    folder = str(tmp_path_factory.mktemp("dask"))
    how: dict[str, Any] = {"threads_per_worker": 1, "dashboard_address": "127.0.0.1:0"}
    with (
        pytest.MonkeyPatch.context() as patch,
        # Time within which Dask must have started a replacement of a lost worker; the default is 15 s.
        dask.config.set({"distributed.deploy.lost-worker-timeout": "600s"}),
        LocalCluster(n_workers=2, local_directory=folder, **how) as there,
    ):
        # Dask's workers import the main module again, which could start these tests again.
        patch.delattr(sys.modules["__main__"], "__file__", raising=False)
        with connect_cluster(there.scheduler_address) as found:
            yield found, there


def test_workers_of_a_local_cluster_open_no_port(two: Cluster) -> None:
    validate("planar_two_link", samples=SAMPLES, executor=two)
    mine = psutil.Process()
    for process in (mine, *mine.children(recursive=True)):
        listening = [c.laddr for c in process.net_connections() if c.status == psutil.CONN_LISTEN]
        assert listening == []
    assert all(address.startswith("inproc://") for address in two._client.nthreads())


def test_a_version_of_dask_that_opens_a_port_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(cluster._WithoutWebServer, "start_http_server")
    with pytest.raises(ClusterError, match="this version of Dask opens a port"), connect_cluster("local:1"):
        pass


def test_a_local_cluster_imports_no_module_from_a_scratch_folder_of_another_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Dask adds its scratch folder to the front of the path."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    planted = tmp_path / "dask-scratch-space"
    planted.mkdir()
    mark = tmp_path / "mark"
    for name in ("json.py", "numpy.py", "pinocchio.py"):
        (planted / name).write_text(f"open({str(mark)!r}, 'w').close()")
    before, seen = list(sys.path), dict[str, int]()
    with connect_cluster("local:1") as there:
        assert sys.path == before
        for folder in there._client.run(lambda dask_worker: dask_worker.local_directory).values():
            above = [place for place in Path(folder).parents if tmp_path in place.parents]
            assert above
            assert planted not in (Path(folder), *above)
            seen |= {str(place): stat.S_IMODE(place.stat().st_mode) for place in above}
        assert seen[min(seen, key=len)] == 0o700
        assert validate("planar_two_link", samples=SAMPLES, executor=there).passed
    assert not mark.exists()
    assert [place.name for place in tmp_path.iterdir()] == ["dask-scratch-space"]


def test_no_process_imports_a_module_from_dasks_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a real cluster, Dask has added its folder to the path before urdfkin is imported."""
    for folder in ("dask-scratch-space", "dask-scratch-space-1000/worker-x"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "planted.py").write_text("")
        monkeypatch.syspath_prepend(str(tmp_path / folder))
        done = subprocess.run(python_command("import planted"), capture_output=True, text=True, check=False)
        assert "No module named 'planted'" in done.stderr


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl")
def test_a_cluster_with_the_settings_of_the_page_serves_only_clients_with_the_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (Path(__file__).parents[2] / "docs" / "campaigns.md").read_text("utf-8")
    make = present(re.search(r"^openssl req .*$", page, re.MULTILINE))
    text = present(re.search(r"^```yaml\n(distributed:.*?)^```$", page, re.MULTILINE | re.DOTALL))[1]
    stranger = tmp_path / "stranger"
    stranger.mkdir()
    for folder in (tmp_path, stranger):
        subprocess.run(make[0].split(), cwd=folder, check=True, capture_output=True)
    config = tmp_path / "dask.yaml"
    config.write_text(text.replace("/home/me/dask", str(tmp_path)))

    def settings_with_key(folder: Path) -> dict[str, Any]:
        mine = yaml.safe_load(text.replace("/home/me/dask", str(folder)))
        merged: dict[str, Any] = dask.config.merge(dask.config.config, mine)
        return merged

    with programs(tmp_path, DASK_CONFIG=str(config)) as start:
        start("scheduler", "--port 0 --host 127.0.0.1")
        start("worker", f"--host 127.0.0.1 --nthreads 1 --no-nanny --local-directory {tmp_path}")
        address = _address(tmp_path)
        assert address.startswith("tls://127.0.0.1:")
        for other in (address, address.replace("tls", "tcp")):
            nobody_answers(other, 2)
        with dask.config.set(settings_with_key(stranger)):
            nobody_answers(address, 2)
        with dask.config.set(settings_with_key(tmp_path)), connect_cluster(address) as there:
            there._client.wait_for_workers(1, timeout=60)
            assert validate("planar_two_link", samples=SAMPLES, executor=there).passed


def test_a_cluster_gives_the_results_of_one_process_and_sends_each_robot_once(
    two: Cluster, undisturbed: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    sent: list[str] = []
    right = RobotInput.with_text

    def with_text(self: RobotInput) -> RobotInput:
        sent.append(self.label)
        return right(self)

    monkeypatch.setattr(RobotInput, "with_text", with_text)
    assert numbers(validate(ROBOTS, samples=SAMPLES, executor=two, store=tmp_path)) == undisturbed
    assert sorted(sent) == sorted(ROBOTS)
    assert numbers(read_stored_report(tmp_path)) == undisturbed


def test_a_robot_sent_to_a_worker_needs_no_file_and_no_catalogue_path(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text('<robot name="a"><link name="l"/></robot>')
    for source in (str(path), "ur5"):
        plain = make_robot_input(source)
        with_text = pickle.loads(pickle.dumps(plain.with_text()))
        assert isinstance(with_text.source, bytes)
        path.unlink(missing_ok=True)
        robot = with_text.make_robot()
        assert robot.source == source
        if source == "ur5":
            assert (robot.base_frame, robot.tip_frame) == (
                plain.make_robot().base_frame,
                plain.make_robot().tip_frame,
            )
            assert {f.file for f in robot.findings} == {f.file for f in plain.make_robot().findings}


def test_the_number_of_pending_chunks_is_bounded(two: Cluster) -> None:
    most = 0

    def count(_: CampaignProgress) -> None:
        nonlocal most
        most = max(most, len(two._pending))

    assert validate("planar_two_link", samples=1600, executor=two, progress=count).passed
    assert 2 <= most <= 2 * 2 + 4


def test_a_crash_is_the_result_of_its_robot_and_the_other_robots_and_dasks_workers_continue(
    two: Cluster, tmp_path: Path
) -> None:
    crashes = tmp_path / "crashes"
    crashes.write_text("99")
    workers = two._client.run(os.getpid)
    one = '<robot name="r{}"><link name="l"/></robot>'
    robots = [*(one.format(i) for i in range(25)), "ur5", *(one.format(i) for i in range(25, 49))]
    two._client.run(_start_processes_of, faulty_worker.MODULE, str(crashes))
    try:
        report = validate(robots, samples=0, executor=two)
    finally:
        two._client.run(_start_processes_of, "urdfkin.validation.worker_processes", "")
    assert [i for i, robot in enumerate(report.robots) if robot.verdict != ValidationVerdict.VERIFIED] == [25]
    assert report.robots[25].reason == f"ur5: {CRASHED_TWICE}: found signal SIGSEGV"
    assert crashes.read_text() == "97"
    assert two._client.run(os.getpid) == workers


def _start_processes_of(module: str, fault: str) -> None:
    """Let a worker start the processes of another module from now on."""
    from urdfkin.validation import remote, worker_processes

    os.environ[faulty_worker.FAULT] = fault
    worker_processes.WORKER_MODULE = module
    remote.end_processes()


_INTERRUPTED_WHILE_A_CHUNK_HANGS = """
import os, signal, threading
from tests.validation import faulty_worker
from urdfkin.validation import worker_processes
from urdfkin.validation.campaign import validate
from urdfkin.validation.cluster import connect_cluster

os.environ[faulty_worker.FAULT] = "hang"
worker_processes.WORKER_MODULE = faulty_worker.MODULE
threading.Timer(3.0, os.kill, (os.getpid(), signal.SIGINT)).start()
with connect_cluster("local:1") as engine:
    assert validate("ur5", samples=0, executor=engine).interrupted
"""


def test_an_interrupt_ends_a_local_cluster_with_a_chunk_that_never_ends() -> None:
    process = subprocess.run(python_command(_INTERRUPTED_WHILE_A_CHUNK_HANGS), timeout=25, check=False)
    assert process.returncode == 0


@pytest.mark.parametrize("seed", range(SEEDS))
def test_killed_workers_of_a_cluster_change_no_result(
    processes: tuple[Cluster, LocalCluster], seed: int
) -> None:
    rng, killed = np.random.default_rng(seed), list[int]()
    times = rng.choice(np.arange(1, 12), 2, replace=False)
    engine, there = processes

    def kill(state: CampaignProgress) -> None:
        if state.chunks_done in times:
            time.sleep(rng.uniform(0.0, 0.2))
            deadline = time.monotonic() + 60
            while not (workers := [worker for worker in _running(there) if worker not in killed]):
                assert time.monotonic() < deadline, "Dask replaced no worker"
                time.sleep(0.05)
            killed.append(int(rng.choice(workers)))
            os.kill(killed[-1], signal.SIGKILL)

    assert numbers(validate(KILLED, samples=400, executor=engine, progress=kill)) == _serial()
    assert len(set(killed)) == 2


def _running(there: LocalCluster) -> list[int]:
    """Return the running workers, which Dask replaces if they end."""
    pids = (nanny.pid for nanny in there.workers.values() if nanny.status == Status.running)
    return [pid for pid in pids if pid is not None]  # A nanny has no pid while its worker ends.


@contextmanager
def programs(folder: Path, **env: str) -> Iterator[Callable[..., subprocess.Popen[bytes]]]:
    """Yield a function that starts Dask's programs, with a file for the scheduler's address in the folder."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), **env}
    started = list[subprocess.Popen[bytes]]()

    def start(role: str, words: str) -> subprocess.Popen[bytes]:
        words = f"--scheduler-file {folder}/scheduler.json {words} --no-dashboard"
        out = (folder / f"{role}.txt").open("wb")
        command = [sys.executable, "-m", f"distributed.cli.dask_{role}", *words.split()]
        started.append(subprocess.Popen(command, env=environment, stdout=out, stderr=out))
        return started[-1]

    try:
        yield start
    finally:
        for process in started:
            process.kill()
            process.wait()


def _address(folder: Path) -> str:
    """Return the address from the scheduler's file, which is empty for a moment."""
    deadline = time.monotonic() + 60
    while True:
        with contextlib.suppress(FileNotFoundError, json.JSONDecodeError):
            return str(json.loads((folder / "scheduler.json").read_text())["address"])
        assert time.monotonic() < deadline, "the scheduler wrote no address"
        time.sleep(0.1)


def nobody_answers(address: str, seconds: float) -> None:
    with (
        dask.config.set({"distributed.comm.timeouts.connect": f"{seconds}s"}),
        pytest.raises(ClusterError, match="no Dask scheduler answers at this address"),
        connect_cluster(address),
    ):
        pass


@cache
def _serial() -> str:
    return numbers(validate(KILLED, samples=400))


def test_the_number_of_workers_may_change_from_none_to_two_and_one(monkeypatch: pytest.MonkeyPatch) -> None:
    # Dask's workers import the main module again, which could start these tests again.
    monkeypatch.delattr(sys.modules["__main__"], "__file__", raising=False)
    counts, warnings = list[int](), list[str]()
    with LocalCluster(n_workers=0, threads_per_worker=1, dashboard_address="127.0.0.1:0") as there:
        scaled = there.adapt(minimum=1, maximum=2, target_duration="200ms")

        def count(state: CampaignProgress) -> None:
            counts.append(len(there.scheduler.workers))
            if state.chunks_done == 8:
                scaled.maximum = 1
            time.sleep(0.2)  # Dask changes the number of workers once a second

        def tell(message: str) -> None:
            if "workers; dashboard: http://127.0.0.1:" in message:
                counts.append(int(message[0]))
            else:
                warnings.append(message)

        with connect_cluster(there.scheduler_address.removeprefix("tcp://"), tell) as engine:
            found = numbers(validate(KILLED, samples=400, executor=engine, progress=count))
    assert found == _serial()
    (warning,) = warnings
    assert warning.startswith("a connection without tls:// is not protected")
    assert counts[0] == 0
    assert max(counts) >= 1


def test_another_version_is_refused_before_any_work(two: Cluster, monkeypatch: pytest.MonkeyPatch) -> None:
    other = provenance() | {"pin": "3.0.0", "code": "0" * 64}
    monkeypatch.setattr(cluster, "provenance", lambda: other)
    words = r"different versions of the code: found pin 4\S* on the cluster and 3"
    with pytest.raises(ClusterError, match=words):
        cluster._check_versions(two._client)
    report = validate("planar_two_link", samples=0, executor=two)  # the check of a worker that starts later
    assert "the cluster and this machine have different versions of the code" in str(report.robots[0].reason)


@pytest.mark.parametrize("word", ["local:", "local:0", "local:-1", "local:two"])
def test_a_local_cluster_has_a_number_of_workers(word: str) -> None:
    with (
        pytest.raises(InputError, match="N in local:N must be a whole number, at least 1"),
        connect_cluster(word),
    ):
        pass


def test_a_client_that_finds_no_scheduler_is_deleted_at_once() -> None:
    """If the garbage collector deleted the client in a thread of Dask, this thread would wait for ever."""

    def clients() -> set[int]:
        return {id(thing) for thing in gc.get_objects() if type(thing) is Client}

    gc.collect()
    before = clients()
    gc.disable()
    try:
        nobody_answers("tcp://127.0.0.1:9", 0.5)
        assert clients() <= before
    finally:
        gc.enable()


def test_a_run_resumes_from_its_store_after_the_scheduler_was_lost(undisturbed: str, tmp_path: Path) -> None:
    with programs(tmp_path) as start:
        scheduler = start("scheduler", "--port 0 --host 127.0.0.1")
        start("worker", f"--nthreads 1 --no-nanny --local-directory {tmp_path}")

        def kill(state: CampaignProgress) -> None:
            if state.chunks_done >= 3:
                scheduler.kill()

        with contextlib.suppress(Exception), connect_cluster(_address(tmp_path)) as there:
            there._client.wait_for_workers(1, timeout=60)
            report = validate(ROBOTS, samples=SAMPLES, executor=there, store=tmp_path / "s", progress=kill)
    reason = str(report.robots[-1].reason)
    assert "connection to the scheduler is lost" in reason
    assert "repeat the same command" in reason
    assert numbers(validate(ROBOTS, samples=SAMPLES, store=tmp_path / "s")) == undisturbed


def test_a_scheduler_that_is_lost_while_a_result_arrives_is_an_error() -> None:
    gone = Mock(status="finished", **{"result.side_effect": CommClosedError("reset by peer")})
    there: Any = Cluster(SimpleNamespace(status="running", scheduler=None))  # type: ignore[arg-type]
    with pytest.raises(ClusterError, match="connection to the scheduler is lost"):
        there._take_answer(gone, None, 1)
