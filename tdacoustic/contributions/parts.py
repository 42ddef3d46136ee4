"""The parts of a receiver's power in one span and state: groups, what they share, and the residual."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import stats

__all__ = ["RESIDUAL", "GroupPart", "Readings", "SpanContributions", "Verdict", "group_part", "leading"]

Array = NDArray[np.float64]
Verdict = Literal["ok", "flagged", "refused", "below"]

RESIDUAL: Final = "residual"
"""Name of what no group explains."""
WITHIN: Final = float(np.log(10.0) * 0.3)
"""3 dB, as a logarithm of power."""
CERTAIN: Final = 3.0
"""Standard deviations of what cross-talk leaves open that have to lie within it."""
OWN: Final = 0.05
"""Part of a group's references that is its own, at least: noise of a sensor 20 dB below its signal [assumed] is a fifth
of that."""
LEAK: Final = 0.1
"""Part of the references' power that is a source without a reference [assumed]."""
NOISE: Final = 0.25
"""Noise of the references over a source's sound, at most: 1 dB."""
BELOW: Final = "not above its own scatter"
NOTHING: Final = 1e-3
"""A reading below this part leaves no lower bound: 30 dB [assumed]."""


@dataclass(frozen=True)
class Readings:
    """What a contribution could be, given what cross-talk can do.

    Parameters
    ----------
    alone, on_top : float
        What the group explains first and last in order, in all states together, over its contribution.
    alone_part : float
        What the group explains first in order, over what all explain.
    crossed : float
        What it shares with others, over it.
    leaked : float
        What others' leaks would make of it in this state, over it.
    source : float
        The source's own power in this state, from the states together, unit².
    source_scatter : float
        Standard deviation of its logarithm.
    own_share, share_elsewhere : float
        The source's part of its own references' power, and the largest of another group's; as far as it is told.
    noise : float
        What noise of the references is worth in the source's sound, over it.
    rival : str
        Group with which it shares the most; empty where there is no other.
    """

    alone: float
    on_top: float
    alone_part: float
    crossed: float
    leaked: float
    source: float
    source_scatter: float
    own_share: float
    share_elsewhere: float
    noise: float
    rival: str


@dataclass(frozen=True)
class GroupPart:
    """A group's contribution.

    Parameters
    ----------
    mean_square : float or None
        unit²: the source's own where it is ``ok``, else that of its references; None where it is refused.
    path_mean_square : float
        What plain OTPA says, the power of ``T_g x_g``: cross-talk in the references is part of it.
    low, high : float
        Scatter of the segments and cross-talk together, unit²; the lower one is 0 where there is none. The upper one of
        a known part reaches to where parts and residual add up to the whole. Of a flagged one it is the range of its
        one-way readings, which is no confidence interval: cross-talk may go both ways.
    lowest, highest : float
        What cross-talk alone leaves open, over the value.
    verdict : str
        ``ok``: cross-talk leaves less than 3 dB open; ``flagged``: more, or nothing tells; ``refused``: next to nothing
        is its own; ``below``: not above its own scatter, `high` is all that is known.
    reason : str
        In words; empty where it is ``ok``.
    """

    mean_square: float | None
    path_mean_square: float
    low: float
    high: float
    lowest: float
    highest: float
    verdict: Verdict
    reason: str


@dataclass(frozen=True)
class SpanContributions:
    """What makes up a receiver's power in one span and state.

    ``total = sum of path_mean_square + shared + residual``, the residual being the power of the receiver less its
    prediction.

    Parameters
    ----------
    state, receiver, span : str
    band_hz : (float, float)
    total, total_low, total_high : float
        unit².
    groups : mapping of str to GroupPart
    shared : float
        What the contributions of different groups' references have in common, below 0 where they cancel; and, as the
        paths are those of all states, what the residual of this one has in common with its prediction.
    residual, residual_low, residual_high : float
        Power that is not explained.
    largest : mapping of str to float
        Probability that a group, or ``residual``, is the largest part; readings of cross-talk included.
    components : float
        Principal components kept, mean over the lines.
    n_states : int
        Operating states behind the paths.
    left_out : tuple of str
        References left out because they are a constant.
    doubts : tuple of str
        In words.
    """

    state: str
    receiver: str
    span: str
    band_hz: tuple[float, float]
    total: float
    total_low: float
    total_high: float
    groups: Mapping[str, GroupPart]
    shared: float
    residual: float
    residual_low: float
    residual_high: float
    largest: Mapping[str, float]
    components: float
    n_states: int
    left_out: tuple[str, ...]
    doubts: tuple[str, ...]

    @property
    def explained(self) -> float:
        """Part of the power that the references explain, 0 to 1."""
        return min(1.0, max(0.0, 1.0 - self.residual / self.total)) if self.total > 0.0 else 0.0

    @classmethod
    def of(
        cls,
        state: str,
        receiver: str,
        span: str,
        band_hz: tuple[float, float],
        total: Array,
        residual: Array,
        groups: Mapping[str, GroupPart],
        largest: Mapping[str, float],
        probability: float,
        segments: int,
        components: float,
        n_states: int,
        left_out: tuple[str, ...],
    ) -> SpanContributions:
        """Gather the parts; arrays hold the value first, then its resampled ones."""
        doubts = []
        if n_states == 1:
            doubts.append("one operating state: nothing tells cross-talk from a source of its own")
        if segments < 2:
            doubts.append("one segment: no scatter, intervals are empty")
        if left_out:
            doubts.append(f"left out as constant: {', '.join(left_out)}")
        total_low, total_high = scatter_bounds(total, segments, probability)
        low, high = scatter_bounds(np.maximum(residual, 0.0), segments, probability)
        return cls(
            state,
            receiver,
            span,
            band_hz,
            float(total[0]),
            total_low,
            total_high,
            dict(groups),
            float(total[0]) - max(0.0, float(residual[0])) - sum(part.path_mean_square for part in groups.values()),
            max(0.0, float(residual[0])),
            low,
            high,
            largest,
            components,
            n_states,
            left_out,
            tuple(doubts),
        )


def scatter_bounds(draws: Array, segments: int, probability: float) -> tuple[float, float]:
    """Return the interval of a power, whose value comes first and then its resampled ones.

    Quantiles of the resampled ones about their median, in decibels, set about the value; widened by
    ``sqrt(m / (m - 1))``, m segments, by which resampling a few of them is too narrow. A value not above 0 has the
    quantiles themselves.
    """
    value, resampled = float(draws[0]), draws[1:]
    if not resampled.size or segments < 2:
        return max(0.0, value), max(0.0, value)
    tails = 50.0 * (1.0 - probability), 50.0 * (1.0 + probability)
    low, middle, high = np.percentile(resampled, (tails[0], 50.0, tails[1]))
    if value <= 0.0 or low <= 0.0 or middle <= 0.0:
        return 0.0, max(0.0, value, float(high))
    wider = np.sqrt(segments / (segments - 1.0))
    return value * float((low / middle) ** wider), value * float((high / middle) ** wider)


def group_part(
    draws: Array,
    readings: Readings,
    explained: float,
    residual: float,
    segments: int,
    probability: float,
    n_states: int,
) -> GroupPart:
    """Judge a contribution.

    Parameters
    ----------
    draws : ndarray
        Power of the references' contribution, then the resampled ones.
    readings : Readings
    explained : float
        Power of all groups together, an upper bound of each one's.
    residual : float
        Power of what they do not explain.
    segments : int
    probability : float
    n_states : int
    """
    value, rival = float(draws[0]), readings.rival
    scatter = scatter_bounds(draws, segments, probability)
    if not rival:  # one group: nothing to be confused with
        verdict: Verdict = "ok" if value > 0.0 and scatter[0] > 0.0 else "below"
        reason = "" if verdict == "ok" else BELOW
        return GroupPart(max(0.0, value), max(0.0, value), *scatter, 1.0, 1.0, verdict, reason)
    crossed = readings.crossed
    lowest = max(0.0, min(1.0, readings.on_top, 1.0 - readings.leaked, max(0.0, 1.0 - crossed) ** 2))
    highest = max(1.0, readings.alone, (1.0 + crossed) ** 2)
    upper = max(scatter[1], readings.alone_part * explained)
    told = float(stats.norm.isf(0.5 * (1.0 - probability))) * readings.source_scatter
    if CERTAIN * readings.source_scatter <= WITHIN:
        if max(value, readings.source) <= 0.0 or scatter[0] <= 0.0:
            return _below(value, max(upper, readings.source), lowest, highest)
        refusal = _refusal(readings)
        if refusal:
            return GroupPart(None, value, 0.0, max(scatter[1], explained), 0.0, highest, "refused", refusal)
        return _known(value, readings, scatter, told, residual)
    if value <= 0.0 or scatter[0] <= 0.0:
        return _below(value, upper, lowest, highest)
    if readings.on_top < OWN:
        own = 100.0 * max(0.0, readings.on_top)
        reason = f"its references are coherent with those of {rival}: {own:.1f} % of it is its own"
        return GroupPart(None, value, 0.0, max(scatter[1], explained), 0.0, highest, "refused", reason)
    why = "one operating state does not tell cross-talk" if n_states == 1 else "the states do not tell cross-talk"
    down = "no lower bound" if lowest < NOTHING else f"{-10.0 * np.log10(lowest):.1f} dB lower"
    reason = f"{why} with {rival}: {down}, {10.0 * np.log10(highest):.1f} dB higher at most"
    low = scatter[0] * lowest if lowest >= NOTHING else 0.0
    return GroupPart(value, value, low, scatter[1] * highest, lowest, highest, "flagged", reason)


def _known(value: float, readings: Readings, scatter: tuple[float, float], told: float, residual: float) -> GroupPart:
    """A contribution that the states tell, unless a source without a reference could be mistaken for it."""
    source, noise = readings.source, float(np.log1p(readings.noise))
    # Scatter of the segments and what the states leave open of the mix are independent; noise is one-sided.
    wide = float(np.hypot(told, 0.5 * np.log(scatter[1] / scatter[0])))
    missed = float(np.sqrt(LEAK * residual / source))
    if missed > 1.0 - np.sqrt(0.5):
        lowest, highest = max(0.0, 1.0 - missed) ** 2 / float(np.exp(told)), (1.0 + missed) ** 2 * float(np.exp(told))
        low, high = source * max(0.0, 1.0 - missed) ** 2 * np.exp(-wide), source * (1.0 + missed) ** 2 * np.exp(wide)
        reason = "what no reference explains is as loud or louder: a source without a reference may be part of it"
        return GroupPart(source, value, float(low), float(high), lowest, highest, "flagged", reason)
    low, high = source * float(np.exp(-wide)), source * float(np.exp(wide + noise))
    return GroupPart(source, value, low, high, float(np.exp(-told)), float(np.exp(told + noise)), "ok", "")


def _refusal(readings: Readings) -> str:
    """Why a source that the states tell is refused all the same; empty where it is not."""
    if readings.share_elsewhere > 1.0 - OWN:
        return (
            f"its sound is {100.0 * readings.share_elsewhere:.1f} % of the references of {readings.rival} too, "
            "which might as well be its owner"
        )
    if readings.own_share < OWN:
        return (
            f"its references are coherent with those of {readings.rival}: {100.0 * readings.own_share:.1f} % is its own"
        )
    if readings.noise > NOISE:
        return f"noise of the references may be {100.0 * min(readings.noise, 9.99):.0f} % of it"
    return ""


def _below(value: float, high: float, lowest: float, highest: float) -> GroupPart:
    return GroupPart(max(0.0, value), max(0.0, value), 0.0, high, lowest, highest, "below", BELOW)


def leading(
    groups: Mapping[str, GroupPart], shared: NDArray[np.complex128], residual: Array, seed: int
) -> dict[str, float]:
    """Return how often each group, or the residual, is the largest part.

    Resampled powers, each moved by what cross-talk leaves open: of an ``ok`` contribution normally spread about the
    separated value, of one ``below`` or ``refused`` evenly drawn, in decibels, over the 30 dB below its upper bound, of
    others a reading evenly drawn, in decibels, from 3 dB below the lowest to 3 dB above the highest
    [assumed].

    Parameters
    ----------
    groups : mapping of str to GroupPart
    shared : ndarray, shape (n_draws + 1, n_groups, n_groups)
    residual : ndarray, shape (n_draws + 1,)
    seed : int
    """
    generator = np.random.default_rng([seed, 1])
    names, powers = [*groups, RESIDUAL], []
    tiny = np.finfo(float).tiny
    for number, part in enumerate(groups.values()):
        level = np.log(np.maximum(shared[:, number, number].real, tiny))
        low, high = np.log(max(part.lowest, NOTHING)), np.log(min(part.highest, 1.0 / NOTHING))
        if part.verdict == "ok" and part.mean_square and part.path_mean_square > 0.0:
            level = level + np.log(part.mean_square / part.path_mean_square)
            level = level + 0.25 * (high - low) * generator.standard_normal(level.shape)
        elif part.verdict in ("below", "refused"):
            upper = np.log(max(part.high, tiny))
            level = generator.uniform(upper + np.log(NOTHING), upper, size=level.shape)
        elif high > low:
            level = level + generator.uniform(low - WITHIN, high + WITHIN, size=level.shape)
        powers.append(level)
    powers.append(np.log(np.maximum(residual, tiny)))
    stacked = np.array(powers)
    stacked = stacked[:, 1:] if stacked.shape[1] > 1 else stacked
    count = np.bincount(stacked.argmax(axis=0), minlength=len(names))
    return {name: float(number / count.sum()) for name, number in zip(names, count, strict=True)}
