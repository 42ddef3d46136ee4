"""Spawned processes on this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Any, Final, ParamSpec, TypeVar

from tdacoustic.errors import ExecutorError
from tdacoustic.steps.computation import compute
from tdacoustic.steps.store import Store
from tdacoustic.steps.task import Task

__all__ = ["NO_WORKERS", "Processes", "WorkerProcess"]

NO_WORKERS: Final = (
    "worker processes end before they take any work: too little memory, or a script that lacks "
    '`if __name__ == "__main__":`; what is done is kept, --jobs 1 (jobs=1) goes on without worker processes'
)

THREAD_VARIABLES: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""What libraries take their number of threads from."""

P = ParamSpec("P")
T = TypeVar("T")


class WorkerProcess:
    """One process that takes one call after the other; after it left, the next call starts another.

    A pool of one process, and one call at a time: Python's pools of several (3.11 to 3.13) wait for ever where one
    process ends while another is being started, and a process that ends takes what the others work on along.

    Parameters
    ----------
    most : int, optional
        Calls, after which the process is replaced.
    """

    def __init__(self, most: int | None = None) -> None:
        self._most = most
        self._pool: ProcessPoolExecutor | None = None
        self._last: Future[Any] | None = None

    @property
    def is_idle(self) -> bool:
        """Whether nothing is being worked on."""
        return self._last is None or self._last.done()

    def submit(self, call: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Hand a call to the process, which has to be idle; one that ended while it was idle is replaced."""
        with _of_workers():
            try:
                future = self._started().submit(call, *args, **kwargs)
            except BrokenProcessPool:
                self.leave()
                future = self._started().submit(call, *args, **kwargs)
        self._last = future
        return future

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is None:
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(1, context, _start, max_tasks_per_child=self._most)
        return self._pool

    def leave(self) -> None:
        """Let the process end, and wait until it has."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
            self._pool = None


class Processes:
    """Computes in spawned processes, which end with this one.

    Parameters
    ----------
    n_processes : int
    """

    def __init__(self, n_processes: int) -> None:
        self.n_slots = n_processes
        self._workers = [WorkerProcess() for _ in range(n_processes)]
        self._others: set[BaseProcess] = set()

    def submit(self, task: Task, store: Store) -> Future[str]:
        """Hand a task to an idle process."""
        return next(worker for worker in self._workers if worker.is_idle).submit(compute, task, store)

    def renew(self) -> None:
        """Try whether a process takes work; those that ended are replaced when they are next needed.

        Raises
        ------
        ExecutorError
            Workers do not even start.
        """
        worker = self._workers[0]
        worker.leave()
        try:
            worker.submit(os.getpid).result()
        except BrokenExecutor as broken:
            raise ExecutorError(NO_WORKERS) from broken

    def look(self) -> None:
        """A worker that ends is heard of at once."""

    def __enter__(self) -> Processes:
        """Remember which processes are not its own; each starts with its first task."""
        self._others = set(multiprocessing.active_children())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None:
        """End the processes; after a defect or Ctrl-C at once: nobody waits for what is still running."""
        if kind is not None:
            for process in set(multiprocessing.active_children()) - self._others:
                process.terminate()
        for worker in self._workers:
            worker.leave()


@contextmanager
def _of_workers() -> Iterator[None]:
    """Let what starts inside begin with one thread a library, and without modules of the working directory.

    The working directory may be a folder from outside: none of its modules are theirs.
    """
    wanted = {**dict.fromkeys(THREAD_VARIABLES, "1"), "PYTHONSAFEPATH": "1"}
    before = {name: os.environ.get(name) for name in wanted}
    os.environ.update(wanted)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _start() -> None:
    """Set up a worker: Ctrl-C is left to the parent, and it does not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: Any) -> None:
    """End this worker when its parent ends, however it does: killed, it leaves its workers waiting for ever."""
    parent.join()
    os._exit(1)
