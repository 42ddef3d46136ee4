"""Tonal audibility of a record: its short-time spectra rated one by one, and their mean."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from tdacoustic.spectra import a_weighting_db
from tdacoustic.tones.audibility import (
    ISO_TS_20065,
    NO_TONE_DB,
    AudibilityMethod,
    AudibleTone,
    SpectrumTones,
    audible_tones_by,
)
from tdacoustic.tones.critical_bands import hearing_threshold_db
from tdacoustic.tones.narrow_band import AVERAGING_S, LINE_SPACING_HZ, ShortTimeMeter

__all__ = [
    "Audibility",
    "AudibilityMeter",
    "RatedTone",
    "SightedTone",
    "mean_audibility",
    "rated_tone",
    "tone_adjustment_db",
]

Array = NDArray[np.float64]

ENOUGH_SPECTRA: Final = 12
"""With fewer, the uncertainty of the mean has to be taken into account (clauses 5.4 and 6)."""
ADJUSTMENT: Final = ((0.0, 0), (2.0, 1), (4.0, 2), (6.0, 3), (9.0, 4), (12.0, 5))
"""Up to which mean audibility in dB, and the tone adjustment in dB; 6 dB above (DIN 45681:2005, table 1, which is that
of ISO 1996-2:2017, table J.1)."""
SAME_TONE_LINES: Final = 1.0
"""Tones of two spectra no farther apart than this many lines are one tone [assumed]."""


class SightedTone(Protocol):
    """A tone in one spectrum; `AudibleTone` is one."""

    @property
    def frequency_hz(self) -> float: ...  # noqa: D102
    @property
    def frequency_error_hz(self) -> float: ...  # noqa: D102
    @property
    def level_db(self) -> float: ...  # noqa: D102
    @property
    def audibility_db(self) -> float: ...  # noqa: D102


@dataclass(frozen=True)
class RatedTone:
    """One tone over all spectra; this summary is ours, the standards rate the spectra.

    Parameters
    ----------
    frequency_hz, frequency_error_hz : float
        Mean over the spectra that hold it; one standard deviation of the mean.
    level_db : float
        Energy mean of its level over these, A-weighted.
    audibility_db : float
        Energy mean over all spectra, `NO_TONE_DB` where it is not audible: the standards' formula (20), for this
        tone alone.
    highest_db : float
        Its largest audibility in one spectrum.
    n_spectra : int
        Spectra in which it is audible.
    over_threshold : bool or None
        Whether its unweighted level reaches the lower threshold of hearing (that of ECMA-418-1; the standards on
        audibility, as far as known, rate a tone against the noise alone); None beyond 22.05 kHz.
    """

    frequency_hz: float
    frequency_error_hz: float
    level_db: float
    audibility_db: float
    highest_db: float
    n_spectra: int
    over_threshold: bool | None


@dataclass(frozen=True)
class Audibility:
    """Tonal audibility of one channel.

    Parameters
    ----------
    method : AudibilityMethod
    channel : str
    line_spacing_hz, averaging_s : float
        As used.
    starts_s : tuple of float
        Start of each spectrum after the record's.
    spectra : tuple of SpectrumTones
    mean_db : float or None
        Mean audibility over the spectra (formula (20)); None without any spectrum.
    uncertainty_db : float or None
        Half of its 90 % interval (formulas (28) and (29)); spectra without tones add none.
    adjustment_db : int or None
        Tone adjustment, where the method has one.
    tones : tuple of RatedTone
        By frequency.
    excluded : tuple of (float, str)
        Tones that the method does not rate, once each, and why.
    notes : tuple of str
        What of the standard's conditions is not met.
    """

    method: AudibilityMethod
    channel: str
    line_spacing_hz: float
    averaging_s: float
    starts_s: tuple[float, ...]
    spectra: tuple[SpectrumTones, ...]
    mean_db: float | None
    uncertainty_db: float | None
    adjustment_db: int | None
    tones: tuple[RatedTone, ...]
    excluded: tuple[tuple[float, str], ...]
    notes: tuple[str, ...]


def tone_adjustment_db(mean_audibility_db: float) -> int:
    """Return the tone adjustment of DIN 45681:2005, table 1.

    Examples
    --------
    >>> tone_adjustment_db(6.38), tone_adjustment_db(-10.0), tone_adjustment_db(15.0)
    (4, 0, 6)
    """
    return next((value for limit, value in ADJUSTMENT if mean_audibility_db <= limit), 6)


def mean_audibility(decisive_db: Sequence[float], uncertainty_db: Sequence[float]) -> tuple[float, float]:
    """Return the mean audibility of spectra (formula (20)) and half of its 90 % interval (formulas (28), (29)).

    Parameters
    ----------
    decisive_db, uncertainty_db : sequence of float
        One a spectrum.

    Examples
    --------
    >>> mean_audibility([9.18, 6.04, 7.46, 2.67, 7.17], [3.21, 2.95, 2.44, 2.52, 2.14])  # doctest: +ELLIPSIS
    (6.9..., 1.3...)
    """
    energy = 10.0 ** (0.1 * np.asarray(decisive_db, dtype=np.float64))
    spread = float(np.linalg.norm(energy * np.asarray(uncertainty_db)) / energy.sum())
    return float(10.0 * np.log10(energy.mean())), spread


class AudibilityMeter:
    """Takes blocks of samples and rates the tones of all channels, spectrum by spectrum.

    Only tones are kept, not spectra: memory grows by some hundred bytes for each tone of each 3 s.

    Parameters
    ----------
    names : sequence of str
        Of the channels; sound pressures in Pa.
    sample_rate_hz : float
    n_samples : int
        Of the record.
    methods : sequence of AudibilityMethod
        Rated side by side on the same spectra.
    line_spacing_hz, averaging_s : float

    Raises
    ------
    AnalysisError
        See `ShortTimeMeter`.
    """

    def __init__(
        self,
        names: Sequence[str],
        sample_rate_hz: float,
        n_samples: int,
        methods: Sequence[AudibilityMethod] = (ISO_TS_20065,),
        line_spacing_hz: float = LINE_SPACING_HZ,
        averaging_s: float = AVERAGING_S,
    ) -> None:
        self._names = tuple(names)
        self._methods = tuple(methods)
        self._meter = ShortTimeMeter(self._names, sample_rate_hz, n_samples, line_spacing_hz, averaging_s)
        self._rated: dict[tuple[str, str], list[tuple[float, SpectrumTones]]] = {
            (method.name, name): [] for method in self._methods for name in self._names
        }
        self._missing = dict.fromkeys(self._names, 0)

    def take(self, block: Array) -> None:
        """Add samples, shape (n_channels, n), in order."""
        for stretch in self._meter.take(block):
            for name, spectrum in zip(self._names, stretch.spectra, strict=True):
                if spectrum is None:
                    self._missing[name] += 1
                    continue
                for method, tones in zip(self._methods, audible_tones_by(spectrum, self._methods), strict=True):
                    self._rated[method.name, name].append((stretch.start_s, tones))

    def result(self) -> tuple[Audibility, ...]:
        """Return the ratings, method by method and channel by channel."""
        return tuple(self._assess(method, name) for method in self._methods for name in self._names)

    def _assess(self, method: AudibilityMethod, name: str) -> Audibility:
        rated = self._rated[method.name, name]
        spectra = tuple(tones for _, tones in rated)
        mean = uncertainty = None
        if spectra:
            mean, uncertainty = mean_audibility(
                [tones.decisive_db for tones in spectra], [tones.decisive_uncertainty_db for tones in spectra]
            )
        spacing = self._meter.line_spacing_hz
        excluded: dict[int, tuple[float, str]] = {}
        for tones in spectra:
            for frequency_hz, reason in tones.excluded:
                excluded.setdefault(round(frequency_hz / (2.0 * spacing)), (frequency_hz, reason))
        return Audibility(
            method=method,
            channel=name,
            line_spacing_hz=spacing,
            averaging_s=self._meter.averaging_s,
            starts_s=tuple(start for start, _ in rated),
            spectra=spectra,
            mean_db=mean,
            uncertainty_db=uncertainty,
            adjustment_db=None if mean is None or not method.adjustment else tone_adjustment_db(mean),
            tones=_over_spectra(spectra, spacing),
            excluded=tuple(excluded[key] for key in sorted(excluded)),
            notes=self._notes(method, name, len(spectra)),
        )

    def _notes(self, method: AudibilityMethod, name: str, n_spectra: int) -> tuple[str, ...]:
        notes = []
        if self._meter.averaging_s < AVERAGING_S * (1.0 - 1e-3):
            notes.append(f"averaged over {self._meter.averaging_s:.2g} s; {method.name} asks for {AVERAGING_S:g} s")
        if n_spectra == 0:
            notes.append("no spectrum: no stretch of the averaging time holds numbers throughout")
        elif n_spectra < ENOUGH_SPECTRA:
            count = "1 spectrum" if n_spectra == 1 else f"{n_spectra} spectra"
            notes.append(f"{count}, fewer than {ENOUGH_SPECTRA}: the uncertainty counts with the result")
        if self._missing[name]:
            left_out = self._missing[name]
            notes.append(f"stretches left out because no frame of them holds numbers throughout: {left_out}")
        return tuple(notes)


def _over_spectra(spectra: Sequence[SpectrumTones], spacing_hz: float) -> tuple[RatedTone, ...]:
    """Gather the same tone of all spectra: neighbours in frequency, one a spectrum."""
    found = sorted(
        ((tone.frequency_hz, index, tone) for index, tones in enumerate(spectra) for tone in tones.tones),
        key=lambda entry: entry[:2],
    )
    groups: list[dict[int, AudibleTone]] = []
    for frequency_hz, index, tone in found:
        group = groups[-1] if groups else {}
        middle = float(np.mean([other.frequency_hz for other in group.values()])) if group else -math.inf
        if group and index not in group and frequency_hz - middle <= SAME_TONE_LINES * spacing_hz:
            group[index] = tone
        else:
            groups.append({index: tone})
    return tuple(rated_tone(list(group.values()), len(spectra)) for group in groups)


def rated_tone(held: Sequence[SightedTone], n_spectra: int) -> RatedTone:
    """Return one tone over several spectra.

    Parameters
    ----------
    held : sequence of SightedTone
        The tone in each spectrum that shows it, once; at least one.
    n_spectra : int
        All spectra, those without it too.
    """
    frequencies = np.array([tone.frequency_hz for tone in held])
    errors = np.array([tone.frequency_error_hz for tone in held])
    scatter = float(np.std(frequencies, ddof=1)) if len(held) > 1 else 0.0
    audible = np.array([tone.audibility_db for tone in held])
    energy = float(np.sum(10.0 ** (0.1 * audible))) + (n_spectra - len(held)) * 10.0 ** (0.1 * NO_TONE_DB)
    frequency_hz = float(frequencies.mean())
    level_db = float(10.0 * np.log10(np.mean(10.0 ** (0.1 * np.array([tone.level_db for tone in held])))))
    threshold_db = hearing_threshold_db(frequency_hz)
    unweighted_db = level_db - float(a_weighting_db(frequency_hz))
    return RatedTone(
        frequency_hz=frequency_hz,
        frequency_error_hz=max(scatter, float(np.sqrt(np.mean(errors**2)))) / math.sqrt(len(held)),
        level_db=level_db,
        audibility_db=10.0 * math.log10(energy / n_spectra),
        highest_db=float(audible.max()),
        n_spectra=len(held),
        over_threshold=None if threshold_db is None else unweighted_db >= threshold_db,
    )
