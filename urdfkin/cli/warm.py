"""`urdfkin warm`: compile all kernels, so that later commands start fast."""

from __future__ import annotations

import time

import click

from urdfkin.cli.streams import say
from urdfkin.errors import SourceError


@click.command(epilog="Example: urdfkin warm")
def command() -> None:
    """Compile all kernels (machine code for batches) and store them, for container images and CI.

    Without this command, urdfkin compiles a kernel when computations without the kernel take too long, for
    example for a large batch. Each compilation takes some seconds. Kernels are stored below XDG_CACHE_HOME.
    On another processor, the kernels are compiled again.

    Exit 0: all kernels are stored. 2: the kernels cannot be stored.
    """
    from urdfkin.compiled.kernel_cache import kernel_cache_folder, listen_to_compile_events
    from urdfkin.compiled.machine import kernels
    from urdfkin.compiled.machine.single import one_configuration
    from urdfkin.verify.comparison import load_kernels

    folder = kernel_cache_folder()
    if folder is None:
        raise SourceError(
            "no folder to store compiled kernels in",
            remedy="set XDG_CACHE_HOME to a folder that only you can write to",
        )
    begin, before = time.perf_counter(), set(folder.glob("*.kernel"))

    def report(name: str, seconds: float | None) -> None:
        say(f"compiling {name} ..." if seconds is None else f"compiled {name} in {seconds:.1f} s", err=True)

    with listen_to_compile_events(report):
        load_kernels()
        for kernel in (kernels.hessians, kernels.imus, one_configuration):
            _ = kernel.compiled_function
    stored = set(folder.glob("*.kernel"))
    if new := stored - before:
        say(f"{len(new)} of {len(stored)} kernels compiled in {time.perf_counter() - begin:.0f} s: {folder}")
    else:
        say(f"all {len(stored)} kernels are compiled: {folder}")
