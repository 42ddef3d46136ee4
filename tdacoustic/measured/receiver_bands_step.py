"""Step: powers of a run's receivers in bands, segment by segment, small enough to hold many runs against each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.contributions import Span
from tdacoustic.measured.results import Survey
from tdacoustic.steps import Step

__all__ = ["RECEIVER_BANDS", "ReceiverBands", "ReceiverBandsSettings", "ReceiverPowers", "receiver_bands"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReceiverBandsSettings:
    """Receivers and bands."""

    receivers: tuple[str, ...]
    bands: tuple[Span, ...]


@dataclass(frozen=True)
class ReceiverPowers:
    """A receiver's powers.

    Parameters
    ----------
    channel : str
    times_s : ndarray, shape (n_segments,)
        Middle of each segment after the record's start.
    mean_square : ndarray, shape (n_segments, n_bands)
        unit²; 0 where `weights` is.
    weights : ndarray, shape (n_segments,)
        Frames of each segment.
    """

    channel: str
    times_s: Array
    mean_square: Array
    weights: Array


@dataclass(frozen=True)
class ReceiverBands:
    """The powers of all receivers of a run that have any."""

    powers: tuple[ReceiverPowers, ...]


def receiver_bands(settings: ReceiverBandsSettings, survey: Survey) -> ReceiverBands:
    """Step: sum the survey's densities over bands; a band beyond a receiver's rate has what lies below."""
    found = []
    for raster in survey.rasters:
        powers = raster.powers
        if powers is None:
            continue
        step_hz = powers.plan.resolution_hz
        frequencies_hz = np.arange(powers.plan.n_frequencies, dtype=np.float64) * step_hz
        widths = np.stack([band.width_hz(frequencies_hz, step_hz) for band in settings.bands])
        for channel in settings.receivers:
            if channel not in raster.channels:
                continue
            place = raster.channels.index(channel)
            weights = powers.frames[place].astype(np.float64)
            density = np.where(weights[:, None] > 0.0, powers.density[place], 0.0)
            found.append(ReceiverPowers(channel, powers.segment_times_s, density @ widths.T, weights))
    return ReceiverBands(tuple(found))


RECEIVER_BANDS = Step("receiver bands", 1, receiver_bands, "Bands of the microphones over time")
"""Inputs: ``survey``."""
