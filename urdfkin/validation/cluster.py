"""Engine that runs chunks on a dask.distributed cluster (the extra `urdfkin[cluster]`).

The number of workers may change during the run.
"""

from __future__ import annotations

import gc
import logging
import pickle
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib import metadata
from itertools import chain
from typing import Any

import dask
from distributed import Client, Future, KilledWorker, Scheduler, SpecCluster, Worker, as_completed

from urdfkin.errors import InputError, UrdfkinError
from urdfkin.urdf.sources import Origin
from urdfkin.validation import remote, results
from urdfkin.validation.answer import (
    CRASHED_TWICE,
    Answer,
    Failure,
    make_crash_failure,
    make_failure,
    make_lost_failure,
)
from urdfkin.validation.engines import AnswerCallback, Task, Work
from urdfkin.validation.results import provenance
from urdfkin.validation.robot_input import RobotInput
from urdfkin.verify.oracles import package_version

#: At most 2 chunks for each thread, plus 4 chunks, wait for an answer. Every thread then always has a next
#: chunk.
_CHUNKS_PER_THREAD, _EXTRA_CHUNKS = 2, 4
#: Maximum number of times that a chunk is sent. A chunk is sent again if Dask loses the worker. A high number
#: is safe, because a chunk can crash a child process of a Dask worker, but not the worker itself.
_MAX_TRIES = 20
#: Minimum time (s) between two readings of the number of worker threads.
_REFRESH_SECONDS = 1.0
#: Packages that must have the same version here and on the scheduler, if the scheduler has them.
_COMPARED_PACKAGES = ("urdfkin", "pin")
_EMPTY_ROBOT_INPUT = RobotInput(b"", Origin(""))


class ClusterError(UrdfkinError, RuntimeError):
    """The cluster cannot be used, or the connection to the cluster was lost."""


@contextmanager
def connect_cluster(scheduler: str, tell: Callable[[str], None] = lambda _: None) -> Iterator[Cluster]:
    """Yield an engine on a cluster, for `validate(executor=...)`.

    Args:
        scheduler: Address of a scheduler, such as `tls://host:8786`, or `local:N` for N local workers. Local
            workers open no port, and stop when the context ends.
        tell: Function that receives messages for the user.

    Raises:
        ClusterError: No scheduler answers. A worker cannot run urdfkin, or has another version or other code.
            Dask opens a port for local workers.
        InputError: N in `local:N` is not a whole number, or is below one.
    """
    with _connect_client(scheduler) as client:
        _check_versions(client)
        threads = client.nthreads()
        dashboard = f"; dashboard: {client.dashboard_link}" if client.dashboard_link else ""
        tell(f"{len(threads)} worker{'' if len(threads) == 1 else 's'}{dashboard}")
        address = str(getattr(client.scheduler, "address", scheduler))
        if not scheduler.startswith("local:") and not address.startswith("tls://"):
            tell(
                "a connection without tls:// is not protected: anyone who reaches the scheduler can run"
                " programs; docs/campaigns.md describes tls://"
            )
        yield Cluster(client)


@contextmanager
def _connect_client(scheduler: str) -> Iterator[Client]:
    kind, _, number = scheduler.partition(":")
    if kind != "local":
        try:
            client = Client(scheduler, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:  # Without a certificate, tls:// raises TypeError.
            found = str(error)
        else:
            with client:
                yield client
            return
        # Delete the client in this thread. Dask hangs if another thread deletes the client.
        gc.collect()
        key_hint = "; give Dask the cluster's certificate and key, as docs/campaigns.md describes"
        raise ClusterError(
            "no Dask scheduler answers at this address",
            where=scheduler,
            found=found,
            remedy="start a scheduler with: dask scheduler" + (key_hint if kind == "tls" else ""),
        )
    if not number.isdecimal() or not int(number):
        raise InputError(
            "`scheduler`: N in local:N must be a whole number, at least 1",
            found=repr(scheduler),
            remedy="give local:2",
        )
    with _start_local_cluster(int(number)) as cluster, Client(cluster, set_as_default=False) as client:
        yield client


class _WithoutWebServer:
    """Scheduler or worker without Dask's web pages, which every user of the machine could read."""

    def start_http_server(self, *_: object, **__: object) -> None: ...


class _LocalScheduler(_WithoutWebServer, Scheduler):
    pass


class _LocalWorker(_WithoutWebServer, Worker):
    pass


@contextmanager
def _start_local_cluster(workers: int) -> Iterator[SpecCluster]:
    """Yield a scheduler and workers in this process, without an open port.

    Dask adds its scratch folder to `sys.path`, where another user could place modules. Therefore, only the
    current user can access the folder, and the function restores `sys.path`.
    """
    with tempfile.TemporaryDirectory(prefix="urdfkin-") as scratch:
        scheduler: dict[str, Any] = {"protocol": "inproc://", "dashboard": False}
        worker = {"nthreads": 1, "memory_limit": 0, "local_directory": scratch, "dashboard": False}
        path = list(sys.path)
        with (
            dask.config.set({"temporary-directory": scratch}),
            SpecCluster(
                scheduler={"cls": _LocalScheduler, "options": scheduler},
                workers={i: {"cls": _LocalWorker, "options": worker} for i in range(workers)},
                silence_logs=logging.ERROR,
            ) as cluster,
        ):
            sys.path[:] = path
            for server in (cluster.scheduler, *cluster.workers.values()):
                if server.services or not str(server.address).startswith("inproc://"):
                    raise ClusterError(
                        "this version of Dask opens a port for local workers",
                        found=str(server.address),
                        remedy="use --jobs, or install another version of the package `distributed`",
                    )
            try:
                yield cluster
            finally:
                remote.end_processes()


def _check_versions(client: Client) -> None:
    for worker, found in client.run(results.provenance, on_error="return").items():
        if isinstance(found, BaseException):
            remedy = f"install urdfkin {package_version('urdfkin')} on the worker's machine"
            raise ClusterError("a worker cannot run urdfkin", where=worker, found=str(found), remedy=remedy)
        _check_code(worker, found)
    for name in _COMPARED_PACKAGES:
        try:
            found = client.run_on_scheduler(metadata.version, name)
        except Exception:  # The scheduler computes nothing, so it does not need the package.
            continue
        own = package_version(name)
        if own not in (found, "a checkout"):
            _raise_difference("scheduler", [f"{name} {found} on the cluster and {own} on this machine"])


def _check_code(worker: str, versions_on_cluster: dict[str, str]) -> None:
    local = provenance()
    differences = [
        f"{k} {versions_on_cluster.get(k, 'none')[:12]} on the cluster and {local[k][:12]} on this machine"
        for k in local
        if versions_on_cluster.get(k) != local[k]
    ]
    if differences:
        _raise_difference(worker, differences)


def _raise_difference(where: str, differences: list[str]) -> None:
    raise ClusterError(
        "the cluster and this machine have different versions of the code",
        where=where,
        found=", ".join(differences),
        remedy="install the same versions on all machines; results of different versions are not mixed",
    )


class Cluster:
    def __init__(self, client: Client) -> None:
        self._client = client
        #: Sent chunks without an answer: the task, and the number of times that the chunk was sent.
        self._pending: dict[Future[Any], tuple[Task, int]] = {}
        #: Maps a robot's index to the future of the robot's text, which the workers store.
        self._robot_texts: dict[int, Future[bytes]] = {}
        #: Number of sent chunks without an answer, by robot.
        self._pending_counts = Counter[int]()
        self._limit, self._limit_time = _EXTRA_CHUNKS, float("-inf")

    def run(self, work: Work, on_answer: AnswerCallback) -> None:
        all_tasks, failed_robots = chain.from_iterable(work), set[int]()
        completed = as_completed(loop=self._client.loop)
        try:
            while True:
                while (
                    len(self._pending) < self._update_limit() and (task := next(all_tasks, None)) is not None
                ):
                    if task.robot in failed_robots:
                        continue
                    try:
                        completed.add(self._send(task, 1))
                    except (UrdfkinError, OSError) as error:  # The file cannot be read or has changed.
                        failed_robots.add(task.robot)
                        on_answer(task, make_failure(task.chunk.robot_input, error))
                if not self._pending:
                    return
                future = next(completed)
                task, tries = self._pending.pop(future)
                answer = self._take_answer(future, task, tries)
                if answer is None:
                    completed.add(self._send(task, tries + 1))
                else:
                    if isinstance(answer, Failure):
                        failed_robots.add(task.robot)
                    on_answer(task, answer)
                self._release_robot(task.robot)
        finally:
            if self._client.status == "running":
                self._client.cancel(list(self._pending))
            self._pending.clear()
            self._robot_texts.clear()

    def _update_limit(self) -> int:
        if time.monotonic() - self._limit_time > _REFRESH_SECONDS and self._client.status == "running":
            threads = sum(self._client.nthreads().values())
            self._limit, self._limit_time = _CHUNKS_PER_THREAD * threads + _EXTRA_CHUNKS, time.monotonic()
        return self._limit

    def _send(self, task: Task, tries: int) -> Future[Any]:
        if (robot := self._robot_texts.get(task.robot)) is None:
            data = pickle.dumps(task.chunk.robot_input.with_text())
            robot = self._robot_texts[task.robot] = self._client.submit(remote.store_robot, data, pure=False)
        chunk = pickle.dumps(replace(task.chunk, robot_input=_EMPTY_ROBOT_INPUT))
        future = self._client.submit(remote.run, robot, chunk, provenance(), pure=False)
        self._pending[future] = task, tries
        self._pending_counts[task.robot] += 1
        return future

    def _release_robot(self, robot: int) -> None:
        """Delete the robot's text on the workers, unless a chunk of the robot is pending."""
        self._pending_counts[robot] -= 1
        if not self._pending_counts[robot]:
            del self._pending_counts[robot]
            self._robot_texts.pop(robot, None)

    def _take_answer(self, future: Future[Any], task: Task, tries: int) -> Answer | None:
        """Return the answer; None if the chunk must be sent again."""
        if future.status == "finished":
            try:
                result = future.result()
            except OSError as lost_error:  # The connection to the scheduler is lost.
                raise self._make_lost_error() from lost_error
            return _as_answer(result, task)
        if self._client.status != "running":
            raise self._make_lost_error()
        error = future.exception() if future.status == "error" else None
        if tries < _MAX_TRIES and (error is None or isinstance(error, KilledWorker)):
            return None
        cause = error if isinstance(error, Exception) else RuntimeError(future.status)
        return make_lost_failure("the cluster lost the chunk", cause)

    def _make_lost_error(self) -> ClusterError:
        return ClusterError(
            "the connection to the scheduler is lost",
            where=str(self._client.scheduler.address if self._client.scheduler else "the cluster"),
            remedy="start the scheduler again and repeat the same command; a store keeps the finished chunks",
        )


def _as_answer(outcome: remote.ChunkOutcome, task: Task) -> Answer:
    if outcome[0] == "died":
        return make_crash_failure(task.chunk.robot_input, CRASHED_TWICE, outcome[1])
    if outcome[0] == "other code":
        _check_code("a worker", outcome[1])
    answer: Answer = pickle.loads(outcome[1])  # type: ignore[arg-type]
    return answer
