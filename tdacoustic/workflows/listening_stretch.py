"""Which seconds of a microphone are worth listening to, and which order to listen for in them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.measured.listening import MarkedOrder
from tdacoustic.measured.listening_step import OrderToTrack

if TYPE_CHECKING:
    from tdacoustic.attribution import SourceLine
    from tdacoustic.measured.hearing import Hearing
    from tdacoustic.measured.order_results import Track
    from tdacoustic.measured.runs import MeasuredRun
    from tdacoustic.recording import Channel
    from tdacoustic.workflows.second_pass import FirstPass, SecondPass

__all__ = ["line_of", "order_of", "sweeping_stretch", "typical_stretch"]

Array = NDArray[np.float64]

SWEPT: Final = 0.7
"""Part of the largest change of speed in any stretch that the chosen one has at least [assumed]."""
LEAST_BAND_HZ: Final = 2.0
BAND_SHARE: Final = 0.003
"""Bandwidth of an extracted line over its frequency, at least: the speed's scatter within an excerpt [assumed]."""
KEPT_APART: Final = 4.0
"""Distance to the next noise line over the bandwidth, at least: that line is then 24 dB down."""
NARROWEST_HZ: Final = 0.5
RATE_SHARE: Final = 1.0 / 70.0
"""Of the sampling rate, up to which the filter can be wide."""
STARTS: Final = 400
"""Stretches that are compared."""
OF_A_SHAFT: Final = frozenset({"mesh", "motor", "wheelset"})
"""Excitations whose frequency is proportional to the speed."""
COMPONENTS: Final = {"mesh": "gearbox", "motor": "motor", "inverter": "motor", "wheelset": "wheelset"}
"""Component whose order it is, by kind."""


def line_of(
    run: MeasuredRun, channel: Channel, source: SourceLine | None
) -> tuple[MarkedOrder | None, OrderToTrack | None]:
    """Return the line that led to the microphone, and how to follow it; both None without a line.

    Parameters
    ----------
    run : MeasuredRun
        A steady one that shows the line.
    channel : Channel
    source : SourceLine or None
    """
    if source is None or run.measurement is None:
        return None, None
    line = next(evidence.line for name, evidence in source.line.members if name == run.name)
    frequency_hz = line.frequency_hz
    result = run.measurement.channel(channel.name)
    others = [] if result is None else [abs(o.frequency_hz - frequency_hz) for o in result.lines]
    apart = min((distance for distance in others if distance > 0.5), default=math.inf)
    band = max(LEAST_BAND_HZ, BAND_SHARE * frequency_hz, 2.0 * line.width_hz)
    band = max(NARROWEST_HZ, min(band, apart / KEPT_APART, RATE_SHARE * channel.sample_rate_hz))
    motor_hz = run.motor_speed_hz
    order = frequency_hz / motor_hz if motor_hz else None
    leading = run.measurement.speed.leading
    follows = source.excitation in OF_A_SHAFT and leading is not None and not leading.stands and leading.mean > 0.0
    name = source.excitation_name or (f"order {order:.4g}" if order else "line")
    owner = None if source.source in ("unassigned", "ambiguous") else source.source
    marked = MarkedOrder(name, None if source.excitation == "inverter" else order, owner, frequency_hz, line.rms)
    if follows and leading is not None:
        return marked, OrderToTrack(leading.channel, frequency_hz / leading.mean, band)
    return marked, OrderToTrack(None, frequency_hz, band)


def order_of(
    run: MeasuredRun, channel: Channel, first: FirstPass, second: SecondPass
) -> tuple[MarkedOrder | None, OrderToTrack | None, Track | None]:
    """Return the strongest of the tracked orders of a run-up at the microphone, how to follow it, and its track.

    Parameters
    ----------
    run : MeasuredRun
    channel : Channel
    first : FirstPass
    second : SecondPass
    """
    from tdacoustic.workflows.order_tracking import order_tasks

    orders = second.of_kind("orders").get(run.name)
    held = None if orders is None else orders.channel(channel.name)
    if held is None or not held.tracks:
        return None, None, None
    track = max(held.tracks, key=lambda item: float(np.mean(_power(item))))
    task = order_tasks(first).get(run.name)
    if task is None:
        return None, None, None
    named, settings = track.order, task.settings
    marked = MarkedOrder(named.name, named.order, COMPONENTS.get(named.kind))
    band = min(track.bandwidth_hz, RATE_SHARE * channel.sample_rate_hz)
    return marked, OrderToTrack(settings.teller, settings.turns_per_unit * named.order, band), track


def _power(track: Track) -> Array:
    return np.abs(np.where(np.isin(track.reason, (0, 5, 6)), track.amplitude, 0.0)) ** 2


def _begins(channel: Channel, length_s: float) -> Array:
    """Where a stretch may begin, after the channel's first sample: not at the very ends where there is room."""
    room = channel.duration_s - length_s
    edge = 1.0 if room > 2.0 else 0.0
    return np.linspace(edge, room - edge, min(STARTS, max(1, int(50.0 * room)) + 1)) if room > 0.0 else np.zeros(1)


def typical_stretch(channel: Channel, length_s: float, hearing: Hearing | None) -> tuple[float, str]:
    """Return where the stretch begins whose A-weighted level is nearest to that of the whole record, and that in words.

    Stretches with missing samples come last; without levels over time it is the middle.

    Parameters
    ----------
    channel : Channel
    length_s : float
    hearing : Hearing or None

    Returns
    -------
    begin_s : float
        After the channel's first sample.
    words : str
    """
    begins = _begins(channel, length_s)
    history = None if hearing is None else hearing.levels(channel.name)
    middle = float(begins[begins.size // 2])
    if channel.duration_s <= length_s:
        return 0.0, "the whole record"
    if history is None:
        return middle, "the middle of the record"
    levels, index, _ = history
    ends = np.concatenate(([0.0], levels.ends_s))

    def within(values: Array) -> Array:
        """Integral of what is constant over each interval, by stretch."""
        sums = np.concatenate(([0.0], np.cumsum(values * np.diff(ends))))
        return np.interp(begins + length_s, ends, sums) - np.interp(begins, ends, sums)

    power, lost = within(levels.mean_square[index]), within(levels.missing[index].astype(float))
    mean = float(np.sum(levels.mean_square[index] * np.diff(ends))) / max(float(ends[-1]), 1e-12)
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = np.abs(np.log10(power / length_s / mean)) if mean > 0.0 else np.zeros(begins.size)
    apart = np.where(np.isfinite(apart), np.round(apart, 4), np.inf) + 10.0 * lost
    best = min(range(begins.size), key=lambda at: (apart[at], abs(begins[at] - middle)))
    return float(begins[best]), "the stretch whose A-weighted level is nearest to the whole record's"


def sweeping_stretch(run: MeasuredRun, channel: Channel, length_s: float, track: Track | None) -> tuple[float, str]:
    """Return where a stretch begins in which the speed changes, and that in words.

    Of those in which it changes by at least `SWEPT` of the most it is the one in which the order is the loudest.

    Parameters
    ----------
    run : MeasuredRun
    channel : Channel
    length_s : float
    track : Track or None

    Returns
    -------
    begin_s : float
        After the channel's first sample.
    words : str
    """
    assert run.measurement is not None
    begins = _begins(channel, length_s)
    profile = run.measurement.speed.leading
    if profile is None or channel.duration_s <= length_s:
        return (0.0, "the whole record") if channel.duration_s <= length_s else (float(begins[0]), "its beginning")
    at = channel.start_s + begins
    with np.errstate(invalid="ignore"):
        change = np.abs(profile.speed_at(at + length_s) - profile.speed_at(at))
    change = np.nan_to_num(change)
    if not change.max() > 0.0:
        return float(begins[begins.size // 2]), "the middle of the record"
    loud = np.zeros(begins.size)
    if track is not None:
        power = _power(track)
        sums = np.concatenate(([0.0], np.cumsum(power)))
        first, last = (np.searchsorted(track.times_s, edge) for edge in (at, at + length_s))
        loud = sums[last] - sums[first]
    allowed = change >= SWEPT * change.max()
    best = int(np.argmax(np.where(allowed, loud if loud.max() > 0.0 else change, -1.0)))
    what = ", where the order is the loudest" if loud.max() > 0.0 else ""
    return float(begins[best]), f"a stretch in which the speed changes{what}"
