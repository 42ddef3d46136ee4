"""From which level on a tone at a frequency would be prominent, or audible: curves for a figure of a spectrum."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tdacoustic.spectra import Spectrum
from tdacoustic.tones.audibility import HIGHEST_HZ, ISO_TS_20065
from tdacoustic.tones.critical_bands import arithmetic_or_geometric_band, geometric_band, masking_index_db
from tdacoustic.tones.ecma_418 import RANGE_HZ, ratio_criterion_db
from tdacoustic.units import REFERENCES

__all__ = ["audible_level_db", "prominent_level_db"]

Array = NDArray[np.float64]


def prominent_level_db(spectrum: Spectrum, floor: Array, frequencies_hz: Sequence[float] | Array) -> Array:
    """Return the level from which a tone would be prominent by its tone-to-noise ratio (ECMA-418-1).

    The floor's level in the critical band around a frequency, plus the criterion there. A tone's own ratio is taken
    with the noise beside it (formula (10)), which is not quite the floor.

    Parameters
    ----------
    spectrum : Spectrum
        Of a sound pressure.
    floor : ndarray
        Density of the spectrum without its lines.
    frequencies_hz : sequence of float

    Returns
    -------
    ndarray, shape (n,)
        dB re 20 uPa, unweighted; NaN outside of `RANGE_HZ` and where the critical band reaches beyond the spectrum.
    """
    found = []
    for frequency_hz in map(float, frequencies_hz):
        noise_db = _noise_db(spectrum, floor, arithmetic_or_geometric_band(frequency_hz))
        inside = RANGE_HZ[0] <= frequency_hz <= RANGE_HZ[1]
        found.append(noise_db + ratio_criterion_db(frequency_hz) if inside else math.nan)
    return np.array(found, dtype=np.float64)


def audible_level_db(spectrum: Spectrum, floor: Array, frequencies_hz: Sequence[float] | Array) -> Array:
    """Return the level from which a tone would be audible over the noise that masks it (ISO/TS 20065, DIN 45681).

    The floor's level in the critical band plus the masking index (formula (14) solved for an audibility of zero). The
    standards take the noise from spectra of 3 s and A-weighted, which within one band makes little of a difference.

    Parameters
    ----------
    spectrum, floor, frequencies_hz
        As `prominent_level_db`.

    Returns
    -------
    ndarray, shape (n,)
        dB re 20 uPa, unweighted; NaN outside of what ISO/TS 20065 rates and where the critical band reaches beyond
        the spectrum.
    """
    found = []
    for frequency_hz in map(float, frequencies_hz):
        noise_db = _noise_db(spectrum, floor, geometric_band(frequency_hz))
        inside = ISO_TS_20065.lowest_hz <= frequency_hz <= HIGHEST_HZ
        found.append(noise_db + masking_index_db(frequency_hz) if inside else math.nan)
    return np.array(found, dtype=np.float64)


def _noise_db(spectrum: Spectrum, floor: Array, band_hz: tuple[float, float]) -> float:
    """Level of the floor in a band; NaN where the band reaches beyond the spectrum or holds nothing."""
    if band_hz[1] > spectrum.frequencies_hz[-1]:
        return math.nan
    noise = replace(spectrum, density=np.asarray(floor, dtype=np.float64)).mean_square(*band_hz)
    return 10.0 * math.log10(noise / REFERENCES[spectrum.quantity] ** 2) if noise > 0.0 else math.nan
