"""What every process of its own needs that runs a native library on a file from outside.

Such a library can end its process, run for ever or take all memory. It then must not take the program, or a worker of
its pool, along. A plain ``subprocess`` is used, because the processes of `multiprocessing` import the user's script
again.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Mapping
from typing import Final

__all__ = ["PYTHON", "bound_memory", "child_environment", "end_with_the_parent"]

PYTHON: Final = (sys.executable, "-P")
"""The interpreter; ``-P``: no modules of the working directory."""


def child_environment(more: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return the environment of a child that imports what this process can import."""
    return os.environ | {"PYTHONPATH": os.pathsep.join(entry for entry in sys.path if entry)} | dict(more or {})


def bound_memory(most_bytes: int) -> None:
    """Bound the address space of this process where the system can; a crash then leaves no picture of it behind."""
    try:
        import resource
    except ImportError:  # Windows
        return
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    most_bytes = most_bytes if hard == resource.RLIM_INFINITY else min(most_bytes, hard)
    resource.setrlimit(resource.RLIMIT_AS, (most_bytes, most_bytes))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def end_with_the_parent() -> None:
    """End this process as soon as its standard input ends, which the parent holds open as long as it lives."""
    threading.Thread(target=_wait, daemon=True).start()


def _wait() -> None:
    os.read(0, 1)
    os._exit(1)
