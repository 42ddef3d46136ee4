"""Logs that are named by URL: fetched whole, kept, and fetched again only where they changed."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO, Final
from urllib.parse import unquote, urlsplit
from uuid import uuid4

from tdacoustic.errors import FetchError, MissingFileError, MissingPackageError, TdacousticError

__all__ = ["fetch"]

_BLOCK_BYTES: Final = 4 << 20

_RESERVE_BYTES: Final = 1 << 30
"""What a fetch leaves free on the disk [assumed]."""

_OLD_S: Final = 86400.0
"""An older version of a log, or what a killed program left of it, is removed after this long."""

_STAMPS: Final = frozenset(
    {"etag", "md5", "contentmd5", "digest", "crc32c", "generation", "versionid", "mtime", "modified", "updated"}
    | {"lastmodified", "created", "ino"}
)
"""What file systems call that by which they know a content; letters and digits alone, lower case."""


def fetch(url: str, folder: Path, part: Callable[[float], None] | None = None) -> Path:
    """Fetch the file that a URL names, or find it where it was fetched before and did not change.

    Known by URL, size and what the file system says of the content (its tag, its time of change); where it says
    nothing, it is fetched each time. Bounded by the free disk, of which 1 GiB is left. Nothing is unpacked and no URL
    within a URL is followed; what http redirects to is.

    Parameters
    ----------
    url : str
        Of any scheme that fsspec knows, its packages and credentials being those of the machine.
    folder : Path
        In which fetched files are kept.
    part : callable, optional
        Called with the part that has been fetched.

    Returns
    -------
    Path
        Named as in the URL.

    Raises
    ------
    MissingPackageError
        fsspec, or what it needs for the scheme, is not installed.
    MissingFileError
        There is no such file.
    FetchError
        It cannot be fetched, or is too large.
    """
    with _clear_errors(url):
        from fsspec.core import url_to_fs

        system, path = url_to_fs(url)
        said: dict[str, Any] = system.info(path)
        if said.get("type") == "directory":
            raise FetchError(f"{url}: is a folder; name a log")
        size = said.get("size")
        n_bytes = int(size) if size is not None else None
        stamps = _stamps(said)
        target = (
            folder / _hashed(url) / (_hashed(json.dumps([n_bytes, stamps])) if stamps else uuid4().hex) / _name(url)
        )
        if stamps and target.is_file() and n_bytes in (None, target.stat().st_size):
            return target
        _sweep(folder / _hashed(url))
        _check_room(url, n_bytes or 0, folder)
        with system.open(path, "rb") as source:
            _keep(url, source, target, n_bytes, part)
    return target


@contextmanager
def _clear_errors(url: str) -> Iterator[None]:
    """Turn what file systems of all kinds raise into one clear line."""
    try:
        yield
    except TdacousticError:
        raise
    except ImportError as error:
        if (error.name or "").split(".")[0] == "fsspec":
            raise MissingPackageError(f"{url}: fetching it needs fsspec: pip install 'tdacoustic[cluster]'") from error
        raise MissingPackageError(f"{url}: fetching it needs a package that is not installed: {error}") from error
    except FileNotFoundError:
        raise MissingFileError(f"{url}: no such file") from None
    except Exception as error:
        words = " ".join(str(error).split()) or "no reason given"
        raise FetchError(f"{url}: cannot be fetched ({type(error).__name__}: {words[:300]})") from error


def _stamps(said: dict[str, Any]) -> dict[str, str]:
    """What tells one content of a file from another, besides its size."""
    named = {re.sub("[^a-z0-9]", "", str(key).lower()): value for key, value in said.items()}
    return {key: str(named[key]) for key in sorted(_STAMPS & named.keys()) if named[key] is not None}


def _hashed(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _name(url: str) -> str:
    """Name of a URL's file, fit for any disk; its suffix kept, because formats go by it."""
    name = re.sub(r"[^\w.()+ -]", "_", PurePosixPath(unquote(urlsplit(url).path)).name)[-100:].strip(" .")
    return name or "log"


def _check_room(url: str, n_bytes: int, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    free = shutil.disk_usage(folder).free - _RESERVE_BYTES
    if n_bytes > free:
        raise FetchError(
            f"{url}: {n_bytes} bytes, but the disk of {folder} has room for {max(0, free)} (1 GiB is left)"
        )


def _keep(url: str, source: BinaryIO, target: Path, n_bytes: int | None, part: Callable[[float], None] | None) -> None:
    """Copy a file under a temporary name and move it when it is whole."""
    target.parent.mkdir(parents=True, exist_ok=True)
    temporary = target.with_name(f"{uuid4().hex}.tmp")
    held = 0
    try:
        with temporary.open("wb") as stream:
            while block := source.read(_BLOCK_BYTES):
                held += len(block)
                if n_bytes is not None and held > n_bytes:
                    raise FetchError(f"{url}: more than the {n_bytes} bytes that it was said to have")
                _check_room(url, len(block), target.parent)
                stream.write(block)
                if part is not None and n_bytes:
                    part(held / n_bytes)
        if n_bytes not in (None, held):
            raise FetchError(f"{url}: ended after {held} of {n_bytes} bytes")
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def _sweep(folder: Path) -> None:
    """Take away older versions, and what killed programs left, once they are old."""
    for path in folder.glob("*/*"):
        with suppress(OSError):
            if time.time() - path.stat().st_mtime > _OLD_S:
                path.unlink()
                path.parent.rmdir()
