"""Sensors: their database, and what calibrators recorded before and after say of their sensitivity.

What reads signals is imported from its modules: reading a campaign needs none of it.
"""

from tdacoustic.sensors.calibrators import LIMIT_DB, USUAL_FREQUENCIES_HZ, Calibrator, parse_calibrator
from tdacoustic.sensors.entries import ChosenEntry, SensorEntry, choose_entry, entries_of
from tdacoustic.sensors.series import series_of

__all__ = [
    "LIMIT_DB",
    "USUAL_FREQUENCIES_HZ",
    "Calibrator",
    "ChosenEntry",
    "SensorEntry",
    "choose_entry",
    "entries_of",
    "parse_calibrator",
    "series_of",
]
