"""What is fixed in Hz and what follows the speed: resonances told from orders over a run-up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.orders.fixed_lines import FixedLine, find_fixed_lines
from tdacoustic.orders.order_cut import OrderCut
from tdacoustic.orders.order_map import OrderMap

__all__ = ["FixedFrequency", "find_fixed_frequencies"]

Array = NDArray[np.float64]

STEPS_PER_OCTAVE: Final = 96
"""Of the logarithmic axis over which orders are laid on top of each other."""
SMOOTHING: Final = 3
"""Steps of the median over the axis."""
BASELINE_OCTAVES: Final = 1.0
"""Width of the running median that a resonance has to rise above."""
RISE_DB: Final = 3.0
"""Of the mean over the orders above the baseline, at least (assumed)."""
RAISED_DB: Final = 2.0
"""By which an order counts as raised there."""
FEWEST_ORDERS: Final = 2
CHANCE: Final = 0.25
"""Chance of one order being raised where nothing is (assumed: peaks cover about a quarter of a track)."""
SAME_WITHIN: Final = 0.02
"""A line this near to a resonance, relative, is taken for scatter that passes through it, unless it is steady."""


@dataclass(frozen=True)
class FixedFrequency:
    """Something that stays at its frequency while the speed changes.

    Parameters
    ----------
    kind : {"resonance", "line"}
        A resonance raises what passes through it; a line is there at each speed by itself (supply, carrier, hum).
    frequency_hz : float
    loss_factor : float
        Half-power width over frequency, of a resonance whose shape could be fitted; NaN with a reason in `evidence`.
        The width of the cuts and the sweep broaden it: an upper bound.
    rise_db : float
        Above the baseline: mean over the orders, or over the rows of a line.
    orders_raised, orders_crossing : int
        Of a resonance. For a line: rows in which it stands out, and all rows.
    confidence : float
        0 to 1: 1 less the probability that as many orders are raised by chance (of a line: part of the rows).
    evidence : str
        In words.
    """

    kind: Literal["resonance", "line"]
    frequency_hz: float
    loss_factor: float
    rise_db: float
    orders_raised: int
    orders_crossing: int
    confidence: float
    evidence: str


def find_fixed_frequencies(
    cuts: Sequence[OrderCut], frequency_map: OrderMap, channel: int = 0
) -> tuple[FixedFrequency, ...]:
    """Return what is fixed in Hz, by frequency: resonances from orders that pass through, lines from the map.

    Each order's level is laid over its frequency, order times speed, and its own median taken off. What all orders
    share at one frequency is a resonance; what one order has alone is its own. A peak of their mean that rises 3 dB
    over the running median of an octave counts where at least two orders cross it and most of them are raised by 2 dB
    or more over what they are beside it. A line counts where it stands 6 dB above the lines beside it in four of five
    rows, is as narrow as the window makes it, and no order that was cut explains it. An order that meets a steady line
    is raised by it as by a resonance: its level there counts only where it is far stronger than the line, and is taken
    as straight elsewhere, so that of a resonance that a line stands in only the flanks may be left.

    Parameters
    ----------
    cuts : sequence of OrderCut
        Of all strong orders over fine classes of speed.
    frequency_map : OrderMap
        Domain ``frequency``, over classes of speed.
    channel : int

    Raises
    ------
    AnalysisError
        A map of another domain, or fewer than two orders.
    """
    if frequency_map.domain != "frequency":
        raise AnalysisError(f"fixed frequencies are looked for in a map over frequency, got {frequency_map.domain!r}")
    chosen = [cut for cut in cuts if cut.channel == channel]
    if len(chosen) < FEWEST_ORDERS:
        raise AnalysisError(f"channel {channel}: {len(chosen)} orders are too few to tell resonances from orders")
    lines = find_fixed_lines(frequency_map, channel, chosen)
    found = _resonances(chosen, [line for line in lines if line.steady])
    resonances = tuple(found)
    for line in lines:  # scatter that a narrow resonance raises is none
        near = any(abs(line.frequency_hz / item.frequency_hz - 1.0) < SAME_WITHIN for item in resonances)
        if line.steady or not near:
            found.append(_line(line))
    return tuple(sorted(found, key=lambda item: item.frequency_hz))


def _tracks(cuts: Sequence[OrderCut], lines: Sequence[FixedLine]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Frequencies; level of each order over them in dB, NaN where it is not; and where a line hides any of them.

    A level that a line hides is straight between those beside it.
    """
    tracks = []
    for cut in cuts:
        place = np.argsort(cut.speeds_hz)
        frequency = cut.order * cut.speeds_hz[place]
        hidden = np.zeros(place.size, dtype=bool)
        for line in lines:
            hidden |= line.hides(cut)[place]
        usable = (cut.stands_out & (cut.mean_square > 0.0))[place] & ~hidden
        if usable.sum() >= 5:
            level = 10.0 * np.log10(cut.line_mean_square[place][usable])
            tracks.append((frequency[usable], level, frequency, hidden.astype(np.float64)))
    if len(tracks) < FEWEST_ORDERS:
        return np.zeros(0), np.zeros((0, 0)), np.zeros(0, dtype=bool)
    lowest, highest = min(track[0][0] for track in tracks), max(track[0][-1] for track in tracks)
    count = max(2, round(STEPS_PER_OCTAVE * math.log2(highest / lowest)))
    axis = np.geomspace(lowest, highest, count + 1)
    levels = np.array([np.interp(axis, *track[:2], left=np.nan, right=np.nan) for track in tracks])
    return axis, levels, np.any([np.interp(axis, *track[2:]) > 0.0 for track in tracks], axis=0)


def _shared(levels: Array) -> Array:
    """Part that depends on the frequency alone: orders' offsets and shared course by alternating means, NaN apart."""
    known = np.isfinite(levels)
    offsets = np.nanmedian(levels, axis=1)
    course = np.zeros(levels.shape[1])
    for _ in range(50):
        course = np.sum(np.where(known, levels - offsets[:, None], 0.0), axis=0) / np.maximum(known.sum(axis=0), 1)
        offsets = np.sum(np.where(known, levels - course, 0.0), axis=1) / np.maximum(known.sum(axis=1), 1)
    return levels - offsets[:, None]


def _resonances(cuts: Sequence[OrderCut], lines: Sequence[FixedLine]) -> list[FixedFrequency]:
    from scipy import ndimage, signal

    axis, levels, hidden = _tracks(cuts, lines)
    if not axis.size:
        return []
    apart = _shared(levels)
    crossing = np.isfinite(apart).sum(axis=0)
    with np.errstate(invalid="ignore"):
        course = np.where(crossing >= FEWEST_ORDERS, np.nansum(apart, axis=0) / np.maximum(crossing, 1), np.nan)
    known = np.flatnonzero(np.isfinite(course))
    if known.size < 8:
        return []
    filled = np.interp(np.arange(course.size), known, course[known])
    filled = ndimage.median_filter(filled, size=SMOOTHING, mode="nearest")
    baseline = ndimage.percentile_filter(
        filled, 40.0, size=round(2.0 * BASELINE_OCTAVES * STEPS_PER_OCTAVE) | 1, mode="nearest"
    )
    rise = filled - baseline
    peaks, details = signal.find_peaks(rise, height=RISE_DB, prominence=RISE_DB, width=1, rel_height=0.5)
    found = []
    for index, peak in enumerate(peaks):
        if not np.isfinite(course[peak]):
            continue
        left, right = int(details["left_ips"][index]), math.ceil(details["right_ips"][index])
        item = _resonance(axis, apart - baseline, rise, int(peak), max(left, 0), min(right, axis.size - 1))
        if item is not None and hidden[max(left, 0) : right + 1].any():
            item = replace(item, evidence=f"{item.evidence}; a steady line hides some of them in part")
        if item is not None:
            found.append(item)
    return found


def _resonance(axis: Array, apart: Array, rise: Array, peak: int, left: int, right: int) -> FixedFrequency | None:
    from scipy import stats

    reach = max(4, right - left)
    before, after = slice(max(0, left - reach), left), slice(right + 1, right + 1 + reach)
    passing = np.isfinite(apart[:, peak]) & _holds(apart[:, before]) & _holds(apart[:, after])
    if not passing.any():
        return None
    tracks = apart[passing]  # each order beside itself: what it does over the speed does not count
    beside = np.maximum(np.nanmean(tracks[:, before], axis=1), np.nanmean(tracks[:, after], axis=1))
    top = np.nanmax(tracks[:, left : right + 1], axis=1) - beside
    raised, count = int(np.sum(top >= RAISED_DB)), int(passing.sum())
    if count < FEWEST_ORDERS or raised < max(FEWEST_ORDERS, math.ceil(0.5 * count)):
        return None
    chance = float(stats.binom.sf(raised - 1, count, CHANCE))
    frequency, loss, doubt = _fitted(axis, rise, peak, left, right)
    text = f"{raised} of {count} orders that pass {frequency:.4g} Hz are raised by {RAISED_DB:g} dB or more"
    return FixedFrequency(
        "resonance",
        frequency,
        loss,
        float(rise[peak]),
        raised,
        count,
        1.0 - chance,
        text + (f"; {doubt}" if doubt else ""),
    )


def _holds(values: Array) -> NDArray[np.bool_]:
    """Whether half the values of each row are numbers."""
    if not values.shape[1]:
        return np.zeros(values.shape[0], dtype=bool)
    return np.asarray(np.isfinite(values).mean(axis=1) >= 0.5)


def _fitted(axis: Array, rise: Array, peak: int, left: int, right: int) -> tuple[float, float, str]:
    """Frequency and loss factor of one resonance on a level floor, by least squares of the level."""
    from scipy import optimize

    reach = max(4, right - left)
    span = slice(max(0, peak - reach), min(axis.size, peak + reach + 1))
    x, y = axis[span], rise[span]
    width = max(axis[right] - axis[left], axis[peak] * 0.01)

    def model(point: Array) -> Array:
        ratio = x / (axis[peak] * math.exp(point[0]))
        gain = 1.0 / ((1.0 - ratio**2) ** 2 + math.exp(2.0 * point[1]) * ratio**2)
        return np.asarray(10.0 * np.log10(math.exp(point[2]) * gain + math.exp(point[3])))

    start = np.array([0.0, math.log(width / axis[peak]), math.log(10.0 ** (0.1 * rise[peak])), 0.0])
    start[2] += 2.0 * start[1]
    result = optimize.least_squares(lambda point: model(point) - y, start, loss="soft_l1", f_scale=1.0)
    frequency, loss = axis[peak] * math.exp(result.x[0]), math.exp(result.x[1])
    rms = float(np.sqrt(np.mean((model(result.x) - y) ** 2)))
    if not (x[0] <= frequency <= x[-1]) or loss > 0.5 or rms > 2.0:
        return float(axis[peak]), math.nan, "its shape is not that of one resonance: no loss factor"
    return float(frequency), float(loss), ""


def _line(line: FixedLine) -> FixedFrequency:
    words = (
        f"a line at {line.frequency_hz:.4g} Hz stands out in {line.rows_out} of {line.rows} classes of speed; "
        "a line has no loss factor"
    )
    confidence = line.rows_out / line.rows
    return FixedFrequency(
        "line", line.frequency_hz, math.nan, line.rise_db, line.rows_out, line.rows, confidence, words
    )
