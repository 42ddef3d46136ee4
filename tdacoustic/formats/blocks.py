"""What every reader does alike: check what was asked for, group it by where it lies, cut what it read into blocks."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError

__all__ = ["by_origin", "check_request", "in_asked_order", "rebuffered", "spans", "unique_names"]

_Origin = TypeVar("_Origin", bound=Hashable)


def check_request(path: Path, n_samples: int, start: int, stop: int, block_size: int) -> None:
    """Refuse a request that the file cannot meet.

    Raises
    ------
    FormatError
        ``0 <= start <= stop <= n_samples`` or ``block_size > 0`` does not hold.
    """
    if block_size <= 0:
        raise FormatError(f"{path}: block_size must be > 0, got {block_size}")
    if not 0 <= start <= stop:
        raise FormatError(f"{path}: 0 <= start <= stop must hold, got start = {start}, stop = {stop}")
    if stop > n_samples:
        raise FormatError(f"{path}: samples {start} to {stop} were asked for, the file holds {n_samples}")


def spans(start: int, stop: int, step: int) -> Iterator[tuple[int, int]]:
    """Yield ``(first, last + 1)`` of the blocks from `start` to `stop`.

    Examples
    --------
    >>> list(spans(3, 10, 4))
    [(3, 7), (7, 10)]
    """
    for first in range(start, stop, step):
        yield first, min(first + step, stop)


def by_origin(origins: Iterable[_Origin]) -> dict[_Origin, list[int]]:
    """Group the channels asked for by the place that each is stored in, in the order of their first mention.

    Parameters
    ----------
    origins : iterable of hashable
        Of each channel: the dataset, array, group or track that is read once for all of its channels.

    Returns
    -------
    dict
        Origin -> positions of its channels in the request.

    Examples
    --------
    >>> by_origin(["b", "a", "b"])
    {'b': [0, 2], 'a': [1]}
    """
    rows: dict[_Origin, list[int]] = {}
    for row, origin in enumerate(origins):
        rows.setdefault(origin, []).append(row)
    return rows


def in_asked_order(
    pieces: Sequence[Iterable[NDArray[np.float64]]], rows: Iterable[Sequence[int]], block_size: int
) -> Iterator[NDArray[np.float64]]:
    """Join what was read from several places, its channels in the order in which they were asked for.

    Parameters
    ----------
    pieces : sequence of iterables of ndarray, shape (channels of one place, n)
        With any n each; all places give the same number of samples.
    rows : iterable of sequences of int
        Positions in the request of the channels of each place, as `by_origin` gives them or in any order.
    block_size : int

    Yields
    ------
    ndarray, shape (channels asked for, block_size)
        The last one may be shorter.
    """
    order = np.argsort([row for members in rows for row in members])
    as_asked = bool((order == np.arange(order.size)).all())
    for blocks in zip(*[rebuffered(one, block_size) for one in pieces], strict=True):
        joined = blocks[0] if len(blocks) == 1 else np.concatenate(blocks)
        yield joined if as_asked else joined[order]


def rebuffered(pieces: Iterable[NDArray[np.float64]], block_size: int) -> Iterator[NDArray[np.float64]]:
    """Cut arrays of any length into blocks of one length.

    Parameters
    ----------
    pieces : iterable of ndarray, shape (channels, n)
        With any n each.
    block_size : int

    Yields
    ------
    ndarray, shape (channels, block_size)
        C-contiguous; the last one may be shorter.
    """
    held: list[NDArray[np.float64]] = []
    n_held = 0
    for piece in pieces:
        at = 0
        while n_held + piece.shape[1] - at >= block_size:
            take = block_size - n_held
            held.append(piece[:, at : at + take])
            at += take
            yield _joined(held)
            held, n_held = [], 0
        if at < piece.shape[1]:
            held.append(piece[:, at:] if at == 0 else piece[:, at:].copy())
            n_held += piece.shape[1] - at
    if held:
        yield _joined(held)


def _joined(held: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.ascontiguousarray(held[0]) if len(held) == 1 else np.concatenate(held, axis=1)


def unique_names(names: Sequence[str]) -> tuple[list[str], list[str | None]]:
    """Make the names of channels unique.

    Returns
    -------
    names : list of str
        The second ``a`` has become ``a#2``.
    flags : list of (str or None)
        One sentence where a name was changed.

    Examples
    --------
    >>> unique_names(["a", "b", "a"])[0]
    ['a', 'b', 'a#2']
    """
    given = set(names)
    taken: set[str] = set()
    count: dict[str, int] = {}
    result: list[str] = []
    flags: list[str | None] = []
    for name in names:
        unique = name
        while unique in taken or (unique != name and unique in given):
            count[name] = count.get(name, 1) + 1
            unique = f"{name}#{count[name]}"
        taken.add(unique)
        result.append(unique)
        flags.append(
            None if unique == name else f"the log names several channels {name!r}: this one is called {unique!r}"
        )
    return result, flags
