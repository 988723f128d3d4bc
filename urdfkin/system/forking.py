"""Locks that a forked child finds open.

A fork copies the locks of every thread and only the thread that forks: what another one held in that moment
would stay closed in the child for ever.
"""

from __future__ import annotations

import os
import threading


def lock_over_forks() -> threading.RLock:
    """A lock for a whole module: a fork waits for it, and parent and child go on with it open.

    It is registered for as long as the process lives, so that no object may have one of its own.
    """
    lock = threading.RLock()
    os.register_at_fork(before=lock.acquire, after_in_parent=lock.release, after_in_child=lock.release)
    return lock


#: Held while a module is imported that is loaded only when it is needed: a child that was forked meanwhile by
#: another thread would wait for ever for the rest of that import.
importing = lock_over_forks()
