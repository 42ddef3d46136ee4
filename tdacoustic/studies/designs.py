"""The points of a design sweep, and how they are cut into batches."""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Collection, Iterator
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FleetError
from tdacoustic.fleet import Fleet
from tdacoustic.fleet.design_sweep import DesignSweep, Range

__all__ = ["BATCH_POINTS", "Assignments", "batches_of", "coordinates", "points_of", "seed_of", "whole_keys"]

Real = NDArray[np.float64]

Assignments: TypeAlias = tuple[tuple[str, Any], ...]
"""Values by key, of one point."""

BATCH_POINTS: Final = 100
"""Points of a batch at most: some two seconds of work, beside which its place in the store costs nothing that counts,
and what a study that is killed has lost."""

_MOST_CUT: Final = 6
"""Axes of a grid along which a batch has more than one value."""


def points_of(sweep: DesignSweep, whole: Collection[str] = ()) -> tuple[Assignments, ...]:
    """Return the points of a design, in the order of its rows.

    A grid has its last key fastest. A Latin hypercube is made of hypercubes of `BATCH_POINTS` points each, so that one
    of twice as many begins with the same points. Saltelli's design has for each base point its rows A, B, and A with
    one column of B after the other; A and B are halves of a scrambled Sobol' sequence (Saltelli et al. 2010), so that
    this design too begins with that of half as many base points.

    Parameters
    ----------
    sweep : DesignSweep
    whole : collection of str
        Keys that take whole numbers alone: those of a range are equally likely.

    Examples
    --------
    >>> sweep = DesignSweep(name="two", parameters=(("a.b", (1.0, 2.0)), ("c.d", ("x", "y"))))
    >>> points_of(sweep)[1]
    (('a.b', 1.0), ('c.d', 'y'))
    """
    keys = sweep.keys
    if sweep.sampling == "grid":
        return tuple(tuple(zip(keys, values, strict=True)) for values in itertools.product(*sweep.values))
    unit = _hypercubes(sweep) if sweep.sampling == "latin_hypercube" else _saltelli(sweep)
    ranges = zip(keys, sweep.ranges, strict=True)
    columns = [_values(held, unit[:, place], key in whole) for place, (key, held) in enumerate(ranges)]
    return tuple(tuple(zip(keys, row, strict=True)) for row in zip(*columns, strict=True))


def whole_keys(sweep: DesignSweep, fleet: Fleet) -> tuple[str, ...]:
    """Return the keys with a range that take whole numbers alone, as teeth do.

    Parameters
    ----------
    sweep : DesignSweep
    fleet : Fleet
    """
    return tuple(key for key, held in sweep.parameters if isinstance(held, Range) and _is_whole(fleet, key))


def _is_whole(fleet: Fleet, key: str) -> bool:
    try:
        return isinstance(fleet.value_of(key), int)
    except FleetError:  # the file leaves it out
        return False


def seed_of(sweep: DesignSweep) -> int:
    """Return the seed of a design over ranges: the stated one, else one made of its parameters and ranges."""
    if sweep.seed is not None:
        return sweep.seed
    text = repr((sweep.sampling, [(k, float(r.low), float(r.high), r.scale) for k, r in _ranged(sweep)]))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big")


def _ranged(sweep: DesignSweep) -> Iterator[tuple[str, Range]]:
    yield from zip(sweep.keys, sweep.ranges, strict=True)


def _hypercubes(sweep: DesignSweep) -> Real:
    from scipy.stats import qmc

    d, n, seed = len(sweep.keys), sweep.n_points, seed_of(sweep)
    sizes = [min(BATCH_POINTS, n - first) for first in range(0, n, BATCH_POINTS)]
    cubes = (np.random.default_rng([seed, number]) for number in range(len(sizes)))
    return np.concatenate([qmc.LatinHypercube(d, rng=rng).random(size) for rng, size in zip(cubes, sizes, strict=True)])


def _saltelli(sweep: DesignSweep) -> Real:
    from scipy.stats import qmc

    d, n = len(sweep.keys), sweep.base_points or 0
    sequence = qmc.Sobol(2 * d, scramble=True, rng=np.random.default_rng(seed_of(sweep)))
    first, second = np.hsplit(sequence.random_base2(n.bit_length() - 1), 2)
    rows = np.repeat(first[:, None, :], d + 2, axis=1)
    rows[:, 1] = second
    place = np.arange(d)
    rows[:, place + 2, place] = second
    return rows.reshape(-1, d)


def _values(held: Range, unit: Real, whole: bool) -> list[float] | list[int]:
    """Values of a range where it is passed through from 0 to 1."""
    low, high = (held.low - 0.5, held.high + 0.5) if whole else (held.low, held.high)
    values = low * (high / low) ** unit if held.scale == "log" else low + (high - low) * unit
    if whole:
        return [int(value) for value in np.clip(np.rint(values), held.low, held.high)]
    return [float(value) for value in np.clip(values, held.low, held.high)]


def coordinates(sweep: DesignSweep, points: tuple[Assignments, ...]) -> Real:
    """Return where points lie in the ranges of a design, from 0 at the lower end to 1, shape (points, parameters).

    Parameters
    ----------
    sweep : DesignSweep
        Over ranges.
    points : tuple of Assignments
        Of it.
    """
    values = np.array([[value for _, value in point] for point in points], dtype=np.float64)
    found = np.empty_like(values)
    for place, held in enumerate(sweep.ranges):
        column = values[:, place]
        if held.scale == "log":
            found[:, place] = np.log(column / held.low) / math.log(held.high / held.low)
        else:
            found[:, place] = (column - held.low) / (held.high - held.low)
    return found


def batches_of(sweep: DesignSweep) -> tuple[tuple[int, ...], ...]:
    """Return the numbers of the points of each batch, `BATCH_POINTS` at most.

    A batch that a longer design has too has the same points there: hypercubes one by one, whole base points of
    Saltelli's design, and blocks of a grid whose size is the same whatever its length, so that values put at the end of
    a list leave the blocks before them as they are.

    Parameters
    ----------
    sweep : DesignSweep

    Examples
    --------
    >>> [len(batch) for batch in batches_of(DesignSweep(name="one", parameters=(("a.b", tuple(range(230))),)))]
    [100, 100, 30]
    """
    if sweep.sampling == "grid":
        return tuple(_blocks(tuple(len(values) for values in sweep.values)))
    size, rows = BATCH_POINTS, len(sweep.keys) + 2
    if sweep.sampling == "saltelli":
        size = rows << max(0, (BATCH_POINTS // rows).bit_length() - 1)
    n = sweep.n_points
    return tuple(tuple(range(first, min(n, first + size))) for first in range(0, n, size))


def _blocks(lengths: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """Numbers of the points of a grid in blocks: as many values along each of the last axes, one along the others."""
    cut = min(len(lengths), _MOST_CUT)
    side = math.floor(BATCH_POINTS ** (1.0 / cut) + 1e-9)
    sides = (1,) * (len(lengths) - cut) + (side,) * cut
    runs = [[range(at, min(n, at + step)) for at in range(0, n, step)] for n, step in zip(lengths, sides, strict=True)]
    for block in itertools.product(*runs):
        places = np.array(list(itertools.product(*block)))
        yield tuple(np.ravel_multi_index(tuple(places.T), lengths).tolist())
