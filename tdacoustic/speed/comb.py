"""How well the lines of spectra fit the orders of a shaft: the likelihood of a comb."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tdacoustic.errors import AnalysisError

__all__ = ["Comb", "CombOrder", "distinct_orders", "line_evidence"]

Array = NDArray[np.float64]
Grid = NDArray[np.float32]

LINE_OVER_FLOOR: Final = 10.0
"""Mean power of a line over that of the floor in its bin that is expected of a line [assumed: 10 dB]."""
MOST_NATS: Final = 4.0
"""Evidence of one order in one frame at most, however strong: a tone that is none of the orders counts no more."""
FIXED_NATS: Final = 0.5
"""The same where a line stands all the time at one frequency [assumed]: a resonance, the mains, or a constant speed."""
FIXED_ABOVE: Final = 3.0
"""Median over time of power over floor from which a frequency counts as always lit; 0.69 is that of floor alone."""
STEADY_PART: Final = 0.35
"""Tenth percentile over the median from which it is a tone's; 0.15 is that of noise, however much a resonance lifts
it."""


COINCIDE: Final = 0.003
"""Relative distance of two orders that draw one line [assumed: the width of a bin]."""


@dataclass(frozen=True)
class CombOrder:
    """An order that is expected of a shaft.

    Parameters
    ----------
    name : str
        As ``"mesh x2"``.
    order : float
        Per turn of the shaft whose speed is sought.
    presence : float
        Probability that it stands out of the floor at one instant.
    reach : float
        Relative half width within which it may lie (a line of the supply: the rotor's slip); 0 of one that is exact.
    """

    name: str
    order: float
    presence: float = 0.5
    reach: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.order) and self.order > 0.0):
            raise AnalysisError(f"order {self.name!r} must be > 0, got {self.order}")
        if not 0.0 < self.presence < 1.0:
            raise AnalysisError(f"presence of order {self.name!r} must be between 0 and 1, got {self.presence}")
        if not 0.0 <= self.reach < 0.5:
            raise AnalysisError(f"reach of order {self.name!r} must be between 0 and 0.5, got {self.reach}")


def distinct_orders(orders: Sequence[CombOrder]) -> tuple[CombOrder, ...]:
    """Return orders of which no two draw one line; those that coincide within 0.3 % become one, named after both.

    Two meshes of a drive may share a harmonic; counted twice it would make half the speed look like the speed.

    Examples
    --------
    >>> both = distinct_orders([CombOrder("a x3", 60.0), CombOrder("b x2", 60.0), CombOrder("a x4", 80.0)])
    >>> [item.name for item in both]
    ['a x3, b x2', 'a x4']
    """
    kept: list[CombOrder] = []
    for item in sorted(orders, key=lambda order: order.order):
        last = kept[-1] if kept else None
        if last is None or item.reach or last.reach or item.order > last.order * (1.0 + COINCIDE):
            kept.append(item)
            continue
        presence = 1.0 - (1.0 - last.presence) * (1.0 - item.presence)
        kept[-1] = CombOrder(f"{last.name}, {item.name}", last.order, presence)
    return tuple(kept)


def line_evidence(over_floor: Grid, presence: float, fixed: NDArray[np.bool_] | None = None) -> Grid:
    """Return the logarithmic likelihood ratio of a line that is there with a probability, over floor alone, per bin.

    Of floor alone the power over its mean is exponentially distributed, with a line its mean is larger by
    `LINE_OVER_FLOOR`. The result never falls below ln(1 - presence) and never exceeds `MOST_NATS`.

    Parameters
    ----------
    over_floor : ndarray, shape (..., n_bins)
        Power over the floor's mean.
    presence : float
    fixed : ndarray of bool, shape (n_bins,), optional
        Bins that are always lit.
    """
    gain = LINE_OVER_FLOOR / (1.0 + LINE_OVER_FLOOR)
    exponent = np.minimum(gain * over_floor, 30.0) - math.log1p(LINE_OVER_FLOOR)
    nats = np.minimum(np.log((1.0 - presence) + presence * np.exp(exponent)), MOST_NATS)
    if fixed is not None:
        nats = np.where(fixed, np.minimum(nats, FIXED_NATS), nats)
    return np.asarray(nats, dtype=np.float32)


class Comb:
    """The evidence of lines at the orders of a shaft, in the spectra of several channels.

    An order looks at the bins that it may lie in between two neighbouring speeds; the chance that one of several is lit
    is allowed for. An order outside of the band says nothing.

    Parameters
    ----------
    over_floor : sequence of ndarray, shape (n_frames, n_bins)
        Power over floor of each channel.
    bin_hz : float
    low_hz, top_hz : float
        Band within which orders are heard.
    step_hz : float
        Distance of the speeds that are tried.
    tones_count : bool
        Whether lines that always stand at one frequency count like others: those of a constant speed do.
    """

    def __init__(
        self,
        over_floor: Sequence[Grid],
        bin_hz: float,
        low_hz: float,
        top_hz: float,
        step_hz: float,
        tones_count: bool = False,
    ) -> None:
        self._bin_hz, self._low_hz, self._top_hz, self._step_hz = bin_hz, low_hz, top_hz, step_hz
        self._levelled, self._fixed = zip(*(_without_resonances(power) for power in over_floor), strict=True)
        if tones_count:
            self._fixed = tuple(np.zeros(tone.size, dtype=np.bool_) for tone in self._fixed)
        self._widened: dict[tuple[int, float], Grid] = {}
        self.n_frames = over_floor[0].shape[0]

    def scores(self, orders: Sequence[CombOrder], speeds_hz: Array) -> Grid:
        """Return ln of the likelihood of a comb at each speed, over floor alone, shape (n_frames, n_speeds)."""
        total = np.zeros((self.n_frames, speeds_hz.size), dtype=np.float32)
        for item in orders:
            inside, place, lines = self._look(item, item.order * speeds_hz, item.presence)
            if inside.any():
                total[:, inside] += lines[:, place[inside]]
        return total

    def along(self, orders: Sequence[CombOrder], path_hz: Array, presence: float) -> Grid:
        """Return the logarithmic likelihood ratio of each order along a path, shape (n_orders, n_frames).

        Parameters
        ----------
        orders : sequence of CombOrder
        path_hz : ndarray, shape (n_frames,)
        presence : float
            Probability that an order of the machine stands out at one instant.
        """
        found = np.zeros((len(orders), self.n_frames), dtype=np.float32)
        rows = np.arange(self.n_frames)
        for index, item in enumerate(orders):
            inside, place, lines = self._look(item, item.order * path_hz, presence)
            if inside.any():
                found[index, inside] = lines[rows[inside], place[inside]]
        return found

    def _look(
        self, item: CombOrder, frequency: Array, presence: float
    ) -> tuple[NDArray[np.bool_], NDArray[np.intp], Grid]:
        inside = (frequency >= self._low_hz) & (frequency <= self._top_hz)
        middle = float(np.mean(frequency[inside])) if inside.any() else 0.0
        reach = 0.5 * item.order * self._step_hz + item.reach * middle
        key = (max(1, math.ceil(reach / self._bin_hz - 0.5)), presence)
        if key not in self._widened:
            self._widened[key] = _evidence_of_channels(self._levelled, self._fixed, *key)
        lines = self._widened[key]
        return inside, np.clip(np.rint(frequency / self._bin_hz), 0, lines.shape[1] - 1).astype(np.intp), lines


def _without_resonances(power: Grid) -> tuple[Grid, NDArray[np.bool_]]:
    """Power over what is usual at its frequency where a resonance lifts the floor, and where a tone always stands."""
    tenth, usual = np.percentile(power, [10.0, 50.0], axis=0)
    tone = (usual > FIXED_ABOVE) & (tenth > STEADY_PART * usual)
    lift = np.where(tone, 1.0, np.maximum(usual / math.log(2.0), 1.0))
    return np.asarray(power / lift.astype(np.float32)), tone


def _evidence_of_channels(
    over_floor: Sequence[Grid], fixed: Sequence[NDArray[np.bool_]], half: int, presence: float
) -> Grid:
    """Sum over channels, within the limits of one and a half of them."""
    total = np.zeros(over_floor[0].shape, dtype=np.float32)
    width = 2 * half + 1
    for power, lit in zip(over_floor, fixed, strict=True):
        # The largest of n exponential values exceeds x about as often as one exceeds x - ln n.
        widest = np.maximum(ndimage.maximum_filter1d(power, width, axis=1) - np.float32(math.log(width)), 0.0)
        total += line_evidence(widest, presence, ndimage.maximum_filter1d(lit, width))
    more = 1.5 if len(over_floor) > 1 else 1.0
    return np.clip(total, np.float32(more * math.log1p(-presence)), np.float32(more * MOST_NATS))
