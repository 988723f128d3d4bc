"""Locks that are unlocked in a child process after a fork.

A fork copies all locks, but only the thread that calls `fork`. Another thread's lock would stay locked in the
child for ever. `import urdfkin` imports this module first. This module imports nothing that an untrusted
current folder could replace.
"""

from __future__ import annotations

import os
import threading

_locks: list[threading.RLock] = []
#: This dictionary maps the identifier of a forking thread to the locks that it acquired before the fork.
_acquired: dict[int, list[threading.RLock]] = {}


def lock_over_forks() -> threading.RLock:
    """Return a lock that is unlocked in a child process after a fork.

    A fork waits until the lock is free. It acquires the locks in reverse order of their creation, so a thread
    that needs two of these locks must also acquire the newer lock first.

    Use this function only for locks that are module variables. This module never removes a lock from its
    list, so a lock of a deleted object would stay in the list until the process ends.
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
    # The list is empty if another thread registered this function while the fork was already running.
    for lock in reversed(_acquired.pop(threading.get_ident(), [])):
        lock.release()


class _ImportLock:
    """The lock that a thread holds during a lazy import.

    Without this lock, another thread could fork a child during the import. The child would wait for ever for
    the end of that import.

    A fork also acquires the lock of `logging`, which an imported module may need. To avoid a deadlock, a fork
    must acquire the import lock before the lock of `logging`. Python calls the registered functions in
    reverse order of their registration. For this reason, `register` imports `logging` first and then
    registers `_before_fork`.
    """

    def __init__(self) -> None:
        self._lock, self._registered = threading.RLock(), False
        _locks.append(self._lock)

    def register(self) -> None:
        if self._registered:  # a module may call `register` while another thread imports it
            return
        with self._lock:
            if not self._registered:
                import logging  # noqa: F401  a file in the current folder could replace `logging`

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
