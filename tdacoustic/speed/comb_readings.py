"""Which lines are which orders: the readings of one set of lines at other speeds, and how likely each is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.speed.comb import Comb, CombOrder
from tdacoustic.speed.comb_path import TEMPER

__all__ = ["Reading", "best_reading"]

Array = NDArray[np.float64]

WITHIN: Final = 0.6
"""Probability that an order of the machine stands out at one instant [assumed]."""
STRANGE: Final = 0.03
"""Probability that a line of something else runs where an order is looked for [assumed]: no single line says more than
ln(1/0.03) = 3.5 of which reading is right."""
RULED_OUT: Final = -1e3
"""Logarithmic prior below which a reading is none."""
SAME: Final = 0.03
"""Ratios that differ by less count as one reading."""
SHARES: Final = (1 / 3, 1 / 2, 2 / 3, 3 / 4, 4 / 3, 3 / 2, 2.0, 3.0)
"""Ratios that every comb may be misread by."""


@dataclass(frozen=True)
class Reading:
    """A path, the likelihood of its orders, and that of the next best reading.

    Parameters
    ----------
    speeds_hz : ndarray, shape (n_frames,)
    probability : float
        Of this reading among all that share a line with it.
    log_evidence : float
        ln of its likelihood over floor alone.
    rival_ratio, rival_probability : float
        The next likely one: its speed over this one's. NaN and 0 without one.
    heard : tuple of (str, float)
        Each order, and the part of its evidence: the probability that the machine has it.
    """

    speeds_hz: Array
    probability: float
    log_evidence: float
    rival_ratio: float
    rival_probability: float
    heard: tuple[tuple[str, float], ...]


def best_reading(
    comb: Comb,
    orders: Sequence[CombOrder],
    path_hz: Array,
    prior: Callable[[Array], float],
    range_hz: tuple[float, float],
) -> Reading:
    """Return the likeliest reading of the lines along a path.

    Where order a was taken for order b, the speed is wrong by a/b. Each such ratio is tried. An order either belongs to
    the machine and mostly stands out over the whole run, or does not and never does: the likelihood of a reading is the
    product over its orders of (1 - presence) + presence x likelihood of the whole run, where a line that is there may
    also be something else's.

    Parameters
    ----------
    comb : Comb
    orders : sequence of CombOrder
    path_hz : ndarray, shape (n_frames,)
    prior : callable
        Logarithmic prior of a path, shape (n_frames,) to float.
    range_hz : (float, float)
        Within which speeds may lie.
    """
    presence = np.array([item.presence for item in orders])
    found: list[tuple[float, float, float, Array]] = []
    for ratio in _ratios(orders):
        path = path_hz * ratio
        if np.mean((path >= range_hz[0]) & (path <= range_hz[1])) < 0.95:
            continue
        nats = TEMPER * comb.along(orders, path, WITHIN).sum(axis=1, dtype=np.float64)
        each = np.logaddexp(np.log1p(-presence), np.log(presence) + nats)
        belongs = np.exp(np.log(presence) + nats - each)
        known = prior(path)
        if known < RULED_OUT:
            continue
        strange = np.logaddexp(np.log1p(-STRANGE), np.log(STRANGE) + nats)
        shared = np.log1p(-presence + presence * np.exp(nats - strange))
        found.append((float(shared.sum()) + known, ratio, float(each.sum()) + known, belongs))
    if not found:
        return Reading(path_hz, 0.0, -np.inf, float("nan"), 0.0, tuple((item.name, 0.0) for item in orders))
    found.sort(key=lambda item: -item[0])
    top = found[0][0]
    weights = np.exp(np.array([item[0] for item in found]) - top)
    shares = weights / weights.sum()
    _, ratio, evidence, belongs = found[0]
    rival = (found[1][1] / ratio, float(shares[1])) if len(found) > 1 else (float("nan"), 0.0)
    heard = tuple((item.name, float(value)) for item, value in zip(orders, belongs, strict=True))
    return Reading(path_hz * ratio, float(shares[0]), evidence, *rival, heard)


def _ratios(orders: Sequence[CombOrder]) -> list[float]:
    """1, and every ratio by which one order may be taken for another, no two of them alike."""
    values = np.array([item.order for item in orders])
    every = np.concatenate((np.asarray(SHARES), (values[:, None] / values[None, :]).ravel()))
    kept = [1.0]
    for ratio in np.sort(every[(every > 0.05) & (every < 20.0)]):
        if min(abs(np.log(ratio / other)) for other in kept) > SAME:
            kept.append(float(ratio))
    return kept
