"""Excerpts of a campaign's sound to listen to, and the order to listen for in each; frozen, for the store."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["ConditionSound", "Excerpt", "ExtractedOrder", "Listening", "MarkedOrder"]

Array = NDArray[np.float64]
Single = NDArray[np.float32]


@dataclass(frozen=True)
class ExtractedOrder:
    """One order of an excerpt by itself, by Vold-Kalman filter.

    Parameters
    ----------
    samples : ndarray of float32, shape (n,)
        Pa, as many and as fast as the excerpt's; zero where the order is not known.
    times_s, frequency_hz : ndarray, shape (m,)
        Its frequency over the time since the excerpt's beginning.
    bandwidth_hz : float
        From the order to where the filter is 3 dB down.
    """

    samples: Single
    times_s: Array
    frequency_hz: Array
    bandwidth_hz: float

    @property
    def rms(self) -> float:
        """Over the whole excerpt, Pa."""
        return _rms(self.samples)


@dataclass(frozen=True)
class Excerpt:
    """A few seconds of one microphone.

    Parameters
    ----------
    channel : str
    sample_rate_hz : float
        Of `samples`.
    first_s : float
        Instant of the first sample on the run's time axis.
    samples : ndarray of float32, shape (n,)
        Pa, mean removed.
    highest_hz : float
        Up to which they hold what was recorded.
    n_missing : int
        Samples of the log that were no numbers, taken as silence.
    order : ExtractedOrder or None
    no_order : str or None
        Why the order that was asked for cannot be extracted.
    """

    channel: str
    sample_rate_hz: float
    first_s: float
    samples: Single
    highest_hz: float
    n_missing: int = 0
    order: ExtractedOrder | None = None
    no_order: str | None = None

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return self.samples.size / self.sample_rate_hz

    @property
    def rms(self) -> float:
        """Pa."""
        return _rms(self.samples)


@dataclass(frozen=True)
class MarkedOrder:
    """The order to listen for, as the analysis knows it.

    Parameters
    ----------
    name : str
        ``"mesh x1"``; ``"line"`` where nobody knows whose order it is.
    order : float or None
        Per turn of the reference shaft.
    source : str or None
        Component that it is of: ``motor``, ``gearbox``, ...; None where nothing says it.
    frequency_hz, rms : float or None
        Of the noise line in this run, over the whole record; None of an order that sweeps.
    """

    name: str
    order: float | None
    source: str | None
    frequency_hz: float | None = None
    rms: float | None = None


@dataclass(frozen=True)
class ConditionSound:
    """What there is to hear of a condition.

    Parameters
    ----------
    condition, run : str
    excerpt : Excerpt
    marked : MarkedOrder or None
    sweeps : bool
        Whether the run's speed changes.
    choice : tuple of str
        Why this microphone and this stretch.
    doubts : tuple of str
        What a check says of this channel of the run.
    """

    condition: str
    run: str
    excerpt: Excerpt
    marked: MarkedOrder | None
    sweeps: bool
    choice: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Listening:
    """The sound of a campaign.

    Parameters
    ----------
    sounds : tuple of ConditionSound
        In the campaign's order of conditions.
    left_out : tuple of (str, str)
        Conditions without an excerpt, and why.
    """

    sounds: tuple[ConditionSound, ...] = ()
    left_out: tuple[tuple[str, str], ...] = ()


def _rms(samples: Single) -> float:
    return float(np.sqrt(np.mean(np.square(samples, dtype=np.float64)))) if samples.size else 0.0
