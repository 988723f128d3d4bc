"""Locks that are unlocked in a child process after a fork.

`import urdfkin` imports this module first. This module imports nothing that an untrusted current folder could
replace.
"""

from __future__ import annotations

import os
import threading

_locks: list[threading.RLock] = []
#: The locks that a thread holds during its fork, by the thread's identifier.
_acquired: dict[int, list[threading.RLock]] = {}


def lock_over_forks() -> threading.RLock:
    """Return a lock that a child process never inherits in a locked state.

    A fork waits until the lock is free. After the fork, the lock is unlocked in the parent and in the child.
    A fork acquires the locks in reverse order of their creation. A thread that needs two of them must acquire
    them in the same order.

    Use this function for locks of modules only. A lock of an object would stay registered after the object is
    deleted, until the process ends.
    """
    importing.register()
    lock = threading.RLock()
    _locks.append(lock)
    return lock


def _before_fork() -> None:
    acquired = _acquired[threading.get_ident()] = list[threading.RLock]()
    for lock in reversed(_locks[:]):
        lock.acquire()
        acquired.append(lock)


def _after_fork() -> None:
    # There are none if another thread registered this function during the fork.
    for lock in reversed(_acquired.pop(threading.get_ident(), [])):
        lock.release()


class _ImportLock:
    """The lock that a thread holds during a lazy import.

    Without this lock, another thread could fork a child during the import. The child would wait for ever for
    the end of that import.

    `logging` has a lock that a fork acquires too. An imported module may need that lock. So a fork must
    acquire this lock first. Python calls the functions that acquire locks in reverse order of their
    registration. For this reason, the function of this module is registered after `logging` is imported.
    """

    def __init__(self) -> None:
        self._lock, self._registered = threading.RLock(), False
        _locks.append(self._lock)

    def register(self) -> None:
        """Let each later fork acquire the locks of this module."""
        if self._registered:  # the body of a module may call this while another thread holds the lock
            return
        with self._lock:
            if not self._registered:
                import logging  # noqa: F401, PLC0415  at the start, a file in the current folder could replace it

                os.register_at_fork(
                    before=_before_fork, after_in_parent=_after_fork, after_in_child=_after_fork
                )
                self._registered = True

    def __enter__(self) -> None:
        self.register()
        self._lock.acquire()

    def __exit__(self, *error: object) -> None:
        self._lock.release()


importing = _ImportLock()
