"""Logs as inputs of steps: known by the sha256 of their content."""

from __future__ import annotations

import hashlib
import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from tdacoustic.errors import MissingFileError

__all__ = ["LogFile", "log_file"]

_RACY_S = 2.0
"""A file changed this shortly before it was hashed could change again within one tick of its time stamp."""


class HashMemory(Protocol):
    """Remembers a text about a log."""

    def remembered_hash(self, path: Path) -> str | None:
        """Return what was kept, or None."""
        ...

    def remember_hash(self, path: Path, text: str) -> None:
        """Keep a text."""
        ...


@dataclass(frozen=True)
class LogFile:
    """A log on disk and the sha256 of its content."""

    path: Path
    sha256: str
    n_bytes: int


def _remembered(store: HashMemory, path: Path, identity: dict[str, int]) -> str | None:
    """Return the hash that the store remembers for a file of this identity; a damaged note is none."""
    text = store.remembered_hash(path)
    try:
        entry = json.loads(text) if text is not None else None
    except ValueError:
        return None
    if not isinstance(entry, dict) or any(entry.get(name) != value for name, value in identity.items()):
        return None
    sha256 = entry.get("sha256")
    return sha256 if isinstance(sha256, str) else None


def log_file(path: Path, store: HashMemory | None = None) -> LogFile:
    """Hash a log, or look its hash up where size and time stamps are as they were.

    Parameters
    ----------
    path : Path
    store : HashMemory, optional
        A `tdacoustic.steps.Store`.
        Remembers hashes between sessions, keyed by path, size and time of change.

    Raises
    ------
    MissingFileError
        There is no such file.
    """
    if not path.is_file():
        raise MissingFileError(f"{path}: no such file")
    stat = path.stat()
    identity = {"size": stat.st_size, "mtime_ns": stat.st_mtime_ns, "ctime_ns": stat.st_ctime_ns}
    remembered = None if store is None else _remembered(store, path, identity)
    if remembered is not None:
        return LogFile(path, remembered, stat.st_size)
    with path.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    if store is not None and time.time_ns() - stat.st_mtime_ns > _RACY_S * 1e9:
        store.remember_hash(path, json.dumps({**identity, "sha256": digest}))
    return LogFile(path, digest, stat.st_size)
