"""Locks that a forked child finds unlocked.

`import urdfkin` imports this module first. It imports nothing that a folder of strangers could replace.
"""

from __future__ import annotations

import os
import threading


def lock_over_forks() -> threading.RLock:
    """Return a lock that a fork waits for, and that is unlocked in parent and child after the fork.

    Use it for modules only, not for objects: the lock stays registered until the process ends.
    """
    lock = threading.RLock()
    os.register_at_fork(before=lock.acquire, after_in_parent=lock.release, after_in_child=lock.release)
    return lock


#: Held during lazy imports. Without it, a child that another thread forks during an import would wait for
#: ever for the end of that import.
importing = lock_over_forks()
