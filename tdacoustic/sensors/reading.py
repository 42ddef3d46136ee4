"""A steady stretch of a calibrator's tone, read exactly."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.sensors.tone_track import LOWEST_HZ, line_powers

__all__ = ["LONGEST_S", "LONGEST_SAMPLES", "Plateau", "ToneReading", "read_plateau"]

Array = NDArray[np.float64]

LONGEST_S: Final = 60.0
LONGEST_SAMPLES: Final = 2**21
"""Of a stretch what is read, from its middle: more tells no more."""
_FRAME_S: Final = 0.5
_HARMONICS: Final = 5
_CLIPPED_SHARE: Final = 0.005
"""Part of the samples that lie on plateaus at the extremes, from which on a tone may be clipped."""
_CLIPPED_DISTORTION: Final = 10.0**-2.5
"""Harmonics over the tone, from which on it is: a sine that loses 0.05 dB to clipping has -50 dB."""
_PLATEAU_SAMPLES: Final = 3


@dataclass(frozen=True)
class Plateau:
    """A steady stretch of a tone, in the log's own numbers.

    Parameters
    ----------
    start_s, end_s : float
        After the first sample of the channel's cut.
    frequency_hz : float
    rms : float
        Of the tone alone, free of window, leakage and noise.
    steadiness_db : float
        Largest distance of the level of half a second from the mean.
    wander_db : float
        By how much the same tone's level lies elsewhere outside of the stretch.
    scatter_db : float
        Standard error of the mean level.
    distortion : float
        Rms of harmonics 2 to 5 over that of the tone.
    residue_db : float
        Level of all else from 10 Hz on against the tone.
    clipped : bool
    """

    start_s: float
    end_s: float
    frequency_hz: float
    rms: float
    steadiness_db: float
    wander_db: float
    scatter_db: float
    distortion: float
    residue_db: float
    clipped: bool

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return self.end_s - self.start_s


@dataclass(frozen=True)
class ToneReading:
    """What a channel shows of a calibrator.

    Parameters
    ----------
    channel : str
    plateaus : tuple of Plateau
        In the order of time.
    stood_out_s : float
        For how long a tone stood out, steady or not.
    """

    channel: str
    plateaus: tuple[Plateau, ...]
    stood_out_s: float = 0.0


def read_plateau(
    samples: Array,
    sample_rate_hz: float,
    frequency_hz: float,
    span_s: tuple[float, float],
    wander_db: float = 0.0,
    limits: tuple[float, float] | None = None,
) -> Plateau:
    """Read a tone.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Of the stretch, all finite; at least two periods.
    sample_rate_hz : float
    frequency_hz : float
        About where it is.
    span_s : (float, float)
        Start and end of the stretch.
    wander_db : float
    limits : (float, float) or None
        Smallest and largest number that the logger can store.

    Returns
    -------
    Plateau
        The level is the mean power of frames of half a second, so that a tone whose frequency wanders a little loses
        nothing. Error of a lone sine: below 0.001 dB.
    """
    n = min(samples.size, 2 * round(0.5 * _FRAME_S * sample_rate_hz))
    frames = np.lib.stride_tricks.sliding_window_view(samples, n)[:: max(1, n // 2)]
    spacing = sample_rate_hz / n
    around = max(2, round(0.02 * frequency_hz / spacing))
    low, high = max(1, int(frequency_hz / spacing) - around), min(n // 2 - 1, int(frequency_hz / spacing) + 1 + around)
    position, tone, spectrum = line_powers(frames, low, high)
    mean_spectrum, mean = spectrum.mean(axis=0), float(tone.mean())
    found_hz = float(np.median(position)) * spacing
    floor = _floor(mean_spectrum, float(np.median(position)))
    level = 10.0 * np.log10(np.maximum(tone, np.finfo(float).tiny) / mean)
    total = float(mean_spectrum[max(1, round(LOWEST_HZ / spacing)) :].sum())
    residue = max(total - mean, 1e-12 * mean)
    distortion = _distortion(mean_spectrum, found_hz / spacing, mean)
    return Plateau(
        start_s=span_s[0],
        end_s=span_s[1],
        frequency_hz=found_hz,
        rms=math.sqrt(max(mean - floor, 0.0)),
        steadiness_db=float(np.max(np.abs(level))),
        wander_db=wander_db,
        scatter_db=float(np.std(level)) / math.sqrt(max(1.0, 0.5 * len(frames))),  # frames overlap by half
        distortion=distortion,
        residue_db=10.0 * math.log10(residue / mean),
        clipped=_clipped(samples, limits, distortion),
    )


def _floor(spectrum: Array, position: float) -> float:
    """Noise within the tone's lobe, from the lines beside it."""
    peak = round(position)
    beside = np.concatenate([spectrum[max(1, peak - 16) : max(1, peak - 6)], spectrum[peak + 7 : peak + 17]])
    return 7.0 * float(np.median(beside)) if beside.size else 0.0


def _distortion(spectrum: Array, position: float, tone: float) -> float:
    power = 0.0
    for number in range(2, _HARMONICS + 1):
        at = round(number * position)
        if at + 3 >= spectrum.size:
            break
        lobe = float(spectrum[at - 3 : at + 4].sum())
        power += max(0.0, lobe - _floor(spectrum, number * position))
    return math.sqrt(power / tone) if tone > 0.0 else 0.0


def _clipped(samples: Array, limits: tuple[float, float] | None, distortion: float) -> bool:
    low, high = float(samples.min()), float(samples.max())
    if limits is not None and int(np.count_nonzero((samples <= limits[0]) | (samples >= limits[1]))) >= 3:
        return True
    at_extreme = (samples == low) | (samples == high)
    inside = np.convolve(at_extreme, np.ones(_PLATEAU_SAMPLES), "valid") == _PLATEAU_SAMPLES
    share = float(np.count_nonzero(inside)) / samples.size
    return share >= _CLIPPED_SHARE and distortion >= _CLIPPED_DISTORTION
