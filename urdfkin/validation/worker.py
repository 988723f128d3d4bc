"""A worker: a process that answers one chunk after another, and ends with its parent, however that ends.

It is an interpreter of its own that runs nothing but this: not the parent's main module, so that a script
needs no guard, and nothing from the current folder.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
from multiprocessing.connection import Connection
from queue import SimpleQueue

from urdfkin.validation.answer import answer
from urdfkin.validation.chunk import Chunk

_PR_SET_PDEATHSIG = 1


def serve(pipe: int, parent: int) -> None:
    """Answer chunks until the pipe ends.

    Args:
        pipe: Descriptor of the connection to the parent.
        parent: Its process.
    """
    _end_with(parent)
    connection, chunks = Connection(pipe), SimpleQueue[Chunk]()
    threading.Thread(target=_receive, args=(connection, chunks), daemon=True).start()
    while True:
        connection.send(answer(chunks.get()))


def _receive(connection: Connection, chunks: SimpleQueue[Chunk]) -> None:
    """Take chunks while another is computed, so that the end of the parent is noticed at once."""
    try:
        while True:
            chunks.put(connection.recv())
    except (EOFError, OSError):
        os._exit(0)


def _end_with(parent: int) -> None:
    """Have the kernel end this process with its parent, where it can: even compiled code that hangs."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(0)
