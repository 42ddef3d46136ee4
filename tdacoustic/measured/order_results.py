"""What the orders of a run are; frozen, so that the store can keep it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.orders import FixedFrequency, FrequencyCurve, NamedOrder, SidebandFamily

__all__ = ["Average", "ChannelOrders", "LevelMap", "OrderLevels", "RunOrders", "Sidebands", "Track"]

Array = NDArray[np.float64]
Single = NDArray[np.float32]


@dataclass(frozen=True)
class OrderLevels:
    """One order in one channel over classes of speed.

    Parameters
    ----------
    order : NamedOrder
    method : {"cut", "vold_kalman"}
    requested_bandwidth : float
        In orders of the reference shaft; of a filter what was advised, at the middle speed.
    bandwidth : ndarray, shape (n,)
        The actual one, 3 dB down of a filter.
    speeds_hz : ndarray, shape (n,)
        Of the reference shaft, means of the classes.
    mean_square : ndarray, shape (n,)
        Of the order: less the floor where it stands 6 dB over it; else all that is in the band, an upper bound.
    error, floor : ndarray, shape (n,)
        Standard error of `mean_square`, and what the floor has in the band.
    phase_rad, phase_error_rad : ndarray, shape (n,)
        Of a cosine against the angle's zero; NaN where it is not steady.
    steadiness : ndarray, shape (n,)
        Of the phase, 0 to 1.
    reasons : tuple of str, one a class
        Why a value is missing or doubtful; a missing one is NaN.
    """

    order: NamedOrder
    method: Literal["cut", "vold_kalman"]
    requested_bandwidth: float
    bandwidth: Array
    speeds_hz: Array
    mean_square: Array
    error: Array
    floor: Array
    phase_rad: Array
    phase_error_rad: Array
    steadiness: Array
    reasons: tuple[str, ...]

    @property
    def disturbed(self) -> NDArray[np.bool_]:
        """Whether another order or line lies in the band."""
        return np.array(["within the band" in reason for reason in self.reasons], dtype=bool)

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Whether the order itself was measured: a level that is no upper bound."""
        with np.errstate(invalid="ignore"):
            return np.isfinite(self.mean_square) & (self.mean_square >= 3.0 * self.floor)


@dataclass(frozen=True)
class Track:
    """One order in one channel over time, by Vold-Kalman filter; thinned where it is long.

    Parameters
    ----------
    order : NamedOrder
    bandwidth_hz : float
        From the order to where the filter is 3 dB down.
    notes : tuple of str
        On the choice of the bandwidth.
    times_s, speeds_hz : ndarray, shape (n,)
    amplitude : ndarray of complex, shape (n,)
        In rms; NaN where a reason says why.
    error : ndarray, shape (n,)
    reason : ndarray of int8, shape (n,)
        Index into `tdacoustic.orders.REASONS`.
    """

    order: NamedOrder
    bandwidth_hz: float
    notes: tuple[str, ...]
    times_s: Array
    speeds_hz: Array
    amplitude: NDArray[np.complex128]
    error: Array
    reason: NDArray[np.int8]


@dataclass(frozen=True)
class LevelMap:
    """Mean squares over rows of speed or time, and orders or Hz.

    Parameters
    ----------
    over : {"speed", "time"}
    domain : {"order", "frequency"}
    axis : ndarray, shape (n_cells,)
        Orders of the reference shaft, or Hz.
    times_s, speeds_hz : ndarray, shape (n_rows,)
    mean_square : ndarray of float32, shape (n_rows, n_cells)
        Of the strongest line of each cell, unit²; NaN beyond what the sampling rate holds.
    resolution, noise_bandwidth : float
        Line spacing, and the window's noise bandwidth, in orders or Hz.
    """

    over: Literal["speed", "time"]
    domain: Literal["order", "frequency"]
    axis: Array
    times_s: Array
    speeds_hz: Array
    mean_square: Single
    resolution: float
    noise_bandwidth: float


@dataclass(frozen=True)
class Sidebands:
    """A family of sidebands with the names of its carrier and of the shaft that spaces it."""

    carrier: str
    spacing: str
    family: SidebandFamily


@dataclass(frozen=True)
class Average:
    """Time-synchronous average of one shaft in one channel.

    Parameters
    ----------
    shaft : str
    ratio : float
        Turns of it for one of the reference shaft.
    periods : int
        Turns that were averaged.
    speed_hz : float
        Of this shaft.
    waveform, error : ndarray, shape (n,)
        Over one turn, and the standard error of each sample.
    residual_mean_square : float
        Of the signal less the average.
    """

    shaft: str
    ratio: float
    periods: int
    speed_hz: float
    waveform: Array
    error: Array
    residual_mean_square: float

    @property
    def amplitudes(self) -> NDArray[np.complex128]:
        """Complex rms amplitude of orders 0, 1, 2, ... of the shaft, phase of a cosine against the angle's zero."""
        lines = np.fft.rfft(self.waveform) * (np.sqrt(2.0) / self.waveform.size)
        lines[0] *= np.sqrt(0.5)
        if self.waveform.size % 2 == 0:
            lines[-1] *= np.sqrt(0.5)
        return lines

    @property
    def amplitude_error(self) -> float:
        """Standard error of each of them, the residual taken for scatter that is even over the orders."""
        return float(np.sqrt(np.mean(self.error**2) / self.waveform.size))


@dataclass(frozen=True)
class ChannelOrders:
    """The orders of one channel.

    Parameters
    ----------
    channel : str
    levels : tuple of OrderLevels
    tracks : tuple of Track
    maps : tuple of LevelMap
    fixed : tuple of FixedFrequency
        Resonances that orders pass, and lines that stay in Hz.
    sidebands : tuple of Sidebands
    averages : tuple of Average
    notes : tuple of str
        What could not be had of this channel, and why.
    """

    channel: str
    levels: tuple[OrderLevels, ...] = ()
    tracks: tuple[Track, ...] = ()
    maps: tuple[LevelMap, ...] = ()
    fixed: tuple[FixedFrequency, ...] = ()
    sidebands: tuple[Sidebands, ...] = ()
    averages: tuple[Average, ...] = ()
    notes: tuple[str, ...] = ()

    def map_over(self, over: str, domain: str) -> LevelMap | None:
        """Return one of its maps, or None."""
        return next((item for item in self.maps if (item.over, item.domain) == (over, domain)), None)


@dataclass(frozen=True)
class RunOrders:
    """The orders of one run.

    Parameters
    ----------
    shaft : str
        Reference shaft, of which orders and speeds are; empty where nobody names it.
    speed_source : str
        Channel that its angle is from, in words.
    steady : bool
    lowest_hz, highest_hz : float
        Its speed.
    requested_bandwidth, bandwidth : float
        Of the cuts, in orders.
    highest_order : float
    orders : tuple of NamedOrder
        All that were looked for, those that were found in the map too.
    curves : tuple of FrequencyCurve
    channels : tuple of ChannelOrders
    notes : tuple of str
        On speed and angle.
    """

    shaft: str
    speed_source: str
    steady: bool
    lowest_hz: float
    highest_hz: float
    requested_bandwidth: float
    bandwidth: float
    highest_order: float
    orders: tuple[NamedOrder, ...]
    curves: tuple[FrequencyCurve, ...]
    channels: tuple[ChannelOrders, ...]
    notes: tuple[str, ...] = ()

    def channel(self, name: str) -> ChannelOrders | None:
        """Return the orders of a channel, or None where it has none."""
        return next((item for item in self.channels if item.channel == name), None)
