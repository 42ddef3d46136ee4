"""Time-synchronous average of a shaft: what repeats every turn, and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.orders.resampling import EvenBlock

__all__ = ["SynchronousAverage", "SynchronousMeter"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SynchronousAverage:
    """Mean over the periods of a shaft.

    Parameters
    ----------
    turns : int
        Turns of a period.
    samples_per_turn : int
    mean : ndarray, shape (n_channels, n)
        Over one period; sample i lies at ``i / samples_per_turn`` turns after the angle's zero.
    error : ndarray, shape (n_channels, n)
        Standard error of each sample, from the scatter of the periods.
    periods : ndarray of int, shape (n_channels,)
        Averaged.
    residual_mean_square : ndarray, shape (n_channels,)
        Of the signal less the average, over the periods that were averaged.
    speed_hz : float
        Mean over them.
    """

    turns: int
    samples_per_turn: int
    mean: Array
    error: Array
    periods: NDArray[np.int64]
    residual_mean_square: Array
    speed_hz: float

    @property
    def orders(self) -> Array:
        """Orders of `amplitudes`, shape (n // 2 + 1,)."""
        return np.asarray(np.fft.rfftfreq(self.mean.shape[1], 1.0 / self.samples_per_turn), dtype=np.float64)

    @property
    def amplitudes(self) -> NDArray[np.complex128]:
        """Complex rms amplitude of each order (of the mean for order 0), phase of a cosine against the angle's zero."""
        lines = np.fft.rfft(self.mean, axis=1) * (np.sqrt(2.0) / self.mean.shape[1])
        lines[:, 0] *= np.sqrt(0.5)
        if self.mean.shape[1] % 2 == 0:
            lines[:, -1] *= np.sqrt(0.5)
        return lines

    def residual(self, block: EvenBlock) -> EvenBlock:
        """Return samples less the average."""
        at = (block.first + np.arange(block.times_s.size)) % self.mean.shape[1]
        return replace(block, values=block.values - self.mean[:, at])

    def only(self, orders: Sequence[float], half_width: float = 0.0) -> Array:
        """Return the part of the average that some orders make (the *regular* signal of gears), shape (n_channels, n).

        Parameters
        ----------
        orders : sequence of float
            Mesh orders and their multiples, say.
        half_width : float
            Orders beside each that count to it, sidebands included.
        """
        axis = self.orders
        kept = np.zeros(axis.size, dtype=bool)
        for order in orders:
            kept |= np.abs(axis - order) <= half_width + 1e-6
        return np.fft.irfft(np.fft.rfft(self.mean, axis=1) * kept, self.mean.shape[1], axis=1)

    def without(self, orders: Sequence[float], half_width: float = 0.0) -> Array:
        """Return the average less its regular signal (the *difference* signal), shape (n_channels, n)."""
        return self.mean - self.only(orders, half_width)


class SynchronousMeter:
    """Averages samples over the angle, period by period.

    Averaging over N periods is a comb filter: what is not a multiple of 1 / `turns` orders is lowered to 1 / N of its
    power where it is scatter, and a tone's rest depends on where it lies between the teeth of the comb (P. D. McFadden,
    Mech. Syst. Signal Process. 1 (1987) 83).

    Parameters
    ----------
    samples_per_turn : int
    n_channels : int
    turns : int
        Of a period: the hunting-tooth period of a pair, or 1.
    speeds_hz : (float, float)
        Periods whose mean speed lies outside are left out.
    """

    def __init__(
        self,
        samples_per_turn: int,
        n_channels: int,
        turns: int = 1,
        speeds_hz: tuple[float, float] = (0.0, np.inf),
    ) -> None:
        if turns < 1 or samples_per_turn < 2:
            raise AnalysisError(f"turns must be >= 1 and samples_per_turn >= 2, got {turns} and {samples_per_turn}")
        self.turns, self.samples_per_turn, self._speeds_hz = turns, samples_per_turn, speeds_hz
        self._size = turns * samples_per_turn
        self._mean, self._spread = np.zeros((n_channels, self._size)), np.zeros((n_channels, self._size))
        self._count = np.zeros(n_channels, dtype=np.int64)
        self._speed, self._periods = 0.0, 0
        self._values, self._block_speeds = np.zeros((n_channels, 0)), np.zeros(0)

    def take(self, block: EvenBlock) -> None:
        """Add samples, in order."""
        values, speeds = block.values, block.speeds_hz
        if not self._values.shape[1]:
            skip = (-block.first) % self._size  # a period begins at a whole number of periods after the angle's zero
            if skip >= speeds.size:
                return
            values, speeds = values[:, skip:], speeds[skip:]
        values = np.concatenate((self._values, values), axis=1)
        speeds = np.concatenate((self._block_speeds, speeds))
        whole = speeds.size // self._size
        for index in range(whole):
            span = slice(index * self._size, (index + 1) * self._size)
            self._take_period(values[:, span], float(np.mean(speeds[span])))
        self._values, self._block_speeds = values[:, whole * self._size :].copy(), speeds[whole * self._size :].copy()

    def _take_period(self, values: Array, speed_hz: float) -> None:
        if not self._speeds_hz[0] <= speed_hz <= self._speeds_hz[1]:
            return
        good = np.isfinite(values).all(axis=1)
        self._count[good] += 1
        apart = values[good] - self._mean[good]
        self._mean[good] += apart / self._count[good, None]
        self._spread[good] += apart * (values[good] - self._mean[good])
        self._speed, self._periods = self._speed + speed_hz, self._periods + 1

    def result(self) -> SynchronousAverage:
        """Return the average.

        Raises
        ------
        AnalysisError
            Fewer than two periods in a channel.
        """
        if np.any(self._count < 2):
            channel = int(np.argmin(self._count))
            raise AnalysisError(
                f"{self._count[channel]} whole periods of {self.turns} turns are too few for a synchronous average of "
                f"channel {channel}; it takes at least 2"
            )
        count = self._count[:, None]
        return SynchronousAverage(
            turns=self.turns,
            samples_per_turn=self.samples_per_turn,
            mean=self._mean.copy(),
            error=np.sqrt(self._spread / (count - 1) / count),
            periods=self._count.copy(),
            residual_mean_square=np.mean(self._spread / (count - 1), axis=1),
            speed_hz=self._speed / self._periods,
        )
