"""Step: levels, spectra, lines and verdicts of a run from its survey."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tdacoustic.errors import AnalysisError
from tdacoustic.lines import Family, Line, find_families, find_lines, local_floor
from tdacoustic.measured.filter_dependence import beside_lines, beside_moving_lines
from tdacoustic.measured.results import Band, ChannelResult, RasterSurvey, RunMeasurement, RunSpeed, SegmentMap, Survey
from tdacoustic.quality import Statistics, Verdict, check_channel, check_duplicates, check_siblings, check_speed
from tdacoustic.recording import Channel, span_of
from tdacoustic.spectra import SegmentPowers, Spectrum, a_weighting_db, average_spectrum
from tdacoustic.steps import Step
from tdacoustic.units import level_db

__all__ = ["MEASUREMENT", "MeasurementSettings", "measure_run"]

MAP_FREQUENCIES = 400


@dataclass(frozen=True)
class MeasurementSettings:
    """What turns the survey of a run into its measurement.

    Parameters
    ----------
    channels : tuple of Channel
        All of the run.
    refused : tuple of (str, str)
        Channels that the run cannot give, and why.
    line_prominence_db, speed_tolerance, mains_hz : float
    level_band_hz : (float, float) or None
        None: 20 Hz to 0.4 of the sampling rate.
    stated : tuple of (str, float)
        Speeds of the campaign in SI: ``motor`` in 1/s, ``train`` in m/s.
    """

    channels: tuple[Channel, ...]
    refused: tuple[tuple[str, str], ...]
    line_prominence_db: float
    speed_tolerance: float
    mains_hz: float
    level_band_hz: tuple[float, float] | None
    stated: tuple[tuple[str, float], ...]


def measure_run(settings: MeasurementSettings, speed: RunSpeed, survey: Survey) -> RunMeasurement:
    """Step: levels, spectra, lines and verdicts of a run from its survey."""
    steady = speed.is_steady(settings.speed_tolerance)
    scatter = speed.scatter if steady else 0.0
    verdicts = [Verdict(name, "channel", "bad", reason) for name, reason in settings.refused]
    signals = [channel for channel in settings.channels if not channel.is_speed]
    verdicts += check_speed(
        speed.profiles,
        settings.speed_tolerance,
        dict(settings.stated),
        speed.problems,
        span_of(signals),
        None if speed.lines is None else speed.lines.reason,
    )
    results = []
    for channel in signals:
        raster, index = survey.of_channel(channel.name)
        result, found = _measure_channel(channel, raster, index, settings, steady, scatter)
        results.append(result)
        verdicts += found
    for raster in survey.rasters:
        held = [next(channel for channel in signals if channel.name == name) for name in raster.channels]
        verdicts += check_duplicates(held, raster.statistics)
    good = [(channel, result.rms) for channel, result in zip(signals, results, strict=True) if result.usable]
    verdicts += check_siblings([channel for channel, _ in good], [rms for _, rms in good])
    return RunMeasurement(replace(speed, angles=()), steady, tuple(results), tuple(verdicts))


def _measure_channel(
    channel: Channel, raster: RasterSurvey, index: int, settings: MeasurementSettings, steady: bool, scatter: float
) -> tuple[ChannelResult, tuple[Verdict, ...]]:
    statistics = raster.statistics
    rms = math.sqrt(max(0.0, float(np.nan_to_num(statistics.mean_square[index]))))
    low, high = settings.level_band_hz or (20.0, 0.4 * channel.sample_rate_hz)
    level_band = (low, min(high, 0.5 * channel.sample_rate_hz))
    average = _average(channel, raster.powers, index)
    lines: tuple[Line, ...] = ()
    families: tuple[Family, ...] = ()
    floor = None
    if average is not None and steady:
        lines = find_lines(average, settings.line_prominence_db, scatter)
        families = find_families(lines, average.resolution_hz)
        floor = local_floor(average)
    sought = lines if steady else None
    verdicts = _channel_verdicts(channel, statistics, raster.powers, average, index, sought, settings.mains_hz)
    usable = all(verdict.verdict != "bad" for verdict in verdicts) and average is not None
    result = ChannelResult(
        channel=channel.name,
        usable=usable,
        rms=rms,
        laeq_db=_laeq_db(channel, average, rms),
        band_rms=None if average is None else math.sqrt(average.mean_square(*level_band)),
        level_band_hz=level_band,
        spectrum=average if steady else None,
        floor=floor,
        lines=lines,
        families=families,
        map=None if steady or raster.powers is None else _segment_map(raster.powers, index),
        bands=_bands(raster, channel.name, lines, steady),
    )
    return result, verdicts


def _average(channel: Channel, powers: SegmentPowers | None, index: int) -> Spectrum | None:
    if powers is None:
        return None
    try:
        return average_spectrum(powers, index, channel.quantity, channel.si_symbol, channel.name)
    except AnalysisError:
        return None


def _channel_verdicts(
    channel: Channel,
    statistics: Statistics,
    powers: SegmentPowers | None,
    average: Spectrum | None,
    index: int,
    lines: Sequence[Line] | None,
    mains_hz: float,
) -> tuple[Verdict, ...]:
    if powers is None:
        words = f"{statistics.n_samples} samples are too short for a spectrum"
        return (Verdict(channel.name, "length", "bad", words),)
    averages = 0.0 if average is None else average.averages
    return check_channel(channel, statistics, powers, averages, index, lines, mains_hz)


def _laeq_db(channel: Channel, average: Spectrum | None, rms: float) -> float | None:
    """A-weighted level: the level of the whole record, corrected by the ratio of weighted to plain density."""
    level = level_db(rms, channel.quantity)
    if channel.quantity != "sound_pressure" or average is None or level is None:
        return None
    density = average.density[1:]
    weighted = float(np.sum(density * 10.0 ** (0.1 * a_weighting_db(average.frequencies_hz[1:]))))
    plain = float(np.sum(density))
    return level + 10.0 * math.log10(weighted / plain) if weighted > 0.0 else None


def _segment_map(powers: SegmentPowers, index: int) -> SegmentMap:
    density = powers.density[index]
    used = powers.frames[index] > 0
    frequencies = np.arange(powers.plan.n_frequencies) * powers.plan.resolution_hz
    edges = np.unique(np.linspace(1, frequencies.size, MAP_FREQUENCIES + 1).astype(int))
    cells = np.maximum.reduceat(density[used], edges[:-1], axis=1)
    centres = 0.5 * (frequencies[edges[:-1]] + frequencies[np.minimum(edges[1:], frequencies.size) - 1])
    return SegmentMap(powers.segment_times_s[used], centres, cells.T.astype(np.float64))


def _bands(raster: RasterSurvey, name: str, lines: Sequence[Line], steady: bool) -> tuple[Band, ...]:
    if raster.bands is None or name not in raster.band_channels:
        return ()
    mean_square = raster.bands.mean_square[raster.band_channels.index(name)]
    if steady or raster.powers is None:
        dependent = beside_lines(raster.bands.centre_hz, mean_square, lines)
    else:
        dependent = beside_moving_lines(raster.bands.centre_hz, mean_square, raster.powers, raster.channels.index(name))
    return tuple(
        Band(float(nominal), float(power), bool(flag))
        for nominal, power, flag in zip(raster.bands.nominal_hz, mean_square, dependent, strict=True)
        if math.isfinite(power)
    )


MEASUREMENT = Step("measurement", 6, measure_run, "Levels, spectra, lines and quality")
