"""Pressures at many points around a box at one frequency, up to its walls.

The surface's pressures are solved for once, then the representation outside is summed for every point. Receivers of
`ExteriorProblem` keep a panel off the body; these need not, because the integrals over a panel of constant pressure are
split towards the point until they are exact. What is left is the constant pressure of the panels: against sources
inside a box of the reference housing's size the error is 0.4 to 0.6 dB rms 2 mm off the wall and 0.1 to 0.3 dB a panel
off it, at 525 to 1500 Hz on their own grids, minima of the pressure counted with all else (test).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.radiation.box_in_air import LEAST_ELEMENTS_PER_WAVELENGTH, BoxInAir
from tdacoustic.radiation.surfaces import Surface

__all__ = ["AT_SOURCE_M", "NEAREST_M", "beyond_walls_m", "off_the_walls", "pressures_outside"]

Real = NDArray[np.float64]
Complex = NDArray[np.complexfloating[Any, Any]]

NEAREST_M: Final = 0.002
"""Points on a wall, or nearer to it than this, take the pressure at this distance from it [assumed]."""

AT_SOURCE_M: Final = 1e-3
"""Points nearer to a point source than this have no pressure."""

_POINTS_AT_ONCE: Final = 512


def beyond_walls_m(body: BoxInAir, points_m: Real) -> Real:
    """Return how far points (n, 3) lie beyond the nearest of the box's six planes; below zero inside: (n,)."""
    return _beyond(body, points_m).max(axis=1)


def _beyond(body: BoxInAir, points_m: Real) -> Real:
    return np.asarray(np.abs(points_m - np.asarray(body.position_m)) - 0.5 * np.asarray(body.extent_m))


def off_the_walls(body: BoxInAir, points_m: Real) -> Real:
    """Return points (n, 3) outside of a box with those on its walls moved `NEAREST_M` off them."""
    beyond = _beyond(body, points_m)
    axis, rows = beyond.argmax(axis=1), np.arange(len(points_m))
    lacking = np.maximum(NEAREST_M - beyond[rows, axis], 0.0)
    moved = points_m.copy()
    moved[rows, axis] += np.copysign(lacking, points_m[rows, axis] - np.asarray(body.position_m)[axis])
    return moved


def pressures_outside(
    body: BoxInAir,
    surface: Surface,
    frequency_hz: float,
    points_m: Real,
    velocities_m_s: Complex,
    sources: tuple[int, ...] = (),
) -> NDArray[np.complex64]:
    """Return the pressures of velocities of the box, and of its sources beside it, where it is rigid.

    Parameters
    ----------
    body : BoxInAir
    surface : Surface
        Its grid, fine enough for the frequency.
    frequency_hz : float
    points_m : ndarray, shape (points, 3)
        Outside of the box or on it, and above the ground.
    velocities_m_s : ndarray, shape (panels, n)
        Out of the box.
    sources : tuple of int
        Numbers among ``body.sources_m``; each of 1 Pa at 1 m in free space.

    Returns
    -------
    ndarray
        (points, n + sources), in Pa; NaN at a source itself (`AT_SOURCE_M`).
    """
    from tdacoustic.radiation.boundary_elements import ExteriorProblem

    wave = body.wave_number_rad_m(frequency_hz)
    impedance, least = body.impedance_pa_s_m, 0.99 * LEAST_ELEMENTS_PER_WAVELENGTH
    problem = ExteriorProblem(surface, wave, impedance, body.ground_m, least_panels_per_wavelength=least)
    pressures = [problem.pressures(velocities_m_s)] if velocities_m_s.shape[1] else []
    if sources:
        pressures.append(problem.blocked_pressures([body.sources_m[source] for source in sources]))
    count = velocities_m_s.shape[1]
    found = np.zeros((len(points_m), count + len(sources)), dtype=np.complex64)
    if not pressures:
        return found
    on_panels = np.concatenate(pressures, axis=1)
    slopes = np.zeros_like(on_panels)
    slopes[:, :count] = 1j * wave * impedance * velocities_m_s
    places = off_the_walls(body, np.asarray(points_m, dtype=np.float64))
    for start in range(0, len(places), _POINTS_AT_ONCE):
        some = slice(start, start + _POINTS_AT_ONCE)
        found[some] = _represented(surface, wave, body.ground_m, places[some], on_panels, slopes)
    for column, source in enumerate(sources, count):
        alone = replace(body, sources_m=(body.sources_m[source],))
        apart = np.linalg.norm(places - np.asarray(alone.sources_m), axis=1) >= AT_SOURCE_M
        found[apart, column] += alone.direct(frequency_hz, places[apart])[:, 0]
        found[~apart, column] = np.nan
    return found


def _represented(
    surface: Surface, wave: float, ground_m: float | None, places_m: Real, pressures: Complex, slopes: Complex
) -> Complex:
    """Return the field outside of the pressures and of jkρc times the velocities on all panels: (places, n)."""
    from tdacoustic.radiation.panel_integrals import assembled

    mirrors = surface.mirrors

    def parts(field: Complex) -> Complex:
        return np.asarray(mirrors.summed(field.reshape(mirrors.count, -1, field.shape[1])) / mirrors.count)

    double, single = assembled(
        surface, places_m, np.zeros_like(places_m), wave, 0.0, ground_m, np.complex64, on_panels=False
    )
    return np.asarray(np.matmul(single, parts(slopes)).sum(axis=0) - np.matmul(double, parts(pressures)).sum(axis=0))
