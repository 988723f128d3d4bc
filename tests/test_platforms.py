"""The parts that use Linux have another way on systems without it; macOS itself is tested in CI only."""

from __future__ import annotations

import os
import resource
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from urdfkin.compiled.batch import default_threads
from urdfkin.urdf import confinement
from urdfkin.validation import memory


def test_the_number_of_processors_is_known_without_affinity(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "sched_getaffinity")
    assert default_threads(10**6) == os.cpu_count()


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_a_compiled_frame_loads_without_files_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "memfd_create")
    robot = urdfkin.load("ur5")
    q = np.full(6, 0.3)
    np.testing.assert_allclose(robot.compiled("tool0").jacobian(q), robot.jacobian(q, "tool0"), atol=1e-15)


def test_no_limit_of_memory_is_derived_where_the_system_states_none(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(memory, "_PROC", tmp_path)
    assert memory.share(2) is None


@pytest.mark.parametrize("system", ["linux", "darwin"])
def test_the_address_space_is_limited_where_the_system_can(
    system: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits: dict[int, tuple[int, int]] = {}
    monkeypatch.setattr(resource, "setrlimit", limits.__setitem__)
    monkeypatch.setattr(sys, "platform", system)
    confinement.limit(20)
    assert (resource.RLIMIT_AS in limits) == (system == "linux")
    assert limits.keys() >= {resource.RLIMIT_CPU, resource.RLIMIT_FSIZE, resource.RLIMIT_NPROC}
