"""The inside of a rectangular box: its size, its six flat walls, and how they displace the air.

Coordinates are those of the middle of the box. Along an axis of length L the functions are √ε cos(lπu/L), u from the
wall at the negative end, ε = 1 of l = 0 and 2 of the others; products of three have a mean square of 1. A wall's
displacement enters by its integrals with the products of the two functions along it, from which everything follows: the
modes of the air (`tdacoustic.cavity.box_modes`) and the pressure anywhere in it (`tdacoustic.cavity.pressure`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.cavity.modes import CavityError
from tdacoustic.housing import Box, HousingModes
from tdacoustic.housing.solid_grid import PANELS

__all__ = [
    "CLEARANCE_M",
    "BoxInterior",
    "box_interior",
    "check_inside",
    "inner_size_m",
    "interior_of",
    "wall_displacements",
]

Real = NDArray[np.float64]
Point = tuple[float, float, float]
Outward = Callable[[Real, Real], Real]

CLEARANCE_M: Final = 0.02
"""Least distance of a source from the walls [assumed]: nearer, the walls would be in its near field."""

KEPT: Final = 1.75
"""Modes are kept up to this times the highest frequency; the others are a power series in k²."""

REACH: Final = 3.0
"""Wave numbers along walls up to this times those of the walls' shortest bending waves."""


@dataclass(frozen=True)
class BoxInterior:
    """The walls of a rectangular cavity and how each of their modes displaces the air.

    Parameters
    ----------
    size_m : (float, float, float)
        Inner lengths along x, y, z.
    walls : tuple of six ndarrays, each of shape (wall modes, m, n)
        In the order of `PANELS`: integrals of the outward displacement, in 1/√kg, with the products of the functions
        along the wall's two axes, those in the order x, y, z.

    Raises
    ------
    CavityError
        A length that is not above zero, or walls that are not six.
    """

    size_m: Point
    walls: tuple[Real, ...]

    def __post_init__(self) -> None:
        if not all(math.isfinite(size) and size > 0.0 for size in self.size_m):
            raise CavityError(f"inner lengths of a box must be > 0 m, got {self.size_m}")
        if len(self.walls) != len(PANELS):
            raise CavityError(f"a box has {len(PANELS)} walls, got {len(self.walls)}")
        for wall in self.walls:
            wall.flags.writeable = False

    @property
    def volume_m3(self) -> float:
        """Of the air; seats, gears and oil take none."""
        return math.prod(self.size_m)

    @property
    def surface_m2(self) -> float:
        """Of the six walls."""
        return 2.0 * sum(one * other for one, other in itertools.combinations(self.size_m, 2))

    @property
    def counts(self) -> tuple[int, int, int]:
        """Number of functions along x, y, z."""
        found = [0, 0, 0]
        for wall, axis in zip(self.walls[::2], (1, 0, 2), strict=True):  # PANELS: y, x, z
            first, second = across(axis)
            found[first], found[second] = wall.shape[1:]
        return found[0], found[1], found[2]

    def wave_numbers(self, axis: int) -> Real:
        """Return lπ/L of the functions along an axis."""
        return np.asarray(np.arange(self.counts[axis]) * math.pi / self.size_m[axis])

    def pair(self, axis: int) -> tuple[Real, Real]:
        """Return the integrals of the walls at the negative and at the positive end of an axis."""
        found = {sign: wall for (name, sign), wall in zip(PANELS, self.walls, strict=True) if name == "xyz"[axis]}
        return found[-1], found[1]

    def contains(self, point_m: ArrayLike, clearance_m: float = 0.0) -> bool:
        """Whether a point lies in the air, some way off the walls."""
        place = np.abs(np.asarray(point_m, dtype=np.float64))
        return bool((place <= 0.5 * np.asarray(self.size_m) - clearance_m + 1e-12).all())


def across(axis: int) -> tuple[int, int]:
    """Return the two axes along a wall whose normal is an axis."""
    first, second = (other for other in range(3) if other != axis)
    return first, second


def functions(number: int, places_m: ArrayLike, length_m: float) -> Real:
    """Return the first functions √ε cos(lπu/L) at places from the middle, shape (number, places)."""
    u = np.asarray(places_m, dtype=np.float64) + 0.5 * length_m
    found = np.cos(np.outer(np.arange(number), np.pi * u / length_m))
    found[1:] *= math.sqrt(2.0)
    return np.asarray(found)


def wall_displacements(modes: HousingModes) -> Outward:
    """Return a function from points on inner walls and their outward normals to the outward displacement of all modes.

    A wall is thin against its bending waves: its inner face moves along its normal as the outer one does beside it. The
    seats' discs, which stand into the cavity, are left out.

    Parameters
    ----------
    modes : HousingModes
    """
    from scipy.sparse import csr_array

    half = 0.5 * np.asarray(modes.box.extent_m)

    def outward(points_m: Real, normals: Real) -> Real:
        outer = np.where(np.abs(normals) > 0.5, normals * half, points_m)
        nodes, weights = modes.surface.weights(outer, normals)
        rows = np.repeat(np.arange(len(outer)), nodes.shape[1])
        picked = csr_array((weights.ravel(), (rows, nodes.ravel())), shape=(len(outer), modes.outward.shape[1]))
        return np.asarray((picked @ modes.outward.T).T)

    return outward


def box_interior(size_m: Point, outward: Outward, bending_rad_m: float, reach_rad_m: float) -> BoxInterior:
    """Return the cavity of a box with walls that move.

    Each wall's integrals are a tensor rule of Gauss and Legendre, fine enough for the products of its bending waves and
    the functions of the air along it, done as matrix products.

    Parameters
    ----------
    size_m : (float, float, float)
        Inner lengths.
    outward : callable
        From points (n, 3) on the inner walls and outward normals (n, 3) to the outward displacement of the wall modes,
        shape (wall modes, n), in 1/√kg.
    bending_rad_m : float
        Largest wave number of the walls' own waves.
    reach_rad_m : float
        Largest wave number of functions along the walls.
    """
    counts = [math.floor(reach_rad_m * size / math.pi) + 1 for size in size_m]
    rules = []
    for size, count in zip(size_m, counts, strict=True):
        number = math.ceil(0.5 * (reach_rad_m + bending_rad_m) * size) + 24
        ends, weights = np.polynomial.legendre.leggauss(number)
        places = 0.5 * size * ends
        rules.append((places, functions(count, places, size) * (0.5 * size * weights)))
    walls = []
    for name, sign in PANELS:
        axis = "xyz".index(name)
        first, second = across(axis)
        u, v = np.meshgrid(rules[first][0], rules[second][0], indexing="ij")
        points, normals = np.zeros((u.size, 3)), np.zeros((u.size, 3))
        points[:, first], points[:, second], points[:, axis] = u.ravel(), v.ravel(), 0.5 * sign * size_m[axis]
        normals[:, axis] = sign
        moved = outward(points, normals).reshape(-1, *u.shape)
        walls.append(rules[first][1] @ moved @ rules[second][1].T)
    return BoxInterior(size_m, tuple(walls))


def inner_size_m(box: Box) -> Point:
    """Return the lengths of a box's cavity along x, y, z; its seats, which stand into it, are left out."""
    x, y, z = (size - 2.0 * panel for size, panel in zip(box.extent_m, box.thickness_m, strict=True))
    return x, y, z


def interior_of(box: Box, modes: HousingModes, sound_speed_m_s: float, reach: float = REACH) -> BoxInterior:
    """Return the cavity of a housing's box.

    Parameters
    ----------
    box : Box
    modes : HousingModes
        Of it.
    sound_speed_m_s : float
    reach : float
        See `REACH`.
    """
    omega = 2.0 * math.pi * float(modes.frequency_hz[: modes.natural].max(initial=modes.highest_hz))
    rigidity = box.modulus_pa * min(box.thickness_m) ** 2 / (12.0 * (1.0 - box.poisson**2) * box.density_kg_m3)
    bending = math.sqrt(omega / math.sqrt(rigidity))
    kept = KEPT * 2.0 * math.pi * modes.highest_hz / sound_speed_m_s
    return box_interior(inner_size_m(box), wall_displacements(modes), bending, max(reach * bending, kept))


def check_inside(size_m: Point, source_m: Point) -> None:
    """Raise for a source that is not in a cavity of an inner size, `CLEARANCE_M` from its walls at least.

    Raises
    ------
    CavityError
    """
    most = [0.5 * size - CLEARANCE_M for size in size_m]
    if all(abs(place) <= half + 1e-12 for place, half in zip(source_m, most, strict=True)):
        return
    ends = ", ".join(f"|{axis}| < {half:.4g} m" for axis, half in zip("xyz", most, strict=True))
    raise CavityError(
        f"the source at {tuple(round(place, 6) for place in source_m)} m from the middle of the housing is not inside "
        f"it, {1e3 * CLEARANCE_M:g} mm off the walls: {ends}"
    )
