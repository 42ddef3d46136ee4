"""Time stamps of logs: how far apart they put the starts, and how finely."""

from __future__ import annotations

import datetime
import re
from dataclasses import dataclass
from decimal import Decimal

__all__ = ["Stamp", "late_s", "parse_stamp"]

_FORM = re.compile(r"^(?P<whole>[^.,]+?)(?:[.,](?P<part>\d+))?(?P<zone>Z|[+-]\d\d:?\d\d)?$")
_EPOCH = datetime.datetime(1970, 1, 1, tzinfo=datetime.UTC)


@dataclass(frozen=True)
class Stamp:
    """An instant as a log states it.

    Parameters
    ----------
    text : str
    whole_s : int
        Since 1970, of the zone's own time where none is stated.
    part_s : Decimal
        Of a second.
    resolution_s : float
        One unit of its last digit.
    zoned : bool
    """

    text: str
    whole_s: int
    part_s: Decimal
    resolution_s: float
    zoned: bool


def parse_stamp(text: str) -> Stamp | None:
    """Return a log's ISO 8601 instant, every digit of it; None where it is none.

    Examples
    --------
    >>> parse_stamp("2026-05-01T10:00:00.250+02:00").resolution_s
    0.001
    """
    found = _FORM.match(text.strip())
    if found is None:
        return None
    whole, part, zone = found.group("whole"), found.group("part") or "", found.group("zone")
    try:
        moment = datetime.datetime.fromisoformat(whole + (zone or ""))
    except ValueError:
        return None
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=datetime.UTC)
    since = moment - _EPOCH
    resolution_s = 10.0 ** -len(part) if ":" in whole else 86400.0
    seconds = since.days * 86400 + since.seconds
    return Stamp(text, seconds, Decimal(f"0.{part or 0}"), resolution_s, zone is not None)


def late_s(stamp: Stamp, reference: Stamp) -> float:
    """Return by how many seconds a stamp is later than another of the same kind of zone."""
    return float(Decimal(stamp.whole_s - reference.whole_s) + stamp.part_s - reference.part_s)
