"""Orders with names, and lines that follow the speed in another way than an order does."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import AnalysisError

__all__ = ["FrequencyCurve", "NamedOrder", "OrderKind"]

Array = NDArray[np.float64]

OrderKind = Literal["mesh", "motor", "inverter", "wheelset", "asked", "found"]
"""Whose order it is; ``asked`` by the campaign alone, ``found`` in the map and named by nobody."""


@dataclass(frozen=True)
class NamedOrder:
    """An order of a drive.

    Parameters
    ----------
    name : str
        ``"mesh x1"``, ``"wheelset x2"``, ``"order 17.4"``.
    kind : str
        One of `OrderKind`.
    order : float
        Per turn of the reference shaft.
    shaft : str
        Over whose angle it is cut: the reference shaft, or one that turns with it.
    ratio : float
        Turns of that shaft for one of the reference shaft.

    Raises
    ------
    AnalysisError
        An order or a ratio that is not above zero.

    Examples
    --------
    >>> NamedOrder("wheelset x2", "wheelset", 0.6, "wheelset", 0.3).of_shaft
    2.0
    """

    name: str
    kind: OrderKind
    order: float
    shaft: str
    ratio: float = 1.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.order) and self.order > 0.0):
            raise AnalysisError(f"order must be > 0, got {self.order} ({self.name})")
        if not (math.isfinite(self.ratio) and self.ratio > 0.0):
            raise AnalysisError(f"the ratio of a shaft must be > 0, got {self.ratio} ({self.name})")

    @property
    def of_shaft(self) -> float:
        """Order per turn of its own shaft."""
        return self.order / self.ratio


@dataclass(frozen=True)
class FrequencyCurve:
    """A line whose frequency is a function of the speed, but not proportional to it: an inverter's carrier, say.

    Parameters
    ----------
    name : str
    kind : str
        One of `OrderKind`.
    speeds_hz : ndarray, shape (n,)
        Of the reference shaft, rising.
    frequencies_hz : ndarray, shape (n,)
        NaN where there is no such line.
    """

    name: str
    kind: OrderKind
    speeds_hz: Array
    frequencies_hz: Array

    def frequency_hz_at(self, speeds_hz: ArrayLike) -> Array:
        """Return its frequency at speeds, any shape; NaN outside of its own, and where there is none."""
        speeds = np.asarray(speeds_hz, dtype=np.float64)
        return np.interp(speeds, self.speeds_hz, self.frequencies_hz, left=np.nan, right=np.nan)
