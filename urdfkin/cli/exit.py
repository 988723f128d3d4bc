"""Exit codes of the commands, error messages, and a clean stop on SIGTERM and SIGHUP.

SIGTERM and SIGHUP stop a command like an interrupt: finished results are saved. Exit code 1 always means a
disagreement. Python also exits with 1 after an uncaught exception, so urdfkin catches such exceptions and
exits with 70.
"""

from __future__ import annotations

import signal
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

import click

from urdfkin.cli import streams
from urdfkin.cli.streams import say
from urdfkin.errors import UrdfkinError

#: A scheduler, `kill` or a shutdown sends SIGTERM, and a closing terminal sends SIGHUP.
_SIGNALS = (signal.SIGTERM, signal.SIGHUP)


@dataclass(slots=True)
class Stop:
    """The number of the signal that stopped the command, or None."""

    signal: int | None = None

    def exit_code(self, otherwise: int) -> int:
        """Return 128 + the number of the signal, as shells do; 1 (a disagreement) has priority."""
        return otherwise if self.signal is None or otherwise == 1 else 128 + self.signal


@contextmanager
def stoppable() -> Iterator[Stop]:
    """Raise KeyboardInterrupt at the first SIGTERM or SIGHUP; ignore later ones so that results are saved.

    After `nohup urdfkin ...`, SIGHUP is ignored.
    """
    stop = Stop()

    def interrupt(number: int, _: FrameType | None) -> None:
        stop.signal = number
        for each in mine:
            signal.signal(each, signal.SIG_IGN)
        raise KeyboardInterrupt

    mine = [each for each in _SIGNALS if signal.getsignal(each) is signal.SIG_DFL]
    for each in mine:
        signal.signal(each, interrupt)
    try:
        yield stop
    finally:
        if stop.signal is None:
            for each in mine:
                signal.signal(each, signal.SIG_DFL)


#: Exit code EX_SOFTWARE of sysexits.h
CRASH = 70
#: Exit code 128 + SIGINT
_INTERRUPTED = 130


def run(command: click.Command, name: str) -> int:
    """Run a command and return its exit code.

    0: done, and verified where possible. 1: a disagreement. 2: bad input or usage. 3: computed, but not
    checked by Pinocchio. 70: a defect of urdfkin. 130: interrupted. 128 + n: stopped by signal n.
    """
    try:
        # In standalone mode, click would exit with 1 after an interrupt.
        try:
            code = command.main(prog_name=name, standalone_mode=False)
        finally:
            streams.finish()
    except click.ClickException as error:
        return _refuse_usage(error)
    except click.Abort:
        click.echo("urdfkin: interrupted", err=True)
        return _INTERRUPTED
    except UrdfkinError as error:
        return refuse(error)
    except Exception as error:
        return crash(error)
    return code if isinstance(code, int) else 0


def refuse(error: UrdfkinError) -> int:
    click.echo(f"urdfkin: error: {error}", err=True)
    return 1 if error.is_disagreement else 2


def _refuse_usage(error: click.ClickException) -> int:
    context = getattr(error, "ctx", None)
    page = f"; see: {context.command_path} --help" if context is not None else ""
    say(f"urdfkin: error: {error.format_message().rstrip('.')}{page}", err=True)
    return error.exit_code


def crash(error: Exception) -> int:
    if isinstance(error, ModuleNotFoundError) and not str(error.name).startswith("urdfkin"):
        # For example, pre-commit installs urdfkin with --no-deps.
        remedy = "install urdfkin with its dependencies: pip install PATH_OF_THE_CLONE"
        click.echo(f"urdfkin: error: {error.name} is not installed; {remedy}", err=True)
        return 2
    click.echo("".join(traceback.format_exception(error)), err=True, nl=False)
    click.echo(
        f"urdfkin: this is a defect of urdfkin, not of your input: {type(error).__name__}."
        f" Please report it in urdfkin's repository, with the lines above and the command (exit {CRASH}).",
        err=True,
    )
    return CRASH
