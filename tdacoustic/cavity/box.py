"""The cavity of a rectangular box: cosines between six flat walls.

Coordinates are those of the middle of the box. Along an axis of length L the functions are √ε cos(lπu/L), u from the
wall at the negative end, ε = 1 of l = 0 and 2 of the others; products of three have a mean square of 1. A wall's
displacement enters by its integrals with the products of the two functions along it, from which everything follows: the
coupling of every mode, and the sums over all modes that are not kept, which have an end along the wall's normal.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.cavity.modes import CavityError, CavityModes
from tdacoustic.housing import Box, HousingModes
from tdacoustic.housing.solid_grid import PANELS

__all__ = [
    "CLEARANCE_M",
    "BoxInterior",
    "box_cavity",
    "box_interior",
    "check_inside",
    "inner_size_m",
    "interior_of",
    "wall_displacements",
    "with_source_at",
]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]
Point = tuple[float, float, float]
Outward = Callable[[Real, Real], Real]

CLEARANCE_M: Final = 0.02
"""Least distance of a source from the walls [assumed]: nearer, the walls would be in its near field."""

KEPT: Final = 1.75
"""Modes are kept up to this times the highest frequency; the others are a power series in k²."""

TERMS: Final = 3
"""Of that series: at the highest frequency the rest of it is (1/KEPT)^6 = 3 % of what the nearest of those modes do."""

REACH: Final = 3.0
"""Wave numbers along walls up to this times those of the walls' shortest bending waves."""

_FARTHEST: Final = 400
"""Terms along a wall's normal that are summed one by one; the rest has an end."""


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


def box_cavity(
    interior: BoxInterior,
    highest_hz: float,
    source_m: Point,
    sound_speed_m_s: float,
    density_kg_m3: float,
    kept: float = KEPT,
    terms: int = TERMS,
) -> CavityModes:
    """Return the modes of a box's cavity with a source in it.

    Parameters
    ----------
    interior : BoxInterior
    highest_hz : float
    source_m : (float, float, float)
        From the middle of the box.
    sound_speed_m_s, density_kg_m3 : float
    kept, terms
        See `KEPT` and `TERMS`.

    Raises
    ------
    CavityError
        The source is not inside, `CLEARANCE_M` from the walls at least; or the interior's functions do not reach.
    """
    check_inside(interior.size_m, source_m)
    reach = kept * 2.0 * math.pi * highest_hz / sound_speed_m_s
    least = min(interior.counts[axis] * math.pi / interior.size_m[axis] for axis in range(3))
    if not least > reach * (1.0 - 1e-9):
        raise CavityError(f"functions up to {least:.4g} rad/m along the walls do not reach {reach:.4g} rad/m")
    numbers, squares = _numbers(interior, reach)
    wall_modes = len(interior.walls[0])
    beyond = np.zeros((terms, wall_modes, wall_modes))
    for axis in range(3):
        _add_normal_sums(interior, axis, reach, beyond)
    for first, second in itertools.combinations(range(3), 2):
        _add_cross_sums(interior, first, second, reach, beyond)
    return CavityModes(
        interior.volume_m3,
        sound_speed_m_s,
        density_kg_m3,
        highest_hz,
        np.sqrt(squares),
        _coupling(interior, numbers),
        beyond,
        *_of_source(interior, numbers, reach, source_m, terms),
    )


def with_source_at(interior: BoxInterior, cavity: CavityModes, source_m: Point) -> CavityModes:
    """Return the modes of a box's cavity with the source elsewhere, from `box_cavity` of the same interior.

    Raises
    ------
    CavityError
        As of `box_cavity`.
    """
    check_inside(interior.size_m, source_m)
    reach = float(cavity.wave_number_rad_m[-1]) * (1.0 + 1e-9)
    numbers, _ = _numbers(interior, reach)
    at_source, of_source = _of_source(interior, numbers, reach, source_m, len(cavity.source_beyond))
    return replace(cavity, source=at_source, source_beyond=of_source)


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


def _numbers(interior: BoxInterior, reach_rad_m: float) -> tuple[Whole, Real]:
    """Return the numbers along x, y, z of the modes up to a wave number, rising, and k_n²."""
    squares = [interior.wave_numbers(axis) ** 2 for axis in range(3)]
    whole = squares[0][:, None, None] + squares[1][None, :, None] + squares[2]
    numbers = np.argwhere(whole <= reach_rad_m**2)
    held = whole[tuple(numbers.T)]
    order = np.argsort(held, kind="stable")
    return numbers[order], held[order]


def _signs(number: int) -> Real:
    """(-1)^l: the functions at the positive end against the negative one."""
    return np.where(np.arange(number) % 2, -1.0, 1.0)


def _weights(number: int) -> Real:
    """√ε: the functions at the negative end."""
    found = np.full(number, math.sqrt(2.0))
    found[0] = 1.0
    return found


def _coupling(interior: BoxInterior, numbers: Whole) -> Real:
    """Return the integrals of modes with wall modes over all walls, shape (modes, wall modes)."""
    found = np.zeros((len(numbers), len(interior.walls[0])))
    for axis in range(3):
        first, second = across(axis)
        low, high = (wall[:, numbers[:, first], numbers[:, second]].T for wall in interior.pair(axis))
        along, count = numbers[:, axis], interior.counts[axis]
        found += _weights(count)[along, None] * (low + _signs(count)[along, None] * high)
    return found


def _far_parts(interior: BoxInterior, axis: int, reach_rad_m: float) -> tuple[Real, Real]:
    """Return ε and k_n² by numbers along the two walls of an axis and along it; ε is 0 of the modes that are kept."""
    first, second = across(axis)
    length = interior.size_m[axis]
    squares = interior.wave_numbers(first)[:, None] ** 2 + interior.wave_numbers(second)[None, :] ** 2
    along = np.arange(_FARTHEST)
    whole = squares[..., None] + (along * math.pi / length) ** 2
    epsilon = np.where(whole > reach_rad_m**2, np.where(along > 0, 2.0, 1.0), 0.0)
    whole[epsilon == 0.0] = 1.0
    return epsilon, whole


def _of_source(
    interior: BoxInterior, numbers: Whole, reach_rad_m: float, source_m: Point, terms: int
) -> tuple[Real, Real]:
    """Return the kept modes at the source, and what the others do between the source and the walls."""
    sizes = zip(interior.counts, source_m, interior.size_m, strict=True)
    ways = [functions(count, [place], size)[:, 0] for count, place, size in sizes]
    at_source = ways[0][numbers[:, 0]] * ways[1][numbers[:, 1]] * ways[2][numbers[:, 2]]
    beyond = np.zeros((terms, len(interior.walls[0])))
    signs = _signs(_FARTHEST)
    for axis in range(3):
        first, second = across(axis)
        epsilon, whole = _far_parts(interior, axis, reach_rad_m)
        along = np.cos(np.arange(_FARTHEST) * math.pi * (source_m[axis] / interior.size_m[axis] + 0.5))
        ends = np.column_stack([along, along * signs])
        low, high = (wall.reshape(len(wall), -1) for wall in interior.pair(axis))
        along_walls = np.outer(ways[first], ways[second]).ravel()
        for term in range(terms):
            epsilon = epsilon / whole
            near, far = (epsilon.reshape(-1, _FARTHEST) @ ends).T
            beyond[term] += low @ (near * along_walls) + high @ (far * along_walls)
    return at_source, beyond


def _add_normal_sums(interior: BoxInterior, axis: int, reach_rad_m: float, beyond: Real) -> None:
    """Add what modes beyond the kept ones do between the two walls of an axis.

    For each pair of numbers along the walls the sum over all numbers along the normal is taken from the first that is
    not kept.
    """
    epsilon, whole = _far_parts(interior, axis, reach_rad_m)
    low, high = (wall.reshape(len(wall), -1) for wall in interior.pair(axis))
    signs = _signs(_FARTHEST)
    for term in range(len(beyond)):
        epsilon = epsilon / whole
        same = epsilon.sum(axis=-1)
        if term == 0:
            same += 2.0 * (interior.size_m[axis] / math.pi) ** 2 / (_FARTHEST - 0.5)
        apart = (epsilon @ signs).ravel()
        both = (low * apart) @ high.T
        beyond[term] += (low * same.ravel()) @ low.T + (high * same.ravel()) @ high.T + both + both.T


def _add_cross_sums(interior: BoxInterior, first: int, second: int, reach_rad_m: float, beyond: Real) -> None:
    """Add what modes beyond the kept ones do between walls of two axes that meet at edges."""
    third = next(axis for axis in range(3) if axis not in (first, second))
    counts = interior.counts
    squares = interior.wave_numbers(first)[:, None] ** 2 + interior.wave_numbers(second)[None, :] ** 2
    ends = _weights(counts[first])[:, None] * _weights(counts[second])[None, :]
    of_first, of_second = _signs(counts[first])[:, None], _signs(counts[second])[None, :]
    one = [np.moveaxis(wall, across(first).index(third) + 1, 0) for wall in interior.pair(first)]
    other = [np.moveaxis(wall, across(second).index(third) + 1, 0) for wall in interior.pair(second)]
    for number, along in enumerate(interior.wave_numbers(third)):
        whole = squares + along**2
        far = np.where(whole > reach_rad_m**2, ends, 0.0)
        whole[far == 0.0] = 1.0
        for term in range(len(beyond)):
            parts = far / whole ** (term + 1)
            # (first, second) times walls of the first axis by their numbers along the second, and the other way round
            through = (parts @ one[0][number].T) + (of_first * parts) @ one[1][number].T
            turned = ((parts * of_second) @ one[0][number].T) + (of_first * parts * of_second) @ one[1][number].T
            both = through.T @ other[0][number].T + turned.T @ other[1][number].T
            beyond[term] += both + both.T
