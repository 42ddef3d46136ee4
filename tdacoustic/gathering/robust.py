"""What stands out from a group: median, median absolute deviation, and a threshold that knows how few there are."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

__all__ = ["FALSE_ALARM", "FEWEST", "NORMAL", "Spread", "spread_of", "threshold"]

FEWEST: Final = 5
"""Values of a group below which none is said to stand out."""

NORMAL: Final = 1.4826
"""Standard deviation of normally scattered values over their median absolute deviation."""

FALSE_ALARM: Final = 0.01
"""Part of groups of normally scattered values in which one of them would stand out by chance."""

_THRESHOLDS: Final = (
    *((5, 18.8), (6, 10.8), (8, 8.3), (10, 7.1), (12, 6.4), (14, 6.0), (16, 5.7), (18, 5.4), (20, 5.3), (25, 5.1)),
    *((30, 4.8), (40, 4.6), (60, 4.5), (100, 4.4), (500, 4.5), (1000, 4.8), (5000, 5.0)),
)
"""From how many values on, which distance from the median counts, in scatters.

The 99 % quantile of the largest such distance in a group of normal values, by simulation (a test repeats it). The usual
3.5 (Iglewicz and Hoaglin 1993) would find one in every fifth group of five, and in every tenth of a hundred.
"""


@dataclass(frozen=True)
class Spread:
    """Middle and scatter of a group.

    Parameters
    ----------
    n : int
    median : float
    mad : float
        Median absolute deviation from the median.
    scatter : float
        1.4826 times that, or a floor where that is larger.
    """

    n: int
    median: float
    mad: float
    scatter: float

    def distance(self, value: float) -> float:
        """Return how far a value is from the median, in scatters; with its sign."""
        return (value - self.median) / self.scatter if self.scatter > 0.0 else 0.0

    def stands_out(self, value: float) -> bool:
        """Whether a value is farther from the median than chance allows; never in a group of fewer than five."""
        return self.n >= FEWEST and abs(self.distance(value)) > threshold(self.n)


def spread_of(values: Sequence[float], floor: float) -> Spread:
    """Return middle and scatter of a group.

    Parameters
    ----------
    values : sequence of float
        At least one.
    floor : float
        Smallest scatter, in the values' unit.

    Examples
    --------
    >>> spread = spread_of([80.0, 81.0, 81.0, 82.0, 95.0], 0.3)
    >>> spread.median, spread.mad, round(spread.distance(95.0), 2)
    (81.0, 1.0, 9.44)
    """
    median = statistics.median(values)
    mad = statistics.median(abs(value - median) for value in values)
    return Spread(len(values), median, mad, max(NORMAL * mad, floor))


def threshold(n: int) -> float:
    """Return the distance from the median, in scatters, from which one of n values stands out.

    Examples
    --------
    >>> threshold(5), threshold(20), threshold(300)
    (18.8, 5.3, 4.4)
    """
    return max(((least, value) for least, value in _THRESHOLDS if n >= least), default=(0, float("inf")))[1]
