"""Code for Linux has an alternative for other systems; only CI tests macOS."""

import ctypes
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from urdfkin.compiled.evaluate import default_threads
from urdfkin.export import compiled_frame
from urdfkin.urdf import confinement
from urdfkin.validation import memory


def test_the_number_of_processors_is_known_without_affinity(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "sched_getaffinity")
    assert default_threads(10**6) == os.cpu_count()


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_machine_code_loads_from_a_temporary_file_without_files_in_memory(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    source, library = tmp_path / "twice.c", tmp_path / "twice.so"
    source.write_text("double twice(double x) { return 2.0 * x; }\n")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
    monkeypatch.delattr(os, "memfd_create")
    twice = compiled_frame._load_code(library.read_bytes()).twice
    twice.argtypes, twice.restype = [ctypes.c_double], ctypes.c_double
    assert twice(21.0) == 42.0


def test_no_limit_of_memory_is_derived_where_the_system_states_none(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(memory, "_PROC", tmp_path)
    assert memory.limit(2) is None


@pytest.mark.parametrize("system", ["linux", "darwin"])
def test_the_address_space_is_limited_if_the_system_can(system: str, monkeypatch: pytest.MonkeyPatch) -> None:
    limits: dict[int, tuple[int, int]] = {}
    monkeypatch.setattr(resource, "setrlimit", limits.__setitem__)
    monkeypatch.setattr(sys, "platform", system)
    confinement.limit_process(20)
    assert (resource.RLIMIT_AS in limits) == (system == "linux")
    assert limits.keys() >= {resource.RLIMIT_CPU, resource.RLIMIT_FSIZE, resource.RLIMIT_NPROC}
