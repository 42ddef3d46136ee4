"""The ledger of an execution: which tasks wait, which are done, which failed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from tdacoustic.errors import TdacousticError
from tdacoustic.steps.store import Store
from tdacoustic.steps.task import Task

__all__ = ["Ledger", "Outcome", "Progress", "in_order"]

Progress = Callable[[str, float, int], None]
"""Called with what is being done, how many tasks are done (with a part of the running one) and how many there are."""


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


def in_order(tasks: Sequence[Task]) -> list[Task]:
    """Return all tasks and what they rest on, upstream first, each key once."""
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


class Ledger:
    """Which tasks wait, which are done, which failed.

    Parameters
    ----------
    tasks : list of Task
        Upstream first, each key once.
    store : Store
        What it holds is done.
    progress : callable or None
    """

    def __init__(self, tasks: list[Task], store: Store, progress: Progress | None) -> None:
        self.total = len(tasks)
        self.found = [task.key for task in tasks if store.is_whole(task.key)]
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
        """Enter what became of a task."""
        if error is None:
            self.done.add(task.key)
            self.computed.append(task.key)
        else:
            self.failed[task.key] = error
        self._tell(f"{task.step.title}: {task.label}")

    def outcome(self) -> Outcome:
        """Return what became of all tasks."""
        return Outcome(tuple(self.computed), tuple(self.found), self.failed)
