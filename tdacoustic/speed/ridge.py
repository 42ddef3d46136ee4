"""Speed without a tacho: from the lines that a shaft's orders draw in vibration or sound."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tdacoustic.speed.profile import SpeedProfile
from tdacoustic.speed.ridge_refinement import RidgeRefinement
from tdacoustic.speed.ridge_search import FoundPath, RidgeSearch, RidgeSettings, refusal

__all__ = ["RidgeSpeed", "refinement_of", "ridge_speed", "speed_from_lines"]

Array = NDArray[np.float64]

LEAST_CONFIDENCE: Final = 0.5
"""Confidence below which a speed is not given [assumed]."""
SURE_READING: Final = 0.9
"""Probability of the reading of the lines from which a speed is not doubtful [assumed]."""
LEAST_SHARE: Final = 0.25
"""Part of the run over which a speed must be known [assumed]; less is no speed of the run."""
FRAMES_S: Final = (0.4, 0.8)
"""Shortest and longest frame of the refinement; else twice that of the search."""
REACH_STEPS, REACH_PART = 2.5, 0.02
"""Half width of the refinement around the path: steps of its grid, and part of the middle speed; the larger counts."""
LONGEST_HOLE_S: Final = 1.0
"""Longest span without a value that is bridged by a straight line [assumed]."""
OUTLIER: Final = 5.0
LEAST_OUTLIER: Final = 0.003
"""Values this far, relative, from their neighbours' median are never outliers [assumed]."""


@dataclass(frozen=True)
class RidgeSpeed:
    """A speed that was read from lines, or why there is none.

    Parameters
    ----------
    profile : SpeedProfile or None
        With `confidence`, `error`, and the spans in which the speed is not known.
    reason : str or None
        Why there is no profile.
    times_s, path_hz, confidence : ndarray, shape (n_frames,)
        The rough path and its confidence, found or not, for a look at it; times on the run's axis.
    heard : tuple of (str, float)
        Each order, and the probability that the machine has it.
    rival_ratio, rival_probability : float
        The next likely reading of the same lines: its speed over this one's. NaN and 0 without one.
    margin : float
        Logarithmic evidence above that of strange orders.
    frame_s : float
        Length of the frames of the search.
    """

    profile: SpeedProfile | None
    reason: str | None
    times_s: Array
    path_hz: Array
    confidence: Array
    heard: tuple[tuple[str, float], ...]
    rival_ratio: float
    rival_probability: float
    margin: float
    frame_s: float


def refinement_of(found: FoundPath, settings: RidgeSettings, sample_rate_hz: float, n_samples: int) -> RidgeRefinement:
    """Return what measures the speed along a path in a second pass over the same channels."""
    frame_s = min(max(2.0 * found.frame_s, FRAMES_S[0]), FRAMES_S[1])
    path = found.path.speeds_hz
    reach = max(REACH_STEPS * found.step_hz, REACH_PART * float(np.median(path)))
    return RidgeRefinement(
        found.times_s,
        path,
        settings.orders,
        frame_s,
        reach,
        settings.acceleration_hz_s,
        sample_rate_hz,
        n_samples,
        found.top_hz,
    )


def ridge_speed(
    name: str,
    settings: RidgeSettings,
    found: FoundPath,
    refined: RidgeRefinement | None,
    start_s: float,
    duration_s: float,
) -> RidgeSpeed:
    """Return the speed of a path after its second pass.

    Parameters
    ----------
    name : str
        Of the channels, for the profile.
    settings : RidgeSettings
    found : FoundPath
    refined : RidgeRefinement or None
        After all samples; None where `refusal` gives a reason.
    start_s : float
        Of the first sample on the run's time axis.
    duration_s : float
        Of the record.
    """
    confidence = found.path.confidence * found.reading.probability
    profile, reason = None, refusal(found)
    if reason is None and refined is not None:
        profile, reason = _profile(name, settings, found, refined, confidence, start_s, duration_s)
    reading = found.reading
    return RidgeSpeed(
        profile=profile,
        reason=reason,
        times_s=start_s + found.times_s,
        path_hz=found.path.speeds_hz,
        confidence=confidence,
        heard=reading.heard,
        rival_ratio=reading.rival_ratio,
        rival_probability=reading.rival_probability,
        margin=found.margin,
        frame_s=found.frame_s,
    )


def _profile(
    name: str,
    settings: RidgeSettings,
    found: FoundPath,
    refined: RidgeRefinement,
    confidence: Array,
    start_s: float,
    duration_s: float,
) -> tuple[SpeedProfile | None, str | None]:
    times, speeds, errors = refined.result()
    sure = np.interp(times, found.times_s, confidence)
    known = np.isfinite(errors) & (sure >= LEAST_CONFIDENCE)
    if known.sum() >= 7:
        middle = np.interp(times, times[known], ndimage.median_filter(speeds[known], 7, mode="nearest"))
        off = np.abs(speeds - middle)
        usual = 1.4826 * float(np.median(off[known]))
        known &= off <= np.maximum(OUTLIER * np.maximum(usual, errors), LEAST_OUTLIER * middle)
    share = float(known.mean()) if known.size else 0.0
    if share < LEAST_SHARE:
        return None, (
            f"no speed in the lines: sure in {100.0 * share:.0f} % of the run alone, where {100.0 * LEAST_SHARE:g} % "
            "are wanted"
        )
    times, speeds, errors, sure = times[known], speeds[known], errors[known], sure[known]
    errors = np.hypot(errors, _local_scatter(times, speeds))
    half = 0.5 * found.frame_s
    edges = np.concatenate(([0.0], times, [duration_s]))
    holes = np.flatnonzero(np.diff(edges) > np.maximum(LONGEST_HOLE_S, half))
    words = "no line of the shaft stands out"
    unknown = tuple((start_s + float(edges[at]), start_s + float(edges[at + 1]), words) for at in holes)
    heard = [item.name for item in found.heard]
    standing = "; all stand still in Hz, as a constant speed's do" if found.constant else ""
    notes = (
        f"read from the lines of {', '.join(heard)}; {found.frame_s:.2g} s a frame, known in {100.0 * share:.0f} % "
        f"of the run, median confidence {float(np.median(sure)):.2f}{standing}",
        *(f"not known from {first:.2f} s to {last:.2f} s: {words}" for first, last, words in unknown),
    )
    return (
        SpeedProfile(
            name,
            settings.shaft,
            "1/s",
            start_s + times,
            speeds,
            notes,
            doubtful=bool(unknown) or found.constant or found.reading.probability < SURE_READING,
            error=errors,
            confidence=sure,
            unknown=unknown,
        ),
        None,
    )


def _local_scatter(times: Array, speeds: Array) -> Array:
    """How far values lie from the straight line between their neighbours, robust over nine of them."""
    if speeds.size < 3:
        return np.zeros(speeds.size)
    part = (times[1:-1] - times[:-2]) / (times[2:] - times[:-2])
    off = np.abs(speeds[1:-1] - (speeds[:-2] + part * (speeds[2:] - speeds[:-2])))
    # Of independent values that distance has the variance 1 + 1/4 + 1/4.
    usual = 1.4826 * ndimage.median_filter(off, 9, mode="nearest") / np.sqrt(1.5)
    return np.concatenate((usual[:1], usual, usual[-1:]))


def speed_from_lines(name: str, signals: Array, sample_rate_hz: float, settings: RidgeSettings) -> RidgeSpeed:
    """Return the speed of a shaft from whole signals, shape (n_channels, n); what a step does block by block.

    Raises
    ------
    AnalysisError
        Too short a record, or orders that cannot be heard in it.
    """
    search = RidgeSearch(settings, sample_rate_hz, signals.shape[1], signals.shape[0])
    search.take(signals)
    found = search.result()
    refined = None
    if refusal(found) is None:
        refined = refinement_of(found, settings, sample_rate_hz, signals.shape[1])
        refined.take(signals)
    return ridge_speed(name, settings, found, refined, 0.0, signals.shape[1] / sample_rate_hz)
