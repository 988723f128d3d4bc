"""A forked child process can compute, although a fork copies no threads and may copy locked locks.

Each case runs in its own process, because Python warns of forks beside threads, and a child may hang.
"""

import textwrap
from pathlib import Path

import pytest

import urdfkin
from tests.cli.running import python

#: Fork, run `child()` in the child, and print its exit status; a child that hangs is killed after a timeout.
HARNESS = """
import os, signal, sys, threading, time, warnings
warnings.simplefilter("ignore")
import numpy as np, urdfkin
robot = urdfkin.load("ur5", verify=False)
q = robot.sample(8192)

def fork(child, patience=60.0):
    pid = os.fork()
    if pid == 0:
        try:
            child()
        except BaseException as error:
            print("child:", type(error).__name__, error, file=sys.stderr, flush=True)
            os._exit(1)
        os._exit(0)
    end = time.monotonic() + patience
    while time.monotonic() < end:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            return print("ended with", os.waitstatus_to_exitcode(status))
        time.sleep(0.02)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    print("hung")

def beside(*works):
    '''Threads that do these works.'''
    threads = [threading.Thread(target=work) for work in works]
    for thread in threads:
        thread.start()
    return lambda: [thread.join() for thread in threads]

def held(lock, seconds=1.0):
    '''Another thread has the lock for a while.'''
    has = threading.Event()
    def hold():
        with lock:
            has.set()
            time.sleep(seconds)
    beside(hold)
    has.wait()
"""

CASES = {
    "a batch on all threads, after the parent had one": """
        expected = robot.jacobian(q, "tool0", threads=2)
        def child():
            assert (robot.jacobian(q, "tool0", threads=2) == expected).all()
            assert (robot.jacobian(q, "tool0") == expected).all()
        fork(child)
        fork(child)
        assert (robot.jacobian(q, "tool0", threads=2) == expected).all()
        """,
    "a batch, while the parent computes one": """
        stop = threading.Event()
        def work():
            while not stop.is_set():
                robot.jacobian(q, "tool0", threads=2)
        join = beside(work)
        for _ in range(5):
            time.sleep(0.05)
            fork(lambda: robot.jacobian(q, "tool0", threads=2))
        stop.set()
        join()
        """,
    "an entry in the ledger, while another thread makes one": """
        from urdfkin.verify import certificate
        held(certificate._ledger_lock)
        fork(lambda: (robot.placement(q[:3], "tool0"), robot.certificate()))
        """,
    "a kernel, while another thread compiles one": """
        from urdfkin.compiled import kernel_cache
        held(kernel_cache.compile_lock)
        fork(lambda: robot.placement(q[:3], "tool0"))
        """,
    "a deep robot, while another thread builds one": """
        from urdfkin.system import processes
        held(processes._stack_size_lock)
        fork(lambda: processes.call_with_stack(2**24, lambda: None))
        """,
    "verified results, after the parent had some": """
        checked = urdfkin.load("ur5")
        checked.acceleration(q[:50], q[:50], q[:50], "tool0")
        def child():
            checked.acceleration(q[:50], q[:50], q[:50], "tool0")
            assert checked.certificate().verified
        fork(child)
        """,
    "a table, screws and a convention, while another thread asks for them first": """
        def ask():
            robot.dh("tool0")
            robot.screws("tool0")
            robot.convention("mujoco")
        join = beside(ask)
        time.sleep(0.01)
        fork(ask)
        join()
        """,
    "a robot, while another thread needs the lock of logging during an import": """
        import logging
        from urdfkin.system.locks import import_lock
        has = threading.Event()
        def work():
            with import_lock:
                has.set()
                time.sleep(1.0)
                logging.getLogger("of a module that is imported")
        join = beside(work)
        has.wait()
        fork(lambda: robot.placement(q[:3], "tool0"))
        join()
        """,
    "several threads that fork at the same time": """
        import urdfkin.compiled.kernel_cache
        sys.setswitchinterval(1e-6)
        end, codes = time.monotonic() + 3.0, set()
        def many():
            while time.monotonic() < end:
                pid = os.fork()
                if pid == 0:
                    os._exit(0)
                codes.add(os.waitpid(pid, 0)[1])
        beside(many, many, many)()
        assert codes == {0}
        sys.setswitchinterval(5e-3)
        fork(lambda: robot.placement(q[:3], "tool0"))
        """,
    "a robot, after one thread imported a module lazily that another imported as usual": """
        from urdfkin.system.lazy_import import lazy_import
        module = "urdfkin.verify.exact.numbers"  # its body makes a lock
        assert module not in sys.modules
        begun, also = threading.Event(), threading.Event()
        class Slow:
            def find_spec(self, name, path=None, target=None):
                if name == "flint" and threading.current_thread().name == "plain":
                    begun.set()
                    also.wait(2.0)
                    time.sleep(0.5)
        sys.meta_path.insert(0, Slow())
        def plain():
            __import__(module)
        def lazy():
            begun.wait()
            also.set()
            lazy_import(module + ":exact")(1)
        threads = [threading.Thread(target=plain, name="plain"), threading.Thread(target=lazy)]
        [thread.start() for thread in threads]
        [thread.join() for thread in threads]
        fork(lambda: robot.placement(q[:3], "tool0"))
        """,
    "a pool of processes": """
        import multiprocessing
        robot.jacobian(q, "tool0", threads=2)
        with multiprocessing.get_context("fork").Pool(2) as pool:
            pool.map_async(len, [q, q]).get(timeout=60)
            found = pool.apply_async(robot.jacobian, (q, "tool0")).get(timeout=60)
        assert (found == robot.jacobian(q, "tool0")).all()
        print("ended with 0")
        """,
}


@pytest.mark.long
@pytest.mark.parametrize("case", CASES)
def test_a_forked_child_process_computes(case: str) -> None:
    code = HARNESS + textwrap.dedent(CASES[case])
    done = python(code, timeout=250)
    assert set(done.stdout.splitlines()) == {"ended with 0"}, done.stderr


def test_every_lock_and_pool_of_the_package_is_listed_as_safe_for_forks() -> None:
    """A new lock or pool must be listed here; locks of a validation end with the run."""
    made = ("threading.Lock(", "threading.RLock(", "default_factory=threading", "ThreadPoolExecutor(")
    package = Path(str(urdfkin.__file__)).parent
    found = {
        f"{path.relative_to(package)}: {name.rstrip('(')}"
        for path in package.rglob("*.py")
        for name in made
        if name in path.read_text(encoding="utf-8") and path.parent.name != "validation"
    }
    assert found == {
        "system/locks.py: threading.RLock",
        "compiled/evaluate.py: ThreadPoolExecutor",  # the child creates a new pool
        "view/viewer.py: threading.RLock",  # this server never forks
    }
