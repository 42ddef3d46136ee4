"""The mass law of walls: a reference to hold an insertion loss against."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["field_incidence_db"]


def field_incidence_db(
    frequency_hz: ArrayLike, walls: Sequence[tuple[float, float]], impedance_pa_s_m: float
) -> NDArray[np.float64]:
    """Return the sound transmission loss of limp walls for sound from all directions up to 78° from the normal.

    R = 10 lg(1 + (ωm/2ρc)²) - 5 dB, the usual estimate of field incidence; of several walls the transmitted energies
    add by area. It knows neither stiffness, resonances nor coincidence, and it is no insertion loss: that is less by
    what the sound inside builds up.

    Parameters
    ----------
    frequency_hz : array_like, shape (n,)
    walls : sequence of (float, float)
        Area in m² and mass in kg/m².
    impedance_pa_s_m : float
        ρc.

    Examples
    --------
    12 mm of steel, 94.2 kg/m², at 500 Hz: by the rule 20 lg(mf) - 47 dB it is 46.5 dB.

    >>> round(float(field_incidence_db(500.0, [(1.0, 94.2)], 413.0)), 1)
    46.1
    """
    omega = 2.0 * math.pi * np.asarray(frequency_hz, dtype=np.float64)
    through = np.zeros(omega.shape)
    for area_m2, mass_kg_m2 in walls:
        through = through + area_m2 * 10.0**0.5 / (1.0 + (0.5 * omega * mass_kg_m2 / impedance_pa_s_m) ** 2)
    return np.asarray(-10.0 * np.log10(through / sum(area for area, _ in walls)))
