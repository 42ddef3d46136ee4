"""Worker processes that work through many campaigns, each one campaign at a time.

Each worker is a process of its own, so that a worker that dies takes no other along and it is known what it was
working on. A campaign whose worker died is tried once more, alone, when all others are done.

Memory is bounded at two places: as many workers start as fit into the memory that is free, at `WORKER_BYTES` each; and
a worker that holds more than that after a campaign is replaced by a new one. While it works on a campaign a worker
needs what the campaign's steps need, which does not grow with the length of the logs.
"""

from __future__ import annotations

import multiprocessing
import os
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from multiprocessing.process import BaseProcess
from typing import Final

from tdacoustic.steps.processes import WorkerProcess
from tdacoustic.workflows.memory import can_measure_memory, free_memory_bytes
from tdacoustic.workflows.run_many_work import CampaignJob, CampaignReport, Told, failed_by_defect, work

__all__ = ["LOST", "WORKER_BYTES", "n_workers", "work_through"]

WORKER_BYTES: Final = 1536 << 20
"""What a worker may hold between two campaigns."""

CAMPAIGNS_UNMEASURED: Final = 20
"""Campaigns of a worker where the system does not tell what it holds."""

END_S: Final = 3.0
"""Time that a worker has to end when it is told to."""

LOST: Final = (
    "a worker process ended before the campaign was done, and again when it worked on it alone: too little memory, a "
    'library that crashes, or a script that lacks `if __name__ == "__main__":`'
)

Work = Callable[[CampaignJob], CampaignReport]

Tell = Callable[[Sequence[CampaignJob]], None]
"""Called with what is being worked on whenever that changes."""


def n_workers(n_campaigns: int, wanted: int | None = None) -> int:
    """Return how many workers pay: one a campaign, at most one a core, and at most what fits into the free memory.

    Parameters
    ----------
    n_campaigns : int
        Those that need work.
    wanted : int, optional
        What the user says instead of cores and memory.
    """
    if wanted is not None:
        return max(1, min(n_campaigns, wanted))
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    free = free_memory_bytes()
    fitting = cores if free is None else free // WORKER_BYTES
    return max(1, min(n_campaigns, cores, fitting))


def work_through(
    jobs: Sequence[CampaignJob], n: int, tell: Tell | None = None, task: Work = work
) -> Generator[tuple[CampaignJob, CampaignReport]]:
    """Yield each campaign with what became of it, as they are done; left early, it ends all its processes at once.

    Parameters
    ----------
    jobs : sequence of CampaignJob
    n : int
        Workers.
    tell : callable, optional
    task : callable
        What is done with a campaign in a worker: a module-level function.
    """
    tell = tell or (lambda _: None)
    lost: list[CampaignJob] = []
    for job, report in _worked(jobs, n, tell, task):
        if report is None:
            lost.append(job)
        else:
            yield job, report
    for job in lost:
        for _, report in _worked([job], 1, tell, task):
            yield job, report or CampaignReport(Told("failed", error=LOST))


def _worked(
    jobs: Sequence[CampaignJob], n: int, tell: Tell, task: Work
) -> Iterator[tuple[CampaignJob, CampaignReport | None]]:
    """Yield each job with its report, or None where its worker died; no worker is left at the end."""
    others = set(multiprocessing.active_children())
    crew = _Crew(n, task)
    try:
        yield from crew.work(jobs, tell)
    except BaseException:  # Ctrl-C, a defect, or nobody listens any more
        _end(set(multiprocessing.active_children()) - others)
        raise
    finally:
        crew.close()


def _end(processes: set[BaseProcess]) -> None:
    """End processes; one that does not end when told to is killed."""
    for process in processes:
        process.terminate()
    for process in processes:
        process.join(END_S)
        if process.is_alive():
            process.kill()


class _Crew:
    """Some workers, started when there is work for them."""

    def __init__(self, n: int, task: Work) -> None:
        most = None if can_measure_memory() else CAMPAIGNS_UNMEASURED
        self._task = task
        self._idle = [WorkerProcess(most) for _ in range(n)]

    def work(self, jobs: Sequence[CampaignJob], tell: Tell) -> Iterator[tuple[CampaignJob, CampaignReport | None]]:
        """Yield each job with its report, or None where its worker died."""
        waiting = deque(jobs)
        running: dict[Future[CampaignReport], tuple[WorkerProcess, CampaignJob]] = {}
        while waiting or running:
            while waiting and self._idle:
                worker, job = self._idle.pop(), waiting.popleft()
                running[worker.submit(self._task, job)] = worker, job
            tell([job for _, job in running.values()])
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                worker, job = running.pop(future)
                try:
                    report = future.result()
                except BrokenExecutor:
                    report = None
                except Exception as error:  # what it told could not be understood
                    report = CampaignReport(failed_by_defect(error))
                if report is None or report.rss_bytes > WORKER_BYTES:
                    worker.leave()
                self._idle.append(worker)
                yield job, report

    def close(self) -> None:
        """Wait until all workers have ended."""
        for worker in self._idle:
            worker.leave()
