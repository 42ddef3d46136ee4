"""Short-time spectra of the line spacing and averaging time that the standards on tonal audibility ask for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.spectra import FramePowerMeter, Spectrum, average_spectrum, plan_frames

__all__ = ["AVERAGING_S", "LINE_SPACING_HZ", "LINE_SPACING_LIMITS_HZ", "ShortTimeMeter", "ShortTimeSpectrum"]

Array = NDArray[np.float64]

LINE_SPACING_HZ: Final = 2.7
"""Line spacing asked for: that of the example in ISO/PAS 20065:2016, annex E."""
LINE_SPACING_LIMITS_HZ: Final = (1.9, 4.0)
"""Line spacing that ISO/PAS 20065:2016 and ISO/TS 20065:2022 allow (also in the manual of Svantek's SV 977D)."""
AVERAGING_S: Final = 3.0
"""Time that one spectrum is averaged over, at least."""


@dataclass(frozen=True)
class ShortTimeSpectrum:
    """Spectra of all channels over one stretch of time.

    Parameters
    ----------
    start_s, end_s : float
        After the record's start.
    spectra : tuple of Spectrum or None
        One a channel, in the order of the channels; None where no frame of it holds numbers throughout.
    """

    start_s: float
    end_s: float
    spectra: tuple[Spectrum | None, ...]


class ShortTimeMeter:
    """Takes blocks of samples and yields averaged spectra, one for each stretch of the averaging time.

    Frames are Hann windows at half overlap that do not reach over the stretches' ends, so that the spectra are
    independent. What is left at the record's end and is shorter than a stretch is not used; a record shorter than
    one stretch gives one spectrum of what there is.

    Parameters
    ----------
    names : sequence of str
        Of the channels.
    sample_rate_hz : float
    n_samples : int
        Of the record.
    line_spacing_hz, averaging_s : float

    Raises
    ------
    AnalysisError
        The line spacing lies outside of the standards' limits, or the record is shorter than a frame.
    """

    def __init__(
        self,
        names: tuple[str, ...],
        sample_rate_hz: float,
        n_samples: int,
        line_spacing_hz: float = LINE_SPACING_HZ,
        averaging_s: float = AVERAGING_S,
    ) -> None:
        low, high = LINE_SPACING_LIMITS_HZ
        stretch = min(n_samples, round(averaging_s * sample_rate_hz))
        self._plan = plan_frames(sample_rate_hz, max(16, stretch), line_spacing_hz, 0.5, len(names), max_segments=1)
        if not low <= self._plan.resolution_hz <= high or stretch < self._plan.frame_length:
            raise AnalysisError(
                f"tonal audibility takes a line spacing of {low:g} to {high:g} Hz; {n_samples} samples at "
                f"{sample_rate_hz:g} Hz give {self._plan.resolution_hz:.3g} Hz ({line_spacing_hz:g} Hz was asked for)"
            )
        self._plan = replace(self._plan, n_segments=1)
        self._names = names
        self._stretch = stretch
        self._rate = sample_rate_hz
        self._meter = FramePowerMeter(self._plan, len(names))
        self._filled = 0
        self._done = 0

    @property
    def line_spacing_hz(self) -> float:
        """Distance of the lines."""
        return self._plan.resolution_hz

    @property
    def averaging_s(self) -> float:
        """Length of a stretch."""
        return self._stretch / self._rate

    def take(self, block: Array) -> Iterator[ShortTimeSpectrum]:
        """Add samples, shape (n_channels, n), in order; yield the spectra that they complete."""
        start = 0
        while start < block.shape[1]:
            used = min(block.shape[1] - start, self._stretch - self._filled)
            self._meter.take(block[:, start : start + used])
            self._filled += used
            start += used
            if self._filled == self._stretch:
                yield self._finish()

    def _finish(self) -> ShortTimeSpectrum:
        powers = self._meter.result()
        self._meter = FramePowerMeter(self._plan, len(self._names))
        begin, self._filled, self._done = self._done, 0, self._done + 1
        spectra = tuple(
            average_spectrum(powers, channel, "sound_pressure", "Pa", name) if powers.frames[channel].sum() else None
            for channel, name in enumerate(self._names)
        )
        return ShortTimeSpectrum(begin * self.averaging_s, (begin + 1) * self.averaging_s, spectra)
