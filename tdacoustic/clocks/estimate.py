"""Offset and drift of one recorder's clock against another's, from a signal that both recorded.

First windows of the shorter record are sought in the longer one, in a band low enough for an unknown drift to do no
harm; the places they agree on give a line within tenths of a millisecond. Then the cross-spectra of many short windows
along the overlap, with that line taken out, give each window's delay by the slope of the phase, weighted by coherence
(Hannan and Thomson, 1973). A robust line through the delays corrects the first one, until it stands still.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.clocks.consensus import Consensus, agree
from tdacoustic.clocks.delays import (
    Delays,
    Stack,
    cell_weights,
    coherence_of,
    stack_line,
    window_delays,
    windows_to_join,
)
from tdacoustic.clocks.line_fit import DelayLine, fit_line
from tdacoustic.clocks.records import SharedRecord, own_span
from tdacoustic.clocks.relation import ClockEstimate, NoRelation, Relation
from tdacoustic.clocks.search import MOST_PEAKS, Candidate, SearchPlan, find_candidates
from tdacoustic.clocks.windows import RATE_PART, WindowSpectra, overlap_of, window_spectra

__all__ = ["MAX_DRIFT_PPM", "estimate_clock"]

Array = NDArray[np.float64]

MAX_DRIFT_PPM: Final = 300.0
"""Difference of two clocks that is looked for: two quartzes of 100 ppm and a margin [assumed]."""
BANDS: Final = (((15.0, 2000.0), 4.0), ((15.0, 8000.0), 2.0), ((2.0, 250.0), 16.0))
"""Bands of the search in turn, and the windows for them."""
LOW_HZ: Final = 1000.0
FIRST_WINDOWS: Final = 12
SECOND_WINDOWS: Final = 24
LEAST_SUPPORT: Final = 4
LEAST_LIKELIHOOD: Final = 40.0
"""Of a line by chance it is some 45 at most, of windows that each may lie anywhere; see tests."""
CHANCE: Final = 1.2
"""Standard deviations beyond the highest correlation that chance gives over all lags."""
MOST_NEXT: Final = 0.6
"""Likelihood of the next best alignment over that of the best, beyond which neither is believed."""
LEAST_RATIO: Final = 1.08
"""The same of the fine correlation's neighbouring peak, as a ratio of heights."""
STACK_WEIGHT: Final = 2.0
"""Most a cell weighs where cycles are told apart: one strong tone must not decide that."""
TOLERANCE_S: Final = 4e-4
LEAST_FREEDOM: Final = 60.0
LEAST_DELAYS: Final = 3
PASSES: Final = 4
REPEATS: Final = 0.8
"""Correlation of the shared signal with itself some time later, beyond which the alignment may be off by that time."""
LEAST_COHERENT: Final = 6
"""Cells of the cross-spectrum; fewer are one tone or two."""
WEAK: Final = 0.1
"""Coherence below which what the windows leave shows too little of the error."""
WEAK_FACTOR: Final = 1.6
"""By how much too little: of simulated records with a coherence of 0.03."""
JOINED_REACH_S: Final = 2e-4
"""How far joined windows may lie from the line that was taken out of them."""
DIGITAL_VALUES: Final = 3
DIGITAL_SAMPLES: Final = 2**17
"""A record whose first samples take so few values tells an edge to a sample, not better."""
STILL: Final = 0.02
"""Samples by which the axis may still move."""
SUB_BANDS: Final = 3
LEAST_CELLS: Final = 2
RESPONSE_SIGMAS: Final = 4.0
RESPONSE_PART: Final = 0.02
"""Samples of difference between parts of the band from which on it is spoken of."""


def estimate_clock(
    reference: SharedRecord,
    other: SharedRecord,
    max_offset_s: float | None = None,
    centre_s: float = 0.0,
    max_drift_ppm: float = MAX_DRIFT_PPM,
) -> ClockEstimate | NoRelation:
    """Estimate how a recorder's time lies on a reference's.

    Sampling rates may differ and need have no common measure; neither record is resampled. Sign and gain of either may
    differ. What is assumed: one signal reaches both recorders with no delay that changes, and both clocks run evenly;
    a clock that does not is said to wander, and the errors then hold that too.

    Parameters
    ----------
    reference, other : SharedRecord
    max_offset_s : float, optional
        How far the offset may lie from `centre_s`. Default: wherever the records overlap.
    centre_s : float
        Reference's time at which the other record's own time is zero, as far as it is known.
    max_drift_ppm : float

    Returns
    -------
    ClockEstimate or NoRelation
        The latter where nothing is found, or where several alignments would do.

    Examples
    --------
    >>> from tdacoustic.clocks.records import ArrayRecord
    >>> noise = np.random.default_rng(1).standard_normal(40000)
    >>> found = estimate_clock(ArrayRecord(noise, 4000.0), ArrayRecord(noise[400:], 4000.0))
    >>> round(found.offset_s, 6)
    0.1
    """
    reach = _Reach(max_offset_s, centre_s, 1e-6 * max_drift_ppm)
    swapped = _length_s(reference) > _length_s(other)
    short, long = (other, reference) if swapped else (reference, other)
    found = _search(short, long, reach.inverse() if swapped else reach)
    if isinstance(found, NoRelation):
        return found
    relation = _inverse(found.relation) if swapped else found.relation
    return _refine(reference, other, replace(found, relation=relation), reach)


def _length_s(record: SharedRecord) -> float:
    first, last = own_span(record)
    return last - first


def _inverse(relation: Relation) -> Relation:
    return Relation(-relation.offset_s * (1.0 + relation.drift), 1.0 / (1.0 + relation.drift) - 1.0)


@dataclass(frozen=True)
class _Reach:
    """Where an offset may lie, and how large a drift may be."""

    max_offset_s: float | None
    centre_s: float
    max_drift: float

    def inverse(self) -> _Reach:
        return replace(self, centre_s=-self.centre_s)

    @property
    def start(self) -> tuple[float, float]:
        return self.centre_s, np.inf if self.max_offset_s is None else self.max_offset_s

    @property
    def longest_s(self) -> float:
        """Longest time between two alignments that are both allowed."""
        return np.inf if self.max_offset_s is None else 2.0 * self.max_offset_s

    def offsets(self, time_s: float) -> tuple[float, float]:
        if self.max_offset_s is None:
            return -np.inf, np.inf
        slack = self.max_offset_s + self.max_drift * abs(time_s - self.centre_s) + TOLERANCE_S
        return self.centre_s - slack, self.centre_s + slack


@dataclass(frozen=True)
class _Found:
    relation: Relation
    sign: float
    peak_ratio: float


def _search(reference: SharedRecord, other: SharedRecord, reach: _Reach) -> _Found | NoRelation:
    """Seek windows of the reference in the other record, in one band after another."""
    low, high = reach.offsets(own_span(reference)[1])
    (first, last), own = own_span(reference), own_span(other)
    begin_s, end_s = max(first, own[0] + low), min(last, own[1] + high)
    if end_s <= begin_s:
        within = "" if reach.max_offset_s is None else f" with an offset within {reach.max_offset_s:g} s"
        return NoRelation(f"the records do not overlap{within}")
    failure: NoRelation | None = None
    for plan in _plans(reference, other, (begin_s, end_s), reach):
        if failure is not None and failure.ambiguous and plan.band_hz[1] <= LOW_HZ:
            break  # what repeats itself in a wide band is not told apart in a narrow one
        candidates = find_candidates(reference, other, plan)
        best = agree(candidates, max(TOLERANCE_S, 0.5 * plan.apart_s), reach.max_drift, reach.start)
        verdict = _verdict(best, candidates, plan, _length_s(other))
        if verdict is None and best is not None:
            best = _wider(reference, other, plan, best, reach)
            if best.ratio**2 * MOST_NEXT < 1.0:
                return NoRelation(
                    "alignments beside the best fit about equally: the shared signal repeats itself", True
                )
            return _Found(_relation(best), best.sign, min(best.ratio, 1e3))
        if failure is None or (verdict is not None and verdict.ambiguous and not failure.ambiguous):
            failure = verdict
    return failure or NoRelation("the records are too short")


def _plans(
    reference: SharedRecord, other: SharedRecord, span_s: tuple[float, float], reach: _Reach
) -> list[SearchPlan]:
    nyquist = RATE_PART * min(reference.sample_rate_hz, other.sample_rate_hz)
    shorter = min(span_s[1] - span_s[0], _length_s(other))
    plans: list[SearchPlan] = []
    for (low, high), longest in BANDS:
        window_s = min(longest, 0.25 * shorter)
        top = min(high, nyquist)
        starts = tuple(np.linspace(span_s[0], span_s[1] - window_s, FIRST_WINDOWS).tolist())
        plan = SearchPlan(window_s, (low, top), starts, tuple(reach.offsets(start) for start in starts))
        if top > 2.0 * low and plan.freedom >= LEAST_FREEDOM and all(plan.band_hz != held.band_hz for held in plans):
            plans.append(plan)
    return plans


def _verdict(
    best: Consensus | None, candidates: Sequence[Candidate], plan: SearchPlan, span_s: float
) -> NoRelation | None:
    """Return None where one alignment stands out, else why not."""
    band = f"{plan.band_hz[0]:g} to {plan.band_hz[1]:g} Hz"
    if best is None:
        return NoRelation(f"nothing to compare in {band}: one record is silent or too short")
    said = (
        f"the best alignment correlates by {best.correlation:.2g} in {len(best.supporters)} of {len(plan.starts_s)} "
        f"windows ({band}), the next by {best.next_correlation:.2g}"
    )
    lags = sum(min(high - low, span_s) for low, high in plan.offsets_s) / plan.apart_s
    chance = np.sqrt(2.0 * np.log(max(10.0, 2.0 * lags))) + CHANCE
    clear = best.correlation > chance / np.sqrt(plan.freedom)
    if best.likelihood < LEAST_LIKELIHOOD or not clear:
        return NoRelation(f"no alignment stands out: {said}; the channels share no signal, or do not overlap")
    least = chance / np.sqrt(plan.freedom)
    repeating = [item for item in best.supporters if _repeats(item, candidates, least)]
    if best.next_likelihood > MOST_NEXT * best.likelihood or 2 * len(repeating) >= len(best.supporters):
        return NoRelation(f"several alignments fit about equally: {said}; the shared signal repeats itself", True)
    return None


def _repeats(item: Candidate, candidates: Sequence[Candidate], least: float) -> bool:
    """Whether a window fits more places than are kept of it about as well as the one chosen, none of them by chance."""
    others = [abs(other.correlation) for other in candidates if other.window == item.window]
    lowest = min(others)
    return len(others) == MOST_PEAKS and lowest > max(least, np.sqrt(MOST_NEXT) * abs(item.correlation))


def _relation(best: Consensus) -> Relation:
    """From ``t - u = offset - drift (t - time)`` to ``t = offset_s + u / (1 + drift)``."""
    offset = best.offset_s + best.drift * best.time_s
    return Relation(offset / (1.0 + best.drift), best.drift)


def _wider(reference: SharedRecord, other: SharedRecord, plan: SearchPlan, best: Consensus, reach: _Reach) -> Consensus:
    """Seek more windows within the overlap now known, where few of the first lay in it."""
    times = [item.time_s for item in best.supporters]
    begin_s, end_s = overlap_of(reference, other, _relation(replace(best, drift=0.0)))
    if len(times) >= LEAST_SUPPORT and max(times) - min(times) >= 0.5 * (end_s - begin_s):
        return best
    window_s = min(plan.window_s, 0.25 * (end_s - begin_s))
    starts = tuple(np.linspace(begin_s, end_s - window_s, SECOND_WINDOWS).tolist())
    middle = 0.5 * window_s
    slack = [2.0 * TOLERANCE_S + reach.max_drift * abs(start + middle - best.time_s) for start in starts]
    offsets = tuple((best.offset_s - s, best.offset_s + s) for s in slack)
    second = SearchPlan(window_s, plan.band_hz, starts, offsets)
    if second.freedom < LEAST_FREEDOM:
        return best
    found = agree(find_candidates(reference, other, second), max(TOLERANCE_S, 0.5 * plan.apart_s), reach.max_drift)
    if found is None or found.likelihood < LEAST_LIKELIHOOD:
        return best
    return found if found.ratio < best.ratio else replace(found, next_likelihood=found.likelihood / best.ratio**2)


# ---------------------------------------------------------------- refinement


def _refine(reference: SharedRecord, other: SharedRecord, found: _Found, reach: _Reach) -> ClockEstimate | NoRelation:
    relation, last = found.relation, None
    for _ in range(PASSES):
        spectra = window_spectra(reference, other, relation)
        if spectra is None:
            return NoRelation("the records overlap too briefly")
        weights = cell_weights(spectra)
        coherent = int(np.count_nonzero(weights))
        if coherent < LEAST_COHERENT:
            width = coherent * float(spectra.frequencies_hz[1] - spectra.frequencies_hz[0])
            return NoRelation(f"the records are coherent in {width:.3g} Hz of their band only, too little for a delay")
        line = stack_line(spectra, np.minimum(weights, STACK_WEIGHT), found.sign)
        if line.ratio < LEAST_RATIO:
            return NoRelation(
                f"neighbouring cycles fit about equally (the next peak is {100.0 / line.ratio:.0f} % of the best): "
                "the shared signal is too narrow in band",
                True,
            )
        repeats, after_s = spectra.repetition(coherence_of(spectra) * (weights > 0.0), reach.longest_s)
        if repeats > REPEATS:
            return NoRelation(
                f"the shared signal repeats itself to {100.0 * repeats:.0f} % after {after_s:.4g} s", True
            )
        number = windows_to_join(spectra, weights, found.sign, line)
        delays = _delays(spectra, weights, found.sign, line, number)
        if delays.times_s.size < LEAST_DELAYS:
            return NoRelation(f"only {delays.times_s.size} of {spectra.times_s.size} windows tell a delay")
        fitted = fit_line(delays)
        begin_s, end_s = overlap_of(reference, other, relation)
        moved = max(abs(fitted.delay_s + fitted.slope * (t - fitted.time_s)) for t in (begin_s, end_s))
        relation, last = _corrected(relation, fitted), _Last(spectra, weights, fitted, number)
        if moved * max(reference.sample_rate_hz, other.sample_rate_hz) < STILL:
            break
    if abs(relation.drift) > reach.max_drift:
        return NoRelation(
            f"the drift found, {1e6 * relation.drift:.4g} ppm, is more than {1e6 * reach.max_drift:g} ppm"
        )
    assert last is not None
    return _estimate(reference, other, found, relation, last)


def _delays(spectra: WindowSpectra, weights: Array, sign: float, line: Stack, number: int) -> Delays:
    """Delays of the windows, or of so many joined that each stands clear of chance."""
    if number == 1:
        return window_delays(spectra, weights, sign, line)
    joined = spectra.joined(number, line.at(spectra.times_s))
    flat = Stack(line.time_s, 0.0, 0.0, line.ratio)
    delays = window_delays(joined, weights, sign, flat, JOINED_REACH_S)
    return replace(delays, delays_s=delays.delays_s + line.at(delays.times_s))


def _corrected(relation: Relation, line: DelayLine) -> Relation:
    """Take a line of delays that are left out of a relation."""
    keep = 1.0 - line.slope
    offset_s = relation.offset_s * keep - line.delay_s + line.slope * line.time_s
    return Relation(offset_s, (1.0 + relation.drift) / keep - 1.0)


@dataclass(frozen=True)
class _Last:
    """What the last pass had."""

    spectra: WindowSpectra
    weights: Array
    line: DelayLine
    joined: int

    @property
    def n_used(self) -> int:
        return min(int(self.spectra.times_s.size), self.line.n_used * self.joined)


def _estimate(
    reference: SharedRecord, other: SharedRecord, found: _Found, relation: Relation, last: _Last
) -> ClockEstimate:
    begin_s, end_s = overlap_of(reference, other, relation)
    line, rate = last.line, max(reference.sample_rate_hz, other.sample_rate_hz)
    response_s, parts = _response(last, found.sign)
    coherence = _mean_coherence(last)
    weak = WEAK_FACTOR if coherence < WEAK else 1.0
    edge_s = float(np.hypot(_edge_s(reference), _edge_s(other)))
    response = response_s if response_s * rate > RESPONSE_PART else 0.0
    wander = float(np.abs(line.groups.delays_s).max(initial=0.0)) if line.wander_s > 0.0 else 0.0
    further = float(np.linalg.norm([wander, response, edge_s]))
    doubts = []
    if response_s * rate > RESPONSE_PART:
        doubts.append(
            f"the delay is {1e6 * parts[0]:.3g} us in the lower and {1e6 * parts[1]:.3g} us in the upper part of the "
            "band against the whole: the two channels answer differently, which the offset's error holds"
        )
    if line.wander_s * rate > 0.1:
        doubts.append(
            f"the clocks do not run evenly against each other: {1e6 * line.wander_s:.3g} us rms are left over time"
        )
    if last.n_used < 0.5 * last.spectra.times_s.size:
        doubts.append(f"only {last.n_used} of {last.spectra.times_s.size} windows along the overlap tell a delay")
    if edge_s > 0.0:
        doubts.append("the shared signal is digital: its edges are told to a sample, not better")
    return ClockEstimate(
        offset_s=relation.offset_s,
        offset_error_s=float(np.hypot(weak * line.error_at(relation.offset_s), further)),
        drift_ppm=1e6 * relation.drift,
        drift_error_ppm=1e6 * weak * line.slope_error,
        axis_error_s=max(float(np.hypot(weak * line.error_at(t), further)) for t in (begin_s, end_s)),
        overlap_s=(begin_s, end_s),
        wander_s=line.wander_s,
        coherence=coherence,
        peak_ratio=found.peak_ratio,
        band_hz=_band(last),
        inverted=found.sign < 0.0,
        n_windows=int(last.spectra.times_s.size),
        n_used=last.n_used,
        residuals=line.groups,
        doubts=tuple(doubts),
    )


def _edge_s(record: SharedRecord) -> float:
    """Standard deviation of an edge's place between two samples, where a record has but a few values; else 0."""
    stop = min(record.n_samples, DIGITAL_SAMPLES)
    values = {
        float(value) for block in record.blocks(0, stop, stop) for value in np.unique(block)[: DIGITAL_VALUES + 1]
    }
    return 1.0 / (np.sqrt(12.0) * record.sample_rate_hz) if len(values) <= DIGITAL_VALUES else 0.0


def _information(last: _Last) -> Array:
    """What each cell tells of a delay, relative."""
    squared = coherence_of(last.spectra)
    known = np.where(last.weights > 0.0, squared / (1.0 - squared), 0.0)
    return np.asarray(known * last.spectra.frequencies_hz**2)


def _mean_coherence(last: _Last) -> float:
    return float(np.average(coherence_of(last.spectra), weights=_information(last)))


def _band(last: _Last) -> tuple[float, float]:
    share = np.cumsum(_information(last))
    low, high = np.searchsorted(share, [0.05 * share[-1], 0.95 * share[-1]])
    frequencies = last.spectra.frequencies_hz
    return float(frequencies[low]), float(frequencies[min(high, frequencies.size - 1)])


def _response(last: _Last, sign: float) -> tuple[float, tuple[float, float]]:
    """Half the difference of the delays in the parts of the band, where it is beyond chance, and the outer ones."""
    line = last.line
    on_line = line.delay_s + line.slope * (last.spectra.times_s - line.time_s)
    omega = 2.0 * np.pi * last.spectra.frequencies_hz
    turned = sign * last.spectra.cross * np.exp(1j * omega * on_line[:, None])
    known = omega[last.weights > 0.0]
    edges = np.searchsorted(omega, np.geomspace(known[0], known[-1], SUB_BANDS + 1)[1:-1])
    delays, errors = [], []
    for cells in np.split(np.arange(omega.size), edges):
        used = cells[last.weights[cells] > 0.0]
        if used.size < LEAST_CELLS:
            continue
        weight = last.weights[used] * omega[used]
        slope = turned[:, used].imag @ weight
        bend = turned[:, used].real @ (weight * omega[used])
        delays.append(float(-slope.sum() / bend.sum()))
        errors.append(float(np.sqrt(np.sum(slope**2)) / bend.sum()))
    if len(delays) < 2:
        return 0.0, (0.0, 0.0)
    spread, error = 0.5 * float(np.ptp(delays)), float(np.hypot(max(errors), min(errors)))
    return (spread if 2.0 * spread > RESPONSE_SIGMAS * error else 0.0), (delays[0], delays[-1])
