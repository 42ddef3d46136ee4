"""Audibility of tones in one spectrum by ISO/TS 20065:2022 and DIN 45681:2005.

The texts are sold, not public. The formulas are those of ISO/PAS 20065:2016, from which ISO/TS 20065:2022 was made,
and of DIN 45681:2005-03, as public sources give them (phonometry, MIT: formulas with clause, printed examples and
errata; Svantek's manual of SV 977D, appendix F). What the 2022 edition changed in them is not known here
[not verified against the standard's text].
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.lines.detection import FREQUENCY_VARIANCE
from tdacoustic.spectra import Spectrum, a_weighting_db
from tdacoustic.tones.critical_bands import critical_bandwidth_hz, geometric_band, masking_index_db
from tdacoustic.tones.masking import (
    HANN_FACTOR,
    TONE_OVER_DB,
    audibility_uncertainty_db,
    combined_level_db,
    energy,
    groups_of,
    is_distinct,
    mean_narrow_band_level_db,
    relative_spread,
    tone_extent,
    tone_level_db,
    uncertainty_of_spread_db,
)
from tdacoustic.tones.narrow_band import LINE_SPACING_LIMITS_HZ

__all__ = [
    "DIN_45681",
    "ISO_TS_20065",
    "NO_TONE_DB",
    "AudibilityMethod",
    "AudibleTone",
    "SpectrumTones",
    "ToneGroup",
    "audible_tones",
    "audible_tones_by",
    "highest_rated_hz",
]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

NO_TONE_DB: Final = -10.0
"""Audibility of a spectrum without an audible tone (formula (21))."""
SILENT_DB: Final = -200.0
"""Level of a line that holds nothing at all."""
HIGHEST_HZ: Final = 15500.0
"""Where the critical bands of hearing end, 24 Bark (E. Zwicker, J. Acoust. Soc. Am. 33 (1961) 248), on which the
standards' bandwidth and masking rest. Whether the standards name an upper limit of their own is not known here [not
verified against their texts]."""
UNVERIFIED: Final = "[not verified against the standard's text]"


@dataclass(frozen=True)
class AudibilityMethod:
    """A standard on tonal audibility with its limits.

    Parameters
    ----------
    name : str
    lowest_hz : float
        Lower tones are not rated.
    adjustment : bool
        Whether it gives a tone adjustment in decibels.
    limits : tuple of str
        What it cannot do, and how far it is known here, one sentence each.
    highest_hz : float
        Higher tones are not rated.
    """

    name: str
    lowest_hz: float
    adjustment: bool
    limits: tuple[str, ...] = ()
    highest_hz: float = HIGHEST_HZ


_UPPER_LIMIT: Final = (
    f"Tones above {HIGHEST_HZ:g} Hz are not rated: there the critical bands of hearing end on which the formulas rest; "
    f"an upper limit of the standard's own is not known {UNVERIFIED}."
)

ISO_TS_20065: Final = AudibilityMethod(
    "ISO/TS 20065:2022",
    50.0,
    False,
    (
        "Tones below 50 Hz are not rated (scope); there, and for screeching, it does not replace a listener.",
        _UPPER_LIMIT,
        f"The formulas are those of ISO/PAS 20065:2016; what the edition of 2022 changed is not known {UNVERIFIED}.",
        "It gives no tone adjustment in decibels.",
    ),
)
"""Scope: tones from 50 Hz (BSI's page on the standard); no adjustment."""
DIN_45681: Final = AudibilityMethod(
    "DIN 45681:2005-03",
    90.0,
    True,
    (
        f"Tones below 90 Hz are not rated (5.3.2, as phonometry read it) {UNVERIFIED}.",
        _UPPER_LIMIT,
        "The tone adjustment is that of its table 1, which ISO 1996-2:2017 repeats.",
    ),
)
"""Tones from 90 Hz (5.3.2, by phonometry); tone adjustment of its table 1."""


def highest_rated_hz(sample_rate_hz: float) -> float:
    """Return the highest tone whose critical band a sampling rate holds, but no more than `HIGHEST_HZ`.

    Examples
    --------
    >>> round(highest_rated_hz(8192.0)), highest_rated_hz(51200.0)
    (3765, 15500.0)
    """
    end_hz = 0.5 * sample_rate_hz
    if geometric_band(HIGHEST_HZ)[1] <= end_hz:
        return HIGHEST_HZ
    low, high = 0.0, HIGHEST_HZ
    for _ in range(60):  # halved until it is exact
        middle = 0.5 * (low + high)
        low, high = (middle, high) if geometric_band(middle)[1] <= end_hz else (low, middle)
    return low


@dataclass(frozen=True)
class AudibleTone:
    """One tone of one spectrum.

    Parameters
    ----------
    line_hz : float
        The line with the highest level: the standard's tone frequency.
    frequency_hz, frequency_error_hz : float
        Interpolated between the lines (ours); one standard deviation.
    level_db : float
        Of the tone, A-weighted, re 20 uPa.
    mean_narrow_band_level_db : float
        Of the masking noise at one line, A-weighted.
    critical_band_hz : (float, float)
    critical_band_level_db, masking_index_db : float
    audibility_db : float
        Level over the masking threshold.
    uncertainty_db : float
        Half of the interval of 90 %.
    distinct_by_iso_print : bool
        The two prints of the edge steepness differ (see `masking.is_distinct`): whether this tone also passes that of
        ISO/PAS 20065:2016. Tones are taken by that of DIN 45681.
    first, last : int
        Its lines.
    noise_spread : float
        One over the effective number of lines that the mean narrow-band level was taken over.
    """

    line_hz: float
    frequency_hz: float
    frequency_error_hz: float
    level_db: float
    mean_narrow_band_level_db: float
    critical_band_hz: tuple[float, float]
    critical_band_level_db: float
    masking_index_db: float
    audibility_db: float
    uncertainty_db: float
    distinct_by_iso_print: bool
    first: int
    last: int
    noise_spread: float


@dataclass(frozen=True)
class ToneGroup:
    """Tones of one critical band that are heard as one (5.3.8, step 3).

    Parameters
    ----------
    members : tuple of int
        Indices of the tones, by frequency.
    leading : int
        The most audible, at whose frequency the group is rated.
    level_db, audibility_db, uncertainty_db : float
    """

    members: tuple[int, ...]
    leading: int
    level_db: float
    audibility_db: float
    uncertainty_db: float


@dataclass(frozen=True)
class SpectrumTones:
    """Tones of one spectrum.

    Parameters
    ----------
    tones : tuple of AudibleTone
        Audible ones, by frequency.
    groups : tuple of ToneGroup
    decisive_db : float
        Largest audibility of tones and groups; `NO_TONE_DB` where nothing is audible.
    decisive_hz : float or None
    decisive_uncertainty_db : float
        0 where nothing is audible: the value is fixed by the standard.
    excluded : tuple of (float, str)
        Frequencies of tones that the standard does not rate, and why.
    """

    tones: tuple[AudibleTone, ...]
    groups: tuple[ToneGroup, ...]
    decisive_db: float
    decisive_hz: float | None
    decisive_uncertainty_db: float
    excluded: tuple[tuple[float, str], ...]


def audible_tones(spectrum: Spectrum, method: AudibilityMethod = ISO_TS_20065) -> SpectrumTones:
    """Find and rate the tones of one spectrum.

    Parameters
    ----------
    spectrum : Spectrum
        Of a sound pressure, unweighted (the A-weighting is done here), Hann window, averaged over at least 3 s,
        line spacing within 1.9 to 4 Hz.
    method : AudibilityMethod

    Raises
    ------
    AnalysisError
        Not a sound pressure, or a line spacing that the standard does not allow.
    """
    return audible_tones_by(spectrum, (method,))[0]


def audible_tones_by(spectrum: Spectrum, methods: Sequence[AudibilityMethod]) -> tuple[SpectrumTones, ...]:
    """Find the tones of one spectrum and rate them by several methods; see `audible_tones`."""
    for method in methods:
        _refuse(spectrum, method)
    with np.errstate(divide="ignore"):
        levels = spectrum.levels_db("rms") + a_weighting_db(spectrum.frequencies_hz)
    levels = np.where(np.isfinite(levels), levels, SILENT_DB)
    found = [tone for tone in _distinct_tones(spectrum, levels) if tone.audibility_db > 0.0]
    last_hz = float(spectrum.frequencies_hz[-1])
    ratings = []
    for method in methods:
        reasons = [_not_rated(tone, method, last_hz) for tone in found]
        rated = [tone for tone, reason in zip(found, reasons, strict=True) if reason is None]
        excluded = ((tone.line_hz, reason) for tone, reason in zip(found, reasons, strict=True) if reason is not None)
        ratings.append(_rated(rated, levels, spectrum.resolution_hz, tuple(excluded)))
    return tuple(ratings)


def _distinct_tones(spectrum: Spectrum, levels: Array) -> Iterator[AudibleTone]:
    """Tones that stand over their critical band and are distinct, by frequency, whatever their audibility."""
    step, taken = spectrum.resolution_hz, -1
    for peak in _candidates(levels, step):
        if peak <= taken:
            continue
        mean, kept = mean_narrow_band_level_db(levels, _band_lines(peak * step, step, levels.size), peak)
        extent = tone_extent(levels, peak, mean)
        highest = extent[0] + int(np.argmax(levels[extent[0] : extent[1] + 1]))
        if levels[peak] <= mean + TONE_OVER_DB or highest != peak:
            continue  # noise, or the flank of a stronger tone
        taken = extent[1]
        if is_distinct(levels, step, peak, extent, "din"):
            yield _tone(spectrum, levels, peak, extent, mean, kept)


def _refuse(spectrum: Spectrum, method: AudibilityMethod) -> None:
    if spectrum.quantity != "sound_pressure":
        raise AnalysisError(f"{spectrum.name}: tones are rated in a sound pressure, not in {spectrum.quantity}")
    low, high = LINE_SPACING_LIMITS_HZ
    if not low <= spectrum.resolution_hz <= high:
        raise AnalysisError(
            f"{spectrum.name}: {method.name} takes a line spacing of {low:g} to {high:g} Hz, "
            f"got {spectrum.resolution_hz:.3g} Hz"
        )


def _not_rated(tone: AudibleTone, method: AudibilityMethod, last_hz: float) -> str | None:
    if tone.line_hz < method.lowest_hz:
        return f"below {method.lowest_hz:g} Hz, from which {method.name} rates tones"
    if tone.line_hz > method.highest_hz:
        return f"above {method.highest_hz:g} Hz, where the critical bands of hearing end"
    if tone.critical_band_hz[1] > last_hz:
        return f"its critical band ends at {tone.critical_band_hz[1]:.0f} Hz, beyond the spectrum's {last_hz:.0f} Hz"
    return None


def _band_lines(frequency_hz: float, step_hz: float, n_lines: int) -> tuple[int, int]:
    """First line inside the critical band, and the one behind its last, as far as the spectrum holds them."""
    low, high = geometric_band(frequency_hz)
    return max(1, math.ceil(low / step_hz - 1e-9)), min(n_lines, math.floor(high / step_hz + 1e-9) + 1)


def _candidates(levels_db: Array, step_hz: float) -> list[int]:
    """Local maxima that can be tones: a sieve that loses none and spares most of them the iteration.

    The mean of the lines up to a threshold grows with the threshold. So if the mean of all lines of the band that
    are no higher than the peak lies less than 6 dB below it, the iteration, which starts above, ends no lower.
    """
    energies = energy(levels_db)
    inner = levels_db[1:-1]
    peaks = 1 + np.flatnonzero((inner >= levels_db[:-2]) & (inner > levels_db[2:]) & (inner > SILENT_DB))
    over = 10.0 ** (0.1 * TONE_OVER_DB) / HANN_FACTOR
    found = []
    for peak in map(int, peaks):
        low, high = _band_lines(peak * step_hz, step_hz, levels_db.size)
        beside = energies[low:high]
        lower = beside[beside <= energies[peak]]
        if energies[peak] * (lower.size - 1) > over * (float(lower.sum()) - energies[peak]):
            found.append(peak)
    return found


def _tone(
    spectrum: Spectrum, levels: Array, peak: int, extent: tuple[int, int], mean_db: float, kept: Indices
) -> AudibleTone:
    step = spectrum.resolution_hz
    frequency_hz = peak * step
    lines = np.arange(extent[0], extent[1] + 1)
    level = tone_level_db(levels, lines)
    critical = mean_db + 10.0 * math.log10(critical_bandwidth_hz(frequency_hz) / step)  # formula (12)
    masking = masking_index_db(frequency_hz)
    over = max(1e-3, 10.0 ** (0.1 * (levels[peak] - mean_db)) - 1.0)
    a, b = FREQUENCY_VARIANCE
    error = step * math.sqrt((a / over + b / over**2) / spectrum.averages)
    return AudibleTone(
        line_hz=frequency_hz,
        frequency_hz=_interpolated_hz(spectrum.density, peak, step),
        frequency_error_hz=max(error, 0.02 * step),
        level_db=level,
        mean_narrow_band_level_db=mean_db,
        critical_band_hz=geometric_band(frequency_hz),
        critical_band_level_db=critical,
        masking_index_db=masking,
        audibility_db=level - critical - masking,  # formula (14)
        uncertainty_db=audibility_uncertainty_db(levels[lines], levels[kept], frequency_hz, step),
        distinct_by_iso_print=is_distinct(levels, step, peak, extent, "iso"),
        first=extent[0],
        last=extent[1],
        noise_spread=relative_spread(levels[kept]),
    )


def _interpolated_hz(density: Array, peak: int, step_hz: float) -> float:
    """Frequency of a sinusoid in a Hann window, from its highest line and the higher neighbour, unweighted."""
    peak = peak - 1 + int(np.argmax(density[peak - 1 : peak + 2]))
    sides = [float(density[side]) if side < density.size else 0.0 for side in (peak - 1, peak + 1)]
    side = 1 if sides[1] > sides[0] else -1
    ratio = math.sqrt(max(sides) / float(density[peak]))
    offset = min(0.5, max(0.0, (2.0 * ratio - 1.0) / (ratio + 1.0)))
    return float((peak + side * offset) * step_hz)


def _rated(
    tones: Sequence[AudibleTone], levels: Array, step_hz: float, excluded: tuple[tuple[float, str], ...]
) -> SpectrumTones:
    groups = []
    for leading, members in groups_of([tone.line_hz for tone in tones], [tone.audibility_db for tone in tones]):
        lead = tones[leading]
        level = combined_level_db(levels, [(tones[index].first, tones[index].last) for index in members])
        groups.append(
            ToneGroup(
                members,
                leading,
                level,
                level - lead.critical_band_level_db - lead.masking_index_db,
                uncertainty_of_spread_db(
                    relative_spread(np.array([tones[index].level_db for index in members])) + lead.noise_spread,
                    lead.line_hz,
                    step_hz,
                ),
            )
        )
    rated = [(tone.audibility_db, tone.line_hz, tone.uncertainty_db) for tone in tones]
    rated += [(group.audibility_db, tones[group.leading].line_hz, group.uncertainty_db) for group in groups]
    best = max(rated, default=None)
    return SpectrumTones(
        tuple(tones),
        tuple(groups),
        NO_TONE_DB if best is None else best[0],
        None if best is None else best[1],
        0.0 if best is None else best[2],
        excluded,
    )
