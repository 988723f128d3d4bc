"""Run a command: exit codes, error messages, and a clean stop on SIGTERM and SIGHUP.

SIGTERM and SIGHUP stop `urdfkin validate` like an interrupt: finished results are saved. Exit code 1 always
means a negative result, such as a disagreement, and never a crash. Python exits with 1 after an uncaught
exception, so urdfkin catches unexpected exceptions and exits with 70.
"""

from __future__ import annotations

import signal
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any, TypeVar

import click

from urdfkin.cli import streams
from urdfkin.cli.streams import say
from urdfkin.errors import UrdfkinError

#: SIGTERM comes from `kill`, a scheduler or a shutdown. SIGHUP comes from a closing terminal.
_SIGNALS = (signal.SIGTERM, signal.SIGHUP)


_T = TypeVar("_T")


@dataclass(slots=True)
class Stop:
    signal: int | None = None

    def exit_code(self, default: int) -> int:
        """Return 128 + n after signal n, as shells do, or `default` if no signal has arrived.

        A signal does not change the exit code 1, which reports a disagreement.
        """
        return default if self.signal is None or default == 1 else 128 + self.signal

    def interrupting(self, function: Callable[[_T], None]) -> Callable[[_T], None]:
        """Return a function that calls `function`, or raises KeyboardInterrupt after a signal."""

        def call(argument: _T) -> None:
            self.raise_if_signal()
            function(argument)

        return call

    def raise_if_signal(self) -> None:
        """Raise KeyboardInterrupt if a signal has arrived.

        Python ignores an exception in a destructor, so the exception of a signal handler can get lost there.
        """
        if self.signal is not None:
            raise KeyboardInterrupt


@contextmanager
def handle_signals() -> Iterator[Stop]:
    """Raise KeyboardInterrupt at the first SIGTERM or SIGHUP.

    Later signals are ignored, so that finished results are saved.
    """
    stop = Stop()
    # Only default handlers are replaced, so that SIGHUP stays ignored under `nohup`.
    numbers = [number for number in _SIGNALS if signal.getsignal(number) is signal.SIG_DFL]

    def handle(handler: Any) -> None:
        for number in numbers:
            signal.signal(number, handler)

    def interrupt(number: int, _: FrameType | None) -> None:
        stop.signal = number
        handle(signal.SIG_IGN)
        raise KeyboardInterrupt

    handle(interrupt)
    try:
        yield stop
    finally:
        if stop.signal is None:
            handle(signal.SIG_DFL)


#: Exit code EX_SOFTWARE of sysexits.h
CRASH_EXIT_CODE = 70
_INTERRUPTED_EXIT_CODE = 128 + signal.SIGINT


def run(command: click.Command, name: str) -> int:
    """Run a command and return its exit code.

    0: success. 1: a negative result, such as a disagreement. 2: bad input or usage. 3: not checked by
    Pinocchio, refused or incomplete. 70: a defect of urdfkin. 130: interrupted. 128 + n: stopped by signal n.
    """
    try:
        # In standalone mode, click would exit with 1 after an interrupt.
        try:
            code = command.main(prog_name=name, standalone_mode=False)
        finally:
            streams.flush_output()
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return error.exit_code
    except click.ClickException as error:
        return _report_usage_error(error)
    except click.Abort:
        click.echo("urdfkin: interrupted", err=True)
        return _INTERRUPTED_EXIT_CODE
    except UrdfkinError as error:
        return report_error(error)
    except Exception as error:
        return report_crash(error)
    return code if isinstance(code, int) else 0


def report_error(error: UrdfkinError) -> int:
    click.echo(f"urdfkin: error: {error}", err=True)
    return 1 if error.is_disagreement else 2


def _report_usage_error(error: click.ClickException) -> int:
    context = getattr(error, "ctx", None)
    page = f"; see: {context.command_path} --help" if context is not None else ""
    # Click lists the choices of a missing argument on several lines.
    message = " ".join(error.format_message().split()).rstrip(".")
    say(f"urdfkin: error: {message}{page}", err=True)
    return error.exit_code


def report_crash(error: Exception) -> int:
    if isinstance(error, ModuleNotFoundError) and not str(error.name).startswith("urdfkin"):
        # A dependency can be missing, for example if pre-commit installed urdfkin with --no-deps.
        remedy = "install urdfkin with its dependencies: pip install PATH_OF_THE_CLONE"
        click.echo(f"urdfkin: error: {error.name} is not installed; {remedy}", err=True)
        return 2
    click.echo("".join(traceback.format_exception(error)), err=True, nl=False)
    click.echo(
        f"urdfkin: this is a defect of urdfkin, not of your input: {type(error).__name__}."
        " Please report it in urdfkin's repository, with the lines above and the command"
        f" (exit {CRASH_EXIT_CODE}).",
        err=True,
    )
    return CRASH_EXIT_CODE
