"""The gearbox housing as a welded box with bearing seats: pure input, checked on construction.

Frame. All coordinates are those of the drive frame of design.md (x along travel, y to the left, z up) with the origin
at the middle of the box; where the box stands in the drive is the caller's. The shafts lie along y, so the two bearing
panels are those at y = ± half the depth.

`Box.size_m` keeps the order of the key ``[housing] size_m = [0.45, 1.0, 0.9]``, which is read as (along the shafts,
along travel, up), that is y, x, z. Reasons: the reference wheel has a tip diameter of about 0.78 m, so both dimensions
across the shafts must be the large ones; a gearbox is flat along its shafts; and with the bearing panels 1.0 m by 0.9 m
walls and seats come to the "about 480 kg" of physics.md section 8 (469 kg, 480 with the edges counted twice). That the
longer of the two lies along travel is assumed.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Final, Literal

from tdacoustic.errors import TdacousticError

__all__ = [
    "ASSUMED_HANGER_STIFFNESS_N_PER_M",
    "ASSUMED_SEAT_STIFFNESS_N_PER_M",
    "SEAT_PLACES",
    "SHAFTS",
    "Box",
    "HousingError",
    "Seat",
    "horizontal_centres",
]

Triple = tuple[float, float, float]
Shaft = Literal["pinion", "wheel"]

SHAFTS: Final[tuple[Shaft, Shaft]] = ("pinion", "wheel")

SEAT_PLACES: Final = (("pinion", "left"), ("pinion", "right"), ("wheel", "left"), ("wheel", "right"))
"""The four seats in the order of every array over seats; left is the bearing panel at +y."""

ASSUMED_SEAT_STIFFNESS_N_PER_M: Final[Triple] = (2e7, 2e7, 2e7)
"""Of the spring between one seat and the frame [assumed].

Chosen so that the six modes of the rigid box on its springs (44 to 84 Hz for the reference) lie well below 175 Hz, the
lowest mesh frequency of the paper: above it the box answers nearly as a free one and the value hardly matters. The
stiffness of the bearings themselves (1e9 N/m) is in the gears' equations; to hold the box with it against a rigid frame
would count it twice.
"""

ASSUMED_HANGER_STIFFNESS_N_PER_M: Final[Triple] = (2e7, 2e7, 2e7)
"""Of the hanger [assumed], as soft as one seat's spring, for the same reason."""


class HousingError(TdacousticError, ValueError):
    """A housing that cannot be built or computed."""


def horizontal_centres(centre_distance_m: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return (x, z) of pinion and wheel where nothing says where the shafts are [assumed].

    The line of centres is horizontal and centred on the box, the pinion behind (at -x). The seats of the reference
    fit there; its wheel would not (its tips reach 0.64 m from the middle of a box of 1.0 m), which matters to nothing
    that is computed here.

    Examples
    --------
    >>> horizontal_centres(0.495)
    ((-0.2475, 0.0), (0.2475, 0.0))
    """
    half = 0.5 * centre_distance_m
    return (-half, 0.0), (half, 0.0)


@dataclass(frozen=True)
class Seat:
    """The two bearing seats of a shaft, one in each bearing panel: thick discs, flush with the panel's outside.

    Parameters
    ----------
    shaft : {"pinion", "wheel"}
    centre_m : (float, float)
        x and z of the shaft.
    radius_m : float
    thickness_m : float
        Of the disc, panel included.
    stiffness_n_per_m : (float, float, float)
        Springs between each of the two seats and the frame along x, y, z, spread over the disc's volume.
    gear_y_m : float
        Where along the shaft its gear stands; the lever rule splits the gear's force between the two bearings. At 0,
        the middle, each bearing takes half.

    Raises
    ------
    HousingError
        A value out of range.
    """

    shaft: Shaft
    centre_m: tuple[float, float]
    radius_m: float
    thickness_m: float = 0.06
    stiffness_n_per_m: Triple = ASSUMED_SEAT_STIFFNESS_N_PER_M
    gear_y_m: float = 0.0

    def __post_init__(self) -> None:
        if self.shaft not in SHAFTS:
            raise HousingError(f"shaft of a seat must be one of {', '.join(SHAFTS)}, got {self.shaft!r}")
        for name in ("radius_m", "thickness_m"):
            _positive(f"{name} of the {self.shaft}'s seat", getattr(self, name))
        for value in self.stiffness_n_per_m:
            _positive(f"stiffness_n_per_m of the {self.shaft}'s seat", value)


@dataclass(frozen=True)
class Box:
    """A closed welded box of plates with four bearing seats, on springs.

    Every edge is mitred and fully welded; ribs, flanges, bores, gears and oil are left out. Seats and hanger sit on
    springs that are spread over their volume.

    Parameters
    ----------
    size_m : (float, float, float)
        Outer dimensions along the shafts (y), along travel (x) and up (z): the order of ``[housing] size_m``.
    wall_m, bearing_panel_m, top_bottom_m : float
        Thickness of the end walls (normal x), bearing panels (normal y), top and bottom (normal z).
    seats : (Seat, Seat)
        Of pinion and wheel, in this order.
    modulus_pa, density_kg_m3, poisson : float
        Of the whole box; steel unless given.
    loss_factor : float
        Structural: complex stiffness K (1 + jη).
    hanger_stiffness_n_per_m : (float, float, float)
        Along x, y, z.
    hanger_radius_m : float
        Of the disc that holds the hanger, in the middle of the end wall on the pinion's side [assumed]: the wheel's end
        rests on the axle.

    Raises
    ------
    HousingError
        A value out of range; seats that leave their panel, reach into each other, or are not one a shaft.

    Examples
    --------
    >>> pinion, wheel = horizontal_centres(0.495)
    >>> box = Box((0.45, 1.0, 0.9), 0.012, 0.014, 0.01, (Seat("pinion", pinion, 0.14), Seat("wheel", wheel, 0.20)))
    >>> round(box.mass_kg)
    469
    """

    size_m: Triple
    wall_m: float
    bearing_panel_m: float
    top_bottom_m: float
    seats: tuple[Seat, Seat]
    modulus_pa: float = 210e9
    density_kg_m3: float = 7850.0
    poisson: float = 0.3
    loss_factor: float = 0.02
    hanger_stiffness_n_per_m: Triple = ASSUMED_HANGER_STIFFNESS_N_PER_M
    hanger_radius_m: float = 0.05

    def __post_init__(self) -> None:
        for name in ("wall_m", "bearing_panel_m", "top_bottom_m", "modulus_pa", "density_kg_m3", "hanger_radius_m"):
            _positive(name, getattr(self, name))
        for name in ("size_m", "hanger_stiffness_n_per_m"):
            for value in getattr(self, name):
                _positive(name, value)
        if not 0.0 <= self.poisson < 0.5:
            raise HousingError(f"poisson must be from 0 to below 0.5, got {self.poisson!r}")
        if not 0.0 < self.loss_factor <= 1.0:
            raise HousingError(f"loss_factor must be above 0 and at most 1, got {self.loss_factor!r}")
        if tuple(seat.shaft for seat in self.seats) != SHAFTS:
            found = ", ".join(seat.shaft for seat in self.seats) or "none"
            raise HousingError(f"seats must be one of the pinion and one of the wheel, in this order, got {found}")
        for side, thickness in zip("xyz", self.thickness_m, strict=True):
            if not 4.0 * thickness < self.extent_m["xyz".index(side)]:
                raise HousingError(f"panels of {thickness:g} m leave no room in a box {self.extent_m} m (x, y, z)")
        for seat in self.seats:
            self._check_place(seat)
        self._check_apart()
        if 2.0 * self.hanger_radius_m > 0.8 * min(self.extent_m[1], self.extent_m[2]):
            raise HousingError(f"hanger_radius_m = {self.hanger_radius_m:g} does not fit on the end wall")

    @property
    def extent_m(self) -> Triple:
        """Outer dimensions along x, y, z of the drive frame."""
        along_shafts, along_travel, up = self.size_m
        return along_travel, along_shafts, up

    @property
    def thickness_m(self) -> Triple:
        """Of the panels whose normals are x, y, z."""
        return self.wall_m, self.bearing_panel_m, self.top_bottom_m

    @property
    def mass_kg(self) -> float:
        """Of the box and its seats; the mitred edges count once."""
        outer = math.prod(self.extent_m)
        inner = math.prod(size - 2.0 * panel for size, panel in zip(self.extent_m, self.thickness_m, strict=True))
        discs = sum(2.0 * math.pi * s.radius_m**2 * (s.thickness_m - self.bearing_panel_m) for s in self.seats)
        return self.density_kg_m3 * (outer - inner + discs)

    def share_of_left(self, seat: Seat) -> float:
        """Part of a gear's bearing force that the bearing at +y takes: lever rule between the seats' mid planes."""
        half = 0.5 * (self.extent_m[1] - seat.thickness_m)
        return 0.5 * (1.0 + seat.gear_y_m / half)

    def _check_place(self, seat: Seat) -> None:
        x, z = seat.centre_m
        free = (0.5 * self.extent_m[0] - self.wall_m, 0.5 * self.extent_m[2] - self.top_bottom_m)
        if not (abs(x) + seat.radius_m < free[0] and abs(z) + seat.radius_m < free[1]):
            raise HousingError(
                f"the {seat.shaft}'s seat at x = {x:g} m, z = {z:g} m with radius {seat.radius_m:g} m leaves its "
                f"panel, which is free over |x| < {free[0]:g} m, |z| < {free[1]:g} m"
            )
        if not self.bearing_panel_m < seat.thickness_m < 0.5 * self.extent_m[1]:
            raise HousingError(
                f"the {seat.shaft}'s seat must be thicker than its panel, {self.bearing_panel_m:g} m, and thinner than "
                f"half the box, {0.5 * self.extent_m[1]:g} m, got {seat.thickness_m:g} m"
            )
        if not 0.0 < self.share_of_left(seat) < 1.0:
            raise HousingError(f"the {seat.shaft}'s gear at y = {seat.gear_y_m:g} m is not between its two bearings")

    def _check_apart(self) -> None:
        for one, other in itertools.combinations(self.seats, 2):
            distance = math.dist(one.centre_m, other.centre_m)
            if not distance > one.radius_m + other.radius_m:
                raise HousingError(
                    f"the seats of {one.shaft} and {other.shaft} overlap: their centres are {distance:g} m apart, "
                    f"their radii {one.radius_m:g} and {other.radius_m:g} m"
                )


def _positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise HousingError(f"{name} must be > 0, got {value!r}")
