"""One task: its inputs out of the store, its result into it, on one thread."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from tdacoustic.steps.codec import canonical_json, encode
from tdacoustic.steps.logfiles import LogFile
from tdacoustic.steps.record import Record, versions
from tdacoustic.steps.store import Store
from tdacoustic.steps.task import Task

__all__ = ["alone_on_one_thread", "compute", "result_of"]

_one_at_a_time = threading.Lock()


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


@contextmanager
def alone_on_one_thread() -> Iterator[None]:
    """Run what is inside on one thread of numba, and by itself in this process.

    For a worker that belongs to somebody else and may have several threads: the limits of BLAS (`compute` sets them)
    are those of the process, so that the first of two tasks to end would lift them for the other, and a thread layer
    of numba ends the process when two threads enter it.
    """
    import numba

    with _one_at_a_time:
        before = numba.get_num_threads()
        numba.set_num_threads(1)
        try:
            yield
        finally:
            numba.set_num_threads(before)
