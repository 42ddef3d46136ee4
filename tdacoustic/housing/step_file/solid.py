"""A housing from a STEP file: what is wished of it, and what was found in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing.box import (
    ASSUMED_HANGER_STIFFNESS_N_PER_M,
    ASSUMED_SEAT_STIFFNESS_N_PER_M,
    SHAFTS,
    HousingError,
    Seat,
    Shaft,
)
from tdacoustic.housing.step_file.triangles import Skin

__all__ = ["HANGER_RADIUS_M", "Planes", "SeatWish", "SolidHousing", "SolidWish"]

Triple = tuple[float, float, float]
Planes = tuple[tuple[Literal["x", "y", "z"], float], ...]
Real = NDArray[np.float64]

HANGER_RADIUS_M: Final = 0.05
"""Of the patch that holds the hanger where no face is named for it [assumed], as of the box."""


@dataclass(frozen=True)
class SeatWish:
    """What a fleet says of the two seats of a shaft.

    Parameters
    ----------
    shaft : {"pinion", "wheel"}
    centre_m : (float, float) or None
        x and z in the file's coordinates; None: by names in the file, else on the default line of centres.
    radius_m, thickness_m : float or None
        Of the part of the solid that is a seat where there is no bore; a bore brings its own.
    stiffness_n_per_m : (float, float, float)
    gear_y_m : float or None
        Where the gear stands along its shaft; None: in the middle between its bearings.
    """

    shaft: Shaft
    centre_m: tuple[float, float] | None
    radius_m: float | None
    thickness_m: float | None
    stiffness_n_per_m: Triple = ASSUMED_SEAT_STIFFNESS_N_PER_M
    gear_y_m: float | None = None


@dataclass(frozen=True)
class SolidWish:
    """What is made of a STEP file, besides the file.

    Parameters
    ----------
    seats : (SeatWish, SeatWish)
        Of pinion and wheel.
    centre_distance_m : float
        Of the default line of centres.
    modulus_pa, density_kg_m3, poisson : float
        Of the whole solid.
    hanger_stiffness_n_per_m : (float, float, float)
    """

    seats: tuple[SeatWish, SeatWish]
    centre_distance_m: float
    modulus_pa: float = 210e9
    density_kg_m3: float = 7850.0
    poisson: float = 0.3
    hanger_stiffness_n_per_m: Triple = ASSUMED_HANGER_STIFFNESS_N_PER_M

    def __post_init__(self) -> None:
        if tuple(seat.shaft for seat in self.seats) != SHAFTS:
            raise HousingError("seats must be one of the pinion and one of the wheel, in this order")

    @property
    def without_gears(self) -> SolidWish:
        """The same, but for where the gears stand on their shafts, which no mode depends on."""
        pinion, wheel = (replace(seat, gear_y_m=None) for seat in self.seats)
        return replace(self, seats=(pinion, wheel))


@dataclass(frozen=True, eq=False)
class SolidHousing:
    """A closed hollow solid with its seats, as found in a STEP file; lengths in the file's own axes.

    Parameters
    ----------
    seats : (Seat, Seat)
        Of pinion and wheel. Radius and thickness are those of the left seat's material.
    seat_y_m : ((float, float), (float, float))
        Mid planes of the left and the right seat, of pinion and wheel.
    low_m, high_m : (float, float, float)
        Ends along x, y, z.
    skin_points_m, skin_triangles : ndarray
        Of the outer surface, within `skin_error_m` of it.
    planes_m : tuple of (str, float)
        Mirror planes of the outer surface: the axis each is normal to, and where it is.
    wall_m : float
        Typical thickness of the thin walls.
    mass_kg : float
    area_m2 : float
        Of the outer surface.
    notes : tuple of str
        What was done to the file's solid, in whole sentences.
    loss_factor : float
        Structural.
    """

    seats: tuple[Seat, Seat]
    seat_y_m: tuple[tuple[float, float], tuple[float, float]]
    low_m: Triple
    high_m: Triple
    skin_points_m: Real
    skin_triangles: NDArray[np.int64]
    planes_m: Planes
    wall_m: float
    mass_kg: float
    area_m2: float
    notes: tuple[str, ...] = ()
    loss_factor: float = 0.02

    @property
    def extent_m(self) -> Triple:
        """Outer dimensions along x, y, z."""
        x, y, z = (high - low for low, high in zip(self.low_m, self.high_m, strict=True))
        return x, y, z

    @property
    def skin(self) -> Skin:
        """The outer surface."""
        return Skin(self.skin_points_m, self.skin_triangles)

    def share_of_left(self, seat: Seat) -> float:
        """Part of a gear's bearing force that the bearing at +y takes: lever rule between the seats' mid planes."""
        left, right = self.seat_y_m[SHAFTS.index(seat.shaft)]
        return (seat.gear_y_m - right) / (left - right)

    def with_gears(self, wish: SolidWish, loss_factor: float) -> SolidHousing:
        """Return the housing with a fleet's loss factor and its gears on their shafts.

        Raises
        ------
        HousingError
            A gear that is not between its bearings.
        """
        seats = []
        for seat, asked, (left, right) in zip(self.seats, wish.seats, self.seat_y_m, strict=True):
            gear_y = 0.5 * (left + right) if asked.gear_y_m is None else asked.gear_y_m
            if not right < gear_y < left:
                raise HousingError(
                    f"the {seat.shaft}'s gear at y = {gear_y:g} m is not between its two bearings, whose middles are "
                    f"at y = {right:.4g} and {left:.4g} m (in the file's own coordinates)"
                )
            seats.append(replace(seat, gear_y_m=gear_y))
        return replace(self, seats=(seats[0], seats[1]), loss_factor=loss_factor)
