"""From sources to the sound field: air, distance, ground."""

from tdacoustic.radiation.air import Air
from tdacoustic.radiation.point_sources import Space, mean_over_sphere_db, overall_level_db, transfer_db

__all__ = ["Air", "Space", "mean_over_sphere_db", "overall_level_db", "transfer_db"]
