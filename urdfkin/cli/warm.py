"""`urdfkin warm`: compile everything now, so that nothing is compiled later."""

from __future__ import annotations

import time

import click

from urdfkin.cli.streams import say
from urdfkin.errors import SourceError

EXAMPLE = "urdfkin warm"


@click.command(epilog=f"Example: {EXAMPLE}")
def command() -> None:
    """Compile every kernel for this machine, and keep it: for container images and CI.

    Commands and programs compile each kernel when they first need it, some seconds each. XDG_CACHE_HOME says
    where they are kept; kernels of another processor are compiled again. Exit 2: they cannot be kept.
    """
    from urdfkin.compiled.compiling import cache_folder, listen_to_compile_events  # noqa: PLC0415
    from urdfkin.compiled.single import one_configuration  # noqa: PLC0415
    from urdfkin.verify.ahead import load_kernels  # noqa: PLC0415

    folder = cache_folder()
    if folder is None:
        raise SourceError(
            "there is no folder to keep kernels in", remedy="set XDG_CACHE_HOME to one that is yours alone"
        )
    begin, before = time.perf_counter(), set(folder.glob("*.kernel"))

    def tell(name: str, seconds: float | None) -> None:
        say(f"compiling {name} ..." if seconds is None else f"compiled {name} in {seconds:.1f} s", err=True)

    with listen_to_compile_events(tell):
        load_kernels()
        _ = one_configuration.compiled
    kept = set(folder.glob("*.kernel"))
    if new := kept - before:
        say(f"{len(new)} of {len(kept)} kernels compiled in {time.perf_counter() - begin:.0f} s: {folder}")
    else:
        say(f"all {len(kept)} kernels are compiled: {folder}")
