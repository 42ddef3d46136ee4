"""A time signal resampled to even steps of a shaft's angle, with a low-pass that follows the speed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.speed.angle import ShaftAngle

__all__ = ["PASS_SHARE", "AngleResampler", "AngleSignal", "EvenBlock", "EvenTime", "plan_samples_per_turn"]

Array = NDArray[np.float64]

PASS_SHARE: Final = 0.4
"""Part of the coarser of the two sampling densities up to which a signal passes flat."""
HALF_WIDTH: Final = 15
"""Of the kernel, in steps of the coarser density."""
FINENESS: Final = 1024
"""Steps of the kernel's table between which it is taken as straight: an error below -120 dB."""
LEAST_SHARE: Final = 2.0**-13
"""Of the output's density over the sampling rate: below, at a crawl, the kernel no longer widens; it bounds memory."""
ATTENUATION_DB: Final = 92.0
"""Of the kernel's window; a design of this length allows 94.1 dB (J. F. Kaiser, ISCAS 1974)."""


@dataclass(frozen=True)
class EvenBlock:
    """Samples at even steps of an angle, or of time.

    Parameters
    ----------
    first : int
        Number of the first sample: it lies at ``first / per_unit`` turns (or seconds).
    per_unit : float
        Samples per turn, or per second.
    values : ndarray, shape (n_channels, n)
    times_s : ndarray, shape (n,)
        On the run's time axis.
    speeds_hz : ndarray, shape (n,)
        Turns per second.
    """

    first: int
    per_unit: float
    values: Array
    times_s: Array
    speeds_hz: Array


@dataclass(frozen=True)
class AngleSignal:
    """A whole signal over the angle of a shaft.

    Parameters
    ----------
    turns, times_s, speeds_hz : ndarray, shape (n,)
    values : ndarray, shape (n_channels, n)
    samples_per_turn : int
    highest_order : float
        Up to which the signal passed flat, where the sampling rate allowed it: see `AngleResampler.highest_order_at`.
    """

    turns: Array
    times_s: Array
    speeds_hz: Array
    values: Array
    samples_per_turn: int
    highest_order: float


def plan_samples_per_turn(highest_order: float) -> int:
    """Return samples per turn, the least even number for which an order passes flat.

    Raises
    ------
    AnalysisError
        An order that is not above zero.

    Examples
    --------
    >>> plan_samples_per_turn(100.0)
    250
    """
    if not (math.isfinite(highest_order) and highest_order > 0.0):
        raise AnalysisError(f"highest_order must be > 0, got {highest_order}")
    return max(8, 2 * math.ceil(0.5 * highest_order / PASS_SHARE - 1e-9))


@lru_cache(maxsize=1)
def _kernel_table() -> tuple[Array, Array]:
    """The kernel from its middle on and its rise to the next step; a windowed sinc, cut off at half the density."""
    steps = np.arange(HALF_WIDTH * FINENESS + 3) / FINENESS
    beta = 0.1102 * (ATTENUATION_DB - 8.7)
    window = np.i0(beta * np.sqrt(np.clip(1.0 - (steps / HALF_WIDTH) ** 2, 0.0, None))) / np.i0(beta)
    values = np.where(steps <= HALF_WIDTH, np.sinc(steps) * window, 0.0)
    return values[:-1].copy(), np.diff(values)


class AngleResampler:
    """Resamples blocks of a time signal to even steps of a shaft's angle.

    Each value is a windowed sinc over the samples around its instant. The kernel is as wide as the coarser of the two
    densities there, the sampling rate or the samples per turn times the speed: what lies above the angle's own limit is
    removed at each speed as it is there, and nothing is lost where the shaft turns faster.

    Orders up to `highest_order` pass within 0.01 dB, as long as they lie below 0.4 of the sampling rate; what would
    alias onto them is 80 dB down or more (the transition lies between 0.4 and 0.6 of the coarser density). The change
    of the speed over the 30 steps of a kernel is neglected. Values whose kernel reaches beyond the record, and those
    where the angle is not known, are left out; where the shaft slows down so fast that samples of a kernel are held no
    more, the value is NaN. At a crawl, below sampling rate / (8192 samples per turn) turns per
    second, the low-pass stays as it is.

    Parameters
    ----------
    angle : ShaftAngle
        Without breaks (`ShaftAngle.stretches`).
    sample_rate_hz : float
    highest_order : float
        Of this shaft, that has to pass flat.
    start_s : float
        Instant of the first sample on the run's time axis.
    samples_per_turn : int or None
        None plans them for the highest order.

    Raises
    ------
    AnalysisError
        An angle with breaks, or too few samples per turn for the highest order.

    Examples
    --------
    >>> angle = ShaftAngle([0.0, 1.0, 2.0], [0.0, 10.0, 20.0])
    >>> resampler = AngleResampler(angle, 1000.0, highest_order=4.0)
    >>> block = resampler.take(np.sin(2.0 * np.pi * 20.0 * np.arange(2000) / 1000.0)[None])  # order 2
    >>> block.per_unit, bool(np.allclose(block.values[0], np.sin(2.0 * np.pi * 20.0 * block.times_s), atol=1e-4))
    (10.0, True)
    """

    def __init__(
        self,
        angle: ShaftAngle,
        sample_rate_hz: float,
        highest_order: float,
        start_s: float = 0.0,
        samples_per_turn: int | None = None,
    ) -> None:
        if angle.breaks:
            raise AnalysisError(
                f"the angle of {angle.shaft or 'a shaft'} is not known from {angle.breaks[0][0]:.3f} s to "
                f"{angle.breaks[0][1]:.3f} s; resample its stretches one by one"
            )
        planned = plan_samples_per_turn(highest_order)
        if samples_per_turn is not None and samples_per_turn * PASS_SHARE < highest_order * (1.0 - 1e-9):
            raise AnalysisError(
                f"{samples_per_turn} samples per turn are too few for order {highest_order:g}; it takes {planned}"
            )
        self.angle = angle
        self.sample_rate_hz = sample_rate_hz
        self.highest_order = highest_order
        self.start_s = start_s
        self.samples_per_turn = planned if samples_per_turn is None else int(samples_per_turn)
        self._data: Array | None = None
        self._held_first = 0  # number of the first sample held
        self._next = math.ceil(float(angle.turns[0]) * self.samples_per_turn - 1e-9)
        self._last = math.floor(float(angle.turns[-1]) * self.samples_per_turn + 1e-9)
        self._begun = False

    def highest_order_at(self, speeds_hz: Array) -> Array:
        """Return the order up to which the signal is flat at a speed: the planned one, or 0.4 of the sampling rate."""
        with np.errstate(divide="ignore"):
            return np.minimum(self.highest_order, PASS_SHARE * self.sample_rate_hz / np.asarray(speeds_hz))

    def take(self, block: Array) -> EvenBlock:
        """Add samples, shape (n_channels, n), in order; return what they complete, perhaps nothing."""
        data = block if self._data is None else np.concatenate((self._data, block), axis=1)
        times, speeds = self._instants(data.shape[1])
        positions = (times - self.start_s) * self.sample_rate_hz - self._held_first
        shares = np.clip(self.samples_per_turn * speeds / self.sample_rate_hz, LEAST_SHARE, 1.0)
        reach = HALF_WIDTH / shares
        if not self._begun:
            late = np.flatnonzero(positions - reach >= 0.0)
            skipped = int(late[0]) if late.size else times.size
            self._next += skipped
            self._begun = bool(late.size)
            times, speeds, positions, shares, reach = (
                values[skipped:] for values in (times, speeds, positions, shares, reach)
            )
        unready = np.flatnonzero(positions + reach > data.shape[1] - 1)
        ready = int(unready[0]) if unready.size else times.size
        out = np.empty((data.shape[0], ready))
        if ready:
            from tdacoustic.orders.kernels import resample_rows

            contiguous = np.ascontiguousarray(data, dtype=np.float64)
            held = np.flatnonzero(positions[:ready] >= reach[:ready])
            # all, unless the shaft slows down so fast that a kernel would need samples that are held no more
            part = out if held.size == ready else np.empty((data.shape[0], held.size))
            if held.size:
                kernel = (*_kernel_table(), FINENESS, HALF_WIDTH)
                resample_rows(contiguous, positions[held], shares[held], *kernel, part)
            if part is not out:
                out[:] = np.nan
                out[:, held] = part
        result = EvenBlock(self._next, float(self.samples_per_turn), out, times[:ready], speeds[:ready])
        self._next += ready
        self._hold(data, positions[ready:] - reach[ready:])
        return result

    def _instants(self, held: int) -> tuple[Array, Array]:
        """Instants and speeds of the next samples in angle, up to the end of the data."""
        end_s = self.start_s + (self._held_first + held - 1) / self.sample_rate_hz
        if end_s <= self.angle.first_s or self._next > self._last:
            return np.zeros(0), np.zeros(0)
        end = self.angle.turns_at(min(end_s, self.angle.last_s))
        stop = min(self._last, math.floor(float(end) * self.samples_per_turn))
        times, speeds = np.empty(max(0, stop - self._next + 1)), np.empty(max(0, stop - self._next + 1))
        if times.size:
            from tdacoustic.orders.kernels import times_on_grid

            nodes = (self.angle.times_s, self.angle.turns, self.angle.slopes_hz)
            times_on_grid(self._next, self.samples_per_turn, *nodes, times, speeds)
        return times, speeds

    def _hold(self, data: Array, begins: Array) -> None:
        """Keep the samples that the kernels to come need."""
        if begins.size:
            first = int(np.floor(begins.min()))
        elif self._next > self._last:
            first = data.shape[1]
        else:  # the next value is not reached yet: keep what the kernel of the slowest speed around may need
            slowest = self._slowest(data.shape[1])
            first = data.shape[1] - math.ceil(HALF_WIDTH / slowest) - 2
        first = min(max(first, 0), data.shape[1])
        self._data = data[:, first:].copy()
        self._held_first += first

    def _slowest(self, held: int) -> float:
        """Least share of the densities at the nodes around the end of the data."""
        end_s = self.start_s + (self._held_first + held - 1) / self.sample_rate_hz
        node = int(np.searchsorted(self.angle.times_s, end_s))
        speed = float(np.min(self.angle.slopes_hz[max(0, node - 2) : node + 3], initial=np.inf))
        share = 0.5 * self.samples_per_turn * speed / self.sample_rate_hz
        return min(1.0, max(share, LEAST_SHARE))

    def signal(self, samples: Array, block_size: int = 1 << 18) -> AngleSignal:
        """Return a whole signal, shape (n_channels, n), over the angle; the resampler is spent after.

        Raises
        ------
        AnalysisError
            The angle and the samples have no time in common.
        """
        blocks = [self.take(samples[:, start : start + block_size]) for start in range(0, samples.shape[1], block_size)]
        blocks = [block for block in blocks if block.times_s.size]
        if not blocks:
            raise AnalysisError(
                f"the angle of {self.angle.shaft or 'a shaft'} is known from {self.angle.first_s:.3f} s to "
                f"{self.angle.last_s:.3f} s, the samples lie from {self.start_s:.3f} s to "
                f"{self.start_s + samples.shape[1] / self.sample_rate_hz:.3f} s: nothing to resample"
            )
        times = np.concatenate([block.times_s for block in blocks])
        return AngleSignal(
            turns=(blocks[0].first + np.arange(times.size)) / self.samples_per_turn,
            times_s=times,
            speeds_hz=np.concatenate([block.speeds_hz for block in blocks]),
            values=np.concatenate([block.values for block in blocks], axis=1),
            samples_per_turn=self.samples_per_turn,
            highest_order=self.highest_order,
        )


class EvenTime:
    """Puts a shaft's speed beside blocks of a time signal as it is, for maps over frequency.

    Parameters
    ----------
    angle : ShaftAngle
    sample_rate_hz : float
    start_s : float
        Instant of the first sample on the run's time axis.
    """

    def __init__(self, angle: ShaftAngle, sample_rate_hz: float, start_s: float = 0.0) -> None:
        self.angle, self.sample_rate_hz, self.start_s = angle, sample_rate_hz, start_s
        self._seen = 0

    def take(self, block: Array) -> EvenBlock:
        """Add samples, shape (n_channels, n), in order; return them. Speeds are NaN where they are not known."""
        offset = round(self.start_s * self.sample_rate_hz)
        times = self.start_s + (self._seen + np.arange(block.shape[1])) / self.sample_rate_hz
        speeds = _speeds_by_tens(self.angle, times)
        first, self._seen = offset + self._seen, self._seen + block.shape[1]
        return EvenBlock(first, self.sample_rate_hz, block, times, speeds)


def _speeds_by_tens(angle: ShaftAngle, times: Array, stride: int = 16) -> Array:
    """Speed at instants, taken at every sixteenth and held: it serves to sort frames by speed alone."""
    return np.repeat(angle.speed_hz_at(times[::stride]), stride)[: times.size]
