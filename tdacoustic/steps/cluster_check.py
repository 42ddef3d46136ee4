"""Whether the workers of a cluster can compute what this client would."""

from __future__ import annotations

import pkgutil
import time
from collections.abc import Callable, Mapping
from importlib import metadata
from typing import TYPE_CHECKING, Any, Final

from tdacoustic.errors import ExecutorError
from tdacoustic.steps.software import own_software

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["asked", "check_workers", "package_problem"]

_LIBRARIES: Final = ("numpy", "scipy", "numba")
"""Libraries that make the numbers: of other versions they are the same within 1e-9 only."""

_WAIT_S: Final = 30.0
"""For how long a first worker is waited for."""


def check_workers(client: Client, address: str) -> tuple[str, ...]:
    """Ask every worker of a cluster for its software.

    What is asked first is a function of the standard library, which a worker without tdacoustic has too.

    Parameters
    ----------
    client : distributed.Client
    address : str
        Of the scheduler.

    Returns
    -------
    tuple of str
        Doubts: libraries of other versions, workers of several threads.

    Raises
    ------
    ExecutorError
        There is no worker, or one has no tdacoustic or another one.
    """
    end = time.monotonic() + _WAIT_S
    while not (threads := client.nthreads()):
        if time.monotonic() > end:
            raise ExecutorError(
                f"the scheduler {address} has no worker; start some: dask worker {address} --nthreads 1"
            )
        time.sleep(0.2)
    problem = package_problem(client)
    if problem is not None:
        raise ExecutorError(problem)
    software = asked(client, own_software)
    for worker, held in software.items():
        if held != own_software():
            raise ExecutorError(
                f"the worker {worker} has the same version of tdacoustic, but other source files or another kind of "
                f"system; install there what the client has{_more(software, held)}"
            )
    return (*_library_doubts(client), *_thread_doubts(threads))


def package_problem(client: Client) -> str | None:
    """Say which worker lacks tdacoustic, or has another version of it; None where all are fine.

    Parameters
    ----------
    client : distributed.Client
    """
    wanted = own_software()[0]
    found = asked(client, pkgutil.resolve_name, "tdacoustic:__version__")
    for worker, version in found.items():
        if version == wanted:
            continue
        if isinstance(version, ImportError | AttributeError):
            what = "has no tdacoustic"
        elif isinstance(version, Exception):
            what = f"does not say which tdacoustic it has ({type(version).__name__}: {version})"
        else:
            what = f"has tdacoustic {version}, this is {wanted}"
        return (
            f"the worker {worker} {what}; install tdacoustic {wanted} into the Python that runs `dask worker` there, "
            f"and start it again{_more(found, version)}"
        )
    return None


def asked(client: Client, function: Callable[..., Any], *arguments: Any) -> dict[str, Any]:
    """Return what each worker answers, or what it raises; one that has left meanwhile is none.

    Parameters
    ----------
    client : distributed.Client
    function : callable
        Of a module that the workers have.
    *arguments
        Of the function.
    """
    found: dict[str, Any] = client.run(function, *arguments, on_error="return")
    return {worker: answer for worker, answer in found.items() if not isinstance(answer, OSError)}


def _more(found: Mapping[str, Any], said: Any) -> str:
    """How many other workers say the same."""
    others = sum(str(other) == str(said) for other in found.values()) - 1
    return f" (so do {others} other workers)" if others > 1 else " (so does another worker)" if others else ""


def _library_doubts(client: Client) -> list[str]:
    doubts = []
    for library in _LIBRARIES:
        wanted = metadata.version(library)
        found = asked(client, metadata.version, library)
        others = {worker: version for worker, version in found.items() if version != wanted}
        for version in dict.fromkeys(map(str, others.values())):
            worker = next(worker for worker, held in others.items() if str(held) == version)
            doubts.append(
                f"the worker {worker} has {library} {version}, this is {wanted}: its numbers are the same within 1e-9 "
                f"only{_more(others, version)}"
            )
    return doubts


def _thread_doubts(threads: Mapping[str, int]) -> list[str]:
    several = [worker for worker, count in threads.items() if count > 1]
    if not several:
        return []
    return [
        f"the worker {several[0]} has {threads[several[0]]} threads, but computes one task at a time; start it with "
        f"--nthreads 1 --nworkers {threads[several[0]]}"
        + (f" (and {len(several) - 1} other workers)" if len(several) > 1 else "")
    ]
