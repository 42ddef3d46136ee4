"""What a worker of a cluster does: one task, wherever its inputs are."""

from __future__ import annotations

import pickle
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Final, TypedDict
from uuid import uuid4

from tdacoustic.errors import AnalysisError, MissingFileError, StoreError, TdacousticError
from tdacoustic.steps.computation import alone_on_one_thread, compute
from tdacoustic.steps.fetched import fetch
from tdacoustic.steps.logfiles import HashMemory, LogFile, log_file
from tdacoustic.steps.software import own_software
from tdacoustic.steps.store import Store
from tdacoustic.steps.task import Task

__all__ = ["Call", "Reply", "SharedStore", "awaited", "compute_call"]

_LATE_S: Final = 15.0
"""For how long a file written by another machine may take to appear in a shared file system [assumed]."""

_OLD_S: Final = 86400.0
"""A sign as old as this was left by a program that was killed."""


@dataclass(frozen=True)
class SharedStore:
    """A store's folder with a sign in it, by which another machine knows whether it sees the same folder.

    Parameters
    ----------
    folder : str
        As the client has it, whole.
    sign : str
    """

    folder: str
    sign: str

    @classmethod
    def of(cls, store: Store) -> SharedStore:
        """Put a new sign into a store.

        Raises
        ------
        StoreError
            It cannot be written.
        """
        shared = cls(str(store.folder.resolve()), uuid4().hex)
        try:
            shared._path.parent.mkdir(parents=True, exist_ok=True)
            for path in shared._path.parent.iterdir():
                with suppress(OSError):
                    if time.time() - path.stat().st_mtime > _OLD_S:
                        path.unlink()
            shared._path.write_text(shared.sign, encoding="utf-8")
        except OSError as error:
            raise StoreError(f"the store {store.folder} cannot be written: {error}") from error
        return shared

    @property
    def _path(self) -> Path:
        return Path(self.folder) / "signs" / self.sign

    def is_seen(self) -> bool:
        """Whether this machine sees the sign."""
        try:
            return self._path.read_text(encoding="utf-8") == self.sign
        except (OSError, ValueError):
            return False

    def remove(self) -> None:
        """Take the sign away."""
        with suppress(OSError):
            self._path.unlink()


@dataclass(frozen=True)
class Call:
    """A task on its way to a worker. Unpickled it *is* the reply: `pickle.loads` is all that a scheduler has to know.

    Parameters
    ----------
    task : Task
    software : tuple of str
        `own_software` of the client.
    shared : SharedStore or None
        Where inputs are read and the result goes; None: they travel.
    upstream : mapping of str to bytes
        By key, what travels there.
    """

    task: Task
    software: tuple[str, str, str]
    shared: SharedStore | None
    upstream: Mapping[str, bytes] = field(default_factory=dict)

    def to_bytes(self) -> bytes:
        """Return what `pickle.loads` turns into the `Reply`, where it is called."""
        return pickle.dumps(_Now(self))


class _Now:
    """Its pickle is the call of a function."""

    def __init__(self, call: Call) -> None:
        self.call = call

    def __reduce__(self) -> tuple[Callable[[Call], Reply], tuple[Call]]:
        return compute_call, (self.call,)


class Reply(TypedDict):
    """What comes back: nothing that a scheduler would have to import.

    ``seen`` is False where the worker does not see the store, and nothing was computed. ``data`` is the result as its
    store keeps it, where it travels; ``error`` the pickled exception, where there was one.
    """

    worker: str
    seen: bool
    data: bytes | None
    error: bytes | None


def compute_call(call: Call) -> Reply:
    """Compute a task on this worker."""
    worker = _worker()
    try:
        if call.software != own_software():
            raise AnalysisError(f"the worker {worker} has other software than the client: {_other(call.software)}")
        if call.shared is not None and not call.shared.is_seen():
            return {"worker": worker, "seen": False, "data": None, "error": None}
        with alone_on_one_thread(), _store(call) as store:
            if not store.is_whole(call.task.key):
                compute(_with_logs_here(call.task, worker, store if call.shared else _Remembered()), store)
            data = None if call.shared else store.read_bytes(call.task.key)
    except Exception as error:
        return {"worker": worker, "seen": True, "data": None, "error": _pickled(error)}
    return {"worker": worker, "seen": True, "data": data, "error": None}


def _worker() -> str:
    from distributed import get_worker

    address: str = get_worker().address
    return address


def _other(wanted: tuple[str, str, str]) -> str:
    mine = own_software()
    if mine[0] != wanted[0]:
        return f"tdacoustic {mine[0]}, not {wanted[0]}"
    return "the same version of tdacoustic with other source files" if mine[1] != wanted[1] else "another system"


def _pickled(error: Exception) -> bytes:
    """An exception; a defect with where it came from, which pickles leave behind."""
    if not isinstance(error, TdacousticError):
        error.add_note("".join(traceback.format_exception(error)))
    try:
        data = pickle.dumps(error)
        pickle.loads(data)
    except Exception:
        return pickle.dumps(RuntimeError(f"{type(error).__name__}: {error}"))
    return data


# ---------------------------------------------------------------- inputs


@contextmanager
def _store(call: Call) -> Iterator[Store]:
    """The shared store, once what the task rests on is there; else one for this task, with what came along."""
    if call.shared is not None:
        store = Store(call.shared.folder)
        for upstream in call.task.upstream:
            awaited(store, upstream.key)
        yield store
        return
    with tempfile.TemporaryDirectory(dir=_scratch(), ignore_cleanup_errors=True) as folder:
        store = Store(folder)
        for key, data in call.upstream.items():
            store.write_bytes(key, data)
        yield store


def awaited(store: Store, key: str) -> bool:
    """Whether a store has a key, giving a network file system time to show what another machine wrote."""
    end = time.monotonic() + _LATE_S
    while key not in store:
        if time.monotonic() > end:
            return False
        with suppress(OSError):
            list((store.folder / "results" / key[:2]).iterdir())  # makes NFS look again
        time.sleep(0.1)
    return True


@cache
def _scratch() -> str:
    """A folder of this process, gone when it ends."""
    from distributed import get_worker

    return tempfile.mkdtemp(prefix="tdacoustic-", dir=get_worker().local_directory)  # dask removes that folder


class _Remembered:
    """Hashes of logs, remembered as long as this process lives."""

    _texts: Final[dict[Path, str]] = {}

    def remembered_hash(self, path: Path) -> str | None:
        """Return what was kept, or None."""
        return self._texts.get(path)

    def remember_hash(self, path: Path, text: str) -> None:
        """Keep a text."""
        self._texts[path] = text


def _with_logs_here(task: Task, worker: str, memory: HashMemory) -> Task:
    """The task with its logs where this machine has them."""

    def here(value: Task | LogFile | tuple[LogFile, ...]) -> Task | LogFile | tuple[LogFile, ...]:
        if isinstance(value, Task):
            return value
        if isinstance(value, tuple):
            return tuple(_log_here(log, worker, memory) for log in value)
        return _log_here(value, worker, memory)

    return replace(task, inputs={name: here(value) for name, value in task.inputs.items()})


def _log_here(log: LogFile, worker: str, memory: HashMemory) -> LogFile:
    """A log whose content this worker has checked: read where it lies, or fetched where it has an address.

    Raises
    ------
    MissingFileError, AnalysisError
    """
    for companion in log.companions:
        _log_here(companion, worker, memory)
    path = log.path
    if not path.is_file():
        if log.url is None:
            raise MissingFileError(
                f"{path}: no such file on the worker {worker}; logs must lie on a file system that every worker sees, "
                "or be named by URL"
            )
        path = fetch(log.url, Path(_scratch()) / "fetched")
    if path.stat().st_size == log.n_bytes:
        found = log_file(path, memory)
        if found.sha256 == log.sha256:
            return replace(log, path=path)
    raise AnalysisError(
        f"{log.path if path == log.path else log.url}: the worker {worker} finds another content there than the client "
        f"did ({path.stat().st_size} bytes, the client's has {log.n_bytes}); it changed, or the path is another file "
        "there"
    )
