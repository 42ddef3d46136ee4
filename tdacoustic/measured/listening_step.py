"""Step: a few seconds of a microphone at a rate that browsers play, and one order of it by itself.

Only the samples of the excerpt and a margin for the filters are read.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.formats import scan
from tdacoustic.measured.listening import Excerpt, ExtractedOrder
from tdacoustic.measured.results import RunSpeed
from tdacoustic.orders import TrackedOrder, VoldKalman
from tdacoustic.recording import Channel, Recording
from tdacoustic.speed import ShaftAngle
from tdacoustic.steps import LogFile, Step

__all__ = ["LISTENING", "PLAYED_HZ", "ListeningSettings", "OrderToTrack", "cut_excerpt", "margin_s"]

Array = NDArray[np.float64]

PLAYED_HZ: Final = 32000
"""Sampling rate of excerpts: of those that MPEG-1 layer III has, the lowest; it holds what is heard up to 15 kHz."""
PASSED: Final = 0.45
"""Part of the slower sampling rate up to which the resampling filter passes all: 0.1 dB down there."""
LARGEST_RATIO: Final = 4000
"""Of the resampling; a rate that needs a larger one is off by less than 1e-7."""
CURVE_POINTS: Final = 241
"""At which the order's frequency is kept."""


@dataclass(frozen=True)
class OrderToTrack:
    """The carrier of the order to extract.

    Parameters
    ----------
    teller : str or None
        Channel whose speed or angle it follows; None: it stays at one frequency.
    ratio : float
        Turns of the order for one of the teller's (or for a metre of the train); without a teller its frequency in Hz.
    bandwidth_hz : float
    """

    teller: str | None
    ratio: float
    bandwidth_hz: float


@dataclass(frozen=True)
class ListeningSettings:
    """Which stretch of which microphone.

    Parameters
    ----------
    channel : Channel
        As read, cut to what the filters need.
    first_s, last_s : float
        The excerpt, on the run's time axis.
    order : OrderToTrack or None
    """

    channel: Channel
    first_s: float
    last_s: float
    order: OrderToTrack | None = None


def cut_excerpt(settings: ListeningSettings, logs: tuple[LogFile, ...], speed: RunSpeed) -> Excerpt:
    """Step: read an excerpt, resample it, extract the order.

    Raises
    ------
    AnalysisError
        Nothing but missing samples.
    """
    channel = settings.channel
    samples = Recording("run", tuple(scan(log.path) for log in logs), (channel,)).samples(channel.name)
    missing = ~np.isfinite(samples)
    if missing.all():
        raise AnalysisError(f"channel {channel.name!r} has no samples from {settings.first_s:.2f} s on")
    mean = float(np.mean(samples[~missing]))
    samples = np.where(missing, 0.0, samples - mean)
    times = settings.first_s + np.arange(int((settings.last_s - settings.first_s) * PLAYED_HZ)) / PLAYED_HZ
    resampled = _resampled(samples, channel, times)
    times = times[: resampled.size]
    order, why = None, None
    if settings.order is not None:
        try:
            order = _extracted(samples, channel, _carrier(settings, speed), settings.order.bandwidth_hz, times)
        except AnalysisError as error:
            why = str(error)
    inside = slice(*np.searchsorted(_instants(channel), [settings.first_s, settings.last_s]))
    return Excerpt(
        channel=channel.name,
        sample_rate_hz=float(PLAYED_HZ),
        first_s=settings.first_s,
        samples=resampled.astype(np.float32),
        highest_hz=PASSED * min(channel.sample_rate_hz, PLAYED_HZ),
        n_missing=int(np.count_nonzero(missing[inside])),
        order=order,
        no_order=why,
    )


def _instants(channel: Channel) -> Array:
    return channel.start_s + np.arange(channel.n_samples) / channel.sample_rate_hz


def _resampled(samples: Array, channel: Channel, times: Array) -> Array:
    """The samples at the instants, which lie within them; the first instant on a sample."""
    from scipy import signal

    ratio = Fraction(PLAYED_HZ / channel.sample_rate_hz).limit_denominator(LARGEST_RATIO)
    first = round((times[0] - channel.start_s) * channel.sample_rate_hz)
    # whole periods of the ratio before the first instant, so that one of the new samples falls on it
    start = first % ratio.denominator
    resampled = signal.resample_poly(samples[start:], ratio.numerator, ratio.denominator)
    skip = (first - start) // ratio.denominator * ratio.numerator
    return np.asarray(resampled[skip : skip + times.size])


def _carrier(settings: ListeningSettings, speed: RunSpeed) -> ShaftAngle:
    """Angle that turns once in a period of the order."""
    order, channel = settings.order, settings.channel
    assert order is not None
    if order.teller is None:
        times = channel.start_s + np.linspace(-1.0, channel.duration_s + 1.0, 3)
        return ShaftAngle(times, order.ratio * (times - times[0]))
    held = next((angle for angle in speed.angles if angle.channel == order.teller), None)
    if held is not None:
        return held.at_ratio(order.ratio)
    profile = next((profile for profile in speed.profiles if profile.channel == order.teller), None)
    if profile is None:
        raise AnalysisError(f"channel {order.teller!r} gives no speed")
    return ShaftAngle.from_profile(profile, order.ratio)


def _extracted(
    samples: Array, channel: Channel, carrier: ShaftAngle, bandwidth_hz: float, times: Array
) -> ExtractedOrder:
    tracker = VoldKalman([TrackedOrder(carrier, 1.0, bandwidth_hz)], channel.sample_rate_hz, start_s=channel.start_s)
    (track,) = tracker.whole(samples[None])
    waveform = track.waveform(times)[0]
    known = np.isfinite(waveform)
    if np.count_nonzero(known) < 0.5 * known.size:
        raise AnalysisError("its frequency is not known over most of the excerpt")
    grid = np.linspace(times[0], times[-1], CURVE_POINTS)
    return ExtractedOrder(
        samples=np.where(known, waveform, 0.0).astype(np.float32),
        times_s=grid - times[0],
        frequency_hz=carrier.speed_hz_at(grid),
        bandwidth_hz=bandwidth_hz,
    )


def margin_s(bandwidth_hz: float | None) -> float:
    """Return the time before and after an excerpt that the filters need."""
    reach = 0.05 if bandwidth_hz is None else 1.5 / bandwidth_hz
    return min(2.0, max(0.05, reach)) if math.isfinite(reach) else 0.05


LISTENING = Step("listening", 1, cut_excerpt, "Excerpts to listen to")
