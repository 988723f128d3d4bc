"""Compilation is reported once for each kernel, and wrong input starts no compilation."""

import time
from pathlib import Path
from typing import NoReturn

import pytest

import urdfkin as library
from tests.cli.running import process, urdfkin
from urdfkin.compiled import kernel_cache, preload
from urdfkin.compiled.machine import kernels as every_kernel
from urdfkin.compiled.machine.compiling import Kernel
from urdfkin.validation import campaign
from urdfkin.verify import kernels as checking


def kernels(cache: Path) -> list[str]:
    return sorted(path.name.split(".")[1] for path in cache.rglob("*.kernel"))


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        "validate no.urdf", "jacobian no.urdf", "jacobian elbow --frame no", "jacobian elbow --q 1",
        "jacobian elbow -o no/J.csv", "dh no.urdf", "validate BAD",
    ],
)  # fmt: skip
def test_wrong_input_is_reported_before_any_compilation(words: str, tmp_path: Path) -> None:
    bad = tmp_path / "bad.urdf"
    bad.write_text('<robot name="r"><link name="a"/><link name="b"/></robot>')
    done = process(*words.replace("BAD", str(bad)).split(), XDG_CACHE_HOME=str(tmp_path / "cache"))
    assert done.code == 2
    assert "compiling" not in done.err
    assert kernels(tmp_path) == []


@pytest.mark.long
def test_only_needed_kernels_are_compiled_and_reported_once(tmp_path: Path) -> None:
    words = ("placement", "elbow", "--no-verify", "--q", "random:20000", "--format", "npy")
    first = process(*words, XDG_CACHE_HOME=str(tmp_path))
    assert kernels(tmp_path) == ["placements"]
    assert first.err.count("urdfkin: compiling placements for this machine, once; 'urdfkin warm'") == 1
    assert first.err.count("'urdfkin warm'") == 1
    assert first.err.count("urdfkin: compiled placements in ") == 1
    assert "compil" not in process(*words, XDG_CACHE_HOME=str(tmp_path)).err


def test_after_warm_no_process_is_started_to_compile(monkeypatch: pytest.MonkeyPatch) -> None:
    assert urdfkin("warm").code == 0
    done = urdfkin("warm")
    assert (done.code, done.err) == (0, "")
    assert done.text.startswith("all ")
    assert "kernels are compiled: " in done.text

    def fail(*_: object, **__: object) -> NoReturn:
        pytest.fail("a process was started")

    monkeypatch.setattr(preload, "_start_compiler", fail)
    preload.load_all_kernels()


@pytest.mark.long
def test_warm_compiles_every_kernel_of_the_package(tmp_path: Path) -> None:
    done = process("warm", XDG_CACHE_HOME=str(tmp_path))
    assert done.code == 0, done.err
    found = [vars(module).items() for module in (every_kernel, checking)]
    every = {name for values in found for name, value in values if isinstance(value, Kernel)}
    assert {"hessians", "imus", "lengths"} <= every <= set(kernels(tmp_path))


def test_compilation_is_logged_as_one_warning(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kernel_cache, "_logged", [])
    for name in ("placements", "jacobians"):
        with kernel_cache.compile_event(name) as missed:
            missed()
    with kernel_cache.compile_event("velocities"):
        pass  # the kernel is in the cache
    (record,) = caplog.records
    assert (record.name, record.levelname) == ("urdfkin", "WARNING")
    assert "compiling placements" in record.getMessage()


@pytest.mark.slow
def test_the_time_in_a_report_excludes_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "load_kernels", lambda: time.sleep(1.0))
    monkeypatch.setattr(campaign, "_should_load_kernels", lambda samples: True)
    begin = time.perf_counter()
    assert library.validate("elbow", samples=1).seconds < time.perf_counter() - begin - 1.0
