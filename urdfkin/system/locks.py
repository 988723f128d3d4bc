"""Locks that are unlocked in a child process after a fork.

A fork copies all locks, but only one thread: the thread that calls `fork`. A lock that another thread holds
would stay locked in the child for ever. `import urdfkin` imports this module first, so this module imports
nothing that an untrusted current folder could replace.
"""

from __future__ import annotations

import os
import threading

_locks: list[threading.RLock] = []
#: The locks that a thread acquired before its fork. The key is the identifier of the thread.
_acquired_locks: dict[int, list[threading.RLock]] = {}


def make_fork_safe_lock() -> threading.RLock:
    """Return a lock that is unlocked in a child process after a fork.

    A fork waits until the lock is free. A fork acquires the newest lock first and the oldest lock last.
    A thread that needs two locks must also acquire the newer lock first.
    The opposite order can cause a deadlock.

    Use this function only for module variables, because this module stores each lock until the process ends.
    """
    import_lock.register_fork_handlers()
    lock = threading.RLock()
    _locks.append(lock)
    return lock


def _before_fork() -> None:
    acquired = _acquired_locks[threading.get_ident()] = list[threading.RLock]()
    for lock in reversed(_locks[:]):
        lock.acquire()
        acquired.append(lock)


def _after_fork() -> None:
    # If another thread registers `_before_fork` during this fork, `_acquired_locks` lacks this thread.
    for lock in reversed(_acquired_locks.pop(threading.get_ident(), [])):
        lock.release()


class ImportLock:
    """Lock for imports inside functions of urdfkin, for example in `lazy_import`.

    Without this lock, another thread could fork a child process during an import. The child process would
    then never finish this import. This lock is not Python's import lock.

    A fork also acquires the lock of `logging`, because `logging` calls `os.register_at_fork`. A thread that
    holds the import lock may need the lock of `logging` during the import. To avoid a deadlock, a fork must
    acquire the import lock before the lock of `logging`. Before a fork, Python calls the registered functions
    in reverse order. Therefore, `register_fork_handlers` imports `logging` before registering `_before_fork`.
    """

    def __init__(self) -> None:
        self._lock, self._registered = threading.RLock(), False
        _locks.append(self._lock)

    def register_fork_handlers(self) -> None:
        # Waiting here could cause a deadlock. The thread that holds the lock may wait for the import of the
        # calling module.
        if self._registered:
            return
        with self._lock:
            if not self._registered:
                # `logging` must be imported before this call; the class docstring states the reason.
                import logging  # noqa: F401

                os.register_at_fork(
                    before=_before_fork, after_in_parent=_after_fork, after_in_child=_after_fork
                )
                self._registered = True

    def __enter__(self) -> None:
        self.register_fork_handlers()
        self._lock.acquire()

    def __exit__(self, *error: object) -> None:
        self._lock.release()


import_lock = ImportLock()
