"""Bands of the train's speed with no usual test speed on an edge."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

__all__ = ["SpeedBand", "band_at", "band_width"]

WIDTHS: Final = (10.0, 20.0, 40.0, 100.0)
"""Widths of bands for tables and figures, in km/h."""


@dataclass(frozen=True, order=True)
class SpeedBand:
    """A band of the train's speed, its lower end in it; in km/h."""

    low: float
    high: float

    @property
    def words(self) -> str:
        """``25–35``."""
        return f"{self.low:g}–{self.high:g}"

    @property
    def middle(self) -> float:
        """Its middle."""
        return 0.5 * (self.low + self.high)


def band_at(speed_km_h: float, width_km_h: float) -> SpeedBand:
    """Return the band that a speed is in, whichever way the train runs.

    Edges lie at 5 km/h and whole widths beyond, those of bands of 5 km/h at 2.5 km/h and beyond: conditions at whole
    tens (or fives) are in the middle of their bands, and a train that runs at 39.8 instead of 40 stays in its own.

    Examples
    --------
    >>> band_at(39.8, 10.0).words, band_at(39.8, 5.0).words, band_at(2.0, 20.0).words
    ('35–45', '37.5–42.5', '0–5')
    """
    first = min(5.0, 0.5 * width_km_h)
    low = first + width_km_h * math.floor((abs(speed_km_h) - first) / width_km_h)
    return SpeedBand(max(low, 0.0), low + width_km_h)


def band_width(speeds_km_h: Iterable[float], most: int) -> float:
    """Return the smallest width with which the speeds fill no more than so many bands.

    Parameters
    ----------
    speeds_km_h : iterable of float
    most : int
    """
    held = set(speeds_km_h)
    for width in WIDTHS:
        if len({band_at(speed, width) for speed in held}) <= most:
            return width
    return WIDTHS[-1]
