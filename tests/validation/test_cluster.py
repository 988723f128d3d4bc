"""A cluster computes what one process does, whoever is killed, and blames a robot and no neighbour."""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import psutil
import pytest
from distributed import Client, LocalCluster
from distributed.comm.core import CommClosedError

from tests.validation.test_store import numbers
from urdfkin.errors import InputError
from urdfkin.validation import cluster
from urdfkin.validation.campaign import stored, validate
from urdfkin.validation.cluster import Cluster, ClusterError, connected
from urdfkin.validation.outcome import Verdict
from urdfkin.validation.provenance import provenance
from urdfkin.validation.standing import Standing
from urdfkin.validation.subject import Subject, subject

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]  # Dask's own, on its way out

ROBOTS = ["planar_two_link", "no such robot", "double_pendulum"]
SAMPLES = 150
#: Whose workers are killed, and with how many seeds: URDFKIN_SEEDS=20 takes some minutes.
KILLED = ["planar_two_link", "double_pendulum"]
SEEDS = int(os.environ.get("URDFKIN_SEEDS", "2"))


@pytest.fixture(scope="module")
def undisturbed() -> str:
    return numbers(validate(ROBOTS, samples=SAMPLES))


@pytest.fixture(scope="module")
def two() -> Iterator[Cluster]:
    """Two workers, for all tests here."""
    said: list[str] = []
    with connected("local:2", said.append) as found:
        assert "2 workers; dashboard: http://127.0.0.1:" in said[0]
        yield found


def test_a_cluster_changes_no_number_and_sends_each_robot_once(
    two: Cluster, undisturbed: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    sent: list[str] = []
    right = Subject.carried

    def carried(self: Subject) -> Subject:
        sent.append(self.label)
        return right(self)

    monkeypatch.setattr(Subject, "carried", carried)
    assert numbers(validate(ROBOTS, samples=SAMPLES, executor=two, store=tmp_path)) == undisturbed
    assert sorted(sent) == sorted(ROBOTS)
    assert numbers(stored(tmp_path)) == undisturbed


def test_what_is_carried_needs_no_file_and_no_catalogue_path(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text('<robot name="a"><link name="l"/></robot>')
    for source in (str(path), "ur5"):
        plain = subject(source)
        carried = pickle.loads(pickle.dumps(plain.carried()))
        assert isinstance(carried.source, bytes)
        path.unlink(missing_ok=True)
        robot = carried.read()
        assert robot.source == source
        if source == "ur5":
            assert (robot.base_frame, robot.tip_frame) == (plain.read().base_frame, plain.read().tip_frame)
            assert {f.file for f in robot.findings} == {f.file for f in plain.read().findings}


def test_no_more_chunks_are_in_flight_than_workers_can_take(two: Cluster) -> None:
    most = 0

    def look(_: Standing) -> None:
        nonlocal most
        most = max(most, len(two._flying))

    assert validate("planar_two_link", samples=1600, executor=two, progress=look).passed
    assert 2 <= most <= 2 * 2 + 4


def test_a_robot_that_kills_its_process_is_blamed_and_none_of_its_neighbours(
    two: Cluster, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """One of fifty, by a signal, as often as it is tried; Dask's workers live on."""
    deaths = tmp_path / "deaths"
    deaths.write_text("99")
    workers = two._client.run(os.getpid)
    one = '<robot name="r{}"><link name="l"/></robot>'
    robots = [*(one.format(i) for i in range(25)), "ur5", *(one.format(i) for i in range(25, 49))]
    two._client.run(_deadly, str(deaths), "tests.validation.deadly_worker")
    try:
        report = validate(robots, samples=0, executor=two)
    finally:
        two._client.run(_deadly, str(deaths), "urdfkin.validation.worker")
    assert [i for i, robot in enumerate(report.robots) if robot.verdict != Verdict.VERIFIED] == [25]
    reason = "ur5: the process that checked it died twice, then alone: found signal SIGSEGV"
    assert report.robots[25].reason == reason
    assert deaths.read_text() == "97"
    assert two._client.run(os.getpid) == workers


def _deadly(deaths: str, module: str) -> None:
    """On a worker: the processes that it starts from now on are others."""
    from urdfkin.validation import child, remote  # noqa: PLC0415

    os.environ["URDFKIN_TEST_DEATHS"] = deaths
    child.WORKER = module
    while remote._idle:
        remote._idle.pop().end()


@pytest.mark.parametrize("seed", range(SEEDS))
def test_workers_killed_at_random_times_cost_time_and_nothing_else(two: Cluster, seed: int) -> None:
    """Dask starts another; `test_workers` has twenty seeds of the processes that compute."""
    rng, killed = np.random.default_rng(seed), list[int]()
    times = rng.choice(np.arange(1, 12), 2, replace=False)

    def kill(standing: Standing) -> None:
        if standing.chunks_done in times:
            time.sleep(rng.uniform(0.0, 0.2))
            while not (workers := _workers()):
                time.sleep(0.05)  # the last one killed has no successor yet
            killed.append(int(rng.choice(workers)))
            os.kill(killed[-1], signal.SIGKILL)

    assert numbers(validate(KILLED, samples=400, executor=two, progress=kill)) == _serial()
    assert len(set(killed)) == 2


@cache
def _serial() -> str:
    return numbers(validate(KILLED, samples=400))


def _workers() -> list[int]:
    """Dask's: each the child of its nanny, beside a process that keeps the books of multiprocessing."""
    found = []
    for nanny in psutil.Process().children():
        with contextlib.suppress(psutil.Error):
            found += [p.pid for p in nanny.children() if "spawn_main" in " ".join(p.cmdline())]
    return found


def test_workers_may_come_and_go(monkeypatch: pytest.MonkeyPatch) -> None:
    """None is there when it begins; Dask starts two for the work, and ends one of them on the way."""
    # Dask's own workers import the main module again, which would run these tests where it has no guard.
    monkeypatch.delattr(sys.modules["__main__"], "__file__", raising=False)
    counts = list[int]()
    with LocalCluster(n_workers=0, threads_per_worker=1, dashboard_address="127.0.0.1:0") as there:
        scaled = there.adapt(minimum=1, maximum=2, target_duration="200ms")

        def count(standing: Standing) -> None:
            counts.append(len(there.scheduler.workers))
            if standing.chunks_done == 8:
                scaled.maximum = 1
            time.sleep(0.2)  # Dask looks once a second

        with connected(there.scheduler_address, lambda said: counts.append(int(said[0]))) as engine:
            found = numbers(validate(KILLED, samples=400, executor=engine, progress=count))
    assert found == _serial()
    assert counts[0] == 0
    assert max(counts) >= 1


def test_another_version_is_refused_before_anything_is_sent(
    two: Cluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = provenance() | {"pin": "3.0.0", "code": "0" * 64}
    monkeypatch.setattr(cluster, "provenance", lambda: other)
    with pytest.raises(ClusterError, match=r"another version computes there: found pin 4\S* there and 3.0.0"):
        cluster._demand_same(two._client)
    report = validate("planar_two_link", samples=0, executor=two)  # a worker that came later
    assert "another version computes there" in str(report.robots[0].reason)


@pytest.mark.parametrize("word", ["local:", "local:0", "local:-1", "local:two"])
def test_a_local_cluster_has_a_number_of_workers(word: str) -> None:
    with pytest.raises(InputError, match="starts N workers"), connected(word):
        pass


def test_where_nobody_answers_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    import dask  # noqa: PLC0415

    with (
        dask.config.set({"distributed.comm.timeouts.connect": "0.5s"}),
        pytest.raises(ClusterError, match="no scheduler answers"),
        connected("tcp://127.0.0.1:9"),
    ):
        pass


def test_a_lost_scheduler_loses_nothing_that_the_store_holds(undisturbed: str, tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    place, started = tmp_path / "scheduler.json", list[subprocess.Popen[bytes]]()

    def start(role: str, *words: str) -> None:
        command = [sys.executable, "-m", f"distributed.cli.dask_{role}", *words]
        out = (tmp_path / f"{role}.txt").open("wb")
        started.append(subprocess.Popen(command, env=environment, stdout=out, stderr=out))

    how = ("--no-dashboard", "--scheduler-file", str(place))
    start("scheduler", "--port", "0", "--host", "127.0.0.1", *how)
    start("worker", "--nthreads", "1", "--no-nanny", "--local-directory", str(tmp_path), *how)
    try:
        while not place.exists():
            time.sleep(0.1)
        with Client(scheduler_file=str(place), set_as_default=False) as client:
            address = client.scheduler.address if client.scheduler else ""

        def killed(standing: Standing) -> None:
            if standing.chunks_done >= 3:
                started[0].kill()

        with contextlib.suppress(Exception), connected(address) as there:
            there._client.wait_for_workers(1)
            report = validate(ROBOTS, samples=SAMPLES, executor=there, store=tmp_path / "s", progress=killed)
    finally:
        for process in started:
            process.kill()
            process.wait()
    assert "the scheduler is lost" in str(report.robots[-1].reason)
    assert "give the same command to go on" in str(report.robots[-1].reason)
    assert numbers(validate(ROBOTS, samples=SAMPLES, store=tmp_path / "s")) == undisturbed


def test_a_scheduler_that_goes_while_a_result_is_on_its_way_is_lost() -> None:
    class Gone:
        status = "finished"

        def result(self) -> None:
            raise CommClosedError("reset by peer")

    there: Any = Cluster(SimpleNamespace(status="running", scheduler=None))  # type: ignore[arg-type]
    with pytest.raises(ClusterError, match="the scheduler is lost"):
        there._found(Gone(), None)
