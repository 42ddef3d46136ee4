"""A housing from a STEP file: read and healed or refused, its seats found, its modes and its outer panels.

``SolidHousing`` is what the rest of the program needs of it. Everything that touches OpenCASCADE, Netgen or NGSolve
runs in a process of its own (`isolation`). Lengths in metres, the file's own axes, which must be those of the drive:
x along travel, y to the left along the shafts, z up.
"""

from tdacoustic.housing.step_file.modes import SolidModes, SolidPanels, solid_modes
from tdacoustic.housing.step_file.solid import SeatWish, SolidHousing, SolidWish
from tdacoustic.housing.step_file.survey import read_solid

__all__ = ["SeatWish", "SolidHousing", "SolidModes", "SolidPanels", "SolidWish", "read_solid", "solid_modes"]
