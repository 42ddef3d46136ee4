"""How far a long step has come, told to whoever listens."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

__all__ = ["listening", "tell_progress"]

_listener: ContextVar[Callable[[float], None] | None] = ContextVar("listener", default=None)


def tell_progress(part_done: float) -> None:
    """Called by a step now and then with the part of its work that is done, 0 to 1; nobody need listen."""
    listener = _listener.get()
    if listener is not None:
        listener(part_done)


@contextmanager
def listening(listener: Callable[[float], None] | None) -> Iterator[None]:
    """Hear `tell_progress` of the steps that run inside, in this process."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)
