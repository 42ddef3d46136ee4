"""The store: results under their keys, each written whole or not at all."""

from __future__ import annotations

import hashlib
import io
import json
import os
import struct
import time
import zipfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import StoreError
from tdacoustic.steps.codec import canonical_json, decode, encode
from tdacoustic.steps.record import Record

__all__ = ["Store", "default_store_path"]

_DAMAGED = (
    *(OSError, ValueError, KeyError, EOFError, AttributeError, ImportError, TypeError),
    *(zipfile.BadZipFile, zlib.error, struct.error, RuntimeError, MemoryError, SyntaxError, IndexError),
)
"""What reading a file of flipped bits has been seen to raise."""

_LEFT_OVER_S = 86400.0
"""A temporary file as old as this was left by a process that was killed."""


def default_store_path() -> Path:
    """Return ``$TDACOUSTIC_STORE``, else a folder in the user's cache directory."""
    named = os.environ.get("TDACOUSTIC_STORE")
    if named:
        return Path(named)
    import platformdirs

    return Path(platformdirs.user_cache_dir("tdacoustic", appauthor=False)) / "store"


class Store:
    """Results in a folder, one file a key.

    A file holds the record and the result. It is written under a temporary name
    and renamed, so that a key either exists whole or does not exist. A file that
    cannot be read is treated as absent and is computed again.

    Parameters
    ----------
    folder : str or Path
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)

    def __repr__(self) -> str:
        return f"Store({str(self.folder)!r})"

    def _path(self, key: str) -> Path:
        return self.folder / "results" / key[:2] / f"{key}.npz"

    def __contains__(self, key: str) -> bool:
        return self._path(key).is_file()

    def save(self, key: str, result: Any, record: Record) -> None:
        """Keep a result and its record under a key."""
        arrays: list[NDArray[Any]] = []
        tree = {"schema": "tdacoustic-result/1", "result": encode(result, arrays), "record": encode(record, [])}
        names: dict[str, Any] = {f"a{index}": array for index, array in enumerate(arrays)}
        text = np.frombuffer(canonical_json(tree).encode(), dtype=np.uint8)
        self._keep(key, lambda stream: np.savez(stream, tree=text, **names))

    def _keep(self, key: str, write: Callable[[BinaryIO], object]) -> None:
        """Write a key's file under a temporary name and move it."""
        target = self._path(key)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            _sweep(target.parent)
            temporary = target.with_name(f"{key}.{uuid4().hex}.tmp")
            try:
                with temporary.open("wb") as stream:
                    write(stream)
                    stream.flush()
                    os.fsync(stream.fileno())
                _replace(temporary, target)
            finally:
                temporary.unlink(missing_ok=True)
        except OSError as error:
            raise StoreError(f"the store {self.folder} cannot be written: {error}") from error

    def read_bytes(self, key: str) -> bytes:
        """Return the file of a key as it is, to be kept elsewhere; raises KeyError as `load` does."""
        path = self._path(key)
        try:
            data = path.read_bytes()
        except OSError:
            raise KeyError(key) from None
        try:
            _check_whole(key, data)
        except StoreError as error:
            path.unlink(missing_ok=True)
            raise KeyError(str(error)) from error
        return data

    def write_bytes(self, key: str, data: bytes) -> None:
        """Keep what another store's `read_bytes` gave.

        Raises
        ------
        StoreError
            It is not whole, or cannot be written.
        """
        _check_whole(key, data)
        self._keep(key, lambda stream: stream.write(data))

    def load(self, key: str) -> Any:
        """Return the result under a key.

        Raises
        ------
        KeyError
            There is none, or the file is damaged (it is then removed).
        """
        path = self._path(key)
        try:
            with np.load(path, allow_pickle=False) as bundle:
                return _decoded(path.name, bundle)
        except FileNotFoundError:
            raise KeyError(key) from None
        except _DAMAGED as error:
            path.unlink(missing_ok=True)
            raise KeyError(f"{key}: damaged ({error})") from error

    def record(self, key: str) -> Record:
        """Return the record of a key; raises KeyError as `load` does."""
        try:
            with np.load(self._path(key), allow_pickle=False) as bundle:
                record = decode(_tree(key, bundle)["record"], [])
        except _DAMAGED as error:
            raise KeyError(key) from error
        if not isinstance(record, Record):
            raise KeyError(key)
        return record

    def is_whole(self, key: str) -> bool:
        """Whether there is a result under a key whose record can be read."""
        if key not in self:
            return False
        try:
            self.record(key)
        except KeyError:
            return False
        return True

    def _hash_path(self, path: Path) -> Path:
        name = hashlib.sha256(str(path.resolve()).encode()).hexdigest()
        return self.folder / "hashes" / f"{name}.json"

    def remembered_hash(self, path: Path) -> str | None:
        """Return what `remember_hash` kept about a log, or None."""
        try:
            return self._hash_path(path).read_text(encoding="utf-8")
        except (OSError, ValueError):
            return None

    def remember_hash(self, path: Path, text: str) -> None:
        """Keep a log's hash; failing to is no error, it is only computed again."""
        target = self._hash_path(path)
        temporary = target.with_name(f"{target.stem}.{uuid4().hex}.tmp")
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            temporary.write_text(text, encoding="utf-8")
            temporary.replace(target)
        except OSError:
            with suppress(OSError):
                temporary.unlink()


def _replace(temporary: Path, target: Path) -> None:
    """Move a result into place; where Windows refuses that, because somebody reads the same key's, that one stays."""
    try:
        temporary.replace(target)
    except PermissionError:
        if not target.is_file():
            raise


def _tree(name: str, bundle: Any) -> Any:
    tree = json.loads(bytes(bundle["tree"]).decode())
    if tree.get("schema") != "tdacoustic-result/1":
        raise StoreError(f"{name}: schema {tree.get('schema')!r} is not 'tdacoustic-result/1'")
    return tree


def _decoded(name: str, bundle: Any) -> Any:
    arrays = [bundle[f"a{index}"] for index in range(len(bundle.files) - 1)]
    return decode(_tree(name, bundle)["result"], arrays)


def _check_whole(key: str, data: bytes) -> None:
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as bundle:
            _decoded(key, bundle)
            if not isinstance(decode(_tree(key, bundle)["record"], []), Record):
                raise StoreError("there is no record in it")
    except _DAMAGED as error:
        raise StoreError(f"{key}: these {len(data)} bytes are no whole result ({error})") from error


@cache
def _sweep(folder: Path) -> None:
    """Take away the temporary files that killed processes left long ago; once a process."""
    for temporary in folder.glob("*.tmp"):
        with suppress(OSError):
            if time.time() - temporary.stat().st_mtime > _LEFT_OVER_S:
                temporary.unlink()
