"""Tone-to-noise ratio and prominence ratio by ECMA-418-1:2024 (3rd edition, December 2024).

Known from the public description and formulas (phonometry, MIT: clauses, formulas, tables and errata
read from the standard, which Ecma offers free of charge) and ECMA's own scope; see `NOTES`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.lines import Line, find_lines
from tdacoustic.spectra import Spectrum
from tdacoustic.tones.critical_bands import (
    arithmetic_or_geometric_band,
    critical_bandwidth_hz,
    hearing_threshold_db,
    separation_hz,
)
from tdacoustic.units import REFERENCES

__all__ = [
    "RANGE_HZ",
    "EcmaTone",
    "EcmaTones",
    "ecma_tones",
    "prominence_criterion_db",
    "ratio_criterion_db",
]

Array = NDArray[np.float64]

RANGE_HZ: Final = (89.1, 11200.0)
"""Tones that the criteria are for. NOTE 2 of 4.1.1 prints 11 220 Hz; its tables and formulas end at 11 200 Hz."""

TONE_BAND_PART: Final = 0.15
"""A discrete tone's band is no wider than this part of the critical band (11.2)."""
DISCRETE_PART: Final = 0.95
"""Part of a discrete tone's power that lies within that band [assumed]."""
NOTHING: Final = 1e-15
"""Noise below this part of the power beside or in the band is arithmetic."""
LEAST_LINES: Final = 3.0
"""Lines of the spectrum in half a tone band, at least, for tone and noise to be told apart (phonometry's rule)."""
ALWAYS_NEAR_FROM_HZ: Final = 1000.0
"""From here on tones of one critical band count as one (11.6)."""
LOWER_BAND_CUT_UP_TO_HZ: Final = 171.4
"""Up to here the lower of the three bands of the prominence ratio is cut at 20 Hz and scaled to 100 Hz (12.5)."""
LOWEST_BAND_EDGE_HZ: Final = 20.0

_LOWER_EDGE: Final = (
    (171.4, (20.0, 0.0, 0.0)),
    (1600.0, (-149.5, 1.001, -6.90e-5)),
    (math.inf, (6.8, 0.806, -8.20e-6)),
)
_UPPER_EDGE: Final = ((1600.0, (149.5, 1.035, 7.70e-5)), (math.inf, (3.3, 1.215, 2.16e-5)))
"""Up to a tone's frequency: coefficients of the outer edges of the neighbouring bands, ascending (tables 2 and 3)."""

NOTES: Final = (
    "The criteria are numbers; the standard also asks for a listener to confirm that a prominent tone is heard.",
    "Candidates are the lines of the spectrum; the standard names no rule for finding them.",
    "Tones outside of 89.1 Hz to 11.2 kHz have no criterion and are not rated.",
    "It rates steady sound: a run whose speed changes has no averaged spectrum and is not rated by it.",
    "The edition of 2024 is known through phonometry (MIT), which read its clauses and formulas "
    "[not verified against the standard's text].",
)


@dataclass(frozen=True)
class EcmaTone:
    """One discrete tone and its two ratios.

    Parameters
    ----------
    frequency_hz, frequency_error_hz : float
        Of the line; one standard deviation.
    level_db : float
        Of the tone (formula (9): its band over the straight line between the band's edges), re 20 uPa, unweighted.
    band_hz : (float, float)
        The tone's band.
    combined_hz : tuple of float
        Frequencies of the tones that the tone-to-noise ratio counts with this one (11.6).
    combined_into_hz : float or None
        The stronger tone that this one is counted with; it has no ratio of its own then.
    noise_level_db : float or None
        Of the masking noise in the critical band, scaled to its full width (formula (10)).
    tone_to_noise_db : float or None
        None with the reason in `notes`.
    tone_to_noise_criterion_db : float
    tone_to_noise_prominent : bool or None
    prominence_db : float or None
    prominence_criterion_db : float
    prominence_prominent : bool or None
    audible : bool or None
        Level at or above the lower threshold of hearing; None beyond its range.
    line : int
        Index among the lines that were given or found.
    notes : tuple of str
        Limits of the standard that this tone meets or breaks.
    """

    frequency_hz: float
    frequency_error_hz: float
    level_db: float
    band_hz: tuple[float, float]
    combined_hz: tuple[float, ...]
    combined_into_hz: float | None
    noise_level_db: float | None
    tone_to_noise_db: float | None
    tone_to_noise_criterion_db: float
    tone_to_noise_prominent: bool | None
    prominence_db: float | None
    prominence_criterion_db: float
    prominence_prominent: bool | None
    audible: bool | None
    line: int
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class EcmaTones:
    """Tones of a spectrum by ECMA-418-1.

    Parameters
    ----------
    tones : tuple of EcmaTone
        By frequency.
    excluded : tuple of (float, str)
        Frequencies of lines that the standard does not rate, and why.
    notes : tuple of str
    """

    tones: tuple[EcmaTone, ...]
    excluded: tuple[tuple[float, str], ...]
    notes: tuple[str, ...] = NOTES


def ratio_criterion_db(frequency_hz: float) -> float:
    """Return the tone-to-noise ratio from which a tone is prominent (formulas (12) and (13)).

    Examples
    --------
    >>> round(ratio_criterion_db(100.0), 2), ratio_criterion_db(2000.0)
    (16.33, 8.0)
    """
    return 8.0 + 8.33 * max(0.0, math.log10(1000.0 / frequency_hz))


def prominence_criterion_db(frequency_hz: float) -> float:
    """Return the prominence ratio from which a tone is prominent (formulas (25) and (26)).

    Examples
    --------
    >>> prominence_criterion_db(100.0), prominence_criterion_db(2000.0)
    (19.0, 9.0)
    """
    return 9.0 + 10.0 * max(0.0, math.log10(1000.0 / frequency_hz))


@dataclass(frozen=True)
class _Part:
    """A tone's band in the spectrum: lines `low` to `high`, and the tone's power over the straight line between."""

    line: int
    frequency_hz: float
    low: int
    high: int
    power: float
    straight: Array


def ecma_tones(spectrum: Spectrum, lines: Sequence[Line] | None = None) -> EcmaTones:
    """Rate the tones of a spectrum.

    Parameters
    ----------
    spectrum : Spectrum
        Of a sound pressure, unweighted, Hann window, averaged (11.1, 12.1). The survey's 1 Hz lines do.
    lines : sequence of Line or None
        The candidates, whose order and owner a caller knows; None: those that `find_lines` finds.

    Returns
    -------
    EcmaTones
        Empty for silence, or where no line stands out.

    Raises
    ------
    AnalysisError
        Not a sound pressure.
    """
    if spectrum.quantity != "sound_pressure":
        raise AnalysisError(f"{spectrum.name}: tones are rated in a sound pressure, not in {spectrum.quantity}")
    found = list(find_lines(spectrum) if lines is None else lines)
    excluded: list[tuple[float, str]] = []
    parts: dict[int, _Part] = {}
    rated: list[int] = []
    for index, line in enumerate(found):
        reason = _not_rated(spectrum, line.frequency_hz)
        twin = _twin(found, index, spectrum.resolution_hz)
        if twin is not None:
            reason = f"the same line as that at {twin.frequency_hz:.2f} Hz"
        elif _in_spectrum(spectrum, line):
            # Lines beyond the range are no tones to rate, but their power is none of the noise of those within.
            parts[index] = _part(spectrum, found, index)
        if reason is None:
            rated.append(index)
        else:
            excluded.append((line.frequency_hz, reason))
    near = {index: _inside(parts, index)[1] for index in rated}
    tones = {index: _rate(spectrum, found[index], parts, index) for index in rated}
    tones = _combined(tones, near)
    return EcmaTones(tuple(sorted(tones.values(), key=lambda tone: tone.frequency_hz)), tuple(excluded))


def _twin(lines: Sequence[Line], index: int, resolution_hz: float) -> Line | None:
    """A stronger line less than a line spacing away (the first of equals): one peak that was found twice."""
    own = lines[index]
    for place, other in enumerate(lines):
        nearer = abs(other.frequency_hz - own.frequency_hz) < resolution_hz
        if place != index and nearer and (other.rms, -place) > (own.rms, -index):
            return other
    return None


def _not_rated(spectrum: Spectrum, frequency_hz: float) -> str | None:
    low, high = RANGE_HZ
    if not low <= frequency_hz <= high:
        return f"outside of {low:g} to {high:g} Hz, for which ECMA-418-1 has criteria"
    upper = arithmetic_or_geometric_band(frequency_hz)[1]
    if upper > spectrum.frequencies_hz[-1]:
        return f"its critical band ends at {upper:.0f} Hz, beyond the spectrum's {spectrum.frequencies_hz[-1]:.0f} Hz"
    return None


def _in_spectrum(spectrum: Spectrum, line: Line) -> bool:
    return spectrum.resolution_hz < line.frequency_hz < spectrum.frequencies_hz[-1] - spectrum.resolution_hz


def _part(spectrum: Spectrum, lines: Sequence[Line], index: int) -> _Part:
    """Find a tone's band: from the lowest point on each side within 15 % of the critical band (11.2).

    Where the lowest point is the end of that reach, the band goes on down to the next local minimum.
    It never goes past the lowest point between this tone and the next line.
    """
    density, step = spectrum.density, spectrum.resolution_hz
    centre = lines[index].frequency_hz
    peak = int(np.clip(round(centre / step), 1, density.size - 2))
    peak = peak - 1 + int(np.argmax(density[peak - 1 : peak + 2]))
    reach = max(1, round(0.5 * TONE_BAND_PART * critical_bandwidth_hz(centre) / step))
    others = [round(line.frequency_hz / step) for place, line in enumerate(lines) if place != index]
    below = max((other for other in others if other < peak), default=-1)
    above = min((other for other in others if other > peak), default=density.size)
    low = _edge(density, peak, -1, reach, max(0, below))
    high = _edge(density, peak, 1, reach, min(density.size - 1, above))
    straight = np.linspace(density[low], density[high], high - low + 1)
    power = max(0.0, float(np.sum(density[low : high + 1] - straight)) * step)
    return _Part(index, centre, low, high, power, straight)


def _edge(density: Array, peak: int, side: int, reach: int, bound: int) -> int:
    """Lowest point beside a peak within reach, or beyond its end the next local minimum; not past `bound`."""
    end = peak + side * reach
    end = max(end, bound) if side < 0 else min(end, bound)
    steps = np.arange(peak, end + side, side)
    place = int(steps[np.argmin(density[steps])])
    while place == end and end != bound and density[end + side] < density[end]:
        place = end = end + side
    return place


def _rate(spectrum: Spectrum, line: Line, parts: dict[int, _Part], index: int) -> EcmaTone:
    part = parts[index]
    reference = REFERENCES[spectrum.quantity] ** 2
    critical_hz = critical_bandwidth_hz(line.frequency_hz)
    notes = []
    discrete = _is_discrete(spectrum, line, part)
    if not discrete:
        notes.append(
            f"wider than {100 * TONE_BAND_PART:.0f} % of the critical band's {critical_hz:.0f} Hz: "
            "not a discrete tone of the standard"
        )
    if 0.5 * TONE_BAND_PART * critical_hz / spectrum.resolution_hz < LEAST_LINES:
        notes.append(f"lines of {spectrum.resolution_hz:.3g} Hz are too coarse to tell tone from noise here")
    powers, near, noise, why = _tone_and_noise(spectrum, parts, index)
    ratio_db = 10.0 * math.log10(powers / noise) if noise > 0.0 and powers > 0.0 else None
    prominence_db, why_prominence = _prominence(spectrum, line.frequency_hz)
    notes += [text for text in (why, why_prominence) if text]
    criteria = ratio_criterion_db(line.frequency_hz), prominence_criterion_db(line.frequency_hz)
    level = 10.0 * math.log10(part.power / reference) if part.power > 0.0 else -math.inf
    threshold = hearing_threshold_db(line.frequency_hz)
    audible = None if threshold is None else level >= threshold
    if audible is False:
        notes.append("below the lower threshold of hearing")

    def prominent(value: float | None, criterion: float) -> bool | None:
        return None if value is None else bool(value >= criterion and discrete and audible is not False)

    return EcmaTone(
        frequency_hz=line.frequency_hz,
        frequency_error_hz=line.frequency_error_hz,
        level_db=level if math.isfinite(level) else float(10.0 * math.log10(max(line.rms**2, 1e-300) / reference)),
        band_hz=(part.low * spectrum.resolution_hz, part.high * spectrum.resolution_hz),
        combined_hz=near,
        combined_into_hz=None,
        noise_level_db=10.0 * math.log10(noise / reference) if noise > 0.0 else None,
        tone_to_noise_db=ratio_db,
        tone_to_noise_criterion_db=criteria[0],
        tone_to_noise_prominent=prominent(ratio_db, criteria[0]),
        prominence_db=prominence_db,
        prominence_criterion_db=criteria[1],
        prominence_prominent=prominent(prominence_db, criteria[1]),
        audible=audible,
        line=index,
        notes=tuple(notes),
    )


def _is_discrete(spectrum: Spectrum, line: Line, part: _Part) -> bool:
    """Whether a tone is no wider than 15 % of its critical band (11.2).

    The band found may be wider because the window's skirts of a strong tone stand over the noise. What counts here is
    where the power lies: `DISCRETE_PART` of it within 15 %, and the line's own width, four standard deviations.
    """
    allowed_hz = TONE_BAND_PART * critical_bandwidth_hz(line.frequency_hz)
    if 4.0 * line.width_hz > allowed_hz:
        return False
    step = spectrum.resolution_hz
    places = np.arange(part.low, part.high + 1) * step
    excess = np.clip(spectrum.density[part.low : part.high + 1] - part.straight, 0.0, None)
    inside = np.abs(places - line.frequency_hz) <= 0.5 * allowed_hz + step
    return bool(excess[inside].sum() >= DISCRETE_PART * excess.sum())


def _inside(parts: dict[int, _Part], index: int) -> tuple[list[_Part], list[_Part]]:
    """Other tones of a tone's critical band, and those of them that count as one with it (11.6)."""
    part = parts[index]
    low_hz, high_hz = arithmetic_or_geometric_band(part.frequency_hz)
    inside = [p for p in parts.values() if low_hz < p.frequency_hz <= high_hz and p.line != index and p.power > 0.0]
    weaker = [p for p in inside if p.power <= part.power]  # a weaker one counts with a stronger, never the reverse
    always = part.frequency_hz >= ALWAYS_NEAR_FROM_HZ
    reach = separation_hz(part.frequency_hz)
    return inside, [p for p in weaker if always or abs(p.frequency_hz - part.frequency_hz) < reach]


def _tone_and_noise(
    spectrum: Spectrum, parts: dict[int, _Part], index: int
) -> tuple[float, tuple[float, ...], float, str | None]:
    """Power of the tone with those that count as one with it, their frequencies, and of the noise (11.3, 11.6).

    The noise is what is left of the critical band when every tone of it is cut down to the line between its
    band's edges, so that it can never be negative, however the bands of tones overlap its edges.
    """
    part = parts[index]
    low_hz, high_hz = arithmetic_or_geometric_band(part.frequency_hz)
    inside, near = _inside(parts, index)
    rest = spectrum.density.copy()
    for p in (part, *inside):
        rest[p.low : p.high + 1] = p.straight
    noise = replace(spectrum, density=rest).mean_square(low_hz, high_hz)
    total = spectrum.mean_square(low_hz, high_hz)
    power = part.power + sum(p.power for p in near)
    frequencies = tuple(sorted(p.frequency_hz for p in near))
    if noise <= NOTHING * total:
        return power, frequencies, 0.0, "no noise beside the tone in its critical band"
    return power, frequencies, noise, None


def _polynomial(pieces: Sequence[tuple[float, tuple[float, float, float]]], frequency_hz: float) -> float:
    a, b, c = next(coefficients for up_to, coefficients in pieces if frequency_hz <= up_to)
    return a + b * frequency_hz + c * frequency_hz**2


def _prominence(spectrum: Spectrum, frequency_hz: float) -> tuple[float | None, str | None]:
    """Prominence ratio (12.2 to 12.5), or None and the reason."""
    low_hz, high_hz = arithmetic_or_geometric_band(frequency_hz)
    lowest_hz = max(LOWEST_BAND_EDGE_HZ, _polynomial(_LOWER_EDGE, frequency_hz))
    highest_hz = _polynomial(_UPPER_EDGE, frequency_hz)
    last_hz = float(spectrum.frequencies_hz[-1])
    if highest_hz > last_hz:
        return (
            None,
            f"no prominence ratio: its upper band ends at {highest_hz:.0f} Hz, the spectrum at {last_hz:.0f} Hz",
        )
    middle = spectrum.mean_square(low_hz, high_hz)
    lower, upper = spectrum.mean_square(lowest_hz, low_hz), spectrum.mean_square(high_hz, highest_hz)
    if frequency_hz <= LOWER_BAND_CUT_UP_TO_HZ:
        lower *= 100.0 / (low_hz - lowest_hz)
    beside = 0.5 * (lower + upper)
    if beside <= NOTHING * middle:
        return None, "no prominence ratio: nothing in the bands beside"
    return 10.0 * math.log10(middle / beside), None


def _combined(tones: dict[int, EcmaTone], near: dict[int, list[_Part]]) -> dict[int, EcmaTone]:
    """Let the strongest of tones that count as one carry the ratio; the others name it (11.6)."""
    result = dict(tones)
    for index in sorted(tones, key=lambda place: -tones[place].level_db):
        tone = result[index]
        if tone.combined_into_hz is not None:
            continue
        for other in (part.line for part in near[index] if part.line in result):
            if result[other].combined_into_hz is not None:
                continue
            result[other] = replace(
                result[other],
                combined_into_hz=tone.frequency_hz,
                tone_to_noise_db=None,
                tone_to_noise_prominent=None,
                notes=(
                    *result[other].notes,
                    f"counted with the tone at {tone.frequency_hz:.1f} Hz in one critical band",
                ),
            )
    return result
