"""A sensor database: which sensor had which sensitivity from when on."""

from __future__ import annotations

import datetime
import difflib
from collections.abc import Sequence
from dataclasses import dataclass

from tdacoustic.errors import CampaignError

__all__ = ["ChosenEntry", "SensorEntry", "choose_entry", "entries_of"]


@dataclass(frozen=True)
class SensorEntry:
    """One calibration of one sensor.

    Parameters
    ----------
    serial : str
    sensitivity : str
        As ``"10.2 mV/(m/s^2)"``.
    date : date or None
        Of the calibration.
    due : date or None
        Until when it holds.
    quantity : str or None
    type, note : str
    line : int
        Where it stands in the file.
    """

    serial: str
    sensitivity: str
    date: datetime.date | None = None
    due: datetime.date | None = None
    quantity: str | None = None
    type: str = ""
    note: str = ""
    line: int = 0


@dataclass(frozen=True)
class ChosenEntry:
    """The calibration that holds at a date.

    Parameters
    ----------
    entry : SensorEntry
    doubts : tuple of str
        What is doubtful about it.
    """

    entry: SensorEntry
    doubts: tuple[str, ...] = ()


def _loose(serial: str) -> str:
    text = "".join(character for character in serial.casefold() if character.isalnum())
    for prefix in ("serialno", "serial", "sn"):
        if text.startswith(prefix) and len(text) > len(prefix):
            return text.removeprefix(prefix)
    return text


def entries_of(entries: Sequence[SensorEntry], serial: str) -> tuple[SensorEntry, ...]:
    """Return the calibrations of a sensor.

    A serial number is looked for as it is, then without regard to case, signs and a leading ``SN``.

    Raises
    ------
    CampaignError
        It is not there, or stands for several sensors; the message names the nearest.
    """
    exact = tuple(entry for entry in entries if entry.serial == serial.strip())
    if exact:
        return exact
    loose = tuple(entry for entry in entries if _loose(entry.serial) == _loose(serial))
    spellings = tuple(dict.fromkeys(entry.serial for entry in loose))
    if len(spellings) > 1:
        raise CampaignError(
            f"sensor {serial!r} could be any of {', '.join(map(repr, spellings))}; write it as it is there"
        )
    if loose:
        return loose
    known = list(dict.fromkeys(entry.serial for entry in entries))
    near = difflib.get_close_matches(serial, known, n=3, cutoff=0.5)
    said = f"the nearest are {', '.join(map(repr, near))}" if near else f"there are {', '.join(map(repr, known[:8]))}"
    raise CampaignError(f"sensor {serial!r} is not in the sensor database; {said}")


def choose_entry(entries: Sequence[SensorEntry], on: datetime.date | None) -> ChosenEntry:
    """Return the calibration of one sensor that holds at a date.

    Parameters
    ----------
    entries : sequence of SensorEntry
        Of one sensor, at least one.
    on : date or None
        Of the run; None where nobody says it: the newest calibration is then taken, and that is said.
    """
    dated = sorted((entry for entry in entries if entry.date is not None), key=lambda entry: str(entry.date))
    if not dated:
        return ChosenEntry(entries[-1], _due(entries[-1], on))
    newest = dated[-1]
    if on is None:
        several = (
            f"the date of the run is not known; of {len(dated)} calibrations the newest, of {newest.date}, is used"
        )
        return ChosenEntry(newest, (several,) if len(dated) > 1 else ())
    before = [entry for entry in dated if entry.date is not None and entry.date <= on]
    if before:
        return ChosenEntry(before[-1], _due(before[-1], on))
    first = dated[0]
    return ChosenEntry(first, (f"calibrated on {first.date}, after the run of {on}", *_due(first, on)))


def _due(entry: SensorEntry, on: datetime.date | None) -> tuple[str, ...]:
    if entry.due is None or on is None or on <= entry.due:
        return ()
    return (f"its calibration was due on {entry.due}, before the run of {on}",)
