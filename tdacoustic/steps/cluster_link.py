"""The connection of a process to a scheduler, made once and checked."""

from __future__ import annotations

import atexit
import logging
import os
import threading
import time
from contextlib import suppress
from typing import Any, Final

from tdacoustic.errors import ExecutorError, MissingPackageError
from tdacoustic.steps.cluster_check import check_workers

__all__ = ["Link", "forget", "link_to"]

_CONNECT_S: Final = 10.0


class Link:
    """A connection of this process to a scheduler.

    Parameters
    ----------
    client : distributed.Client
    doubts : tuple of str
        About its workers.
    """

    def __init__(self, client: Any, doubts: tuple[str, ...]) -> None:
        self.client = client
        self.doubts = doubts
        self._n_threads = 0
        self._asked_s = -1e9
        self._seen_s = time.monotonic()

    def n_threads(self) -> int:
        """Threads of all workers, as of a few seconds ago."""
        if time.monotonic() - self._asked_s > 2.0:
            with suppress(Exception):  # a lost scheduler is heard of by what is in flight
                self._n_threads = sum(self.client.nthreads().values())
            self._asked_s = time.monotonic()
            if self._n_threads:
                self._seen_s = self._asked_s
        return self._n_threads

    def lonely_s(self) -> float:
        """For how long there has been no worker."""
        return 0.0 if self.n_threads() else time.monotonic() - self._seen_s


_links: dict[tuple[int, str], Link] = {}
_lock = threading.Lock()


def link_to(address: str) -> Link:
    """Return the connection of this process to a scheduler, made and its workers checked when it is first asked for.

    Parameters
    ----------
    address : str

    Raises
    ------
    MissingPackageError
        The package distributed is not installed.
    ExecutorError
        The scheduler does not answer, has no worker, or a worker has no tdacoustic or another one.
    """
    name = (os.getpid(), address)
    with _lock:
        if name not in _links:
            client = _connected(address)
            try:
                _links[name] = Link(client, check_workers(client, address))
            except BaseException:
                client.close(timeout=2)
                raise
            atexit.register(forget, address)
        return _links[name]


def _connected(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingPackageError(
            f"a scheduler ({address}) needs the package {error.name}, which is not installed: "
            "pip install 'tdacoustic[cluster]'"
        ) from error
    _check_address(address)  # a client that fails while it is made leaves dask's own thread in disorder
    for name in ("client", "batched", "core", "comm"):  # their traces of a lost scheduler: we say it
        logging.getLogger(f"distributed.{name}").setLevel(logging.CRITICAL)
    try:
        return Client(address, timeout=_CONNECT_S, set_as_default=False, name="tdacoustic")
    except Exception as error:
        words = " ".join(str(error).split())
        raise ExecutorError(
            f"the scheduler {address} does not answer ({type(error).__name__}: {words[:200]}); is `dask scheduler` "
            "running there?"
        ) from error


def _check_address(address: str) -> None:
    from distributed import Security
    from distributed.comm import parse_address
    from distributed.comm.registry import get_backend

    try:
        scheme, _ = parse_address(address)
        get_backend(scheme)
    except ValueError as error:
        raise ExecutorError(f"the scheduler {address} has no address of dask ({error}), as tcp://host:8786") from error
    if scheme == "tls" and Security().get_connection_args("client")["ssl_context"] is None:
        raise ExecutorError(
            f"the scheduler {address} asks for certificates, and dask's configuration names none: "
            "distributed.comm.tls.ca-file, distributed.comm.tls.client.cert and .key"
        )


def forget(address: str) -> None:
    """Close the connection to a scheduler."""
    link = _links.pop((os.getpid(), address), None)
    if link is not None:
        with suppress(Exception):
            link.client.close(timeout=2)
