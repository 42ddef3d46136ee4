"""A dask.distributed cluster that is there already, as an executor."""

from __future__ import annotations

import hashlib
import pickle
from concurrent.futures import BrokenExecutor, CancelledError, Future
from contextlib import suppress
from functools import partial
from types import TracebackType
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import AnalysisError, ExecutorError, StoreError, TdacousticError
from tdacoustic.steps.cluster_check import asked, package_problem
from tdacoustic.steps.cluster_link import Link, forget, link_to
from tdacoustic.steps.cluster_worker import Call, Reply, SharedStore, awaited
from tdacoustic.steps.computation import compute
from tdacoustic.steps.executor import SuspectedError
from tdacoustic.steps.software import own_software
from tdacoustic.steps.store import Store
from tdacoustic.steps.task import Task

if TYPE_CHECKING:
    import distributed

__all__ = ["Cluster"]

_NO_WORKER_S: Final = 60.0
"""After how long without any worker a run ends."""


class Cluster:
    """Computes on the workers of an existing dask.distributed scheduler.

    Small and picklable: it connects when it is first used, once a process. The workers need tdacoustic of the same
    version and sources; those with several threads compute one task at a time, so ``--nthreads 1`` and a process a
    core is best. A store that a worker sees (a shared file system) is read and written there; else inputs and results
    travel. Logs are read where they lie: on a file system that every worker sees under the same path, or fetched by
    each worker where the campaign names a URL.

    A worker that dies is dask's affair: its tasks are given to others. A task that several workers died of fails; where
    there are more of them, each is tried once more, alone.

    For ``tls://`` addresses certificates come from dask's own configuration (``distributed.comm.tls``). Dask's
    messages hold pickles, which run code where they are opened: scheduler and workers have to be trusted, and their
    network too unless it is ``tls://``.

    Parameters
    ----------
    address : str
        Of the scheduler, as ``tcp://host:8786``.
    """

    def __init__(self, address: str) -> None:
        if not address.strip():
            raise ExecutorError("the address of a scheduler is empty; name one as tcp://host:8786")
        self.address = address.strip()
        self._link: Link | None = None
        self._flying: dict[Future[str], distributed.Future] = {}
        self._shared: dict[str, SharedStore | None] = {}

    def __reduce__(self) -> tuple[type[Cluster], tuple[str]]:
        return Cluster, (self.address,)

    def __repr__(self) -> str:
        return f"Cluster({self.address!r})"

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is doubtful about the workers: connects, and raises where they cannot be used.

        Raises
        ------
        MissingPackageError
            The package distributed is not installed.
        ExecutorError
            The scheduler does not answer, has no worker, or a worker has no tdacoustic or another one.
        """
        return link_to(self.address).doubts

    @property
    def n_slots(self) -> int:
        """One task more than all workers have threads, as of a few seconds ago.

        Not many more: dask holds what waits on a worker guilty with what runs there, where the worker dies.
        """
        return 1 + max(1, 0 if self._link is None else self._link.n_threads())

    def __enter__(self) -> Cluster:
        """Connect."""
        self._link = link_to(self.address)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None:
        """Give back what is in flight, and take the signs out of stores; the connection stays unless all is over."""
        for flying in list(self._flying.values()):
            with suppress(Exception):
                flying.release()
        for shared in self._shared.values():
            if shared is not None:
                shared.remove()
        self._flying, self._shared, self._link = {}, {}, None
        if kind is not None:  # now: when the interpreter ends, dask's own threads are no more
            forget(self.address)

    def renew(self) -> None:
        """Raise: a lost scheduler does not come back with what it knew."""
        forget(self.address)
        raise ExecutorError(
            f"the scheduler {self.address} was lost, or gave up what it was asked for; what is done is kept, run again "
            "to go on"
        )

    def look(self) -> None:
        """Raise where there has been no worker for a minute."""
        if self._link is not None and self._link.lonely_s() > _NO_WORKER_S:
            raise ExecutorError(
                f"the scheduler {self.address} has had no worker for {_NO_WORKER_S:.0f} s; what is done is kept"
            )

    # ------------------------------------------------------------ tasks

    def submit(self, task: Task, store: Store) -> Future[str]:
        """Send a task to the scheduler; one that another program has sent already is not computed twice."""
        answer: Future[str] = Future()
        try:
            self._send(task, store, self._shared_with_all(store), answer)
        except TdacousticError as error:
            answer.set_exception(error)
        except Exception as error:
            if self._is_connected() and not _is_of_the_line(error):
                raise
            answer.set_exception(BrokenExecutor(str(error)))
        return answer

    def _is_connected(self) -> bool:
        return self._link is not None and self._link.client.status == "running"

    def _shared_with_all(self, store: Store) -> SharedStore | None:
        """The store where every worker sees it, else None."""
        folder = str(store.folder.resolve())
        if folder not in self._shared:
            assert self._link is not None
            shared = SharedStore.of(store)
            if all(seen is True for seen in asked(self._link.client, shared.is_seen).values()):
                self._shared[folder] = shared
            else:
                shared.remove()
                self._shared[folder] = None
        return self._shared[folder]

    def _send(self, task: Task, store: Store, shared: SharedStore | None, answer: Future[str]) -> None:
        import dask

        assert self._link is not None
        upstream = {} if shared else {up.key: _bytes_of(up, store) for up in task.upstream}
        call = Call(task, own_software(), shared, upstream)
        # the name says all that the reply depends on, so that dask gives one reply to all who ask for it
        place = "travels" if shared is None else hashlib.sha256(shared.folder.encode()).hexdigest()[:16]
        name = f"{task.step.name}-{task.key}-{place}"
        with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1TB"}):  # inputs travel on purpose
            flying = self._link.client.submit(pickle.loads, call.to_bytes(), key=name, pure=True)
        self._flying[answer] = flying
        flying.add_done_callback(partial(self._arrived, task, store, shared, answer))

    def _arrived(
        self,
        task: Task,
        store: Store,
        shared: SharedStore | None,
        answer: Future[str],
        flying: distributed.Future,
    ) -> None:
        """Take a reply; runs in a thread of dask."""
        try:
            try:
                reply: Reply = flying.result()
            finally:
                self._flying.pop(answer, None)
                flying.release()
            if not reply["seen"]:  # a worker that joined later does not see the store
                self._send(task, store, None, answer)
                return
            if reply["error"] is not None:
                raise pickle.loads(reply["error"])
            if reply["data"] is not None:
                store.write_bytes(task.key, reply["data"])
            elif not awaited(store, task.key):
                raise StoreError(
                    f"{task.step.title}: {task.label}: the worker {reply['worker']} wrote its result into the store "
                    f"{store.folder}, but it does not appear here"
                )
            answer.set_result(task.key)
        except BaseException as error:
            answer.set_exception(self._in_words(task, error))

    def _in_words(self, task: Task, error: BaseException) -> BaseException:
        """What happened to a task, where dask says it in its own way."""
        from distributed.scheduler import KilledWorker

        whose = f"{task.step.title}: {task.label}"
        if isinstance(error, TdacousticError):
            return error
        if isinstance(error, KilledWorker):
            return SuspectedError(
                f"{whose}: {error.allowed_failures + 1} workers ended while they worked on it, the last one "
                f"{error.last_worker.address}: too little memory, or a library that crashes; the others go on"
            )
        if isinstance(error, CancelledError) or _is_of_the_line(error) or not self._is_connected():
            return BrokenExecutor(str(error))
        if isinstance(error, ImportError | AttributeError) and self._link is not None:
            with suppress(Exception):
                problem = package_problem(self._link.client)
                if problem is not None:
                    return AnalysisError(f"{whose}: {problem}")
        return error


def _is_of_the_line(error: BaseException) -> bool:
    """Whether the connection broke: dask's client notices a moment later."""
    from distributed.comm import CommClosedError

    return isinstance(error, CommClosedError)


def _bytes_of(task: Task, store: Store) -> bytes:
    """A result as the store keeps it, computed (again) here where it is damaged."""
    try:
        return store.read_bytes(task.key)
    except KeyError:
        return store.read_bytes(compute(task, store))
