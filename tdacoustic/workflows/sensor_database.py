"""Which calibration of which sensor holds for a channel in each run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from tdacoustic.campaign import Campaign, CampaignChannel, Scale
from tdacoustic.ingest.known_scale import KnownScale, is_physical, number_unit
from tdacoustic.measured.run_sensors import DatabaseUse
from tdacoustic.sensors import ChosenEntry, SensorEntry, choose_entry, entries_of
from tdacoustic.units import parse_sensitivity

if TYPE_CHECKING:
    from tdacoustic.recording import LogChannel
    from tdacoustic.workflows.scanned_runs import ScannedRun

__all__ = ["database_scales"]

SAME_DB: Final = 0.05
"""Up to which a sensitivity in the campaign and one in the database are the same, rounded differently [assumed]."""


def database_scales(
    campaign: Campaign, scanned: Sequence[ScannedRun]
) -> tuple[tuple[DatabaseUse, ...], dict[str, dict[str, KnownScale]]]:
    """Return the uses of the sensor database, and the scales that come from it, by run and channel.

    Parameters
    ----------
    campaign : Campaign
    scanned : sequence of ScannedRun
        Its valid runs.
    """
    uses: dict[tuple[str, int, bool], DatabaseUse] = {}
    scales: dict[str, dict[str, KnownScale]] = {}
    for channel in campaign.channels:
        if channel.sensor is None:
            continue
        entries = entries_of(campaign.sensors, channel.sensor)
        for item in scanned:
            place = item.source(channel)
            if place is None:
                continue
            chosen = choose_entry(entries, item.date)
            scale, doubts = _scale(campaign, channel, chosen, place[2])
            if scale is not None:
                scales.setdefault(item.run.name, {})[channel.name] = scale
            key = (channel.name, chosen.entry.line, scale is not None)
            before = uses.get(key)
            runs = (*(() if before is None else before.runs), item.run.name)
            said = dict.fromkeys((*(() if before is None else before.doubts), *chosen.doubts, *doubts))
            uses[key] = DatabaseUse(channel.name, channel.sensor, chosen, runs, scale is not None, tuple(said))
    return tuple(uses.values()), scales


def _scale(
    campaign: Campaign, channel: CampaignChannel, chosen: ChosenEntry, source: LogChannel
) -> tuple[KnownScale | None, tuple[str, ...]]:
    """The scale that the database gives a channel; None where the campaign or the log says it, and what is doubtful."""
    entry, stated = chosen.entry, channel.scale
    if stated.sensitivity is not None:
        return None, _contradiction(stated.sensitivity, entry)
    if is_physical(number_unit(source, stated).unit):
        return None, ()  # the log's numbers are what is measured: whoever wrote them knew a sensitivity
    table = "" if campaign.sensor_table is None else f" of {campaign.sensor_table.text}"
    words = f"sensor {channel.sensor}{table}" + (f", calibrated on {entry.date}" if entry.date is not None else "")
    return KnownScale(words, Scale(stated.quantity, stated.unit, entry.sensitivity, stated.full_scale)), ()


def _contradiction(stated: str, entry: SensorEntry) -> tuple[str, ...]:
    one, two = parse_sensitivity(stated), parse_sensitivity(entry.sensitivity)
    both = f"the campaign says {stated}, the sensor database {entry.sensitivity}"
    if (one.electrical_si_symbol, one.physical_si_symbol) != (two.electrical_si_symbol, two.physical_si_symbol):
        return (f"{both}: they are of different kinds; the campaign's is used",)
    ratio_db = 20.0 * math.log10(one.electrical_per_physical / two.electrical_per_physical)
    if abs(ratio_db) <= SAME_DB:
        return ()
    return (f"{both}, {ratio_db:+.2f} dB apart; the campaign's is used",)
