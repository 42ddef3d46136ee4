"""Executors: compute what the store does not hold, inline or in a pool of processes."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from typing import Any

from tdacoustic.errors import AnalysisError, TdacousticError
from tdacoustic.steps.codec import canonical_json, encode
from tdacoustic.steps.logfiles import LogFile
from tdacoustic.steps.progress import listening
from tdacoustic.steps.record import Record, versions
from tdacoustic.steps.store import Store
from tdacoustic.steps.task import Task

__all__ = ["Outcome", "execute", "result_of"]

Progress = Callable[[str, float, int], None]
"""Called with what is being done, how many tasks are done (with a part of the running one) and how many there are."""

WORKER_LOST = (
    "a worker process ended before its work was done: too little memory, or a script that lacks "
    '`if __name__ == "__main__":`; what is done is kept, --jobs 1 (jobs=1) goes on without worker processes'
)

_THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True)
class Outcome:
    """What became of a set of tasks.

    Parameters
    ----------
    computed, found : tuple of str
        Keys that were computed, and keys that the store already held.
    failed : mapping of str to TdacousticError
        By key. A task downstream of a failed one fails with the same error.
    """

    computed: tuple[str, ...]
    found: tuple[str, ...]
    failed: Mapping[str, TdacousticError]


def compute(task: Task, store: Store) -> str:
    """Compute one task whose inputs the store holds, keep the result, return the key."""
    from threadpoolctl import threadpool_limits

    arguments = {
        name: result_of(value, store) if isinstance(value, Task) else value for name, value in task.inputs.items()
    }
    start = time.perf_counter()
    with threadpool_limits(limits=1):
        result = task.step.function(task.settings, **arguments)
    record = Record(
        step=task.step.name,
        version=task.step.version,
        title=task.step.title,
        label=task.label,
        settings=canonical_json(encode(task.settings, [])),
        inputs=tuple(pair for name, value in task.inputs.items() for pair in _input_names(name, value)),
        libraries=versions(),
        wall_s=time.perf_counter() - start,
    )
    store.save(task.key, result, record)
    return task.key


def result_of(task: Task, store: Store) -> Any:
    """Return a task's result, computing it (again) where the store does not hold it whole."""
    try:
        return store.load(task.key)
    except KeyError:
        return store.load(compute(task, store))


def _input_names(name: str, value: Task | LogFile | tuple[LogFile, ...]) -> list[tuple[str, str]]:
    if isinstance(value, Task):
        return [(name, value.key)]
    logs = value if isinstance(value, tuple) else (value,)
    return [(name, f"sha256:{file.sha256}") for log in logs for file in log.files]


def _ordered(tasks: Sequence[Task]) -> list[Task]:
    """All tasks and what they rest on, upstream first, each key once."""
    found: dict[str, Task] = {}

    def walk(task: Task) -> None:
        if task.key in found:
            return
        for upstream in task.upstream:
            walk(upstream)
        found[task.key] = task

    for task in tasks:
        walk(task)
    return list(found.values())


class _Ledger:
    """Which tasks wait, which are done, which failed."""

    def __init__(self, tasks: list[Task], store: Store, progress: Progress | None) -> None:
        self.total = len(tasks)
        self.found = [task.key for task in tasks if _readable(task, store)]
        self.computed: list[str] = []
        self.failed: dict[str, TdacousticError] = {}
        self.done = set(self.found)
        self.waiting = [task for task in tasks if task.key not in self.done]
        self._progress = progress
        self._tell("found in the store" if self.found else "starting")

    def _tell(self, what: str, part: float = 0.0) -> None:
        if self._progress is not None:
            self._progress(what, len(self.done) + len(self.failed) + part, self.total)

    def tell_part(self, task: Task, part: float) -> None:
        """Tell how far a running task has come."""
        self._tell(f"{task.step.title}: {task.label}", part)

    def ready(self) -> list[Task]:
        """Take the tasks whose inputs are there; those downstream of a failure fail."""
        ready, waiting = [], []
        for task in self.waiting:
            broken = next((up for up in task.upstream if up.key in self.failed), None)
            if broken is not None:
                self.failed[task.key] = self.failed[broken.key]
            elif all(up.key in self.done for up in task.upstream):
                ready.append(task)
            else:
                waiting.append(task)
        self.waiting = waiting
        return ready

    def finish(self, task: Task, error: TdacousticError | None) -> None:
        if error is None:
            self.done.add(task.key)
            self.computed.append(task.key)
        else:
            self.failed[task.key] = error
        self._tell(f"{task.step.title}: {task.label}")

    def outcome(self) -> Outcome:
        return Outcome(tuple(self.computed), tuple(self.found), self.failed)


def _readable(task: Task, store: Store) -> bool:
    """Whether the store holds a task's result whole (a damaged file is removed)."""
    if task.key not in store:
        return False
    try:
        store.record(task.key)
    except KeyError:
        return False
    return True


def execute(tasks: Sequence[Task], store: Store, jobs: int = 1, progress: Progress | None = None) -> Outcome:
    """Bring the results of tasks into the store.

    Parameters
    ----------
    tasks : sequence of Task
        What they rest on is computed too.
    store : Store
        What it already holds is not computed again, so a run that was killed
        goes on where it was.
    jobs : int
        Processes; 1 computes in this one.
    progress : callable, optional
        Called after each task.

    Returns
    -------
    Outcome
        Errors that tdacoustic raises on purpose are collected by key; the
        other tasks go on. Any other exception is a defect and propagates.
    """
    ledger = _Ledger(_ordered(tasks), store, progress)
    if jobs <= 1 or len(ledger.waiting) <= 1:
        _inline(ledger, store)
    else:
        _in_processes(ledger, store, min(jobs, len(ledger.waiting)))
    return ledger.outcome()


def _inline(ledger: _Ledger, store: Store) -> None:
    while ready := ledger.ready():
        for task in ready:
            ledger.tell_part(task, 0.0)
            try:
                with listening(partial(ledger.tell_part, task)):
                    compute(task, store)
            except TdacousticError as error:
                ledger.finish(task, error)
            else:
                ledger.finish(task, None)


def _start_worker() -> None:
    """Set up a worker: one thread a library, Ctrl-C left to the parent, and no life beyond the parent's."""
    for name in _THREAD_VARIABLES:
        os.environ[name] = "1"
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: Any) -> None:
    """End this worker when its parent ends, however it does: killed, it leaves its workers waiting for ever."""
    parent.join()
    os._exit(1)


def _in_processes(ledger: _Ledger, store: Store, jobs: int) -> None:
    context = multiprocessing.get_context("spawn")
    running: dict[Future[Any], Task] = {}
    others = set(multiprocessing.active_children())
    # workers begin in the working directory, which may be a folder from outside: none of its modules are theirs
    os.environ.setdefault("PYTHONSAFEPATH", "1")
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_start_worker)
    try:
        while True:
            for task in ledger.ready():
                running[pool.submit(compute, task, store)] = task
            if not running:
                break
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                task = running.pop(future)
                error = future.exception()
                if error is not None and not isinstance(error, TdacousticError):
                    raise error
                ledger.finish(task, error)
    except BrokenProcessPool as broken:
        raise AnalysisError(WORKER_LOST) from broken
    except BaseException:  # a defect, or Ctrl-C: nobody waits for what is still running
        for process in set(multiprocessing.active_children()) - others:
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
