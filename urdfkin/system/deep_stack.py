"""Call something on a thread whose stack is large enough for it.

Pinocchio and its parser walk a robot recursively; on a usual stack of 8 MiB a chain of some 3,000 links
ends the process, on a smaller one a few hundred links do.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

from urdfkin.system.forking import lock_over_forks

_T = TypeVar("_T")

_USUAL_STACK = 8 * 2**20
_one_at_a_time = lock_over_forks()


def with_stack(size: int, function: Callable[[], _T]) -> _T:
    """What `function()` returns or raises, called on a stack of at least `size` bytes.

    >>> with_stack(64 * 2**20, lambda: 6 * 7)
    42
    """
    future: Future[_T] = Future()

    def run() -> None:
        try:
            future.set_result(function())
        except BaseException as error:
            future.set_exception(error)

    with _one_at_a_time:  # the size is a setting of the whole process
        before = threading.stack_size(max(size, _USUAL_STACK))
        try:
            thread = threading.Thread(target=run)
            thread.start()
        finally:
            threading.stack_size(before)
    thread.join()
    return future.result()
