"""The modes of the air in a rectangular box, from the integrals of its walls.

Modes up to some frequency are kept one by one. Of the others the sums over the numbers along a wall's normal have an
end, so that nothing of them is lost but what a power series in k² leaves.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.cavity.box import KEPT, BoxInterior, across, check_inside, functions
from tdacoustic.cavity.modes import CavityError, CavityModes

__all__ = ["box_cavity", "with_source_at"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]
Point = tuple[float, float, float]

TERMS: Final = 3
"""Of the series in k² for the others: at the highest frequency its rest is (1/KEPT)^6 = 3 % of what the nearest do."""

_FARTHEST: Final = 400
"""Terms along a wall's normal that are summed one by one; the rest has an end."""


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
