"""From sources to the sound field: air, distance, ground."""

from tdacoustic.radiation.air import ABSORPTION_RANGE, Air, absorption_db_per_m
from tdacoustic.radiation.point_sources import Space, mean_over_sphere_db, overall_level_db, transfer_db

__all__ = [
    "ABSORPTION_RANGE",
    "Air",
    "Space",
    "absorption_db_per_m",
    "mean_over_sphere_db",
    "overall_level_db",
    "transfer_db",
]
