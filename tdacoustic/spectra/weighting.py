"""Frequency weightings as analytic curves, to be applied to spectra."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["A_POLES_HZ", "a_weighting_db"]

A_POLES_HZ = _F1_HZ, _F2_HZ, _F3_HZ, _F4_HZ = (20.598997, 107.65265, 737.86223, 12194.217)
"""Pole frequencies of the A curve (IEC 61672-1:2013, 5.4.6 and Annex E)."""


def _a_response(frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]:
    square = frequency_hz**2
    return (
        _F4_HZ**2
        * square**2
        / ((square + _F1_HZ**2) * np.sqrt((square + _F2_HZ**2) * (square + _F3_HZ**2)) * (square + _F4_HZ**2))
    )


def a_weighting_db(frequency_hz: ArrayLike) -> NDArray[np.float64]:
    """A-weighting, 0 dB at 1 kHz; minus infinity at 0 Hz.

    Source: IEC 61672-1:2013, formula (E.6).

    Examples
    --------
    >>> round(float(a_weighting_db(100.0)), 1)
    -19.1
    """
    with np.errstate(divide="ignore"):
        response = _a_response(np.asarray(frequency_hz, dtype=np.float64))
        return np.asarray(20.0 * np.log10(response / _a_response(np.array(1000.0))))
