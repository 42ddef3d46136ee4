"""Critical bands of hearing, and thresholds, as the standards on tones give them."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

__all__ = [
    "arithmetic_or_geometric_band",
    "critical_bandwidth_hz",
    "geometric_band",
    "hearing_threshold_db",
    "masking_index_db",
    "separation_hz",
]

ARITHMETIC_UP_TO_HZ: Final = 500.0
"""ECMA-418-1:2024, clause 10: up to here the edges lie symmetrically in Hz, above geometrically."""

_THRESHOLD: Final = (
    (20.0, 305.0, 167.5, 87.3212, (1.415532, -2.451068, 1.498869, -6.983224, 8.621226)),
    (305.0, 2230.0, 1157.5, 488.582, (0.397994, -0.891839, -0.815138, -1.221319, -7.600754)),
    (2230.0, 14000.0, 7250.0, 3033.25, (1.584978, -2.766599, -6.9061912, 10.138553, -3.149339)),
    (14000.0, 22050.0, 16990.0, 4049.0, (-5.775593, -9.200034, 26.59115, 52.16712, 15.61552048)),
)
"""From, to, mean, spread and coefficients of a fourth-order polynomial: ECMA-74, D.7.1, which ECMA-418-1 took over as
its formula (1); as read from MoSQITo 1.2 (Apache-2.0). The pieces meet within 0.01 dB, which a test holds."""


def critical_bandwidth_hz(frequency_hz: float) -> float:
    """Return the width of the critical band around a tone.

    ``25 + 75 (1 + 1.4 (f / 1 kHz)²)^0.69`` Hz: ECMA-418-1:2024, formula (2);
    the same in ISO/PAS 20065:2016 and DIN 45681:2005, formula (2).

    Examples
    --------
    >>> round(critical_bandwidth_hz(1000.0), 1)
    162.2
    """
    return float(25.0 + 75.0 * (1.0 + 1.4 * (frequency_hz / 1000.0) ** 2) ** 0.69)


def geometric_band(frequency_hz: float) -> tuple[float, float]:
    """Return the edges of the critical band, with the tone at their geometric mean.

    ISO/PAS 20065:2016, formulas (3) to (5); ECMA-418-1:2024, formulas (7) and (8).

    Examples
    --------
    >>> tuple(round(edge, 1) for edge in geometric_band(1000.0))
    (922.2, 1084.4)
    """
    width = critical_bandwidth_hz(frequency_hz)
    low = 2.0 * frequency_hz**2 / (width + math.hypot(width, 2.0 * frequency_hz))
    return low, low + width


def arithmetic_or_geometric_band(frequency_hz: float) -> tuple[float, float]:
    """Return the edges of the critical band of ECMA-418-1:2024, formulas (4) to (8).

    Up to 500 Hz the tone lies in the middle in Hz, above at the geometric mean.
    """
    if frequency_hz > ARITHMETIC_UP_TO_HZ:
        return geometric_band(frequency_hz)
    half = 0.5 * critical_bandwidth_hz(frequency_hz)
    return frequency_hz - half, frequency_hz + half


def separation_hz(frequency_hz: float) -> float:
    """Return how far apart two tones of one critical band must lie to be heard as two, below 1 kHz.

    ``21 · 10^(1.2 |lg(f / 212 Hz)|^1.8)`` Hz: ECMA-418-1:2024, formula (14), at the
    primary tone; ISO/PAS 20065:2016, formula (19), at the more audible one.

    Examples
    --------
    >>> round(separation_hz(150.0), 1), round(separation_hz(850.0), 1)
    (23.0, 63.8)
    """
    return float(21.0 * 10.0 ** (1.2 * abs(math.log10(frequency_hz / 212.0)) ** 1.8))


def masking_index_db(frequency_hz: float) -> float:
    """Return the masking index a_v, ``-2 - lg(1 + (f / 502 Hz)^2.5)`` dB (ISO/PAS 20065:2016, formula (13)).

    Examples
    --------
    >>> round(masking_index_db(137.3), 2)
    -2.02
    """
    return float(-2.0 - math.log10(1.0 + (frequency_hz / 502.0) ** 2.5))


def hearing_threshold_db(frequency_hz: float) -> float | None:
    """Return the lower threshold of hearing, dB re 20 uPa; None beyond 20 Hz to 22.05 kHz.

    The level that the best-hearing percent of people hear (ECMA-418-1, formula (1)).

    Examples
    --------
    >>> round(hearing_threshold_db(1000.0), 1)
    -7.3
    """
    for low, high, mean, spread, coefficients in _THRESHOLD:
        if low <= frequency_hz < high:
            return float(np.polyval(coefficients, (frequency_hz - mean) / spread))
    return None
