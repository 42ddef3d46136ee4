"""Entries of parameters that are lists or tables, under keys such as ``gear_dynamics.mass_kg.2``."""

from __future__ import annotations

from typing import Any

from tdacoustic.fleet.messages import key_problem

__all__ = ["entry_at", "split_entry", "with_entry"]


def split_entry(key: str) -> tuple[str, tuple[int, ...]]:
    """Return the parameter that a dotted key is in, and the positions of its entry from 0.

    A key of a whole parameter, or one that no fleet has, comes back as it is.

    Examples
    --------
    >>> split_entry("gear_pair.1.transmission_error_um.2")
    ('gear_pair.1.transmission_error_um', (1,))
    >>> split_entry("masuda.constant_db")
    ('masuda.constant_db', ())
    """
    parts = key.split(".")
    for end in range(len(parts) - 1, 1, -1):
        whole, rest = ".".join(parts[:end]), parts[end:]
        if not all(part.isdecimal() and int(part) > 0 for part in rest):
            break
        if key_problem(whole) is None:
            return whole, tuple(int(part) - 1 for part in rest)
    return key, ()


def entry_at(value: Any, place: tuple[int, ...]) -> Any:
    """Return an entry of a value; None where it has none there."""
    for index in place:
        if not isinstance(value, tuple) or index >= len(value):
            return None
        value = value[index]
    return value


def with_entry(value: Any, place: tuple[int, ...], entry: Any) -> Any:
    """Return a value with one of its entries replaced; it must have one there.

    Examples
    --------
    >>> with_entry(((300.0, 101.9), (340.0, 101.9)), (1, 1), 99.0)
    ((300.0, 101.9), (340.0, 99.0))
    """
    if not place:
        return entry
    first, *rest = place
    return (*value[:first], with_entry(value[first], tuple(rest), entry), *value[first + 1 :])
