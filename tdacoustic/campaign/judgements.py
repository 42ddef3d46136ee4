"""``[[level]]``, ``[[exclude]]``, ``[[override]]``: what the engineer knows better than the logs."""

from __future__ import annotations

from typing import Literal

from tdacoustic.campaign.values import FrequencyBand
from tdacoustic.toml_models import Name, Positive, Table, Text

__all__ = ["Exclude", "Level", "Override", "Source"]

Source = Literal["motor", "gearbox", "wheelset", "bogie", "body", "air", "shaft", "ambiguous", "unassigned"]
"""What a line can be ascribed to."""


class Level(Table):
    """One ``[[level]]``: a sound pressure level known without logs, dB re 20 uPa.

    Parameters
    ----------
    condition : str
        It may be one that no run has.
    distance_m : float
        From the drive's centre.
    level_db : float
    sigma_db : float or None
        One standard deviation, where it is known.
    weighting : str
        ``"Z"``, ``"A"`` or ``"C"``.
    origin : str or None
        Where the number comes from.
    """

    condition: Name
    distance_m: Positive
    level_db: float
    sigma_db: Positive | None = None
    weighting: Literal["Z", "A", "C"] = "Z"
    origin: Text | None = None


class Exclude(Table):
    """One ``[[exclude]]``: a band of a condition that is left out.

    Parameters
    ----------
    condition : str
    channel : str or None
        Default: every channel.
    frequency_hz : (float, float)
        From, to.
    reason : str
    """

    condition: Name
    channel: Name | None = None
    frequency_hz: FrequencyBand
    reason: Text


class Override(Table):
    """One ``[[override]]``: the engineer's word on the source of a line.

    Parameters
    ----------
    condition : str
    frequency_hz : float
        Of the line.
    source : str
        One of `Source`.
    reason : str
    """

    condition: Name
    frequency_hz: Positive
    source: Source
    reason: Text
