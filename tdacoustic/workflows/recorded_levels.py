"""Levels of a campaign's steady recordings as data of a calibration: at 4 m, at its receivers, in third octaves."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

from tdacoustic.measured.levels import energy_mean_db
from tdacoustic.measured.mean_levels import MeanLevel, RecordedLevels, mean_levels
from tdacoustic.units import level_db
from tdacoustic.workflows.usable_recordings import SURFACE_M, UsableRecordings, WantedScatter

if TYPE_CHECKING:
    from tdacoustic.drive import Condition, Receiver
    from tdacoustic.fitting.measured_level import MeasuredLevel

__all__ = ["band_edges_hz", "band_levels", "receiver_levels", "surface_levels"]

LOWEST_BAND_HZ: Final = 20.0

Conditions: TypeAlias = "Mapping[str, Condition]"
Found: TypeAlias = "tuple[list[MeasuredLevel], list[str]]"
"""Data, and what could not be used in words."""


class _Level(NamedTuple):
    """A level of a run at a receiver."""

    condition: str
    run: str
    receiver: str
    level_db: float


def surface_levels(usable: UsableRecordings, conditions: Conditions) -> Found:
    """Return the 4 m level of each condition: the energy mean over its runs and its receivers near 4 m.

    Its standard deviation contains the scatter over the receivers, because the model's 4 m level is the mean over a
    whole sphere.

    Parameters
    ----------
    usable : UsableRecordings
    conditions : mapping of str to Condition
    """
    levels, doubts = _overall(usable, conditions, usable.near)
    means = _means(usable, levels, True, _record_sigmas(usable, {None: levels}))
    return [_datum(usable, conditions[name], _surface(), mean) for name, mean in means.items()], doubts


def receiver_levels(usable: UsableRecordings, conditions: Conditions, places: Mapping[str, Receiver]) -> Found:
    """Return the level of each condition at each microphone of role receiver, at its own place.

    Parameters
    ----------
    usable : UsableRecordings
    conditions : mapping of str to Condition
    places : mapping of str to Receiver
        Of microphones, by channel.
    """
    channels = [name for name, channel in usable.microphones.items() if channel.role == "receiver"]
    levels, doubts = _overall(usable, conditions, channels)
    sigmas = _record_sigmas(usable, {None: levels})
    data = []
    for channel in channels:
        if channel not in places:
            doubts.append(f"channel {channel} is a receiver without position_m or distance_m: it has no place")
            continue
        means = _means(usable, [level for level in levels if level.receiver == channel], False, sigmas)
        data += [_datum(usable, conditions[name], places[channel], mean) for name, mean in means.items()]
    return data, doubts


def band_levels(usable: UsableRecordings, conditions: Conditions, highest_hz: float) -> Found:
    """Return the third-octave levels of each condition at 4 m, from 20 Hz up to a frequency.

    Left out are levels that a strong line in a neighbouring band decides, those within 3 dB of the background, and
    those that ``[[exclude]]`` touches; the others are corrected for background band by band.

    Parameters
    ----------
    usable : UsableRecordings
    conditions : mapping of str to Condition
    highest_hz : float
        Upper edge of the highest band, at most.
    """
    held, left_out = _bands(usable, conditions, highest_hz)
    doubts = list(usable.doubts_of(usable.near))
    if left_out:
        words = ", ".join(f"{count} {reason}" for reason, count in left_out.items())
        doubts.append(f"third-octave levels of single runs and receivers left out: {words}")
    sigmas = _record_sigmas(usable, {band_edges_hz(nominal_hz): levels for nominal_hz, levels in held.items()})
    data: list[MeasuredLevel] = []
    for nominal_hz, levels in sorted(held.items()):
        edges_hz = band_edges_hz(nominal_hz)
        what = f"1/3 octave {nominal_hz:g} Hz"
        for name, mean in _means(usable, levels, True, sigmas, edges_hz).items():
            data.append(_datum(usable, conditions[name], _surface(), mean, what, edges_hz))
    return data, doubts


def band_edges_hz(nominal_hz: float) -> tuple[float, float]:
    """Return the edges of a third octave of a nominal frequency (IEC 61260-1, base ten).

    Examples
    --------
    >>> [round(edge, 2) for edge in band_edges_hz(1000.0)]
    [891.25, 1122.02]
    """
    number = round(10.0 * math.log10(nominal_hz / 1000.0))
    return 1000.0 * 10.0 ** (0.1 * number - 0.05), 1000.0 * 10.0 ** (0.1 * number + 0.05)


def _surface() -> Receiver:
    from tdacoustic.drive import Receiver

    return Receiver(f"{SURFACE_M:g} m", SURFACE_M)


def _datum(
    usable: UsableRecordings,
    condition: Condition,
    receiver: Receiver,
    mean: MeanLevel,
    what: str = "overall",
    band_hz: tuple[float, float] | None = None,
) -> MeasuredLevel:
    from tdacoustic.fitting.measured_level import MeasuredLevel

    return MeasuredLevel(
        condition=condition,
        receiver=receiver,
        level_db=mean.level_db,
        sigma_db=mean.sigma_db,
        weighting="Z",
        origin=usable.campaign.origin,
        source=f"recordings, {mean.words}",
        what=what,
        band_hz=band_hz,
    )


def _overall(
    usable: UsableRecordings, conditions: Conditions, channels: Iterable[str]
) -> tuple[list[_Level], list[str]]:
    """Overall levels of the steady runs, corrected for background where that can be."""
    wanted = set(channels)
    doubts = list(usable.doubts_of(wanted))
    levels = []
    steady = usable.steady
    table = usable.analysis.tables["levels"]
    for row in table[table["level_db"].notna() & table["channel"].isin(wanted)].itertuples():
        if row.run not in steady or row.condition not in conditions or usable.is_bad(row.run, row.channel):
            continue
        if row.correction == "impossible":
            doubts.append(
                f"run {row.run}, channel {row.channel}: less than 3 dB above the background, so its level is an upper "
                "bound and does not feed the calibration"
            )
            continue
        levels.append(_Level(row.condition, row.run, row.channel, float(row.level_db)))
    return levels, doubts


def _record_sigmas(
    usable: UsableRecordings, by_band: Mapping[tuple[float, float] | None, list[_Level]]
) -> dict[WantedScatter, float]:
    """What the records themselves show of their levels; asked only where no condition has two runs."""
    wanted: list[WantedScatter] = []
    for band_hz, levels in by_band.items():
        runs = {(level.condition, level.run) for level in levels}
        if len(runs) == len({condition for condition, _ in runs}):
            wanted += [(level.run, level.receiver, band_hz) for level in levels]
    return usable.record_sigmas_db(wanted)


def _means(
    usable: UsableRecordings,
    levels: Iterable[_Level],
    over_receivers: bool,
    sigmas: Mapping[WantedScatter, float],
    band_hz: tuple[float, float] | None = None,
) -> dict[str, MeanLevel]:
    """Mean levels by condition."""
    by_condition: dict[str, dict[tuple[str, str], float]] = {}
    for level in levels:
        by_condition.setdefault(level.condition, {})[level.run, level.receiver] = level.level_db
    by_place = {(run, receiver): sigma for (run, receiver, band), sigma in sigmas.items() if band == band_hz}
    recorded = {name: RecordedLevels(held, by_place) for name, held in by_condition.items()}
    return mean_levels(recorded, usable.level_sigma_db, over_receivers)


def _bands(
    usable: UsableRecordings, conditions: Conditions, highest_hz: float
) -> tuple[dict[float, list[_Level]], Counter[str]]:
    """Third-octave levels by band, and how many were left out why."""
    from tdacoustic.spectra import correct_for_background

    found: dict[float, list[_Level]] = {}
    left_out: Counter[str] = Counter()
    steady, near = usable.steady, set(usable.near)
    table = usable.analysis.tables["bands"]
    background = _background(usable)
    for row in table[table["level_db"].notna() & table["channel"].isin(near)].itertuples():
        edges_hz = band_edges_hz(row.band_hz)
        inside = row.band_hz >= LOWEST_BAND_HZ and edges_hz[1] <= highest_hz
        if not inside or row.run not in steady or row.condition not in conditions:
            continue
        if usable.is_bad(row.run, row.channel):
            continue
        if row.filter_dependent:
            left_out["decided by a strong line beside the band"] += 1
        elif usable.is_excluded(row.condition, row.channel, edges_hz):
            left_out["excluded by the campaign"] += 1
        else:
            outcome = correct_for_background(float(row.level_db), background(row.condition, row.channel, row.band_hz))
            if outcome.kind == "impossible":
                left_out["less than 3 dB above the background"] += 1
            else:
                level = _Level(row.condition, row.run, row.channel, outcome.level_db)
                found.setdefault(float(row.band_hz), []).append(level)
    return found, left_out


def _background(usable: UsableRecordings) -> Callable[[str, str, float], float | None]:
    """Band levels of the background runs: those of the condition where it has its own, else those of all."""
    found: dict[tuple[str | None, str, float], list[float]] = {}
    for run in usable.analysis.runs:
        if run.run.kind != "background" or run.measurement is None:
            continue
        for result in run.measurement.channels:
            for band in result.bands if result.usable else ():
                value = level_db(math.sqrt(band.mean_square), "sound_pressure")
                if value is not None:
                    found.setdefault((run.run.condition, result.channel, band.nominal_hz), []).append(value)

    def level_of(condition: str, channel: str, nominal_hz: float) -> float | None:
        own = found.get((condition, channel, nominal_hz))
        return energy_mean_db(own or found.get((None, channel, nominal_hz), []))

    return level_of
