"""Signals that ask a command to end do so as an interrupt does: what had finished is kept and written.

How the command ends: what everybody may raise, in words and exit codes; a crash is one of its own.

Exit 1 is a disagreement and nothing else; Python's own exit code of an uncaught exception is 1 as well.
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

#: From a scheduler, `kill` or a shutdown; and from a terminal that is closed.
_SIGNALS = (signal.SIGTERM, signal.SIGHUP)


@dataclass(slots=True)
class Stop:
    """Which signal asked to end; None: none did.

    Attributes:
        signal: Its number.
    """

    signal: int | None = None

    def exit_code(self, otherwise: int) -> int:
        """128 and the signal's number, as shells have it; a disagreement that was found stays one."""
        return otherwise if self.signal is None or otherwise == 1 else 128 + self.signal


@contextmanager
def stoppable() -> Iterator[Stop]:
    """While open, the first SIGTERM or SIGHUP raises KeyboardInterrupt; from then on there is time to write.

    A signal that the parent had ignored (`nohup`) stays ignored.
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


#: EX_SOFTWARE of sysexits.h.
CRASH = 70
#: 128 and SIGINT's number, as shells have it.
_INTERRUPTED = 130


def run(command: click.Command, name: str) -> int:
    """Run a command; its exit code.

    0: done, and verified where it could be. 1: a disagreement. 2: bad input or usage. 3: computed, but
    Pinocchio did not check it. 70: a defect of urdfkin. 130: interrupted.
    """
    try:
        # click's own way out gives 1 to an interrupt.
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
    """Say an error that was raised on purpose; its exit code."""
    click.echo(f"urdfkin: error: {error}", err=True)
    return 1 if error.is_disagreement else 2


def _refuse_usage(error: click.ClickException) -> int:
    """Say what click refused, as everything else is said."""
    context = getattr(error, "ctx", None)
    page = f"; see: {context.command_path} --help" if context is not None else ""
    say(f"urdfkin: error: {error.format_message().rstrip('.')}{page}", err=True)
    return error.exit_code


def crash(error: Exception) -> int:
    """Say an error that nobody foresaw, and what to do about it; its exit code."""
    if isinstance(error, ModuleNotFoundError) and not str(error.name).startswith("urdfkin"):
        # Installed with --no-deps, as pre-commit does.
        missing = f"{error.name} is not installed; pip install urdfkin with all it needs"
        click.echo(f"urdfkin: error: {missing}", err=True)
        return 2
    click.echo("".join(traceback.format_exception(error)), err=True, nl=False)
    click.echo(
        f"urdfkin: this is a defect of urdfkin, not of what it was given: {type(error).__name__}."
        f" Please report it, with the lines above and the command, in urdfkin's repository (exit {CRASH}).",
        err=True,
    )
    return CRASH
