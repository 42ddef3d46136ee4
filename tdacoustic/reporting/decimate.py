"""Fewer points for the same picture: traces keep their peaks, maps keep their maxima.

What is drawn is what counts: bins are uniform along the axis as it is drawn, so on a
logarithmic axis a low-frequency peak weighs as much as a high-frequency one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["block_max", "drawn", "envelope", "minmax_indices"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def drawn(values: FloatArray, log: bool) -> FloatArray:
    """Position along an axis: the value itself, or its decadic logarithm (NaN where it has none)."""
    if not log:
        return np.asarray(values, dtype=np.float64)
    positive = np.where(values > 0, values, np.nan)
    return np.log10(positive)


def _visible(x: FloatArray, log: bool, limits: tuple[float, float] | None) -> IntArray:
    """Indices with a place on the axis, within the limits and one neighbour beyond each."""
    position = drawn(x, log)
    has_place = np.isfinite(position)
    if limits is not None:
        inside = has_place & (x >= limits[0]) & (x <= limits[1])
        reach = inside.copy()
        reach[:-1] |= inside[1:]
        reach[1:] |= inside[:-1]
        has_place &= reach
    return np.flatnonzero(has_place).astype(np.int64)


def _bins(position: FloatArray, n_bins: int) -> IntArray:
    """Bin of each point: uniform in position where it rises, else uniform in number."""
    count = position.size
    if np.all(np.diff(position) >= 0) and position[-1] > position[0]:
        scaled = (position - position[0]) / (position[-1] - position[0]) * n_bins
        return np.minimum(scaled.astype(np.int64), n_bins - 1)
    return np.arange(count, dtype=np.int64) * n_bins // count


def minmax_indices(
    x: FloatArray, y: FloatArray, max_points: int, log: bool = False, limits: tuple[float, float] | None = None
) -> IntArray:
    """Indices of at most ``max_points`` points that draw the same trace.

    Each bin keeps its smallest and its largest value, in the order in which they come, and one
    gap (NaN) if it has any; the first and the last point are kept. So the global maximum and
    minimum survive exactly, and nothing is averaged.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        The trace; NaN in y is a gap.
    max_points : int
        At least 8.
    log : bool
        Whether x is drawn on a logarithmic axis; points at x <= 0 are left out then.
    limits : (float, float), optional
        What is shown of x; points outside are left out, but for one on each side.

    Returns
    -------
    ndarray of int, rising

    Raises
    ------
    ValueError
        ``max_points`` is less than 8.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.arange(1000.0); y = np.zeros(1000); y[517] = 1.0
    >>> kept = minmax_indices(x, y, 20)
    >>> len(kept) <= 20, 517 in kept
    (True, True)
    """
    if max_points < 8:
        raise ValueError(f"max_points must be at least 8, got {max_points}")
    visible = _visible(x, log, limits)
    if visible.size <= max_points:
        return visible
    values = y[visible]
    gaps = np.isnan(values)
    bins = _bins(drawn(x[visible], log), (max_points - 2) // (3 if gaps.any() else 2))
    chosen = [np.array([0, visible.size - 1], dtype=np.int64)]
    finite = np.flatnonzero(~gaps)
    if finite.size:
        order = finite[np.lexsort((values[finite], bins[finite]))]
        edge = np.flatnonzero(np.diff(bins[order])) + 1
        chosen += [order[np.r_[0, edge]], order[np.r_[edge, order.size] - 1]]
    if gaps.any():
        gap = np.flatnonzero(gaps)
        chosen.append(gap[np.r_[True, np.diff(bins[gap]) > 0]])
    return np.asarray(visible[np.unique(np.concatenate(chosen))], dtype=np.int64)


def envelope(
    x: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    max_points: int,
    log: bool = False,
    limits: tuple[float, float] | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Reduce the region between two traces to at most ``max_points`` columns that still contain it.

    Returns
    -------
    x, lower, upper : ndarray
        Each bin has its first x, its smallest lower and its largest upper edge; a bin with a gap is a gap.
    """
    visible = _visible(x, log, limits)
    if visible.size <= max_points:
        return x[visible], lower[visible], upper[visible]
    bins = _bins(drawn(x[visible], log), max_points)
    start = np.flatnonzero(np.r_[True, np.diff(bins) != 0])
    return (
        x[visible][start],
        np.minimum.reduceat(lower[visible], start),
        np.maximum.reduceat(upper[visible], start),
    )


def _blocks(centres: FloatArray, max_count: int, log: bool) -> tuple[IntArray, FloatArray]:
    """First index and centre of each block of cells along one axis."""
    if centres.size <= max_count:
        return np.arange(centres.size, dtype=np.int64), centres
    position = drawn(centres, log)
    bins = _bins(position, max_count)
    start = np.flatnonzero(np.r_[True, np.diff(bins) != 0]).astype(np.int64)
    last = np.r_[start[1:], centres.size] - 1
    middle = (position[start] + position[last]) / 2
    return start, 10.0**middle if log else middle


def block_max(
    x: FloatArray,
    y: FloatArray,
    z: FloatArray,
    max_columns: int,
    max_rows: int,
    log_x: bool = False,
    log_y: bool = False,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Reduce a map to at most ``max_rows`` by ``max_columns`` cells, each the maximum of those it replaces.

    Parameters
    ----------
    x, y : ndarray, shape (n,) and (m,)
        Centres of the cells, rising.
    z : ndarray, shape (m, n)
        A cell that is NaN does not count unless its whole block is NaN.
    max_columns, max_rows : int
        At least 1.
    log_x, log_y : bool
        Whether the axes are logarithmic; cells at x <= 0 or y <= 0 are left out then.

    Returns
    -------
    x, y, z : ndarray
        Centres of the blocks as drawn, and their maxima.

    Examples
    --------
    >>> import numpy as np
    >>> z = np.zeros((4, 6)); z[3, 5] = 7.0
    >>> block_max(np.arange(6.0), np.arange(4.0), z, 3, 2)[2].tolist()
    [[0.0, 0.0, 0.0], [0.0, 0.0, 7.0]]
    """
    columns, rows = _visible(x, log_x, None), _visible(y, log_y, None)
    x, y, z = x[columns], y[rows], z[np.ix_(rows, columns)]
    start_x, centre_x = _blocks(x, max_columns, log_x)
    start_y, centre_y = _blocks(y, max_rows, log_y)
    if start_x.size < x.size:
        z = np.fmax.reduceat(z, start_x, axis=1)
    if start_y.size < y.size:
        z = np.fmax.reduceat(z, start_y, axis=0)
    return centre_x, centre_y, z
