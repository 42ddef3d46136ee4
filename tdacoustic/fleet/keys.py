"""Tables of a fleet's dotted keys, as ``[[sweep]]`` and ``[[what_if]]`` have them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any

__all__ = ["flat_keys"]


def flat_keys(table: Mapping[str, Any], of_values: Collection[str] = ()) -> tuple[tuple[str, Any], ...]:
    """Return the dotted keys of a table with their values; keys without quotes come as tables in tables.

    Parameters
    ----------
    table : mapping
    of_values : collection of str
        A table with one of these keys is a value, not a table of keys.

    Raises
    ------
    ValueError
        A key stands in it with and without quotes.

    Examples
    --------
    >>> flat_keys({"masuda": {"constant_db": 20}, "model.motor_gain_db": 1})
    (('masuda.constant_db', 20), ('model.motor_gain_db', 1))
    """
    pairs = tuple(_flat(table, of_values))
    keys = [key for key, _ in pairs]
    twice = next((key for number, key in enumerate(keys) if key in keys[:number]), None)
    if twice is not None:
        raise ValueError(f"names {twice!r} twice, with and without quotes")
    return pairs


def _flat(table: Mapping[str, Any], of_values: Collection[str], before: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, Mapping) and not any(one in value for one in of_values):
            yield from _flat(value, of_values, f"{before}{key}.")
        else:
            yield f"{before}{key}", value
