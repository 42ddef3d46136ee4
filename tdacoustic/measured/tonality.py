"""Whether the runs are tonal: each tone with its rating, its order and its owner."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tdacoustic.measured.hearing import Hearing

__all__ = ["RunTonality", "RunTone", "SpeedSpan", "Tonality", "ToneCurves"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SpeedSpan:
    """Speeds between which something of a run-up holds.

    Parameters
    ----------
    low, high : float
    unit : str
        ``km/h`` of the train, ``rpm`` of a shaft.
    """

    low: float
    high: float
    unit: str

    def words(self) -> str:
        """Return the span as a sentence has it."""
        digits = 0 if self.unit == "rpm" else 1
        return f"{self.low:.{digits}f} to {self.high:.{digits}f} {self.unit}"


@dataclass(frozen=True)
class RunTone:
    """One tone of one channel by one method: a row of ``tones.csv``.

    Parameters
    ----------
    run : str
    condition : str or None
    channel, method : str
    frequency_hz, frequency_error_hz : float
        One standard deviation.
    level_db : float
        Re 20 uPa, in `weighting`.
    weighting : str
        ``Z`` by ECMA-418-1, ``A`` by the methods on audibility.
    value_db : float or None
        Tone-to-noise ratio, prominence ratio, or audibility; None with the reason in `notes`.
    criterion_db : float
        Of `value_db`, from which it is prominent, or audible.
    prominent : bool or None
        By ECMA-418-1; None by the others, which know no prominence.
    audible : bool or None
        By ECMA-418-1: whether the level reaches the lower threshold of hearing. By the others: whether the audibility
        is above zero, and the level reaches that threshold. None beyond the threshold's range.
    combined_into_hz : float or None
        The stronger tone of its critical band that this one is counted with.
    n_spectra : int
        Spectra that show it.
    order : float or None
        Its frequency per turn of the motor, of its speed class in a run-up; None where the motor's speed is not known.
    owner : str
        A component, ``ambiguous`` or ``unassigned``.
    excitation : str
        As ``"mesh x2"``, or ``unknown``.
    notes : tuple of str
    speed : SpeedSpan or None
        Speed class of a run-up.
    """

    run: str
    condition: str | None
    channel: str
    method: str
    frequency_hz: float
    frequency_error_hz: float
    level_db: float
    weighting: str
    value_db: float | None
    criterion_db: float
    prominent: bool | None
    audible: bool | None
    combined_into_hz: float | None
    n_spectra: int
    order: float | None
    owner: str
    excitation: str
    notes: tuple[str, ...] = ()
    speed: SpeedSpan | None = None


@dataclass(frozen=True)
class RunTonality:
    """How tonal one channel is by one method: a row of ``tonality.csv``.

    Parameters
    ----------
    run : str
    condition : str or None
    channel, method : str
    mean_audibility_db, uncertainty_db : float or None
        Half of a 90 % interval; None with the reason in `notes`.
    adjustment_db : int or None
    n_spectra : int
    notes : tuple of str
    speed : SpeedSpan or None
        Speed class of a run-up; None of a whole run.
    run_up : bool
        The speed changes: the mean is over unlike sounds, and no verdict on the run.
    """

    run: str
    condition: str | None
    channel: str
    method: str
    mean_audibility_db: float | None
    uncertainty_db: float | None
    adjustment_db: int | None
    n_spectra: int
    notes: tuple[str, ...] = ()
    speed: SpeedSpan | None = None
    run_up: bool = False


@dataclass(frozen=True)
class ToneCurves:
    """From which level on a tone would be audible, and prominent by its tone-to-noise ratio, in a steady run.

    Parameters
    ----------
    run, channel : str
    frequency_hz, prominent_db, audible_db : ndarray, shape (n,)
        NaN where the method has no criterion or the spectrum no critical band.
    """

    run: str
    channel: str
    frequency_hz: Array
    prominent_db: Array
    audible_db: Array


@dataclass(frozen=True)
class Tonality:
    """Tones of a campaign.

    Parameters
    ----------
    tones : tuple of RunTone
    ratings : tuple of RunTonality
    curves : tuple of ToneCurves
    hearing : mapping of str to Hearing
        By run.
    limits : tuple of (str, tuple of str)
        Of each method: what it cannot do, and how far it is known here.
    """

    tones: tuple[RunTone, ...] = ()
    ratings: tuple[RunTonality, ...] = ()
    curves: tuple[ToneCurves, ...] = ()
    hearing: Mapping[str, Hearing] = field(default_factory=dict)
    limits: tuple[tuple[str, tuple[str, ...]], ...] = ()

    def of(self, run: str, channel: str, method: str) -> tuple[RunTone, ...]:
        """Return the tones of a channel of a run by a method."""
        return tuple(t for t in self.tones if (t.run, t.channel, t.method) == (run, channel, method))

    def rating(self, run: str, channel: str, method: str) -> RunTonality | None:
        """Return how tonal a channel of a whole run is by a method; None where it was not rated."""
        for rating in self.ratings:
            if (rating.run, rating.channel, rating.method) == (run, channel, method) and rating.speed is None:
                return rating
        return None
