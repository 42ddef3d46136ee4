"""Cases of sound radiated and scattered, told in numpy alone, for our boundary elements and for those of others.

With e^{+jωt}. The box is the reference housing's, its panel at y = +0.225 m vibrates like a plate on supports; the
sphere has some of every kind of motion, so that nothing is symmetric but the body; the source stands beside the box.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import eval_legendre, spherical_jn, spherical_yn

SPEED_M_S = 343.2
IMPEDANCE_PA_S_M = 413.0
BOX_M = (1.0, 0.45, 0.9)
RADIUS_M = 0.5
SOURCE_M = (0.0, 0.8, 0.1)
HALF_WAVES = (3, 2)
FAR = 50
"""So many of the receivers are at 4 m, the others at 1 m."""

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def spread(count: int, radius_m: float) -> Real:
    """Points (count, 3) spread evenly over a sphere along a spiral, turned so that no plane of symmetry holds any."""
    number = np.arange(count) + 0.5
    height, angle = 1.0 - 2.0 * number / count, math.pi * (1.0 + math.sqrt(5.0)) * number
    flat = np.sqrt(1.0 - height**2)
    points = np.stack((flat * np.cos(angle), flat * np.sin(angle), height), axis=1)
    turn = np.linalg.qr(np.array([[1.0, 0.4, -0.3], [-0.2, 1.0, 0.5], [0.6, -0.1, 1.0]]))[0]
    return np.asarray(radius_m * points @ turn.T)


def receivers() -> Real:
    """All receivers: (58, 3) in m."""
    return np.concatenate((spread(FAR, 4.0), spread(8, 1.0)))


def plate(x: Any, z: Any, half_waves: tuple[int, int] = HALF_WAVES, sine: Callable[[Any], Any] = np.sin) -> Any:
    """Velocity of the vibrating panel in m/s, 1 at its most; `sine` of what the coordinates (m) are."""
    along, up = half_waves[0] * math.pi / BOX_M[0], half_waves[1] * math.pi / BOX_M[2]
    return sine(along * (x + 0.5 * BOX_M[0])) * sine(up * (z + 0.5 * BOX_M[2]))


MOTIONS: dict[int, Callable[[Real], Real]] = {
    0: lambda u: np.ones(len(u)),
    1: lambda u: 0.7 * u[:, 0] - 0.4 * u[:, 2],
    2: lambda u: 2.0 * u[:, 0] * u[:, 1],
    3: lambda u: 0.5 * (5.0 * u[:, 2] ** 3 - 3.0 * u[:, 2]),
    5: lambda u: np.asarray(eval_legendre(5, u @ [0.6, 0.0, 0.8])),
}
"""Of the sphere, in m/s: degree of the spherical harmonic, and its value in directions (n, 3)."""


def ball(points_m: Real) -> Real:
    """Velocity of the sphere in m/s."""
    directions = points_m / np.linalg.norm(points_m, axis=1, keepdims=True)
    return np.asarray(sum(motion(directions) for motion in MOTIONS.values()))


def ball_pressures(points_m: Real, wave_number_rad_m: float) -> Complex:
    """Return the exact pressures of the sphere at points: p = -jρc Σ h_n(kr) / h_n'(ka) Y_n."""

    def hankel(n: int, x: Any, slope: bool = False) -> Any:
        return spherical_jn(n, x, slope) - 1j * spherical_yn(n, x, slope)

    distance = np.linalg.norm(points_m, axis=1)
    terms = [
        hankel(n, wave_number_rad_m * distance)
        / hankel(n, wave_number_rad_m * RADIUS_M, True)
        * motion(points_m / distance[:, None])
        for n, motion in MOTIONS.items()
    ]
    return np.asarray(-1j * IMPEDANCE_PA_S_M * sum(terms))


@dataclass(frozen=True)
class Case:
    """One body at one frequency: vibrating (Pa at 1 m/s), or rigid beside the source (Pa of the scattered part)."""

    body: Literal["sphere", "box"]
    what: Literal["vibrating", "scattering"]
    wave_number_rad_m: float
    name: str


def _box(what: Literal["vibrating", "scattering"], frequency_hz: float) -> Case:
    kind = "panel of the box, 3 x 2 half waves" if what == "vibrating" else "rigid box, point source"
    return Case("box", what, 2.0 * math.pi * frequency_hz / SPEED_M_S, f"{kind}, {frequency_hz:g} Hz")


BOX_HZ = (200.0, 525.0, 1000.0, 1500.0)
SPHERES = tuple(Case("sphere", "vibrating", ka / RADIUS_M, f"sphere, ka = {ka:g}") for ka in (2.0, 6.0))
PANELS = tuple(_box("vibrating", frequency) for frequency in BOX_HZ)
SCATTERINGS = tuple(_box("scattering", frequency) for frequency in BOX_HZ)
CASES = (*SPHERES, *PANELS, *SCATTERINGS)


def hashed(paths: list[Path]) -> str:
    """Return the SHA-256 of text files; the ends of lines do not count."""
    held = hashlib.sha256()
    for path in paths:
        text = path.read_text(encoding="utf-8")  # universal newlines: CRLF is read as LF
        held.update(f"{path.parent.name}/{path.name}\n{text}\n".encode())
    return held.hexdigest()
