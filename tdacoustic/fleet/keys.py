"""Tables of a fleet's dotted keys, as ``[[sweep]]`` and ``[[what_if]]`` have them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

__all__ = ["flat_keys"]


def flat_keys(table: Mapping[str, Any]) -> tuple[tuple[str, Any], ...]:
    """Return the dotted keys of a table with their values; keys without quotes come as tables in tables.

    Parameters
    ----------
    table : mapping

    Raises
    ------
    ValueError
        A key stands in it with and without quotes.

    Examples
    --------
    >>> flat_keys({"masuda": {"constant_db": 20}, "model.motor_gain_db": 1})
    (('masuda.constant_db', 20), ('model.motor_gain_db', 1))
    """
    pairs = tuple(_flat(table))
    keys = [key for key, _ in pairs]
    twice = next((key for number, key in enumerate(keys) if key in keys[:number]), None)
    if twice is not None:
        raise ValueError(f"names {twice!r} twice, with and without quotes")
    return pairs


def _flat(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value
