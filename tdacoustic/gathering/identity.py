"""Which train a campaign was of, and when: as its ``[meta]`` and its logs say, never guessed."""

from __future__ import annotations

import datetime
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

__all__ = ["DATE_KEYS", "TRAIN_KEYS", "Identity", "identified"]

TRAIN_KEYS: Final = ("train", "train_number", "vehicle", "locomotive")
DATE_KEYS: Final = ("date", "year")
"""Keys of ``[meta]`` that are known, the first one first; in any case, with blanks or hyphens for ``_``."""

LONGEST_TRAIN: Final = 80


@dataclass(frozen=True)
class Identity:
    """Train and time of a campaign.

    Parameters
    ----------
    train : str
        Empty where nothing says it.
    date : date or None
        None where not even a log says the day.
    year : int or None
        Known where the date is, or stated alone.
    date_from : str
        ``meta``, ``log``, or empty.
    started : datetime or None
        Earliest start in UTC; None where no log states one with its offset.
    started_text : str
        As the log states it, with an offset or without.
    note : str
        What was stated and could not be used.
    """

    train: str = ""
    date: datetime.date | None = None
    year: int | None = None
    date_from: str = ""
    started: datetime.datetime | None = None
    started_text: str = ""
    note: str = ""


def identified(
    meta: Mapping[str, str], started: str, train_key: str | None = None, date_key: str | None = None
) -> Identity:
    """Return train and time of a campaign.

    A date is ISO 8601: a day, with or without a time; of ``2024-05`` and ``2024`` the year is known alone. Where
    ``[meta]`` says none, the day of the earliest log counts, in the zone that the log states.

    Parameters
    ----------
    meta : mapping of str to str
    started : str
        Earliest start of a log, empty of none.
    train_key, date_key : str, optional
        Keys of ``[meta]`` instead of the known ones.

    Examples
    --------
    >>> identified({"Train number": "185 042"}, "2024-05-01T09:00:00+02:00").train
    '185 042'
    """
    plain: dict[str, str] = {}
    for key, value in meta.items():
        plain.setdefault(_plain(key), value.strip())
    train = _first(plain, TRAIN_KEYS if train_key is None else (train_key,))[:LONGEST_TRAIN]
    moment = _moment(started)
    zoned = moment if moment is not None and moment.tzinfo is not None else None
    known = Identity(
        train=train,
        started=None if zoned is None else zoned.astimezone(datetime.UTC),
        started_text="" if moment is None else started,
    )
    for key in DATE_KEYS if date_key is None else (date_key,):
        text = plain.get(_plain(key), "")
        day, year = _day(text)
        if year is not None:
            return replace(known, date=day, year=year, date_from="meta", note="")
        if text:
            known = replace(known, note=f"{key} {text[:40]!r} in [meta] is no date of the form 2024-05-31")
    if moment is not None:
        return replace(known, date=moment.date(), year=moment.year, date_from="log")
    return known


def _plain(key: str) -> str:
    return re.sub(r"[\s-]+", "_", key.strip().lower())


def _first(meta: Mapping[str, str], keys: Sequence[str]) -> str:
    return next((text for key in keys if (text := meta.get(_plain(key), ""))), "")


def _moment(text: str) -> datetime.datetime | None:
    """An instant that can be said in UTC; None of what is none."""
    try:
        found = datetime.datetime.fromisoformat(text)
        found.astimezone(datetime.UTC)
    except (ValueError, OverflowError):
        return None
    return found


def _day(text: str) -> tuple[datetime.date | None, int | None]:
    """Day and year of a text, as far as it says them."""
    if re.fullmatch(r"\d{4}(-(0[1-9]|1[0-2]))?", text):
        year = int(text[:4])
        return None, year if year else None
    if not re.match(r"\d{4}-\d{2}-\d{2}([T ]|$)", text):
        return None, None
    moment = _moment(text)
    return (None, None) if moment is None else (moment.date(), moment.year)
