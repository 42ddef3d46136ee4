"""Third-octave levels by a class-1 filter bank, over blocks, each octave at its own rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from tdacoustic.errors import AnalysisError

__all__ = ["BandPowers", "ThirdOctaveMeter"]

Array = NDArray[np.float64]

ORDER = 6
"""Order of the Butterworth prototype; class 1 of IEC 61260-1 (a test holds it)."""

HIGHEST_EDGE = 0.45
"""Upper band edge over the sampling rate, at most."""

STAGE_EDGE = 0.28
"""Upper band edge over the rate of the stage that filters it, at most, but for the first stage."""

DECIMATOR_TAPS = 47
SETTLING = 4.0
"""Start of the record left out of a band's mean, over its bandwidth: the filter settles."""
SETTLING_PART = 0.2
"""The same, as part of the record, at most."""


@dataclass(frozen=True)
class BandPowers:
    """Mean squares in third-octave bands.

    Parameters
    ----------
    centre_hz : ndarray, shape (n_bands,)
        Exact mid-band frequencies (base ten, IEC 61260-1).
    nominal_hz : ndarray, shape (n_bands,)
        The nominal ones (16, 20, 25, 31.5, ...).
    mean_square : ndarray, shape (n_channels, n_bands)
    """

    centre_hz: Array
    nominal_hz: Array
    mean_square: Array


def _label_hz(label: str) -> float:
    """Read a nominal band label: ``"31.5"``, ``"1.25k"``."""
    return 1e3 * float(label[:-1]) if label.endswith("k") else float(label)


class _Stage:
    """The bands filtered at one rate, and the way down to the next."""

    def __init__(
        self, rate_hz: float, limits_hz: tuple[float, float] | None, n_channels: int, n_samples: float
    ) -> None:
        from pyoctaveband import OctaveFilterBank

        self.rate_hz = rate_hz
        self.centre_hz = np.zeros(0)
        self.sos: list[Array] = []
        self.nominal_hz: list[float] = []
        self.skip: list[int] = []
        if limits_hz is not None:
            bank = OctaveFilterBank(  # its rate need not be whole, whatever the annotation says
                fs=cast(int, rate_hz), fraction=3, order=ORDER, limits=list(limits_hz), stateful=True, resample=False
            )
            self.centre_hz = np.array(bank.freq)
            self.sos = [np.asarray(sos) for sos in bank.sos]
            self.nominal_hz = [_label_hz(str(label)) for label in bank.nominal_freq]
            width = np.array(bank.freq_u) - np.array(bank.freq_d)
            self.skip = [int(min(SETTLING * rate_hz / w, SETTLING_PART * n_samples)) for w in width]
        self.state = [np.zeros((len(sos), n_channels, 2)) for sos in self.sos]
        self.energy = np.zeros((n_channels, len(self.sos)))
        self.count = np.zeros(len(self.sos), dtype=np.int64)
        self.seen = 0
        self._taps = signal.firwin(DECIMATOR_TAPS, 0.5, window=("kaiser", 9.0))
        self._history = np.zeros((n_channels, DECIMATOR_TAPS - 1))
        self._phase = 0

    def measure(self, block: Array) -> None:
        if block.shape[1] == 0:  # decimation leaves nothing of a block of one sample
            return
        for band, sos in enumerate(self.sos):
            filtered, self.state[band] = signal.sosfilt(sos, block, axis=-1, zi=self.state[band])
            settled = filtered[:, max(0, self.skip[band] - self.seen) :]
            self.energy[:, band] += np.einsum("ij,ij->i", settled, settled)
            self.count[band] += settled.shape[1]
        self.seen += block.shape[1]

    def decimate(self, block: Array) -> Array:
        """Return every second low-passed sample, whatever the blocks' lengths.

        Every second tap of a half-band filter is 0 but for the middle one, which is odd: it alone meets odd samples.
        """
        data = np.concatenate((self._history, block), axis=1)
        self._history = data[:, data.shape[1] - (DECIMATOR_TAPS - 1) :]
        even, odd = (np.ascontiguousarray(data[:, self._phase + start :: 2]) for start in (0, 1))
        middle = (DECIMATOR_TAPS - 1) // 2
        n_out = (block.shape[1] - self._phase + 1) // 2
        self._phase = (self._phase + block.shape[1]) % 2
        out: Array = signal.upfirdn(self._taps[::2], even, 1, 1, axis=-1)[:, middle : middle + n_out]
        return out + self._taps[middle] * odd[:, middle // 2 : middle // 2 + n_out]


class ThirdOctaveMeter:
    """Takes blocks of samples and gathers the mean square in each third octave.

    The band filters are those of PyOctaveBand (Butterworth, order 6, class 1
    of IEC 61260-1). Octave by octave the signal is low-passed and halved in
    rate, so that low bands cost little and stay numerically sound.

    Parameters
    ----------
    sample_rate_hz : float
    n_channels : int
    n_samples : int
        Length of the record; bounds what is left out while filters settle.
    lowest_hz : float
        Nominal centre of the lowest band.
    """

    def __init__(self, sample_rate_hz: float, n_channels: int, n_samples: int, lowest_hz: float = 20.0) -> None:
        from pyoctaveband import getansifrequencies

        centre, low, high, _ = (np.array(values) for values in getansifrequencies(3, [lowest_hz * 0.99, 20500.0]))
        keep = high <= HIGHEST_EDGE * sample_rate_hz
        centre, low, high = centre[keep], low[keep], high[keep]
        if centre.size == 0:
            raise AnalysisError(f"a rate of {sample_rate_hz:g} Hz holds no third octave from {lowest_hz:g} Hz up")
        stage_of = np.maximum(0, np.floor(np.log2(STAGE_EDGE * sample_rate_hz / high))).astype(int)
        self._stages = []
        for index in range(int(stage_of.max()) + 1):
            chosen = centre[stage_of == index]
            limits = (float(chosen[0]) * 0.99, float(chosen[-1]) * 1.01) if chosen.size else None
            self._stages.append(_Stage(sample_rate_hz / 2**index, limits, n_channels, n_samples / 2**index))

    def take(self, block: Array) -> None:
        """Add samples, shape (n_channels, n), in order."""
        for index, stage in enumerate(self._stages):
            stage.measure(block)
            if index + 1 < len(self._stages):
                block = stage.decimate(block)

    def result(self) -> BandPowers:
        """Return the mean squares over all samples taken so far."""
        stages = self._stages[::-1]
        with np.errstate(invalid="ignore", divide="ignore"):
            mean_square = np.concatenate([stage.energy / stage.count for stage in stages], axis=1)
        return BandPowers(
            centre_hz=np.concatenate([stage.centre_hz for stage in stages]),
            nominal_hz=np.array([label for stage in stages for label in stage.nominal_hz]),
            mean_square=mean_square,
        )
