"""How one recorder's time lies on another's, as far as it could be found."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["ClockEstimate", "NoRelation", "Relation", "ResidualDelays"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Relation:
    """The reference's time t of a recorder's own time u: ``t = offset_s + u / (1 + drift)``.

    Parameters
    ----------
    offset_s : float
        The reference's time when the recorder's own is zero.
    drift : float
        Relative excess of the recorder's clock rate over the reference's: it takes ``1 + drift`` samples in the time
        in which it should take one.
    """

    offset_s: float
    drift: float = 0.0

    def to_reference(self, own_s: NDArray[Any] | float) -> NDArray[Any] | float:
        """Return the reference's time of a recorder's."""
        return self.offset_s + own_s / (1.0 + self.drift)

    def to_own(self, reference_s: NDArray[Any] | float) -> NDArray[Any] | float:
        """Return the recorder's time of the reference's."""
        return (reference_s - self.offset_s) * (1.0 + self.drift)


@dataclass(frozen=True)
class ResidualDelays:
    """What the fitted line leaves, over the reference's time; groups of neighbouring windows together.

    Parameters
    ----------
    times_s : ndarray, shape (n,)
    delays_s : ndarray, shape (n,)
        Positive where the recorder is later than the line says.
    errors_s : ndarray, shape (n,)
        Standard errors.
    """

    times_s: Array = field(default_factory=lambda: np.zeros(0))
    delays_s: Array = field(default_factory=lambda: np.zeros(0))
    errors_s: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class ClockEstimate:
    """Offset and drift of a recorder's clock against a reference's, from a signal that both recorded.

    Parameters
    ----------
    offset_s, offset_error_s : float
        See `Relation`; one standard error.
    drift_ppm, drift_error_ppm : float
        The same, in parts per million.
    axis_error_s : float
        Largest standard error of an instant within the overlap, wander included.
    overlap_s : (float, float)
        In the reference's time.
    wander_s : float
        Root mean square of what is left over time beyond scatter: a clock whose rate is not constant.
    coherence : float
        Magnitude-squared coherence of both channels in the band, its mean by weight.
    peak_ratio : float
        Mean correlation over that of the next best alignment.
    band_hz : (float, float)
        Within which nine tenths of the information lie.
    inverted : bool
        Whether one channel has the other's sign turned round.
    n_windows, n_used : int
        Along the overlap, and how many of them told a delay.
    residuals : ResidualDelays
    doubts : tuple of str
    """

    offset_s: float
    offset_error_s: float
    drift_ppm: float
    drift_error_ppm: float
    axis_error_s: float
    overlap_s: tuple[float, float]
    wander_s: float
    coherence: float
    peak_ratio: float
    band_hz: tuple[float, float]
    inverted: bool
    n_windows: int
    n_used: int
    residuals: ResidualDelays = field(default_factory=ResidualDelays)
    doubts: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """What is of use to know and makes nothing doubtful."""
        return ("one channel has the other's sign turned round",) if self.inverted else ()

    @property
    def relation(self) -> Relation:
        """The affine map itself."""
        return Relation(self.offset_s, 1e-6 * self.drift_ppm)


@dataclass(frozen=True)
class NoRelation:
    """Why no offset and drift are stated.

    Parameters
    ----------
    reason : str
    ambiguous : bool
        Whether several alignments explain the records about as well; else none does.
    """

    reason: str
    ambiguous: bool = False
