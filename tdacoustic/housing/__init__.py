"""The gearbox housing: a welded box with bearing seats, its modes by NGSolve, its response to bearing forces.

SI units, the drive frame of design.md with the origin at the middle of the box; `frames` says how the gears' frame lies
in it. Only the computation of modes needs NGSolve (extra ``housing``).
"""

from tdacoustic.housing.box import SEAT_PLACES, SHAFTS, Box, HousingError, Seat, horizontal_centres
from tdacoustic.housing.box_modes import housing_modes
from tdacoustic.housing.frames import gear_axes, mean_seat_loads, seat_loads
from tdacoustic.housing.modes import HousingModes

__all__ = [
    "SEAT_PLACES",
    "SHAFTS",
    "Box",
    "HousingError",
    "HousingModes",
    "Seat",
    "gear_axes",
    "horizontal_centres",
    "housing_modes",
    "mean_seat_loads",
    "seat_loads",
]
