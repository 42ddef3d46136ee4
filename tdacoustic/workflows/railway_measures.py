"""The quantities of the railway standards, from the runs that a campaign says are tests of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from tdacoustic.campaign.railway import RailwaySettings, RailwayTest
from tdacoustic.measured.hearing import Hearing
from tdacoustic.measured.levels import background_laeq_db
from tdacoustic.measured.runs import receivers
from tdacoustic.railway import (
    STANDARDS,
    Conditions,
    Passage,
    Quantity,
    RailwayMeasures,
    RunQuantity,
    Standard,
    braking,
    constant_speed,
    pass_by,
    repeated,
    starting,
    stationary,
    transit_exposure,
    unit_results,
)
from tdacoustic.railway.quantities import Test
from tdacoustic.workflows.tonality import KIND

if TYPE_CHECKING:
    from tdacoustic.campaign import CampaignChannel
    from tdacoustic.measured.runs import MeasuredRun
    from tdacoustic.spectra import LevelHistory
    from tdacoustic.workflows.second_pass import FirstPass, SecondPass

__all__ = ["railway_measures"]

KNOWN_SHARE: Final = 0.9
"""Part of an interval over which the speed must be known for its extremes to be [assumed]."""
TRANSIT_EDITION: Final = "ISO 3095:2005"
"""Whose quantity the transit exposure level is; dropped in 2013."""

_WITHOUT: Final[Mapping[str, tuple[Test, str]]] = {
    "pass-by": ("pass-by", "LpAeq,Tp"),
    "stationary": ("stationary", "LpAeq,T"),
    "starting": ("starting", "LpAFmax"),
    "braking": ("braking", "LpAFmax"),
    "constant-speed": ("constant speed", "LpAeq,T"),
}
"""Test and symbol of a quantity that cannot be had, by the campaign's word."""

_OVER_TIME: Final[Mapping[str, Callable[[LevelHistory, int, Conditions, Standard], Quantity]]] = {
    "stationary": stationary,
    "starting": starting,
    "braking": braking,
    "constant-speed": constant_speed,
}


def railway_measures(first: FirstPass, second: SecondPass) -> tuple[RailwayMeasures | None, list[str]]:
    """Return what the runs give by the standards that the campaign names, and what could not be done in words.

    Parameters
    ----------
    first : FirstPass
    second : SecondPass

    Returns
    -------
    measures : RailwayMeasures or None
        None where no key of the campaign asks for it.
    problems : list of str
    """
    campaign = first.campaign
    if not campaign.asks_for_railway:
        return None, []
    settings = campaign.railway or RailwaySettings()
    names = _microphones(first)
    tested = [run for run in first.measured if run.run.test is not None]
    problems = []
    if not tested:
        problems.append("railway: no run that could be measured states its test, so nothing is rated by the standards")
    elif not names:
        problems.append("railway: no microphone is a receiver or has a place, so nothing is rated by the standards")
    heard: Mapping[str, Hearing] = second.of_kind(KIND)
    found: list[RunQuantity] = []
    for run in tested:
        backgrounds = background_laeq_db(first.runs, run.run)
        for name in names:
            known = _Microphone(first, run, campaign.channel(name), settings, heard.get(run.name), backgrounds)
            found += [
                RunQuantity(run.name, run.run.condition or "", name, quantity)
                for quantity in known.quantities(run.run.test)
            ]
    positions = repeated(found)
    lengths = {c.name: c.stands_for_m for c in campaign.channels if c.stands_for_m is not None and c.name in names}
    return RailwayMeasures(tuple(found), positions, unit_results(positions, lengths), settings.standards), problems


def _microphones(first: FirstPass) -> tuple[str, ...]:
    """Microphones with a place; where none has one, the receivers."""
    placed = tuple(channel.name for channel in first.campaign.channels if channel.place is not None)
    return placed or receivers(first.runs)


@dataclass(frozen=True)
class _Microphone:
    """One microphone in one run, and all that is known about it."""

    first: FirstPass
    run: MeasuredRun
    channel: CampaignChannel
    settings: RailwaySettings
    hearing: Hearing | None
    backgrounds: Mapping[str, float]

    def quantities(self, test: RailwayTest | None) -> Iterator[Quantity]:
        """Yield the quantities of a test by each standard that rates microphones of this place."""
        if test is None:
            return
        inside = self.channel.place == "interior"
        standards = [STANDARDS[name] for name in self.settings.standards if STANDARDS[name].inside is inside]
        held = None if self.hearing is None else self.hearing.levels(self.channel.name)
        for number, standard in enumerate(standards):
            if held is None:
                yield self._without(standard, test, self._why_silent())
                continue
            history, place, start_s = held
            for quantity in self._of(standard, test, history, place, start_s, number == 0):
                yield _shifted(quantity, start_s)

    def _of(
        self, standard: Standard, test: RailwayTest, history: LevelHistory, place: int, start_s: float, first: bool
    ) -> Iterator[Quantity]:
        if test == "pass-by" and standard.inside:
            yield self._without(standard, test, "the microphone is inside; a pass-by is heard beside the track")
        elif test == "constant-speed" and not standard.inside:
            why = f"{standard.name} rates constant speed by the pass-by of a microphone beside the track"
            yield self._without(standard, test, why)
        elif test == "pass-by":
            passage = self._passage(start_s)
            conditions = self._conditions(passage.interval_s() or (0.0, history.duration_s), start_s)
            yield pass_by(history, place, conditions, passage, standard)
            if first:
                exposure = transit_exposure(history, place, conditions, passage, standard)
                yield replace(exposure, standard=TRANSIT_EDITION)
        else:
            conditions = self._conditions((0.0, history.duration_s), start_s)
            yield _OVER_TIME[test](history, place, conditions, standard)

    def _without(self, standard: Standard, test: RailwayTest, why: str) -> Quantity:
        of, symbol = _WITHOUT[test]
        return Quantity(standard.name, of, symbol, None, why)

    def _why_silent(self) -> str:
        """Why there are no levels over time."""
        name = self.channel.name
        said = None if self.hearing is None else self.hearing.reason(name, "levels")
        if said is not None:
            return said
        assert self.run.measurement is not None
        bad = [v.detail for v in self.run.measurement.verdicts if v.channel == name and v.verdict == "bad"]
        return f"the channel cannot be used: {'; '.join(bad) or 'no levels of it'}"

    # ------------------------------------------------------------ what is known

    def _passage(self, start_s: float) -> Passage:
        run = self.run.run
        stated = (run.front_s, run.middle_s, run.rear_s)
        front, middle, rear = (None if instant is None else instant - start_s for instant in stated)
        instants = [instant for instant in stated if instant is not None]
        speed = None
        if instants:
            low, high = self._speed_km_h(min(instants), max(instants))
            speed = None if low is None or high is None else 0.5 * (low + high)
        return Passage(front, middle, rear, self.settings.unit_length_m, speed or self._nominal_km_h())

    def _nominal_km_h(self) -> float | None:
        run = self.run.run
        if run.train_speed_km_h is not None or run.motor_speed_rpm is None:
            return run.train_speed_km_h
        drive = self.first.drive(self.run)
        return None if drive is None else drive.train_speed_km_h(run.motor_speed_rpm / 60.0)

    def _conditions(self, interval_s: tuple[float, float], start_s: float) -> Conditions:
        low, high = self._speed_km_h(start_s + interval_s[0], start_s + interval_s[1])
        nominal = self._nominal_km_h()
        if low is None and nominal == 0.0:  # standing, as the campaign says
            low = high = 0.0
        channel = self.channel
        height = channel.height_above_floor_m if channel.place == "interior" else channel.height_above_rail_m
        return Conditions(
            place=channel.place,
            distance_m=channel.distance_m,
            height_m=height,
            nominal_km_h=nominal,
            lowest_km_h=low,
            highest_km_h=high,
            background_db=self.backgrounds.get(channel.name),
            reference_track=self.settings.reference_track,
        )

    def _speed_km_h(self, from_s: float, to_s: float) -> tuple[float | None, float | None]:
        """Lowest and highest train speed between two instants of the run; None where it is not known."""
        assert self.run.measurement is not None
        profile = self.run.measurement.speed.leading
        if profile is None:
            return None, None
        speeds = np.abs(profile.speed_at(np.linspace(from_s, to_s, 201)))
        known = speeds[np.isfinite(speeds)]
        if known.size < KNOWN_SHARE * speeds.size:
            return None, None
        low, high = float(known.min()), float(known.max())
        if profile.si_symbol == "m/s":
            return 3.6 * low, 3.6 * high
        if profile.stands:
            return 0.0, 0.0
        drive = self.first.drive(self.run)
        if drive is None or profile.shaft not in ("motor", "wheelset"):
            return None, None
        of_wheel = profile.shaft == "wheelset"
        low, high = (drive.motor_hz_of_wheel(speed) if of_wheel else speed for speed in (low, high))
        return drive.train_speed_km_h(low), drive.train_speed_km_h(high)


def _shifted(quantity: Quantity, start_s: float) -> Quantity:
    """A quantity whose instants count from the run's common start."""
    if not start_s or quantity.start_s is None or quantity.end_s is None:
        return quantity
    return replace(quantity, start_s=quantity.start_s + start_s, end_s=quantity.end_s + start_s)
