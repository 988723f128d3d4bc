"""A worker that hangs as compiled code does: it notices neither a signal that can be caught nor its pipe."""

import signal
import time


def serve(pipe: int, parent: int) -> None:
    """Never answer."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(600 + 0 * (pipe + parent))
