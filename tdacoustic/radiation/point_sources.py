"""The field of point sources in free space or over rigid ground.

A sound power level and a sound pressure level are joined by the surface alone, L_p = L_W - 10 lg(4π r²): at 1 m 11 dB,
at 4 m 23.03 dB (physics.md sections 4 and 8). That takes ρc for 400 Pa s/m, which is 0.1 dB off at 20 °C.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import RadiationError

__all__ = ["Space", "mean_over_sphere_db", "overall_level_db", "transfer_db"]

Space = Literal["free", "half"]
Point = tuple[float, float, float]


def mean_over_sphere_db(radius_m: float, space: Space = "free") -> float:
    """Return the level, averaged in energy over a sphere or the half sphere above ground, less the sound power level.

    Examples
    --------
    >>> round(mean_over_sphere_db(4.0), 2), round(mean_over_sphere_db(4.0, "half"), 2)
    (-23.03, -20.02)
    """
    if not radius_m > 0.0:
        raise RadiationError(f"radius must be > 0 m, got {radius_m!r}")
    return -10.0 * math.log10((4.0 if space == "free" else 2.0) * math.pi * radius_m**2)


def transfer_db(
    source_m: Point, receiver_m: Point, frequency_hz: ArrayLike, sound_speed_m_s: float, ground_m: float | None = None
) -> NDArray[np.float64]:
    """Return the level at a point less the sound power level of a point source, for each frequency.

    Over rigid ground the image source adds its pressure with its phase; the source keeps its free-field power.

    Parameters
    ----------
    source_m, receiver_m : (float, float, float)
        z upwards.
    frequency_hz : array_like
    sound_speed_m_s : float
    ground_m : float, optional
        Height z of rigid ground; None of free space.

    Raises
    ------
    RadiationError
        The receiver is at the source, or one of them is below the ground.
    """
    direct = math.dist(source_m, receiver_m)
    if not direct > 0.0:
        raise RadiationError(f"the receiver at {receiver_m} m is at the source itself")
    wave_number = 2.0 * math.pi * np.asarray(frequency_hz, dtype=np.float64) / sound_speed_m_s
    pressure = np.exp(-1j * wave_number * direct) / direct
    if ground_m is not None:
        if min(source_m[2], receiver_m[2]) < ground_m:
            raise RadiationError(f"source or receiver is below the ground at z = {ground_m:g} m")
        image = math.dist((*source_m[:2], 2.0 * ground_m - source_m[2]), receiver_m)
        pressure = pressure + np.exp(-1j * wave_number * image) / image
    with np.errstate(divide="ignore"):
        return np.asarray(20.0 * np.log10(np.abs(pressure)) - 10.0 * math.log10(4.0 * math.pi))


def overall_level_db(
    levels_db: ArrayLike, reading: Literal["lines", "density"] = "lines", bandwidth_hz: ArrayLike | None = None
) -> float | None:
    """Return the overall level of parts: equation (7) in one of its two readings.

    Parameters
    ----------
    levels_db : array_like
    reading : {"lines", "density"}
        ``"lines"``: the parts are levels of lines, and their energies add. ``"density"``: they are levels per hertz,
        each times the bandwidth it stands for; the equation as printed is right only then (physics.md section 8).
    bandwidth_hz : array_like, optional
        Δf of each part, in the reading ``"density"``.

    Returns
    -------
    float or None
        None of no parts.

    Examples
    --------
    >>> round(overall_level_db([80.0, 80.0]), 2)
    83.01
    >>> round(overall_level_db([80.0, 80.0], "density", [175.0, 175.0]), 2)
    105.44
    """
    levels = np.asarray(levels_db, dtype=np.float64)
    if reading == "density":
        if bandwidth_hz is None:
            raise RadiationError("levels per hertz need the bandwidth each of them stands for")
        weights = np.broadcast_to(np.asarray(bandwidth_hz, dtype=np.float64), levels.shape)
    else:
        weights = np.ones_like(levels)
    energy = float((weights * 10.0 ** (levels / 10.0)).sum())
    return 10.0 * math.log10(energy) if energy > 0.0 else None
