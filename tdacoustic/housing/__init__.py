"""The gearbox housing: a welded box with bearing seats or a STEP file's solid, its modes, its response to forces.

SI units, the drive frame of design.md with the origin at the middle of the box; `frames` says how the gears' frame lies
in it. Only the computation of modes needs NGSolve (extra ``housing``).
"""

from tdacoustic.housing.box import SEAT_PLACES, SHAFTS, Box, HousingError, Seat, horizontal_centres
from tdacoustic.housing.box_modes import housing_modes
from tdacoustic.housing.frames import foundation_of, gear_axes, mean_seat_loads, seat_loads
from tdacoustic.housing.modes import HousingModes
from tdacoustic.housing.response import SeatResponse
from tdacoustic.housing.seated import Seated
from tdacoustic.housing.step_file import SeatWish, SolidHousing, SolidModes, SolidWish, read_solid, solid_modes

__all__ = [
    "SEAT_PLACES",
    "SHAFTS",
    "Box",
    "HousingError",
    "HousingModes",
    "Seat",
    "SeatResponse",
    "SeatWish",
    "Seated",
    "SolidHousing",
    "SolidModes",
    "SolidWish",
    "foundation_of",
    "gear_axes",
    "horizontal_centres",
    "housing_modes",
    "mean_seat_loads",
    "read_solid",
    "seat_loads",
    "solid_modes",
]
