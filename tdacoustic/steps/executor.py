"""What an executor of tasks is, and the one that computes in this process."""

from __future__ import annotations

from concurrent.futures import Future
from types import TracebackType
from typing import Protocol, TypeAlias

from tdacoustic.errors import AnalysisError, TdacousticError
from tdacoustic.steps.computation import compute
from tdacoustic.steps.progress import tell_progress
from tdacoustic.steps.store import Store
from tdacoustic.steps.task import Task

__all__ = ["Executor", "Inline", "Jobs", "SuspectedError"]


class SuspectedError(AnalysisError):
    """Workers ended while they worked on a task: it ended them, or one that was beside it did."""


class Executor(Protocol):
    """Where tasks are computed; `tdacoustic.steps.execute` drives any.

    A context manager: it may be entered again after it was left. Left with an exception, it computes no further.
    """

    @property
    def n_slots(self) -> int:
        """How many tasks it takes at a time; may change while it works."""
        ...

    def submit(self, task: Task, store: Store) -> Future[str]:
        """Start a task whose inputs the store holds.

        The future's result is the key, whose result the store then holds. Its exception is the task's own
        `TdacousticError`, a `concurrent.futures.BrokenExecutor` where the process that worked on it ended (`renew` is
        then called, when nothing is in flight any more), a `SuspectedError` where the executor went on by itself, or a
        defect.
        """
        ...

    def renew(self) -> None:
        """Make it fit for work again after a `BrokenExecutor`; raises where that cannot be."""
        ...

    def look(self) -> None:
        """Called now and then while nothing finishes; raises where nothing can come any more."""
        ...

    def __enter__(self) -> Executor:
        """Get ready."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None:
        """Let go; after an exception without waiting for what still runs."""
        ...


Jobs: TypeAlias = "int | Executor"
"""How many processes, 1 being this one; or an executor."""


class Inline:
    """Computes in this process, one task at a time; a step is heard while it works."""

    n_slots = 1

    def submit(self, task: Task, store: Store) -> Future[str]:
        """Compute a task; a defect propagates at once."""
        done: Future[str] = Future()
        tell_progress(0.0)
        try:
            done.set_result(compute(task, store))
        except TdacousticError as error:
            done.set_exception(error)
        return done

    def renew(self) -> None:
        """Nothing can break."""

    def look(self) -> None:
        """Nothing is ever waited for."""

    def __enter__(self) -> Inline:
        """Nothing to get ready."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None:
        """Nothing to let go."""
