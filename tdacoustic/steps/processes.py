"""A pool of spawned processes on this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Any

from tdacoustic.errors import ExecutorError
from tdacoustic.steps.computation import compute
from tdacoustic.steps.store import Store
from tdacoustic.steps.task import Task

__all__ = ["NO_WORKERS", "THREAD_VARIABLES", "Processes", "start_worker"]

NO_WORKERS = (
    "worker processes end before they take any work: too little memory, or a script that lacks "
    '`if __name__ == "__main__":`; what is done is kept, --jobs 1 (jobs=1) goes on without worker processes'
)

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""What libraries take their number of threads from."""


class Processes:
    """Computes in spawned processes, which end with this one.

    Parameters
    ----------
    n_processes : int
    """

    def __init__(self, n_processes: int) -> None:
        self._n_processes = n_processes
        self.n_slots = n_processes + 1  # one at hand, so that nobody waits
        self._pool: ProcessPoolExecutor | None = None
        self._others: set[BaseProcess] = set()

    def submit(self, task: Task, store: Store) -> Future[str]:
        """Hand a task to the pool."""
        if self._pool is None:
            self._pool = self._started()
        try:
            return self._pool.submit(compute, task, store)
        except BrokenProcessPool as error:  # an idle worker ended: it is said as of one that worked
            broken: Future[str] = Future()
            broken.set_exception(error)
            return broken

    def renew(self) -> None:
        """Start a new pool.

        Raises
        ------
        ExecutorError
            Its workers do not even start.
        """
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
        self._pool = self._started()
        try:
            self._pool.submit(os.getpid).result()
        except BrokenProcessPool as broken:
            raise ExecutorError(NO_WORKERS) from broken

    def look(self) -> None:
        """A worker that ends is heard of at once."""

    def _started(self) -> ProcessPoolExecutor:
        # workers begin in the working directory, which may be a folder from outside: none of its modules are theirs
        os.environ.setdefault("PYTHONSAFEPATH", "1")
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(self._n_processes, mp_context=context, initializer=start_worker)

    def __enter__(self) -> Processes:
        """Remember which processes are not its own; the pool starts with the first task."""
        self._others = set(multiprocessing.active_children())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None:
        """End the pool; after a defect or Ctrl-C at once: nobody waits for what is still running."""
        if kind is not None:
            for process in set(multiprocessing.active_children()) - self._others:
                process.terminate()
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
            self._pool = None


def start_worker() -> None:
    """Set up a worker: one thread a library, Ctrl-C left to the parent, and no life beyond the parent's."""
    for name in THREAD_VARIABLES:
        os.environ[name] = "1"
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: Any) -> None:
    """End this worker when its parent ends, however it does: killed, it leaves its workers waiting for ever."""
    parent.join()
    os._exit(1)
