"""Locks that are unlocked in a child process after a fork.

`import urdfkin` imports this module first. This module imports nothing that an untrusted current folder could
replace.
"""

from __future__ import annotations

import os
import threading
from contextlib import suppress


def lock_over_forks() -> threading.RLock:
    """Return a lock that a child process never inherits in a locked state.

    A fork waits until the lock is free. After the fork, the lock is unlocked in the parent and in the child.

    Use this function for locks of modules only. A lock of an object would stay registered after the object is
    deleted, until the process ends.
    """
    lock = threading.RLock()

    def release() -> None:
        with suppress(
            RuntimeError
        ):  # another thread created this lock during the fork, so the lock was not acquired before the fork
            lock.release()

    os.register_at_fork(before=lock.acquire, after_in_parent=release, after_in_child=release)
    return lock


#: The lock that a thread holds during a lazy import. Without this lock, another thread could fork a child
#: during the import. The child would wait for ever for the end of that import.
importing = lock_over_forks()
