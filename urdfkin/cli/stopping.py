"""Signals that ask a command to end do so as an interrupt does: what had finished is kept and written."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

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
