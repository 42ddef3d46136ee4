"""Logs as inputs of steps: known by the sha256 of their content."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from tdacoustic.errors import MissingFileError

__all__ = ["HashMemory", "LogFile", "log_file"]

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
    """A log on disk and the sha256 of its content.

    Parameters
    ----------
    path : Path
    sha256 : str
        Of the file itself.
    n_bytes : int
    companions : tuple of LogFile
        The further files that the log consists of.
    url : str or None
        Whence it was fetched, for who does not see the path; no part of any key.
    """

    path: Path
    sha256: str
    n_bytes: int
    companions: tuple[LogFile, ...] = ()
    url: str | None = None

    @property
    def files(self) -> tuple[LogFile, ...]:
        """The file and its companions."""
        return (self, *self.companions)

    @property
    def key(self) -> str:
        """What the whole log is known by: ``sha256:`` of the file, or of all its files' hashes where it has several."""
        if not self.companions:
            return f"sha256:{self.sha256}"
        text = "\n".join(file.sha256 for file in self.files)
        return f"sha256:{hashlib.sha256(text.encode()).hexdigest()}"


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


def log_file(
    path: Path, store: HashMemory | None = None, companions: Sequence[Path] = (), url: str | None = None
) -> LogFile:
    """Hash a log, or look its hash up where size and time stamps are as they were.

    Parameters
    ----------
    path : Path
    store : HashMemory, optional
        A `tdacoustic.steps.Store`.
        Remembers hashes between sessions, keyed by path, size and time of change.
    companions : sequence of Path
        Further files that the log consists of (`tdacoustic.recording.Log.companions`), hashed like it.
    url : str, optional
        Whence the log was fetched.

    Raises
    ------
    MissingFileError
        There is no such file.
    """
    others = tuple(log_file(companion, store) for companion in companions)
    if not path.is_file():
        raise MissingFileError(f"{path}: no such file")
    stat = path.stat()
    identity = {"size": stat.st_size, "mtime_ns": stat.st_mtime_ns, "ctime_ns": stat.st_ctime_ns}
    remembered = None if store is None else _remembered(store, path, identity)
    if remembered is not None:
        return LogFile(path, remembered, stat.st_size, others, url)
    with path.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    if store is not None and time.time_ns() - stat.st_mtime_ns > _RACY_S * 1e9:
        store.remember_hash(path, json.dumps({**identity, "sha256": digest}))
    return LogFile(path, digest, stat.st_size, others, url)
