"""Frozen dataclasses to a JSON tree and a list of arrays, and back.

Nothing is ever executed while decoding: a type is looked up by name among the
dataclasses of tdacoustic alone, and arrays are read without pickle.
"""

from __future__ import annotations

import dataclasses
import hashlib
import importlib
import json
import math
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import StoreError

__all__ = ["canonical_json", "decode", "encode", "fingerprint"]

_PACKAGE = "tdacoustic."


def _type_name(kind: type) -> str:
    return f"{kind.__module__}:{kind.__qualname__}"


def encode(value: Any, arrays: list[NDArray[Any]]) -> Any:
    """Return the JSON tree of a value; its arrays are appended to `arrays`.

    Parameters
    ----------
    value : object
        Frozen dataclasses of tdacoustic, tuples, lists, dicts with string keys,
        numbers, strings, None, paths and numpy arrays, nested freely.
    arrays : list of ndarray
        Receives the arrays, in the order in which the tree refers to them.

    Raises
    ------
    StoreError
        A value of another type.
    """
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        number = float(value)
        return number if math.isfinite(number) else {"$float": repr(number)}
    if isinstance(value, np.ndarray):
        if value.dtype.hasobject:
            raise StoreError(f"an array of {value.dtype} cannot be kept in the store")
        arrays.append(value)
        return {"$array": len(arrays) - 1}
    if isinstance(value, tuple):
        return {"$tuple": [encode(item, arrays) for item in value]}
    if isinstance(value, list):
        return [encode(item, arrays) for item in value]
    if isinstance(value, dict):
        for key in value:
            if not isinstance(key, str):
                raise StoreError(f"a dict with the key {key!r} cannot be kept in the store; keys must be strings")
        return {"$dict": [[key, encode(item, arrays)] for key, item in value.items()]}
    if isinstance(value, PurePath):
        return {"$path": value.as_posix()}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {field.name: encode(getattr(value, field.name), arrays) for field in dataclasses.fields(value)}
        return {"$type": _type_name(type(value)), "fields": fields}
    raise StoreError(f"a value of type {type(value).__name__} cannot be kept in the store")


def _dataclass_named(name: str) -> type:
    module_name, _, qualified = name.partition(":")
    if not module_name.startswith(_PACKAGE):
        raise StoreError(f"the store names a type outside tdacoustic: {name!r}")
    found: Any = importlib.import_module(module_name)
    for part in qualified.split("."):
        found = getattr(found, part)
    if not (isinstance(found, type) and dataclasses.is_dataclass(found) and _type_name(found) == name):
        raise StoreError(f"the store names {name!r}, which is no dataclass of tdacoustic")
    return found


def decode(tree: Any, arrays: list[NDArray[Any]]) -> Any:
    """Rebuild the value that `encode` took apart; arrays come back read-only."""
    if isinstance(tree, list):
        return [decode(item, arrays) for item in tree]
    if not isinstance(tree, dict):
        return tree
    if "$type" in tree:
        kind = _dataclass_named(tree["$type"])
        return kind(**{name: decode(item, arrays) for name, item in tree["fields"].items()})
    if "$tuple" in tree:
        return tuple(decode(item, arrays) for item in tree["$tuple"])
    if "$dict" in tree:
        return {key: decode(item, arrays) for key, item in tree["$dict"]}
    if "$array" in tree:
        array = arrays[tree["$array"]]
        array.flags.writeable = False
        return array
    if "$float" in tree:
        return float(tree["$float"])
    if "$path" in tree:
        from pathlib import Path

        return Path(tree["$path"])
    raise StoreError(f"the store holds a value that cannot be read: {sorted(tree)}")


def canonical_json(tree: Any) -> str:
    """One spelling for one value: sorted keys, no spaces, no NaN."""
    return json.dumps(tree, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def fingerprint(value: Any) -> str:
    """SHA-256 of a value, arrays included."""
    arrays: list[NDArray[Any]] = []
    digest = hashlib.sha256(canonical_json(encode(value, arrays)).encode())
    for array in arrays:
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
