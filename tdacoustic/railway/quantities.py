"""The levels that ISO 3095 and ISO 3381 ask for, from one microphone's level over time in one run."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Literal

from tdacoustic.errors import AnalysisError
from tdacoustic.railway.conditions import Conditions, Finding, State
from tdacoustic.railway.rules import Standard
from tdacoustic.spectra.time_weighting import SETTLING, TIME_CONSTANTS_S, LevelHistory
from tdacoustic.units import REFERENCES

__all__ = [
    "Passage",
    "Quantity",
    "Test",
    "braking",
    "constant_speed",
    "pass_by",
    "starting",
    "stationary",
    "transit_exposure",
]

Test = Literal["pass-by", "transit exposure", "stationary", "constant speed", "starting", "braking"]

_P0_SQUARED: Final = REFERENCES["sound_pressure"] ** 2
_SETTLED_S: Final = SETTLING * TIME_CONSTANTS_S["F"]


@dataclass(frozen=True)
class Quantity:
    """One level of one run, or why there is none.

    Parameters
    ----------
    standard : str
    test : Test
    symbol : str
        As ``"LpAeq,Tp"``.
    level_db : float or None
        Re 20 uPa, not rounded, not corrected for background.
    reason : str or None
        Why there is no level.
    start_s, end_s : float or None
        The interval that counts, after the record's start.
    findings : tuple of Finding
        The standard's requirements held against what is known.
    corrected_db : float or None
        The level less the background's energy, where the background is too near for the standard and yet far enough
        for its informative correction (D.4.2 of ISO 3095:2013).
    """

    standard: str
    test: Test
    symbol: str
    level_db: float | None
    reason: str | None
    start_s: float | None = None
    end_s: float | None = None
    findings: tuple[Finding, ...] = ()
    corrected_db: float | None = None

    @property
    def state(self) -> State:
        """``broken`` where a requirement is, ``unknown`` where one cannot be judged or no level is, else ``met``."""
        if self.level_db is None:
            return "unknown"
        states = {finding.state for finding in self.findings}
        return "broken" if "broken" in states else "unknown" if "unknown" in states else "met"


@dataclass(frozen=True)
class Passage:
    """When a unit passes a wayside microphone; None where nothing says it.

    Two of the three instants, or one of them with length and speed, give the pass-by time.

    Parameters
    ----------
    front_s, middle_s, rear_s : float or None
        Instants at which the unit's front, middle and rear (over buffers) are opposite the microphone.
    length_m : float or None
        Of the unit over buffers.
    speed_km_h : float or None
        At which it passed.
    """

    front_s: float | None = None
    middle_s: float | None = None
    rear_s: float | None = None
    length_m: float | None = None
    speed_km_h: float | None = None

    @property
    def pass_by_time_s(self) -> float | None:
        """Length over speed, Tp; None where it is not known."""
        if self.length_m is None or not self.speed_km_h:
            return None
        return self.length_m / (self.speed_km_h / 3.6)

    def interval_s(self) -> tuple[float, float] | None:
        """Instants of front and rear; None where they cannot be had."""
        stated = ((0.0, self.front_s), (0.5, self.middle_s), (1.0, self.rear_s))
        known = [(part, instant) for part, instant in stated if instant is not None]
        if len(known) >= 2:
            (first, start), (last, end) = known[0], known[-1]
            length_s = (end - start) / (last - first)
        elif known and self.pass_by_time_s is not None:
            ((first, start),), length_s = known, self.pass_by_time_s
        else:
            return None
        front = start - first * length_s
        return front, front + length_s


def _level(mean_square: float) -> float | None:
    return 10.0 * math.log10(mean_square / _P0_SQUARED) if mean_square > 0.0 else None


def _quantity(
    standard: Standard,
    test: Test,
    symbol: str,
    history: LevelHistory,
    channel: int,
    interval: tuple[float, float] | None,
    why_none: str,
    maximum: bool = False,
) -> Quantity:
    """The level over an interval, or the reason why there is none."""
    if history.weighting != "A":
        raise AnalysisError(f"{symbol} takes an A-weighted history, got weighting {history.weighting!r}")
    start, end = interval if interval is not None else (None, None)

    def none(reason: str) -> Quantity:
        return Quantity(standard.name, test, symbol, None, reason, start, end)

    if interval is None or start is None or end is None:
        return none(why_none)
    if not 0.0 <= start < end <= history.duration_s * (1.0 + 1e-9):
        return none(f"{start:.2f} to {end:.2f} s is not within the record of {history.duration_s:.2f} s")
    if history.has_missing(channel, start, end):
        return none("samples are missing within the interval")
    if maximum:
        value = history.highest_between(channel, "F", start, end)
    else:
        value = history.mean_square_between(channel, start, end)
    level = _level(value)
    if level is None:
        return none("no sound within the interval")
    return Quantity(standard.name, test, symbol, level, None, start, end)


def _found(quantity: Quantity, conditions: Conditions, standard: Standard, *findings: Finding) -> Quantity:
    """The quantity with what was found, that of the background, and the correction for it."""
    if quantity.level_db is None:
        return quantity
    background = conditions.background(standard, quantity.level_db)
    corrected = conditions.corrected_db(standard, quantity.level_db)
    return replace(quantity, findings=(*findings, background), corrected_db=corrected)


def _whole(history: LevelHistory) -> tuple[float, float]:
    return 0.0, history.duration_s


def pass_by(
    history: LevelHistory, channel: int, conditions: Conditions, passage: Passage, standard: Standard
) -> Quantity:
    """LpAeq,Tp of a unit that passes at constant speed (ISO 3095:2013, 6.5 and 6.6.3).

    The interval is the pass-by time, from front to rear over buffers; the record has to begin and end at
    least 10 dB below the level at front and rear. Where units that do not count run along in the train, the instants
    are those of the units under test; whether the neighbours count as neutral (6.3.4) the logs do not tell.

    Parameters
    ----------
    history : LevelHistory
        A-weighted, of the whole record.
    channel : int
    conditions : Conditions
    passage : Passage
    standard : Standard
        An edition of ISO 3095.
    """
    _outside(standard)
    interval = passage.interval_s()
    why = "nothing says when the unit's front and rear pass the microphone (instants, or one of them, length and speed)"
    if conditions.place in ("vehicle", "interior"):
        interval, why = None, f"the microphone does not stand beside the track (place: {conditions.place})"
    quantity = _quantity(standard, "pass-by", "LpAeq,Tp", history, channel, interval, why)
    if quantity.level_db is None or interval is None:
        return quantity
    speed = conditions.nominal_km_h or passage.speed_km_h
    far = bool(speed and speed >= standard.value("far_from_km_h") and (conditions.distance_m or 0.0) > 15.0)
    return _found(
        quantity,
        conditions,
        standard,
        *conditions.position(standard, far),
        conditions.speed(standard),
        *_margins(history, channel, interval, standard),
        conditions.track(standard),
    )


def _margins(
    history: LevelHistory, channel: int, interval: tuple[float, float], standard: Standard
) -> tuple[Finding, ...]:
    """Whether the record begins and ends far enough below the passage."""
    rule = standard.rule("record_margin_db")
    found = []
    for word, instant, edge in (
        ("begins", interval[0], min(_SETTLED_S, interval[0])),
        ("ends", interval[1], history.duration_s),
    ):
        opposite, far = (_level(history.at(channel, "F", moment)) for moment in (instant, edge))
        requirement = (
            f"record {word} at least {rule.value:g} dB below the unit's {'front' if word == 'begins' else 'rear'}"
        )
        if word == "begins" and edge < _SETTLED_S:
            detail = f"the record begins {interval[0]:.2f} s before; LpAF takes {_SETTLED_S:.2f} s to settle"
            found.append(Finding(requirement, "unknown", detail, rule.origin))
        elif opposite is None or far is None:
            found.append(Finding(requirement, "unknown", "no sound at the record's end", rule.origin))
        else:
            below = opposite - far
            state: State = "met" if below >= rule.value else "broken"
            found.append(Finding(requirement, state, f"{below:.1f} dB below", rule.origin))
    return tuple(found)


def transit_exposure(
    history: LevelHistory, channel: int, conditions: Conditions, passage: Passage, standard: Standard
) -> Quantity:
    """TEL: the energy of the whole record over the pass-by time (ISO 3095:2005, 3.14; dropped in 2013).

    Formula B.1 of the 2013 edition keeps its form for a single trailer, over the pass-by time of half of it.
    """
    _outside(standard)
    interval = passage.interval_s()
    why = "nothing says how long the unit takes to pass the microphone"
    if conditions.place in ("vehicle", "interior"):
        interval, why = None, f"the microphone does not stand beside the track (place: {conditions.place})"
    quantity = _quantity(standard, "transit exposure", "TEL", history, channel, interval and _whole(history), why)
    if quantity.level_db is None or interval is None:
        return quantity
    length = interval[1] - interval[0]
    level = quantity.level_db + 10.0 * math.log10(history.duration_s / length)
    quantity = Quantity(standard.name, "transit exposure", "TEL", level, None, 0.0, history.duration_s)
    return _found(
        quantity,
        conditions,
        standard,
        *conditions.position(standard),
        conditions.speed(standard),
        *_margins(history, channel, interval, standard),
    )


def stationary(history: LevelHistory, channel: int, conditions: Conditions, standard: Standard) -> Quantity:
    """LpAeq,T at standstill, over the whole record (ISO 3095:2013, clause 5; ISO 3381:2021).

    One position of the standard's mesh; the unit's level is the mean over all of it (`unit_level_db`).
    """
    quantity = _quantity(standard, "stationary", "LpAeq,T", history, channel, _whole(history), "")
    if quantity.level_db is None:
        return quantity
    return _found(
        quantity,
        conditions,
        standard,
        *conditions.position(standard),
        conditions.standstill(standard),
        _duration(history, standard, "stationary_s"),
    )


def constant_speed(history: LevelHistory, channel: int, conditions: Conditions, standard: Standard) -> Quantity:
    """LpAeq,T inside a vehicle at constant speed, over the whole record (ISO 3381:2021)."""
    if not standard.inside:
        raise AnalysisError(
            f"{standard.name} rates constant speed by the pass-by, not by LpAeq,T of a moving microphone"
        )
    quantity = _quantity(standard, "constant speed", "LpAeq,T", history, channel, _whole(history), "")
    if quantity.level_db is None:
        return quantity
    return _found(
        quantity,
        conditions,
        standard,
        *conditions.position(standard),
        conditions.speed(standard),
        _duration(history, standard, "constant_speed_s"),
    )


def starting(history: LevelHistory, channel: int, conditions: Conditions, standard: Standard) -> Quantity:
    """LpAFmax of a start from standstill, over the whole record (ISO 3095:2013, 7.5; ISO 3381:2021).

    The microphones of ISO 3095 stand 10 m ahead of the unit and along it: which this one is the logs do not tell.
    """
    return _maximum(history, channel, conditions, standard, "starting")


def braking(history: LevelHistory, channel: int, conditions: Conditions, standard: Standard) -> Quantity:
    """LpAFmax of braking, over the whole record (ISO 3095:2013, clause 8, from 30 km/h; ISO 3381:2021)."""
    quantity = _maximum(history, channel, conditions, standard, "braking")
    if quantity.level_db is None or standard.inside:
        return quantity
    rule = standard.rule("braking_from_km_h")
    requirement = f"braked from {rule.value:g} km/h"
    if conditions.highest_km_h is None:
        finding = Finding(requirement, "unknown", "the speed is not known", rule.origin)
    else:
        near = abs(conditions.highest_km_h - rule.value) <= standard.value("speed_tolerance") * rule.value
        finding = Finding(requirement, "met" if near else "broken", f"{conditions.highest_km_h:.1f} km/h", rule.origin)
    return replace(quantity, findings=(*quantity.findings, finding))


def _maximum(
    history: LevelHistory,
    channel: int,
    conditions: Conditions,
    standard: Standard,
    test: Literal["starting", "braking"],
) -> Quantity:
    interval, why = _whole(history), ""
    quantity = _quantity(standard, test, "LpAFmax", history, channel, interval, why, maximum=True)
    if quantity.level_db is None:
        return quantity
    return _found(quantity, conditions, standard, *conditions.position(standard))


def _duration(history: LevelHistory, standard: Standard, key: str) -> Finding:
    rule = standard.rule(key)
    state: State = "met" if history.duration_s >= rule.value * (1.0 - 1e-6) else "broken"
    return Finding(f"at least {rule.value:g} s", state, f"{history.duration_s:.1f} s", rule.origin)


def _outside(standard: Standard) -> None:
    if standard.inside:
        raise AnalysisError(f"{standard.name} has no pass-by: its microphones are inside the vehicle")
