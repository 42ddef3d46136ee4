"""Checks of signal channels, each from what one pass over the samples has shown.

The limits are assumed: they come from practice, not from a standard, and are
named here so that they can be questioned.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from tdacoustic.lines import Line
from tdacoustic.quality.statistics import Statistics
from tdacoustic.quality.verdict import Verdict
from tdacoustic.recording import Channel
from tdacoustic.spectra import SegmentPowers
from tdacoustic.units import level_db

__all__ = ["PLAUSIBLE_RMS", "check_channel", "check_duplicates", "check_siblings"]

MISSING_BAD = 0.01
"""Part of the samples that may be missing before a channel is unusable."""
CLIPPED_BAD = 0.01
"""Part of the samples that may be clipped before a channel is unusable."""
CLIPPED_WARN = 3
"""Samples at the logger's limit, or on a plateau at the extreme, from which clipping is said."""
FLAT_BAD = 0.5
"""Part of the record that may be flat before a channel is unusable."""
OFFSET_OVER_RMS = 2.0
DRIFT_OVER_RMS = 1.0
HUM_PROMINENCE_DB = 10.0
HUM_HARMONICS = 6
MIN_AVERAGES = 4.0
DUPLICATE_CORRELATION = 0.99999
FACTOR_TEN_DB = (17.0, 23.0)
"""Distance of a channel from its like that looks like a factor of ten in the sensitivity."""

PLAUSIBLE_RMS = {
    "sound_pressure": (2e-4, 2e3),  # 20 dB, 160 dB: self-noise of a good microphone; beyond a measuring microphone
    "acceleration": (1e-4, 5e3),  # m/s²: noise of an industrial accelerometer; 500 g
    "force": (1e-6, 1e7),
    "torque": (1e-6, 1e6),
}
"""Plausible rms of a signal on a drive, in SI."""


def check_channel(
    channel: Channel,
    statistics: Statistics,
    powers: SegmentPowers,
    averages: float,
    index: int,
    lines: Sequence[Line] | None,
    mains_hz: float,
) -> tuple[Verdict, ...]:
    """Return one verdict a check for a signal channel.

    Parameters
    ----------
    channel : Channel
    statistics, powers : Statistics, SegmentPowers
        Of the channel's raster.
    averages : float
        Independent averages of its spectrum; 0 where no frame is without missing values.
    index : int
        Its place in them.
    lines : sequence of Line or None
        Of its averaged spectrum; None for a run-up, which is not looked at for hum.
    mains_hz : float
    """
    rms = math.sqrt(max(0.0, float(np.nan_to_num(statistics.mean_square[index]))))
    found = [
        *_log_flags(channel),
        _missing(channel, statistics, index, averages),
        _clipping(channel, statistics, index),
        _flat(channel, statistics, index),
        _offset(channel, statistics, index, rms),
        _drift(channel, powers, index, rms),
        _level(channel, rms),
        _length(channel, powers, averages),
    ]
    if lines is not None and mains_hz:
        found.append(_hum(channel, lines, mains_hz))
    return tuple(found)


def _log_flags(channel: Channel) -> Iterator[Verdict]:
    for flag in channel.flags:
        yield Verdict(channel.name, "log", "warning", flag)


def _missing(channel: Channel, statistics: Statistics, index: int, averages: float) -> Verdict:
    count, total = int(statistics.missing[index]), statistics.n_samples
    if count == 0:
        return Verdict(channel.name, "missing values", "ok", "none")
    words = f"{count} of {total} samples are no numbers (NaN or infinite)"
    if averages == 0.0:
        return Verdict(channel.name, "missing values", "bad", f"{words}; no frame is without them")
    words += "; frames that hold them are left out, and there are no third octaves"
    return Verdict(channel.name, "missing values", "bad" if count > MISSING_BAD * total else "warning", words)


def _clipping(channel: Channel, statistics: Statistics, index: int) -> Verdict:
    at_limits, plateau = int(statistics.at_limits[index]), int(statistics.plateau[index])
    count = max(at_limits, plateau)
    if count < CLIPPED_WARN:
        return Verdict(channel.name, "clipping", "ok", "no plateau at the extremes")
    part = count / max(1, statistics.n_samples)
    where = "at the logger's limit" if at_limits >= plateau else "on plateaus at the record's extremes"
    extremes = f"{statistics.minimum[index]:.4g} to {statistics.maximum[index]:.4g} {channel.si_symbol}"
    return Verdict(
        channel.name,
        "clipping",
        "bad" if part > CLIPPED_BAD else "warning",
        f"{count} samples ({100 * part:.3g} %) {where} ({extremes})",
    )


def _flat(channel: Channel, statistics: Statistics, index: int) -> Verdict:
    flat = int(statistics.flat_samples[index])
    if flat == 0:
        return Verdict(channel.name, "dropouts", "ok", "no flat stretch")
    part = flat / max(1, statistics.n_samples)
    longest_s = float(statistics.longest_flat[index]) / channel.sample_rate_hz
    return Verdict(
        channel.name,
        "dropouts",
        "bad" if part > FLAT_BAD else "warning",
        f"{100 * part:.3g} % of the record stands still; the longest stretch is {longest_s:.3g} s",
    )


def _offset(channel: Channel, statistics: Statistics, index: int, rms: float) -> Verdict:
    mean = float(statistics.mean[index])
    if math.isfinite(mean) and abs(mean) > OFFSET_OVER_RMS * rms and rms > 0.0:
        return Verdict(
            channel.name,
            "offset",
            "warning",
            f"mean {mean:.4g} {channel.si_symbol} is {abs(mean) / rms:.2g} times the rms; it is taken off",
        )
    return Verdict(channel.name, "offset", "ok", f"mean {mean:.3g} {channel.si_symbol}")


def _drift(channel: Channel, powers: SegmentPowers, index: int, rms: float) -> Verdict:
    means = powers.means[index]
    means = means[np.isfinite(means)]
    span = float(np.ptp(means)) if means.size > 1 else 0.0
    if span > DRIFT_OVER_RMS * rms > 0.0:
        return Verdict(
            channel.name,
            "drift",
            "warning",
            f"the mean wanders by {span:.3g} {channel.si_symbol}, the rms is {rms:.3g}",
        )
    return Verdict(channel.name, "drift", "ok", f"the mean wanders by {span:.3g} {channel.si_symbol}")


def _level(channel: Channel, rms: float) -> Verdict:
    if rms == 0.0:
        return Verdict(channel.name, "level", "bad", "no signal: the rms is zero")
    level = level_db(rms, channel.quantity)
    words = f"rms {rms:.4g} {channel.si_symbol}" + (f", {level:.1f} dB" if level is not None else "")
    low, high = PLAUSIBLE_RMS.get(channel.quantity, (0.0, math.inf))
    if rms < low or rms > high:
        side = "low" if rms < low else "high"
        return Verdict(channel.name, "level", "warning", f"{words}: implausibly {side}; check sensitivity and unit")
    return Verdict(channel.name, "level", "ok", words)


def _length(channel: Channel, powers: SegmentPowers, averages: float) -> Verdict:
    plan = powers.plan
    words = (
        f"{channel.duration_s:.4g} s, {averages:.3g} independent averages at {plan.resolution_hz:.4g} Hz line spacing"
    )
    if plan.resolution_hz > 1.05 * plan.requested_resolution_hz:
        asked = f"the record is shorter than one frame of {1.0 / plan.requested_resolution_hz:.3g} s"
        return Verdict(channel.name, "length", "warning", f"{words}: {asked}")
    if averages < MIN_AVERAGES:
        return Verdict(channel.name, "length", "warning", f"{words}: few for a spectrum, levels of noise scatter")
    return Verdict(channel.name, "length", "ok", words)


def _hum(channel: Channel, lines: Sequence[Line], mains_hz: float) -> Verdict:
    hits = []
    for harmonic in range(1, HUM_HARMONICS + 1):
        target = harmonic * mains_hz
        for line in lines:
            tolerance = max(0.004 * target, 3.0 * line.frequency_error_hz)  # grid frequency within ±0.2 Hz of 50 Hz
            if abs(line.frequency_hz - target) <= tolerance and line.prominence_db >= HUM_PROMINENCE_DB:
                hits.append((harmonic, line))
    if any(harmonic == 1 for harmonic, _ in hits) or len({harmonic for harmonic, _ in hits}) >= 2:
        words = ", ".join(f"{line.frequency_hz:.1f} Hz ({line.prominence_db:.0f} dB)" for _, line in hits)
        return Verdict(
            channel.name, "mains hum", "warning", f"lines over the floor at multiples of {mains_hz:g} Hz: {words}"
        )
    return Verdict(channel.name, "mains hum", "ok", f"no line at {mains_hz:g} Hz")


def check_duplicates(channels: Sequence[Channel], statistics: Statistics) -> tuple[Verdict, ...]:
    """Return a warning for each pair of channels of one raster that carry the same signal."""
    found = []
    for first in range(len(channels)):
        for second in range(first + 1, len(channels)):
            correlation = float(statistics.correlation[first, second])
            if channels[first].quantity == channels[second].quantity and abs(correlation) >= DUPLICATE_CORRELATION:
                sign = " with the sign turned" if correlation < 0.0 else ""
                found.append(
                    Verdict(
                        channels[second].name,
                        "duplicate",
                        "warning",
                        f"the same signal as channel {channels[first].name!r}{sign} (correlation {correlation:.7f})",
                    )
                )
    return tuple(found)


def check_siblings(channels: Sequence[Channel], rms: Sequence[float]) -> tuple[Verdict, ...]:
    """Return a warning for each channel that differs from its like by about a factor of ten.

    Like are channels of one quantity, component, drive and role, and microphones
    at one distance; each is held against the median of the others.
    """
    groups: dict[tuple[object, ...], list[int]] = {}
    for index, channel in enumerate(channels):
        if channel.component is not None and level_db(rms[index], channel.quantity) is not None:
            key = (channel.quantity, channel.component, channel.drive, channel.role, channel.distance_m)
            groups.setdefault(key, []).append(index)
    found = []
    for members in groups.values():
        for index in members:
            others = [20.0 * math.log10(rms[other]) for other in members if other != index]
            if not others:
                continue
            distance = 20.0 * math.log10(rms[index]) - float(np.median(others))
            if FACTOR_TEN_DB[0] <= abs(distance) <= FACTOR_TEN_DB[1]:
                names = ", ".join(channels[other].name for other in members if other != index)
                found.append(
                    Verdict(
                        channels[index].name,
                        "sensitivity",
                        "warning",
                        f"{distance:+.1f} dB against {names}: a factor of ten in a sensitivity?",
                    )
                )
    return tuple(found)
