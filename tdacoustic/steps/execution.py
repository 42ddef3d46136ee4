"""Compute what the store does not hold, on any executor."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from functools import partial

from tdacoustic.errors import AnalysisError, TdacousticError
from tdacoustic.steps.computation import compute, result_of
from tdacoustic.steps.executor import Executor, Inline, Jobs, SuspectedError
from tdacoustic.steps.ledger import Ledger, Outcome, Progress, in_order
from tdacoustic.steps.processes import Processes
from tdacoustic.steps.progress import listening
from tdacoustic.steps.store import Store
from tdacoustic.steps.task import Task

__all__ = ["Outcome", "Progress", "compute", "execute", "result_of"]

WORKER_LOST = (
    "a worker process ended before its work was done, and again when it worked on this alone: too little memory, or a "
    "library that crashes; the others go on, --jobs 1 (jobs=1) computes it without worker processes"
)

_LOOK_S = 5.0
"""How often an executor is asked to look, while nothing finishes."""


def execute(tasks: Sequence[Task], store: Store, jobs: Jobs = 1, progress: Progress | None = None) -> Outcome:
    """Bring the results of tasks into the store.

    Parameters
    ----------
    tasks : sequence of Task
        What they rest on is computed too.
    store : Store
        What it already holds is not computed again, so a run that was killed
        goes on where it was.
    jobs : int or Executor
        Processes; 1 computes in this one, and so does any number where one
        task is left. An executor gets whatever is left.
    progress : callable, optional
        Called after each task.

    Returns
    -------
    Outcome
        Errors that tdacoustic raises on purpose are collected by key, and so
        is the error of a task that ends the process it is computed in; the
        other tasks go on. Any other exception is a defect and propagates.
    """
    ledger = Ledger(in_order(tasks), store, progress)
    if ledger.waiting:
        with _executor(jobs, len(ledger.waiting)) as executor:
            _drive(ledger, store, executor)
    return ledger.outcome()


def _executor(jobs: Jobs, n_waiting: int) -> Executor:
    if not isinstance(jobs, int):
        return jobs
    n_processes = min(jobs, n_waiting)
    return Inline() if n_processes <= 1 else Processes(n_processes)


def _drive(ledger: Ledger, store: Store, executor: Executor) -> None:
    """Compute until nothing waits; of several tasks that are suspected each is tried once more, alone."""
    while suspected := _driven(ledger, store, executor):
        if len(suspected) == 1:
            ledger.finish(*suspected[0])
        else:
            _one_by_one(ledger, [task for task, _ in suspected], store, executor)


def _driven(ledger: Ledger, store: Store, executor: Executor) -> list[tuple[Task, SuspectedError]]:
    """Keep the executor's slots full until nothing is ready; return the tasks that are suspected."""
    queue: deque[Task] = deque()
    running: dict[Future[str], Task] = {}
    suspected: list[tuple[Task, SuspectedError]] = []
    while True:
        queue.extend(ledger.ready())
        while queue and len(running) < executor.n_slots:
            task = queue.popleft()
            running[_submit(ledger, task, store, executor)] = task
        if not running:
            return suspected
        done = _finished(running, executor)
        if any(_is_broken(future) for future in done):
            done = wait(running).done  # what is tried again is tried alone
        broken = []
        for future in [future for future in running if future in done]:
            task, error = running.pop(future), future.exception()
            if _is_broken(future):
                broken.append(task)
            elif isinstance(error, SuspectedError):
                suspected.append((task, error))
            else:
                _finish(ledger, task, future)
        if broken:
            executor.renew()
            _one_by_one(ledger, broken, store, executor)


def _submit(ledger: Ledger, task: Task, store: Store, executor: Executor) -> Future[str]:
    with listening(partial(ledger.tell_part, task)):
        return executor.submit(task, store)


def _finished(running: Mapping[Future[str], Task], executor: Executor) -> set[Future[str]]:
    while not (done := wait(running, _LOOK_S, FIRST_COMPLETED).done):
        executor.look()
    return done


def _is_broken(future: Future[str]) -> bool:
    return isinstance(future.exception(), BrokenExecutor)


def _finish(ledger: Ledger, task: Task, future: Future[str]) -> None:
    error = future.exception()
    if error is not None and not isinstance(error, TdacousticError):
        raise error
    ledger.finish(task, error)


def _one_by_one(ledger: Ledger, suspects: Sequence[Task], store: Store, executor: Executor) -> None:
    """Compute the tasks of which one ended its process; the one that does so alone fails."""
    for task in suspects:
        future = _submit(ledger, task, store, executor)
        _finished({future: task}, executor)
        if _is_broken(future):
            ledger.finish(task, AnalysisError(f"{task.step.title}: {task.label}: {WORKER_LOST}"))
            executor.renew()
        else:
            _finish(ledger, task, future)
